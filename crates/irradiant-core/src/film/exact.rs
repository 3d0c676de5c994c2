//! Exact sums: fixed-point accumulators whose result does not depend on the order or grouping of the additions.
//!
//! "Any split of the work, any number of threads, any resume gives the same file" rests on this: each sample is
//! rounded once, to a multiple of the unit; integer addition does the rest.

use std::ops::Range;

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

/// `mantissa * 2^exponent`, rounded half away from zero to an integer, as its low and its high word: `mantissa` below 2^53, `exponent` below 64 + 40.
/// Chooses, so that loops become vector code.
#[inline(always)]
fn scaled(mantissa: u64, exponent: i32) -> [u64; 2] {
    // Shifts count modulo 64 in words: what is not meant is not chosen.
    let (up, down) = (exponent as u32, exponent.wrapping_neg() as u32);
    let rounded = mantissa.wrapping_add(1u64.wrapping_shl(down.wrapping_sub(1))).wrapping_shr(down);
    let low = if exponent < 64 { mantissa.wrapping_shl(up) } else { 0 };
    let carried = if exponent > 0 { mantissa.wrapping_shr(down) } else { 0 };
    let low = if exponent >= 0 { low } else { rounded };
    [if exponent > -64 { low } else { 0 }, if exponent < 64 { carried } else { mantissa.wrapping_shl(up) }]
}

/// Mantissa and exponent of a finite number's magnitude.
#[inline(always)]
fn parts(x: f32) -> (u64, i32) {
    let bits = x.to_bits();
    let biased = (bits >> 23 & 0xff) as i32;
    let leading = if biased == 0 { 0 } else { 0x80_0000 };
    (u64::from(bits & 0x7f_ffff | leading), biased.max(1) - 150)
}

/// A sample in units of [`ExactSum`], two's complement, low word first; its magnitude is below [`SAMPLE_LIMIT`].
#[inline(always)]
pub(super) fn sample_words(x: f32) -> [u64; 2] {
    let (mantissa, exponent) = parts(x);
    let [low, high] = scaled(mantissa, exponent + 64);
    let sign = if x < 0.0 { u64::MAX } else { 0 };
    let carry = if low == 0 { sign & 1 } else { 0 };
    [(low ^ sign).wrapping_sub(sign), (high ^ sign).wrapping_add(carry)]
}

/// A sample's square in units of [`SquareSum`], low word first; its magnitude is below [`SQUARE_LIMIT`].
#[inline(always)]
pub(super) fn square_words(x: f32) -> [u64; 2] {
    // Exact: 24 + 24 bits.
    let (mantissa, exponent) = parts(x);
    scaled(mantissa * mantissa, 2 * exponent + 48)
}

#[inline(always)]
fn joined([low, high]: [u64; 2]) -> i128 {
    (u128::from(high) << 64 | u128::from(low)) as i128
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
        Some(Self(joined(sample_words(x))))
    }

    /// Adds the samples of some lanes, of which these are the [`sample_words`].
    #[inline(always)]
    pub(super) fn add_words<const N: usize>(&mut self, [low, high]: &[[u64; N]; 2], lanes: Range<usize>) {
        for i in lanes {
            self.0 += joined([low[i], high[i]]);
        }
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
        self.0 += joined(square_words(x));
        true
    }

    /// Adds the samples of some lanes, of which these are the [`square_words`].
    #[inline(always)]
    pub(super) fn add_words<const N: usize>(&mut self, [low, high]: &[[u64; N]; 2], lanes: Range<usize>) {
        for i in lanes {
            self.0 += joined([low[i], high[i]]);
        }
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
