//! Four lanes of NEON, which is part of every aarch64 target with floats.

use super::*;
use core::arch::aarch64::*;

/// Calls baseline intrinsics.
macro_rules! baseline {
    ($e:expr) => {
        // SAFETY: NEON is part of every aarch64 target with floats, and the only pointers are to whole arrays of four,
        // read or written unaligned. Guard: `neon_lanes_agree_with_portable_ones`.
        unsafe { $e }
    };
}

#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Neon(float32x4_t);

macro_rules! operator {
    ($trait:ident, $method:ident, $e:expr) => {
        impl $trait for Neon {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                let operation: fn(Self, Self) -> Self = $e;
                operation(self, b)
            }
        }
    };
}
operator!(Add, add, |a, b| Self(baseline!(vaddq_f32(a.0, b.0))));
operator!(Sub, sub, |a, b| Self(baseline!(vsubq_f32(a.0, b.0))));
operator!(Mul, mul, |a, b| Self(baseline!(vmulq_f32(a.0, b.0))));
operator!(Div, div, |a, b| Self(baseline!(vdivq_f32(a.0, b.0))));
operator!(BitAnd, bitand, |a, b| Self::from_bits(baseline!(vandq_u32(a.bits(), b.bits()))));
operator!(BitOr, bitor, |a, b| Self::from_bits(baseline!(vorrq_u32(a.bits(), b.bits()))));

impl Neon {
    #[inline(always)]
    fn bits(self) -> uint32x4_t {
        baseline!(vreinterpretq_u32_f32(self.0))
    }
    #[inline(always)]
    fn from_bits(bits: uint32x4_t) -> Self {
        Self(baseline!(vreinterpretq_f32_u32(bits)))
    }
    #[inline(always)]
    fn integers(a: [u32; 4]) -> uint32x4_t {
        baseline!(vld1q_u32(a.as_ptr()))
    }
}

impl Lanes for Neon {
    type Array = [f32; 4];
    const ALL: u32 = 0xf;
    #[inline(always)]
    fn load(a: &[f32; 4]) -> Self {
        Self(baseline!(vld1q_f32(a.as_ptr())))
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self(baseline!(vdupq_n_f32(a)))
    }
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
        let (a, b) = (Self::load(rows[0]).0, Self::load(rows[1]).0);
        let (c, d) = (Self::load(rows[2]).0, Self::load(rows[3]).0);
        // First and third numbers of two rows, second and fourth; then of all.
        let (ab, ab_odd) = (baseline!(vtrn1q_f32(a, b)), baseline!(vtrn2q_f32(a, b)));
        let (cd, cd_odd) = (baseline!(vtrn1q_f32(c, d)), baseline!(vtrn2q_f32(c, d)));
        let low = |ab, cd| Self(baseline!(vcombine_f32(vget_low_f32(ab), vget_low_f32(cd))));
        let high = |ab, cd| Self(baseline!(vcombine_f32(vget_high_f32(ab), vget_high_f32(cd))));
        [low(ab, cd), low(ab_odd, cd_odd), high(ab, cd), high(ab_odd, cd_odd)]
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 4] {
        let mut a = [0.0; 4];
        baseline!(vst1q_f32(a.as_mut_ptr(), self.0));
        a
    }
    // `vminq` and `vmaxq` give NaN for any NaN.
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(baseline!(vbslq_f32(vcltq_f32(self.0, b.0), self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(baseline!(vbslq_f32(vcgtq_f32(self.0, b.0), self.0, b.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(baseline!(vabsq_f32(self.0)))
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        Self(baseline!(vfmaq_f32(c.0, self.0, b.0)))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        Self::from_bits(baseline!(vcltq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Self {
        Self::from_bits(baseline!(vcleq_f32(self.0, b.0)))
    }
    #[inline(always)]
    fn mask(self) -> u32 {
        let places = baseline!(vld1q_s32([0, 1, 2, 3].as_ptr()));
        baseline!(vaddvq_u32(vshlq_u32(vshrq_n_u32::<31>(self.bits()), places)))
    }
    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        let chosen = baseline!(vtstq_u32(vdupq_n_u32(mask), Self::integers([1, 2, 4, 8])));
        Self(baseline!(vbslq_f32(chosen, a.0, b.0)))
    }
    #[inline(always)]
    fn look_up([x, y, z]: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
        let is = |row: u32| baseline!(vceqq_u32(rows.bits(), vdupq_n_u32(row << 3)));
        let [x, y, z] = [x, y, z].map(|axis| Self::splat(axis[column]).0);
        Self(baseline!(vbslq_f32(is(0), x, vbslq_f32(is(1), y, z))))
    }
}

impl Four for Neon {
    #[inline(always)]
    fn round_down(self) -> [u32; 4] {
        let mut a = [0; 4];
        baseline!(vst1q_u32(a.as_mut_ptr(), vcvtq_u32_f32(self.0)));
        a
    }
    #[inline(always)]
    fn from_integers(a: [u32; 4]) -> Self {
        Self(baseline!(vcvtq_f32_u32(Self::integers(a))))
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        let (even, odd) = (baseline!(vtrn1q_f32(a.0, b.0)), baseline!(vtrn2q_f32(a.0, b.0)));
        let low = |ab, c| baseline!(vcombine_f32(vget_low_f32(ab), vget_low_f32(c)));
        let third = baseline!(vcombine_f32(vget_high_f32(even), vget_high_f32(c.0)));
        [Self(low(even, c.0)), Self(low(odd, baseline!(vdupq_laneq_f32::<1>(c.0)))), Self(third)]
    }
    #[inline(always)]
    fn choose(low: Self, high: Self, word: u32) -> Self {
        // Four bits at `4 i` into lane `i`, and from there the four bytes of the number that they name.
        let shifts = baseline!(vld1q_s32([0, -4, -8, -12].as_ptr()));
        let names = baseline!(vandq_u32(vshlq_u32(vdupq_n_u32(word), shifts), vdupq_n_u32(7)));
        let bytes = baseline!(vmlaq_n_u32(vdupq_n_u32(0x0302_0100), names, 0x0404_0404));
        let table = baseline!(uint8x16x2_t(vreinterpretq_u8_f32(low.0), vreinterpretq_u8_f32(high.0)));
        Self(baseline!(vreinterpretq_f32_u8(vqtbl2q_u8(table, vreinterpretq_u8_u32(bytes)))))
    }
}
