//! Eight lanes of AVX2 with FMA, sixteen of AVX-512 F and DQ.

use super::*;
use core::arch::x86_64::*;

/// Calls intrinsics of AVX.
macro_rules! avx {
    ($e:expr) => {
        // SAFETY: only code compiled for AVX2 and FMA (AVX-512) behind a check that the machine has it uses `Avx`
        // (`Avx512`): the entry points of `traverse`, and `build::wide`. The only pointers are to whole `[f32; 8]`s (`[f32; 16]`s,
        // `[f32; 4]`s), read or written unaligned. Guards: `avx_lanes_agree_with_portable_ones`, `avx512_lanes_agree_with_portable_ones`.
        unsafe { $e }
    };
}

#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Avx(__m256);

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self(avx!($intrinsic(self.0, b.0)))
            }
        }
    };
}
operator!(Avx, Add, add, _mm256_add_ps);
operator!(Avx, Sub, sub, _mm256_sub_ps);
operator!(Avx, Mul, mul, _mm256_mul_ps);
operator!(Avx, Div, div, _mm256_div_ps);
operator!(Avx, BitAnd, bitand, _mm256_and_ps);
operator!(Avx, BitOr, bitor, _mm256_or_ps);

/// Sixteen lanes of AVX-512 F and DQ.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Avx512(__m512);

operator!(Avx512, Add, add, _mm512_add_ps);
operator!(Avx512, Sub, sub, _mm512_sub_ps);
operator!(Avx512, Mul, mul, _mm512_mul_ps);
operator!(Avx512, Div, div, _mm512_div_ps);
operator!(Avx512, BitAnd, bitand, _mm512_and_ps);
operator!(Avx512, BitOr, bitor, _mm512_or_ps);

/// Masks become lanes and lanes masks again; the compiler leaves out both.
impl Lanes for Avx512 {
    type Array = [f32; 16];
    const ALL: u32 = 0xffff;
    #[inline(always)]
    fn load(a: &[f32; 16]) -> Self {
        Self(avx!(_mm512_loadu_ps(a.as_ptr())))
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self(avx!(_mm512_set1_ps(a)))
    }
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
        // Rows `i`, `4 + i`, `8 + i` and `12 + i`, so that four by four numbers are turned in each quarter.
        macro_rules! quarters {
            ($i:literal) => {{
                let first = avx!(_mm512_castps128_ps512(_mm_loadu_ps(rows[$i].as_ptr())));
                let two = avx!(_mm512_insertf32x4::<1>(first, _mm_loadu_ps(rows[4 + $i].as_ptr())));
                let three = avx!(_mm512_insertf32x4::<2>(two, _mm_loadu_ps(rows[8 + $i].as_ptr())));
                avx!(_mm512_insertf32x4::<3>(three, _mm_loadu_ps(rows[12 + $i].as_ptr())))
            }};
        }
        let (a, b, c, d) = (quarters!(0), quarters!(1), quarters!(2), quarters!(3));
        let (ab, ab_high) = (avx!(_mm512_unpacklo_ps(a, b)), avx!(_mm512_unpackhi_ps(a, b)));
        let (cd, cd_high) = (avx!(_mm512_unpacklo_ps(c, d)), avx!(_mm512_unpackhi_ps(c, d)));
        [
            Self(avx!(_mm512_shuffle_ps::<0b01_00_01_00>(ab, cd))),
            Self(avx!(_mm512_shuffle_ps::<0b11_10_11_10>(ab, cd))),
            Self(avx!(_mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high))),
            Self(avx!(_mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high))),
        ]
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let mut a = [0.0; 16];
        avx!(_mm512_storeu_ps(a.as_mut_ptr(), self.0));
        a
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(avx!(_mm512_min_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(avx!(_mm512_max_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        Self(avx!(_mm512_fmadd_ps(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        Self(avx!(_mm512_castsi512_ps(_mm512_movm_epi32(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, b.0)))))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Self {
        Self(avx!(_mm512_castsi512_ps(_mm512_movm_epi32(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0)))))
    }
    #[inline(always)]
    fn mask(self) -> u32 {
        u32::from(avx!(_mm512_movepi32_mask(_mm512_castps_si512(self.0))))
    }
    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        Self(avx!(_mm512_mask_blend_ps(mask as u16, b.0, a.0)))
    }
    #[inline(always)]
    fn look_up(table: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
        let [x, y, z] = table;
        let index = avx!(_mm512_add_epi32(_mm512_castps_si512(rows.0), _mm512_set1_epi32(column as i32)));
        let (low, high) = avx!((_mm512_castps256_ps512(_mm256_loadu_ps(x.as_ptr())), _mm256_loadu_ps(y.as_ptr())));
        let both = avx!(_mm512_insertf32x8::<1>(low, high));
        let last = avx!(_mm512_castps256_ps512(_mm256_loadu_ps(z.as_ptr())));
        Self(avx!(_mm512_permutex2var_ps(both, index, last)))
    }
}

impl Lanes for Avx {
    type Array = [f32; 8];
    const ALL: u32 = 0xff;
    #[inline(always)]
    fn load(a: &[f32; 8]) -> Self {
        Self(avx!(_mm256_loadu_ps(a.as_ptr())))
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self(avx!(_mm256_set1_ps(a)))
    }
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
        // Rows `i` and `4 + i`, so that four by four numbers are turned in each half.
        macro_rules! halves {
            ($i:literal) => {{
                let first = avx!(_mm256_castps128_ps256(_mm_loadu_ps(rows[$i].as_ptr())));
                avx!(_mm256_insertf128_ps::<1>(first, _mm_loadu_ps(rows[4 + $i].as_ptr())))
            }};
        }
        let (a, b, c, d) = (halves!(0), halves!(1), halves!(2), halves!(3));
        let (ab, ab_high) = (avx!(_mm256_unpacklo_ps(a, b)), avx!(_mm256_unpackhi_ps(a, b)));
        let (cd, cd_high) = (avx!(_mm256_unpacklo_ps(c, d)), avx!(_mm256_unpackhi_ps(c, d)));
        [
            Self(avx!(_mm256_shuffle_ps::<0b01_00_01_00>(ab, cd))),
            Self(avx!(_mm256_shuffle_ps::<0b11_10_11_10>(ab, cd))),
            Self(avx!(_mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high))),
            Self(avx!(_mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high))),
        ]
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut a = [0.0; 8];
        avx!(_mm256_storeu_ps(a.as_mut_ptr(), self.0));
        a
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(avx!(_mm256_min_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(avx!(_mm256_max_ps(self.0, b.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        Self(avx!(_mm256_fmadd_ps(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        Self(avx!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0)))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Self {
        Self(avx!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)))
    }
    #[inline(always)]
    fn mask(self) -> u32 {
        avx!(_mm256_movemask_ps(self.0)) as u32
    }
    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        let bits = avx!(_mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128));
        let chosen = avx!(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bits), bits));
        Self(avx!(_mm256_blendv_ps(b.0, a.0, _mm256_castsi256_ps(chosen))))
    }
    #[inline(always)]
    fn look_up([x, y, z]: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
        let rows = avx!(_mm256_castps_si256(rows.0));
        let is_x = avx!(_mm256_castsi256_ps(_mm256_cmpeq_epi32(rows, _mm256_setzero_si256())));
        let is_y = avx!(_mm256_castsi256_ps(_mm256_cmpeq_epi32(rows, _mm256_set1_epi32(8))));
        let [x, y, z] = avx!([_mm256_set1_ps(x[column]), _mm256_set1_ps(y[column]), _mm256_set1_ps(z[column])]);
        Self(avx!(_mm256_blendv_ps(_mm256_blendv_ps(z, y, is_y), x, is_x)))
    }
}

impl Eight for Avx {
    #[inline(always)]
    fn choose<const N: usize>([x, y, z]: [Self; 3], words: [u32; N]) -> [[Self; 3]; N] {
        let mut out = [[x; 3]; N];
        for n in 0..N {
            let which = avx!(_mm256_srlv_epi32(
                _mm256_set1_epi32(words[n] as i32),
                _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28)
            ));
            out[n] = [
                Self(avx!(_mm256_permutevar8x32_ps(x.0, which))),
                Self(avx!(_mm256_permutevar8x32_ps(y.0, which))),
                Self(avx!(_mm256_permutevar8x32_ps(z.0, which))),
            ];
        }
        out
    }
}

impl TwoFours for Avx {
    #[inline(always)]
    fn low(self) -> Native {
        Sse(avx!(_mm256_castps256_ps128(self.0)))
    }
    #[inline(always)]
    fn of_halves(low: Native, high: Native) -> Self {
        Self(avx!(_mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low.0), high.0)))
    }
    #[inline(always)]
    fn halves(a: Self, b: Self) -> [Self; 2] {
        [Self(avx!(_mm256_permute2f128_ps::<0x20>(a.0, b.0))), Self(avx!(_mm256_permute2f128_ps::<0x31>(a.0, b.0)))]
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        let (low, high) = (avx!(_mm256_unpacklo_ps(a.0, b.0)), avx!(_mm256_unpackhi_ps(a.0, b.0)));
        [
            Self(avx!(_mm256_shuffle_ps::<0b00_00_01_00>(low, c.0))),
            Self(avx!(_mm256_shuffle_ps::<0b00_01_11_10>(low, c.0))),
            Self(avx!(_mm256_shuffle_ps::<0b00_10_01_00>(high, c.0))),
        ]
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        Self(avx!(_mm256_cvtepi32_ps(_mm256_cvttps_epi32(self.0))))
    }
    #[inline(always)]
    fn swapped(self) -> Self {
        Self(avx!(_mm256_permute2f128_ps::<1>(self.0, self.0)))
    }
}
