//! Many samples added to a tile, whose numbers are rounded side by side.

use super::FilmTile;
use super::exact::{SQUARE_LIMIT, sample_words, square_words};
use irradiant_math::lanes::{Triples, WHOLE};

/// Low and high words of a vector's worth of samples.
type Words = [[u64; WHOLE]; 2];

impl FilmTile {
    /// Adds samples as [`FilmTile::add`] does, to the bit, in a film without layers: to each of `pixels` that of its lane. Those of a pixel that
    /// follow each other are added together. The lanes of those that are refused are put into `refused`.
    #[inline(always)]
    pub fn add_lanes(&mut self, pixels: &[[i32; 2]], rgb: &Triples, refused: &mut Vec<usize>) {
        debug_assert_eq!(self.channels_per_pixel, 0);
        let channels = [&rgb.x, &rgb.y, &rgb.z];
        let (mut samples, mut squares): ([Words; 3], [Words; 3]) = ([[[0; WHOLE]; 2]; 3], [[[0; WHOLE]; 2]; 3]);
        for first in (0..pixels.len()).step_by(WHOLE) {
            let mut is_plain = true;
            for c in 0..3 {
                let (samples, squares) = (&mut samples[c], &mut squares[c]);
                for k in 0..WHOLE {
                    let x = channels[c][first + k];
                    [samples[0][k], samples[1][k]] = sample_words(x);
                    [squares[0][k], squares[1][k]] = square_words(x);
                    is_plain &= x.abs() < SQUARE_LIMIT;
                }
            }
            let pixels = &pixels[first..pixels.len().min(first + WHOLE)];
            if !is_plain {
                for (k, [x, y]) in pixels.iter().enumerate() {
                    if !self.add(*x, *y, channels.map(|channel| channel[first + k]), &[]) {
                        refused.push(first + k);
                    }
                }
                continue;
            }
            let mut begin = 0;
            while begin < pixels.len() {
                let [x, y] = pixels[begin];
                let count = pixels[begin..].iter().take_while(|pixel| **pixel == [x, y]).count();
                let index = self.index(x, y);
                let pixel = &mut self.pixels[index];
                for c in 0..3 {
                    // Whole vectors by loops of a known length.
                    if count == WHOLE {
                        pixel.radiance[c].add_words(&samples[c], 0..WHOLE);
                        pixel.squares[c].add_words(&squares[c], 0..WHOLE);
                    } else {
                        pixel.radiance[c].add_words(&samples[c], begin..begin + count);
                        pixel.squares[c].add_words(&squares[c], begin..begin + count);
                    }
                }
                pixel.count += count as u32;
                begin += count;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelBounds;
    use crate::film::exact::SAMPLE_LIMIT;
    use crate::geometry::{Kernel, Level};
    use irradiant_testkit::Rng;

    struct Add<'a>(&'a mut FilmTile, &'a [[i32; 2]], &'a Triples, &'a mut Vec<usize>);

    impl Kernel for Add<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.0.add_lanes(self.1, self.2, self.3);
        }
    }

    // Runs of all lengths; numbers of all magnitudes and both signs, at the limits, and some that are refused: as one at a time.
    #[test]
    fn lanes_add_what_single_samples_do() {
        let bounds = PixelBounds { x0: 3, y0: -2, x1: 7, y1: 1 };
        let special = [
            0.0,
            -0.0,
            f32::MIN_POSITIVE,
            -1e-44,
            (-40f32).exp2(),
            -(-41f32).exp2() * 1.5,
            (-64f32).exp2(),
            (-65f32).exp2(),
            -1.0,
            SQUARE_LIMIT.next_down(),
            SQUARE_LIMIT,
            -SAMPLE_LIMIT.next_down(),
            SAMPLE_LIMIT,
            f32::NAN,
            f32::NEG_INFINITY,
        ];
        let mut rng = Rng::new(3);
        for round in 0..300 {
            let n = [240, 239, 16, 5, 0][round % 5];
            // Half of the rounds have only numbers that go side by side.
            let specials = if round % 2 == 0 { 9 } else { special.len() };
            let mut rgb = Triples::ZERO;
            for i in 0..n {
                let mut number = || {
                    if rng.next_f32() < 0.02 {
                        special[(rng.next_f32() * specials as f32) as usize]
                    } else {
                        (90.0 * rng.next_f32() - 70.0).exp2() * (rng.next_f32() - 0.3)
                    }
                };
                rgb.set(i, [number(), number(), number()]);
            }
            let mut pixel = [3, -2];
            let pixels: Vec<[i32; 2]> = (0..n)
                .map(|_| {
                    if rng.next_f32() < [0.0, 0.03, 0.5][round % 3] {
                        pixel = [3 + (4.0 * rng.next_f32()) as i32, -2 + (3.0 * rng.next_f32()) as i32];
                    }
                    pixel
                })
                .collect();
            let mut expected = (FilmTile::new(bounds, 0), Vec::new());
            for (i, [x, y]) in pixels.iter().enumerate() {
                if !expected.0.add(*x, *y, [rgb.x[i], rgb.y[i], rgb.z[i]], &[]) {
                    expected.1.push(i);
                }
            }
            for level in Level::available() {
                let mut found = (FilmTile::new(bounds, 0), Vec::new());
                level.run(Add(&mut found.0, &pixels, &rgb, &mut found.1));
                assert!(found == expected, "{level:?}, round {round}");
            }
        }
    }
}
