//! Pictures as plain floats, and how far they are from the truth.

use irradiant_image::{ReadOptions, ResizeFilter, ToneOptions, read_file, to_srgb8, write_jpeg};
use std::path::Path;

/// Linear RGB, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Interleaved.
    pub rgb: Vec<f32>,
}

impl Picture {
    /// Reads a file of any known kind.
    pub fn read(path: &Path) -> Result<Self, String> {
        let fail = |e: String| format!("{}: {e}", path.display());
        let image = read_file(path, &ReadOptions::default()).map_err(|e| fail(e.to_string()))?;
        let rgb = image.to_rgb().ok_or_else(|| fail("not a colour picture".into()))?;
        Ok(Self { width: rgb.width(), height: rgb.height(), rgb: rgb.to_f32() })
    }

    /// The mean of pictures of one size; `None` of none.
    pub fn mean(pictures: &[Self]) -> Option<Self> {
        let first = pictures.first()?;
        let mut sum = vec![0.0f64; first.rgb.len()];
        for picture in pictures {
            sum.iter_mut().zip(&picture.rgb).for_each(|(s, &x)| *s += f64::from(x));
        }
        let rgb = sum.iter().map(|s| (s / pictures.len() as f64) as f32).collect();
        Some(Self { rgb, ..*first })
    }

    /// Mean of each channel over the pixels that count.
    pub fn average(&self, mask: &Mask) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (_, pixel) in self.rgb.chunks_exact(3).enumerate().filter(|(i, _)| mask.counts(*i)) {
            sum.iter_mut().zip(pixel).for_each(|(s, &x)| *s += f64::from(x));
        }
        sum.map(|s| s / mask.len() as f64)
    }
}

/// A picture of any kind at half its size, to look at: clipped, sRGB, JPEG.
pub fn write_half_size(from: &Path, to: &Path, exposure: f32) -> Result<(), String> {
    let image = read_file(from, &ReadOptions::default()).map_err(|e| format!("{}: {e}", from.display()))?;
    let half =
        image.resize(image.width() / 2, image.height() / 2, ResizeFilter::Box).ok_or("a picture without pixels")?;
    let tone = ToneOptions { exposure, ..ToneOptions::default() };
    let bytes = to_srgb8(&half, &tone).and_then(|p| write_jpeg(&p, 85)).map_err(|e| e.to_string())?;
    std::fs::write(to, bytes).map_err(|e| format!("{}: {e}", to.display()))
}

/// Which pixels count.
#[derive(Clone, Debug)]
pub struct Mask {
    counts: Vec<bool>,
    len: usize,
}

impl Mask {
    /// All but the pixels where a picture without any scattering has light: those see a lamp or the sky.
    pub fn without_lamps(emission: &Picture) -> Self {
        let counts: Vec<bool> = emission.rgb.chunks_exact(3).map(|p| p.iter().all(|&x| x == 0.0)).collect();
        let len = counts.iter().filter(|&&c| c).count();
        Self { counts, len }
    }

    /// Whether the pixel of this index counts.
    pub fn counts(&self, pixel: usize) -> bool {
        self.counts[pixel]
    }

    /// How many pixels count.
    pub fn len(&self) -> usize {
        self.len
    }
}

/// Side of the blocks of [`Truth::relative_error_of_blocks`], pixels.
pub const BLOCK: usize = 8;

/// The truth, estimated twice, so that the noise of the reference does not count as error of the picture.
pub struct Truth {
    first: Picture,
    second: Picture,
    mean: Picture,
    mask: Mask,
    epsilon: f64,
}

impl Truth {
    /// Of two independent, unbiased, well converged pictures; `None` if they or the mask differ in size.
    pub fn new(first: Picture, second: Picture, mask: Mask) -> Option<Self> {
        let size = |p: &Picture| (p.width, p.height);
        if size(&first) != size(&second) || mask.counts.len() * 3 != first.rgb.len() {
            return None;
        }
        let mean = Picture::mean(&[first.clone(), second.clone()])?;
        let level = mean.average(&mask).iter().sum::<f64>() / 3.0;
        Some(Self { first, second, mean, mask, epsilon: 0.01 * level * level })
    }

    /// Which pixels count.
    pub fn mask(&self) -> &Mask {
        &self.mask
    }

    /// Mean of the reference over the pixels that count.
    pub fn average(&self) -> [f64; 3] {
        self.mean.average(&self.mask)
    }

    /// relMSE: the mean over pixels and channels of (x - r)^2 / (r^2 + 0.01 mean(r)^2), nothing trimmed.
    ///
    /// (x - r)^2 is estimated by (x - r1)(x - r2), whose expectation does not depend on the noise of r1 and r2. That of the
    /// denominator remains: with references of relative variance s it adds some 1.5 s^2, and some 2 s of a bias of the picture.
    pub fn relative_error(&self, picture: &Picture) -> f64 {
        self.over_pixels(|i| {
            let x = f64::from(picture.rgb[i]);
            (x - f64::from(self.first.rgb[i])) * (x - f64::from(self.second.rgb[i]))
        })
    }

    /// As [`Truth::relative_error`], of means over blocks of [`BLOCK`] by [`BLOCK`] pixels that all count: what is left of the error where one
    /// looks at more than single pixels.
    pub fn relative_error_of_blocks(&self, picture: &Picture) -> f64 {
        let (mut sum, mut blocks) = (0.0, 0);
        let (width, height) = (picture.width, picture.height);
        for top in (0..height / BLOCK).map(|y| y * BLOCK) {
            for left in (0..width / BLOCK).map(|x| x * BLOCK) {
                let pixels = || (0..BLOCK * BLOCK).map(|i| (top + i / BLOCK) * width + left + i % BLOCK);
                if !pixels().all(|pixel| self.mask.counts(pixel)) {
                    continue;
                }
                blocks += 1;
                for c in 0..3 {
                    let of = |p: &Picture| {
                        pixels().map(|pixel| f64::from(p.rgb[3 * pixel + c])).sum::<f64>() / (BLOCK * BLOCK) as f64
                    };
                    let x = of(picture);
                    let square = (x - of(&self.first)) * (x - of(&self.second));
                    sum += square / (of(&self.mean).powi(2) + self.epsilon);
                }
            }
        }
        sum / f64::from(3 * blocks)
    }

    /// What [`Truth::relative_error`] would be of unbiased pictures that scatter as these do: it needs no reference.
    /// `None` of fewer than two pictures.
    pub fn scatter(&self, pictures: &[Picture]) -> Option<f64> {
        let mean = Picture::mean(pictures)?;
        let n = pictures.len() as f64;
        (pictures.len() > 1).then(|| {
            self.over_pixels(|i| {
                let square = |p: &Picture| (f64::from(p.rgb[i]) - f64::from(mean.rgb[i])).powi(2);
                pictures.iter().map(square).sum::<f64>() / (n - 1.0)
            })
        })
    }

    /// The two estimates compared: ratio of their means, channel by channel, and their relMSE to each other.
    pub fn agreement(&self) -> ([f64; 3], f64) {
        let (a, b) = (self.first.average(&self.mask), self.second.average(&self.mask));
        let apart = self.over_pixels(|i| (f64::from(self.first.rgb[i]) - f64::from(self.second.rgb[i])).powi(2));
        (std::array::from_fn(|c| a[c] / b[c]), apart)
    }

    fn over_pixels(&self, square: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for i in (0..self.mean.rgb.len()).filter(|i| self.mask.counts(i / 3)) {
            sum += square(i) / (f64::from(self.mean.rgb[i]).powi(2) + self.epsilon);
        }
        sum / (3 * self.mask.len()) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::random;

    fn noisy(level: f32, amplitude: f32, salt: u64) -> Picture {
        let noise = |i| level + amplitude * (random(i, salt) - 0.5);
        Picture { width: 100, height: 100, rgb: (0..30_000).map(noise).collect() }
    }

    fn dark() -> Picture {
        Picture { width: 100, height: 100, rgb: vec![0.0; 30_000] }
    }

    #[test]
    fn noise_of_the_reference_is_not_error_of_the_picture() {
        let truth = Truth::new(noisy(2.0, 0.5, 1), noisy(2.0, 0.5, 2), Mask::without_lamps(&dark())).unwrap();
        // Uniform noise of width 1 has variance 1/12; the denominator is 4 (1 + 0.01), give or take the noise of r.
        let expected = 1.0 / 12.0 / 4.04;
        let found = truth.relative_error(&noisy(2.0, 1.0, 3));
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
        let found = truth.scatter(&[noisy(2.0, 1.0, 4), noisy(2.0, 1.0, 5), noisy(2.0, 1.0, 6)]).unwrap();
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
        // A picture that is 10 % too bright and has no noise: 0.04 / 4.04.
        let truth = Truth::new(noisy(2.0, 0.1, 1), noisy(2.0, 0.1, 2), Mask::without_lamps(&dark())).unwrap();
        let found = truth.relative_error(&noisy(2.2, 0.0, 0));
        assert!((found / (0.04 / 4.04) - 1.0).abs() < 0.02, "{found}");
    }

    #[test]
    fn noise_of_single_pixels_is_gone_from_blocks_and_bias_is_not() {
        let truth = Truth::new(noisy(2.0, 0.5, 1), noisy(2.0, 0.5, 2), Mask::without_lamps(&dark())).unwrap();
        let expected = 1.0 / 12.0 / 4.04 / (BLOCK * BLOCK) as f64;
        let found = truth.relative_error_of_blocks(&noisy(2.0, 1.0, 3));
        assert!((found / expected - 1.0).abs() < 0.3, "{found} {expected}");
        let found = truth.relative_error_of_blocks(&noisy(2.2, 0.0, 0));
        assert!((found / (0.04 / 4.04) - 1.0).abs() < 0.02, "{found}");
    }

    #[test]
    fn pixels_that_see_a_lamp_do_not_count() {
        let mut lamps = dark();
        lamps.rgb[30 * 3 + 1] = 5.0;
        let mask = Mask::without_lamps(&lamps);
        assert_eq!(mask.len(), 9_999);
        let truth = Truth::new(noisy(1.0, 0.0, 0), noisy(1.0, 0.0, 0), mask).unwrap();
        let mut picture = noisy(1.0, 0.0, 0);
        picture.rgb[30 * 3] = 1e6;
        assert_eq!(truth.relative_error(&picture), 0.0);
        picture.rgb[31 * 3] = 2.0;
        assert!(truth.relative_error(&picture) > 0.0);
    }
}
