//! Owen scrambling by hash, and scrambled Sobol blocks.
//!
//! Owen 1995: flipping each bit by a random function of the bits above it keeps every net a net and makes its points
//! unbiased. Laine and Karras 2011 do that with a hash on reversed bits in which bits only ever influence higher ones;
//! the constants are Vegdahl's (2021, "Building a better LK hash"), as in pbrt-v4's `FastOwenScrambler`. Blocks of padded
//! dimensions with shuffled indices follow Burley 2020, "Practical hash-based Owen scrambling", JCGT 9(4).

use super::sobol::{REVERSED_NIBBLES, look_up};
use crate::hash::{mix64, unit_f32};

/// The hash at the heart: each output bit depends on the input bits at and below it. For reversed fractions.
#[inline(always)]
pub const fn laine_karras(mut v: u32, seed: u32) -> u32 {
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul(seed >> 16 | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^ v.wrapping_mul(0x53a2_2864)
}

/// Owen-scrambles a 32-bit fraction; equal seeds scramble equally. Mix the seed well beforehand.
#[inline]
pub const fn nested_uniform_scramble_base2(v: u32, seed: u32) -> u32 {
    laine_karras(v.reverse_bits(), seed).reverse_bits()
}

/// Independent seeds for the index shuffle (entry 4) and the dimensions of a block, by two 64-bit mixes.
#[inline(always)]
pub(super) const fn block_seeds(seed: u32) -> [u32; 5] {
    let a = mix64(seed as u64 ^ 0x9e37_79b9_7f4a_7c15);
    let b = mix64(a.wrapping_add(0xd1b5_4a32_d192_ed03));
    // The fifth from both, so that it equals neither part of either.
    [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32, (a.wrapping_mul(b | 1) >> 32) as u32]
}

/// [`laine_karras`] of four words together, in stages, so that the compiler may use vector registers.
#[inline(always)]
fn laine_karras_4(v: [u32; 4], seeds: [u32; 4]) -> [u32; 4] {
    let v = v.map(|x| x ^ x.wrapping_mul(0x3d20_adea));
    let v: [u32; 4] = std::array::from_fn(|d| v[d].wrapping_add(seeds[d]));
    let v: [u32; 4] = std::array::from_fn(|d| v[d].wrapping_mul(seeds[d] >> 16 | 1));
    let v = v.map(|x| x ^ x.wrapping_mul(0x0552_6c56));
    v.map(|x| x ^ x.wrapping_mul(0x53a2_2864))
}

/// Reverses the bits of four words together; in stages, so that the compiler may use vector registers.
#[inline(always)]
fn reverse_bits_4(v: [u32; 4]) -> [u32; 4] {
    let v = v.map(|x| x.rotate_left(16));
    let v = v.map(|x| x >> 8 & 0x00ff_00ff | (x & 0x00ff_00ff) << 8);
    let v = v.map(|x| x >> 4 & 0x0f0f_0f0f | (x & 0x0f0f_0f0f) << 4);
    let v = v.map(|x| x >> 2 & 0x3333_3333 | (x & 0x3333_3333) << 2);
    v.map(|x| x >> 1 & 0x5555_5555 | (x & 0x5555_5555) << 1)
}

/// Four dimensions of point `index` of an Owen-scrambled, index-shuffled Sobol sequence, as 32-bit fractions.
///
/// Different seeds give independent blocks, which is how more than four dimensions are padded. 10 to 20 ns.
#[inline]
pub fn owen_sobol_4d_bits(index: u32, seed: u32) -> [u32; 4] {
    bits_of_reversed(index.reverse_bits(), seed)
}

#[inline(always)]
fn bits_of_reversed(reversed_index: u32, seed: u32) -> [u32; 4] {
    let seeds = block_seeds(seed);
    // The shuffle is itself an Owen scramble of the index, which keeps aligned blocks together. The tables take reversed
    // indices and give reversed points, so that no reversal is wasted.
    let v = look_up(&REVERSED_NIBBLES, laine_karras(reversed_index, seeds[4]));
    let scrambled = laine_karras_4(v, [seeds[0], seeds[1], seeds[2], seeds[3]]);
    reverse_bits_4(scrambled)
}

/// [`owen_sobol_4d_bits`] as numbers in [0, 1).
#[inline]
pub fn owen_sobol_4d(index: u32, seed: u32) -> [f32; 4] {
    owen_sobol_4d_bits(index, seed).map(unit_f32)
}

/// [`owen_sobol_4d`] of the index whose reversed bits these are, for asking for many blocks of one index.
#[inline]
pub fn owen_sobol_4d_of_reversed(reversed_index: u32, seed: u32) -> [f32; 4] {
    bits_of_reversed(reversed_index, seed).map(unit_f32)
}

/// The first of [`owen_sobol_4d`]'s dimensions, alone.
#[inline]
pub fn owen_sobol_1d(index: u32, seed: u32) -> f32 {
    // Dimension 0 reversed is the index itself.
    let seeds = block_seeds(seed);
    let shuffled = nested_uniform_scramble_base2(index, seeds[4]);
    unit_f32(laine_karras(shuffled, seeds[0]).reverse_bits())
}

/// The first two of [`owen_sobol_4d`]'s dimensions, alone.
#[inline]
pub fn owen_sobol_2d(index: u32, seed: u32) -> [f32; 2] {
    let seeds = block_seeds(seed);
    let shuffled = nested_uniform_scramble_base2(index, seeds[4]);
    // Dimension 1 reversed: Pascal's triangle modulo 2, the shifts mirrored.
    let mut y = shuffled;
    y ^= y >> 1 & 0x5555_5555;
    y ^= y >> 2 & 0x3333_3333;
    y ^= y >> 4 & 0x0f0f_0f0f;
    y ^= y >> 8 & 0x00ff_00ff;
    y ^= y >> 16;
    [unit_f32(laine_karras(shuffled, seeds[0]).reverse_bits()), unit_f32(laine_karras(y, seeds[1]).reverse_bits())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix32;
    use irradiant_testkit::{Mean, chi2_counts};

    #[test]
    fn scrambling_keeps_prefixes_and_is_a_bijection() {
        for seed in [0, 1, 0x1234_5678, u32::MAX].map(mix32) {
            for bits in 1..=12 {
                let mut seen = vec![false; 1 << bits];
                for i in 0..1u32 << bits {
                    let v = i << (32 - bits);
                    let (a, b) =
                        (nested_uniform_scramble_base2(v, seed), nested_uniform_scramble_base2(v | 0x3ff, seed));
                    // Low bits never change high ones.
                    assert_eq!(a >> 12, b >> 12);
                    seen[(a >> (32 - bits)) as usize] = true;
                }
                assert!(seen.iter().all(|s| *s), "{seed} {bits}");
            }
        }
    }

    #[test]
    fn scrambled_pairs_stay_nets_and_dimensions_stratified() {
        for seed in [0, 7, 99] {
            for (a, b) in [(0, 1)] {
                for m in 0..=9 {
                    for split in 0..=m {
                        let mut seen = vec![false; 1 << m];
                        for i in 0..1u32 << m {
                            let v = owen_sobol_4d_bits(i, seed).map(|v| v as u64);
                            seen[((v[a] << split >> 32) << (m - split) | (v[b] << (m - split) >> 32)) as usize] = true;
                        }
                        assert!(seen.iter().all(|s| *s), "{seed} {m} {split}");
                    }
                }
            }
            for d in 0..4 {
                let mut seen = [false; 4096];
                (0..4096).for_each(|i| seen[(owen_sobol_4d_bits(8192 + i, seed)[d] >> 20) as usize] = true);
                assert!(seen.iter().all(|s| *s), "{seed} {d}");
            }
        }
    }

    #[test]
    fn short_forms_agree_with_the_block() {
        for i in 0..10_000 {
            let v = owen_sobol_4d(i, i / 100);
            assert_eq!(owen_sobol_1d(i, i / 100), v[0]);
            assert_eq!(owen_sobol_2d(i, i / 100), [v[0], v[1]]);
            assert!(v.iter().all(|x| (0.0..1.0).contains(x)));
        }
    }

    #[test]
    fn each_point_is_uniform_over_seeds() {
        // The promise that makes estimates unbiased. 65,536 seeds, 256 bins a dimension, several indices: 1e-6 each; a 6 %
        // bias in half of the bins would be seen. Then pairs of dimensions and of successive points in 16 x 16 bins.
        for index in [0u32, 1, 2, 3, 17, 255, 100_000] {
            let mut counts = [[0u64; 256]; 4];
            let mut pairs = [[0u64; 256]; 3];
            for seed in 0..65_536u32 {
                let v = owen_sobol_4d_bits(index, seed);
                let next = owen_sobol_4d_bits(index ^ 16, seed);
                (0..4).for_each(|d| counts[d][(v[d] >> 24) as usize] += 1);
                pairs[0][(v[0] >> 28 << 4 | v[1] >> 28) as usize] += 1;
                pairs[1][(v[2] >> 28 << 4 | v[3] >> 28) as usize] += 1;
                pairs[2][(v[0] >> 28 << 4 | owen_sobol_4d_bits(index, seed ^ 0x8000_0000)[0] >> 28) as usize] += 1;
                // Points of one block of 2^m never share their stratum: not independent, but never equal.
                assert_ne!(v, next);
            }
            for c in counts.iter().chain(&pairs) {
                let report = chi2_counts(c, &[1.0 / 256.0; 256]);
                assert!(report.p_value > 1e-7, "{index}: {report:?}");
            }
        }
    }

    #[test]
    fn smooth_integrals_converge_faster_than_random_ones() {
        // x y z w over [0,1]^4 is 1/16. Random points with n = 1024 have a standard error of 0.0028; these must average to
        // the truth over seeds (4.9 sigma) with an error at least 10 times smaller.
        let mut over_seeds = Mean::new();
        for seed in 0..200 {
            let sum: f64 =
                (0..1024).map(|i| owen_sobol_4d(i, mix32(seed)).iter().map(|x| *x as f64).product::<f64>()).sum();
            over_seeds.add(sum / 1024.0);
        }
        irradiant_testkit::assert_mean_close(&over_seeds, 1.0 / 16.0, 4.9);
        assert!(over_seeds.variance().sqrt() < 2.8e-4, "{over_seeds:?}");
    }

    #[test]
    fn the_plane_discrepancy_is_small() {
        // Star discrepancy of 256 points in the first two dimensions, on the points' own grid: random about 0.07,
        // an Owen-scrambled net below 0.02.
        for seed in 0..8 {
            let points: Vec<[f32; 2]> = (0..256).map(|i| owen_sobol_2d(i, seed)).collect();
            let mut worst = 0f64;
            for a in &points {
                for b in &points {
                    let inside = points.iter().filter(|p| p[0] < a[0] && p[1] < b[1]).count();
                    worst = worst.max((inside as f64 / 256.0 - a[0] as f64 * b[1] as f64).abs());
                }
            }
            assert!(worst < 0.025, "{seed}: {worst}");
        }
    }
}
