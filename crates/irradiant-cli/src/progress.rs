//! How far a render is: a bar on a terminal, plain lines elsewhere, nothing when asked for quiet.

use crate::say::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use irradiant::renderer::Progress;
use std::io::IsTerminal;
use std::time::Duration;

/// Shows progress on standard error.
pub struct Reporter {
    /// Before each line; empty for the render itself.
    what: &'static str,
    form: Form,
}

enum Form {
    /// Nothing.
    Quiet,
    /// A bar.
    Bar {
        bar: ProgressBar,
        /// The noise when it was last asked for (it costs a pass over the film), and when that was.
        noise: Option<f64>,
        asked: Option<Duration>,
    },
    /// A line now and then.
    Lines(Lines),
}

/// When the next line is due.
struct Lines {
    /// The next fraction to report.
    next: f64,
    /// When the last line was printed.
    last: Duration,
}

const RESOLUTION: u64 = 10_000;
/// Of the noise on the bar.
const ASK_AGAIN: Duration = Duration::from_secs(2);
/// Lines come at each tenth of the work, but not more often than this...
const LEAST_PAUSE: Duration = Duration::from_secs(2);
/// ...nor less often than this.
const MOST_PAUSE: Duration = Duration::from_secs(30);

impl Lines {
    /// Whether to say something now; if so the next line comes later.
    fn is_due(&mut self, fraction: f64, elapsed: Duration) -> bool {
        let pause = elapsed.saturating_sub(self.last);
        let due = pause >= MOST_PAUSE || pause >= LEAST_PAUSE && fraction >= self.next && fraction < 1.0;
        if due {
            self.last = elapsed;
            while self.next <= fraction {
                self.next += 0.1;
            }
        }
        due
    }
}

impl Reporter {
    /// For this terminal and wish; `what` stands before each line.
    pub fn new(quiet: bool, what: &'static str) -> Self {
        if quiet {
            return Self { what, form: Form::Quiet };
        }
        if !std::io::stderr().is_terminal() {
            return Self { what, form: Form::Lines(Lines { next: 0.1, last: Duration::ZERO }) };
        }
        let bar = ProgressBar::with_draw_target(Some(RESOLUTION), ProgressDrawTarget::stderr_with_hz(10));
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3}%  {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { what, form: Form::Bar { bar, noise: None, asked: None } }
    }

    /// Shows where it is. `noise` is asked when it will be shown, and not more often than it is worth.
    pub fn update(&mut self, progress: &Progress, noise_now: impl FnOnce() -> Option<f64>) {
        let text = |noise: Option<f64>| {
            let left = progress.time_left().map_or("?".into(), short_time);
            let noise = noise.map_or(String::new(), |n| format!("noise {:.2} %  ", 100.0 * n));
            format!("{}/s  {noise}{left} left", short_count(progress.rate()))
        };
        match &mut self.form {
            Form::Quiet => {}
            Form::Bar { bar, noise, asked } => {
                if asked.is_none_or(|asked| progress.elapsed.saturating_sub(asked) > ASK_AGAIN) {
                    (*noise, *asked) = (noise_now(), Some(progress.elapsed));
                }
                bar.set_position((progress.fraction() * RESOLUTION as f64) as u64);
                bar.set_message(format!("{}{}", self.what, text(*noise)));
            }
            Form::Lines(lines) => {
                if lines.is_due(progress.fraction(), progress.elapsed) {
                    say!("{}{:3.0} %  {}", self.what, 100.0 * progress.fraction(), text(noise_now()));
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Form::Bar { bar, .. } = &self.form {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of the lines of a render that takes so many seconds, asked for each tenth of a second.
    fn lines_of(seconds: u32) -> Vec<f64> {
        let mut lines = Lines { next: 0.1, last: Duration::ZERO };
        let tenths = 1..=10 * seconds;
        let due = tenths.filter(|&i| {
            lines.is_due(f64::from(i) / f64::from(10 * seconds), Duration::from_millis(100 * u64::from(i)))
        });
        due.map(|i| f64::from(i) / 10.0).collect()
    }

    #[test]
    fn lines_are_neither_many_nor_far_between() {
        assert!(lines_of(1).is_empty());
        assert!(lines_of(5).len() <= 2, "{:?}", lines_of(5));
        assert_eq!(lines_of(100).len(), 9, "{:?}", lines_of(100));
        let long = lines_of(3600);
        assert!(long.windows(2).all(|pair| pair[1] - pair[0] < 60.0), "{long:?}");
    }
}
