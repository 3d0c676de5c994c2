//! Spheres, whole or cut by z and by a sweep about z.
//!
//! Parametrisation as pbrt-v4: u along phi in [0, phi_max], v along theta from z_min to z_max. The quadratic is solved in
//! `f64` in the form that loses nothing where the ray starts near the surface (Press et al., Numerical Recipes, 5.6.4),
//! with the discriminant from the distance of closest approach (Haines et al. 2019, Ray Tracing Gems, chapter 7).

use super::placement::{Double3, Parametric, Placed, Placement, add, dot, length, scale};
use irradiant_math::{Bounds3, Point2, Ray, elementary};
use std::f32::consts::TAU;

/// Candidate ray parameters, nearer first.
pub(crate) type Roots = [f64; 2];

/// What a ray misses by this share of its squared distance from the centre it misses whatever was rounded: 10^6 roundings.
const CLEARLY: f64 = 1e-10;

/// A sphere of shape space with its place.
#[derive(Clone, Debug)]
pub(crate) struct Sphere {
    pub radius: f64,
    pub z_min: f64,
    pub z_max: f64,
    theta_z_min: f32,
    theta_z_max: f32,
    /// Radians.
    pub phi_max: f32,
    pub placement: Placement,
}

impl Sphere {
    /// `radius` > 0; z limits in either order, clamped to the sphere; `phi_max` in degrees, clamped to [0, 360].
    pub fn new(radius: f32, z_min: f32, z_max: f32, phi_max: f32, placement: Placement) -> Self {
        let (low, high) = (z_min.min(z_max).clamp(-radius, radius), z_min.max(z_max).clamp(-radius, radius));
        Self {
            radius: radius as f64,
            z_min: low as f64,
            z_max: high as f64,
            theta_z_min: elementary::safe_acos(low / radius),
            theta_z_max: elementary::safe_acos(high / radius),
            phi_max: sweep(phi_max),
            placement,
        }
    }

    /// Nothing is cut off.
    pub fn is_whole(&self) -> bool {
        self.z_min <= -self.radius && self.z_max >= self.radius && self.phi_max >= TAU
    }

    pub fn bounds(&self) -> Bounds3 {
        let ball = self.placement.ball_bounds(self.radius);
        let r = self.radius;
        let boxed = self.placement.box_bounds([-r, -r, self.z_min], [r, r, self.z_max]);
        Bounds3 { min: ball.min.max(boxed.min), max: ball.max.min(boxed.max) }
    }

    /// Both roots, nearer first, whatever their sign; not yet cut.
    #[inline]
    pub fn roots(&self, o: Double3, d: Double3) -> Option<Roots> {
        quadric_roots(dot(d, d), dot(o, d), length(o), self.radius, |t| length(add(o, scale(d, t))))
    }

    /// True when no root, as it is computed and rounded, is one of 0 to `t_max`: without roots and quotients. Most rays that meet the box do
    /// not meet the sphere: they pass it, or end before it, as those do that ask for what is in the way of its light.
    #[inline(always)]
    pub fn is_clearly_missed(&self, o: Double3, d: Double3, t_max: f32) -> bool {
        let (a, b, c) = (dot(d, d), dot(o, d), dot(o, o));
        let end = add(o, scale(d, t_max as f64));
        // Not the sphere but a larger one, by far more than is rounded.
        let limit = self.radius * self.radius + CLEARLY * c;
        let passes = c * a - b * b > limit * a;
        let ends_before = (dot(end, end) > limit) & (dot(end, d) < 0.0);
        let starts_behind = (c > limit) & (b > 0.0);
        passes | ends_before | starts_behind
    }

    /// The point at `t`, brought back to the sphere, unless it is cut off.
    #[inline]
    pub fn point(&self, o: Double3, d: Double3, t: f64) -> Option<Double3> {
        let p = add(o, scale(d, t));
        let p = scale(p, self.radius / length(p));
        let kept = (self.z_min <= -self.radius || p[2] >= self.z_min)
            && (self.z_max >= self.radius || p[2] <= self.z_max)
            && (self.phi_max >= TAU || azimuth(p) <= self.phi_max);
        kept.then_some(p)
    }

    /// Surface parameters of a point of the sphere.
    #[inline(always)]
    pub fn uv(&self, p: Double3) -> Point2 {
        let theta = elementary::safe_acos((p[2] / self.radius) as f32);
        let range = self.theta_z_max - self.theta_z_min;
        let v = if range == 0.0 { 0.0 } else { ((theta - self.theta_z_min) / range).clamp(0.0, 1.0) };
        Point2::new((azimuth(p) / self.phi_max).min(1.0), v)
    }

    #[inline(always)]
    fn parametric(&self, p: Double3) -> Parametric {
        let phi_max = self.phi_max as f64;
        let range = (self.theta_z_max - self.theta_z_min) as f64;
        let uv = self.uv(p);
        let n = scale(p, 1.0 / self.radius);
        // At a pole phi is undefined: step off it, so that the derivatives span the tangent plane.
        let x = if p[0] == 0.0 && p[1] == 0.0 { 1e-5 * self.radius } else { p[0] };
        let rho = (x * x + p[1] * p[1]).sqrt();
        let (cos_phi, sin_phi) = (x / rho, p[1] / rho);
        let dpdu = [-phi_max * p[1], phi_max * x, 0.0];
        let dpdv = [range * p[2] * cos_phi, range * p[2] * sin_phi, -range * rho];
        let per_radius = 1.0 / self.radius;
        Parametric { p, n, uv, dpdu, dpdv, dndu: scale(dpdu, per_radius), dndv: scale(dpdv, per_radius) }
    }

    /// The hit of `ray` at root number `root` (0 or 1). What is not looked at is not computed either.
    #[inline(always)]
    pub fn place(&self, ray: &Ray, root: usize) -> Option<Placed> {
        let (o, d) = self.placement.ray_to_shape(ray);
        let t = self.roots(o, d)?[root];
        let p = add(o, scale(d, t));
        Some(self.placement.place(&self.parametric(scale(p, self.radius / length(p)))))
    }
}

/// Degrees to radians, clamped to one turn; at 360 degrees exactly [`TAU`].
pub(crate) fn sweep(degrees: f32) -> f32 {
    if degrees >= 360.0 { TAU } else { degrees.max(0.0).to_radians() }
}

/// Angle about z in [0, 2 pi].
#[inline]
pub(crate) fn azimuth(p: Double3) -> f32 {
    let phi = elementary::atan2(p[1] as f32, p[0] as f32);
    if phi < 0.0 { phi + TAU } else { phi }
}

/// Roots of |o + t d| = r, with a = d.d, b = o.d (half of the linear coefficient), |o|, and the distance at `t`.
#[inline]
pub(crate) fn quadric_roots(a: f64, b: f64, o: f64, r: f64, distance_at: impl Fn(f64) -> f64) -> Option<Roots> {
    let closest = distance_at(-b / a);
    let discriminant = (r - closest) * (r + closest);
    // Also false for NaN.
    if !(discriminant >= 0.0) || a == 0.0 {
        return None;
    }
    let root = (a * discriminant).sqrt();
    let c = (o - r) * (o + r);
    let (t0, t1) = if b < 0.0 {
        let q = root - b;
        (c / q, q / a)
    } else {
        let q = -(b + root);
        (q / a, if q == 0.0 { 0.0 } else { c / q })
    };
    Some(if t0 <= t1 { [t0, t1] } else { [t1, t0] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::Rng;

    // Rays towards, past, from within and from the surface itself; ends before, on and behind it.
    #[test]
    fn what_is_clearly_missed_has_no_root_in_reach() {
        let mut rng = Rng::new(9);
        let placement = Placement::new(&irradiant_math::Transform::IDENTITY, false).expect("the identity is affine");
        let sphere = Sphere::new(1.0, -1.0, 1.0, 360.0, placement);
        let (mut missed, mut told) = (0, 0);
        for i in 0..400_000 {
            let distance = [0.0, 0.5, 1.0, 1.0 + 1e-7, 1.5, 30.0, 1e4][i % 7];
            let (o, to) = (rng.direction().map(f64::from), rng.direction().map(f64::from));
            let o = scale(o, distance);
            // Many of them graze.
            let aim = if i % 2 == 0 { scale(to, 1.0 + 1e-6 * (rng.next_f32() as f64 - 0.5)) } else { scale(to, 1.3) };
            let d = add(aim, scale(o, -1.0));
            let t_max = [f32::INFINITY, 1.0, 0.999_999, rng.next_f32()][i / 7 % 4];
            let within = |t: f64| t > 0.0 && (t as f32) > 0.0 && (t as f32) < t_max;
            let is_met = sphere.roots(o, d).is_some_and(|roots| roots.into_iter().any(within));
            let is_told = sphere.is_clearly_missed(o, d, t_max);
            assert!(!(is_met && is_told), "{o:?} {d:?} {t_max}");
            missed += u32::from(!is_met);
            told += u32::from(is_told);
        }
        assert!(told as f64 > 0.5 * missed as f64, "{told} of {missed}");
    }
}
