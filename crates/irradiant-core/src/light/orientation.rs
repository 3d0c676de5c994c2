//! Directions between render space and a light's own space.

use irradiant_math::{Transform, Vec3};

/// The linear part of `render_from_light`, both ways, for directions.
#[derive(Clone, Copy, Debug)]
pub struct Orientation {
    render_from_light: [Vec3; 3],
    light_from_render: [Vec3; 3],
    /// |determinant| of `render_from_light`.
    determinant: f32,
    /// True when it keeps angles, so that solid angles are alike in both spaces.
    keeps_angles: bool,
}

fn rows(m: &[[f64; 4]; 4]) -> [Vec3; 3] {
    std::array::from_fn(|i| Vec3::new(m[i][0] as f32, m[i][1] as f32, m[i][2] as f32))
}

#[inline(always)]
fn apply(m: &[Vec3; 3], v: Vec3) -> Vec3 {
    Vec3::new(m[0].dot(v), m[1].dot(v), m[2].dot(v))
}

impl Orientation {
    /// From an affine transform.
    pub fn new(render_from_light: &Transform) -> Self {
        let m = &render_from_light.m;
        let column = |j: usize| [m[0][j], m[1][j], m[2][j]];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (a, b, c) = (column(0), column(1), column(2));
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        let size = dot(a, a);
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-5 * size;
        let keeps_angles = near(dot(b, b), size)
            && near(dot(c, c), size)
            && near(dot(a, b), 0.0)
            && near(dot(b, c), 0.0)
            && near(dot(c, a), 0.0);
        Self {
            render_from_light: rows(m),
            light_from_render: rows(&render_from_light.inv),
            determinant: determinant.abs() as f32,
            keeps_angles,
        }
    }

    /// A render-space direction in light space, unit.
    #[inline(always)]
    pub fn to_light(&self, w: Vec3) -> Vec3 {
        apply(&self.light_from_render, w).normalize()
    }

    /// A light-space direction in render space, unit.
    #[inline(always)]
    pub fn to_render(&self, w: Vec3) -> Vec3 {
        apply(&self.render_from_light, w).normalize()
    }

    /// Solid angle in render space for a unit of it in light space, around the unit light-space direction `w`.
    ///
    /// 1 for rotations, mirrors and uniform scales; |det M| / |M w|^3 for the rest (pbrt-v4 takes 1 always).
    #[inline(always)]
    pub fn stretch(&self, w: Vec3) -> f32 {
        if self.keeps_angles {
            return 1.0;
        }
        let length_squared = apply(&self.render_from_light, w).length_squared();
        self.determinant / (length_squared * length_squared.sqrt())
    }
}
