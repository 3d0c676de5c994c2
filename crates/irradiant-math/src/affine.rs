//! Affine transforms in `f32`: the fast form that rays meet at run time.

use crate::bounds::Bounds3;
use crate::interval::gamma;
use crate::ray::Ray;
use crate::transform::Transform;
use crate::vector::{Normal3, Point3, Vec3};

/// A 3x4 matrix and that of its inverse, row-major, in `f32`; 96 bytes.
///
/// Rounded once from a [`Transform`], where composing and inverting happen in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Rows of the matrix; the fourth column moves.
    pub m: [[f32; 4]; 3],
    /// Rows of its inverse.
    pub inv: [[f32; 4]; 3],
}

impl Default for Affine {
    fn default() -> Self {
        Self::IDENTITY
    }
}

#[inline(always)]
fn point(m: &[[f32; 4]; 3], p: Point3) -> Point3 {
    let row = |r: &[f32; 4]| (r[0] * p.x + r[1] * p.y) + (r[2] * p.z + r[3]);
    Point3::new(row(&m[0]), row(&m[1]), row(&m[2]))
}

#[inline(always)]
fn vector(m: &[[f32; 4]; 3], v: Vec3) -> Vec3 {
    let row = |r: &[f32; 4]| r[0] * v.x + r[1] * v.y + r[2] * v.z;
    Vec3::new(row(&m[0]), row(&m[1]), row(&m[2]))
}

#[inline(always)]
fn transposed(m: &[[f32; 4]; 3], n: Normal3) -> Normal3 {
    let column = |i: usize| m[0][i] * n.x + m[1][i] * n.y + m[2][i] * n.z;
    Normal3::new(column(0), column(1), column(2))
}

#[inline(always)]
fn point_with_error(m: &[[f32; 4]; 3], p: Point3, error: Vec3) -> (Point3, Vec3) {
    // Three roundings on each term; an error of the input is carried over and rounded as well.
    let bound = |r: &[f32; 4]| {
        let size = (r[0] * p.x).abs() + (r[1] * p.y).abs() + (r[2] * p.z).abs() + r[3].abs();
        let carried = r[0].abs() * error.x + r[1].abs() * error.y + r[2].abs() * error.z;
        gamma(3) * size + (1.0 + gamma(3)) * carried
    };
    (point(m, p), Vec3::new(bound(&m[0]), bound(&m[1]), bound(&m[2])))
}

impl Affine {
    /// Changes nothing.
    pub const IDENTITY: Self = {
        let m = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        Self { m, inv: m }
    };

    /// Rounds a transform; `None` when it is projective (its last row is not 0, 0, 0, 1) or does not fit in `f32`.
    pub fn from_transform(t: &Transform) -> Option<Self> {
        const LAST: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
        // The inverse's last row is computed, hence only nearly exact.
        let affine = t.m[3] == LAST && t.inv[3].iter().zip(LAST).all(|(a, b)| (a - b).abs() < 1e-9);
        let rows = |m: &[[f64; 4]; 4]| std::array::from_fn(|i| m[i].map(|x| x as f32));
        let affine = affine.then(|| Self { m: rows(&t.m), inv: rows(&t.inv) })?;
        affine.m.iter().chain(&affine.inv).flatten().all(|x| x.is_finite()).then_some(affine)
    }

    /// Undoes this transform.
    #[inline]
    pub const fn inverse(&self) -> Self {
        Self { m: self.inv, inv: self.m }
    }

    /// True for exactly the identity.
    pub fn is_identity(&self) -> bool {
        self.m == Self::IDENTITY.m
    }

    /// True when it mirrors, i.e. changes a right-handed frame to a left-handed one.
    pub fn swaps_handedness(&self) -> bool {
        let row = |i: usize| Vec3::new(self.m[i][0], self.m[i][1], self.m[i][2]);
        row(0).dot(row(1).cross(row(2))) < 0.0
    }

    /// A point.
    #[inline]
    pub fn point(&self, p: Point3) -> Point3 {
        point(&self.m, p)
    }

    /// A vector: not moved.
    #[inline]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        vector(&self.m, v)
    }

    /// A normal, by the inverse transpose; not renormalised.
    #[inline]
    pub fn normal(&self, n: Normal3) -> Normal3 {
        transposed(&self.inv, n)
    }

    /// A point known to within the absolute `error`, and a bound on the error of the result: that of the input carried
    /// over, and that of rounding here.
    #[inline]
    pub fn point_with_error(&self, p: Point3, error: Vec3) -> (Point3, Vec3) {
        point_with_error(&self.m, p, error)
    }

    /// A point through the inverse.
    #[inline]
    pub fn inverse_point(&self, p: Point3) -> Point3 {
        point(&self.inv, p)
    }

    /// A vector through the inverse.
    #[inline]
    pub fn inverse_vector(&self, v: Vec3) -> Vec3 {
        vector(&self.inv, v)
    }

    /// A normal through the inverse; not renormalised.
    #[inline]
    pub fn inverse_normal(&self, n: Normal3) -> Normal3 {
        transposed(&self.m, n)
    }

    /// As [`Affine::point_with_error`], through the inverse.
    #[inline]
    pub fn inverse_point_with_error(&self, p: Point3, error: Vec3) -> (Point3, Vec3) {
        point_with_error(&self.inv, p, error)
    }

    /// A ray: its direction is not renormalised, so parameters along it mean the same points.
    #[inline]
    pub fn ray(&self, r: &Ray) -> Ray {
        Ray::new(self.point(r.o), self.vector(r.d), r.time)
    }

    /// A ray through the inverse; its direction is not renormalised.
    #[inline]
    pub fn inverse_ray(&self, r: &Ray) -> Ray {
        Ray::new(self.inverse_point(r.o), self.inverse_vector(r.d), r.time)
    }

    /// A box around a transformed box, rounded outward; empty stays empty.
    pub fn bounds(&self, b: &Bounds3) -> Bounds3 {
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        (0..8).fold(Bounds3::EMPTY, |bounds, i| {
            let (p, error) = self.point_with_error(b.corner(i), Vec3::ZERO);
            bounds.including(p - error).including(p + error)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::Pcg32;

    fn some_transform() -> Transform {
        Transform::translate(100.0, -2.0, 3.0)
            .compose(&Transform::rotate(33.0, [1.0, 2.0, 0.5]).unwrap())
            .compose(&Transform::scale(2.0, -0.5, 3.0).unwrap())
    }

    #[test]
    fn errors_are_bounded_and_bounds_are_tight() {
        let a = Affine::from_transform(&some_transform()).unwrap();
        let mut rng = Pcg32::new(5, 5);
        let mut tightest = f64::INFINITY;
        for _ in 0..100_000 {
            let p = Point3::new(rng.next_f32() * 200.0 - 100.0, rng.next_f32() - 0.5, rng.next_f32() * 1e4);
            let (q, e) = a.point_with_error(p, Vec3::ZERO);
            for i in 0..3 {
                let exact = a.m[i][0] as f64 * p.x as f64
                    + a.m[i][1] as f64 * p.y as f64
                    + a.m[i][2] as f64 * p.z as f64
                    + a.m[i][3] as f64;
                let error = (q[i] as f64 - exact).abs();
                assert!(error <= e[i] as f64);
                tightest = tightest.min((e[i] as f64 - error) / e[i] as f64);
            }
        }
        // Within a factor of 3 of an error that happens.
        assert!(tightest < 0.67, "{tightest}");
        let (_, e) = a.point_with_error(Point3::ZERO, Vec3::new(1.0, 0.0, 0.0));
        assert!(e.x >= a.m[0][0].abs());
    }

    #[test]
    fn inverses_and_kinds_agree_with_the_exact_transform() {
        let t = some_transform();
        let a = Affine::from_transform(&t).unwrap();
        let (p, v, n) = (Point3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 0.5, 2.0), Normal3::new(0.0, 1.0, 2.0));
        assert!((a.point(p) - t.point(p)).length() < 1e-4);
        assert!((a.vector(v) - t.vector(v)).length() < 1e-5);
        assert!((a.normal(n) - t.normal(n)).length() < 1e-5);
        assert!((a.inverse_point(a.point(p)) - p).length() < 1e-4);
        assert!((a.inverse_normal(a.normal(n)) - n).length() < 1e-5);
        assert!((a.inverse_vector(a.vector(v)) - v).length() < 1e-5);
        assert!(a.swaps_handedness() && !Affine::IDENTITY.swaps_handedness() && Affine::IDENTITY.is_identity());
        assert_eq!(a.inverse().point(p), a.inverse_point(p));
        let b = a.bounds(&Bounds3::new(Point3::ZERO, p));
        assert!(b.contains(a.point(Point3::new(0.3, 1.9, 0.1))) && a.bounds(&Bounds3::EMPTY).is_empty());
        let mut projective = Transform::IDENTITY;
        projective.m[3] = [0.0, 0.0, 1.0, 0.0];
        assert!(Affine::from_transform(&projective).is_none());
    }
}
