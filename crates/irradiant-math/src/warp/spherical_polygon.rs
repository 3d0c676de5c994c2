//! Triangles and rectangles as seen from a point: uniform by solid angle, with inverse.

use crate::elementary::{ONE_MINUS_EPSILON, atan2, atan2_core, safe_sqrt, sin_cos, sin_cos_core};
use crate::vector::{Point2, Point3, Vec3};

/// A triangle projected to the unit sphere around a point, ready to be sampled by solid angle.
///
/// Arvo 1995, "Stratified sampling of spherical triangles", in the vector form of Peters 2021, "BRDF importance sampling
/// for polygonal lights" (the same map, with one `atan2` and one `sin_cos` instead of a dozen). The solid angle is van
/// Oosterom and Strackee's (1983), of edge differences, so that small triangles keep their digits.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    volume: f32,
    third: f32,
    half: f32,
    solid_angle: f32,
}

impl SphericalTriangle {
    /// The triangle `v` seen from `p`; `None` when `p` lies in its plane or on a vertex, or anything is not finite.
    #[inline]
    pub fn new(v: [Point3; 3], p: Point3) -> Option<Self> {
        Self::from_vectors([v[0] - p, v[1] - p, v[2] - p])
    }

    /// As [`SphericalTriangle::new`], for vertices relative to the point of view.
    #[inline]
    pub fn from_vectors(v: [Vec3; 3]) -> Option<Self> {
        let (a, b, c) = (v[0].normalize(), v[1].normalize(), v[2].normalize());
        // det(a, b, c) of differences: the direct triple product cancels when the three are close.
        let volume = a.dot((b - a).cross(c - a)).abs();
        let third = a.dot(c) + b.dot(c);
        let half = 1.0 + a.dot(b);
        let solid_angle = 2.0 * atan2(volume, third + half);
        (solid_angle > 0.0).then_some(Self { a, b, c, volume, third, half, solid_angle })
    }

    /// Solid angle, in (0, 2 pi) steradians; its reciprocal is the density of [`SphericalTriangle::sample`].
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// Directions of the vertices, unit.
    #[inline]
    pub fn corners(&self) -> [Vec3; 3] {
        [self.a, self.b, self.c]
    }

    /// Uniform direction of the triangle; unit length.
    #[inline]
    pub fn sample(&self, u: Point2) -> Vec3 {
        // The vertex c' on the arc a-c that leaves the fraction u.x of the area in a, b, c'.
        let (s, c) = sin_cos(0.5 * self.solid_angle * u.x);
        let (p, q) = (self.volume * c - self.third * s, self.half * s);
        let half_way = self.a * p + self.c * q;
        let c_prime = half_way * (2.0 * self.a.dot(half_way) / half_way.length_squared()) - self.a;
        // Along the arc b-c', uniform in height above the plane normal to b: 1 - cos = |difference|^2 / 2.
        let along = c_prime - self.b;
        let height_max = 0.5 * along.length_squared();
        if !(height_max > 0.0) {
            return self.b;
        }
        let height = u.y * height_max;
        // w = cos b + sin t, with t the unit tangent at b towards c'.
        let sin_max = safe_sqrt(height_max * (2.0 - height_max));
        let sin = safe_sqrt(height * (2.0 - height));
        let tangent = if sin_max > 0.0 { sin / sin_max } else { u.y };
        let w = self.b * (1.0 - height) + (along + self.b * height_max) * tangent;
        w.normalize()
    }

    /// The `u` that [`SphericalTriangle::sample`] maps to the unit vector `w`; clamped to the unit square.
    #[inline]
    pub fn inverse(&self, w: Vec3) -> Point2 {
        let c_prime = self.b.cross(w).cross(self.c.cross(self.a)).normalize();
        if !c_prime.is_finite() {
            // w is b, where every u.x leads.
            return Point2::new(0.5, 0.0);
        }
        let c_prime = if c_prime.dot(self.a + self.c) < 0.0 { -c_prime } else { c_prime };
        let (a, b) = (self.a, self.b);
        let volume = a.dot((b - a).cross(c_prime - a)).abs();
        let area = 2.0 * atan2(volume, (a.dot(c_prime) + b.dot(c_prime)) + self.half);
        let height = (w - b).length_squared() / (c_prime - b).length_squared();
        Point2::new(
            (area / self.solid_angle).clamp(0.0, ONE_MINUS_EPSILON),
            if height.is_finite() { height.clamp(0.0, ONE_MINUS_EPSILON) } else { 0.0 },
        )
    }

    /// Barycentric coordinates of the point of the triangle `v` (relative to the point of view) that direction `w` meets;
    /// clamped to the triangle.
    #[inline]
    pub fn barycentrics(v: [Vec3; 3], w: Vec3) -> [f32; 3] {
        let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
        let s1 = w.cross(e2);
        let divisor = s1.dot(e1);
        if divisor == 0.0 {
            return [1.0 / 3.0; 3];
        }
        let s = -v[0];
        let b1 = (s.dot(s1) / divisor).clamp(0.0, 1.0);
        let b2 = (w.dot(s.cross(e1)) / divisor).clamp(0.0, 1.0);
        let sum = b1 + b2;
        if sum > 1.0 { [0.0, b1 / sum, b2 / sum] } else { [1.0 - sum, b1, b2] }
    }
}

/// A rectangle seen from a point, ready to be sampled by solid angle.
///
/// The map is that of Urena, Fajardo and King 2013, "An area-preserving parametrization for spherical rectangles", but
/// their sums of arc cosines are arguments of products of complex numbers here, so that one `atan2` makes the solid
/// angle and one `sin_cos` a sample. In `f64`, since the solid angle is a small difference of large ones.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    origin: Point3,
    x: Vec3,
    y: Vec3,
    /// Towards the rectangle's plane.
    z: Vec3,
    x0: f64,
    x1: f64,
    y0: f64,
    y1: f64,
    /// Distance of the plane, > 0.
    h: f64,
    /// Distances of the corners (x0, y0), (x1, y0), (x0, y1), (x1, y1).
    corners: [f64; 4],
    /// With the angle that the edge x0 makes (see `edge_turn`).
    start: Turn,
    solid_angle: f64,
}

/// An angle as a point in its direction, of any length.
#[derive(Clone, Copy, Debug)]
struct Turn {
    cos: f64,
    sin: f64,
}

impl Turn {
    /// The sum of the angles.
    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        Self { cos: self.cos * b.cos - self.sin * b.sin, sin: self.sin * b.cos + self.cos * b.sin }
    }

    /// The difference of the angles.
    #[inline(always)]
    fn minus(self, b: Self) -> Self {
        self.plus(Self { cos: b.cos, sin: -b.sin })
    }

    /// The angle, in [0, 2 pi).
    #[inline(always)]
    fn angle(self) -> f64 {
        let a = atan2_core(self.sin, self.cos);
        if a < 0.0 { a + std::f64::consts::TAU } else { a }
    }
}

/// atan(x y1 / (h d1)) - atan(x y0 / (h d0)): the solid angle of the strip [0, x] x [y0, y1] at height h, where d0 and d1
/// are the distances of (x, y0, h) and (x, y1, h).
#[inline(always)]
fn edge_turn(x: f64, y0: f64, y1: f64, h: f64, d0: f64, d1: f64) -> Turn {
    Turn { cos: h * d1, sin: x * y1 }.minus(Turn { cos: h * d0, sin: x * y0 })
}

impl SphericalRectangle {
    /// The rectangle of corner `s` and orthogonal edges `ex`, `ey` seen from `p`; `None` when `p` lies in its plane or
    /// anything is degenerate or not finite.
    #[inline]
    pub fn new(p: Point3, s: Point3, ex: Vec3, ey: Vec3) -> Option<Self> {
        let (length_x, length_y) = (ex.length(), ey.length());
        let (x, y) = (ex / length_x, ey / length_y);
        Self::with_axes(p, s, [x, y, x.cross(y)], [length_x, length_y])
    }

    /// As [`SphericalRectangle::new`], for edges along the first two of three orthonormal `axes` and their lengths.
    #[inline(always)]
    pub fn with_axes(p: Point3, s: Point3, axes: [Vec3; 3], lengths: [f32; 2]) -> Option<Self> {
        let (seen, is_sound) = Self::perhaps(p, s, axes, lengths);
        is_sound.then_some(seen)
    }

    /// As [`SphericalRectangle::with_axes`], with whether it is any good, for loops that choose later.
    #[inline(always)]
    pub fn perhaps(p: Point3, s: Point3, axes: [Vec3; 3], lengths: [f32; 2]) -> (Self, bool) {
        let d = s - p;
        let [x, y, z] = axes;
        let (x0, y0, height) = (d.dot(x) as f64, d.dot(y) as f64, d.dot(z));
        let (x1, y1, h) = (x0 + lengths[0] as f64, y0 + lengths[1] as f64, height.abs() as f64);
        let h2 = h * h;
        let (c0, c1) = (x0 * x0 + h2, x1 * x1 + h2);
        let (s0, s1) = (y0 * y0, y1 * y1);
        // Written out, not mapped: loops over many points become vector code.
        let corners = [(c0 + s0).sqrt(), (c1 + s0).sqrt(), (c0 + s1).sqrt(), (c1 + s1).sqrt()];
        let start = edge_turn(x0, y0, y1, h, corners[0], corners[2]);
        let solid_angle = edge_turn(x1, y0, y1, h, corners[1], corners[3]).minus(start).angle();
        // A point of the plane itself, but for rounding, must not see a half-space of rectangle: a lamp would light itself.
        let rounding = 1e-6 * (p.abs().max_component() + s.abs().max_component()) + 1e-5 * lengths[0].max(lengths[1]);
        // Far away or almost in its plane, rounding leaves nothing (or a full turn); NaN compares false too.
        let sound = h > rounding as f64 && solid_angle > 0.0 && solid_angle < std::f64::consts::TAU;
        let z = if height < 0.0 { -z } else { z };
        (Self { origin: p, x, y, z, x0, x1, y0, y1, h, corners, start, solid_angle }, sound)
    }

    /// Solid angle, in (0, 2 pi) steradians; its reciprocal is the density of [`SphericalRectangle::sample`].
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// Distance of the rectangle's plane, > 0.
    #[inline]
    pub fn height(&self) -> f32 {
        self.h as f32
    }

    /// Distances of the corners `s`, `s + ex`, `s + ey`, `s + ex + ey`.
    #[inline]
    pub fn corner_distances(&self) -> [f32; 4] {
        let [a, b, c, d] = self.corners;
        [a as f32, b as f32, c as f32, d as f32]
    }

    /// Where on the rectangle a direction uniform over its solid angle leads: distances from `s` along the edges.
    #[inline(always)]
    pub fn sample_along(&self, u: Point2) -> [f32; 2] {
        let (h, y0, y1) = (self.h, self.y0, self.y1);
        let h2 = h * h;
        // The edge x that leaves the share u.x: its strip angle is phi = that of x0 plus the share.
        let (sin, cos) = sin_cos_core(u.x as f64 * self.solid_angle);
        let phi = self.start.plus(Turn { cos, sin });
        // Sines of the heights of the edges y0, y1 above x = 0; the strip angle of x has, with s = sin phi, c = cos phi,
        // x = h s / sqrt((b1 - b0 c)^2 - (1 - b0^2) s^2).
        let (r0, r1) = ((h2 + y0 * y0).sqrt(), (h2 + y1 * y1).sqrt());
        // The same multiplied by r0 r1 and the length of phi.
        let length = (phi.cos * phi.cos + phi.sin * phi.sin).sqrt();
        let n = y1 * r0 * length - y0 * r1 * phi.cos;
        let m = h * r1 * phi.sin;
        let x = h * phi.sin * (r0 * r1) / ((n - m) * (n + m)).max(0.0).sqrt();
        // Infinite or NaN at the far end of a long strip.
        let x = if x > self.x0 {
            x.min(self.x1)
        } else if phi.sin > 0.0 && !(x <= self.x1) {
            self.x1
        } else {
            self.x0
        };
        // Along that line, uniform in the sine of the height.
        let d2 = x * x + h2;
        let s0 = y0 / (d2 + y0 * y0).sqrt();
        let s1 = y1 / (d2 + y1 * y1).sqrt();
        let s = s0 + u.y as f64 * (s1 - s0);
        let rest = 1.0 - s * s;
        let y = s * (d2 / rest).sqrt();
        // As `clamp`, which would ask whether y0 <= y1.
        let y = if y < y0 { y0 } else { y };
        let y = if y > y1 { y1 } else { y };
        let y = if rest > 1e-12 { y } else { y1 };
        [(x - self.x0) as f32, (y - y0) as f32]
    }

    /// The point of the rectangle in a direction that is uniform over its solid angle.
    #[inline]
    pub fn sample(&self, u: Point2) -> Point3 {
        let [a, b] = self.sample_along(u);
        let (x, y) = (self.x0 + a as f64, self.y0 + b as f64);
        self.origin + self.x * x as f32 + self.y * y as f32 + self.z * self.h as f32
    }

    /// The `u` that [`SphericalRectangle::sample`] maps to the point `q` of the rectangle; clamped to the unit square.
    ///
    /// `u.x` is the share of the solid angle on the near side of `q` along x.
    #[inline]
    pub fn inverse(&self, q: Point3) -> Point2 {
        let d = q - self.origin;
        let x = (d.dot(self.x) as f64).clamp(self.x0, self.x1);
        let y = (d.dot(self.y) as f64).clamp(self.y0, self.y1);
        let d2 = x * x + self.h * self.h;
        let (d0, d1) = ((d2 + self.y0 * self.y0).sqrt(), (d2 + self.y1 * self.y1).sqrt());
        let part = edge_turn(x, self.y0, self.y1, self.h, d0, d1).minus(self.start);
        // A hair below zero is zero, not a full turn; a true share is never beyond the whole.
        let near = part.angle();
        let near = if near > 0.5 * (self.solid_angle + std::f64::consts::TAU) { 0.0 } else { near };
        let (s0, s1) = (self.y0 / d0, self.y1 / d1);
        let s = y / (d2 + y * y).sqrt();
        let inside = |v: f64| (v as f32).clamp(0.0, ONE_MINUS_EPSILON);
        Point2::new(inside(near / self.solid_angle), inside((s - s0) / (s1 - s0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::uniform_sphere;
    use irradiant_testkit::{Chi2, Mean, Rng};

    fn uniform(rng: &mut Rng) -> Point2 {
        Point2::new(rng.next_f32(), rng.next_f32())
    }

    fn triangles() -> Vec<[Vec3; 3]> {
        vec![
            [Vec3::X, Vec3::Y, Vec3::Z],
            [Vec3::new(1.0, -1.0, 0.2), Vec3::new(1.0, 1.0, 0.1), Vec3::new(-1.2, 0.3, 0.3)],
            [Vec3::new(0.9, 0.1, 3.0), Vec3::new(-0.2, 1.0, 2.0), Vec3::new(0.3, -0.4, 2.5)],
            [Vec3::new(0.02, 0.0, 1.0), Vec3::new(0.0, 0.03, 1.0), Vec3::new(-0.01, -0.02, 1.0)],
        ]
    }

    #[test]
    fn an_octant_has_its_solid_angle_and_tiny_triangles_their_area() {
        let t = SphericalTriangle::from_vectors([Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
        assert!((t.solid_angle() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        for e in [1e-1f32, 1e-2, 1e-3] {
            let t = SphericalTriangle::from_vectors([Vec3::Z, Vec3::new(e, 0.0, 1.0), Vec3::new(0.0, e, 1.0)]).unwrap();
            // Area e^2/2 seen head-on at distance 1, less the fall of cos^3 over it (about e^2/2).
            let expected = 0.5 * e * e * (1.0 - 0.5 * e * e);
            assert!((t.solid_angle() / expected - 1.0).abs() < e * e + 2e-4, "{e}: {} {expected}", t.solid_angle());
        }
        assert!(
            SphericalTriangle::from_vectors([Vec3::X, Vec3::Y, Vec3::new(-1.0, -1.0, 0.0)])
                .is_none_or(|t| t.solid_angle() > 0.999 * std::f32::consts::TAU)
        );
        assert!(SphericalTriangle::from_vectors([Vec3::ZERO, Vec3::Y, Vec3::Z]).is_none());
    }

    #[test]
    fn spherical_triangles_are_sampled_uniformly() {
        // Uniformity is tested in two ways. The inverse of a uniform direction inside must be uniform on the square, and
        // the mean direction of samples must be that of uniform ones (1e-6 and 5 sigma).
        let mut rng = Rng::new(31);
        for v in triangles() {
            let t = SphericalTriangle::from_vectors(v).unwrap();
            let report = Chi2::new(20_000).grid(
                [0.0, 0.0],
                [1.0, 1.0],
                [16, 16],
                |_, _| 1.0,
                || {
                    // A uniform direction of the triangle by an independent way: area sampling, accepted by its Jacobian.
                    let n = (v[1] - v[0]).cross(v[2] - v[0]);
                    let distance = n.dot(v[0]).abs() / n.length();
                    loop {
                        let b = crate::warp::uniform_triangle(uniform(&mut rng));
                        let q = v[0] * b[0] + v[1] * b[1] + v[2] * b[2];
                        // cos / r^2 = distance / r^3, at most 1 / distance^2.
                        let accept = (distance / q.length()).powi(3);
                        if rng.next_f32() < accept {
                            let u = t.inverse(q.normalize());
                            return Some([u.x as f64, u.y as f64]);
                        }
                    }
                },
            );
            assert!(report.p_value > 1e-6, "{v:?}: {report:?}");
            for _ in 0..20_000 {
                let u = uniform(&mut rng);
                let w = t.sample(u);
                assert!((w.length() - 1.0).abs() < 3e-7);
                let b = SphericalTriangle::barycentrics(v, w);
                assert!((v[0] * b[0] + v[1] * b[1] + v[2] * b[2]).normalize().dot(w) > 1.0 - 1e-6);
                let back = t.inverse(w);
                let slack = 1e-6 / t.solid_angle().min(1.0).sqrt() + 1e-5;
                assert!(
                    (back.x - u.x).abs() < slack / u.y.sqrt().max(1e-2) && (back.y - u.y).abs() < 10.0 * slack,
                    "{v:?} {u:?} {back:?}"
                );
            }
        }
    }

    #[test]
    fn spherical_rectangles_are_sampled_uniformly() {
        let mut rng = Rng::new(37);
        for (s, ex, ey) in [
            (Point3::new(-1.0, -1.0, 1.0), Vec3::X * 2.0, Vec3::Y * 2.0),
            (Point3::new(0.5, 0.2, -0.5), Vec3::X * 3.0, Vec3::Y * 0.7),
            (Point3::new(-4.0, -3.0, 0.05), Vec3::X * 8.0, Vec3::Y * 6.0),
            (Point3::new(1.0, 2.0, 9.0), Vec3::X * 0.3, Vec3::Y * 0.2),
            (Point3::new(1.0, 2.0, 90.0), Vec3::X * 0.3, Vec3::Y * 0.2),
        ] {
            let r = SphericalRectangle::new(Point3::ZERO, s, ex, ey).unwrap();
            let n = ex.cross(ey);
            let area = n.length();
            let distance = s.z.abs();
            // The solid angle against quadrature of cos / r^2 over the area.
            let exact = irradiant_testkit::integrate_square(
                |a, b| {
                    let q = s.as_vec() + ex * a as f32 + ey * b as f32;
                    (area * distance / (q.length_squared() * q.length())) as f64
                },
                1e-7,
            );
            assert!((r.solid_angle() as f64 / exact - 1.0).abs() < 2e-5, "{s:?} {} {exact}", r.solid_angle());
            // Uniform directions, by rejection, inverted, are uniform on the square.
            let nearest = {
                let clamp = |a: f32, l: f32| {
                    if a > 0.0 {
                        a
                    } else if a + l < 0.0 {
                        a + l
                    } else {
                        0.0
                    }
                };
                Vec3::new(clamp(s.x, ex.x), clamp(s.y, ey.y), s.z).length()
            };
            let report = Chi2::new(20_000).grid(
                [0.0, 0.0],
                [1.0, 1.0],
                [16, 16],
                |_, _| 1.0,
                || loop {
                    let u = uniform(&mut rng);
                    let q = s + ex * u.x + ey * u.y;
                    if rng.next_f32() < (nearest / q.as_vec().length()).powi(3) {
                        let u = r.inverse(q);
                        return Some([u.x as f64, u.y as f64]);
                    }
                },
            );
            assert!(report.p_value > 1e-6, "{s:?}: {report:?}");
            for _ in 0..20_000 {
                let u = uniform(&mut rng);
                let q = r.sample(u);
                let back = r.inverse(q);
                let slack = 1e-5 + 2e-6 / r.solid_angle().sqrt();
                assert!(
                    (back - u).length() < slack.max(3e-4 * (distance < 0.1) as u8 as f32),
                    "{s:?} {u:?} {back:?} {}",
                    r.solid_angle()
                );
            }
        }
        assert!(SphericalRectangle::new(Point3::ZERO, Point3::new(1.0, 1.0, 0.0), Vec3::X, Vec3::Y).is_none());
    }

    #[test]
    fn sampling_a_triangle_integrates_like_sampling_the_sphere() {
        let v = triangles()[2];
        let t = SphericalTriangle::from_vectors(v).unwrap();
        let mut rng = Rng::new(41);
        let f = |w: Vec3| (w.x * w.x + 2.0 * w.z) as f64;
        let (mut ours, mut theirs) = (Mean::new(), Mean::new());
        for _ in 0..100_000 {
            ours.add(f(t.sample(uniform(&mut rng))) * t.solid_angle() as f64);
            let w = uniform_sphere(uniform(&mut rng));
            let inside = |a: Vec3, b: Vec3, c: Vec3| a.cross(b).dot(w) * a.cross(b).dot(c) >= 0.0;
            let hit = inside(v[0], v[1], v[2]) && inside(v[1], v[2], v[0]) && inside(v[2], v[0], v[1]);
            theirs.add(if hit { f(w) * 4.0 * std::f64::consts::PI } else { 0.0 });
        }
        // 4.5 sigma: one false alarm in 150,000; a 5 % error would show.
        assert!(irradiant_testkit::z_score(&ours, &theirs).abs() < 4.5, "{ours:?} {theirs:?}");
    }

    #[test]
    fn a_point_of_its_own_plane_sees_no_rectangle() {
        // A tilted lamp far from the origin, seen from points of itself that are rounded to f32.
        let (s, ex, ey) = (Point3::new(40.3, 7.7, -90.1), Vec3::new(1.2, 0.0, 0.0), Vec3::new(0.0, -0.1, 1.1));
        for i in 0..1000 {
            let (a, b) = ((i % 31) as f32 / 30.0, (i / 31) as f32 / 33.0);
            assert!(SphericalRectangle::new(s + (ex * a + ey * b), s, ex, ey).is_none(), "{a} {b}");
        }
        assert!(SphericalRectangle::new(s + (ex + ey) * 0.5 + Vec3::new(0.0, 0.01, 0.0), s, ex, ey).is_some());
    }
}
