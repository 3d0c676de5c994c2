//! Samples in parts: a sample's radiance as the sum of what single paths carry, each rounded once and added to the picture
//! and to every layer that shows it, so that layers add up to the picture to the last bit.

use super::exact::{ExactSum, SAMPLE_LIMIT};
use super::{FilmTile, Pixel};

/// The parts of one sample. Storage is kept from sample to sample.
#[derive(Clone, Debug, Default)]
pub struct SampleParts {
    /// Weighted radiance of each, linear RGB of the film's colour space.
    rgb: Vec<[f32; 3]>,
    /// One past the last of each part's `channels`.
    ends: Vec<u32>,
    /// Of layers that show the part: the first of three channels.
    channels: Vec<u32>,
}

impl SampleParts {
    /// No parts: the sample is black.
    pub fn clear(&mut self) {
        self.rgb.clear();
        self.ends.clear();
        self.channels.clear();
    }

    /// Adds a part, which belongs to the layers whose first channels (of a pixel's) these are.
    pub fn push(&mut self, rgb: [f32; 3], first_channels: impl IntoIterator<Item = u32>) {
        self.rgb.push(rgb);
        self.channels.extend(first_channels);
        self.ends.push(self.channels.len() as u32);
    }
}

impl Pixel {
    /// Adds a sample that is rounded already; `false` when its magnitude is out of range (and counted).
    fn add_rounded(&mut self, rgb: [ExactSum; 3]) -> bool {
        let values = rgb.map(|c| c.value() as f32);
        if values.iter().any(|v| v.abs() >= SAMPLE_LIMIT) {
            self.out_of_range += 1;
            return false;
        }
        let mut in_range = true;
        for c in 0..3 {
            self.radiance[c] += rgb[c];
            in_range &= self.squares[c].add(values[c]);
        }
        self.square_overflow += u32::from(!in_range);
        self.count += 1;
        true
    }
}

impl FilmTile {
    /// Adds a sample in parts to a pixel and its layers; `layers` are the channels of the other layers, which come first
    /// (see [`FilmTile::add`]). The sample is refused as a whole, and counted, when any part is not finite or out of range.
    pub fn add_parts(&mut self, x: i32, y: i32, parts: &SampleParts, layers: &[f32]) -> bool {
        let i = self.index(x, y);
        let mut total = [ExactSum::default(); 3];
        for rgb in &parts.rgb {
            let [Some(r), Some(g), Some(b)] = rgb.map(ExactSum::quantised) else {
                // Refused and counted by the rules for whole samples.
                return self.pixels[i].add(*rgb);
            };
            total[0] += r;
            total[1] += g;
            total[2] += b;
        }
        if !self.pixels[i].add_rounded(total) {
            return false;
        }
        let at = i * self.channels_per_pixel;
        let sums = &mut self.layers[at..at + self.channels_per_pixel];
        for (sum, &value) in sums.iter_mut().zip(layers) {
            let _ = sum.add(value);
        }
        let mut start = 0;
        for (rgb, &end) in parts.rgb.iter().zip(&parts.ends) {
            for &first in &parts.channels[start as usize..end as usize] {
                for c in 0..3 {
                    let _ = sums[first as usize + c].add(rgb[c]);
                }
            }
            start = end;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Film, Layer, PixelBounds};
    use super::*;

    #[test]
    fn layers_add_up_to_the_picture_to_the_last_bit_and_refused_samples_leave_both() {
        let bounds = PixelBounds { x0: 0, y0: 0, x1: 1, y1: 1 };
        let paths = |name: &str| Layer::Paths { name: name.into(), expression: String::new() };
        let mut film = Film::new([1, 1], bounds, vec![Layer::Uv, paths("a"), paths("b")]);
        let mut tile = FilmTile::new(bounds, film.channels_per_pixel());
        let mut parts = SampleParts::default();
        let mut refused = 0;
        for i in 0..1000u32 {
            parts.clear();
            for k in 0..i % 7 {
                let x = (i * 31 + k * 17) as f32 * 1.7e-5;
                let x = if i % 100 == 55 && k == 3 { f32::INFINITY } else { x };
                parts.push([x, x * 0.3, x * 1e-12], [if (i + k) % 3 == 0 { 2 } else { 5 }]);
            }
            refused += u32::from(!tile.add_parts(0, 0, &parts, &[0.5, 0.25]));
        }
        film.merge_tile(&tile);
        let pixel = film.pixel(0, 0);
        assert!(refused > 0 && (pixel.count, pixel.not_finite) == (1000 - refused, refused));
        for c in 0..3 {
            let mut sum = film.layer_sums(0, 0, 1)[c];
            sum += film.layer_sums(0, 0, 2)[c];
            assert_eq!(sum, pixel.radiance[c]);
        }
        assert_eq!(film.layer_sums(0, 0, 0)[0].value(), 0.5 * f64::from(pixel.count));
        assert!(pixel.variance()[0] > 0.0);
    }

    #[test]
    fn a_sample_whose_parts_are_in_range_and_whose_sum_is_not_is_refused() {
        let bounds = PixelBounds { x0: 0, y0: 0, x1: 1, y1: 1 };
        let mut tile = FilmTile::new(bounds, 0);
        let mut parts = SampleParts::default();
        for _ in 0..2 {
            parts.push([SAMPLE_LIMIT * 0.75, 0.0, 0.0], []);
        }
        assert!(!tile.add_parts(0, 0, &parts, &[]));
        assert_eq!((tile.pixel(0, 0).count, tile.pixel(0, 0).out_of_range), (0, 1));
    }
}
