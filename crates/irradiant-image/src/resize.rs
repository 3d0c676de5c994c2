//! Resampling to another size.
//!
//! Separable; each output sample is a normalised weighted sum of input samples, in linear light.

use crate::encoding::Encoding;
use crate::image::{Image, PixelFormat};
use crate::wrap::WrapMode;

/// The kernel of [`Image::resize`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResizeFilter {
    /// Mean over the area that an output pixel covers: exact energy, no ringing.
    Box,
    /// Lanczos of three lobes: sharp, may overshoot below 0 and above 1.
    Lanczos,
}

/// The input samples that make up one output sample: the first's index (may lie outside) and the weights.
struct Taps {
    first: i64,
    weights: Vec<f32>,
}

impl Image {
    /// The picture at another size, in the same storage; edges are continued outwards by clamping.
    ///
    /// `None` if either picture is empty.
    pub fn resize(&self, width: usize, height: usize, filter: ResizeFilter) -> Option<Self> {
        if width == 0 || height == 0 || self.width() == 0 || self.height() == 0 {
            return None;
        }
        let across = taps(self.width(), width, filter);
        let down = taps(self.height(), height, filter);
        let samples = resample(&self.to_f32(), [self.width(), self.height()], self, &across, &down, WrapMode::Clamp);
        let mut resized = self.with_samples(width, height, &samples, self.format(), self.encoding());
        // The old windows counted old pixels.
        resized.metadata.origin = [0, 0];
        resized.metadata.display_window = None;
        Some(resized)
    }
}

fn taps(old: usize, new: usize, filter: ResizeFilter) -> Vec<Taps> {
    let scale = old as f64 / new as f64;
    let make = |index: usize| match filter {
        ResizeFilter::Box => {
            let (from, to) = (index as f64 * scale, (index + 1) as f64 * scale);
            let first = from.floor() as i64;
            let last = (to.ceil() as i64).max(first + 1);
            let covered = |texel: i64| ((texel + 1) as f64).min(to) - (texel as f64).max(from);
            normalised(first, (first..last).map(covered).collect())
        }
        ResizeFilter::Lanczos => {
            let stretch = scale.max(1.0);
            let centre = (index as f64 + 0.5) * scale;
            let first = (centre - 3.0 * stretch + 0.5).floor() as i64;
            let last = (centre + 3.0 * stretch + 0.5).floor() as i64;
            let weight = |texel: i64| windowed_sinc((texel as f64 + 0.5 - centre) / stretch, 3.0, 3.0);
            normalised(first, (first..last).map(weight).collect())
        }
    };
    (0..new).map(make).collect()
}

fn normalised(first: i64, weights: Vec<f64>) -> Taps {
    let sum: f64 = weights.iter().sum();
    Taps { first, weights: weights.iter().map(|weight| (weight / sum) as f32).collect() }
}

/// sinc(x) times the window sinc(x / tau), 0 beyond `radius`.
fn windowed_sinc(x: f64, radius: f64, tau: f64) -> f64 {
    let sinc = |x: f64| {
        let angle = std::f64::consts::PI * x;
        if angle.abs() < 1e-9 { 1.0 } else { libm::sin(angle) / angle }
    };
    if x.abs() > radius { 0.0 } else { sinc(x) * sinc(x / tau) }
}

fn resample(
    samples: &[f32],
    [width, height]: [usize; 2],
    image: &Image,
    across: &[Taps],
    down: &[Taps],
    wrap: WrapMode,
) -> Vec<f32> {
    let count = image.channel_count();
    let (new_width, new_height) = (across.len(), down.len());
    // Octahedral folds couple rows and columns, so every sample is looked up by both coordinates.
    let row_of = |y: i64, output: &mut [f32]| {
        for (taps, output) in across.iter().zip(output.chunks_exact_mut(count)) {
            output.fill(0.0);
            for (offset, &weight) in taps.weights.iter().enumerate() {
                let x = (taps.first + offset as i64) as i32;
                if let Some((x, y)) = wrap.remap(x, y as i32, width as i32, height as i32) {
                    let texel = &samples[(y * width + x) * count..][..count];
                    for (sum, &value) in output.iter_mut().zip(texel) {
                        *sum += weight * value;
                    }
                }
            }
        }
    };
    let row = new_width * count;
    let lowest = down.first().map_or(0, |taps| taps.first);
    let highest = down.iter().map(|taps| taps.first + taps.weights.len() as i64).max().unwrap_or(0);
    let mut rows = vec![0.0; row * (highest - lowest).max(0) as usize];
    for (index, output) in rows.chunks_exact_mut(row).enumerate() {
        row_of(lowest + index as i64, output);
    }
    let mut result = vec![0.0f32; row * new_height];
    for (taps, output) in down.iter().zip(result.chunks_exact_mut(row)) {
        for (offset, &weight) in taps.weights.iter().enumerate() {
            let from = (taps.first - lowest) as usize + offset;
            for (sum, &value) in output.iter_mut().zip(&rows[from * row..(from + 1) * row]) {
                *sum += weight * value;
            }
        }
    }
    result
}

/// Linear floats of the picture enlarged as pbrt-v4 enlarges textures to powers of two: Lanczos of two lobes over
/// four texels, wrapped, and never below 0.
pub(crate) fn enlarge(image: &Image, width: usize, height: usize, wrap: WrapMode) -> Image {
    let lobes = |old: usize, new: usize| -> Vec<Taps> {
        (0..new)
            .map(|index| {
                let centre = (index as f64 + 0.5) * old as f64 / new as f64;
                let first = (centre - 2.0 + 0.5).floor() as i64;
                let weight = |texel: i64| windowed_sinc(texel as f64 + 0.5 - centre, 2.0, 2.0);
                normalised(first, (first..first + 4).map(weight).collect())
            })
            .collect()
    };
    let (across, down) = (lobes(image.width(), width), lobes(image.height(), height));
    let mut samples = resample(&image.to_f32(), [image.width(), image.height()], image, &across, &down, wrap);
    for value in &mut samples {
        *value = value.max(0.0);
    }
    image.with_samples(width, height, &samples, PixelFormat::F32, Encoding::Linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Image {
        Image::from_fn(30, 21, ["R", "G"], |x, y| [((x * 31 + y * 17) % 13) as f32, x as f32])
    }

    #[test]
    fn boxes_keep_the_energy() {
        for (width, height) in [(10, 7), (7, 5), (30, 21), (60, 84), (1, 1)] {
            let small = picture().resize(width, height, ResizeFilter::Box).unwrap();
            for (a, b) in picture().average().iter().zip(small.average()) {
                assert!((a - b).abs() < 1e-5 * a, "{width} x {height}: {a} {b}");
            }
        }
        assert_eq!(picture().resize(30, 21, ResizeFilter::Box).unwrap(), picture());
    }

    #[test]
    fn lanczos_keeps_ramps_and_constants() {
        let ramp = picture().resize(60, 42, ResizeFilter::Lanczos).unwrap();
        for x in 12..48 {
            assert!((ramp.get(x, 20, 1) - (x as f32 - 0.5) / 2.0).abs() < 0.02, "{x} {}", ramp.get(x, 20, 1));
        }
        let flat = Image::from_fn(13, 9, ["Y"], |_, _| [0.7]).resize(5, 23, ResizeFilter::Lanczos).unwrap();
        assert!(flat.to_f32().iter().all(|value| (value - 0.7).abs() < 1e-6));
        assert!(picture().resize(0, 3, ResizeFilter::Lanczos).is_none());
    }
}
