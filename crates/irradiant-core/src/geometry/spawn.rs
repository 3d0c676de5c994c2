//! Rays that leave a hit, and segments between two.

use crate::interaction::{Interaction, ReferencePoint};
use irradiant_math::{Normal3, Point3, Ray, Vec3, gamma, offset_ray_origin};

impl Interaction {
    /// A ray from here in direction `w`, starting beyond the error of this point on the side that `w` points to.
    #[inline]
    pub fn spawn_ray(&self, w: Vec3) -> Ray {
        Ray::new(offset_ray_origin(self.p, self.p_error, self.n, w), w, self.time)
    }

    /// The segment from here (t = 0) to a point of another surface (t = 1, exclusive), both ends beyond their errors on
    /// the sides that face each other. `n` is zero for a point in space, which needs no offset.
    #[inline(always)]
    pub fn spawn_ray_to(&self, p: Point3, p_error: Vec3, n: Normal3) -> Ray {
        self.reference().spawn_ray_to(p, p_error, n, self.time)
    }
}

impl ReferencePoint {
    /// As [`Interaction::spawn_ray`].
    #[inline]
    pub fn spawn_ray(&self, w: Vec3, time: f32) -> Ray {
        Ray::new(offset_ray_origin(self.p, self.p_error, self.n, w), w, time)
    }

    /// As [`Interaction::spawn_ray_to`].
    #[inline(always)]
    pub fn spawn_ray_to(&self, p: Point3, p_error: Vec3, n: Normal3, time: f32) -> Ray {
        let (o, d) = segment((self.p, self.p_error, self.n), (p, p_error, n));
        Ray::new(o, d, time)
    }
}

/// Origin and direction of a segment between two points with their errors and normals.
#[inline(always)]
pub(crate) fn segment(from: (Point3, Vec3, Normal3), to: (Point3, Vec3, Normal3)) -> (Point3, Vec3) {
    let (p, p_error, n) = to;
    let o = offset_ray_origin(from.0, from.1, from.2, p - from.0);
    let back = o - p;
    // The direction is a rounded difference, and the t of a hit is rounded too: both in proportion to the length.
    // Where pbrt stops every segment at 0.9999, this stops it where those errors do.
    let error = p_error + back.abs() * gamma(8);
    (o, offset_ray_origin(p, error, n, back) - o)
}
