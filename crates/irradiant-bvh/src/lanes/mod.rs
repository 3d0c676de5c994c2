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
mod neon;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod sse;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx;

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests;
