//! The two precisions.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number of some precision.
pub(crate) trait Number:
    Copy
    + PartialOrd
    + std::fmt::Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The nearest to `x`.
    fn of(x: f64) -> Self;
    /// The same.
    fn wide(self) -> f64;
    /// Square root, correctly rounded.
    fn root(self) -> Self;
}

impl Number for f32 {
    fn of(x: f64) -> Self {
        x as Self
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
    fn root(self) -> Self {
        self.sqrt()
    }
}

impl Number for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn wide(self) -> f64 {
        self
    }
    fn root(self) -> Self {
        self.sqrt()
    }
}

pub(crate) type Triple<T> = [T; 3];

pub(crate) fn dot<T: Number>(a: Triple<T>, b: Triple<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross<T: Number>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn sub<T: Number>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The roots of a t^2 + b t + c by the formula from school, smaller first: (-b -+ sqrt(b^2 - 4 a c)) / 2 a. It loses all
/// digits where b^2 and 4 a c are nearly equal, and where b and the root are.
pub(crate) fn school_roots<T: Number>(a: T, b: T, c: T) -> Option<[T; 2]> {
    let discriminant = b * b - T::of(4.0) * a * c;
    if !(discriminant >= T::of(0.0)) {
        return None;
    }
    let root = discriminant.root();
    let two_a = T::of(2.0) * a;
    let (t0, t1) = ((-b - root) / two_a, (-b + root) / two_a);
    Some(if t0 <= t1 { [t0, t1] } else { [t1, t0] })
}
