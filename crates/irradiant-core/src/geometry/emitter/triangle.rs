//! Triangles: by solid angle, warped by the cosine at the receiver.

use super::{Drawn, Nearness, NormalCone, ShapeSample, cosine_weights};
use crate::geometry::placement::{cross, double, length, scale, single, sub};
use crate::geometry::triangle::{interpolate2, triangle_point};
use crate::interaction::ReferencePoint;
use irradiant_math::warp::{SphericalTriangle, bilinear, bilinear_pdf, uniform_triangle};
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Vec3};

/// Solid angles outside this range are sampled by area: spherical triangles lose digits when small, and BSDF sampling
/// does better when the triangle fills half of the sky. pbrt's limits; far ones are not even tried ([`Nearness`]).
const SOLID_ANGLES: std::ops::RangeInclusive<f32> = 3e-4..=6.22;

/// A triangle that may emit.
#[derive(Clone, Debug)]
pub struct TriangleEmitter {
    pub(super) p: [Point3; 3],
    pub(super) uvs: [[f32; 2]; 3],
    /// Vertex normals, which say what is outside; all zero when there are none.
    normals: [Normal3; 3],
    /// Unit; on the outer side if there are no vertex normals.
    n: Normal3,
    area: f32,
    near: Nearness,
}

impl TriangleEmitter {
    /// `flip`: outside is against (p1 - p0) x (p2 - p0), unless `normals` say otherwise.
    pub(crate) fn new(p: [Point3; 3], uvs: [[f32; 2]; 3], normals: Option<[Normal3; 3]>, flip: bool) -> Self {
        let q = p.map(|p| double(p.to_array()));
        let c = cross(sub(q[1], q[0]), sub(q[2], q[0]));
        let l = length(c);
        let sign = if flip && normals.is_none() { -1.0 } else { 1.0 };
        let n = if l > 0.0 { scale(c, sign / l) } else { [0.0, 0.0, 1.0] };
        let normals = normals.unwrap_or([Normal3::ZERO; 3]);
        Self { p, uvs, normals, n: single(n).into(), area: (0.5 * l) as f32, near: Nearness::new(p) }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        Bounds3::from_points(self.p)
    }

    #[inline]
    fn normal(&self, b: [f32; 3]) -> Normal3 {
        let ns = self.normals[0] * b[0] + self.normals[1] * b[1] + self.normals[2] * b[2];
        self.n.face_forward(ns.as_vec())
    }

    pub(crate) fn normal_cone(&self) -> NormalCone {
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

    #[inline]
    pub(super) fn sample_area(&self, u: Point2) -> ShapeSample {
        self.at(uniform_triangle(u), 1.0 / self.area)
    }

    /// The triangle on the sphere around a point, if its size there suits sampling by solid angle.
    #[inline]
    fn seen_from(&self, p: Point3) -> Option<SphericalTriangle> {
        if self.near.is_far(p) {
            return None;
        }
        SphericalTriangle::new(self.p, p).filter(|s| SOLID_ANGLES.contains(&s.solid_angle()))
    }

    #[inline]
    fn weights(at: &ReferencePoint, seen: &SphericalTriangle) -> Option<[f32; 4]> {
        if at.ns == Normal3::ZERO {
            return None;
        }
        let [w0, w1, w2] = seen.corners();
        // Where the corners of the square go: all of its edge u.y = 0 to vertex 1, (0,1) to vertex 0, (1,1) to vertex 2.
        Some(cosine_weights(at.ns, [w1, w1, w0, w2]))
    }

    pub(super) fn sample(&self, at: &ReferencePoint, u: Point2) -> Drawn {
        let Some(seen) = self.seen_from(at.p) else { return Drawn::ByArea };
        let (u, mut pdf) = match Self::weights(at, &seen) {
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

    pub(super) fn pdf(&self, at: &ReferencePoint, wi: Vec3) -> Option<f32> {
        let seen = self.seen_from(at.p)?;
        let warp = Self::weights(at, &seen).map_or(1.0, |w| bilinear_pdf(seen.inverse(wi), w));
        Some(warp / seen.solid_angle())
    }
}
