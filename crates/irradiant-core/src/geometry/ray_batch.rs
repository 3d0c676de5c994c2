//! Many rays that are traced in one call, in memory that is kept from one batch to the next.
//!
//! They are put down as the tree wants them. Arrays made anew for each call, and filled with nothing first, took 5 % of the Cornell box: most batches are
//! of few rays, the last of their paths.

use super::accel::GroupLeaves;
use super::{AlphaTextures, Geometry, Hit, hit_of};
use irradiant_bvh as bvh;
use irradiant_math::lanes::{Floats, LANES, Triples};
use irradiant_math::{Point3, Vec3};

/// Rays with their ends, [`LANES`] at most, and room for what they meet.
#[derive(Clone, Debug)]
pub struct RayBatch {
    n: usize,
    rays: [bvh::Ray; LANES],
    closest: [Option<bvh::Closest<Hit>>; LANES],
    blocked: [bool; LANES],
}

impl RayBatch {
    /// Of no rays yet.
    pub const NONE: Self = Self {
        n: 0,
        rays: [bvh::Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 }; LANES],
        closest: [None; LANES],
        blocked: [false; LANES],
    };

    /// How many there are.
    #[inline]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Forgets all rays.
    #[inline]
    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds a ray up to `t_max`, in lengths of its direction.
    ///
    /// # Panics
    /// If there are [`LANES`] already.
    #[inline(always)]
    pub fn push(&mut self, o: Point3, d: Vec3, t_max: f32, time: f32) {
        self.rays[self.n] = bvh::Ray { o: o.to_array(), t_max, d: d.to_array(), time };
        self.n += 1;
    }

    /// Whether anything is in the way of a ray, once [`Geometry::occluded_rays`] has been asked.
    #[inline(always)]
    pub fn is_blocked(&self, ray: usize) -> bool {
        self.blocked[ray]
    }

    /// Holds the first `n` of these, each up to its `t_max`, instead of what there was; [`LANES`] at most.
    #[inline(always)]
    pub fn take(&mut self, n: usize, o: &Triples, d: &Triples, time: &Floats, t_max: impl Fn(usize) -> f32) {
        self.n = n.min(LANES);
        for (i, ray) in self.rays.iter_mut().enumerate().take(n) {
            *ray =
                bvh::Ray { o: [o.x[i], o.y[i], o.z[i]], t_max: t_max(i), d: [d.x[i], d.y[i], d.z[i]], time: time[i] };
        }
    }
}

impl Geometry {
    /// What [`Geometry::intersect`] gives for each ray of a batch, to the bit. Of rays that go anywhere (`scattered`: bounces) those of large trees
    /// are traced one by one.
    ///
    /// # Panics
    /// If there is not one of `hits` for each ray.
    pub fn intersect_rays(
        &self,
        batch: &mut RayBatch,
        scattered: bool,
        alpha: &impl AlphaTextures,
        hits: &mut [Option<Hit>],
    ) {
        assert_eq!(batch.n, hits.len(), "one answer for each ray");
        let group = &self.groups[0];
        let leaves = GroupLeaves { geometry: self, group, alpha };
        let RayBatch { rays, closest, .. } = batch;
        if scattered && !self.sorts_rays() {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = group.tree.intersect(self.level, ray, &leaves).map(hit_of);
            }
            return;
        }
        let (rays, closest) = (&rays[..hits.len()], &mut closest[..hits.len()]);
        group.tree.intersect_batch(self.level, rays, &leaves, closest);
        for (hit, closest) in hits.iter_mut().zip(closest) {
            *hit = closest.map(hit_of);
        }
    }

    /// Finds out what [`Geometry::occluded`] says of each ray of a batch: [`RayBatch::is_blocked`].
    pub fn occluded_rays(&self, batch: &mut RayBatch, alpha: &impl AlphaTextures) {
        let group = &self.groups[0];
        let leaves = GroupLeaves { geometry: self, group, alpha };
        let RayBatch { n, rays, blocked, .. } = batch;
        group.tree.occluded_batch(self.level, &rays[..*n], &leaves, &mut blocked[..*n]);
    }
}
