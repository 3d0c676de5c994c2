//! Orthonormal frames.

use crate::vector::{Normal3, Vec3};

/// A right-handed orthonormal basis: `x` and `y` span the tangent plane, `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// Normal direction.
    pub z: Vec3,
}

impl Frame {
    /// Some frame around the unit vector `z`.
    #[inline(always)]
    pub fn from_z(z: Vec3) -> Self {
        // Duff et al. 2017, JCGT 6(1): branchless basis. copysign, so that z.z = -0 is treated like z.z < 0.
        let sign = 1f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The frame with normal `z` (unit) and first tangent as near as possible to `x` (need be neither unit nor
    /// orthogonal). Falls back to [`Frame::from_z`] when `x` is parallel to `z` or not finite.
    #[inline(always)]
    pub fn from_z_near_x(z: Vec3, x: Vec3) -> Self {
        let tangent = x - z * z.dot(x);
        let length_squared = tangent.length_squared();
        if !(length_squared > 0.0 && length_squared.is_finite()) {
            return Self::from_z(z);
        }
        let x = tangent / length_squared.sqrt();
        Self { x, y: z.cross(x), z }
    }

    /// Components of `v` in this frame.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// The vector whose components in this frame are `v`.
    #[inline(always)]
    pub fn from_local(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The normal direction as a normal.
    #[inline]
    pub fn normal(&self) -> Normal3 {
        self.z.as_normal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed_everywhere() {
        for v in [
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            Vec3::new(0.0, 0.0, -0.0) + Vec3::Y,
            Vec3::new(1e-8, -1e-8, -1.0).normalize(),
            Vec3::new(0.3, -0.5, 0.8).normalize(),
        ] {
            for f in [Frame::from_z(v), Frame::from_z_near_x(v, Vec3::new(0.9, 0.1, -0.2)), Frame::from_z_near_x(v, v)]
            {
                for (a, b) in [(f.x, f.y), (f.y, f.z), (f.z, f.x)] {
                    assert!(a.dot(b).abs() < 1e-6);
                    assert!((a.length() - 1.0).abs() < 1e-6);
                }
                assert!((f.x.cross(f.y) - f.z).length() < 1e-6);
                let w = Vec3::new(0.1, 0.7, -0.4);
                assert!((f.from_local(f.to_local(w)) - w).length() < 1e-6);
            }
        }
    }
}
