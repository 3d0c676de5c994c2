//! Groups placed in the scene: still or moving.
//!
//! The map that rays take into the group is the truth; the map back is its inverse up to rounding, which the error bounds
//! of a hit include. So a ray that leaves a hit of an instance starts on the right side of its surface in the group's
//! space too.

use crate::interaction::Interaction;
use irradiant_bvh as bvh;
use irradiant_math::{Affine, AnimatedTransform, Bounds3, Normal3, Point3, Vec3, gamma};

/// A ray outside, as the space inside sees it; parameters stay the same.
#[inline]
pub(crate) fn ray_inside(to: &Affine, ray: &bvh::Ray) -> bvh::Ray {
    bvh::Ray {
        o: to.inverse_point(ray.o.into()).to_array(),
        t_max: ray.t_max,
        d: to.inverse_vector(ray.d.into()).to_array(),
        time: ray.time,
    }
}

/// A point of the space inside with its error, as seen outside, such that going in again is within the error too.
fn point_outside(to: &Affine, p: Point3, error: Vec3) -> (Point3, Vec3) {
    // What coming back in rounds and the two maps' disagreement lose, in the space inside ...
    let (_, back) = to.inverse_point_with_error(to.point(p), Vec3::ZERO);
    let inside = error + (back + p.abs().as_vec() * gamma(1)) * 2.0;
    // ... is magnified on the way out, and rounded.
    to.point_with_error(p, inside)
}

/// A hit inside, brought outside.
pub(crate) fn interaction_outside(to: &Affine, at: &mut Interaction) {
    (at.p, at.p_error) = point_outside(to, at.p, at.p_error);
    let unit = |n: Normal3| {
        let m = to.normal(n);
        let per_length = 1.0 / m.length();
        (m * per_length, per_length)
    };
    at.n = unit(at.n).0;
    let (ns, per_length) = unit(at.ns);
    at.ns = ns.face_forward(at.n.as_vec());
    for v in [&mut at.dpdu, &mut at.dpdv, &mut at.dpdus, &mut at.dpdvs] {
        *v = to.vector(*v);
    }
    // The derivative of the normalised normal, up to its part along the normal itself.
    for v in [&mut at.dndus, &mut at.dndvs] {
        *v = to.normal(*v) * per_length;
    }
}

/// Where a group stands.
#[derive(Clone, Debug)]
pub(crate) enum Motion {
    Still(Affine),
    Moving(Box<AnimatedTransform>),
}

impl Motion {
    /// A box around all that a box inside may become.
    pub fn bounds(&self, b: &Bounds3) -> Bounds3 {
        match self {
            Self::Still(affine) => affine.bounds(b),
            Self::Moving(motion) => motion.motion_bounds(b),
        }
    }
}

/// A group placed in another.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub group: u32,
    pub motion: Motion,
}

impl Instance {
    /// The map at a time.
    #[inline]
    pub fn at(&self, time: f32) -> Affine {
        match &self.motion {
            Motion::Still(affine) => *affine,
            Motion::Moving(motion) => motion.at(time),
        }
    }

    /// A ray outside, as the group sees it.
    #[inline]
    pub fn ray_to_group(&self, ray: &bvh::Ray) -> bvh::Ray {
        match &self.motion {
            Motion::Still(affine) => ray_inside(affine, ray),
            Motion::Moving(motion) => ray_inside(&motion.at(ray.time), ray),
        }
    }
}
