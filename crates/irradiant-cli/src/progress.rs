//! How far a render is: a bar on a terminal, plain lines elsewhere, nothing when asked for quiet.

use crate::say::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use irradiant::renderer::Progress;
use std::io::IsTerminal;
use std::time::Duration;

/// Shows progress on standard error.
pub enum Reporter {
    /// Nothing.
    Quiet,
    /// A bar.
    Bar(ProgressBar),
    /// A line now and then.
    Lines {
        /// The next fraction to report.
        next: f64,
        /// When the last line was printed.
        last: Duration,
    },
}

const RESOLUTION: u64 = 10_000;

impl Reporter {
    /// For this terminal and wish.
    pub fn new(quiet: bool) -> Self {
        if quiet {
            return Self::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { next: 0.1, last: Duration::ZERO };
        }
        let bar = ProgressBar::with_draw_target(Some(RESOLUTION), ProgressDrawTarget::stderr_with_hz(10));
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3}%  {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self::Bar(bar)
    }

    /// True when an estimate of the noise will be shown soon (it costs a pass over the film).
    pub fn wants_noise(&self) -> bool {
        !matches!(self, Self::Quiet)
    }

    /// Shows where it is.
    ///
    /// The noise is `None` while most pixels have fewer than two samples: nothing can be said then.
    pub fn update(&mut self, progress: &Progress, noise: Option<f64>) {
        let text = || {
            let left = progress.time_left().map_or("?".into(), short_time);
            let noise = noise.map_or("-".into(), |n| format!("{:.2} %", 100.0 * n));
            format!("{}/s  noise {noise}  {left} left", short_count(progress.rate()))
        };
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => {
                bar.set_position((progress.fraction() * RESOLUTION as f64) as u64);
                bar.set_message(text());
            }
            Self::Lines { next, last } => {
                let due = progress.elapsed.saturating_sub(*last) > Duration::from_secs(30);
                if (progress.fraction() >= *next && progress.fraction() < 1.0) || due {
                    say!("{:3.0} %  {}", 100.0 * progress.fraction(), text());
                    *last = progress.elapsed;
                    while *next <= progress.fraction() {
                        *next += 0.1;
                    }
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// 12.3 M and the like.
pub fn short_count(n: f64) -> String {
    match n {
        n if n >= 1e9 => format!("{:.2} G", n / 1e9),
        n if n >= 1e6 => format!("{:.2} M", n / 1e6),
        n if n >= 1e3 => format!("{:.1} k", n / 1e3),
        n => format!("{n:.0} "),
    }
}

/// 5 s, 3 m 20 s, 2 h 5 m.
pub fn short_time(t: Duration) -> String {
    let s = t.as_secs();
    match s {
        0..60 => format!("{:.1} s", t.as_secs_f64()),
        60..3600 => format!("{} m {} s", s / 60, s % 60),
        _ => format!("{} h {} m", s / 3600, s % 3600 / 60),
    }
}
