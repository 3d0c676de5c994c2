//! Spheres by the cone they subtend; cut and deformed quadrics by area of shape space, weighed by the stretch of the map.

use super::{Drawn, ShapeSample};
use crate::geometry::cylinder::Cylinder;
use crate::geometry::disk::Disk;
use crate::geometry::placement::{Double3, Placement, axes, dot, double, length, scale, single, sub};
use crate::geometry::sphere::Sphere;
use crate::interaction::ReferencePoint;
use irradiant_math::warp::uniform_disk_concentric;
use irradiant_math::{Bounds3, Frame, Normal3, Point2, Point3, Vec3, elementary, gamma};
use std::f32::consts::TAU;

/// Below sin^2 of 1.5 degrees the cone of a sphere is described by its Taylor series.
const SMALL_SIN2: f64 = 0.000_685_23;

/// Density of points drawn uniformly in shape space, per area of render space.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// 1 / area in shape space.
    per_shape_area: f64,
    /// Area in render space, per area in shape space, if the same everywhere.
    uniform: Option<f64>,
}

impl Stretch {
    /// Also the area in render space: exact under even scaling, else by a midpoint rule over the shape's parameters.
    fn new(shape_area: f64, placement: &Placement, normal: impl Fn(f64, f64) -> Double3) -> (Self, f32) {
        let uniform = placement.uniform_scale().map(|s| s * s);
        const N: usize = 64;
        let mean = uniform.unwrap_or_else(|| {
            let middle = |i: usize| (i as f64 + 0.5) / N as f64;
            let sum: f64 = (0..N * N).map(|k| placement.unit_normal(normal(middle(k % N), middle(k / N))).1).sum();
            sum / (N * N) as f64
        });
        (Self { per_shape_area: 1.0 / shape_area, uniform }, (shape_area * mean) as f32)
    }

    /// Density per area of render space where the shape-space unit normal is `n`.
    fn pdf_shape_normal(&self, placement: &Placement, n: Double3) -> f32 {
        (self.per_shape_area / self.uniform.unwrap_or_else(|| placement.unit_normal(n).1)) as f32
    }

    /// The same for the render-space normal `n`, on either side.
    fn pdf(&self, placement: &Placement, n: Normal3) -> f32 {
        if let Some(s) = self.uniform {
            return (self.per_shape_area / s) as f32;
        }
        // The shape-space normal is the transpose of the map applied to `n`.
        let n = placement.normal_to_shape(double(n.to_array()));
        self.pdf_shape_normal(placement, scale(n, 1.0 / length(n)))
    }
}

/// A sphere that may emit.
#[derive(Clone, Debug)]
pub struct SphereEmitter {
    sphere: Sphere,
    stretch: Stretch,
    /// Centre and radius in render space, if it is a whole sphere there.
    ball: Option<(Double3, f64)>,
    area: f32,
}

impl SphereEmitter {
    pub(crate) fn new(sphere: Sphere) -> Self {
        let shape_area = sphere.phi_max as f64 * sphere.radius * (sphere.z_max - sphere.z_min);
        let (stretch, area) =
            Stretch::new(shape_area, &sphere.placement, |a, b| scale(cut_point(&sphere, a, b), 1.0 / sphere.radius));
        let ball = sphere
            .placement
            .uniform_scale()
            .filter(|_| sphere.is_whole())
            .map(|s| (sphere.placement.point64([0.0; 3]), s * sphere.radius));
        Self { sphere, stretch, ball, area }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        self.sphere.bounds()
    }

    pub(super) fn pdf_area(&self, n: Normal3) -> f32 {
        self.stretch.pdf(&self.sphere.placement, n)
    }

    pub(super) fn sample_area(&self, u: Point2, wants_uv: bool) -> ShapeSample {
        let s = &self.sphere;
        let q = cut_point(s, u.x as f64, u.y as f64);
        let n_shape = scale(q, 1.0 / s.radius);
        let (p, p_error) = s.placement.point(q);
        let (n, _) = s.placement.unit_normal(n_shape);
        let uv = if wants_uv { s.uv(q) } else { Point2::ZERO };
        ShapeSample { p, p_error, n, uv, pdf: self.stretch.pdf_shape_normal(&s.placement, n_shape) }
    }

    /// The ball it is, if it is whole and round.
    #[inline]
    pub(super) fn ball(&self) -> Option<Ball> {
        let (center, radius) = self.ball?;
        Some(Ball { center, radius, sign: if self.sphere.placement.flip { -1.0 } else { 1.0 } })
    }

    pub(super) fn sample(&self, at: &ReferencePoint, u: Point2, wants_uv: bool) -> Drawn {
        let Some(ball) = self.ball() else { return Drawn::ByArea };
        let (seen, is_outside) = ball.seen_from(at.p, at.p_error);
        if !is_outside {
            return Drawn::ByArea;
        }
        let BallPoint { p, n, pdf, exact } = ball.sample(&seen, u);
        let uv = if wants_uv { self.sphere.uv(self.sphere.placement.point_to_shape(exact)) } else { Point2::ZERO };
        Drawn::BySolidAngle(ShapeSample { p, p_error: ball_error(exact), n, uv, pdf })
    }

    pub(super) fn pdf(&self, at: &ReferencePoint, wi: Vec3, p: Point3) -> Option<f32> {
        let ball = self.ball()?;
        let (seen, is_outside) = ball.seen_from(at.p, at.p_error);
        is_outside.then(|| ball.pdf(&seen, wi, p))
    }
}

/// A whole sphere in render space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub center: Double3,
    pub radius: f64,
    /// -1 where its outer side is within.
    pub sign: f64,
}

/// How a ball is seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenBall {
    /// From the point to the centre, and the squared length of that.
    to: Double3,
    d2: f64,
}

/// A point of a ball by the cone that it subtends.
#[derive(Clone, Copy, Debug)]
pub(super) struct BallPoint {
    pub p: Point3,
    pub n: Normal3,
    /// Per steradian.
    pub pdf: f32,
    /// The point, not rounded.
    pub exact: Double3,
}

/// Bound of the error of a ball's point.
#[inline(always)]
pub(super) fn ball_error(p: Double3) -> Vec3 {
    axes(|i| p[i].abs() as f32 * gamma(2)).into()
}

impl Ball {
    /// Seen from `p`, and whether that is outside, where alone it can be sampled by its cone.
    #[inline(always)]
    pub fn seen_from(&self, p: Point3, p_error: Vec3) -> (SeenBall, bool) {
        let to = sub(self.center, double(p.to_array()));
        let d2 = dot(to, to);
        // On the surface, rounding decides the side: samples by area do no harm there.
        let reach = self.radius + p_error.max_component() as f64;
        (SeenBall { to, d2 }, d2 > reach * reach)
    }

    /// A point by `u`, uniform in the cone that the ball subtends.
    #[inline(always)]
    pub fn sample(&self, &SeenBall { to, d2 }: &SeenBall, u: Point2) -> BallPoint {
        let Self { center, radius, sign } = *self;
        let inverse_distance = 1.0 / d2.sqrt();
        let sin_max = radius * inverse_distance;
        let sin2_max = sin_max * sin_max;
        let height = cone_height(sin2_max);
        let (u0, u1) = (u.x as f64, u.y);
        let one_minus_cos = height * u0;
        let (small, large) = (sin2_max * u0, one_minus_cos * (2.0 - one_minus_cos));
        let sin2 = if sin2_max < SMALL_SIN2 { small } else { large };
        let cos = (1.0 - sin2).max(0.0).sqrt();
        // Cosine of the angle at the centre between the directions to `at` and to the point.
        let share = sin2 / sin2_max;
        let cos_alpha = (share * sin_max + cos * (1.0 - share).max(0.0).sqrt()).min(1.0);
        let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
        let (sin_phi, cos_phi) = elementary::sin_cos_bounded(u1 * TAU);
        let axis = scale(to, -inverse_distance);
        let frame = Frame::from_z(single(axis).into());
        let (x, y) = (double(frame.x.to_array()), double(frame.y.to_array()));
        let n = axes(|i| (x[i] * cos_phi as f64 + y[i] * sin_phi as f64) * sin_alpha + axis[i] * cos_alpha);
        // The frame is unit to a single's precision; one step of Newton's makes that a double's.
        let n = scale(n, 1.5 - 0.5 * dot(n, n));
        let p = axes(|i| center[i] + radius * n[i]);
        BallPoint { p: single(p).into(), n: single(scale(n, sign)).into(), pdf: (1.0 / height) as f32 / TAU, exact: p }
    }

    /// Density, per steradian, with which [`Ball::sample`] draws the direction `wi` by way of its point `p`.
    #[inline(always)]
    pub fn pdf(&self, seen: &SeenBall, wi: Vec3, p: Point3) -> f32 {
        // The far side (met by rays that pass the near one, if that is cut out by alpha) is never drawn.
        let outwards = sub(double(p.to_array()), self.center);
        let is_far = dot(outwards, double(wi.to_array())) > 1e-3 * self.radius;
        let pdf = (1.0 / cone_height(self.radius * self.radius / seen.d2)) as f32 / TAU;
        if is_far { 0.0 } else { pdf }
    }
}

/// 1 - cos of a cone's half angle from its sin^2.
#[inline(always)]
fn cone_height(sin2: f64) -> f64 {
    // Without the cancellation of 1 - sqrt(1 - x).
    sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

/// A point of a cut sphere, uniform by area (Archimedes): z from `a`, phi from `b`.
fn cut_point(s: &Sphere, a: f64, b: f64) -> Double3 {
    let z = s.z_max + a * (s.z_min - s.z_max);
    let r = (s.radius * s.radius - z * z).max(0.0).sqrt();
    let (sin, cos) = elementary::sin_cos(b as f32 * s.phi_max);
    let q = [r * cos as f64, r * sin as f64, z];
    scale(q, s.radius / length(q))
}

/// A disk that may emit.
#[derive(Clone, Debug)]
pub struct DiskEmitter {
    disk: Disk,
    n: Normal3,
    area: f32,
}

impl DiskEmitter {
    pub(crate) fn new(disk: Disk) -> Self {
        let shape_area = 0.5 * disk.phi_max as f64 * (disk.radius * disk.radius - disk.inner * disk.inner);
        let (n, stretch) = disk.placement.unit_normal([0.0, 0.0, 1.0]);
        Self { n, area: (shape_area * stretch) as f32, disk }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        self.disk.bounds()
    }

    pub(super) fn normal(&self) -> Normal3 {
        self.n
    }

    pub(super) fn sample_area(&self, u: Point2) -> ShapeSample {
        let d = &self.disk;
        let q = if d.is_whole() {
            let p = uniform_disk_concentric(u);
            [p.x as f64 * d.radius, p.y as f64 * d.radius, d.height]
        } else {
            let (r2, inner2) = (d.radius * d.radius, d.inner * d.inner);
            let r = (inner2 + u.x as f64 * (r2 - inner2)).sqrt();
            let (sin, cos) = elementary::sin_cos(u.y * d.phi_max);
            [r * cos as f64, r * sin as f64, d.height]
        };
        let (p, p_error) = d.placement.point(q);
        ShapeSample { p, p_error, n: self.n, uv: d.uv(q), pdf: 1.0 / self.area }
    }
}

/// A cylinder that may emit.
#[derive(Clone, Debug)]
pub struct CylinderEmitter {
    cylinder: Cylinder,
    stretch: Stretch,
    area: f32,
}

impl CylinderEmitter {
    pub(crate) fn new(cylinder: Cylinder) -> Self {
        let shape_area = cylinder.phi_max as f64 * cylinder.radius * (cylinder.z_max - cylinder.z_min);
        let (stretch, area) = Stretch::new(shape_area, &cylinder.placement, |_, b| {
            let (sin, cos) = elementary::sin_cos(b as f32 * cylinder.phi_max);
            [cos as f64, sin as f64, 0.0]
        });
        Self { cylinder, stretch, area }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        self.cylinder.bounds()
    }

    pub(super) fn pdf_area(&self, n: Normal3) -> f32 {
        self.stretch.pdf(&self.cylinder.placement, n)
    }

    pub(super) fn sample_area(&self, u: Point2) -> ShapeSample {
        let c = &self.cylinder;
        let z = c.z_min + u.x as f64 * (c.z_max - c.z_min);
        let (sin, cos) = elementary::sin_cos(u.y * c.phi_max);
        let n = [cos as f64, sin as f64, 0.0];
        let n = scale(n, 1.0 / length(n));
        let q = [c.radius * n[0], c.radius * n[1], z];
        let (p, p_error) = c.placement.point(q);
        let pdf = self.stretch.pdf_shape_normal(&c.placement, n);
        ShapeSample { p, p_error, n: c.placement.unit_normal(n).0, uv: c.uv(q), pdf }
    }
}
