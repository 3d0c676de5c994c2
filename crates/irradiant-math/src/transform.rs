//! Homogeneous transforms with their inverses, in `f64`: built and composed exactly enough that rounding to
//! `f32` happens once, when a scene is compiled.

use crate::bounds::Bounds3;
use crate::vector::{Normal3, Point3, Vec3};

/// A 4x4 matrix, row-major: `m[row][column]`, applied to column vectors.
pub type Matrix4 = [[f64; 4]; 4];

/// A 4x4 transform and its inverse. Named for what it does, as `render_from_object`; composition reads right to left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The matrix, row-major.
    pub m: Matrix4,
    /// Its inverse.
    pub inv: Matrix4,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

const IDENTITY4: Matrix4 = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn multiply(a: &Matrix4, b: &Matrix4) -> Matrix4 {
    let mut r = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            r[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j] + a[i][3] * b[3][j];
        }
    }
    r
}

fn transpose(a: &Matrix4) -> Matrix4 {
    let mut r = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            r[i][j] = a[j][i];
        }
    }
    r
}

/// The inverse by Gauss-Jordan elimination with partial pivoting; `None` when singular or not finite.
pub fn invert(a: &Matrix4) -> Option<Matrix4> {
    let mut m = *a;
    let mut r = IDENTITY4;
    if !m.iter().flatten().all(|x| x.is_finite()) {
        return None;
    }
    for column in 0..4 {
        let pivot = (column..4).max_by(|&i, &j| m[i][column].abs().total_cmp(&m[j][column].abs()))?;
        if m[pivot][column] == 0.0 {
            return None;
        }
        m.swap(column, pivot);
        r.swap(column, pivot);
        let scale = 1.0 / m[column][column];
        for j in 0..4 {
            m[column][j] *= scale;
            r[column][j] *= scale;
        }
        for i in 0..4 {
            let factor = m[i][column];
            if i == column || factor == 0.0 {
                continue;
            }
            for j in 0..4 {
                m[i][j] -= factor * m[column][j];
                r[i][j] -= factor * r[column][j];
            }
        }
    }
    r.iter().flatten().all(|x| x.is_finite()).then_some(r)
}

impl Transform {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { m: IDENTITY4, inv: IDENTITY4 };

    /// From a matrix; `None` when it cannot be inverted.
    pub fn from_matrix(m: Matrix4) -> Option<Self> {
        invert(&m).map(|inv| Self { m, inv })
    }

    /// Moves by `(x, y, z)`.
    pub fn translate(x: f64, y: f64, z: f64) -> Self {
        let mut t = Self::IDENTITY;
        for (i, d) in [x, y, z].into_iter().enumerate() {
            t.m[i][3] = d;
            t.inv[i][3] = -d;
        }
        t
    }

    /// Scales along the axes; `None` when a factor is zero or not finite.
    pub fn scale(x: f64, y: f64, z: f64) -> Option<Self> {
        let mut m = IDENTITY4;
        (m[0][0], m[1][1], m[2][2]) = (x, y, z);
        Self::from_matrix(m)
    }

    /// Turns by `degrees` about `axis` (need not be unit), counter-clockwise seen from its tip; `None` for a zero axis.
    pub fn rotate(degrees: f64, axis: [f64; 3]) -> Option<Self> {
        let length = (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]).sqrt();
        if !(length > 0.0 && length.is_finite() && degrees.is_finite()) {
            return None;
        }
        let a = axis.map(|c| c / length);
        // libm, not std: the same bits on every platform.
        let (s, c) = (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
        let mut m = IDENTITY4;
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] = a[i] * a[j] * (1.0 - c) + if i == j { c } else { 0.0 };
            }
        }
        m[0][1] -= a[2] * s;
        m[0][2] += a[1] * s;
        m[1][0] += a[2] * s;
        m[1][2] -= a[0] * s;
        m[2][0] -= a[1] * s;
        m[2][1] += a[0] * s;
        Some(Self { m, inv: transpose(&m) })
    }

    /// Camera-from-world for an eye at `eye` that looks at `look` (+z forward) with `up` roughly +y; left-handed as in
    /// pbrt. `None` when the viewing direction is zero or parallel to `up`.
    pub fn look_at(eye: [f64; 3], look: [f64; 3], up: [f64; 3]) -> Option<Self> {
        fn normalized(v: [f64; 3]) -> Option<[f64; 3]> {
            let l = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            (l > 0.0 && l.is_finite()).then(|| v.map(|c| c / l))
        }
        fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        }
        let dir = normalized([look[0] - eye[0], look[1] - eye[1], look[2] - eye[2]])?;
        let right = normalized(cross(normalized(up)?, dir)).filter(|r| r.iter().all(|c| c.is_finite()))?;
        let new_up = cross(dir, right);
        let mut world_from_camera = IDENTITY4;
        for i in 0..3 {
            world_from_camera[i] = [right[i], new_up[i], dir[i], eye[i]];
        }
        Self::from_matrix(world_from_camera).map(|t| t.inverse())
    }

    /// Undoes this transform.
    pub const fn inverse(&self) -> Self {
        Self { m: self.inv, inv: self.m }
    }

    /// `self` after `first`: `a.then_of(b)` maps p to a(b(p)).
    pub fn compose(&self, first: &Transform) -> Self {
        Self { m: multiply(&self.m, &first.m), inv: multiply(&first.inv, &self.inv) }
    }

    /// True for the identity.
    pub fn is_identity(&self) -> bool {
        self.m == IDENTITY4
    }

    /// True when it mirrors, i.e. changes a right-handed frame to a left-handed one.
    pub fn swaps_handedness(&self) -> bool {
        let m = &self.m;
        let det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        det < 0.0
    }

    /// A point, through the full homogeneous matrix (divided by w).
    pub fn point64(&self, p: [f64; 3]) -> [f64; 3] {
        let m = &self.m;
        let row = |i: usize| m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3];
        let w = row(3);
        if w == 1.0 { [row(0), row(1), row(2)] } else { [row(0) / w, row(1) / w, row(2) / w] }
    }

    /// A point; computed in `f64`, rounded once.
    pub fn point(&self, p: Point3) -> Point3 {
        let r = self.point64([p.x as f64, p.y as f64, p.z as f64]);
        Point3::new(r[0] as f32, r[1] as f32, r[2] as f32)
    }

    /// A vector (no translation); computed in `f64`, rounded once.
    pub fn vector(&self, v: Vec3) -> Vec3 {
        let m = &self.m;
        let row = |i: usize| (m[i][0] * v.x as f64 + m[i][1] * v.y as f64 + m[i][2] * v.z as f64) as f32;
        Vec3::new(row(0), row(1), row(2))
    }

    /// A normal, by the inverse transpose; not renormalised.
    pub fn normal(&self, n: Normal3) -> Normal3 {
        let m = &self.inv;
        let column = |i: usize| (m[0][i] * n.x as f64 + m[1][i] * n.y as f64 + m[2][i] * n.z as f64) as f32;
        Normal3::new(column(0), column(1), column(2))
    }

    /// The box around a transformed box (affine transforms); empty stays empty.
    pub fn bounds(&self, b: &Bounds3) -> Bounds3 {
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        Bounds3::from_points((0..8).map(|i| self.point(b.corner(i))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: &Matrix4, b: &Matrix4) -> bool {
        a.iter().flatten().zip(b.iter().flatten()).all(|(x, y)| (x - y).abs() < 1e-12)
    }

    #[test]
    fn every_transform_carries_its_inverse() {
        let t = Transform::translate(1.0, -2.0, 3.0)
            .compose(&Transform::rotate(33.0, [1.0, 2.0, 0.5]).unwrap())
            .compose(&Transform::scale(2.0, -0.5, 3.0).unwrap());
        assert!(close(&multiply(&t.m, &t.inv), &IDENTITY4));
        assert!(t.swaps_handedness());
        assert!(!t.compose(&t).swaps_handedness());
    }

    #[test]
    fn singular_transforms_are_refused() {
        assert!(Transform::scale(1.0, 0.0, 1.0).is_none());
        assert!(Transform::rotate(10.0, [0.0; 3]).is_none());
        assert!(Transform::look_at([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]).is_none());
        assert!(Transform::look_at([0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]).is_none());
        assert!(Transform::from_matrix([[f64::NAN; 4]; 4]).is_none());
    }

    #[test]
    fn look_at_puts_the_eye_at_the_origin_and_the_target_on_z() {
        let t = Transform::look_at([1.0, 2.0, 3.0], [4.0, 6.0, 3.0], [0.0, 0.0, 1.0]).unwrap();
        let p = t.point64([1.0, 2.0, 3.0]);
        assert!(p.iter().all(|c| c.abs() < 1e-12));
        let q = t.point64([4.0, 6.0, 3.0]);
        assert!(q[0].abs() < 1e-12 && q[1].abs() < 1e-12 && (q[2] - 5.0).abs() < 1e-12);
    }

    #[test]
    fn normals_stay_orthogonal_under_shear_like_scales() {
        let t = Transform::scale(1.0, 4.0, 1.0).unwrap();
        let (n, v) = (Normal3::new(1.0, 1.0, 0.0), Vec3::new(1.0, -1.0, 0.0));
        assert_eq!(t.normal(n).dot(t.vector(v)), 0.0);
    }
}
