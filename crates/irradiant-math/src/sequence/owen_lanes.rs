//! The blocks of many samples side by side: [`owen_sobol_4d`](super::owen_sobol_4d) without tables, which vectors would have to look up
//! lane by lane.
//!
//! 8 ns a whole block with AVX-512, 12 ns with AVX2, where one at a time takes 20 to 40 ns (Xeon 4th generation, a busy machine).

use super::laine_karras;
use super::owen::block_seeds;
use super::sobol::REVERSED_COLUMNS;
use crate::hash::{mix32, unit_f32};
use crate::lanes::{Floats, LANES, whole};

/// For each of `n` lanes what [`owen_sobol_4d_of_reversed`](super::owen_sobol_4d_of_reversed) gives, to the bit, for its seed mixed with
/// `block`. Of the third and the fourth numbers only those that are `asked` for, which take most of the time; what was there stays.
#[inline(always)]
pub fn owen_sobol_4d_lanes(
    n: usize,
    reversed_indices: &[u32; LANES],
    seeds: &[u32; LANES],
    block: u32,
    asked: [bool; 2],
    out: &mut [Floats; 4],
) {
    match asked {
        [false, false] => lanes::<false, false>(n, reversed_indices, seeds, block, out),
        [false, true] => lanes::<false, true>(n, reversed_indices, seeds, block, out),
        [true, false] => lanes::<true, false>(n, reversed_indices, seeds, block, out),
        [true, true] => lanes::<true, true>(n, reversed_indices, seeds, block, out),
    }
}

#[inline(always)]
fn lanes<const THIRD: bool, const FOURTH: bool>(
    n: usize,
    reversed_indices: &[u32; LANES],
    seeds: &[u32; LANES],
    block: u32,
    out: &mut [Floats; 4],
) {
    let block = block.wrapping_mul(0x9e37_79b9);
    for i in whole(n) {
        let seeds = block_seeds(mix32(seeds[i] ^ block));
        let v = laine_karras(reversed_indices[i], seeds[4]);
        // The first reversed coordinate is the index itself, the second Pascal's triangle times it; see `owen_sobol_2d`.
        let x = reversed(v);
        let y = x ^ (x >> 1 & 0x5555_5555);
        let y = y ^ (y >> 2 & 0x3333_3333);
        let y = y ^ (y >> 4 & 0x0f0f_0f0f);
        let y = y ^ (y >> 8 & 0x00ff_00ff);
        let y = y ^ y >> 16;
        let point = |v, seed| unit_f32(reversed(laine_karras(v, seed)));
        (out[0][i], out[1][i]) = (point(x, seeds[0]), point(y, seeds[1]));
        if THIRD {
            out[2][i] = point(multiplied(v, &REVERSED_COLUMNS[0]), seeds[2]);
        }
        if FOURTH {
            out[3][i] = point(multiplied(v, &REVERSED_COLUMNS[1]), seeds[3]);
        }
    }
}

/// The xor of the columns of the set bits.
#[inline(always)]
fn multiplied(v: u32, columns: &[u32; 32]) -> u32 {
    // Eight at a time, so that they are unrolled before loops are made into vector code.
    eight(v, columns, 0) ^ eight(v, columns, 8) ^ eight(v, columns, 16) ^ eight(v, columns, 24)
}

#[inline(always)]
fn eight(v: u32, columns: &[u32; 32], first: usize) -> u32 {
    let mut sum = 0;
    for k in 0..8 {
        let is_set = ((v << (31 - (first + k))) as i32 >> 31) as u32;
        sum ^= is_set & columns[first + k];
    }
    sum
}

/// `reverse_bits` in steps that vectors have.
#[inline(always)]
fn reversed(x: u32) -> u32 {
    let x = x.rotate_left(16);
    let x = x >> 8 & 0x00ff_00ff | (x & 0x00ff_00ff) << 8;
    let x = x >> 4 & 0x0f0f_0f0f | (x & 0x0f0f_0f0f) << 4;
    let x = x >> 2 & 0x3333_3333 | (x & 0x3333_3333) << 2;
    x >> 1 & 0x5555_5555 | (x & 0x5555_5555) << 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::Pcg32;
    use crate::sequence::owen_sobol_4d_of_reversed;

    #[test]
    fn lanes_have_the_bits_of_single_blocks() {
        let mut rng = Pcg32::new(7, 7);
        for block in 0..50u32 {
            let indices: [u32; LANES] = std::array::from_fn(|i| if i % 3 == 0 { i as u32 } else { rng.next_u32() });
            let seeds: [u32; LANES] = std::array::from_fn(|_| rng.next_u32());
            for asked in [[false, false], [false, true], [true, false], [true, true]] {
                let mut out = [[-1.0; LANES]; 4];
                owen_sobol_4d_lanes(LANES, &indices, &seeds, block, asked, &mut out);
                for i in 0..LANES {
                    let seed = mix32(seeds[i] ^ block.wrapping_mul(0x9e37_79b9));
                    let [a, b, c, d] = owen_sobol_4d_of_reversed(indices[i], seed);
                    let expected = [a, b, if asked[0] { c } else { -1.0 }, if asked[1] { d } else { -1.0 }];
                    assert_eq!([0, 1, 2, 3].map(|d| out[d][i]), expected, "{block} {i} {asked:?}");
                }
            }
        }
    }
}
