//! Rays.

use crate::vector::{Point3, Vec3};

/// Half of a line: origin, direction, time.
///
/// `d` need not be unit length; ray parameters are in units of its length. Camera and scattered rays have unit `d`;
/// rays in an instance's own space do not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub o: Point3,
    /// Direction.
    pub d: Vec3,
    /// Shutter time in the scene's time units.
    pub time: f32,
}

impl Ray {
    /// A ray from its parts.
    #[inline]
    pub const fn new(o: Point3, d: Vec3, time: f32) -> Self {
        Self { o, d, time }
    }

    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Point3 {
        self.o + self.d * t
    }
}
