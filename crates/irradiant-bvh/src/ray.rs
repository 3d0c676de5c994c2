//! What a query takes and gives back, and what the caller supplies for primitives that are not triangles.

use crate::lanes::Lanes;

/// A ray `o + t d` for `t` in the open interval (0, `t_max`).
///
/// `d` need not be of unit length: `t` counts lengths of `d`. A ray with a NaN or infinite `o` or `d`, a zero `d`,
/// or a `t_max` that is NaN or not positive meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Origin, in the space of the tree.
    pub o: [f32; 3],
    /// Exclusive end of the ray, in lengths of `d`; may be infinite.
    pub t_max: f32,
    /// Direction, any length whose reciprocal is a finite `f32`.
    pub d: [f32; 3],
    /// Time, handed to user primitives untouched.
    pub time: f32,
}

impl Ray {
    /// Origin and direction in a register each, read at once; the fourth lanes are `t_max` and `time`.
    #[inline(always)]
    pub(crate) fn lanes<F: Lanes<Array = [f32; 4]>>(&self) -> (F, F) {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.o, self.d);
        (F::load(&[ox, oy, oz, self.t_max]), F::load(&[dx, dy, dz, self.time]))
    }

    /// Origin with end, and direction with time, where they are: what is read number by number the compiler gathers, which is slow.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub(crate) fn rows(&self) -> (&[f32; 4], &[f32; 4]) {
        const { assert!(size_of::<Self>() == 32) };
        // SAFETY: a ray is eight floats one after the other, as written above. Guard: `rays_are_rows_of_numbers`.
        let [first, last] = unsafe { &*std::ptr::from_ref(self).cast::<[[f32; 4]; 2]>() };
        (first, last)
    }
}

/// Where a ray meets a triangle.
///
/// With vertices `p0, p1, p2` as given in the index triple, the point is `(1 - u - v) p0 + u p1 + v p2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's `d`; greater than its own rounding error.
    pub t: f32,
    /// Barycentric weight of vertex 1.
    pub u: f32,
    /// Barycentric weight of vertex 2.
    pub v: f32,
    /// Index of the triangle, counted over all meshes of the build list in order.
    pub primitive: u32,
}

/// The closest thing a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closest<U> {
    /// A triangle.
    Triangle(Hit),
    /// A user primitive.
    User {
        /// Distance in lengths of the ray's `d`, as the callback returned it.
        t: f32,
        /// Index into [`BuildInput::user_boxes`](crate::BuildInput::user_boxes).
        user: u32,
        /// What the callback returned.
        hit: U,
    },
}

impl<U> Closest<U> {
    /// Distance along the ray, in lengths of its `d`.
    #[inline]
    pub fn t(&self) -> f32 {
        match self {
            Self::Triangle(hit) => hit.t,
            Self::User { t, .. } => *t,
        }
    }
}

/// What the caller knows about its primitives: how to test user primitives, and which triangle hits count.
///
/// Every method must be a pure function of its arguments, or results will depend on the order of traversal.
pub trait Leaves {
    /// Whatever the caller wants back for a user primitive.
    type UserHit: Copy;

    /// Whether [`accept`](Self::accept) is asked about flagged triangles; if `false` the question is compiled out.
    const HAS_FILTER: bool = false;

    /// The first hit of user primitive `user` with `0 < t < ray.t_max`.
    ///
    /// `ray.t_max` is one step above the closest `t` so far, so that equal distances are reported and the tie can be
    /// broken by [`precedes`](Self::precedes).
    fn intersect(&self, user: u32, ray: &Ray) -> Option<(f32, Self::UserHit)>;

    /// Whether user primitive `user` has any hit with `0 < t < ray.t_max`.
    fn occluded(&self, user: u32, ray: &Ray) -> bool;

    /// Of hits of two user primitives at exactly the same `t`, whether `a` counts rather than `b`.
    ///
    /// To be written where parts of one instance are user primitives: then by what was met inside.
    #[inline]
    fn precedes(&self, a: (u32, &Self::UserHit), b: (u32, &Self::UserHit)) -> bool {
        a.0 < b.0
    }

    /// For each ray what [`intersect`](Self::intersect) gives: `hits[i]` answers `rays[i]`, and is `None` before. Asked for
    /// rays of a batch that travel together, at most sixteen; worth writing for instances.
    #[inline]
    fn intersect_many(&self, user: u32, rays: &[Ray], hits: &mut [Option<(f32, Self::UserHit)>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(user, ray);
        }
    }

    /// For each ray what [`occluded`](Self::occluded) says: `out[i]` answers `rays[i]`, and is `false` before.
    #[inline]
    fn occluded_many(&self, user: u32, rays: &[Ray], out: &mut [bool]) {
        for (ray, out) in rays.iter().zip(out) {
            *out = self.occluded(user, ray);
        }
    }

    /// Whether a hit of a triangle of a mesh flagged [`filtered`](crate::Mesh::filtered) counts (alpha cut-outs).
    ///
    /// Called for each candidate in any order, perhaps twice for the same one.
    #[inline]
    fn accept(&self, triangle: u32, ray: &Ray, t: f32, u: f32, v: f32) -> bool {
        let _ = (triangle, ray, t, u, v);
        true
    }
}

/// Leaves of a tree without user primitives or filter.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrianglesOnly;

impl Leaves for TrianglesOnly {
    type UserHit = ();

    #[inline]
    fn intersect(&self, _user: u32, _ray: &Ray) -> Option<(f32, ())> {
        None
    }

    #[inline]
    fn occluded(&self, _user: u32, _ray: &Ray) -> bool {
        false
    }
}

#[cfg(test)]
#[test]
fn rays_are_rows_of_numbers() {
    let ray = Ray { o: [1.0, 2.0, 3.0], t_max: 4.0, d: [5.0, 6.0, 7.0], time: 8.0 };
    assert_eq!(ray.rows(), (&[1.0, 2.0, 3.0, 4.0], &[5.0, 6.0, 7.0, 8.0]));
}
