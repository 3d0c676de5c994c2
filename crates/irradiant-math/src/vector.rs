//! Points, vectors and normals as distinct plain types, so that a transform cannot mistake one for another.
//!
//! Plain `f32` fields rather than a SIMD library's vector: three lanes gain little from SIMD on a CPU, and the
//! storage stays 12 bytes, which is what meshes and film planes want.

use std::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// A displacement or direction in three dimensions. Unit length only where a document says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Vec3 {
    /// First component.
    pub x: f32,
    /// Second component.
    pub y: f32,
    /// Third component.
    pub z: f32,
}

/// A position in three dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Point3 {
    /// First coordinate.
    pub x: f32,
    /// Second coordinate.
    pub y: f32,
    /// Third coordinate.
    pub z: f32,
}

/// A surface normal: transforms by the inverse transpose. Unit length only where a document says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Normal3 {
    /// First component.
    pub x: f32,
    /// Second component.
    pub y: f32,
    /// Third component.
    pub z: f32,
}

/// A displacement in two dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Vec2 {
    /// First component.
    pub x: f32,
    /// Second component.
    pub y: f32,
}

/// A position in two dimensions: a film position, a texture coordinate, a sample in the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Point2 {
    /// First coordinate.
    pub x: f32,
    /// Second coordinate.
    pub y: f32,
}

macro_rules! tuple3 {
    ($T:ident) => {
        impl $T {
            /// All components zero.
            pub const ZERO: Self = Self::new(0.0, 0.0, 0.0);

            /// From its three components.
            #[inline]
            pub const fn new(x: f32, y: f32, z: f32) -> Self {
                Self { x, y, z }
            }

            /// The components as an array.
            #[inline]
            pub const fn to_array(self) -> [f32; 3] {
                [self.x, self.y, self.z]
            }

            /// True when no component is infinite or NaN.
            #[inline]
            pub fn is_finite(self) -> bool {
                self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
            }

            /// Component-wise minimum.
            #[inline]
            pub fn min(self, other: Self) -> Self {
                Self::new(self.x.min(other.x), self.y.min(other.y), self.z.min(other.z))
            }

            /// Component-wise maximum.
            #[inline]
            pub fn max(self, other: Self) -> Self {
                Self::new(self.x.max(other.x), self.y.max(other.y), self.z.max(other.z))
            }

            /// Component-wise absolute value.
            #[inline]
            pub fn abs(self) -> Self {
                Self::new(self.x.abs(), self.y.abs(), self.z.abs())
            }

            /// The largest component.
            #[inline]
            pub fn max_component(self) -> f32 {
                self.x.max(self.y).max(self.z)
            }

            /// Index of the component of largest value; the first of equals.
            #[inline]
            pub fn max_dimension(self) -> usize {
                if self.x >= self.y && self.x >= self.z {
                    0
                } else if self.y >= self.z {
                    1
                } else {
                    2
                }
            }
        }

        impl From<[f32; 3]> for $T {
            #[inline]
            fn from(a: [f32; 3]) -> Self {
                Self::new(a[0], a[1], a[2])
            }
        }

        impl Index<usize> for $T {
            type Output = f32;
            #[inline]
            fn index(&self, i: usize) -> &f32 {
                match i {
                    0 => &self.x,
                    1 => &self.y,
                    _ => &self.z,
                }
            }
        }

        impl IndexMut<usize> for $T {
            #[inline]
            fn index_mut(&mut self, i: usize) -> &mut f32 {
                match i {
                    0 => &mut self.x,
                    1 => &mut self.y,
                    _ => &mut self.z,
                }
            }
        }

        impl Mul<f32> for $T {
            type Output = Self;
            #[inline]
            fn mul(self, s: f32) -> Self {
                Self::new(self.x * s, self.y * s, self.z * s)
            }
        }

        impl Mul<$T> for f32 {
            type Output = $T;
            #[inline]
            fn mul(self, v: $T) -> $T {
                v * self
            }
        }

        impl Div<f32> for $T {
            type Output = Self;
            #[inline]
            fn div(self, s: f32) -> Self {
                Self::new(self.x / s, self.y / s, self.z / s)
            }
        }

        impl Neg for $T {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self::new(-self.x, -self.y, -self.z)
            }
        }
    };
}

macro_rules! sum3 {
    ($A:ident $op:ident $f:ident $B:ident = $C:ident, $sym:tt) => {
        impl $op<$B> for $A {
            type Output = $C;
            #[inline]
            fn $f(self, b: $B) -> $C {
                $C::new(self.x $sym b.x, self.y $sym b.y, self.z $sym b.z)
            }
        }
    };
}

macro_rules! assign3 {
    ($A:ident $op:ident $f:ident $B:ty, $sym:tt) => {
        impl $op<$B> for $A {
            #[inline]
            fn $f(&mut self, b: $B) {
                *self = *self $sym b;
            }
        }
    };
}

tuple3!(Vec3);
tuple3!(Point3);
tuple3!(Normal3);
sum3!(Vec3 Add add Vec3 = Vec3, +);
sum3!(Vec3 Sub sub Vec3 = Vec3, -);
sum3!(Normal3 Add add Normal3 = Normal3, +);
sum3!(Normal3 Sub sub Normal3 = Normal3, -);
sum3!(Point3 Add add Vec3 = Point3, +);
sum3!(Point3 Sub sub Vec3 = Point3, -);
sum3!(Point3 Sub sub Point3 = Vec3, -);
assign3!(Vec3 AddAssign add_assign Vec3, +);
assign3!(Vec3 SubAssign sub_assign Vec3, -);
assign3!(Vec3 MulAssign mul_assign f32, *);
assign3!(Vec3 DivAssign div_assign f32, /);
assign3!(Normal3 AddAssign add_assign Normal3, +);
assign3!(Point3 AddAssign add_assign Vec3, +);
assign3!(Point3 SubAssign sub_assign Vec3, -);

macro_rules! directions {
    ($T:ident) => {
        impl $T {
            /// Dot product with a vector.
            #[inline]
            pub fn dot(self, b: Vec3) -> f32 {
                self.x * b.x + self.y * b.y + self.z * b.z
            }

            /// Dot product with a normal.
            #[inline]
            pub fn dot_normal(self, b: Normal3) -> f32 {
                self.x * b.x + self.y * b.y + self.z * b.z
            }

            /// Squared Euclidean length.
            #[inline]
            pub fn length_squared(self) -> f32 {
                self.x * self.x + self.y * self.y + self.z * self.z
            }

            /// Euclidean length.
            #[inline]
            pub fn length(self) -> f32 {
                self.length_squared().sqrt()
            }

            /// Scaled to unit length. Non-finite for the zero vector.
            #[inline]
            pub fn normalize(self) -> Self {
                self / self.length()
            }

            /// Flipped, if need be, into the hemisphere around `reference`: the dot product is then >= 0.
            #[inline]
            pub fn face_forward(self, reference: Vec3) -> Self {
                if self.dot(reference) < 0.0 { -self } else { self }
            }
        }
    };
}

directions!(Vec3);
directions!(Normal3);

impl Vec3 {
    /// The unit vectors of the axes.
    pub const X: Self = Self::new(1.0, 0.0, 0.0);
    /// The unit vector along y.
    pub const Y: Self = Self::new(0.0, 1.0, 0.0);
    /// The unit vector along z.
    pub const Z: Self = Self::new(0.0, 0.0, 1.0);

    /// Cross product. Products are exact in `f64`, so nearly parallel vectors lose nothing to cancellation.
    #[inline]
    pub fn cross(self, b: Vec3) -> Vec3 {
        Vec3::new(
            difference_of_products(self.y, b.z, self.z, b.y),
            difference_of_products(self.z, b.x, self.x, b.z),
            difference_of_products(self.x, b.y, self.y, b.x),
        )
    }

    /// The same components taken as a normal.
    #[inline]
    pub const fn as_normal(self) -> Normal3 {
        Normal3::new(self.x, self.y, self.z)
    }

    /// The same components taken as a position.
    #[inline]
    pub const fn as_point(self) -> Point3 {
        Point3::new(self.x, self.y, self.z)
    }
}

impl Normal3 {
    /// The same components taken as a vector.
    #[inline]
    pub const fn as_vec(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }
}

impl Point3 {
    /// The vector from the origin to this point.
    #[inline]
    pub const fn as_vec(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }

    /// Distance to another point.
    #[inline]
    pub fn distance(self, b: Point3) -> f32 {
        (self - b).length()
    }

    /// Squared distance to another point.
    #[inline]
    pub fn distance_squared(self, b: Point3) -> f32 {
        (self - b).length_squared()
    }

    /// `self` at t = 0 and `b` at t = 1.
    #[inline]
    pub fn lerp(self, b: Point3, t: f32) -> Point3 {
        Point3::new((1.0 - t) * self.x + t * b.x, (1.0 - t) * self.y + t * b.y, (1.0 - t) * self.z + t * b.z)
    }
}

/// `a*b - c*d`, each product exact in `f64`, rounded once to `f32`.
///
/// The naive form loses all digits when the products nearly cancel (Kahan's problem); a fused multiply-add would
/// do, but its availability depends on the CPU and so would the bits.
#[inline]
pub fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    (a as f64 * b as f64 - c as f64 * d as f64) as f32
}

/// `a*b + c*d`, each product exact in `f64`, rounded once to `f32`.
#[inline]
pub fn sum_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    (a as f64 * b as f64 + c as f64 * d as f64) as f32
}

macro_rules! tuple2 {
    ($T:ident) => {
        impl $T {
            /// All components zero.
            pub const ZERO: Self = Self::new(0.0, 0.0);

            /// From its two components.
            #[inline]
            pub const fn new(x: f32, y: f32) -> Self {
                Self { x, y }
            }

            /// The components as an array.
            #[inline]
            pub const fn to_array(self) -> [f32; 2] {
                [self.x, self.y]
            }

            /// True when no component is infinite or NaN.
            #[inline]
            pub fn is_finite(self) -> bool {
                self.x.is_finite() && self.y.is_finite()
            }
        }

        impl From<[f32; 2]> for $T {
            #[inline]
            fn from(a: [f32; 2]) -> Self {
                Self::new(a[0], a[1])
            }
        }

        impl Index<usize> for $T {
            type Output = f32;
            #[inline]
            fn index(&self, i: usize) -> &f32 {
                if i == 0 { &self.x } else { &self.y }
            }
        }

        impl Mul<f32> for $T {
            type Output = Self;
            #[inline]
            fn mul(self, s: f32) -> Self {
                Self::new(self.x * s, self.y * s)
            }
        }

        impl Div<f32> for $T {
            type Output = Self;
            #[inline]
            fn div(self, s: f32) -> Self {
                Self::new(self.x / s, self.y / s)
            }
        }

        impl Add<Vec2> for $T {
            type Output = Self;
            #[inline]
            fn add(self, b: Vec2) -> Self {
                Self::new(self.x + b.x, self.y + b.y)
            }
        }

        impl Sub<Vec2> for $T {
            type Output = Self;
            #[inline]
            fn sub(self, b: Vec2) -> Self {
                Self::new(self.x - b.x, self.y - b.y)
            }
        }
    };
}

tuple2!(Vec2);
tuple2!(Point2);

impl Vec2 {
    /// Squared Euclidean length.
    #[inline]
    pub fn length_squared(self) -> f32 {
        self.x * self.x + self.y * self.y
    }

    /// Euclidean length.
    #[inline]
    pub fn length(self) -> f32 {
        self.length_squared().sqrt()
    }
}

impl Sub for Point2 {
    type Output = Vec2;
    #[inline]
    fn sub(self, b: Point2) -> Vec2 {
        Vec2::new(self.x - b.x, self.y - b.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cross_of_nearly_parallel_vectors_keeps_its_digits() {
        let a = Vec3::new(33_962.035, 41_563.4, 7_706.415);
        let b = Vec3::new(-24_871.969, -30_438.8, -5_643.727);
        let c = a.cross(b);
        // Exact values, rounded to f32 (Kahan's example, after Shewchuk).
        let exact = |p: f32, q: f32, r: f32, s: f32| (p as f64 * q as f64 - r as f64 * s as f64) as f32;
        assert_eq!(c.x, exact(a.y, b.z, a.z, b.y));
        assert!(c.is_finite() && c.length() > 0.0);
    }

    #[test]
    fn face_forward_agrees_with_the_reference() {
        let n = Normal3::new(0.0, 0.0, -1.0).face_forward(Vec3::Z);
        assert_eq!(n, Normal3::new(0.0, 0.0, 1.0));
    }
}
