//! How measurements are judged: bounds, error bars, and the error that would have been seen.
//!
//! Random quantities are compared at 4.9 standard errors (a right program fails with chance 1e-6) and every comparison also
//! demands its power: the bias that a test at these standard errors sees with a chance of 98 % must not exceed a stated share.

use crate::estimate::Estimate;
use crate::row::{Measure, Outcome, Picture, Verdict};
use irradiant::image::{FileFormat, Image, Pixels, ToneCurve, ToneOptions, to_srgb8, write};
use irradiant_testkit::{Mean, Tiles};

/// Standard errors that a right program exceeds with chance 1e-6.
pub const SIGMAS: f64 = 4.9;

/// What a row has found so far.
#[derive(Default)]
pub struct Sheet {
    measures: Vec<Measure>,
    pictures: Vec<Picture>,
    notes: Vec<String>,
    commands: Vec<String>,
}

/// Four significant digits, or an exponent where the number is very large or small.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || !x.is_finite() {
        format!("{x}")
    } else if !(1e-3..1e5).contains(&size) {
        format!("{x:.2e}")
    } else {
        let decimals = (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{x:.decimals$}")
    }
}

fn percent(x: f64) -> String {
    format!("{} %", number(100.0 * x))
}

/// Pixels across that a picture is enlarged to, at least, if that takes no more than [`MOST`] times.
const WIDE: usize = 400;
const MOST: usize = 6;

/// A small coded picture with each pixel repeated, so that it can be seen where it is shown as it is.
fn enlarged(coded: Image) -> Image {
    let (w, h, channels) = (coded.width(), coded.height(), coded.channel_count());
    let times = WIDE.div_ceil(w.max(1)).min(MOST);
    let Pixels::U8(samples) = coded.pixels() else { return coded };
    let mut large = Vec::with_capacity(samples.len() * times * times);
    for row in samples.chunks(w * channels) {
        let wide: Vec<u8> =
            row.chunks(channels).flat_map(|pixel| std::iter::repeat_n(pixel, times).flatten().copied()).collect();
        (0..times).for_each(|_| large.extend_from_slice(&wide));
    }
    let names: Vec<&str> = coded.channels().iter().map(String::as_str).collect();
    Image::from_u8(w * times, h * times, &names, large, coded.encoding()).unwrap_or(coded)
}

impl Sheet {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    fn push(&mut self, what: &str, value: String, bound: String, detectable: String, passes: bool) {
        self.measures.push(Measure { what: what.into(), value, bound, detectable, passes, of_speed: false });
    }

    /// Two independent pictures estimate the same thing: every channel's mean, and every tile, within noise, where a bias of
    /// the share `power` of the mean would have been seen.
    pub fn agree(&mut self, what: &str, a: &Estimate, b: &Estimate, power: f64) {
        let (mut worst, mut detectable) = (0.0f64, 0.0f64);
        let mut failed_tiles = 0;
        for (c, (x, y)) in a.total().into_iter().zip(b.total()).enumerate() {
            let se = x.1.hypot(y.1);
            let off = ((x.0 - y.0).abs() - 2e-6 * y.0.abs()).max(0.0);
            worst = worst.max(if off == 0.0 { 0.0 } else { off / se });
            detectable = detectable.max((SIGMAS + 2.0) * se / y.0.abs());
            let of = |e: &Estimate| -> (Vec<f64>, Vec<f64>) {
                (e.mean.iter().map(|p| p[c]).collect(), e.variance.iter().map(|p| p[c]).collect())
            };
            let ((ia, va), (ib, vb)) = (of(a), of(b));
            let tiles =
                Tiles { width: a.width, a: &ia, variance_a: &va, b: &ib, variance_b: &vb, tile: 8, slack: 2e-6 };
            failed_tiles += tiles.compare(1e-6).map_or(1, |r| r.failed.len());
        }
        self.push(
            what,
            format!("{:.2} standard errors apart, {failed_tiles} tiles off", worst),
            format!("{SIGMAS} standard errors, no tile off (1e-6)"),
            format!("a bias of {} (must be below {})", percent(detectable), percent(power)),
            worst <= SIGMAS && failed_tiles == 0 && detectable <= power,
        );
    }

    /// A picture's mean is a known number.
    pub fn is(&mut self, what: &str, a: &Estimate, expected: f64, power: f64) {
        let (mut worst, mut detectable, mut value) = (0.0f64, 0.0f64, expected);
        for (mean, se) in a.total() {
            // f32 transport rounds by some 1e-6.
            let off = ((mean - expected).abs() - 1e-5 * expected.abs()).max(0.0);
            let z = if off == 0.0 { 0.0 } else { off / se };
            if z >= worst {
                (worst, value) = (z, mean);
            }
            detectable = detectable.max((SIGMAS + 2.0) * se / expected.abs());
        }
        self.push(
            what,
            format!("{} for {}: {worst:.2} standard errors", number(value), number(expected)),
            format!("{SIGMAS} standard errors"),
            format!("a bias of {} (must be below {})", percent(detectable.max(1e-5)), percent(power)),
            worst <= SIGMAS && detectable <= power,
        );
    }

    /// A mean is a known number.
    pub fn mean_is(&mut self, what: &str, mean: &Mean, expected: f64, power: f64) {
        let off = ((mean.mean() - expected).abs() - 1e-5 * expected.abs()).max(0.0);
        let z = if off == 0.0 { 0.0 } else { off / mean.standard_error() };
        let detectable = (SIGMAS + 2.0) * mean.standard_error() / expected.abs();
        self.push(
            what,
            format!("{} for {}: {z:.2} standard errors", number(mean.mean()), number(expected)),
            format!("{SIGMAS} standard errors"),
            format!("a bias of {} (must be below {})", percent(detectable.max(1e-5)), percent(power)),
            z <= SIGMAS && detectable <= power,
        );
    }

    /// Two means agree.
    pub fn means_agree(&mut self, what: &str, a: &Mean, b: &Mean, power: f64) {
        let se = a.standard_error().hypot(b.standard_error());
        let off = ((a.mean() - b.mean()).abs() - 1e-5 * b.mean().abs()).max(0.0);
        let z = if off == 0.0 { 0.0 } else { off / se };
        let detectable = (SIGMAS + 2.0) * se / b.mean().abs();
        self.push(
            what,
            format!("{} and {}: {z:.2} standard errors apart", number(a.mean()), number(b.mean())),
            format!("{SIGMAS} standard errors"),
            format!("a bias of {} (must be below {})", percent(detectable), percent(power)),
            z <= SIGMAS && detectable <= power,
        );
    }

    /// A number is at most `bound`.
    pub fn at_most(&mut self, what: &str, value: f64, bound: f64) {
        self.push(what, number(value), format!("at most {}", number(bound)), "anything above".into(), value <= bound);
    }

    /// A goal of speed: at most so many seconds on this machine. What is slower is no error, and the row says so.
    pub fn seconds_at_most(&mut self, what: &str, seconds: f64, goal: f64) {
        self.push(what, number(seconds), format!("at most {}", number(goal)), "anything above".into(), seconds <= goal);
        self.measures.iter_mut().last().into_iter().for_each(|m| m.of_speed = true);
    }

    /// A number is at least `bound`.
    pub fn at_least(&mut self, what: &str, value: f64, bound: f64) {
        self.push(what, number(value), format!("at least {}", number(bound)), "anything below".into(), value >= bound);
    }

    /// A number lies between two others, which say what error would be seen.
    pub fn between(&mut self, what: &str, value: f64, [low, high]: [f64; 2]) {
        let passes = low <= value && value <= high;
        self.push(
            what,
            number(value),
            format!("{} to {}", number(low), number(high)),
            format!("a deviation of {}", number(0.5 * (high - low))),
            passes,
        );
    }

    /// A number is another within a relative tolerance.
    pub fn close(&mut self, what: &str, value: f64, expected: f64, tolerance: f64) {
        let off = (value / expected - 1.0).abs();
        self.push(
            what,
            format!("{} for {}", number(value), number(expected)),
            format!("within {}", percent(tolerance)),
            format!("an error of {}", percent(tolerance)),
            off <= tolerance,
        );
    }

    /// Something is so or is not; `seen` says what would have shown.
    pub fn holds(&mut self, what: &str, value: impl Into<String>, bound: &str, seen: &str, passes: bool) {
        self.push(what, value.into(), bound.into(), seen.into(), passes);
    }

    /// Several numbers, none of which can be off: counted, and the first few named.
    pub fn none_of(&mut self, what: &str, of: usize, wrong: &[String]) {
        let value = match wrong.first() {
            None => format!("none of {of}"),
            Some(first) => format!("{} of {of}: {first}", wrong.len()),
        };
        self.push(what, value, "none".into(), "a single one".into(), wrong.is_empty() && of > 0);
    }

    /// A picture from linear pixels, brightened by `exposure` stops.
    pub fn picture(&mut self, name: &str, caption: &str, image: &Image, exposure: f32) {
        let options = ToneOptions { exposure, curve: ToneCurve::None, dither: true };
        let encoded = to_srgb8(image, &options).and_then(|coded| {
            let large = enlarged(coded);
            Ok((large.width(), large.height(), write(&large, FileFormat::Png)?))
        });
        match encoded {
            Ok((width, height, png)) => {
                self.pictures.push(Picture { name: name.into(), caption: caption.into(), width, height, png });
            }
            Err(why) => {
                self.holds(&format!("picture {name}"), format!("{why}"), "can be written", "any failure", false);
            }
        }
    }

    /// A picture that is coded for display already (a drawing).
    pub fn drawing(&mut self, name: &str, caption: &str, image: &Image) {
        if let Ok(png) = write(image, FileFormat::Png) {
            let (width, height) = (image.width(), image.height());
            self.pictures.push(Picture { name: name.into(), caption: caption.into(), width, height, png });
        }
    }

    /// A remark.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    /// A command that shows it with the program.
    pub fn command(&mut self, text: impl Into<String>) {
        self.commands.push(text.into());
    }

    /// Whether a measure is out of its bound.
    pub fn has_failed(&self) -> bool {
        self.measures.iter().any(|m| !m.passes)
    }

    /// All measured: the row passes when each measure does. A row that measured nothing fails.
    pub fn finish(self) -> Outcome {
        let failed = self.measures.iter().filter(|m| !m.passes);
        let failed = failed.map(|m| match m.of_speed {
            true => format!(
                "not met: {} s on this machine, the goal is {} (speed, not correctness): {}",
                m.value, m.bound, m.what
            ),
            false => format!("{}: {}; bound: {}", m.what, m.value, m.bound),
        });
        let failed: Vec<String> = failed.collect();
        let verdict = if self.measures.is_empty() {
            Verdict::Fails("nothing was measured".into())
        } else if failed.is_empty() {
            Verdict::Passes
        } else {
            Verdict::Fails(failed.join("; "))
        };
        Outcome {
            verdict,
            measures: self.measures,
            pictures: self.pictures,
            notes: self.notes,
            commands: self.commands,
            seconds: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_only_slow_says_so_and_what_is_wrong_too_does_not() {
        let mut slow = Sheet::new();
        slow.at_most("error", 0.5, 1.0);
        slow.seconds_at_most("seconds for it", 7.25, 6.0);
        let mut wrong = Sheet::new();
        wrong.at_most("error", 2.0, 1.0);
        wrong.seconds_at_most("seconds for it", 7.25, 6.0);
        let mut met = Sheet::new();
        met.seconds_at_most("seconds for it", 5.0, 6.0);
        let (slow, wrong, met) = (slow.finish(), wrong.finish(), met.finish());
        assert!(slow.is_only_slow() && !wrong.is_only_slow() && !met.is_only_slow());
        let Verdict::Fails(why) = slow.verdict else { panic!("a goal that is not met does not pass") };
        assert!(why.starts_with("not met: 7.250 s on this machine") && why.contains("speed, not correctness"), "{why}");
        assert_eq!(met.verdict, Verdict::Passes);
    }

    #[test]
    fn small_pictures_are_enlarged_pixel_by_pixel_and_large_ones_kept() {
        let mut sheet = Sheet::new();
        for (name, width) in [("tiny", 3), ("strip", 150), ("large", 640)] {
            let image = Image::from_fn(width, 2, ["R", "G", "B"], |x, y| [x as f32 / width as f32, y as f32, 0.5]);
            sheet.picture(name, "", &image, 0.0);
        }
        let sizes: Vec<_> = sheet.pictures.iter().map(|p| (p.width, p.height)).collect();
        assert_eq!(sizes, [(18, 12), (450, 6), (640, 2)]);
        let coded = Image::from_u8(2, 1, &["Y"], vec![7, 200], irradiant::image::Encoding::Srgb).expect("an image");
        let Pixels::U8(samples) = enlarged(coded).into_pixels() else { panic!("codes") };
        assert_eq!(samples, [[7; 6], [200; 6]].concat().repeat(6));
    }
}
