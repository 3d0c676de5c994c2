//! Many rays in one call.

use crate::level::Level;
use crate::node::Bvh;
use crate::ray::{Closest, Leaves, Ray};

impl Bvh {
    /// For each ray what [`intersect`](Self::intersect) gives, to the bit; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where neighbours in `rays` travel together.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn intersect_batch<L: Leaves>(
        &self,
        level: Level,
        rays: &[Ray],
        leaves: &L,
        out: &mut [Option<Closest<L::UserHit>>],
    ) {
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        for (ray, out) in rays.iter().zip(out) {
            *out = self.intersect(level, ray, leaves);
        }
    }

    /// For each ray what [`occluded`](Self::occluded) says; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where neighbours in `rays` travel together.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn occluded_batch<L: Leaves>(&self, level: Level, rays: &[Ray], leaves: &L, out: &mut [bool]) {
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        for (ray, out) in rays.iter().zip(out) {
            *out = self.occluded(level, ray, leaves);
        }
    }
}
