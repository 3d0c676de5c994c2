//! Axis-aligned boxes.

use crate::vector::{Point2, Point3, Vec3};

/// An axis-aligned box in three dimensions; empty when `min > max` in any dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds3 {
    /// Least corner.
    pub min: Point3,
    /// Greatest corner.
    pub max: Point3,
}

/// An axis-aligned box in two dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds2 {
    /// Least corner.
    pub min: Point2,
    /// Greatest corner.
    pub max: Point2,
}

impl Bounds3 {
    /// The empty box: the identity of [`Bounds3::union`].
    pub const EMPTY: Self = Self {
        min: Point3::new(f32::INFINITY, f32::INFINITY, f32::INFINITY),
        max: Point3::new(f32::NEG_INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY),
    };

    /// The box spanned by two corners, given in any order.
    pub fn new(a: Point3, b: Point3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// The smallest box around some points.
    pub fn from_points(points: impl IntoIterator<Item = Point3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// Grown to include a point.
    #[inline]
    pub fn including(self, p: Point3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The smallest box around both.
    #[inline]
    pub fn union(self, b: Self) -> Self {
        Self { min: self.min.min(b.min), max: self.max.max(b.max) }
    }

    /// True when no point is inside.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// From least to greatest corner.
    #[inline]
    pub fn diagonal(&self) -> Vec3 {
        self.max - self.min
    }

    /// The middle.
    #[inline]
    pub fn center(&self) -> Point3 {
        Point3::new(0.5 * (self.min.x + self.max.x), 0.5 * (self.min.y + self.max.y), 0.5 * (self.min.z + self.max.z))
    }

    /// Surface area; 0 for an empty box.
    pub fn surface_area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.diagonal();
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// True when `p` is inside or on the boundary.
    #[inline]
    pub fn contains(&self, p: Point3) -> bool {
        self.min.x <= p.x
            && p.x <= self.max.x
            && self.min.y <= p.y
            && p.y <= self.max.y
            && self.min.z <= p.z
            && p.z <= self.max.z
    }

    /// Corner `i` in 0..8; bit 0 chooses max x, bit 1 max y, bit 2 max z.
    pub fn corner(&self, i: usize) -> Point3 {
        Point3::new(
            if i & 1 == 0 { self.min.x } else { self.max.x },
            if i & 2 == 0 { self.min.y } else { self.max.y },
            if i & 4 == 0 { self.min.z } else { self.max.z },
        )
    }

    /// Centre and radius of a sphere that contains the box; radius 0 for an empty box.
    pub fn bounding_sphere(&self) -> (Point3, f32) {
        if self.is_empty() {
            return (Point3::ZERO, 0.0);
        }
        let center = self.center();
        (center, center.distance(self.max))
    }
}

impl Bounds2 {
    /// The box spanned by two corners, given in any order.
    pub fn new(a: Point2, b: Point2) -> Self {
        Self { min: Point2::new(a.x.min(b.x), a.y.min(b.y)), max: Point2::new(a.x.max(b.x), a.y.max(b.y)) }
    }

    /// Width times height.
    pub fn area(&self) -> f32 {
        (self.max.x - self.min.x) * (self.max.y - self.min.y)
    }

    /// True when `p` is inside or on the boundary.
    pub fn contains(&self, p: Point2) -> bool {
        self.min.x <= p.x && p.x <= self.max.x && self.min.y <= p.y && p.y <= self.max.y
    }

    /// The point at fractions `t` of the way from `min` to `max`.
    pub fn lerp(&self, t: Point2) -> Point2 {
        Point2::new(self.min.x + t.x * (self.max.x - self.min.x), self.min.y + t.y * (self.max.y - self.min.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_is_the_identity_of_union() {
        let b = Bounds3::new(Point3::new(1.0, 2.0, 3.0), Point3::new(-1.0, 0.0, 5.0));
        assert_eq!(b.union(Bounds3::EMPTY), b);
        assert!(Bounds3::EMPTY.is_empty() && !b.is_empty());
        assert_eq!(Bounds3::EMPTY.surface_area(), 0.0);
        assert_eq!(b.surface_area(), 2.0 * (4.0 + 4.0 + 4.0));
    }
}
