//! What paths from lights bring to pixels that nobody asked about: a plane of sums of its own beside the pixels.
//!
//! A sample adds to its own pixel only; the path from a light that belongs to it may reach any pixel of the film. A
//! work unit therefore lists what it brings ([`FilmTile::splat`](super::FilmTile::splat)), and the film adds up the lists:
//! exact sums again, so their order does not matter. Each sample traces one path from a light, refused samples too, so a
//! pixel's part from such paths is its sum over the number of *all* samples of the film, whatever pixel they belong to.
//! This holds at any time: a render that was stopped early is divided by what it has.

use super::exact::{ExactSum, SquareSum};

/// Light that a path from a light brings to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Splat {
    pub x: i32,
    pub y: i32,
    pub rgb: [f32; 3],
}

/// Sums over what paths from lights bring to one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SplatPixel {
    /// Linear RGB of the film's colour space, times the film's number of samples over its pixels.
    radiance: [ExactSum; 3],
    squares: [SquareSum; 3],
    /// Squares out of range: the error bar is unknown.
    square_overflow: u32,
}

impl SplatPixel {
    pub(super) fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.radiance[c] += other.radiance[c];
            self.squares[c] += other.squares[c];
        }
        self.square_overflow += other.square_overflow;
    }
}

/// The plane of a film, one for each of its pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SplatPlane {
    pixels: Vec<SplatPixel>,
    /// Of all pixels together: what was refused, being not finite or beyond the range of the sums.
    not_finite: u64,
    out_of_range: u64,
}

impl SplatPlane {
    pub fn new(n_pixels: usize) -> Self {
        Self { pixels: vec![SplatPixel::default(); n_pixels], not_finite: 0, out_of_range: 0 }
    }

    pub fn add(&mut self, index: usize, rgb: [f32; 3]) {
        let pixel = &mut self.pixels[index];
        let [Some(r), Some(g), Some(b)] = rgb.map(ExactSum::quantised) else {
            if rgb.iter().all(|x| x.is_finite()) {
                self.out_of_range += 1;
            } else {
                self.not_finite += 1;
            }
            return;
        };
        pixel.radiance[0] += r;
        pixel.radiance[1] += g;
        pixel.radiance[2] += b;
        let mut in_range = true;
        for (sum, x) in pixel.squares.iter_mut().zip(rgb) {
            in_range &= sum.add(x);
        }
        pixel.square_overflow += u32::from(!in_range);
    }

    pub fn merge(&mut self, other: &Self) {
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            a.merge(b);
        }
        self.not_finite += other.not_finite;
        self.out_of_range += other.out_of_range;
    }

    /// Splats refused: not finite, out of range.
    pub fn refused(&self) -> [u64; 2] {
        [self.not_finite, self.out_of_range]
    }

    /// The mean and the variance of that mean of a pixel's part, over `n` paths from lights.
    pub fn estimate(&self, index: usize, n: u64) -> SplatEstimate {
        let pixel = &self.pixels[index];
        let n = n.max(1) as f64;
        let mean = pixel.radiance.map(|sum| sum.value() / n);
        let variance = std::array::from_fn(|c| {
            if pixel.square_overflow > 0 {
                return f64::INFINITY;
            }
            if n < 2.0 {
                return 0.0;
            }
            ((pixel.squares[c].value() / n - mean[c] * mean[c]) / (n - 1.0)).max(0.0)
        });
        SplatEstimate { mean, variance }
    }
}

/// What paths from lights make of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SplatEstimate {
    /// To be added to the pixel's mean.
    pub mean: [f64; 3],
    /// Of `mean`, as if paths were independent; infinite when unknown.
    pub variance: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::super::{DevelopOptions, Film, FilmTile, PixelBounds};
    use super::*;

    const BOUNDS: PixelBounds = PixelBounds { x0: 2, y0: 1, x1: 5, y1: 4 };

    fn unit(x: i32, samples: u32, splats: &[(i32, i32, [f32; 3])]) -> FilmTile {
        let mut tile = FilmTile::new(PixelBounds { x0: x, x1: x + 1, ..BOUNDS }, 0);
        for y in BOUNDS.y0..BOUNDS.y1 {
            for _ in 0..samples {
                tile.add(x, y, [0.5; 3], &[]);
            }
        }
        for &(x, y, rgb) in splats {
            tile.splat(x, y, rgb);
        }
        tile
    }

    fn film(tiles: &[FilmTile]) -> Film {
        let mut film = Film::new([8, 8], BOUNDS, vec![]);
        tiles.iter().for_each(|t| film.merge_tile(t));
        film
    }

    #[test]
    fn any_order_and_grouping_of_work_gives_the_same_film() {
        let tiles = [
            unit(2, 1, &[(4, 3, [0.1, 1e-7, 3e5]), (2, 1, [0.3; 3])]),
            unit(3, 1, &[]),
            unit(4, 1, &[(4, 3, [0.7, 12.5, -0.25]), (4, 3, [1.0 / 3.0; 3])]),
        ];
        let [a, b, c] = tiles.clone();
        let forwards = film(&tiles);
        assert_eq!(forwards, film(&[c.clone(), a.clone(), b.clone()]));
        let mut merged = film(&[b]);
        merged.merge(&film(&[c, a])).unwrap();
        assert_eq!(forwards, merged);
        assert!(forwards != film(&tiles[..2]));
    }

    #[test]
    fn a_pixels_part_is_over_the_samples_of_the_whole_film_at_any_time() {
        // 9 pixels; one column has 2 samples each, one 4, one none: 18 paths from lights.
        let film = film(&[unit(2, 2, &[(4, 2, [9.0, 0.0, 0.0]), (9, 2, [1.0; 3])]), unit(3, 4, &[(4, 2, [18.0; 3])])]);
        let part = film.splat_estimate(4, 2);
        assert_eq!(part.mean, [1.5, 1.0, 1.0]);
        // 18 draws, all 0 but one of 9 and one of 18.
        let sum: f64 = (81.0 + 324.0) / 18.0 - 1.5 * 1.5;
        assert!((part.variance[0] - sum / 17.0).abs() < 1e-12);
        let image = film.develop(DevelopOptions::default());
        assert_eq!([0, 1, 2].map(|x| image.get(x, 1, 0)), [0.5, 0.5, 1.5]);
        assert_eq!(image.get(2, 0, 0), 0.0);
        let error = film.develop(DevelopOptions { standard_error: true, variance: true });
        let at = error.channels().iter().position(|c| *c == "SE.R").unwrap();
        assert!((f64::from(error.get(2, 1, at)) - part.variance[0].sqrt()).abs() < 1e-6);
    }

    #[test]
    fn films_without_paths_from_lights_have_no_plane() {
        let plain = film(&[unit(2, 1, &[])]);
        assert_eq!(plain.splat_estimate(2, 1), SplatEstimate::default());
        assert!(!plain.has_splats());
        assert!(film(&[unit(2, 1, &[(2, 1, [0.0; 3])])]).has_splats());
    }

    #[test]
    fn what_is_refused_is_counted() {
        let film = film(&[unit(2, 1, &[(2, 1, [f32::NAN, 0.0, 0.0]), (2, 1, [1e30; 3]), (3, 1, [6.0; 3])])]);
        let totals = film.totals();
        assert_eq!((totals.samples, totals.not_finite, totals.out_of_range), (3, 1, 1));
        assert_eq!(film.splat_estimate(2, 1).mean, [0.0; 3]);
        assert_eq!(film.splat_estimate(3, 1).mean, [2.0; 3]);
    }
}
