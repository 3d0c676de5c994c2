//! Integer mixing and a small random number generator: pure functions of their arguments, the same bits everywhere.

use crate::vector::{Point2, Point3, Vec3};

/// A bijection of 64-bit integers whose output bits each depend on all input bits. 0 stays 0.
///
/// Maiga 2020, "mx3"-style xor-shift-multiply with the constants of pbrt-v4's `MixBits`.
#[inline]
pub const fn mix64(mut v: u64) -> u64 {
    v ^= v >> 31;
    v = v.wrapping_mul(0x7fb5_d329_728e_a185);
    v ^= v >> 27;
    v = v.wrapping_mul(0x81da_def4_bc2d_d44d);
    v ^ (v >> 33)
}

/// A bijection of 32-bit integers with near-ideal avalanche. 0 stays 0.
///
/// Wellons 2018, "Prospecting for hash functions", `lowbias32` (bias 0.17).
#[inline]
pub const fn mix32(mut v: u32) -> u32 {
    v ^= v >> 16;
    v = v.wrapping_mul(0x21f0_aaad);
    v ^= v >> 15;
    v = v.wrapping_mul(0x735a_2d97);
    v ^ (v >> 15)
}

/// Hash of two words; order matters.
#[inline]
pub const fn hash2(a: u64, b: u64) -> u64 {
    mix64(a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ mix64(b.wrapping_add(0xd1b5_4a32_d192_ed03)))
}

/// Hash of three words; order matters.
#[inline]
pub const fn hash3(a: u64, b: u64, c: u64) -> u64 {
    hash2(hash2(a, b), c)
}

/// Hash of four words; order matters.
#[inline]
pub const fn hash4(a: u64, b: u64, c: u64, d: u64) -> u64 {
    hash2(hash2(hash2(a, b), c), d)
}

/// Hash of any number of words and their count.
pub fn hash_words(words: impl IntoIterator<Item = u64>) -> u64 {
    let (h, n) = words.into_iter().fold((0, 0u64), |(h, n), w| (hash2(h, w), n + 1));
    hash2(h, n)
}

/// Hash of bytes, eight at a time, little-endian, and their count.
pub fn hash_bytes(bytes: &[u8]) -> u64 {
    let mut h = bytes.len() as u64;
    for chunk in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        h = hash2(h, u64::from_le_bytes(word));
    }
    h
}

/// Hash of floats by their bits: 0 and -0 differ, every NaN pattern is its own.
#[inline]
pub fn hash_floats(values: &[f32]) -> u64 {
    let mut h = values.len() as u64;
    for v in values {
        h = hash2(h, v.to_bits() as u64);
    }
    h
}

/// Hash of a point by its bits.
#[inline]
pub fn hash_point(p: Point3) -> u64 {
    hash2((p.x.to_bits() as u64) << 32 | p.y.to_bits() as u64, p.z.to_bits() as u64)
}

/// Hash of a planar point by its bits.
#[inline]
pub fn hash_point2(p: Point2) -> u64 {
    hash2(p.x.to_bits() as u64, p.y.to_bits() as u64)
}

/// Hash of a ray's origin and direction by their bits.
#[inline]
pub fn hash_ray(o: Point3, d: Vec3) -> u64 {
    hash2(hash_point(o), hash_point(d.as_point()))
}

/// The upper 24 bits as a fraction in [0, 1): equidistant, largest 1 - 2^-24.
#[inline]
pub fn unit_f32(v: u32) -> f32 {
    (v >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A hash as a fraction in [0, 1), from its upper bits.
#[inline]
pub fn unit_f32_from_hash(h: u64) -> f32 {
    unit_f32((h >> 32) as u32)
}

/// The `index`-th element of a pseudo-random permutation of 0..`n`, chosen by `seed`, without a table.
///
/// Kensler 2013, "Correlated multi-jittered sampling": hash within the next power of two until the walk lands inside.
/// `n` must be positive and `index < n`.
pub fn permutation_element(index: u32, n: u32, seed: u32) -> u32 {
    debug_assert!(index < n);
    let mut w = n.wrapping_sub(1);
    w |= w >> 1;
    w |= w >> 2;
    w |= w >> 4;
    w |= w >> 8;
    w |= w >> 16;
    let mut i = index;
    loop {
        i ^= seed;
        i = i.wrapping_mul(0xe170_893d);
        i ^= seed >> 16;
        i ^= (i & w) >> 4;
        i ^= seed >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= seed >> 23;
        i ^= (i & w) >> 1;
        i = i.wrapping_mul(1 | seed >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & w) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & w) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & w) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= w;
        i ^= i >> 5;
        if i < n {
            return ((i as u64 + seed as u64) % n as u64) as u32;
        }
    }
}

/// A small random number generator: 64 bits of state, 2^63 independent streams of period 2^64.
///
/// O'Neill 2014, PCG-XSH-RR 64/32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pcg32 {
    state: u64,
    increment: u64,
}

const PCG_MULTIPLIER: u64 = 0x5851_f42d_4c95_7f2d;

impl Pcg32 {
    /// The generator for a seed and a stream; different streams never meet.
    #[inline]
    pub const fn new(seed: u64, stream: u64) -> Self {
        let increment = stream << 1 | 1;
        let state = increment.wrapping_add(seed).wrapping_mul(PCG_MULTIPLIER).wrapping_add(increment);
        Self { state, increment }
    }

    /// The next 32 random bits.
    #[inline]
    pub const fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(PCG_MULTIPLIER).wrapping_add(self.increment);
        let shifted = ((old >> 18 ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// The next 64 random bits.
    #[inline]
    pub const fn next_u64(&mut self) -> u64 {
        (self.next_u32() as u64) << 32 | self.next_u32() as u64
    }

    /// Uniform in [0, 1): a multiple of 2^-24, at most `0x1.fffffep-1`.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// Uniform in [0, 1): a multiple of 2^-53.
    #[inline]
    pub fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Two uniform numbers.
    #[inline]
    pub fn next_2d(&mut self) -> Point2 {
        let x = self.next_f32();
        Point2::new(x, self.next_f32())
    }

    /// Uniform in 0..`n`, without modulo bias. `n` must be positive.
    ///
    /// Lemire 2019: multiply and reject the short tail.
    pub fn below(&mut self, n: u32) -> u32 {
        debug_assert!(n > 0);
        let threshold = n.wrapping_neg() % n;
        loop {
            let product = self.next_u32() as u64 * n as u64;
            if product as u32 >= threshold {
                return (product >> 32) as u32;
            }
        }
    }

    /// Moves `n` draws ahead in logarithmic time; `n` wraps, so a "negative" `n` moves back.
    ///
    /// Brown 1994, "Random number generation with arbitrary strides".
    pub fn advance(&mut self, mut n: u64) {
        let (mut multiplier, mut increment) = (PCG_MULTIPLIER, self.increment);
        let (mut total_multiplier, mut total_increment) = (1u64, 0u64);
        while n > 0 {
            if n & 1 == 1 {
                total_multiplier = total_multiplier.wrapping_mul(multiplier);
                total_increment = total_increment.wrapping_mul(multiplier).wrapping_add(increment);
            }
            increment = multiplier.wrapping_add(1).wrapping_mul(increment);
            multiplier = multiplier.wrapping_mul(multiplier);
            n >>= 1;
        }
        self.state = total_multiplier.wrapping_mul(self.state).wrapping_add(total_increment);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pcg_gives_the_published_first_values() {
        // O'Neill's pcg32-demo seeds with (42, 54): pcg_basic 0.9, test-high/expected/check-pcg32.out.
        let mut g = Pcg32::new(42, 54);
        let first: Vec<u32> = (0..6).map(|_| g.next_u32()).collect();
        assert_eq!(first, [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330, 0x83d2_f293, 0xbfa4_784b, 0xcbed_606e]);
    }

    #[test]
    fn advancing_equals_drawing_and_goes_back() {
        let mut a = Pcg32::new(7, 1);
        let mut b = a;
        (0..1000).for_each(|_| {
            a.next_u32();
        });
        b.advance(1000);
        assert_eq!(a, b);
        b.advance(1000u64.wrapping_neg());
        assert_eq!(b, Pcg32::new(7, 1));
    }

    #[test]
    fn uniform_floats_stay_below_one() {
        assert_eq!(unit_f32(u32::MAX), crate::elementary::ONE_MINUS_EPSILON);
        assert_eq!(unit_f32(0), 0.0);
        let mut g = Pcg32::new(1, 1);
        let mean = (0..100_000).map(|_| g.next_f64()).sum::<f64>() / 1e5;
        // Standard error 0.0009.
        assert!((mean - 0.5).abs() < 0.004);
        assert!((0..1000).all(|_| g.below(7) < 7));
    }

    #[test]
    fn permutations_permute() {
        for n in [1, 2, 3, 7, 16, 100, 1000] {
            for seed in [0, 1, 0xdead_beef] {
                let mut seen = vec![false; n as usize];
                (0..n).for_each(|i| seen[permutation_element(i, n, seed) as usize] = true);
                assert!(seen.iter().all(|s| *s), "{n} {seed}");
            }
        }
    }

    #[test]
    fn one_input_bit_flips_half_of_the_output_bits() {
        // 64 x 64 flip counts over 2000 inputs: sigma of each 0.011, bound 6 sigma.
        let mut g = Pcg32::new(3, 3);
        let mut counts = [[0u32; 64]; 64];
        for _ in 0..2000 {
            let v = g.next_u64();
            for i in 0..64 {
                let d = hash2(v, 5) ^ hash2(v ^ 1 << i, 5);
                (0..64).for_each(|j| counts[i][j] += (d >> j & 1) as u32);
            }
        }
        for c in counts.iter().flatten() {
            assert!((*c as f64 / 2000.0 - 0.5).abs() < 0.067, "{c}");
        }
        assert_ne!(hash_floats(&[0.0]), hash_floats(&[-0.0]));
        assert_ne!(hash_bytes(b"a"), hash_bytes(b"a\0"));
    }
}
