//! Four floats at a time, each lane an unfused IEEE operation.
//!
//! `Portable` is arrays and loops and is what other architectures get; `Sse` is the x86-64 baseline. Comparisons give
//! all-ones or all-zeros lanes. `min(a, b)` is `if a < b { a } else { b }` lane by lane, so a NaN in `a` gives `b`.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Four lanes of `f32`.
pub(crate) trait Four:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    fn load(a: &[f32; 4]) -> Self;
    fn splat(a: f32) -> Self;
    fn to_array(self) -> [f32; 4];
    fn min(self, b: Self) -> Self;
    fn max(self, b: Self) -> Self;
    fn abs(self) -> Self;
    fn lt(self, b: Self) -> Self;
    fn le(self, b: Self) -> Self;
    /// Bit `i` is the sign bit of lane `i`.
    fn mask(self) -> u32;
}

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

impl Portable {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }
}

#[inline(always)]
fn all_ones_if(condition: bool) -> f32 {
    f32::from_bits(if condition { u32::MAX } else { 0 })
}

impl Four for Portable {
    #[inline(always)]
    fn load(a: &[f32; 4]) -> Self {
        Self(*a)
    }
    #[inline(always)]
    fn splat(a: f32) -> Self {
        Self([a; 4])
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
}

#[cfg(target_arch = "x86_64")]
pub(crate) use sse::Sse;

/// The lanes to build with: the best that every machine of this target has.
#[cfg(target_arch = "x86_64")]
pub(crate) type Native = Sse;
/// The lanes to build with: the best that every machine of this target has.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) type Native = Portable;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod sse {
    use super::*;
    use core::arch::x86_64::*;

    /// Calls baseline intrinsics.
    macro_rules! baseline {
        ($e:expr) => {
            // SAFETY: SSE and SSE2 are part of every x86-64 target, and the only pointers are to whole `[f32; 4]`s,
            // read or written unaligned. Guard: `sse_lanes_agree_with_portable_ones`.
            unsafe { $e }
        };
    }

    #[derive(Clone, Copy, Debug)]
    #[repr(transparent)]
    pub(crate) struct Sse(__m128);

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
        fn load(a: &[f32; 4]) -> Self {
            Self(baseline!(_mm_loadu_ps(a.as_ptr())))
        }
        #[inline(always)]
        fn splat(a: f32) -> Self {
            Self(baseline!(_mm_set1_ps(a)))
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
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    #[test]
    fn sse_lanes_agree_with_portable_ones() {
        let values = [0.0, -0.0, 1.0, -1.5, 1e-40, 3e38, -3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.3, 7.25];
        for (i, &a) in values.iter().enumerate() {
            for &b in &values {
                let (x, y) = ([a, b, values[(i + 1) % 12], -a], [b, a, 0.5, b]);
                check::<Portable, Sse>(x, y);
            }
        }
    }

    fn check<P: Four, S: Four>(x: [f32; 4], y: [f32; 4]) {
        fn run<F: Four>(x: [f32; 4], y: [f32; 4]) -> Vec<[f32; 4]> {
            let (a, b) = (F::load(&x), F::load(&y));
            let results = [
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
            ];
            let mut out: Vec<_> = results.iter().map(|r| r.to_array()).collect();
            out.push([a.lt(b).mask() as f32, a.mask() as f32, 0.0, 0.0]);
            out
        }
        for (p, s) in run::<P>(x, y).iter().zip(run::<S>(x, y)) {
            for lane in 0..4 {
                // The payload of a NaN is not promised, and sign bits of NaNs only show up through `mask`.
                let same = p[lane].to_bits() == s[lane].to_bits() || (p[lane].is_nan() && s[lane].is_nan());
                assert!(same, "{x:?} {y:?}: {p:?} {s:?}");
            }
        }
    }
}
