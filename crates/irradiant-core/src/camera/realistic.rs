//! Rays through a real lens onto a film of a given size.

use super::exit_pupil::ExitPupil;
use super::lens::{Lens, LensRay, dot, normalize};
use super::{ModelRay, Offsets};
use irradiant_math::{Affine, Point2, Point3, Vec3};

/// The step, in pixels, of the finite differences that give the neighbours.
const STEP: f64 = 0.05;

/// A film behind a lens. Distances in metres, which are the scene's units.
///
/// The weight of a ray is cos^4(theta) A / z^2, with A the area that was sampled on the exit pupil's plane at distance z:
/// its mean times radiance is the irradiance on the film (Kolb, Mitchell and Hanrahan 1995, equation 2).
#[derive(Clone, Debug)]
pub(super) struct Realistic {
    lens: Lens,
    pupil: ExitPupil,
    rear_z: f64,
    /// Of a pixel; the picture on the film is upside down.
    pixel: [f64; 2],
    /// Film position of the image's top left corner.
    corner: [f64; 2],
    space_from_camera: Affine,
}

fn f32s(v: [f64; 3]) -> Vec3 {
    Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

impl Realistic {
    /// `diagonal` of the film, metres.
    pub fn new(lens: Lens, diagonal: f64, resolution: [u32; 2], space_from_camera: Affine) -> Self {
        let [width, height] = resolution.map(|n| n as f64);
        let pixel = diagonal / (width * width + height * height).sqrt();
        Self {
            pupil: ExitPupil::new(&lens, 0.5 * diagonal),
            rear_z: lens.rear_z(),
            lens,
            pixel: [-pixel, pixel],
            corner: [0.5 * pixel * width, -0.5 * pixel * height],
            space_from_camera,
        }
    }

    fn film_point(&self, x: f64, y: f64) -> [f64; 3] {
        [self.corner[0] + self.pixel[0] * x, self.corner[1] + self.pixel[1] * y, 0.0]
    }

    pub fn ray(&self, film: Point2, lens: Point2) -> Option<ModelRay> {
        let (x, y) = (film.x as f64, film.y as f64);
        let start = self.film_point(x, y);
        let r = (start[0] * start[0] + start[1] * start[1]).sqrt();
        let [x0, x1, y0, y1] = self.pupil.bounds(r)?;
        // The box is for a film point on the +x axis: turn it.
        let across = [x0 + (x1 - x0) * lens.x as f64, y0 + (y1 - y0) * lens.y as f64];
        let (cos, sin) = if r > 0.0 { (start[0] / r, start[1] / r) } else { (1.0, 0.0) };
        let pupil = [cos * across[0] - sin * across[1], sin * across[0] + cos * across[1], self.rear_z];
        let through = |film: [f64; 3]| {
            let (ray, weight) = self.lens.from_film(LensRay { o: film, d: difference(pupil, film) })?;
            Some((LensRay { o: ray.o, d: normalize(ray.d) }, weight))
        };
        let (ray, passed) = through(start)?;

        // Neighbours pass the same point of the pupil; pbrt-v4 draws it anew, and jumps where rings of the film meet.
        let neighbour = |dx: f64, dy: f64| {
            [STEP, -STEP].into_iter().find_map(|step| {
                let (near, _) = through(self.film_point(x + dx * step, y + dy * step))?;
                let change = |a, b| self.space_from_camera.vector(f32s(difference(a, b).map(|c| c / step)));
                Some((change(near.o, ray.o), change(near.d, ray.d)))
            })
        };
        let offsets =
            neighbour(1.0, 0.0).zip(neighbour(0.0, 1.0)).map(|((origin_x, direction_x), (origin_y, direction_y))| {
                Offsets { origin_x, direction_x, origin_y, direction_y }
            });
        let inside = difference(pupil, start);
        let cos2 = self.rear_z * self.rear_z / dot(inside, inside);
        let area = (x1 - x0) * (y1 - y0);
        Some(ModelRay {
            o: self.space_from_camera.point(Point3::from(f32s(ray.o).to_array())),
            d: self.space_from_camera.vector(f32s(ray.d)),
            weight: (passed * cos2 * cos2 * area / (self.rear_z * self.rear_z)) as f32,
            offsets,
        })
    }
}
