//! Light drawn towards many surfaces side by side, and the rays that ask for what is in the way.

use super::{LightSample, LightTarget};
use crate::geometry::segment;
use crate::geometry::{RayBatch, SurfaceLanes};
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_math::{Normal3, Point3, Vec3, offset_ray_origin};

/// Where the light of each lane comes from, and the segment or ray there.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct TargetLanes {
    /// Directions of the light, unit.
    pub wi: Triples,
    /// Densities, 1/sr; 0 where there is nothing.
    pub pdf: Floats,
    pub(crate) p: Triples,
    pub(crate) p_error: Triples,
    pub(crate) n: Triples,
    pub(crate) is_infinite: [u32; LANES],
    o: Triples,
    d: Triples,
}

impl TargetLanes {
    /// Nothing yet.
    pub const NONE: Self = Self {
        wi: Triples::ZERO,
        pdf: [0.0; LANES],
        p: Triples::ZERO,
        p_error: Triples::ZERO,
        n: Triples::ZERO,
        is_infinite: [0; LANES],
        o: Triples::ZERO,
        d: Triples::ZERO,
    };

    /// Sets a lane to light that was drawn alone.
    pub fn set(&mut self, i: usize, sample: &LightSample) {
        self.wi.set(i, sample.wi.to_array());
        self.pdf[i] = sample.pdf;
        let (p, p_error, n) = match sample.target {
            LightTarget::Point(p) => (p, Vec3::ZERO, Normal3::ZERO),
            LightTarget::Surface { p, p_error, n, .. } => (p, p_error, n),
            LightTarget::Infinite => (Point3::ZERO, Vec3::ZERO, Normal3::ZERO),
        };
        self.p.set(i, p.to_array());
        self.p_error.set(i, p_error.to_array());
        self.n.set(i, n.to_array());
        self.is_infinite[i] = u32::from(matches!(sample.target, LightTarget::Infinite));
    }

    /// For `n` lanes the rays that [`Scene::is_occluded`](crate::scene::Scene::is_occluded) traces, to the bit.
    #[inline(always)]
    pub fn aim(&mut self, n: usize, at: &SurfaceLanes) {
        for i in whole(n) {
            let (p, p_error, n, wi) = (at.p.point(i), at.p_error.vector(i), at.n.normal(i), self.wi.vector(i));
            let away = offset_ray_origin(p, p_error, n, wi);
            let (o, d) = segment((p, p_error, n), (self.p.point(i), self.p_error.vector(i), self.n.normal(i)));
            let is_infinite = self.is_infinite[i] != 0;
            let choose = |a: f32, b: f32| if is_infinite { a } else { b };
            self.o.set(i, [choose(away.x, o.x), choose(away.y, o.y), choose(away.z, o.z)]);
            self.d.set(i, [choose(wi.x, d.x), choose(wi.y, d.y), choose(wi.z, d.z)]);
        }
    }

    /// Takes the ray of a lane that has been aimed from another, if it `is_taken`.
    #[inline(always)]
    pub fn keep(&mut self, i: usize, from: &Self, is_taken: bool) {
        let choose = |a: f32, b: f32| if is_taken { a } else { b };
        for (to, from) in [(&mut self.o, &from.o), (&mut self.d, &from.d)] {
            let (a, b) = (from.vector(i), to.vector(i));
            to.set(i, [choose(a.x, b.x), choose(a.y, b.y), choose(a.z, b.z)]);
        }
        self.is_infinite[i] = if is_taken { from.is_infinite[i] } else { self.is_infinite[i] };
    }

    /// Adds the ray of a lane.
    #[inline(always)]
    pub fn put_ray(&self, i: usize, time: f32, rays: &mut RayBatch) {
        let end = if self.is_infinite[i] != 0 { f32::INFINITY } else { 1.0 };
        rays.push(self.o.point(i), self.d.vector(i), end, time);
    }
}
