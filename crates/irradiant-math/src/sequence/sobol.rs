//! Sobol's sequence in base 2.
//!
//! Sobol 1967, with the direction numbers of Joe and Kuo 2008. The first two dimensions form a (0, 2)-sequence: each
//! aligned block of 2^m points has one point in each elementary interval of area 2^-m.

use super::sobol_directions::{INITIAL, POLYNOMIALS};

/// How many dimensions there are.
pub const N_SOBOL_DIMENSIONS: usize = POLYNOMIALS.len();

/// Index bits that count; higher ones are ignored.
const COLUMNS: usize = 52;

/// Column k of each dimension's generator matrix: the first 32 bits of the point with index 2^k, top bit first.
static MATRICES: [[u32; COLUMNS]; N_SOBOL_DIMENSIONS] = generate();

const fn generate() -> [[u32; COLUMNS]; N_SOBOL_DIMENSIONS] {
    let mut matrices = [[0; COLUMNS]; N_SOBOL_DIMENSIONS];
    let mut dimension = 0;
    while dimension < N_SOBOL_DIMENSIONS {
        let columns = columns(dimension);
        let mut k = 0;
        while k < COLUMNS {
            matrices[dimension][k] = (columns[k] >> 32) as u32;
            k += 1;
        }
        dimension += 1;
    }
    matrices
}

/// The columns of one dimension as 64-bit fractions, by Bratley and Fox's recurrence (1988).
const fn columns(dimension: usize) -> [u64; COLUMNS] {
    let mut v = [0u64; COLUMNS];
    let (polynomial, start) = POLYNOMIALS[dimension];
    let mut k = 0;
    if dimension == 0 {
        while k < COLUMNS {
            v[k] = 1 << (63 - k);
            k += 1;
        }
        return v;
    }
    let degree = 15 - polynomial.leading_zeros() as usize;
    while k < COLUMNS {
        if k < degree {
            v[k] = (INITIAL[start as usize + k] as u64) << (63 - k);
        } else {
            let mut x = v[k - degree] ^ (v[k - degree] >> degree);
            let mut i = 1;
            while i < degree {
                if polynomial >> (degree - i) & 1 == 1 {
                    x ^= v[k - i];
                }
                i += 1;
            }
            v[k] = x;
        }
        k += 1;
    }
    v
}

/// Coordinate `dimension` (below [`N_SOBOL_DIMENSIONS`]) of point `index`, as a 32-bit fraction.
#[inline]
pub fn sobol(index: u32, dimension: usize) -> u32 {
    match dimension {
        0 => index.reverse_bits(),
        1 => second_dimension(index),
        _ => multiply(&MATRICES[dimension], index as u64),
    }
}

/// As [`sobol`](fn@sobol), for indices up to 2^52.
#[inline]
pub fn sobol_64(index: u64, dimension: usize) -> u32 {
    multiply(&MATRICES[dimension], index)
}

#[inline]
fn multiply(matrix: &[u32; COLUMNS], mut index: u64) -> u32 {
    index &= (1 << COLUMNS) - 1;
    let mut v = 0;
    while index != 0 {
        v ^= matrix[index.trailing_zeros() as usize];
        index &= index - 1;
    }
    v
}

/// The second dimension is Pascal's triangle modulo 2: five shift-and-mask steps on the reversed index (after Ahmed 2024,
/// "An implementation algorithm of 2D Sobol sequence fast, elegant, and compact").
#[inline]
const fn second_dimension(index: u32) -> u32 {
    let mut v = index.reverse_bits();
    v ^= (v & 0x5555_5555) << 1;
    v ^= (v & 0x3333_3333) << 2;
    v ^= (v & 0x0f0f_0f0f) << 4;
    v ^= (v & 0x00ff_00ff) << 8;
    v ^ (v & 0x0000_ffff) << 16
}

/// For the first four dimensions at once: entry [j][n] is the xor of the columns of the set bits of nibble n at place j.
/// 2 KB, which stays in the first-level cache where byte tables (16 KB) would push other things out.
static NIBBLES: [[[u32; 4]; 16]; 8] = nibbles(false);

/// The same for an index and points whose bits are reversed, as Owen scrambling wants both.
pub(super) static REVERSED_NIBBLES: [[[u32; 4]; 16]; 8] = nibbles(true);

const fn nibbles(reversed: bool) -> [[[u32; 4]; 16]; 8] {
    let mut table = [[[0; 4]; 16]; 8];
    let mut dimension = 0;
    while dimension < 4 {
        let columns = columns(dimension);
        let mut bit = 0;
        while bit < 32 {
            let column = (columns[bit] >> 32) as u32;
            let place = if reversed { 31 - bit } else { bit };
            let mut n = 0;
            while n < 16 {
                if n >> (place % 4) & 1 == 1 {
                    table[place / 4][n][dimension] ^= if reversed { column.reverse_bits() } else { column };
                }
                n += 1;
            }
            bit += 1;
        }
        dimension += 1;
    }
    table
}

/// What each bit of a reversed index contributes to the reversed coordinates 2 and 3.
pub(super) const REVERSED_COLUMNS: [[u32; 32]; 2] = [reversed_columns(2), reversed_columns(3)];

const fn reversed_columns(dimension: usize) -> [u32; 32] {
    let columns = columns(dimension);
    let mut reversed = [0; 32];
    let mut bit = 0;
    while bit < 32 {
        reversed[31 - bit] = ((columns[bit] >> 32) as u32).reverse_bits();
        bit += 1;
    }
    reversed
}

#[inline(always)]
pub(super) fn look_up(table: &[[[u32; 4]; 16]; 8], index: u32) -> [u32; 4] {
    let mut v = [0; 4];
    for (j, row) in table.iter().enumerate() {
        let entry = row[(index >> (4 * j) & 15) as usize];
        for d in 0..4 {
            v[d] ^= entry[d];
        }
    }
    v
}

/// The first four coordinates of point `index`, as 32-bit fractions.
#[inline]
pub fn sobol_4d(index: u32) -> [u32; 4] {
    look_up(&NIBBLES, index)
}

/// Finds the points of one Sobol sequence over an image that fall into a given pixel.
///
/// On a grid of 2^m by 2^m pixels, each consecutive 4^m points put exactly one into each pixel (in dimensions 0 and 1).
/// Gruenschloss, Raab and Keller 2012, "Enumerating quasi-Monte Carlo point sequences in elementary intervals".
#[derive(Clone, Debug)]
pub struct SobolPixels {
    log2_size: u32,
    // Row-reduced: which index bits to flip to flip bit i of (x << m | y).
    inverse: Vec<u64>,
}

impl SobolPixels {
    /// For a grid of 2^`log2_size` pixels a side; `None` above 2^16.
    pub fn new(log2_size: u32) -> Option<Self> {
        if log2_size > 16 {
            return None;
        }
        let bits = 2 * log2_size;
        // Gauss-Jordan over GF(2): each row pairs a pixel pattern with the index bits that make it.
        let mut rows: Vec<(u64, u64)> = (0..bits).map(|k| (Self::pattern(log2_size, 1 << k), 1u64 << k)).collect();
        for bit in 0..bits as usize {
            let pivot = (bit..rows.len()).find(|r| rows[*r].0 >> bit & 1 == 1)?;
            rows.swap(bit, pivot);
            let (pattern, index) = rows[bit];
            for (r, row) in rows.iter_mut().enumerate() {
                if r != bit && row.0 >> bit & 1 == 1 {
                    *row = (row.0 ^ pattern, row.1 ^ index);
                }
            }
        }
        Some(Self { log2_size, inverse: rows.into_iter().map(|r| r.1).collect() })
    }

    /// The pixel of point `index`, as x << m | y.
    fn pattern(log2_size: u32, index: u64) -> u64 {
        let top = |d: usize| (sobol_64(index, d) as u64) << log2_size >> 32;
        top(0) << log2_size | top(1)
    }

    /// The index of the `frame`-th point in pixel (x, y), which must lie on the grid. Indices must stay below 2^52.
    pub fn index(&self, frame: u64, x: u32, y: u32) -> u64 {
        debug_assert!(x >> self.log2_size == 0 && y >> self.log2_size == 0);
        let high = frame << (2 * self.log2_size);
        let mut wanted = ((x as u64) << self.log2_size | y as u64) ^ Self::pattern(self.log2_size, high);
        let mut index = high;
        while wanted != 0 {
            index ^= self.inverse[wanted.trailing_zeros() as usize];
            wanted &= wanted - 1;
        }
        index
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_points_are_the_published_ones() {
        // From SciPy 1.x's qmc.Sobol (an independent implementation of the same numbers), its Gray code undone.
        let expected = [
            (0, 0x8d167b50),
            (1, 0xd0a67d30),
            (2, 0x90010a50),
            (5, 0x7afd1170),
            (17, 0x89110a30),
            (63, 0xee619650),
            (100, 0x85139930),
            (255, 0x48b94730),
        ];
        expected.iter().for_each(|(d, v)| assert_eq!(sobol(182347953, *d), *v, "{d}"));
        // By hand, from the m values.
        assert!((0..N_SOBOL_DIMENSIONS).all(|d| sobol(1, d) == 1 << 31 && sobol(0, d) == 0));
        let quarters: Vec<u32> = (0..8).map(|d| sobol(2, d) >> 30).collect();
        assert_eq!(quarters, [1, 3, 3, 3, 1, 1, 3, 1]);
        let eighths: Vec<u32> = (0..4).map(|d| sobol(4, d) >> 29).collect();
        assert_eq!(eighths, [1, 5, 3, 1]);
    }

    #[test]
    fn fast_forms_agree_with_the_matrices() {
        for i in (0..200_000u32).chain((0..200).map(|i| u32::MAX - i * 12_345_678)) {
            let v = sobol_4d(i);
            for d in 0..4 {
                assert_eq!(v[d], multiply(&MATRICES[d], i as u64));
                assert_eq!(v[d], sobol(i, d));
            }
            let r = look_up(&REVERSED_NIBBLES, i.reverse_bits());
            assert_eq!(r.map(u32::reverse_bits), v);
        }
    }

    #[test]
    fn every_dimension_is_stratified_in_each_power_of_two() {
        for d in 0..N_SOBOL_DIMENSIONS {
            for block in [0u32, 5] {
                let mut seen = [false; 1024];
                (0..1024).for_each(|i| seen[(sobol(block * 1024 + i, d) >> 22) as usize] = true);
                assert!(seen.iter().all(|s| *s), "{d}");
            }
        }
    }

    #[test]
    fn the_first_two_dimensions_are_a_net() {
        for m in 0..=10 {
            for split in 0..=m {
                let mut seen = vec![false; 1 << m];
                for i in 0..1u32 << m {
                    let (x, y) = (sobol((3 << m) + i, 0) as u64, sobol((3 << m) + i, 1) as u64);
                    seen[((x << split >> 32) << (m - split) | (y << (m - split) >> 32)) as usize] = true;
                }
                assert!(seen.iter().all(|s| *s), "{m} {split}");
            }
        }
    }

    #[test]
    fn pixels_find_their_points() {
        for m in [0, 1, 3, 7] {
            let pixels = SobolPixels::new(m).unwrap();
            for (x, y) in [(0, 0), (1, 2), (5, 7), (100, 37)].map(|(x, y)| (x & ((1 << m) - 1), y & ((1 << m) - 1))) {
                for frame in [0, 1, 2, 63, 1000] {
                    let i = pixels.index(frame, x, y);
                    assert_eq!(i >> (2 * m), frame);
                    let at = |d| (sobol_64(i, d) as u64) << m >> 32;
                    assert_eq!((at(0), at(1)), (x as u64, y as u64), "{m} {x} {y} {frame}");
                }
            }
        }
        assert!(SobolPixels::new(17).is_none() && SobolPixels::new(16).is_some());
    }
}
