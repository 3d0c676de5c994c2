//! Values at the wavelengths of one path: four lanes and their arithmetic.
//!
//! Knows nothing of which wavelengths the lanes stand for; that is [`Wavelengths`](crate::Wavelengths).

use crate::N_WAVELENGTHS;
use std::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// A quantity at each of a path's [`N_WAVELENGTHS`] wavelengths (or at r, g, b and a copy of g in the RGB basis).
///
/// Plain data, 16 bytes, aligned for one SIMD register. Arithmetic is lane by lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct SampledSpectrum(pub [f32; N_WAVELENGTHS]);

impl SampledSpectrum {
    /// All lanes 0.
    pub const ZERO: Self = Self([0.0; N_WAVELENGTHS]);
    /// All lanes 1.
    pub const ONE: Self = Self([1.0; N_WAVELENGTHS]);

    /// The lanes as given.
    #[inline]
    pub const fn new(lanes: [f32; N_WAVELENGTHS]) -> Self {
        Self(lanes)
    }

    /// The same value in every lane.
    #[inline]
    pub const fn splat(value: f32) -> Self {
        Self([value; N_WAVELENGTHS])
    }

    /// `f` of the lane index, for each lane.
    #[inline]
    pub fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }

    /// `f` of each lane.
    #[inline]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        // Written out: the array's own is sometimes called rather than inlined.
        let [a, b, c, d] = self.0;
        Self([f(a), f(b), f(c), f(d)])
    }

    /// `f` of each pair of lanes.
    #[inline]
    pub fn zip(self, other: Self, mut f: impl FnMut(f32, f32) -> f32) -> Self {
        Self::from_fn(|i| f(self.0[i], other.0[i]))
    }

    /// The largest lane.
    #[inline]
    pub fn max_component(self) -> f32 {
        let [a, b, c, d] = self.0;
        a.max(b).max(c.max(d))
    }

    /// The smallest lane.
    #[inline]
    pub fn min_component(self) -> f32 {
        let [a, b, c, d] = self.0;
        a.min(b).min(c.min(d))
    }

    /// The mean of the lanes.
    #[inline]
    pub fn average(self) -> f32 {
        let [a, b, c, d] = self.0;
        ((a + b) + (c + d)) * 0.25
    }

    /// Whether every lane is exactly 0 (NaN is not).
    #[inline(always)]
    pub fn is_black(self) -> bool {
        let [a, b, c, d] = self.0;
        (a == 0.0) & (b == 0.0) & (c == 0.0) & (d == 0.0)
    }

    /// Whether no lane is infinite or NaN.
    #[inline]
    pub fn is_finite(self) -> bool {
        // 0 x is 0 for finite x and NaN otherwise.
        let [a, b, c, d] = (self * 0.0).0;
        (a + b) + (c + d) == 0.0
    }

    /// `self / divisor`, with 0 where the divisor is 0.
    #[inline]
    pub fn safe_div(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| if b != 0.0 { a / b } else { 0.0 })
    }

    /// Negative lanes (and NaN) become 0.
    #[inline]
    pub fn clamp_zero(self) -> Self {
        self.map(|v| v.max(0.0))
    }

    /// Each lane moved into `[lo, hi]`; NaN becomes `lo`.
    #[inline]
    pub fn clamp(self, lo: f32, hi: f32) -> Self {
        self.map(|v| v.max(lo).min(hi))
    }

    /// Square root of each lane; NaN for negative ones.
    #[inline]
    pub fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    /// e to each lane, by the pinned `exp`.
    #[inline]
    pub fn exp(self) -> Self {
        self.map(crate::elementary::exp)
    }

    /// `(1 - t) a + t b`; exact at `t` = 0 and 1.
    #[inline]
    pub fn lerp(t: f32, a: Self, b: Self) -> Self {
        a * (1.0 - t) + b * t
    }

    /// The lane-wise larger of two.
    #[inline]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, f32::max)
    }

    /// The lane-wise smaller of two.
    #[inline]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, f32::min)
    }
}

impl From<[f32; N_WAVELENGTHS]> for SampledSpectrum {
    #[inline]
    fn from(lanes: [f32; N_WAVELENGTHS]) -> Self {
        Self(lanes)
    }
}

impl Index<usize> for SampledSpectrum {
    type Output = f32;
    #[inline]
    fn index(&self, lane: usize) -> &f32 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for SampledSpectrum {
    #[inline]
    fn index_mut(&mut self, lane: usize) -> &mut f32 {
        &mut self.0[lane]
    }
}

impl Neg for SampledSpectrum {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(|v| -v)
    }
}

macro_rules! lane_wise {
    ($($op:ident $method:ident $assign:ident $assign_method:ident $symbol:tt;)*) => {$(
        impl $op for SampledSpectrum {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                let (a, b) = (self.0, other.0);
                Self([a[0] $symbol b[0], a[1] $symbol b[1], a[2] $symbol b[2], a[3] $symbol b[3]])
            }
        }
        impl $op<f32> for SampledSpectrum {
            type Output = Self;
            #[inline]
            fn $method(self, other: f32) -> Self {
                self $symbol Self::splat(other)
            }
        }
        impl $op<SampledSpectrum> for f32 {
            type Output = SampledSpectrum;
            #[inline]
            fn $method(self, other: SampledSpectrum) -> SampledSpectrum {
                SampledSpectrum::splat(self) $symbol other
            }
        }
        impl $assign for SampledSpectrum {
            #[inline]
            fn $assign_method(&mut self, other: Self) {
                *self = *self $symbol other;
            }
        }
        impl $assign<f32> for SampledSpectrum {
            #[inline]
            fn $assign_method(&mut self, other: f32) {
                *self = *self $symbol other;
            }
        }
    )*};
}

lane_wise! {
    Add add AddAssign add_assign +;
    Sub sub SubAssign sub_assign -;
    Mul mul MulAssign mul_assign *;
    Div div DivAssign div_assign /;
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: SampledSpectrum = SampledSpectrum([1.0, -2.0, 0.5, 4.0]);
    const B: SampledSpectrum = SampledSpectrum([2.0, 4.0, -1.0, 0.0]);

    #[test]
    fn arithmetic_is_lane_by_lane() {
        assert_eq!((A + B).0, [3.0, 2.0, -0.5, 4.0]);
        assert_eq!((A - B).0, [-1.0, -6.0, 1.5, 4.0]);
        assert_eq!((A * B).0, [2.0, -8.0, -0.5, 0.0]);
        assert_eq!((B / A).0, [2.0, -2.0, -2.0, 0.0]);
        assert_eq!((-A).0, [-1.0, 2.0, -0.5, -4.0]);
        assert_eq!((A * 2.0).0, (2.0 * A).0);
        assert_eq!((1.0 - A).0, [0.0, 3.0, 0.5, -3.0]);
        let mut c = A;
        c += B;
        c -= 1.0;
        c *= B;
        c /= 2.0;
        assert_eq!(c.0, [2.0, 2.0, 0.75, 0.0]);
        assert_eq!(SampledSpectrum::lerp(0.0, A, B), A);
        assert_eq!(SampledSpectrum::lerp(1.0, A, B), B);
    }

    #[test]
    fn reductions_and_predicates_hold_at_the_edges() {
        assert_eq!(A.max_component(), 4.0);
        assert_eq!(A.min_component(), -2.0);
        assert_eq!(A.average(), 0.875);
        assert!(SampledSpectrum::ZERO.is_black() && SampledSpectrum::splat(-0.0).is_black());
        assert!(!SampledSpectrum([0.0, 0.0, f32::NAN, 0.0]).is_black());
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for lane in 0..4 {
                let mut s = SampledSpectrum::splat(3e38);
                assert!(s.is_finite());
                s[lane] = bad;
                assert!(!s.is_finite());
            }
        }
        assert_eq!(A.safe_div(B).0, [0.5, -0.5, -0.5, 0.0]);
        assert_eq!(A.clamp_zero().0, [1.0, 0.0, 0.5, 4.0]);
        assert_eq!(SampledSpectrum::splat(f32::NAN).clamp_zero(), SampledSpectrum::ZERO);
        assert_eq!(A.clamp(-1.0, 1.0).0, [1.0, -1.0, 0.5, 1.0]);
        assert_eq!(SampledSpectrum::splat(4.0).sqrt(), SampledSpectrum::splat(2.0));
        assert_eq!(SampledSpectrum::ZERO.exp(), SampledSpectrum::ONE);
    }
}
