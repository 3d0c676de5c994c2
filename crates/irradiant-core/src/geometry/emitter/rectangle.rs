//! Rectangles made of two triangles: by solid angle, warped by the cosine at the receiver; far ones by area.
//!
//! Two triangles of a mesh that together are a rectangle are one emitter: half as many lights to choose from, and no
//! seam for strata to break at.

use super::{Drawn, Nearness, NormalCone, ShapeSample, TriangleEmitter, cosine_weights_of, is_on_plane};
use crate::geometry::placement::{Double3, add, cross, dot, double, length, scale, single, sub};
use crate::geometry::triangle::interpolate2;
use crate::interaction::ReferencePoint;
use irradiant_math::warp::{SphericalRectangle, bilinear, bilinear_pdf};
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Vec3, gamma};

/// How far, in edges, corners may be from those of a true rectangle: text of six digits is.
const SLACK: f64 = 2e-5;

/// A rectangle that may emit.
#[derive(Clone, Debug)]
pub struct RectangleEmitter {
    pub(super) corner: Point3,
    /// Full edges.
    pub(super) ex: Vec3,
    pub(super) ey: Vec3,
    /// Orthonormal: along the edges, and across.
    pub(super) axes: [Vec3; 3],
    pub(super) lengths: [f32; 2],
    pub(super) near: Nearness,
    area: f32,
    pub(super) per_area: f32,
    /// On the outer side, unit.
    pub(super) n: Normal3,
    /// Holds for every point.
    pub(super) p_error: Vec3,
    /// Of the triangle at `corner`, and of the one across: texture coordinates of its right angle, then of the ends of
    /// `ex` and `ey`.
    uvs: [[[f32; 2]; 3]; 2],
}

impl RectangleEmitter {
    /// The rectangle that two triangles are, if they are one and agree about the outside.
    pub(crate) fn of_triangles(a: &TriangleEmitter, b: &TriangleEmitter) -> Option<Self> {
        let across = |t: &TriangleEmitter, other: &TriangleEmitter| {
            let mut alone = (0..3).filter(|&i| !other.p.contains(&t.p[i]));
            alone.next().filter(|_| alone.next().is_none())
        };
        let (i, j) = (across(a, b)?, across(b, a)?);
        let (s, t) = ((i + 1) % 3, (i + 2) % 3);
        let find = |k: usize| b.p.iter().position(|&q| q == a.p[k]);
        let (s_in_b, t_in_b) = (find(s)?, find(t)?);
        let corner: Double3 = double(a.p[i].to_array());
        let (ps, pt) = (double(a.p[s].to_array()), double(a.p[t].to_array()));
        let (ex, ey) = (sub(ps, corner), sub(pt, corner));
        let (lx, ly) = (length(ex), length(ey));
        let opposite = sub(add(ps, pt), corner);
        let gap = sub(double(b.p[j].to_array()), opposite);
        let is_rectangle = lx > 0.0
            && ly > 0.0
            && length(gap) <= SLACK * lx.min(ly)
            && dot(ex, ey).abs() <= SLACK * lx * ly
            && lx.max(ly).is_finite();
        let (cone, other) = (a.normal_cone(), b.normal_cone());
        if !is_rectangle || cone.cos_angle < 1.0 || other.cos_angle < 1.0 || cone.axis.dot(other.axis) < 0.999 {
            return None;
        }
        let (x, y) = (scale(ex, 1.0 / lx), scale(ey, 1.0 / ly));
        let z = cross(x, y);
        // A second edge exactly across the first.
        let z = scale(z, 1.0 / length(z));
        let y = cross(z, x);
        let largest = [0, 1, 2].map(|k| {
            [corner[k], ps[k], pt[k], opposite[k]].iter().fold(0.0f64, |m, c| m.max(c.abs())) as f32 * gamma(7)
                + gap[k].abs() as f32
        });
        let area = (lx * ly) as f32;
        Some(Self {
            corner: a.p[i],
            ex: single(ex).into(),
            ey: single(ey).into(),
            axes: [x, y, z].map(|v| single(v).into()),
            lengths: [lx as f32, ly as f32],
            near: Nearness::new([a.p[i], a.p[s], a.p[t], b.p[j]]),
            area,
            per_area: 1.0 / area,
            n: cone.axis.as_normal(),
            p_error: largest.into(),
            uvs: [[a.uvs[i], a.uvs[s], a.uvs[t]], [b.uvs[j], b.uvs[t_in_b], b.uvs[s_in_b]]],
        })
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        let c = self.corner;
        let b = Bounds3::from_points([c, c + self.ex, c + self.ey, c + self.ex + self.ey]);
        Bounds3 { min: b.min - self.p_error, max: b.max + self.p_error }
    }

    pub(super) fn normal_cone(&self) -> NormalCone {
        NormalCone { axis: self.n.as_vec(), cos_angle: 1.0 }
    }

    /// As a hit of the triangle there would report.
    #[inline]
    fn uv(&self, s: f32, t: f32) -> Point2 {
        if s + t <= 1.0 {
            interpolate2(&self.uvs[0], [1.0 - s - t, s, t])
        } else {
            interpolate2(&self.uvs[1], [s + t - 1.0, 1.0 - s, 1.0 - t])
        }
    }

    #[inline]
    fn at(&self, s: f32, t: f32, pdf: f32, wants_uv: bool) -> ShapeSample {
        let p = self.corner + (self.ex * s + self.ey * t);
        let uv = if wants_uv { self.uv(s, t) } else { Point2::ZERO };
        ShapeSample { p, p_error: self.p_error, n: self.n, uv, pdf }
    }

    #[inline]
    pub(super) fn sample_area(&self, u: Point2, wants_uv: bool) -> ShapeSample {
        self.at(u.x, u.y, self.per_area, wants_uv)
    }

    #[inline]
    fn seen_from(&self, p: Point3) -> Option<SphericalRectangle> {
        if self.near.is_far(p) {
            return None;
        }
        SphericalRectangle::with_axes(p, self.corner, self.axes, self.lengths)
    }

    /// Cosines at the corners; their directions are known but for their lengths, which `seen` has.
    #[inline]
    fn weights(&self, at: &ReferencePoint, seen: &SphericalRectangle) -> Option<[f32; 4]> {
        if at.ns == Normal3::ZERO {
            return None;
        }
        Some(Self::weights_at(at.p, at.ns, self.corner, self.ex, self.ey, seen))
    }

    #[inline(always)]
    pub(super) fn weights_at(
        p: Point3,
        ns: Normal3,
        corner: Point3,
        ex: Vec3,
        ey: Vec3,
        seen: &SphericalRectangle,
    ) -> [f32; 4] {
        let (c, x, y) = (ns.dot(corner - p), ns.dot(ex), ns.dot(ey));
        let [d00, d10, d01, d11] = seen.corner_distances();
        cosine_weights_of([c / d00, (c + x) / d10, (c + y) / d01, (c + x + y) / d11])
    }

    #[inline]
    pub(super) fn sample(&self, at: &ReferencePoint, u: Point2, wants_uv: bool) -> Drawn {
        let Some(seen) = self.seen_from(at.p) else { return Drawn::ByArea };
        if is_on_plane(at, seen.height(), self.p_error) {
            return Drawn::Nothing;
        }
        let (u, mut pdf) = match self.weights(at, &seen) {
            Some(w) => {
                let u = bilinear(u, w);
                (u, bilinear_pdf(u, w))
            }
            None => (u, 1.0),
        };
        pdf /= seen.solid_angle();
        let [a, b] = seen.sample_along(u);
        let (s, t) = ((a / self.lengths[0]).min(1.0), (b / self.lengths[1]).min(1.0));
        Drawn::BySolidAngle(self.at(s, t, pdf, wants_uv))
    }

    pub(super) fn pdf(&self, at: &ReferencePoint, p: Point3) -> Option<f32> {
        let seen = self.seen_from(at.p)?;
        if is_on_plane(at, seen.height(), self.p_error) {
            return Some(0.0);
        }
        let warp = self.weights(at, &seen).map_or(1.0, |w| bilinear_pdf(seen.inverse(p), w));
        Some(warp / seen.solid_angle())
    }
}
