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
