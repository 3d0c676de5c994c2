//! Shapes as light sources: points drawn from them, uniformly by area or well distributed as seen from a point.
//!
//! Each emissive triangle, patch and quadric is one [`EmitterShape`], self-contained, in render space. Methods as in
//! pbrt-v4, section 6: spheres by the cone they subtend; triangles and rectangles by solid angle, warped by the cosine at
//! the receiver; all else by area. Where we depart: quadrics may be scaled unevenly and cut (pbrt samples whole,
//! unscaled spheres), since densities here follow the surface that rays meet.
//!
//! Densities are per unit area of render space or per steradian, as each function says. It knows nothing of light.

use super::bilinear::{self, Corners};
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::placement::{Double3, Placement, cross, dot, double, length, scale, single, sub};
use super::sphere::Sphere;
use super::triangle::{interpolate2, triangle_point};
use crate::interaction::ReferencePoint;
use irradiant_math::warp::{
    SphericalRectangle, SphericalTriangle, bilinear, bilinear_pdf, uniform_disk_concentric, uniform_triangle,
};
use irradiant_math::{Bounds3, Frame, Normal3, Point2, Point3, Vec3, elementary, gamma};
use std::f32::consts::TAU;

/// A point drawn from an emitter's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample {
    /// The point, render space.
    pub p: Point3,
    /// Bound on |computed - true| of each coordinate.
    pub p_error: Vec3,
    /// Geometric normal, unit, on the outer side: the same side as a ray's hit of that point would report.
    pub n: Normal3,
    /// Surface parameters, as a hit would report.
    pub uv: Point2,
    /// Density, > 0 and finite: per unit area or per steradian, as the drawing function says.
    pub pdf: f32,
}

/// Directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Axis, unit.
    pub axis: Vec3,
    /// Cosine of the half angle; -1 for all directions.
    pub cos_angle: f32,
}

impl NormalCone {
    /// All directions.
    pub const ALL: Self = Self { axis: Vec3::Z, cos_angle: -1.0 };
}

/// A surface element that may emit.
#[derive(Clone, Debug)]
pub enum EmitterShape {
    /// A triangle.
    Triangle(Box<TriangleEmitter>),
    /// A bilinear patch.
    Bilinear(Box<BilinearEmitter>),
    /// A sphere, perhaps cut or deformed by an affine map.
    Sphere(Box<SphereEmitter>),
    /// A disk.
    Disk(Box<DiskEmitter>),
    /// An open cylinder.
    Cylinder(Box<CylinderEmitter>),
    /// A piece of a curve: never drawn from (density 0); rays find it.
    Curve(CurveEmitter),
}

/// Solid angles outside this range are sampled by area: spherical triangles lose digits when small, and BSDF sampling
/// does better when the triangle fills half of the sky. pbrt's limits.
const TRIANGLE_SOLID_ANGLES: std::ops::RangeInclusive<f32> = 3e-4..=6.22;
/// The same for rectangles.
const LEAST_RECTANGLE_SOLID_ANGLE: f32 = 1e-4;
/// Below sin^2 of 1.5 degrees the cone of a sphere is described by its Taylor series.
const SMALL_SIN2: f64 = 0.000_685_23;

impl EmitterShape {
    /// Surface area in render space.
    pub fn area(&self) -> f32 {
        match self {
            Self::Triangle(e) => e.area,
            Self::Bilinear(e) => e.area,
            Self::Sphere(e) => e.area,
            Self::Disk(e) => e.area,
            Self::Cylinder(e) => e.area,
            Self::Curve(e) => e.area,
        }
    }

    /// Bytes held beyond the enum itself.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::Triangle(e) => size_of_val(&**e),
            Self::Bilinear(e) => size_of_val(&**e),
            Self::Sphere(e) => size_of_val(&**e),
            Self::Disk(e) => size_of_val(&**e),
            Self::Cylinder(e) => size_of_val(&**e),
            Self::Curve(_) => 0,
        }
    }

    /// A box around it.
    pub fn bounds(&self) -> Bounds3 {
        match self {
            Self::Triangle(e) => Bounds3::from_points(e.p),
            Self::Bilinear(e) => Bounds3::from_points(e.p.map(|c| Point3::from(single(c)))),
            Self::Sphere(e) => e.sphere.bounds(),
            Self::Disk(e) => e.disk.bounds(),
            Self::Cylinder(e) => e.cylinder.bounds(),
            Self::Curve(e) => e.bounds,
        }
    }

    /// A cone around its normals on the outer side.
    pub fn normal_cone(&self) -> NormalCone {
        match self {
            Self::Triangle(e) => e.normal_cone(),
            Self::Bilinear(e) => e.normal_cone(),
            Self::Disk(e) => NormalCone { axis: e.n.as_vec(), cos_angle: 1.0 },
            Self::Sphere(_) | Self::Cylinder(_) | Self::Curve(_) => NormalCone::ALL,
        }
    }

    /// A point of the surface; `pdf` per unit area. Uniform but for curved patches and uneven scales, where it is near.
    pub fn sample_area(&self, u: Point2) -> Option<ShapeSample> {
        let s = match self {
            Self::Triangle(e) => e.sample_area(u),
            Self::Bilinear(e) => e.sample_area(u),
            Self::Sphere(e) => e.sample_area(u),
            Self::Disk(e) => e.sample_area(u),
            Self::Cylinder(e) => e.sample_area(u),
            Self::Curve(_) => return None,
        };
        (s.pdf > 0.0 && s.pdf.is_finite()).then_some(s)
    }

    /// A point of the surface as seen from `at`; `pdf` per steradian at `at.p`.
    ///
    /// `None` when there is nothing to draw: the shape is seen edge-on, `at` lies on it, or it is a curve. The point may
    /// be hidden by another part of the same shape, or show its inner side.
    pub fn sample(&self, at: &ReferencePoint, u: Point2) -> Option<ShapeSample> {
        let drawn = match self {
            Self::Triangle(e) => e.sample(at, u),
            Self::Bilinear(e) => e.sample(at, u),
            Self::Sphere(e) => e.sample(at, u),
            Self::Disk(_) | Self::Cylinder(_) => Drawn::ByArea,
            Self::Curve(_) => return None,
        };
        let s = match drawn {
            Drawn::BySolidAngle(s) => s,
            Drawn::ByArea => {
                let mut s = self.sample_area(u)?;
                let to = s.p - at.p;
                s.pdf *= solid_angle_per_area_inverse(to, s.n)?;
                s
            }
        };
        (s.pdf > 0.0 && s.pdf.is_finite()).then_some(s)
    }

    /// Density, per steradian at `at.p`, with which [`EmitterShape::sample`] draws the direction `wi` (unit) by way of the
    /// point `p` of this shape, where the geometric normal is `n` and the parameters are `uv` (as its hit reported them).
    ///
    /// 0 where that way is never taken: edge-on, the far side of a sphere, curves.
    pub fn pdf(&self, at: &ReferencePoint, wi: Vec3, p: Point3, n: Normal3, uv: Point2) -> f32 {
        let by_solid_angle = match self {
            Self::Triangle(e) => e.pdf(at, wi),
            Self::Bilinear(e) => e.pdf(at, p),
            Self::Sphere(e) => e.pdf(at, wi, p),
            Self::Disk(_) | Self::Cylinder(_) => None,
            Self::Curve(_) => Some(0.0),
        };
        let pdf = by_solid_angle.unwrap_or_else(|| {
            let to = p - at.p;
            self.pdf_area(p, n, uv) * to.length_squared() / n.dot(wi).abs()
        });
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Density, per unit area, with which [`EmitterShape::sample_area`] draws the point `p`, where the normal is `n` and
    /// the parameters are `uv`.
    pub fn pdf_area(&self, p: Point3, n: Normal3, uv: Point2) -> f32 {
        match self {
            Self::Triangle(e) => 1.0 / e.area,
            Self::Bilinear(e) => e.pdf_area(p, uv),
            Self::Sphere(e) => e.stretch.pdf(&e.sphere.placement, n),
            Self::Disk(e) => 1.0 / e.area,
            Self::Cylinder(e) => e.stretch.pdf(&e.cylinder.placement, n),
            Self::Curve(_) => 0.0,
        }
    }
}

enum Drawn {
    BySolidAngle(ShapeSample),
    ByArea,
}

/// distance^2 / |cos|; `None` edge-on or at distance zero.
#[inline]
fn solid_angle_per_area_inverse(to: Vec3, n: Normal3) -> Option<f32> {
    let d2 = to.length_squared();
    let cos = n.dot(to).abs() / d2.sqrt();
    (d2 > 0.0 && cos > 0.0).then(|| d2 / cos)
}

/// Weights that make a bilinear density follow |cos| at the receiver, never below 0.01.
#[inline]
fn cosine_weights(ns: Normal3, directions: [Vec3; 4]) -> [f32; 4] {
    directions.map(|w| ns.dot(w).abs().max(0.01))
}

// ---------------------------------------------------------------------------------------------------------------------

/// A triangle that may emit.
#[derive(Clone, Debug)]
pub struct TriangleEmitter {
    p: [Point3; 3],
    uvs: [[f32; 2]; 3],
    /// Vertex normals, which say what is outside; all zero when there are none.
    normals: [Normal3; 3],
    /// Unit; on the outer side if there are no vertex normals.
    n: Normal3,
    area: f32,
}

impl TriangleEmitter {
    /// `flip`: outside is against (p1 - p0) x (p2 - p0), unless `normals` say otherwise.
    pub(crate) fn new(p: [Point3; 3], uvs: [[f32; 2]; 3], normals: Option<[Normal3; 3]>, flip: bool) -> Self {
        let q = p.map(|p| double(p.to_array()));
        let c = cross(sub(q[1], q[0]), sub(q[2], q[0]));
        let l = length(c);
        let sign = if flip && normals.is_none() { -1.0 } else { 1.0 };
        let n = if l > 0.0 { scale(c, sign / l) } else { [0.0, 0.0, 1.0] };
        Self { p, uvs, normals: normals.unwrap_or([Normal3::ZERO; 3]), n: single(n).into(), area: (0.5 * l) as f32 }
    }

    #[inline]
    fn normal(&self, b: [f32; 3]) -> Normal3 {
        let ns = self.normals[0] * b[0] + self.normals[1] * b[1] + self.normals[2] * b[2];
        self.n.face_forward(ns.as_vec())
    }

    fn normal_cone(&self) -> NormalCone {
        // Vertex normals that disagree about the side leave both open.
        let sides = self.normals.map(|ns| self.n.dot_normal(ns) < 0.0);
        if sides[0] != sides[1] || sides[0] != sides[2] {
            return NormalCone::ALL;
        }
        NormalCone { axis: self.normal([1.0 / 3.0; 3]).as_vec(), cos_angle: 1.0 }
    }

    #[inline]
    fn at(&self, b: [f32; 3], pdf: f32) -> ShapeSample {
        let (p, p_error) = triangle_point(self.p, b[1], b[2]);
        ShapeSample { p, p_error, n: self.normal(b), uv: interpolate2(&self.uvs, b), pdf }
    }

    fn sample_area(&self, u: Point2) -> ShapeSample {
        self.at(uniform_triangle(u), 1.0 / self.area)
    }

    /// The triangle on the sphere around a point, if its size there suits sampling by solid angle.
    #[inline]
    fn seen_from(&self, p: Point3) -> Option<SphericalTriangle> {
        SphericalTriangle::new(self.p, p).filter(|s| TRIANGLE_SOLID_ANGLES.contains(&s.solid_angle()))
    }

    #[inline]
    fn weights(&self, at: &ReferencePoint) -> Option<[f32; 4]> {
        if at.ns == Normal3::ZERO {
            return None;
        }
        let [w0, w1, w2] = self.p.map(|p| (p - at.p).normalize());
        // Where the corners of the square go: all of its edge u.y = 0 to vertex 1, (0,1) to vertex 0, (1,1) to vertex 2.
        Some(cosine_weights(at.ns, [w1, w1, w0, w2]))
    }

    fn sample(&self, at: &ReferencePoint, u: Point2) -> Drawn {
        let Some(seen) = self.seen_from(at.p) else { return Drawn::ByArea };
        let (u, mut pdf) = match self.weights(at) {
            Some(w) => {
                let u = bilinear(u, w);
                (u, bilinear_pdf(u, w))
            }
            None => (u, 1.0),
        };
        pdf /= seen.solid_angle();
        let w = seen.sample(u);
        let b = SphericalTriangle::barycentrics(self.p.map(|p| p - at.p), w);
        Drawn::BySolidAngle(self.at(b, pdf))
    }

    fn pdf(&self, at: &ReferencePoint, wi: Vec3) -> Option<f32> {
        let seen = self.seen_from(at.p)?;
        let warp = self.weights(at).map_or(1.0, |w| bilinear_pdf(seen.inverse(wi), w));
        Some(warp / seen.solid_angle())
    }
}

// ---------------------------------------------------------------------------------------------------------------------

/// A bilinear patch that may emit.
#[derive(Clone, Debug)]
pub struct BilinearEmitter {
    p: Corners,
    /// Texture coordinates of the corners, if given.
    uvs: Option<[[f32; 2]; 4]>,
    normals: Option<[Normal3; 4]>,
    flip: bool,
    is_rectangle: bool,
    /// Area per du dv at the corners.
    weights: [f32; 4],
    area: f32,
}

impl BilinearEmitter {
    /// Corners (0,0), (1,0), (0,1), (1,1); `flip`: outside is against dp/du x dp/dv, unless `normals` say otherwise.
    pub(crate) fn new(p: [Point3; 4], uvs: Option<[[f32; 2]; 4]>, normals: Option<[Normal3; 4]>, flip: bool) -> Self {
        let p = p.map(|p| double(p.to_array()));
        let stretch = |u, v| {
            let (du, dv) = bilinear::derivatives(&p, u, v);
            length(cross(du, dv))
        };
        const N: usize = 32;
        let middle = |i: usize| (i as f64 + 0.5) / N as f64;
        let sum: f64 = (0..N * N).map(|k| stretch(middle(k % N), middle(k / N))).sum();
        let weights = [stretch(0.0, 0.0), stretch(1.0, 0.0), stretch(0.0, 1.0), stretch(1.0, 1.0)].map(|w| w as f32);
        Self {
            p,
            uvs,
            normals,
            flip,
            is_rectangle: bilinear::is_rectangle(&p),
            weights,
            area: (sum / (N * N) as f64) as f32,
        }
    }

    fn normal_at(&self, u: f64, v: f64) -> (Normal3, f64) {
        let (du, dv) = bilinear::derivatives(&self.p, u, v);
        let c = cross(du, dv);
        let l = length(c);
        let n: Normal3 = if l > 0.0 { single(scale(c, 1.0 / l)).into() } else { Normal3::new(0.0, 0.0, 1.0) };
        let n = match self.normals {
            Some([n00, n10, n01, n11]) => {
                let mixed = |t: f32, a: Normal3, b: Normal3| a * (1.0 - t) + b * t;
                n.face_forward(mixed(u as f32, mixed(v as f32, n00, n01), mixed(v as f32, n10, n11)).as_vec())
            }
            None if self.flip => -n,
            None => n,
        };
        (n, l)
    }

    fn normal_cone(&self) -> NormalCone {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| self.normal_at(u, v));
        // The unnormalised normal is bilinear up to the twist term, so the cone of the corners' normals holds it.
        let mut sum = Vec3::ZERO;
        for (n, l) in corners {
            if l > 0.0 {
                sum += n.as_vec();
            }
        }
        let axis = sum.normalize();
        if !axis.is_finite() {
            return NormalCone::ALL;
        }
        let cos = corners.iter().filter(|c| c.1 > 0.0).fold(1.0f32, |m, c| m.min(c.0.dot(axis)));
        if cos < 0.0 { NormalCone::ALL } else { NormalCone { axis, cos_angle: (cos - 1e-6).min(1.0) } }
    }

    fn at(&self, u: f64, v: f64, pdf: f32) -> ShapeSample {
        let (p, p_error) = bilinear::point_and_error(&self.p, u, v);
        let uv = match self.uvs {
            None => Point2::new(u as f32, v as f32),
            Some(c) => {
                let mix = |t: f32, a: f32, b: f32| (1.0 - t) * a + t * b;
                let at = |i: usize| mix(u as f32, mix(v as f32, c[0][i], c[2][i]), mix(v as f32, c[1][i], c[3][i]));
                Point2::new(at(0), at(1))
            }
        };
        ShapeSample { p, p_error, n: self.normal_at(u, v).0, uv, pdf }
    }

    fn sample_area(&self, u: Point2) -> ShapeSample {
        let (uv, pdf) = if self.is_rectangle {
            (u, 1.0)
        } else {
            let uv = bilinear(u, self.weights);
            (uv, bilinear_pdf(uv, self.weights))
        };
        let (u, v) = (uv.x as f64, uv.y as f64);
        let stretch = self.normal_at(u, v).1;
        self.at(u, v, (pdf as f64 / stretch) as f32)
    }

    fn pdf_area(&self, p: Point3, uv: Point2) -> f32 {
        let (u, v) = self.parameters(p, uv);
        let pdf = if self.is_rectangle { 1.0 } else { bilinear_pdf(Point2::new(u as f32, v as f32), self.weights) };
        (pdf as f64 / self.normal_at(u, v).1) as f32
    }

    fn parameters(&self, p: Point3, uv: Point2) -> (f64, f64) {
        match self.uvs {
            None => (uv.x as f64, uv.y as f64),
            Some(_) => bilinear::invert(&self.p, double(p.to_array())),
        }
    }

    fn seen_from(&self, p: Point3) -> Option<SphericalRectangle> {
        if !self.is_rectangle {
            return None;
        }
        let corner = |i: usize| Point3::from(single(self.p[i]));
        SphericalRectangle::new(p, corner(0), corner(1) - corner(0), corner(2) - corner(0))
            .filter(|s| s.solid_angle() > LEAST_RECTANGLE_SOLID_ANGLE)
    }

    fn cosines(&self, at: &ReferencePoint) -> Option<[f32; 4]> {
        (at.ns != Normal3::ZERO)
            .then(|| cosine_weights(at.ns, self.p.map(|c| (Point3::from(single(c)) - at.p).normalize())))
    }

    fn sample(&self, at: &ReferencePoint, u: Point2) -> Drawn {
        let Some(seen) = self.seen_from(at.p) else { return Drawn::ByArea };
        let (u, mut pdf) = match self.cosines(at) {
            Some(w) => {
                let u = bilinear(u, w);
                (u, bilinear_pdf(u, w))
            }
            None => (u, 1.0),
        };
        pdf /= seen.solid_angle();
        let q = double(seen.sample(u).to_array());
        let (ex, ey) = (sub(self.p[1], self.p[0]), sub(self.p[2], self.p[0]));
        let from = sub(q, self.p[0]);
        let s = (dot(from, ex) / dot(ex, ex)).clamp(0.0, 1.0);
        let t = (dot(from, ey) / dot(ey, ey)).clamp(0.0, 1.0);
        Drawn::BySolidAngle(self.at(s, t, pdf))
    }

    fn pdf(&self, at: &ReferencePoint, p: Point3) -> Option<f32> {
        let seen = self.seen_from(at.p)?;
        let warp = self.cosines(at).map_or(1.0, |w| bilinear_pdf(seen.inverse(p), w));
        Some(warp / seen.solid_angle())
    }
}

// ---------------------------------------------------------------------------------------------------------------------

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

    fn sample_area(&self, u: Point2) -> ShapeSample {
        let s = &self.sphere;
        let q = cut_point(s, u.x as f64, u.y as f64);
        let n_shape = scale(q, 1.0 / s.radius);
        let (p, p_error) = s.placement.point(q);
        let (n, _) = s.placement.unit_normal(n_shape);
        ShapeSample { p, p_error, n, uv: s.uv(q), pdf: self.stretch.pdf_shape_normal(&s.placement, n_shape) }
    }

    /// From `at` to the centre, squared distance and radius, if `at` is outside a whole sphere.
    #[inline]
    fn seen_from(&self, at: &ReferencePoint) -> Option<(Double3, f64, Double3, f64)> {
        let (center, radius) = self.ball?;
        let to = sub(center, double(at.p.to_array()));
        let d2 = dot(to, to);
        // On the surface, rounding decides the side: samples by area do no harm there.
        let reach = radius + at.p_error.max_component() as f64;
        (d2 > reach * reach).then_some((to, d2, center, radius))
    }

    fn sample(&self, at: &ReferencePoint, u: Point2) -> Drawn {
        let Some((to, d2, center, radius)) = self.seen_from(at) else { return Drawn::ByArea };
        let sin2_max = radius * radius / d2;
        let height = cone_height(sin2_max);
        let (u0, u1) = (u.x as f64, u.y);
        let one_minus_cos = height * u0;
        let sin2 = if sin2_max < SMALL_SIN2 { sin2_max * u0 } else { one_minus_cos * (2.0 - one_minus_cos) };
        let cos = (1.0 - sin2).max(0.0).sqrt();
        // Cosine of the angle at the centre between the directions to `at` and to the point.
        let sin_max = sin2_max.sqrt();
        let cos_alpha = (sin2 / sin_max + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt()).min(1.0);
        let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
        let (sin_phi, cos_phi) = elementary::sin_cos(u1 * TAU);
        let axis = scale(to, -1.0 / d2.sqrt());
        let frame = Frame::from_z(single(axis).into());
        let (x, y) = (double(frame.x.to_array()), double(frame.y.to_array()));
        let n = [0, 1, 2].map(|i| (x[i] * cos_phi as f64 + y[i] * sin_phi as f64) * sin_alpha + axis[i] * cos_alpha);
        let n = scale(n, 1.0 / length(n));
        let p = [0, 1, 2].map(|i| center[i] + radius * n[i]);
        let placement = &self.sphere.placement;
        let error = [0, 1, 2].map(|i| p[i].abs() as f32 * gamma(2));
        let sign = if placement.flip { -1.0 } else { 1.0 };
        Drawn::BySolidAngle(ShapeSample {
            p: single(p).into(),
            p_error: error.into(),
            n: single(scale(n, sign)).into(),
            uv: self.sphere.uv(placement.point_to_shape(p)),
            pdf: (1.0 / height) as f32 / TAU,
        })
    }

    fn pdf(&self, at: &ReferencePoint, wi: Vec3, p: Point3) -> Option<f32> {
        let (_, d2, center, radius) = self.seen_from(at)?;
        // The far side (met by rays that pass the near one, if that is cut out by alpha) is never drawn.
        let outwards = sub(double(p.to_array()), center);
        if dot(outwards, double(wi.to_array())) > 1e-3 * radius {
            return Some(0.0);
        }
        Some((1.0 / cone_height(radius * radius / d2)) as f32 / TAU)
    }
}

/// 1 - cos of a cone's half angle from its sin^2.
#[inline]
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

    fn sample_area(&self, u: Point2) -> ShapeSample {
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

    fn sample_area(&self, u: Point2) -> ShapeSample {
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

/// A piece of a curve that may emit.
#[derive(Clone, Copy, Debug)]
pub struct CurveEmitter {
    pub(crate) bounds: Bounds3,
    pub(crate) area: f32,
}
