//! Disks at a height z, with a hole, swept about z.
//!
//! Parametrisation as pbrt-v4: u along phi, v from the rim (0) to the hole (1). The normal is +z of shape space.

use super::placement::{Double3, Parametric, Placed, Placement};
use super::sphere::{azimuth, sweep};
use irradiant_math::{Bounds3, Point2, Ray};
use std::f32::consts::TAU;

/// A disk of shape space with its place.
#[derive(Clone, Debug)]
pub(crate) struct Disk {
    pub height: f64,
    pub radius: f64,
    pub inner: f64,
    /// Radians.
    pub phi_max: f32,
    pub placement: Placement,
}

impl Disk {
    /// `radius` > 0; `phi_max` in degrees, clamped to [0, 360].
    pub fn new(height: f32, radius: f32, inner: f32, phi_max: f32, placement: Placement) -> Self {
        Self { height: height as f64, radius: radius as f64, inner: inner as f64, phi_max: sweep(phi_max), placement }
    }

    /// Neither a hole nor a missing sector.
    pub fn is_whole(&self) -> bool {
        self.inner <= 0.0 && self.phi_max >= TAU
    }

    pub fn bounds(&self) -> Bounds3 {
        self.placement.disc_bounds(self.radius, self.height)
    }

    /// Where the ray meets the plane, if it is inside the disk there.
    #[inline]
    pub fn meet(&self, o: Double3, d: Double3) -> Option<(f64, Double3)> {
        let t = (self.height - o[2]) / d[2];
        // A ray in the plane gives an infinity or a NaN.
        if !t.is_finite() {
            return None;
        }
        let p = [o[0] + t * d[0], o[1] + t * d[1], self.height];
        let r2 = p[0] * p[0] + p[1] * p[1];
        let inside = r2 <= self.radius * self.radius
            && r2 >= self.inner * self.inner
            && (self.phi_max >= TAU || azimuth(p) <= self.phi_max);
        inside.then_some((t, p))
    }

    /// Surface parameters of a point of the disk.
    #[inline]
    pub fn uv(&self, p: Double3) -> Point2 {
        let r = (p[0] * p[0] + p[1] * p[1]).sqrt();
        let v = ((self.radius - r) / (self.radius - self.inner)) as f32;
        Point2::new((azimuth(p) / self.phi_max).min(1.0), v.clamp(0.0, 1.0))
    }

    /// The hit of `ray`.
    pub fn place(&self, ray: &Ray) -> Option<Placed> {
        let (o, d) = self.placement.ray_to_shape(ray);
        let (_, p) = self.meet(o, d)?;
        let uv = self.uv(p);
        // In the middle phi is undefined: step off it, so that the derivatives span the plane.
        let x = if p[0] == 0.0 && p[1] == 0.0 { 1e-5 * self.radius } else { p[0] };
        let r = (x * x + p[1] * p[1]).sqrt();
        let phi_max = self.phi_max as f64;
        let along = (self.inner - self.radius) / r;
        Some(self.placement.place(&Parametric {
            p,
            n: [0.0, 0.0, 1.0],
            uv,
            dpdu: [-phi_max * p[1], phi_max * x, 0.0],
            dpdv: [x * along, p[1] * along, 0.0],
            dndu: [0.0; 3],
            dndv: [0.0; 3],
        }))
    }
}
