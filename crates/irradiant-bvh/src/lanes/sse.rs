//! Four lanes of SSE2, which is part of every x86-64 target.

use super::*;
use core::arch::x86_64::*;

/// Calls baseline intrinsics.
macro_rules! baseline {
    ($e:expr) => {
        // SAFETY: SSE and SSE2 are part of every x86-64 target, and the only pointers are to whole arrays of four,
        // read or written unaligned. Guard: `sse_lanes_agree_with_portable_ones`.
        unsafe { $e }
    };
}

#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Sse(pub(super) __m128);

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Sse {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self(baseline!($intrinsic(self.0, b.0)))
            }
        }
    };
}
operator!(Add, add, _mm_add_ps);
operator!(Sub, sub, _mm_sub_ps);
operator!(Mul, mul, _mm_mul_ps);
operator!(Div, div, _mm_div_ps);
operator!(BitAnd, bitand, _mm_and_ps);
operator!(BitOr, bitor, _mm_or_ps);

impl Four for Sse {
    #[inline(always)]
    fn round_down(self) -> [u32; 4] {
        let mut a = [0; 4];
        baseline!(_mm_storeu_si128(a.as_mut_ptr().cast(), _mm_cvttps_epi32(self.0)));
        a
    }
    #[inline(always)]
    fn from_integers(a: [u32; 4]) -> Self {
        Self(baseline!(_mm_cvtepi32_ps(_mm_loadu_si128(a.as_ptr().cast()))))
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        let (low, high) = (baseline!(_mm_unpacklo_ps(a.0, b.0)), baseline!(_mm_unpackhi_ps(a.0, b.0)));
        [
            Self(baseline!(_mm_shuffle_ps::<0b00_00_01_00>(low, c.0))),
            Self(baseline!(_mm_shuffle_ps::<0b00_01_11_10>(low, c.0))),
            Self(baseline!(_mm_shuffle_ps::<0b00_10_01_00>(high, c.0))),
        ]
    }
}

impl Lanes for Sse {
    type Array = [f32; 4];
    const ALL: u32 = 0xf;
    #[inline(always)]
    fn load(a: &[f32; 4]) -> Self {
        Self(baseline!(_mm_loadu_ps(a.as_ptr())))
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self(baseline!(_mm_set1_ps(a)))
    }
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
        let (a, b) = (Self::load(rows[0]).0, Self::load(rows[1]).0);
        let (c, d) = (Self::load(rows[2]).0, Self::load(rows[3]).0);
        // First and second numbers of two rows, third and fourth; then of all.
        let (ab, ab_high) = (baseline!(_mm_unpacklo_ps(a, b)), baseline!(_mm_unpackhi_ps(a, b)));
        let (cd, cd_high) = (baseline!(_mm_unpacklo_ps(c, d)), baseline!(_mm_unpackhi_ps(c, d)));
        [
            Self(baseline!(_mm_movelh_ps(ab, cd))),
            Self(baseline!(_mm_movehl_ps(cd, ab))),
            Self(baseline!(_mm_movelh_ps(ab_high, cd_high))),
            Self(baseline!(_mm_movehl_ps(cd_high, ab_high))),
        ]
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 4] {
        let mut a = [0.0; 4];
        baseline!(_mm_storeu_ps(a.as_mut_ptr(), self.0));
        a
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(baseline!(_mm_min_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(baseline!(_mm_max_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(baseline!(_mm_andnot_ps(_mm_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        Self(baseline!(_mm_cmplt_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Self {
        Self(baseline!(_mm_cmple_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn mask(self) -> u32 {
        baseline!(_mm_movemask_ps(self.0)) as u32
    }
    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        let bits = baseline!(_mm_setr_epi32(1, 2, 4, 8));
        let chosen = baseline!(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(mask as i32), bits), bits));
        let chosen = baseline!(_mm_castsi128_ps(chosen));
        Self(baseline!(_mm_or_ps(_mm_and_ps(chosen, a.0), _mm_andnot_ps(chosen, b.0))))
    }
    #[inline(always)]
    fn look_up([x, y, z]: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
        let rows = baseline!(_mm_castps_si128(rows.0));
        let is = |row: i32| baseline!(_mm_castsi128_ps(_mm_cmpeq_epi32(rows, _mm_set1_epi32(row << 3))));
        let of = |axis: &[f32; 8], row: i32| baseline!(_mm_and_ps(is(row), _mm_set1_ps(axis[column])));
        Self(baseline!(_mm_or_ps(of(x, 0), _mm_or_ps(of(y, 1), of(z, 2)))))
    }
}
