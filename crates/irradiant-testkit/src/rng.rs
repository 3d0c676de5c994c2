//! A small seedable generator, independent of the one under test.

/// Xorshift128+ seeded by SplitMix64: fast, good enough for tests, and not the renderer's own.
///
/// Vigna 2014, "Further scramblings of Marsaglia's xorshift generators".
#[derive(Clone, Copy, Debug)]
pub struct Rng {
    a: u64,
    b: u64,
}

impl Rng {
    /// The generator for a seed.
    pub fn new(seed: u64) -> Self {
        let mut state = seed;
        let mut split_mix = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let a = split_mix();
        Self { a, b: split_mix() | 1 }
    }

    /// 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        let (mut s, t) = (self.a, self.b);
        let sum = s.wrapping_add(t);
        self.a = t;
        s ^= s << 23;
        self.b = s ^ t ^ (s >> 18) ^ (t >> 5);
        sum
    }

    /// 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1): multiples of 2^-53.
    pub fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Uniform in [0, 1): multiples of 2^-24, at most the largest `f32` below 1.
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 / 16_777_216.0
    }

    /// A uniform direction, unit to rounding.
    pub fn direction(&mut self) -> [f32; 3] {
        let z = 1.0 - 2.0 * self.next_f64();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (std::f64::consts::TAU * self.next_f64()).sin_cos();
        [(r * c) as f32, (r * s) as f32, z as f32]
    }

    /// A uniform direction with z > 0.
    pub fn upper_direction(&mut self) -> [f32; 3] {
        let d = self.direction();
        [d[0], d[1], d[2].abs().max(1e-6)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_enough() {
        let mut rng = Rng::new(0);
        let mut counts = [0u64; 256];
        (0..256_000).for_each(|_| counts[(rng.next_f32() * 256.0) as usize] += 1);
        let report = crate::chi2_counts(&counts, &[1.0 / 256.0; 256]);
        assert!(report.p_value > 1e-4 && report.p_value < 1.0 - 1e-4, "{report:?}");
        let d = rng.direction();
        assert!((d.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-6);
    }
}
