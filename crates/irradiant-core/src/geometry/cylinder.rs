//! Open cylinders around z, swept about z.
//!
//! Parametrisation as pbrt-v4: u along phi, v along z from z_min to z_max. Solved like a sphere (see there) in x and y.

use super::placement::{Double3, Parametric, Placed, Placement};
use super::sphere::{Roots, azimuth, quadric_roots, sweep};
use irradiant_math::{Bounds3, Point2, Ray};
use std::f32::consts::TAU;

/// A cylinder of shape space with its place.
#[derive(Clone, Debug)]
pub(crate) struct Cylinder {
    pub radius: f64,
    pub z_min: f64,
    pub z_max: f64,
    /// Radians.
    pub phi_max: f32,
    pub placement: Placement,
}

impl Cylinder {
    /// `radius` > 0; z limits in either order; `phi_max` in degrees, clamped to [0, 360].
    pub fn new(radius: f32, z_min: f32, z_max: f32, phi_max: f32, placement: Placement) -> Self {
        Self {
            radius: radius as f64,
            z_min: z_min.min(z_max) as f64,
            z_max: z_min.max(z_max) as f64,
            phi_max: sweep(phi_max),
            placement,
        }
    }

    pub fn bounds(&self) -> Bounds3 {
        let end = |z| self.placement.disc_bounds(self.radius, z);
        end(self.z_min).union(end(self.z_max))
    }

    /// Both roots, nearer first, whatever their sign; not yet cut. `None` along the axis.
    #[inline]
    pub fn roots(&self, o: Double3, d: Double3) -> Option<Roots> {
        let rho = |x: f64, y: f64| (x * x + y * y).sqrt();
        let a = d[0] * d[0] + d[1] * d[1];
        let b = o[0] * d[0] + o[1] * d[1];
        quadric_roots(a, b, rho(o[0], o[1]), self.radius, |t| rho(o[0] + t * d[0], o[1] + t * d[1]))
    }

    /// The point at `t`, brought back to the surface, unless it is cut off.
    #[inline]
    pub fn point(&self, o: Double3, d: Double3, t: f64) -> Option<Double3> {
        let p = self.project([o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]);
        let kept = p[2] >= self.z_min && p[2] <= self.z_max && (self.phi_max >= TAU || azimuth(p) <= self.phi_max);
        kept.then_some(p)
    }

    fn project(&self, p: Double3) -> Double3 {
        let s = self.radius / (p[0] * p[0] + p[1] * p[1]).sqrt();
        [p[0] * s, p[1] * s, p[2]]
    }

    /// Surface parameters of a point of the cylinder.
    #[inline]
    pub fn uv(&self, p: Double3) -> Point2 {
        let v = ((p[2] - self.z_min) / (self.z_max - self.z_min)) as f32;
        Point2::new((azimuth(p) / self.phi_max).min(1.0), v.clamp(0.0, 1.0))
    }

    /// The hit of `ray` at root number `root` (0 or 1).
    pub fn place(&self, ray: &Ray, root: usize) -> Option<Placed> {
        let (o, d) = self.placement.ray_to_shape(ray);
        let t = self.roots(o, d)?[root];
        let p = self.project([o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]);
        let phi_max = self.phi_max as f64;
        let r = self.radius;
        let dpdu = [-phi_max * p[1], phi_max * p[0], 0.0];
        Some(self.placement.place(&Parametric {
            p,
            n: [p[0] / r, p[1] / r, 0.0],
            uv: self.uv(p),
            dpdu,
            dpdv: [0.0, 0.0, self.z_max - self.z_min],
            dndu: [dpdu[0] / r, dpdu[1] / r, 0.0],
            dndv: [0.0; 3],
        }))
    }
}
