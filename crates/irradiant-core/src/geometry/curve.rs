//! Curves: cubic Bezier segments with a width, as flat strips, tubes or ribbons, for hair and grass.
//!
//! Met as in pbrt-v4 (Nakamaru and Ohno 2002, after Pharr et al. 2023, section 6.7): control points projected along the
//! ray, halved until straight to a twentieth of the width, then the distance to the curve against the width. Each
//! segment stands in the acceleration structure as 2^split_depth pieces whose control points are stored, not recomputed.
//!
//! A curve has no thickness that rays could resolve, so the error bound of a hit is its whole width, as pbrt's: rays
//! leave from beside the strip.

use super::placement::{Placement, double, single};
use crate::interaction::Interaction;
use irradiant_math::{Bounds3, Frame, Normal3, Point2, Point3, Ray, Transform, Vec3, elementary};
use irradiant_scene::desc::shape::{CurveData, CurveStyle};

/// Halvings below a piece at most.
const MAX_DEPTH: i32 = 10;

/// Fraction bits of sqrt(2): where the nearest power of two changes.
const SQRT_2_MANTISSA: u32 = std::f32::consts::SQRT_2.to_bits() & 0x7f_ffff;

type Control = [Point3; 4];

#[derive(Clone, Debug)]
struct Segment {
    control: Control,
    width: [f32; 2],
    /// Ribbons: unit normals at both ends, and the angle between them.
    normals: [Normal3; 2],
    angle: f32,
}

#[derive(Clone, Debug)]
struct Piece {
    control: Control,
    u0: f32,
    u1: f32,
    segment: u32,
}

/// A chain of segments with its place.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    style: CurveStyle,
    flip: bool,
    /// Only for maps that are not a rotation with even scale: else control points are already in place.
    placement: Option<Placement>,
    /// How far a hit may be off in each coordinate, in hit widths.
    error_per_width: Vec3,
    segments: Vec<Segment>,
    pieces: Vec<Piece>,
}

/// A meeting of ray and piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurveHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

impl Curve {
    /// `None` when `t` is singular or has perspective. Normals must be there for ribbons.
    pub fn new(data: &CurveData, t: &Transform, reverse_orientation: bool) -> Option<Self> {
        let placement = Placement::new(t, reverse_orientation)?;
        let even = placement.uniform_scale().filter(|_| !t.swaps_handedness());
        let factor = even.unwrap_or(1.0) as f32;
        let place = |p: &[f32; 3]| match even {
            Some(_) => Point3::from(single(placement.point64(double(*p)))),
            None => Point3::from(*p),
        };
        let turn = |n: &[f32; 3]| {
            let n = match even {
                Some(_) => single(placement.normal(double(*n))).into(),
                None => Normal3::from(*n),
            };
            let l = n.length();
            if l > 0.0 && l.is_finite() { n / l } else { Normal3::new(0.0, 0.0, 1.0) }
        };
        let count = data.segments.len();
        let width_at = |i: usize| {
            let x = i as f32 / count as f32;
            ((1.0 - x) * data.width0 + x * data.width1) * factor
        };
        let (mut segments, mut pieces) = (Vec::with_capacity(count), Vec::with_capacity(count << data.split_depth));
        for (i, control) in data.segments.iter().enumerate() {
            let control: Control = [0, 1, 2, 3].map(|k| place(&control[k]));
            let normals = match data.style {
                CurveStyle::Ribbon => [turn(&data.normals[i]), turn(&data.normals[i + 1])],
                CurveStyle::Flat | CurveStyle::Cylinder => [Normal3::ZERO; 2],
            };
            let angle = angle_between(normals[0].as_vec(), normals[1].as_vec());
            segments.push(Segment { control, width: [width_at(i), width_at(i + 1)], normals, angle });
            let n = 1u32 << data.split_depth;
            for k in 0..n {
                let (u0, u1) = (k as f32 / n as f32, (k + 1) as f32 / n as f32);
                pieces.push(Piece { control: section(&control, u0, u1), u0, u1, segment: i as u32 });
            }
        }
        let rows = [0, 1, 2].map(|i| (t.m[i][0].abs() + t.m[i][1].abs() + t.m[i][2].abs()) as f32 / factor);
        Some(Self {
            style: data.style,
            flip: placement.flip,
            error_per_width: if even.is_some() { rows.into() } else { Vec3::new(1.0, 1.0, 1.0) },
            placement: even.is_none().then_some(placement),
            segments,
            pieces,
        })
    }

    /// Number of pieces, each to stand in the acceleration structure.
    pub fn n_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A box around a piece, in the space of the rays.
    pub fn piece_bounds(&self, piece: u32) -> Bounds3 {
        let p = &self.pieces[piece as usize];
        let half = 0.5 * self.widest(p);
        let b = Bounds3::from_points(p.control);
        let e = Vec3::new(half, half, half);
        // The strip faces the ray, so in shape space half a width on all sides holds it.
        match &self.placement {
            Some(at) => at.box_bounds(double((b.min - e).to_array()), double((b.max + e).to_array())),
            None => super::placement::outward(double((b.min - e).to_array()), double((b.max + e).to_array())),
        }
    }

    /// Length of the control polygon times mean width: pbrt's approximation of a piece's area.
    pub fn piece_area(&self, piece: u32) -> f32 {
        let p = &self.pieces[piece as usize];
        let s = &self.segments[p.segment as usize];
        let length: f32 = (0..3).map(|i| p.control[i].distance(p.control[i + 1])).sum();
        length * 0.5 * (s.width_at(p.u0) + s.width_at(p.u1))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.segments[..]) + size_of_val(&self.pieces[..])
    }

    fn widest(&self, p: &Piece) -> f32 {
        let s = &self.segments[p.segment as usize];
        s.width_at(p.u0).max(s.width_at(p.u1))
    }

    fn ray_to_curve(&self, ray: &Ray) -> Ray {
        match &self.placement {
            None => *ray,
            Some(at) => {
                let (o, d) = at.ray_to_shape(ray);
                Ray::new(single(o).into(), single(d).into(), ray.time)
            }
        }
    }

    /// The nearest meeting with a piece, 0 < t < `t_max`.
    pub fn meet(&self, piece: u32, ray: &Ray, t_max: f32) -> Option<CurveHit> {
        let ray = self.ray_to_curve(ray);
        let p = &self.pieces[piece as usize];
        let segment = &self.segments[p.segment as usize];
        let view = View::new(&ray, &p.control)?;
        let control = p.control.map(|c| view.to_view(c));
        let reach = view.length * t_max;
        if !overlaps(&control, 0.5 * self.widest(p), reach) {
            return None;
        }
        let bend = (0..2).fold(0.0f32, |m, i| {
            let second = |a: fn(&Point3) -> f32| (a(&control[i]) - 2.0 * a(&control[i + 1]) + a(&control[i + 2])).abs();
            m.max(second(|p| p.x)).max(second(|p| p.y)).max(second(|p| p.z))
        });
        let tolerance = segment.width[0].max(segment.width[1]) * 0.05;
        let depth = if bend > 0.0 && tolerance > 0.0 {
            let ratio = std::f32::consts::SQRT_2 * 6.0 * bend / (8.0 * tolerance);
            halvings(ratio)
        } else {
            0
        };
        let mut search = Search { segment, style: self.style, view: &view, reach, best: None };
        search.descend(&control, p.u0, p.u1, depth);
        search.best.filter(|hit| hit.t > 0.0 && hit.t < t_max)
    }

    /// Fills in all that is known of a hit.
    pub fn interaction(&self, piece: u32, ray: &Ray, hit: &CurveHit, at: &mut Interaction) {
        let local = self.ray_to_curve(ray);
        let p = &self.pieces[piece as usize];
        let segment = &self.segments[p.segment as usize];
        let mut dpdu = evaluate(&segment.control, hit.u).1;
        if dpdu.length_squared() == 0.0 {
            dpdu = segment.control[3] - segment.control[0];
        }
        if dpdu.length_squared() == 0.0 {
            dpdu = Vec3::X;
        }
        let mut width = segment.width_at(hit.u);
        let dpdv = match self.style {
            CurveStyle::Ribbon => {
                let n = segment.normal_at(hit.u);
                width *= n.dot(local.d).abs() / local.d.length();
                n.as_vec().cross(dpdu).normalize() * width
            }
            CurveStyle::Flat | CurveStyle::Cylinder => {
                // Across the strip, in the plane that faces the ray.
                let z = local.d.normalize();
                let tangent = dpdu.normalize();
                let across = z.cross(dpdu).normalize();
                let across = if across.is_finite() { across } else { Frame::from_z(z).x };
                if self.style == CurveStyle::Cylinder {
                    // Turned about the curve, as if the strip bulged towards the viewer.
                    let theta = (hit.v - 0.5) * std::f32::consts::PI;
                    let (sin, cos) = elementary::sin_cos(-theta);
                    (across * cos + tangent.cross(across) * sin) * width
                } else {
                    across * width
                }
            }
        };
        let p64 = [0, 1, 2].map(|i| local.o[i] as f64 + hit.t as f64 * local.d[i] as f64);
        let n = dpdu.cross(dpdv).normalize();
        let n = if n.is_finite() { n } else { -local.d.normalize() };
        match &self.placement {
            None => {
                at.p = single(p64).into();
                at.p_error = self.error_per_width * width;
                at.n = if self.flip { -n.as_normal() } else { n.as_normal() };
                (at.dpdu, at.dpdv) = (dpdu, dpdv);
            }
            Some(place) => {
                at.p = single(place.point64(p64)).into();
                at.p_error = [0, 1, 2].map(|i| self.extent(place, i) * width).into();
                at.n = place.unit_normal(double(n.to_array())).0;
                at.dpdu = place.vector(double(dpdu.to_array()));
                at.dpdv = place.vector(double(dpdv.to_array()));
            }
        }
        at.uv = Point2::new(hit.u, hit.v);
        at.ns = at.n;
        (at.dpdus, at.dpdvs) = (at.dpdu, at.dpdv);
        (at.dndus, at.dndvs) = (Normal3::ZERO, Normal3::ZERO);
        at.face = p.segment;
    }

    /// |row i| of the map applied to (1, 1, 1).
    fn extent(&self, place: &Placement, i: usize) -> f32 {
        let column = |v: [f64; 3]| place.vector(v)[i].abs();
        column([1.0, 0.0, 0.0]) + column([0.0, 1.0, 0.0]) + column([0.0, 0.0, 1.0])
    }
}

impl Segment {
    #[inline]
    fn width_at(&self, u: f32) -> f32 {
        (1.0 - u) * self.width[0] + u * self.width[1]
    }

    /// Spherical interpolation of the ribbon's normals.
    fn normal_at(&self, u: f32) -> Normal3 {
        let sin = elementary::sin(self.angle);
        if sin.abs() < 1e-6 {
            return self.normals[0];
        }
        self.normals[0] * (elementary::sin((1.0 - u) * self.angle) / sin)
            + self.normals[1] * (elementary::sin(u * self.angle) / sin)
    }
}

/// A frame with the ray as its z axis.
struct View {
    origin: Point3,
    x: Vec3,
    y: Vec3,
    z: Vec3,
    length: f32,
}

impl View {
    /// x along the projected chord of the curve, so that boxes are tight.
    fn new(ray: &Ray, control: &Control) -> Option<Self> {
        let length = ray.d.length();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let z = ray.d / length;
        let up = z.cross(control[3] - control[0]);
        let l = up.length();
        let (x, y) = if l > 0.0 && l.is_finite() {
            let y = up / l;
            (y.cross(z), y)
        } else {
            let frame = Frame::from_z(z);
            (frame.x, frame.y)
        };
        Some(Self { origin: ray.o, x, y, z, length })
    }

    #[inline]
    fn to_view(&self, p: Point3) -> Point3 {
        let v = p - self.origin;
        Point3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}

struct Search<'a> {
    segment: &'a Segment,
    style: CurveStyle,
    view: &'a View,
    /// Distance along the ray within which hits count.
    reach: f32,
    best: Option<CurveHit>,
}

impl Search<'_> {
    fn descend(&mut self, control: &Control, u0: f32, u1: f32, depth: i32) {
        if depth == 0 {
            return self.leaf(control, u0, u1);
        }
        let middle = 0.5 * (u0 + u1);
        let (first, second) = halves(control);
        for (half, a, b) in [(first, u0, middle), (second, middle, u1)] {
            let widest = self.segment.width_at(a).max(self.segment.width_at(b));
            if overlaps(&half, 0.5 * widest, self.reach) {
                self.descend(&half, a, b, depth - 1);
            }
        }
    }

    fn leaf(&mut self, c: &Control, u0: f32, u1: f32) {
        // Beyond the perpendiculars to the tangents at the ends is the neighbour's.
        let start = (c[1].y - c[0].y) * -c[0].y + c[0].x * (c[0].x - c[1].x);
        let end = (c[2].y - c[3].y) * -c[3].y + c[3].x * (c[3].x - c[2].x);
        if start < 0.0 || end < 0.0 {
            return;
        }
        let (dx, dy) = (c[3].x - c[0].x, c[3].y - c[0].y);
        let chord2 = dx * dx + dy * dy;
        if chord2 == 0.0 {
            return;
        }
        let w = -(c[0].x * dx + c[0].y * dy) / chord2;
        let u = ((1.0 - w) * u0 + w * u1).clamp(u0, u1);
        let mut width = self.segment.width_at(u);
        if self.style == CurveStyle::Ribbon {
            width *= self.segment.normal_at(u).dot(self.view.z).abs();
        }
        let (p, tangent) = evaluate(c, w.clamp(0.0, 1.0));
        let distance2 = p.x * p.x + p.y * p.y;
        // Also false for NaN.
        if !(distance2 <= 0.25 * width * width && p.z >= 0.0 && p.z <= self.reach) {
            return;
        }
        let t = p.z / self.view.length;
        if self.best.is_some_and(|b| t > b.t) {
            return;
        }
        let side = tangent.y * p.x - tangent.x * p.y;
        let off = if width > 0.0 { distance2.sqrt() / width } else { 0.0 };
        let v = if side > 0.0 { 0.5 + off } else { 0.5 - off };
        self.best = Some(CurveHit { t, u, v });
        self.reach = p.z;
    }
}

/// Halvings that make a curve straight whose bend is `ratio` tolerances: log base 4, from the nearest whole log base 2
/// (pbrt-v4's `Log2Int` rounds to nearest, not down; the picture at sharp bends depends on it).
#[inline]
fn halvings(ratio: f32) -> i32 {
    let bits = ratio.to_bits();
    let nearest_log2 = (bits >> 23) as i32 - 127 + i32::from(bits & 0x7f_ffff >= SQRT_2_MANTISSA);
    (nearest_log2 / 2).clamp(0, MAX_DEPTH)
}

/// Whether the box of the control points, grown, can hold a point of the z axis between 0 and `reach`.
#[inline]
fn overlaps(c: &Control, grow: f32, reach: f32) -> bool {
    let b = Bounds3::new(c[0], c[1]).union(Bounds3::new(c[2], c[3]));
    b.min.x - grow <= 0.0
        && b.max.x + grow >= 0.0
        && b.min.y - grow <= 0.0
        && b.max.y + grow >= 0.0
        && b.max.z + grow >= 0.0
        && b.min.z - grow <= reach
}

/// Both halves of a Bezier curve (de Casteljau).
#[inline]
fn halves(c: &Control) -> (Control, Control) {
    let mid = |a: Point3, b: Point3| Point3::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z));
    let (a, b, d) = (mid(c[0], c[1]), mid(c[1], c[2]), mid(c[2], c[3]));
    let (e, f) = (mid(a, b), mid(b, d));
    let m = mid(e, f);
    ([c[0], a, e, m], [m, f, d, c[3]])
}

/// The point and the derivative at `u`.
#[inline]
fn evaluate(c: &Control, u: f32) -> (Point3, Vec3) {
    let (a, b, d) = (c[0].lerp(c[1], u), c[1].lerp(c[2], u), c[2].lerp(c[3], u));
    let (e, f) = (a.lerp(b, u), b.lerp(d, u));
    let derivative = (f - e) * 3.0;
    let derivative = if derivative.length_squared() > 0.0 { derivative } else { c[3] - c[0] };
    (e.lerp(f, u), derivative)
}

/// The part between `u0` and `u1`, by blossoming.
fn section(c: &Control, u0: f32, u1: f32) -> Control {
    let blossom = |s: f32, t: f32, r: f32| {
        let a = [c[0].lerp(c[1], s), c[1].lerp(c[2], s), c[2].lerp(c[3], s)];
        a[0].lerp(a[1], t).lerp(a[1].lerp(a[2], t), r)
    };
    [blossom(u0, u0, u0), blossom(u0, u0, u1), blossom(u0, u1, u1), blossom(u1, u1, u1)]
}

/// Angle between unit vectors, precise for small and large ones (Kahan, after Hughes).
fn angle_between(a: Vec3, b: Vec3) -> f32 {
    if a.dot(b) < 0.0 {
        std::f32::consts::PI - 2.0 * elementary::safe_asin(0.5 * (a + b).length())
    } else {
        2.0 * elementary::safe_asin(0.5 * (b - a).length())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// pbrt-v4's `Log2Int` rounds to nearest: a bend of 1.5 octaves is halved once, not never.
    #[test]
    fn halvings_are_half_of_the_nearest_octave() {
        let cases =
            [(0.3, 0), (1.0, 0), (2.8, 0), (2.9, 1), (4.0, 1), (11.3, 1), (11.4, 2), (45.3, 3), (1e20, MAX_DEPTH)];
        for (ratio, expected) in cases {
            assert_eq!(halvings(ratio), expected, "ratio {ratio}");
        }
        assert_eq!(halvings(f32::INFINITY), MAX_DEPTH);
    }
}
