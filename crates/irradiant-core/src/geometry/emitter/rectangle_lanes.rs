//! Points drawn from many rectangles for many points that they shine on, side by side.

use super::RectangleEmitter;
use crate::geometry::SurfaceLanes;
use crate::light::TargetLanes;
use irradiant_math::lanes::{Floats, LANES, Triples, WHOLE, whole};
use irradiant_math::warp::{SphericalRectangle, bilinear, bilinear_pdf};
use irradiant_math::{Point2, Point3};

/// The rectangle of each lane, and what is drawn from it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct RectangleLanes {
    corner: Triples,
    ex: Triples,
    ey: Triples,
    axes: [Triples; 3],
    lengths: [Floats; 2],
    center: Triples,
    limit: Floats,
    per_area: Floats,
    n: Triples,
    p_error: Triples,
    // Between the steps.
    s: Floats,
    t: Floats,
    pdf: Floats,
    by_area: [u32; LANES],
    is_near: [u32; LANES],
}

impl RectangleLanes {
    /// Of nothing yet.
    pub const NONE: Self = Self {
        corner: Triples::ZERO,
        ex: Triples::ZERO,
        ey: Triples::ZERO,
        axes: [Triples::ZERO; 3],
        lengths: [[0.0; LANES]; 2],
        center: Triples::ZERO,
        limit: [0.0; LANES],
        per_area: [0.0; LANES],
        n: Triples::ZERO,
        p_error: Triples::ZERO,
        s: [0.0; LANES],
        t: [0.0; LANES],
        by_area: [0; LANES],
        is_near: [0; LANES],
        pdf: [0.0; LANES],
    };

    /// Puts a rectangle into a lane.
    pub fn set(&mut self, i: usize, r: &RectangleEmitter) {
        self.corner.set(i, r.corner.to_array());
        self.ex.set(i, r.ex.to_array());
        self.ey.set(i, r.ey.to_array());
        (0..3).for_each(|k| self.axes[k].set(i, r.axes[k].to_array()));
        (self.lengths[0][i], self.lengths[1][i]) = (r.lengths[0], r.lengths[1]);
        self.center.set(i, r.near.center.to_array());
        (self.limit[i], self.per_area[i]) = (r.near.limit, r.per_area);
        self.n.set(i, r.n.to_array());
        self.p_error.set(i, r.p_error.to_array());
    }

    /// For `n` lanes what [`AreaLight::sample`](crate::light::AreaLight::sample) draws, to the bit: into `out`.
    #[inline(always)]
    pub fn sample(
        &mut self,
        n: usize,
        at: &SurfaceLanes,
        u: [&Floats; 2],
        two_sided: &[u32; LANES],
        out: &mut TargetLanes,
    ) {
        for i in whole(n) {
            let is_far = (at.p.point(i) - self.center.point(i)).length_squared() > self.limit[i];
            (self.s[i], self.t[i], self.pdf[i]) = (u[0][i], u[1][i], self.per_area[i]);
            (self.by_area[i], self.is_near[i]) = (1, u32::from(!is_far));
        }
        // Near ones come in bunches.
        for first in whole(n).step_by(WHOLE) {
            if self.is_near[first..first + WHOLE].iter().fold(0, |any, near| any | near) != 0 {
                self.sample_near(first, at, u);
            }
        }
        for i in whole(n) {
            let reference = at.p.point(i);
            let (s, t) = (self.s[i], self.t[i]);
            let p = self.corner.point(i) + (self.ex.vector(i) * s + self.ey.vector(i) * t);
            let normal = self.n.normal(i);
            let to = p - reference;
            let d2 = to.length_squared();
            let cos = normal.dot(to).abs() / d2.sqrt();
            let by_area = self.pdf[i] * (d2 / cos);
            let is_by_area = self.by_area[i] != 0;
            let pdf = if is_by_area { by_area } else { self.pdf[i] };
            let wi = to * (1.0 / d2.sqrt());
            let usable = (!is_by_area || (d2 > 0.0 && cos > 0.0)) & (pdf > 0.0) & (pdf < f32::INFINITY) & (d2 > 0.0);
            let shines = (two_sided[i] != 0) | !(normal.dot(wi) > 0.0);
            out.wi.set(i, wi.to_array());
            out.pdf[i] = if usable & shines { pdf } else { 0.0 };
            out.p.set(i, p.to_array());
            out.p_error.set(i, self.p_error.vector(i).to_array());
            out.n.set(i, normal.to_array());
            out.is_infinite[i] = 0;
        }
    }

    /// Those of a vector that are near, by solid angle.
    #[inline(always)]
    fn sample_near(&mut self, first: usize, at: &SurfaceLanes, u: [&Floats; 2]) {
        for i in first..first + WHOLE {
            let p: Point3 = at.p.point(i);
            let corner = self.corner.point(i);
            let axes = [self.axes[0].vector(i), self.axes[1].vector(i), self.axes[2].vector(i)];
            let lengths = [self.lengths[0][i], self.lengths[1][i]];
            let (seen, is_sound) = SphericalRectangle::perhaps(p, corner, axes, lengths);
            let e = at.p_error.vector(i) + self.p_error.vector(i);
            let is_on_plane = seen.height() <= e.x + e.y + e.z;
            let w =
                RectangleEmitter::weights_at(p, at.ns.normal(i), corner, self.ex.vector(i), self.ey.vector(i), &seen);
            let warped = bilinear(Point2::new(u[0][i], u[1][i]), w);
            let pdf = bilinear_pdf(warped, w) / seen.solid_angle();
            let [a, b] = seen.sample_along(warped);
            let (s, t) = ((a / lengths[0]).min(1.0), (b / lengths[1]).min(1.0));
            let by_angle = (self.is_near[i] != 0) & is_sound;
            let pdf = if is_on_plane { 0.0 } else { pdf };
            self.s[i] = if by_angle { s } else { self.s[i] };
            self.t[i] = if by_angle { t } else { self.t[i] };
            self.pdf[i] = if by_angle { pdf } else { self.pdf[i] };
            self.by_area[i] = u32::from(!by_angle);
        }
    }
}
