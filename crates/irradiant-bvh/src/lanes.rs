//! Four, eight or sixteen floats at a time, each lane an unfused IEEE operation (but for `multiply_add`).
//!
//! `Portable` is arrays and loops and is what other architectures get; `Sse` is the x86-64 baseline, `Neon` that of aarch64; `Twice` is two of
//! any of these, `Avx` eight in one register, `Pair` two of eight, and `Avx512` sixteen in one register. Comparisons give all-ones or all-zeros lanes. `min(a, b)` is `if a < b { a } else { b }` lane by lane, so a NaN in `a` gives `b`.

use std::ops::{Add, BitAnd, BitOr, Div, IndexMut, Mul, Sub};

/// Lanes of `f32`.
pub(crate) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    /// `[f32; 4]`, `[f32; 8]` or `[f32; 16]`.
    type Array: Copy + IndexMut<usize, Output = f32>;
    /// One bit for each lane.
    const ALL: u32;
    fn load(a: &Self::Array) -> Self;
    fn splat(a: f32) -> Self;
    /// Rows of four numbers, one for each lane, turned: the first numbers of all, the second, the third, the fourth.
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4];
    fn to_array(self) -> Self::Array;
    fn min(self, b: Self) -> Self;
    fn max(self, b: Self) -> Self;
    fn abs(self) -> Self;
    /// `self * b + c` with one rounding where the lanes have such an operation, else with two.
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    fn lt(self, b: Self) -> Self;
    fn le(self, b: Self) -> Self;
    /// Bit `i` is the sign bit of lane `i`.
    fn mask(self) -> u32;
    /// Lane `i` is that of `a` where bit `i` of `mask` is set, else that of `b`.
    fn select(mask: u32, a: Self, b: Self) -> Self;
    /// Lane `i` is the number of a table in the row named by bits 3 and 4 of lane `i` of `rows` (whose other bits are zero), and the column.
    fn look_up(table: &[[f32; 8]; 3], rows: Self, column: usize) -> Self;
}

/// Eight lanes.
pub(crate) trait Eight: Lanes<Array = [f32; 8]> {
    /// Three permutations: lane `i` becomes the lane that the lowest three of the four bits at `4 i` name.
    fn choose<const N: usize>(lanes: [Self; 3], words: [u32; N]) -> [[Self; 3]; N];
}

/// Four lanes.
pub(crate) trait Four: Lanes<Array = [f32; 4]> {
    /// Lanes from 0 to 2^31, rounded down; what others become differs from machine to machine.
    fn round_down(self) -> [u32; 4];
    /// Whole numbers below 2^31.
    fn from_integers(a: [u32; 4]) -> Self;
    /// The first lanes of all three, the second, the third; the fourth is noise.
    fn transpose(rows: [Self; 3]) -> [Self; 3];
    /// Lane `i` becomes that of the first four or the second four that the lowest three of the four bits at `4 i` name.
    #[inline(always)]
    fn choose(low: Self, high: Self, word: u32) -> Self {
        let from = [low.to_array(), high.to_array()];
        let from = from.as_flattened();
        Self::load(&std::array::from_fn(|i| from[(word >> (4 * i)) as usize & 7]))
    }
}

/// Eight lanes as two times the four to build with.
pub(crate) trait TwoFours: Eight {
    /// The lower four lanes.
    fn low(self) -> Native;
    /// The lower and the upper four lanes.
    fn of_halves(low: Native, high: Native) -> Self;
    /// The lower four lanes of both, and the upper four of both.
    fn halves(a: Self, b: Self) -> [Self; 2];
    /// Each half as [`Four::transpose`].
    fn transpose(lanes: [Self; 3]) -> [Self; 3];
    /// Lanes from 0 to 2^31, rounded down; what others become differs from machine to machine.
    fn truncate(self) -> Self;
    /// The halves exchanged.
    #[inline(always)]
    fn swapped(self) -> Self {
        let [low, high] = Self::halves(self, self);
        Self::of_halves(high.low(), low.low())
    }
}

/// Where there is something better it is the specification of it.
#[cfg_attr(target_arch = "aarch64", allow(dead_code))]
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(crate) struct Portable([f32; 4]);

macro_rules! portable_operator {
    ($trait:ident, $method:ident, $a:ident, $b:ident, $e:expr) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| {
                    let ($a, $b) = (self.0[i], other.0[i]);
                    $e
                }))
            }
        }
    };
}
portable_operator!(Add, add, a, b, a + b);
portable_operator!(Sub, sub, a, b, a - b);
portable_operator!(Mul, mul, a, b, a * b);
portable_operator!(Div, div, a, b, a / b);
portable_operator!(BitAnd, bitand, a, b, f32::from_bits(a.to_bits() & b.to_bits()));
portable_operator!(BitOr, bitor, a, b, f32::from_bits(a.to_bits() | b.to_bits()));

#[cfg_attr(target_arch = "aarch64", allow(dead_code))]
impl Portable {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }
}

impl Four for Portable {
    #[inline(always)]
    fn round_down(self) -> [u32; 4] {
        self.0.map(|x| x as u32)
    }
    #[inline(always)]
    fn from_integers(a: [u32; 4]) -> Self {
        Self(a.map(|x| x as f32))
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        std::array::from_fn(|i| Self([a.0[i], b.0[i], c.0[i], 0.0]))
    }
}

#[cfg_attr(target_arch = "aarch64", allow(dead_code))]
#[inline(always)]
fn all_ones_if(condition: bool) -> f32 {
    f32::from_bits(if condition { u32::MAX } else { 0 })
}

impl Lanes for Portable {
    type Array = [f32; 4];
    const ALL: u32 = 0xf;
    #[inline(always)]
    fn load(a: &[f32; 4]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self([a; 4])
    }
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
        std::array::from_fn(|k| Self([rows[0][k], rows[1][k], rows[2][k], rows[3][k]]))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 4] {
        self.0
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        self.zip(b, |a, b| all_ones_if(a < b))
    }
    #[inline(always)]
    fn le(self, b: Self) -> Self {
        self.zip(b, |a, b| all_ones_if(a <= b))
    }
    #[inline(always)]
    fn mask(self) -> u32 {
        (0..4).map(|i| (self.0[i].to_bits() >> 31) << i).sum()
    }
    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| if mask >> i & 1 != 0 { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn look_up(table: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
        Self(rows.0.map(|row| table[(row.to_bits() >> 3) as usize][column]))
    }
}

macro_rules! doubled_operator {
    ($type:ident, $trait:ident, $method:ident) => {
        impl<F: Lanes> $trait for $type<F> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self($trait::$method(self.0, b.0), $trait::$method(self.1, b.1))
            }
        }
    };
}

/// Lanes of twice the number, as two of another.
macro_rules! doubled {
    ($(#[$doc:meta])* $type:ident, $half:literal, $whole:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct $type<F>(F, F);

        doubled_operator!($type, Add, add);
        doubled_operator!($type, Sub, sub);
        doubled_operator!($type, Mul, mul);
        doubled_operator!($type, Div, div);
        doubled_operator!($type, BitAnd, bitand);
        doubled_operator!($type, BitOr, bitor);

        impl<F: Lanes<Array = [f32; $half]>> Lanes for $type<F> {
            type Array = [f32; $whole];
            const ALL: u32 = F::ALL << $half | F::ALL;
            #[inline(always)]
            fn load(a: &[f32; $whole]) -> Self {
                let (halves, _) = a.as_chunks::<$half>();
                Self(F::load(&halves[0]), F::load(&halves[1]))
            }
            #[inline(always)]
            fn splat(a: f32) -> Self {
                Self(F::splat(a), F::splat(a))
            }
            #[inline(always)]
            fn columns(rows: &[&[f32; 4]]) -> [Self; 4] {
                let [a, b, c, d] = F::columns(&rows[..$half]);
                let [e, f, g, h] = F::columns(&rows[$half..]);
                [Self(a, e), Self(b, f), Self(c, g), Self(d, h)]
            }
            #[inline(always)]
            fn to_array(self) -> [f32; $whole] {
                let (low, high) = (self.0.to_array(), self.1.to_array());
                let mut a = [0.0; $whole];
                a[..$half].copy_from_slice(&low);
                a[$half..].copy_from_slice(&high);
                a
            }
            #[inline(always)]
            fn min(self, b: Self) -> Self {
                Self(self.0.min(b.0), self.1.min(b.1))
            }
            #[inline(always)]
            fn max(self, b: Self) -> Self {
                Self(self.0.max(b.0), self.1.max(b.1))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.abs(), self.1.abs())
            }
            #[inline(always)]
            fn multiply_add(self, b: Self, c: Self) -> Self {
                Self(self.0.multiply_add(b.0, c.0), self.1.multiply_add(b.1, c.1))
            }
            #[inline(always)]
            fn lt(self, b: Self) -> Self {
                Self(self.0.lt(b.0), self.1.lt(b.1))
            }
            #[inline(always)]
            fn le(self, b: Self) -> Self {
                Self(self.0.le(b.0), self.1.le(b.1))
            }
            #[inline(always)]
            fn mask(self) -> u32 {
                self.0.mask() | self.1.mask() << $half
            }
            #[inline(always)]
            fn select(mask: u32, a: Self, b: Self) -> Self {
                Self(F::select(mask, a.0, b.0), F::select(mask >> $half, a.1, b.1))
            }
            #[inline(always)]
            fn look_up(table: &[[f32; 8]; 3], rows: Self, column: usize) -> Self {
                Self(F::look_up(table, rows.0, column), F::look_up(table, rows.1, column))
            }
        }
    };
}
doubled!(
    /// Eight lanes as two times four.
    Twice, 4, 8
);
doubled!(
    /// Sixteen lanes as two times eight.
    Pair, 8, 16
);

impl<F: Four> Eight for Twice<F> {
    #[inline(always)]
    fn choose<const N: usize>(lanes: [Self; 3], words: [u32; N]) -> [[Self; 3]; N] {
        words
            .map(|word| lanes.map(|Self(low, high)| Self(F::choose(low, high, word), F::choose(low, high, word >> 16))))
    }
}

impl TwoFours for Twice<Native> {
    #[inline(always)]
    fn low(self) -> Native {
        self.0
    }
    #[inline(always)]
    fn of_halves(low: Native, high: Native) -> Self {
        Self(low, high)
    }
    #[inline(always)]
    fn halves(a: Self, b: Self) -> [Self; 2] {
        [Self(a.0, b.0), Self(a.1, b.1)]
    }
    #[inline(always)]
    fn transpose([a, b, c]: [Self; 3]) -> [Self; 3] {
        let ([d, e, f], [g, h, i]) = (Native::transpose([a.0, b.0, c.0]), Native::transpose([a.1, b.1, c.1]));
        [Self(d, g), Self(e, h), Self(f, i)]
    }
    #[inline(always)]
    fn truncate(self) -> Self {
        let whole = |half: Native| Native::from_integers(half.round_down());
        Self(whole(self.0), whole(self.1))
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use avx::{Avx, Avx512};
#[cfg(target_arch = "x86_64")]
pub(crate) use sse::Sse;

/// The lanes to build with: the best that every machine of this target has.
#[cfg(target_arch = "x86_64")]
pub(crate) type Native = Sse;
/// The lanes to build with: the best that every machine of this target has.
#[cfg(target_arch = "aarch64")]
pub(crate) type Native = neon::Neon;
/// The lanes to build with: the best that every machine of this target has.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(crate) type Native = Portable;

/// The lanes of [`Level::Neon`](crate::Level::Neon).
#[cfg(target_arch = "aarch64")]
pub(crate) type NeonOrPortable = neon::Neon;
/// The lanes of [`Level::Neon`](crate::Level::Neon).
#[cfg(not(target_arch = "aarch64"))]
pub(crate) type NeonOrPortable = Portable;

#[cfg(target_arch = "aarch64")]
#[allow(unsafe_code)]
mod neon {
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
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod sse {
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
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx {
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
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::*;

    const VALUES: [f32; 12] =
        [0.0, -0.0, 1.0, -1.5, 1e-40, 3e38, -3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.3, 7.25];

    const WORDS: [u32; 3] = [0x7654_3210, 0x0123_4567, 0xf8f9_1122];

    fn agrees_with_portable_ones<F: Four>() {
        for x in [[0.0, -0.0, 0.99, 1.0], [1.5, 63.999, 1e-40, 2_147_483_520.0]] {
            assert_eq!(Portable::load(&x).round_down(), F::load(&x).round_down());
            let n = Portable::load(&x).round_down();
            assert_eq!(Portable::from_integers(n).to_array(), F::from_integers(n).to_array());
        }
        let rows = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0]];
        let columns = Portable::transpose(rows.map(|r| Portable::load(&r))).map(|c| c.to_array());
        let same_columns = F::transpose(rows.map(|r| F::load(&r))).map(|c| c.to_array());
        for i in 0..3 {
            assert_eq!(columns[i][..3], same_columns[i][..3]);
        }
        for (i, &a) in VALUES.iter().enumerate() {
            for &b in &VALUES {
                let (x, y) = ([a, b, VALUES[(i + 1) % 12], -a], [b, a, 0.5, b]);
                same(&run::<Portable>(x, y), &run::<F>(x, y));
                let (x, y) = ([a, b, b, a, 1.0, b, VALUES[(i + 1) % 12], -a], [b, a, a, 1.0, b, -b, 0.5, b]);
                same(&run::<Twice<Portable>>(x, y), &run::<Twice<F>>(x, y));
            }
        }
        for word in WORDS {
            let (low, high) = ([0.5, 1.5, 2.5, 3.5], [4.5, 5.5, 6.5, 7.5]);
            let chosen = F::choose(F::load(&low), F::load(&high), word);
            let expected = Portable::choose(Portable::load(&low), Portable::load(&high), word);
            assert_eq!(chosen.to_array(), expected.to_array());
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn sse_lanes_agree_with_portable_ones() {
        agrees_with_portable_ones::<Sse>();
    }

    #[test]
    #[cfg(target_arch = "aarch64")]
    fn neon_lanes_agree_with_portable_ones() {
        agrees_with_portable_ones::<neon::Neon>();
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    fn avx_lanes_agree_with_portable_ones() {
        #[target_feature(enable = "avx2,fma")]
        fn compiled(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
            let lanes = [Avx::load(&x), Avx::load(&y), Avx::splat(1.0)];
            let chosen = Avx::choose(lanes, WORDS).as_flattened().iter().map(|l| l.to_array()).collect::<Vec<_>>();
            [run::<Avx>(x, y), chosen, by_halves::<Avx>(x, y)].concat()
        }
        fn portable(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
            type P = Twice<Native>;
            let lanes = [P::load(&x), P::load(&y), P::splat(1.0)];
            let chosen = P::choose(lanes, WORDS).as_flattened().iter().map(|l| l.to_array()).collect::<Vec<_>>();
            [run::<P>(x, y), chosen, by_halves::<P>(x, y)].concat()
        }
        if !is_x86_feature_detected!("avx2") || !is_x86_feature_detected!("fma") {
            return;
        }
        for (i, &a) in VALUES.iter().enumerate() {
            for &b in &VALUES {
                let (x, y) = ([a, b, b, a, 1.0, b, VALUES[(i + 1) % 12], -a], [b, a, a, 1.0, b, -b, 0.5, b]);
                // SAFETY: the machine has AVX2 and FMA.
                same(&portable(x, y), &unsafe { compiled(x, y) });
            }
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    fn avx512_lanes_agree_with_portable_ones() {
        #[target_feature(enable = "avx512f,avx512dq")]
        fn compiled(x: [f32; 16], y: [f32; 16]) -> Vec<[f32; 16]> {
            run::<Avx512>(x, y)
        }
        if !is_x86_feature_detected!("avx512f") || !is_x86_feature_detected!("avx512dq") {
            return;
        }
        for (i, &a) in VALUES.iter().enumerate() {
            for (j, &b) in VALUES.iter().enumerate() {
                let x = std::array::from_fn(|k| if k == 5 { a } else { VALUES[(i + k) % 12] });
                let y = std::array::from_fn(|k| if k == 3 { a } else { VALUES[(j + 5 * k) % 12].min(b) });
                // SAFETY: the machine has AVX-512 F and DQ.
                same(&run::<Pair<Twice<Portable>>>(x, y), &unsafe { compiled(x, y) });
            }
        }
    }

    /// Fourth lanes of a transpose are noise and left out.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn by_halves<E: TwoFours>(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
        let (a, b) = (E::load(&x), E::load(&y));
        let whole = E::load(&[0.0, 0.99, 1.0, 1.5, 63.999, 1e-40, 7.0, 2_147_483_520.0]).truncate();
        let [p, q, r] = E::transpose([a, b, E::splat(3.0)]).map(|l| {
            let l = l.to_array();
            [l[0], l[1], l[2], 0.0, l[4], l[5], l[6], 0.0]
        });
        let [low, high] = E::halves(a, b).map(|l| l.to_array());
        [a.swapped(), E::of_halves(a.low(), b.low()), whole]
            .map(|l| l.to_array())
            .into_iter()
            .chain([low, high, p, q, r])
            .collect()
    }

    #[inline(always)]
    fn run<F: Lanes>(x: F::Array, y: F::Array) -> Vec<F::Array> {
        let (a, b) = (F::load(&x), F::load(&y));
        let mut rows = x;
        (0..F::ALL.count_ones()).for_each(|i| rows[i as usize] = f32::from_bits((i % 3) << 3));
        let table = [1.0, 2.0, 3.0].map(|row: f32| std::array::from_fn(|column| 10.0 * row + column as f32));
        let four: Vec<_> = (0..F::ALL.count_ones() as usize).map(|i| [y[i], x[i], -x[i], i as f32]).collect();
        let [c0, c1, c2, c3] = F::columns(&four.iter().collect::<Vec<_>>());
        let results = [
            c0,
            c1,
            c2,
            c3,
            a + b,
            a - b,
            a * b,
            a / b,
            a & b,
            a | b,
            a.min(b),
            a.max(b),
            a.abs(),
            a.lt(b),
            a.le(b),
            F::splat(x[1]),
            F::splat(a.lt(b).mask() as f32),
            F::splat(a.mask() as f32),
            F::splat((a.lt(b) & b.le(a.abs()) | a.le(b)).mask() as f32),
            F::splat(2.0).multiply_add(F::splat(3.0), F::splat(0.5)),
            F::select(a.lt(b).mask(), a, b),
            F::select(0x5a37 & F::ALL, a, b),
            F::look_up(&table, F::load(&rows), 0),
            F::look_up(&table, F::load(&rows), 7),
        ];
        results.iter().map(|r| r.to_array()).collect()
    }

    fn same<A: Copy + AsRef<[f32]>>(portable: &[A], other: &[A]) {
        for (p, s) in portable.iter().zip(other) {
            for (p, s) in p.as_ref().iter().zip(s.as_ref()) {
                // The payload of a NaN is not promised, and sign bits of NaNs only show up through `mask`.
                assert!(p.to_bits() == s.to_bits() || (p.is_nan() && s.is_nan()), "{p:?} {s:?}");
            }
        }
    }
}
