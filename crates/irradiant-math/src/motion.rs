//! Transforms that change over the shutter's time.
//!
//! Two keys, interpolated as pbrt-v4 does: each is split into translation, rotation and stretch (polar decomposition, Shoemake
//! and Duff 1992), the translation and the stretch are interpolated linearly, the rotation along the shortest arc
//! (Shoemake 1985). Where we depart: a mirroring key is split into a proper rotation and a negative stretch, where pbrt
//! would make a quaternion of an improper rotation.

use crate::affine::Affine;
use crate::bounds::Bounds3;
use crate::elementary::sin_cos_core;
use crate::solve::invert_3x3;
use crate::transform::Transform;
use crate::vector::{Point3, Vec3};

type Matrix3 = [[f64; 3]; 3];

/// A transform that moves from `start` at time `t0` to `end` at time `t1`, and rests before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimatedTransform {
    start: Transform,
    end: Transform,
    t0: f32,
    t1: f32,
    at_start: Affine,
    at_end: Affine,
    path: Option<Path>,
}

/// The decomposed movement.
#[derive(Clone, Debug, PartialEq)]
struct Path {
    translation: [[f64; 3]; 2],
    // q(t) = q0 cos(angle t) + perpendicular sin(angle t); w, x, y, z.
    q0: [f64; 4],
    perpendicular: [f64; 4],
    angle: f64,
    stretch: [Matrix3; 2],
    // When both stretches are equal, which is usual.
    stretch_inverse: Option<Matrix3>,
    // When only the translation changes: the linear part, ready, and its inverse.
    still: Option<Box<Still>>,
}

/// The part of a movement that does not change.
#[derive(Clone, Debug, PartialEq)]
struct Still {
    /// Without translation.
    affine: Affine,
    inverse: Matrix3,
}

fn multiply(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

fn transpose(a: &Matrix3) -> Matrix3 {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn determinant(m: &Matrix3) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

fn map(m: &Matrix3, v: [f64; 3]) -> [f64; 3] {
    m.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// The proper rotation and the stretch with m = rotation * stretch; `None` when singular.
fn polar(m: &Matrix3) -> Option<(Matrix3, Matrix3)> {
    // Higham 1986: averaging with the inverse transpose converges to the orthogonal factor.
    let mut r = *m;
    for _ in 0..100 {
        let inverse_transpose = transpose(&invert_3x3(r)?);
        let next: Matrix3 = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (r[i][j] + inverse_transpose[i][j])));
        let change = r.iter().flatten().zip(next.iter().flatten()).fold(0f64, |c, (a, b)| c.max((a - b).abs()));
        r = next;
        if change < 1e-14 {
            break;
        }
    }
    if determinant(&r) < 0.0 {
        r.iter_mut().flatten().for_each(|x| *x = -*x);
    }
    Some((r, multiply(&transpose(&r), m)))
}

/// The unit quaternion (w, x, y, z) of a proper rotation (Shepperd 1978: from the largest component).
fn quaternion(m: &Matrix3) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let mut q = [0.0; 4];
    if trace > 0.0 {
        let s = (trace + 1.0).sqrt();
        q[0] = 0.5 * s;
        let s = 0.5 / s;
        q[1] = (m[2][1] - m[1][2]) * s;
        q[2] = (m[0][2] - m[2][0]) * s;
        q[3] = (m[1][0] - m[0][1]) * s;
    } else {
        let i = (0..3).max_by(|a, b| m[*a][*a].total_cmp(&m[*b][*b])).unwrap_or(0);
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let s = (m[i][i] - m[j][j] - m[k][k] + 1.0).max(0.0).sqrt();
        q[i + 1] = 0.5 * s;
        let s = if s > 0.0 { 0.5 / s } else { 0.0 };
        q[0] = (m[k][j] - m[j][k]) * s;
        q[j + 1] = (m[j][i] + m[i][j]) * s;
        q[k + 1] = (m[k][i] + m[i][k]) * s;
    }
    let l = dot4(q, q).sqrt();
    q.map(|c| c / l)
}

fn dot4(a: [f64; 4], b: [f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The rotation matrix of a unit quaternion.
#[inline]
fn rotation([w, x, y, z]: [f64; 4]) -> Matrix3 {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

impl Path {
    fn new(start: &Transform, end: &Transform) -> Option<Self> {
        let linear = |t: &Transform| -> Matrix3 { std::array::from_fn(|i| std::array::from_fn(|j| t.m[i][j])) };
        let translation = [start, end].map(|t| [t.m[0][3], t.m[1][3], t.m[2][3]]);
        let (r0, s0) = polar(&linear(start))?;
        let (r1, s1) = polar(&linear(end))?;
        let (q0, mut q1) = (quaternion(&r0), quaternion(&r1));
        // The shorter way around.
        if dot4(q0, q1) < 0.0 {
            q1 = q1.map(|c| -c);
        }
        // The angle by its half's tangent, which keeps small ones exact.
        let difference: [f64; 4] = std::array::from_fn(|i| q1[i] - q0[i]);
        let sum: [f64; 4] = std::array::from_fn(|i| q1[i] + q0[i]);
        let angle = 2.0 * libm::atan2(dot4(difference, difference).sqrt(), dot4(sum, sum).sqrt());
        let along = dot4(q0, q1);
        let mut perpendicular: [f64; 4] = std::array::from_fn(|i| q1[i] - q0[i] * along);
        let l = dot4(perpendicular, perpendicular).sqrt();
        let turns = l > 1e-14;
        perpendicular = if turns { perpendicular.map(|c| c / l) } else { [0.0; 4] };
        let same = s0
            .iter()
            .flatten()
            .zip(s1.iter().flatten())
            .all(|(a, b)| (a - b).abs() <= 1e-12 * (a.abs() + b.abs() + 1.0));
        let stretch = [s0, if same { s0 } else { s1 }];
        let stretch_inverse = if same { Some(invert_3x3(s0)?) } else { None };
        let angle = if turns { angle } else { 0.0 };
        let mut path = Self { translation, q0, perpendicular, angle, stretch, stretch_inverse, still: None };
        if angle == 0.0 && same {
            let (m, inverse) = path.linear_at(0.0)?;
            path.still = Some(Box::new(Still { affine: affine(&m, [0.0; 3], &inverse, [0.0; 3]), inverse }));
        }
        Some(path)
    }

    fn stretch_at(&self, t: f64) -> Matrix3 {
        let [a, b] = &self.stretch;
        std::array::from_fn(|i| std::array::from_fn(|j| (1.0 - t) * a[i][j] + t * b[i][j]))
    }

    fn rotation_at(&self, t: f64) -> Matrix3 {
        let (s, c) = sin_cos_core(self.angle * t);
        rotation(std::array::from_fn(|i| self.q0[i] * c + self.perpendicular[i] * s))
    }

    /// The linear part at fraction `t` of the way, and its inverse; `None` where two mirrored stretches pass through a
    /// singular one.
    fn linear_at(&self, t: f64) -> Option<(Matrix3, Matrix3)> {
        let r = self.rotation_at(t);
        let (s, s_inverse) = match self.stretch_inverse {
            Some(inverse) => (self.stretch[0], inverse),
            None => {
                let s = self.stretch_at(t);
                (s, invert_3x3(s)?)
            }
        };
        Some((multiply(&r, &s), multiply(&s_inverse, &transpose(&r))))
    }

    #[inline]
    fn translation_at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|i| (1.0 - t) * self.translation[0][i] + t * self.translation[1][i])
    }

    fn turning_at(&self, t: f64) -> Option<Affine> {
        let (m, inverse) = self.linear_at(t)?;
        let d = self.translation_at(t);
        Some(affine(&m, d, &inverse, map(&inverse, d)))
    }

    /// At fraction `t` of the way; `None` as for [`Path::linear_at`]. Inlined: who needs one direction pays for one.
    #[inline]
    fn at(&self, t: f64) -> Option<Affine> {
        let Some(still) = &self.still else { return self.turning_at(t) };
        let d = self.translation_at(t);
        let back = map(&still.inverse, d);
        let mut affine = still.affine;
        for i in 0..3 {
            affine.m[i][3] = d[i] as f32;
            affine.inv[i][3] = -back[i] as f32;
        }
        Some(affine)
    }
}

/// In single precision: `x` to `m x + d`, and back by the inverse of `m`, `back` being the inverse of `d`.
fn affine(m: &Matrix3, d: [f64; 3], inverse: &Matrix3, back: [f64; 3]) -> Affine {
    let rows = |m: &Matrix3, d: [f64; 3]| -> [[f32; 4]; 3] {
        std::array::from_fn(|i| [m[i][0] as f32, m[i][1] as f32, m[i][2] as f32, d[i] as f32])
    };
    Affine { m: rows(m, d), inv: rows(inverse, back.map(|x| -x)) }
}

impl AnimatedTransform {
    /// From two keys and their times. `None` when a key is projective or singular, or times are not finite. When `t1 <= t0`
    /// or the keys are equal, it rests at `start`.
    pub fn new(start: Transform, end: Transform, t0: f32, t1: f32) -> Option<Self> {
        let (at_start, at_end) = (Affine::from_transform(&start)?, Affine::from_transform(&end)?);
        if !(t0.is_finite() && t1.is_finite()) {
            return None;
        }
        let moves = start.m != end.m && t0 < t1;
        let path = if moves { Some(Path::new(&start, &end)?) } else { None };
        Some(Self { start, end, t0, t1, at_start, at_end, path })
    }

    /// One that rests. `None` for a projective or singular transform.
    pub fn fixed(t: Transform) -> Option<Self> {
        Self::new(t, t, 0.0, 1.0)
    }

    /// True when it ever moves.
    #[inline]
    pub fn is_animated(&self) -> bool {
        self.path.is_some()
    }

    /// True when it turns while it moves, so that points travel along arcs.
    pub fn has_rotation(&self) -> bool {
        self.path.as_ref().is_some_and(|p| p.angle > 0.0)
    }

    /// The first key, exact.
    pub fn start(&self) -> &Transform {
        &self.start
    }

    /// The last key, exact.
    pub fn end(&self) -> &Transform {
        &self.end
    }

    /// The times of the keys.
    pub fn times(&self) -> (f32, f32) {
        (self.t0, self.t1)
    }

    /// The transform at a time; the keys, exactly, at and outside of theirs. About 60 ns when it turns, 10 when it only
    /// travels.
    #[inline]
    pub fn at(&self, time: f32) -> Affine {
        match &self.path {
            Some(path) if self.t0 < time => {
                if time >= self.t1 {
                    return self.at_end;
                }
                let t = (time as f64 - self.t0 as f64) / (self.t1 as f64 - self.t0 as f64);
                path.at(t).unwrap_or(self.at_start)
            }
            _ => self.at_start,
        }
    }

    /// A box that contains a box at every time.
    ///
    /// Corners are followed in n steps and the polygon is padded by a proven bound on how far the arc leaves its chords:
    /// |p''| / (8 n^2) <= (a^2 |Sc| + 2 a |S'c|) / (8 n^2), with a the whole angle turned, S the stretch and c the corner
    /// (translations add nothing), plus 2e-6 of the largest coordinate for rounding. Without rotation paths are straight.
    pub fn motion_bounds(&self, b: &Bounds3) -> Bounds3 {
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        let Some(path) = &self.path else { return self.at_start.bounds(b) };
        let turned = 2.0 * path.angle;
        let steps = if turned > 0.0 { (turned * 48.0).ceil().clamp(8.0, 160.0) as usize } else { 1 };
        let change: Matrix3 =
            std::array::from_fn(|i| std::array::from_fn(|j| path.stretch[1][i][j] - path.stretch[0][i][j]));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for i in 0..8 {
            let corner = b.corner(i).to_array().map(|x| x as f64);
            let reach = length(map(&path.stretch[0], corner)).max(length(map(&path.stretch[1], corner)));
            let rate = length(map(&change, corner));
            let arc = (turned * turned * reach + 2.0 * turned * rate) / (8.0 * (steps * steps) as f64);
            for step in 0..=steps {
                let t = step as f64 / steps as f64;
                let p = map(&path.rotation_at(t), map(&path.stretch_at(t), corner));
                for k in 0..3 {
                    let d = (1.0 - t) * path.translation[0][k] + t * path.translation[1][k];
                    let pad = arc + 2e-6 * (d.abs() + reach);
                    low[k] = low[k].min(p[k] + d - pad);
                    high[k] = high[k].max(p[k] + d + pad);
                }
            }
        }
        let at = |v: [f64; 3]| Point3::new(v[0] as f32, v[1] as f32, v[2] as f32);
        let ulp = Vec3::new(f32::EPSILON, f32::EPSILON, f32::EPSILON);
        let (low, high) = (at(low), at(high));
        Bounds3 { min: low - ulp * low.abs().max_component(), max: high + ulp * high.abs().max_component() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::Pcg32;

    fn rotate(degrees: f64) -> Transform {
        Transform::rotate(degrees, [0.2, 1.0, -0.4]).unwrap()
    }

    #[test]
    fn keys_are_met_exactly_and_rest_outside() {
        let (a, b) = (Transform::translate(1.0, 2.0, 3.0), Transform::translate(5.0, 2.0, 3.0).compose(&rotate(80.0)));
        let m = AnimatedTransform::new(a, b, 0.5, 1.5).unwrap();
        assert!(m.is_animated() && m.has_rotation());
        for t in [-1.0, 0.0, 0.5] {
            assert_eq!(m.at(t), Affine::from_transform(&a).unwrap());
        }
        for t in [1.5, 2.0] {
            assert_eq!(m.at(t), Affine::from_transform(&b).unwrap());
        }
        let fixed = AnimatedTransform::fixed(b).unwrap();
        assert!(!fixed.is_animated() && fixed.at(0.3) == m.at(9.0));
        assert!(AnimatedTransform::new(a, b, f32::NAN, 1.0).is_none());
    }

    #[test]
    fn rotations_turn_at_constant_speed_and_carry_their_stretch() {
        let s = Transform::scale(2.0, -0.5, 3.0).unwrap();
        let m = AnimatedTransform::new(
            Transform::translate(1.0, 0.0, 0.0).compose(&rotate(10.0)).compose(&s),
            Transform::translate(3.0, 0.0, 0.0).compose(&rotate(130.0)).compose(&s),
            0.0,
            1.0,
        )
        .unwrap();
        for i in 0..=20 {
            let t = i as f64 / 20.0;
            let expected = Transform::translate(1.0 + 2.0 * t, 0.0, 0.0).compose(&rotate(10.0 + 120.0 * t)).compose(&s);
            let expected = Affine::from_transform(&expected).unwrap();
            let got = m.at(t as f32);
            for i in 0..3 {
                for j in 0..4 {
                    assert!((got.m[i][j] - expected.m[i][j]).abs() < 1e-5, "{t} {got:?} {expected:?}");
                    assert!((got.inv[i][j] - expected.inv[i][j]).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn changing_stretches_and_half_turns_work() {
        let half = AnimatedTransform::new(Transform::IDENTITY, rotate(179.0), 0.0, 1.0).unwrap();
        let p = Point3::new(1.0, 0.0, 0.0);
        assert!((half.at(0.5).point(p) - rotate(89.5).point(p)).length() < 1e-5);
        let grow =
            AnimatedTransform::new(Transform::IDENTITY, Transform::scale(3.0, 1.0, 1.0).unwrap(), 0.0, 1.0).unwrap();
        assert!(!grow.has_rotation());
        assert!((grow.at(0.5).point(p).x - 2.0).abs() < 1e-6);
        assert!((grow.at(0.5).inverse_point(Point3::new(2.0, 0.0, 0.0)).x - 1.0).abs() < 1e-6);
        let tiny = AnimatedTransform::new(Transform::IDENTITY, rotate(1e-4), 0.0, 1.0).unwrap();
        let far = Point3::new(1e4, 0.0, 0.0);
        assert!((tiny.at(0.5).point(far) - rotate(0.5e-4).point(far)).length() < 2e-3);
    }

    #[test]
    fn motion_bounds_contain_the_box_at_all_times_and_are_tight() {
        let mut rng = Pcg32::new(1, 9);
        for case in 0..200 {
            let mut key = |far: f64| {
                let r = |rng: &mut Pcg32| rng.next_f64() * 2.0 - 1.0;
                let axis = [r(&mut rng), r(&mut rng), r(&mut rng) + 1e-3];
                Transform::translate(far * r(&mut rng), far * r(&mut rng), 0.0)
                    .compose(&Transform::rotate(180.0 * r(&mut rng), axis).unwrap())
                    .compose(&Transform::scale(0.2 + r(&mut rng).abs(), 0.5, 0.3 + r(&mut rng).abs()).unwrap())
            };
            let (a, b) = (key(1.0), key(if case % 2 == 0 { 0.1 } else { 1000.0 }));
            let m = AnimatedTransform::new(a, b, 0.0, 1.0).unwrap();
            let local = Bounds3::new(Point3::new(-1.0, 0.0, -0.5), Point3::new(2.0, 1.0, 0.5));
            let bounds = m.motion_bounds(&local);
            let mut seen = Bounds3::EMPTY;
            for i in 0..=500 {
                let affine = m.at(i as f32 / 500.0);
                for k in 0..8 {
                    let p = affine.point(local.corner(k));
                    assert!(bounds.contains(p), "{case} {i} {p:?} {bounds:?}");
                    seen = seen.including(p);
                }
            }
            let (big, small) = (bounds.diagonal().max_component(), seen.diagonal().max_component());
            assert!(big < small * 1.01 + 1e-4 * seen.max.abs().max_component().max(1.0), "{case} {big} {small}");
        }
    }
}
