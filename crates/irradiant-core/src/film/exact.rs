//! Exact sums: fixed-point accumulators whose result does not depend on the order or grouping of the additions.
//!
//! "Any split of the work, any number of threads, any resume gives the same file" rests on this: each sample is
//! rounded once, to a multiple of the unit; integer addition does the rest.

/// Sum of `f32` samples in units of 2^-64. A sample's magnitude must be below 2^43; then 2^20 samples cannot overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct ExactSum(i128);

/// Largest magnitude of one sample (exclusive).
pub const SAMPLE_LIMIT: f32 = (1u64 << 43) as f32;

/// Sum of squares of `f32` samples in units of 2^-48: a sample's magnitude must be below 2^29, and magnitudes below
/// 2^-24 have squares that round to zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct SquareSum(i128);

/// Largest magnitude of one sample whose square is summed (exclusive).
pub const SQUARE_LIMIT: f32 = (1u64 << 29) as f32;

/// `mantissa * 2^exponent`, rounded half away from zero to an integer. A mantissa has 53 bits at most, so what is shifted to
/// the right fits one word; `exponent < 100` where it has 24.
#[inline]
fn scaled(mantissa: u64, exponent: i32) -> i128 {
    if exponent >= 0 {
        (mantissa as i128) << exponent
    } else if exponent > -64 {
        let shift = -exponent as u32;
        i128::from((mantissa + (1 << (shift - 1))) >> shift)
    } else {
        0
    }
}

impl ExactSum {
    /// Adds a sample; false (and nothing added) when it is not finite or its magnitude is [`SAMPLE_LIMIT`] or more.
    #[inline]
    #[must_use]
    pub fn add(&mut self, x: f32) -> bool {
        match Self::quantised(x) {
            Some(q) => {
                self.0 += q.0;
                true
            }
            None => false,
        }
    }

    /// One sample, rounded to the unit; `None` outside the range.
    #[inline]
    pub fn quantised(x: f32) -> Option<Self> {
        if !(x.abs() < SAMPLE_LIMIT) {
            return None;
        }
        let bits = x.to_bits();
        let biased = (bits >> 23 & 0xff) as i32;
        let mantissa = if biased == 0 { bits & 0x7f_ffff } else { bits & 0x7f_ffff | 0x80_0000 };
        let magnitude = scaled(mantissa as u64, biased.max(1) - 150 + 64);
        Some(Self(if x < 0.0 { -magnitude } else { magnitude }))
    }

    /// The sum, rounded to `f64`.
    #[inline]
    pub fn value(self) -> f64 {
        self.0 as f64 / (1u128 << 64) as f64
    }
}

impl std::ops::AddAssign for ExactSum {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl SquareSum {
    /// Adds the square of a sample; false (and nothing added) when it is not finite or its magnitude is
    /// [`SQUARE_LIMIT`] or more.
    #[inline]
    #[must_use]
    pub fn add(&mut self, x: f32) -> bool {
        if !(x.abs() < SQUARE_LIMIT) {
            return false;
        }
        // Exact in f64: 24 + 24 bits.
        let square = x as f64 * x as f64;
        let bits = square.to_bits();
        let biased = (bits >> 52) as i32;
        if biased != 0 {
            self.0 += scaled(bits & ((1 << 52) - 1) | 1 << 52, biased - 1075 + 48);
        }
        true
    }

    /// The sum, rounded to `f64`.
    #[inline]
    pub fn value(self) -> f64 {
        self.0 as f64 / (1u64 << 48) as f64
    }
}

impl std::ops::AddAssign for SquareSum {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Vec<f32> {
        // A heavy-tailed set: magnitudes from 1e-8 to 1e8, both signs.
        let mut state = 1u64;
        (0..10_000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let u = (state >> 40) as f32 / (1u64 << 24) as f32;
                let sign = if state & 1 << 20 == 0 { 1.0 } else { -1.0 };
                sign * 10f32.powf(16.0 * u - 8.0)
            })
            .collect()
    }

    #[test]
    fn sums_do_not_depend_on_order_or_grouping() {
        let xs = samples();
        let total = |xs: &[f32]| {
            let (mut a, mut b) = (ExactSum::default(), SquareSum::default());
            for &x in xs {
                assert!(a.add(x) && b.add(x));
            }
            (a, b)
        };
        let forward = total(&xs);
        let backward = total(&xs.iter().rev().copied().collect::<Vec<_>>());
        assert_eq!(forward, backward);
        for cut in [1, 17, 5000, 9999] {
            let (mut a, b) = (total(&xs[..cut]), total(&xs[cut..]));
            a.0 += b.0;
            a.1 += b.1;
            assert_eq!(a, forward);
        }
        let f64_sum = |it: &mut dyn Iterator<Item = f32>| it.fold(0.0f64, |s, x| s + x as f64 * x as f64 * x as f64);
        assert_ne!(f64_sum(&mut xs.iter().copied()), f64_sum(&mut xs.iter().rev().copied()), "the set has no bite");
    }

    #[test]
    fn single_samples_come_back() {
        for x in [0.0, -0.0, 1.0, -1.5, 3.0e-5, 1e12, -7.25e9, f32::MIN_POSITIVE, 1e-19] {
            let mut sum = ExactSum::default();
            assert!(sum.add(x));
            assert!((sum.value() - x as f64).abs() <= 0.5f64 * (-64f64).exp2(), "{x}");
        }
        for x in [0.0, 1.0, -1.5, 0.001, 5e8] {
            let mut sum = SquareSum::default();
            assert!(sum.add(x));
            assert!((sum.value() - x as f64 * x as f64).abs() <= 0.5f64 * (-48f64).exp2(), "{x}");
        }
    }

    #[test]
    fn samples_outside_the_range_are_refused() {
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, SAMPLE_LIMIT, -SAMPLE_LIMIT, f32::MAX] {
            let mut sum = ExactSum::default();
            assert!(!sum.add(x));
            assert_eq!(sum, ExactSum::default());
        }
        assert!(!SquareSum::default().add(SQUARE_LIMIT));
        let mut sum = ExactSum::default();
        for _ in 0..1 << 20 {
            assert!(sum.add(SAMPLE_LIMIT.next_down()));
        }
        assert!(sum.value() > 9.2e18);
    }
}
