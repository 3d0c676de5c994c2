//! Cameras that see all around themselves.

use super::{ModelRay, Offsets};
use irradiant_math::elementary::sin_cos;
use irradiant_math::warp::{equal_area_square_to_sphere, spherical_direction, wrap_equal_area_square};
use irradiant_math::{Affine, Point2, Vec3};
use std::f32::consts::PI;

/// The step, in pixels, of the finite differences that give the neighbours.
const STEP: f32 = 0.05;

/// The whole sphere of directions on one image; up is +y.
///
/// Latitude-longitude: the top row looks up, the left edge and the right edge along +x, the middle along -x. Equal-area: the
/// octahedral map of Clarberg 2008, in which every pixel has the same solid angle; the centre looks up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spherical {
    pub equirectangular: bool,
    /// One over the image size.
    pub scale: [f32; 2],
    pub space_from_camera: Affine,
}

impl Spherical {
    #[inline]
    pub fn ray(&self, film: Point2) -> ModelRay {
        let d = self.direction(film);
        let change = |x: f32, y: f32| (self.direction(Point2::new(film.x + x, film.y + y)) - d) / STEP;
        let offsets = Offsets { direction_x: change(STEP, 0.0), direction_y: change(0.0, STEP), ..Offsets::ZERO };
        let m = &self.space_from_camera.m;
        ModelRay { o: [m[0][3], m[1][3], m[2][3]].into(), d, weight: 1.0, offsets: Some(offsets) }
    }

    #[inline]
    fn direction(&self, film: Point2) -> Vec3 {
        let uv = Point2::new(film.x * self.scale[0], film.y * self.scale[1]);
        let d = if self.equirectangular {
            let (sin, cos) = sin_cos(PI * uv.y);
            spherical_direction(sin, cos, 2.0 * PI * uv.x)
        } else {
            equal_area_square_to_sphere(wrap_equal_area_square(uv))
        };
        self.space_from_camera.vector(Vec3::new(d.x, d.z, d.y))
    }
}
