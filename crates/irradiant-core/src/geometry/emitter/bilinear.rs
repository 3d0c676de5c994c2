//! Bilinear patches: rectangles by solid angle, warped by the cosine at the receiver; others by area.

use super::{Drawn, Nearness, NormalCone, ShapeSample, cosine_weights, is_on_plane};
use crate::geometry::bilinear::{self, Corners};
use crate::geometry::placement::{cross, dot, double, length, scale, single, sub};
use crate::interaction::ReferencePoint;
use irradiant_math::warp::{SphericalRectangle, bilinear, bilinear_pdf};
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Vec3, gamma};

/// Smaller rectangles are sampled by area, as in pbrt.
const LEAST_SOLID_ANGLE: f32 = 1e-4;

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
    near: Nearness,
    /// Holds for every point of a rectangle.
    p_error: Vec3,
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
            near: Nearness::new(p.map(|c| Point3::from(single(c)))),
            p_error: [0, 1, 2].map(|k| p.iter().fold(0.0f64, |m, c| m.max(c[k].abs())) as f32 * gamma(7)).into(),
        }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        Bounds3::from_points(self.p.map(|c| Point3::from(single(c))))
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

    pub(super) fn normal_cone(&self) -> NormalCone {
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

    pub(super) fn sample_area(&self, u: Point2) -> ShapeSample {
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

    pub(super) fn pdf_area(&self, p: Point3, uv: Point2) -> f32 {
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
        if !self.is_rectangle || self.near.is_far(p) {
            return None;
        }
        let corner = |i: usize| Point3::from(single(self.p[i]));
        SphericalRectangle::new(p, corner(0), corner(1) - corner(0), corner(2) - corner(0))
            .filter(|s| s.solid_angle() > LEAST_SOLID_ANGLE)
    }

    fn cosines(&self, at: &ReferencePoint) -> Option<[f32; 4]> {
        (at.ns != Normal3::ZERO)
            .then(|| cosine_weights(at.ns, self.p.map(|c| (Point3::from(single(c)) - at.p).normalize())))
    }

    pub(super) fn sample(&self, at: &ReferencePoint, u: Point2) -> Drawn {
        let Some(seen) = self.seen_from(at.p) else { return Drawn::ByArea };
        if is_on_plane(at, seen.height(), self.p_error) {
            return Drawn::Nothing;
        }
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

    pub(super) fn pdf(&self, at: &ReferencePoint, p: Point3) -> Option<f32> {
        let seen = self.seen_from(at.p)?;
        if is_on_plane(at, seen.height(), self.p_error) {
            return Some(0.0);
        }
        let warp = self.cosines(at).map_or(1.0, |w| bilinear_pdf(seen.inverse(p), w));
        Some(warp / seen.solid_angle())
    }
}
