//! Shapes as light sources: points drawn from them, uniformly by area or well distributed as seen from a point.
//!
//! Each emissive triangle, patch and quadric is one [`EmitterShape`], self-contained, in render space. Methods as in
//! pbrt-v4, section 6: spheres by the cone they subtend; triangles and rectangles that are near by solid angle, warped by
//! the cosine at the receiver; all else by area. Two triangles that are a rectangle are one emitter. Where we depart: quadrics may be scaled unevenly and cut (pbrt samples whole,
//! unscaled spheres), since densities here follow the surface that rays meet.
//!
//! Densities are per unit area of render space or per steradian, as each function says. It knows nothing of light.

mod bilinear;
mod quadric;
mod rectangle;
mod rectangle_lanes;
mod sphere_lanes;
mod triangle;

pub use bilinear::BilinearEmitter;
pub use quadric::{CylinderEmitter, DiskEmitter, SphereEmitter};
pub use rectangle::RectangleEmitter;
pub use rectangle_lanes::RectangleLanes;
pub use sphere_lanes::SphereLanes;
pub use triangle::TriangleEmitter;

use crate::interaction::ReferencePoint;
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Vec3};

/// A point drawn from an emitter's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeSample {
    /// The point, render space.
    pub p: Point3,
    /// Bound on |computed - true| of each coordinate.
    pub p_error: Vec3,
    /// Geometric normal, unit, on the outer side: the same side as a ray's hit of that point would report.
    pub n: Normal3,
    /// Surface parameters, as a hit would report; (0, 0) if they were not asked for and are not to be had for nothing.
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
    /// A rectangle of two triangles.
    Rectangle(Box<RectangleEmitter>),
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

impl EmitterShape {
    /// Surface area in render space.
    pub fn area(&self) -> f32 {
        match self {
            Self::Triangle(e) => e.area(),
            Self::Rectangle(e) => e.area(),
            Self::Bilinear(e) => e.area(),
            Self::Sphere(e) => e.area(),
            Self::Disk(e) => e.area(),
            Self::Cylinder(e) => e.area(),
            Self::Curve(e) => e.area,
        }
    }

    /// Bytes held beyond the enum itself.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::Triangle(e) => size_of_val(&**e),
            Self::Rectangle(e) => size_of_val(&**e),
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
            Self::Triangle(e) => e.bounds(),
            Self::Rectangle(e) => e.bounds(),
            Self::Bilinear(e) => e.bounds(),
            Self::Sphere(e) => e.bounds(),
            Self::Disk(e) => e.bounds(),
            Self::Cylinder(e) => e.bounds(),
            Self::Curve(e) => e.bounds,
        }
    }

    /// A cone around its normals on the outer side.
    pub fn normal_cone(&self) -> NormalCone {
        match self {
            Self::Triangle(e) => e.normal_cone(),
            Self::Rectangle(e) => e.normal_cone(),
            Self::Bilinear(e) => e.normal_cone(),
            Self::Disk(e) => NormalCone { axis: e.normal().as_vec(), cos_angle: 1.0 },
            Self::Sphere(_) | Self::Cylinder(_) | Self::Curve(_) => NormalCone::ALL,
        }
    }

    /// False for what only rays find.
    pub fn can_be_drawn_from(&self) -> bool {
        !matches!(self, Self::Curve(_))
    }

    /// A point of the surface; `pdf` per unit area. Uniform but for curved patches and uneven scales, where it is near.
    pub fn sample_area(&self, u: Point2, wants_uv: bool) -> Option<ShapeSample> {
        let s = match self {
            Self::Triangle(e) => e.sample_area(u),
            Self::Rectangle(e) => e.sample_area(u, wants_uv),
            Self::Bilinear(e) => e.sample_area(u),
            Self::Sphere(e) => e.sample_area(u, wants_uv),
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
    #[inline]
    pub fn sample(&self, at: &ReferencePoint, u: Point2, wants_uv: bool) -> Option<ShapeSample> {
        let drawn = match self {
            Self::Triangle(e) => e.sample(at, u),
            Self::Rectangle(e) => e.sample(at, u, wants_uv),
            Self::Bilinear(e) => e.sample(at, u),
            Self::Sphere(e) => e.sample(at, u, wants_uv),
            Self::Disk(_) | Self::Cylinder(_) => Drawn::ByArea,
            Self::Curve(_) => return None,
        };
        let s = match drawn {
            Drawn::BySolidAngle(s) => s,
            Drawn::Nothing => return None,
            Drawn::ByArea => {
                let mut s = self.sample_area(u, wants_uv)?;
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
            Self::Rectangle(e) => e.pdf(at, p),
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
            Self::Triangle(e) => 1.0 / e.area(),
            Self::Rectangle(e) => 1.0 / e.area(),
            Self::Bilinear(e) => e.pdf_area(p, uv),
            Self::Sphere(e) => e.pdf_area(n),
            Self::Disk(e) => 1.0 / e.area(),
            Self::Cylinder(e) => e.pdf_area(n),
            Self::Curve(_) => 0.0,
        }
    }
}

enum Drawn {
    BySolidAngle(ShapeSample),
    ByArea,
    Nothing,
}

/// True when a point at `height` over a plane may just as well be on it, both being known with an error: as is every
/// point of a flat shape itself, which would otherwise light itself from within that error, at any angle.
#[inline(always)]
fn is_on_plane(at: &ReferencePoint, height: f32, error: Vec3) -> bool {
    let e = at.p_error + error;
    height <= e.x + e.y + e.z
}

/// distance^2 / |cos|; `None` edge-on or at distance zero.
#[inline(always)]
fn solid_angle_per_area_inverse(to: Vec3, n: Normal3) -> Option<f32> {
    let d2 = to.length_squared();
    let cos = n.dot(to).abs() / d2.sqrt();
    (d2 > 0.0 && cos > 0.0).then(|| d2 / cos)
}

/// Weights that make a bilinear density follow |cos| at the receiver, never below 0.01.
#[inline]
fn cosine_weights(ns: Normal3, directions: [Vec3; 4]) -> [f32; 4] {
    cosine_weights_of(directions.map(|w| ns.dot(w)))
}

/// The same from cosines.
#[inline(always)]
fn cosine_weights_of(cosines: [f32; 4]) -> [f32; 4] {
    let [a, b, c, d] = cosines;
    [a.abs().max(0.01), b.abs().max(0.01), c.abs().max(0.01), d.abs().max(0.01)]
}

/// Flat shapes whose squared radius is less than this share of their squared distance are sampled by area.
///
/// By solid angle costs some 70 ns more and pays only close to a light. In the Cornell box, at equal samples and against
/// solid angles everywhere: 0.03 takes 0.93 of the time and 1.004 of the variance, 0.1 takes 0.83 and 1.02, no limit
/// takes 0.79 and 1.04 but has no bound on its variance near a light.
const FAR: f32 = 0.08;

/// From where on a flat shape is so far that all of it is seen about alike, and a point by area will do.
#[derive(Clone, Copy, Debug)]
struct Nearness {
    center: Point3,
    /// Squared distance from the centre.
    limit: f32,
}

impl Nearness {
    fn new<const N: usize>(corners: [Point3; N]) -> Self {
        let sum = corners.iter().fold(Vec3::ZERO, |sum, c| sum + c.as_vec() * (1.0 / N as f32));
        let center = sum.as_point();
        let radius = corners.iter().fold(0.0f32, |r, c| r.max(c.distance(center)));
        Self { center, limit: radius * radius / FAR }
    }

    /// False for NaN.
    #[inline(always)]
    fn is_far(&self, p: Point3) -> bool {
        (p - self.center).length_squared() > self.limit
    }
}

/// A piece of a curve that may emit.
#[derive(Clone, Copy, Debug)]
pub struct CurveEmitter {
    pub(crate) bounds: Bounds3,
    pub(crate) area: f32,
}
