//! Where a quadric stands: an affine map and its inverse in `f64`, and how a hit in shape space becomes one in render
//! space.
//!
//! Quadrics are met and sampled in their own space in double precision. The ray that arrives is `f32` and taken as
//! exact, so the only errors of a hit point are the rounding of its three coordinates at the very end and that of the
//! map itself; the bounds below cover both. Nothing here is fused, so bits do not depend on the CPU.

use irradiant_math::{Bounds3, Normal3, Point2, Point3, Ray, Transform, Vec3};

/// Three doubles: a point, vector or normal of shape space.
pub(crate) type Double3 = [f64; 3];

#[inline(always)]
pub(crate) fn dot(a: Double3, b: Double3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross(a: Double3, b: Double3) -> Double3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn sub(a: Double3, b: Double3) -> Double3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn add(a: Double3, b: Double3) -> Double3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn scale(a: Double3, s: f64) -> Double3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline]
pub(crate) fn lerp3(a: Double3, b: Double3, t: f64) -> Double3 {
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])]
}

#[inline(always)]
pub(crate) fn length(a: Double3) -> f64 {
    dot(a, a).sqrt()
}

/// What `f` says for each axis. Written out: `[0, 1, 2].map(f)` was called rather than inlined where much goes on around
/// it, and took three times as many instructions.
#[inline(always)]
pub(crate) fn axes<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

#[inline(always)]
pub(crate) fn double(p: [f32; 3]) -> Double3 {
    [p[0].into(), p[1].into(), p[2].into()]
}

#[inline(always)]
pub(crate) fn single(p: Double3) -> [f32; 3] {
    [p[0] as f32, p[1] as f32, p[2] as f32]
}

/// Relative bound of one rounding to `f32`, with room for a second.
const ROUNDING: f64 = 1.0 / (1u64 << 23) as f64;
/// Relative bound of the sum of four products in `f64`, generously.
const MAP_ROUNDING: f64 = 1e-14;

/// A surface point in shape space with its parametrisation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parametric {
    pub p: Double3,
    /// Unit, along dpdu x dpdv.
    pub n: Double3,
    pub uv: Point2,
    pub dpdu: Double3,
    pub dpdv: Double3,
    pub dndu: Double3,
    pub dndv: Double3,
}

/// The same in render space (or the object's, inside objects).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub p: Point3,
    pub p_error: Vec3,
    pub n: Normal3,
    pub uv: Point2,
    pub dpdu: Vec3,
    pub dpdv: Vec3,
    pub dndu: Normal3,
    pub dndv: Normal3,
}

/// An affine map from shape space and its inverse.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    m: [[f64; 4]; 3],
    inv: [[f64; 4]; 3],
    /// Normals point against dpdu x dpdv of shape space: `ReverseOrientation` xor a mirroring map, as pbrt.
    pub flip: bool,
    /// |det| of the linear part.
    pub determinant: f64,
}

impl Placement {
    /// `None` for a map with perspective or one that is singular or not finite.
    pub fn new(t: &Transform, reverse_orientation: bool) -> Option<Self> {
        let affine = |m: &[[f64; 4]; 4]| m[3] == [0.0, 0.0, 0.0, 1.0] && m.iter().flatten().all(|x| x.is_finite());
        if !(affine(&t.m) && affine(&t.inv)) {
            return None;
        }
        let rows = |m: &[[f64; 4]; 4]| [m[0], m[1], m[2]];
        let m = rows(&t.m);
        let row = |i: usize| [m[i][0], m[i][1], m[i][2]];
        let determinant = dot(row(0), cross(row(1), row(2))).abs();
        (determinant > 0.0).then(|| Self {
            m,
            inv: rows(&t.inv),
            flip: reverse_orientation != t.swaps_handedness(),
            determinant,
        })
    }

    /// The ray's origin and direction in shape space; parameters stay the same.
    #[inline(always)]
    pub fn ray_to_shape(&self, ray: &Ray) -> (Double3, Double3) {
        let o = double(ray.o.to_array());
        let d = double(ray.d.to_array());
        (self.point_to_shape(o), axes(|i| self.inv[i][0] * d[0] + self.inv[i][1] * d[1] + self.inv[i][2] * d[2]))
    }

    #[inline(always)]
    pub fn point_to_shape(&self, p: Double3) -> Double3 {
        axes(|i| self.inv[i][0] * p[0] + self.inv[i][1] * p[1] + self.inv[i][2] * p[2] + self.inv[i][3])
    }

    #[inline]
    pub fn point64(&self, p: Double3) -> Double3 {
        axes(|i| self.m[i][0] * p[0] + self.m[i][1] * p[1] + self.m[i][2] * p[2] + self.m[i][3])
    }

    /// A point of the surface and the bound of its error.
    #[inline]
    pub fn point(&self, p: Double3) -> (Point3, Vec3) {
        let q = self.point64(p);
        let error = axes(|i| {
            let m = &self.m[i];
            let terms = (m[0] * p[0]).abs() + (m[1] * p[1]).abs() + (m[2] * p[2]).abs() + m[3].abs();
            (q[i].abs() * ROUNDING + terms * MAP_ROUNDING) as f32
        });
        (single(q).into(), error.into())
    }

    #[inline]
    pub fn vector(&self, v: Double3) -> Vec3 {
        axes(|i| (self.m[i][0] * v[0] + self.m[i][1] * v[1] + self.m[i][2] * v[2]) as f32).into()
    }

    /// The inverse transpose applied to `n`, not normalised.
    #[inline]
    pub fn normal(&self, n: Double3) -> Double3 {
        axes(|i| self.inv[0][i] * n[0] + self.inv[1][i] * n[1] + self.inv[2][i] * n[2])
    }

    /// The transpose applied to `n`: a normal of shape space from one of render space, not normalised.
    #[inline]
    pub fn normal_to_shape(&self, n: Double3) -> Double3 {
        axes(|i| self.m[0][i] * n[0] + self.m[1][i] * n[1] + self.m[2][i] * n[2])
    }

    /// The unit normal of render space at shape-space unit normal `n`, and by how much area is stretched there.
    #[inline]
    pub fn unit_normal(&self, n: Double3) -> (Normal3, f64) {
        let t = self.normal(n);
        let l = length(t);
        let s = if self.flip { -1.0 / l } else { 1.0 / l };
        (single(scale(t, s)).into(), self.determinant * l)
    }

    /// The factor of a map that scales all directions alike (to one part in 10^5), else `None`.
    pub fn uniform_scale(&self) -> Option<f64> {
        let column = |j: usize| [self.m[0][j], self.m[1][j], self.m[2][j]];
        let (x, y, z) = (column(0), column(1), column(2));
        let s = length(x);
        let tolerance = 1e-5 * s * s;
        let alike = [dot(y, y), dot(z, z)].iter().all(|l| (l - s * s).abs() <= tolerance)
            && [dot(x, y), dot(y, z), dot(z, x)].iter().all(|c| c.abs() <= tolerance);
        alike.then_some(s)
    }

    /// A hit with its parametrisation.
    #[inline(always)]
    pub fn place(&self, at: &Parametric) -> Placed {
        let (p, p_error) = self.point(at.p);
        let n = self.normal(at.n);
        let inverse_length = 1.0 / length(n);
        let signed = if self.flip { -inverse_length } else { inverse_length };
        Placed {
            p,
            p_error,
            n: single(scale(n, signed)).into(),
            uv: at.uv,
            dpdu: self.vector(at.dpdu),
            dpdv: self.vector(at.dpdv),
            // The derivative of the normalised normal, up to its part along the normal itself.
            dndu: single(scale(self.normal(at.dndu), inverse_length)).into(),
            dndv: single(scale(self.normal(at.dndv), inverse_length)).into(),
        }
    }

    /// The box of a disc of `radius` around z at height `z`: tight, rounded outwards.
    pub fn disc_bounds(&self, radius: f64, z: f64) -> Bounds3 {
        let c = self.point64([0.0, 0.0, z]);
        let e = axes(|i| radius * (self.m[i][0] * self.m[i][0] + self.m[i][1] * self.m[i][1]).sqrt());
        outward(sub(c, e), add(c, e))
    }

    /// The box of a ball of `radius` around the origin: tight, rounded outwards.
    pub fn ball_bounds(&self, radius: f64) -> Bounds3 {
        let c = self.point64([0.0; 3]);
        let e = axes(|i| {
            let m = &self.m[i];
            radius * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]).sqrt()
        });
        outward(sub(c, e), add(c, e))
    }

    /// The box of a box of shape space, rounded outwards.
    pub fn box_bounds(&self, min: Double3, max: Double3) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        for corner in 0..8 {
            let pick = |i: usize| if corner >> i & 1 == 0 { min[i] } else { max[i] };
            let p = self.point64([pick(0), pick(1), pick(2)]);
            bounds = bounds.union(outward(p, p));
        }
        bounds
    }
}

/// The smallest `f32` box around a double one, a step wider for what computing it rounded.
pub(crate) fn outward(min: Double3, max: Double3) -> Bounds3 {
    let down = |x: f64| ((x - x.abs() * MAP_ROUNDING) as f32).next_down();
    let up = |x: f64| ((x + x.abs() * MAP_ROUNDING) as f32).next_up();
    Bounds3 { min: min.map(down).into(), max: max.map(up).into() }
}
