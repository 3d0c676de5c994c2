//! Bilinear patches: p(u,v) between four corners, u from corner 0 to 1 and v from corner 0 to 2.
//!
//! Met as by Reshetov 2019 (Ray Tracing Gems, chapter 8), all in `f64`: for each root u of a quadratic, the nearest
//! point of the ray to the line across. Texture coordinates, orientation and shading as pbrt-v4.

use super::placement::{Double3, add, cross, dot, double, length, lerp3, scale, single, sub};
use super::triangle::{Mesh, shade};
use crate::interaction::Interaction;
use irradiant_math::vector::difference_of_products;
use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3, gamma};

/// The corners (0,0), (1,0), (0,1), (1,1) of a patch.
pub(crate) type Corners = [Double3; 4];

/// A meeting of ray and patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchHit {
    pub t: f64,
    pub u: f64,
    pub v: f64,
}

/// All meetings with t > 0, nearer first.
pub(crate) fn meet(ray: &Ray, p: &Corners) -> [Option<PatchHit>; 2] {
    let o = double(ray.o.to_array());
    let d = double(ray.d.to_array());
    let [q00, q10, q01, q11] = p.map(|c| sub(c, o));
    let (e00, e11) = (sub(q01, q00), sub(q11, q10));
    // The ray meets the line across at u when the volume spanned by both is zero: a + b u + c u^2 = 0.
    let a = dot(cross(q00, d), e00);
    let c = dot(cross(sub(q10, q00), sub(q01, q11)), d);
    let b = dot(cross(q10, d), e11) - (a + c);
    let size = length(sub(q10, q00)).max(length(e00)).max(length(sub(q11, q01))).max(length(e11));
    let scale_of_c = size * size * length(d);
    // Flat parallelograms have c = 0 but for rounding.
    let roots = if c.abs() <= 1e-12 * scale_of_c {
        [-a / b, f64::NAN]
    } else {
        let discriminant = b * b - 4.0 * a * c;
        if !(discriminant >= 0.0) {
            return [None; 2];
        }
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        [q / c, a / q]
    };
    let [first, second] = roots.map(|u| {
        if !(0.0..=1.0).contains(&u) {
            return None;
        }
        let across = lerp3(e00, e11, u);
        let from = lerp3(q00, q10, u);
        let n = cross(d, across);
        let n2 = dot(n, n);
        let m = cross(n, from);
        let (t, v) = (dot(m, across) / n2, dot(m, d) / n2);
        (t > 0.0 && t.is_finite() && (0.0..=1.0).contains(&v)).then_some(PatchHit { t, u, v })
    });
    match (first, second) {
        (Some(x), Some(y)) if y.t < x.t => [second, first],
        (None, _) => [second, None],
        _ => [first, second],
    }
}

#[inline]
pub(crate) fn point(p: &Corners, u: f64, v: f64) -> Double3 {
    lerp3(lerp3(p[0], p[2], v), lerp3(p[1], p[3], v), u)
}

/// dp/du and dp/dv.
#[inline]
pub(crate) fn derivatives(p: &Corners, u: f64, v: f64) -> (Double3, Double3) {
    (lerp3(sub(p[1], p[0]), sub(p[3], p[2]), v), lerp3(sub(p[2], p[0]), sub(p[3], p[1]), u))
}

/// The point at (u, v) in single precision, and the bound of its error (pbrt's: gamma(6) of the largest corner).
#[inline]
pub(crate) fn point_and_error(p: &Corners, u: f64, v: f64) -> (Point3, Vec3) {
    let error = [0, 1, 2].map(|i| p.iter().fold(0.0f64, |m, c| m.max(c[i].abs())) as f32 * gamma(6));
    (single(point(p, u, v)).into(), error.into())
}

/// The (u, v) of a point of the patch, by Gauss-Newton from the middle.
pub(crate) fn invert(p: &Corners, q: Double3) -> (f64, f64) {
    let (mut u, mut v) = (0.5, 0.5);
    for _ in 0..12 {
        let rest = sub(q, point(p, u, v));
        let (du, dv) = derivatives(p, u, v);
        let (uu, uv, vv) = (dot(du, du), dot(du, dv), dot(dv, dv));
        let determinant = uu * vv - uv * uv;
        if !(determinant > 0.0) {
            break;
        }
        let (ru, rv) = (dot(du, rest), dot(dv, rest));
        let (step_u, step_v) = ((ru * vv - rv * uv) / determinant, (rv * uu - ru * uv) / determinant);
        u = (u + step_u).clamp(-0.5, 1.5);
        v = (v + step_v).clamp(-0.5, 1.5);
        if step_u.abs() + step_v.abs() < 1e-9 {
            break;
        }
    }
    (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}

/// Whether a patch is a flat rectangle, by pbrt's tolerances: 1e-5 off the plane, 1e-4 in squared half diagonals.
pub(crate) fn is_rectangle(p: &Corners) -> bool {
    let [p00, p10, p01, p11] = *p;
    if p00 == p01 || p01 == p11 || p11 == p10 || p10 == p00 {
        return false;
    }
    let n = cross(sub(p10, p00), sub(p01, p00));
    let diagonal = sub(p11, p00);
    if !(dot(diagonal, n).abs() <= 1e-5 * length(n) * length(diagonal)) || length(n) == 0.0 {
        return false;
    }
    let center = scale(add(add(p00, p01), add(p10, p11)), 0.25);
    let d2 = p.map(|c| dot(sub(c, center), sub(c, center)));
    d2.iter().all(|x| (x - d2[0]).abs() <= 1e-4 * d2[0])
}

impl Mesh {
    /// Corners of a quad.
    #[inline]
    pub fn corners(&self, quad: u32) -> Corners {
        self.quads[quad as usize].map(|i| double(self.positions[i as usize]))
    }

    /// Texture coordinates at surface parameters (u, v).
    #[inline]
    pub fn patch_uv(&self, quad: u32, u: f32, v: f32) -> Point2 {
        if self.uvs.is_empty() {
            return Point2::new(u, v);
        }
        let c = self.quads[quad as usize].map(|i| self.uvs[i as usize]);
        let at = |i: usize| mix(u, mix(v, c[0][i], c[2][i]), mix(v, c[1][i], c[3][i]));
        Point2::new(at(0), at(1))
    }

    /// Fills in all that is known of a hit at (u, v) of a quad.
    pub fn patch_interaction(&self, quad: u32, u: f32, v: f32, at: &mut Interaction) {
        let p = self.corners(quad);
        let (u64, v64) = (u as f64, v as f64);
        (at.p, at.p_error) = point_and_error(&p, u64, v64);
        let (du, dv) = derivatives(&p, u64, v64);
        at.uv = self.patch_uv(quad, u, v);
        at.face = self.face(self.triangles.len() + quad as usize);
        let normal = cross(du, dv);
        // At a corner where two vertices coincide one derivative is zero; a little inside it is not.
        let normal = if length(normal) > 0.0 {
            normal
        } else {
            let inside = |x: f64| 0.5 + (x - 0.5) * 0.999;
            let (du, dv) = derivatives(&p, inside(u64), inside(v64));
            cross(du, dv)
        };
        let l = length(normal);
        let normal = if l > 0.0 { scale(normal, 1.0 / l) } else { [0.0, 0.0, 1.0] };
        let n: Normal3 = single(normal).into();
        let (mut dpdu, mut dpdv): (Vec3, Vec3) = (single(du).into(), single(dv).into());

        if !self.uvs.is_empty() {
            let c = self.quads[quad as usize].map(|i| self.uvs[i as usize]);
            let twist = |i: usize| c[0][i] - c[2][i] - c[1][i] + c[3][i];
            let by_u = |i: usize| c[1][i] - c[0][i] + v * twist(i);
            let by_v = |i: usize| c[2][i] - c[0][i] + u * twist(i);
            // pbrt's reciprocals of single entries (not the inverse matrix), kept so that footprints agree.
            let reciprocal = |x: f32| if x.abs() < 1e-8 { 0.0 } else { 1.0 / x };
            let dpds = dpdu * reciprocal(by_u(0)) + dpdv * reciprocal(by_v(0));
            let mut dpdt = dpdu * reciprocal(by_u(1)) + dpdv * reciprocal(by_v(1));
            let across = dpds.cross(dpdt);
            if across.length_squared() > 0.0 {
                if across.dot_normal(n) < 0.0 {
                    dpdt = -dpdt;
                }
                (dpdu, dpdv) = (dpds, dpdt);
            }
        }
        (at.dpdu, at.dpdv) = (dpdu, dpdv);
        (at.dpdus, at.dpdvs) = (dpdu, dpdv);

        // Weingarten: second derivatives by u and by v alone are zero.
        let twist: Vec3 = single(add(sub(p[0], p[2]), sub(p[3], p[1]))).into();
        let f = twist.dot_normal(n);
        let (e, ff, g) = (dpdu.length_squared(), dpdu.dot(dpdv), dpdv.length_squared());
        let determinant = difference_of_products(e, g, ff, ff);
        (at.dndus, at.dndvs) = (Normal3::ZERO, Normal3::ZERO);
        if determinant != 0.0 {
            let inverse = 1.0 / determinant;
            at.dndus = (dpdu * (f * ff * inverse) - dpdv * (f * e * inverse)).as_normal();
            at.dndvs = (dpdv * (f * ff * inverse) - dpdu * (f * g * inverse)).as_normal();
        }
        at.n = if self.flip { -n } else { n };
        at.ns = at.n;
        if !self.normals.is_empty() {
            self.shade_patch(quad, u, v, at);
        }
    }

    fn shade_patch(&self, quad: u32, u: f32, v: f32, at: &mut Interaction) {
        let [n00, n10, n01, n11] = self.quads[quad as usize].map(|i| self.normal(i));
        let mixed = |t: f32, a: Normal3, b: Normal3| a * (1.0 - t) + b * t;
        let ns = mixed(u, mixed(v, n00, n01), mixed(v, n10, n11));
        let l = ns.length();
        if !(l > 0.0 && l.is_finite()) {
            return;
        }
        let ns = ns / l;
        let axis = at.n.as_vec().cross(ns.as_vec());
        let dndu = mixed(v, n10, n11) - mixed(v, n00, n01);
        let dndv = mixed(u, n01, n11) - mixed(u, n00, n10);
        let sin2 = axis.length_squared();
        // Parallel or opposite: there is no turn worth the name.
        if sin2 <= 1e-14 {
            let (dpdus, dpdvs) = (at.dpdu, at.dpdv);
            return shade(at, ns, dpdus, dpdvs, dndu, dndv);
        }
        // Turn the tangents with the normal: Rodrigues about the axis perpendicular to both normals.
        let cos = at.n.dot_normal(ns);
        let (sin, axis) = (sin2.sqrt(), axis / sin2.sqrt());
        let turn = |w: Vec3| w * cos + axis.cross(w) * sin + axis * (axis.dot(w) * (1.0 - cos));
        let dpdus = turn(at.dpdu);
        let dpdus = dpdus - ns.as_vec() * dpdus.dot_normal(ns);
        let dpdvs = turn(at.dpdv);
        shade(at, ns, dpdus, dpdvs, dndu, dndv);
    }
}

#[inline]
fn mix(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}
