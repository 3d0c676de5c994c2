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
            let (ray, weight) = self.lens.trace_to_scene(LensRay { o: film, d: difference(pupil, film) })?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::lens::ThickLens;
    use crate::camera::tests::{Setup, realistic};
    use crate::camera::{Camera, Model};
    use irradiant_image::Image;
    use irradiant_scene::assets::MemoryAssets;
    use irradiant_scene::desc::FileDesc;
    use irradiant_scene::desc::camera::ApertureShape;

    const RESOLUTION: [u32; 2] = [360, 240];

    fn camera(aperture_mm: f32, focus: f32, shape: ApertureShape) -> Camera {
        // A stop that is open into the corners of the square around the hole, but for a bar.
        let picture = Image::from_fn(32, 32, ["Y"], |x, _| [if x < 20 { 1.0 } else { 0.0 }]);
        let png = irradiant_image::write(&picture, irradiant_image::FileFormat::Png).unwrap();
        let mut setup = Setup::new(realistic(aperture_mm, focus, shape), RESOLUTION);
        setup.assets = MemoryAssets::default().with("bar.png", png);
        setup.compile().camera
    }

    fn model(camera: &Camera) -> &Realistic {
        match &camera.model {
            Model::Realistic(model) => model,
            other => panic!("{other:?}"),
        }
    }

    fn grid(n: usize) -> impl Iterator<Item = Point2> {
        let at = move |i: usize| (i as f32 + 0.5) / n as f32;
        (0..n * n).map(move |i| Point2::new(at(i % n), at(i / n)))
    }

    #[test]
    fn the_double_gauss_has_the_focal_length_of_its_patent_and_light_runs_both_ways() {
        let camera = camera(17.1, 1e4, ApertureShape::Circular);
        let lens = &model(&camera).lens;
        let thick = ThickLens::new(lens, 1e-5).unwrap();
        assert!((thick.focal_length() / 0.05 - 1.0).abs() < 0.01, "{thick:?}");
        // Focused far away, the film lies where parallel light meets.
        assert!(thick.film_focus.abs() < 1e-6 && thick.shift_to_focus(0.1).is_none());
        let start = LensRay { o: [0.003, -0.002, 0.0], d: [-0.001, 0.004, lens.rear_z()] };
        let (out, weight) = lens.trace_to_scene(start).unwrap();
        let back = lens.trace_to_film(LensRay { o: out.at(0.1), d: out.d.map(|c| -c) }).unwrap();
        let t = -back.o[2] / back.d[2];
        for i in 0..3 {
            assert!((back.o[i] + back.d[i] * t - start.o[i]).abs() < 1e-12 && weight == 1.0);
        }
    }

    #[test]
    fn the_picture_is_upright_and_as_wide_as_the_focal_length_says() {
        let camera = camera(4.0, 1e4, ApertureShape::Circular);
        let mean_direction = |film: Point2| {
            let rays = grid(40).filter_map(|u| camera.generate_ray(film, u, 0.5));
            rays.fold(Vec3::ZERO, |sum, ray| sum + ray.ray.d).normalize()
        };
        let pixel = 0.035 / (360f32 * 360.0 + 240.0 * 240.0).sqrt();
        for film in [Point2::new(180.0, 120.0), Point2::new(330.0, 120.0), Point2::new(60.0, 30.0)] {
            let d = mean_direction(film);
            let expected = [(film.x - 180.0) * pixel / 0.05, (120.0 - film.y) * pixel / 0.05];
            // Distortion of this lens is below 2 %.
            for (found, expected) in [d.x / d.z, d.y / d.z].into_iter().zip(expected) {
                assert!((found - expected).abs() <= 0.02 * expected.abs() + 1e-4, "{film:?} {found} {expected}");
            }
        }
    }

    #[test]
    fn rays_meet_in_the_plane_of_focus_and_spread_elsewhere() {
        let camera = camera(5.0, 2.0, ApertureShape::Circular);
        let spot = |film: Point2, z: f32| {
            let rays: Vec<_> = grid(40).filter_map(|u| camera.generate_ray(film, u, 0.5)).collect();
            let p = |i: usize| rays[i].ray.at((z - rays[i].ray.o.z) / rays[i].ray.d.z);
            let n = rays.len() as f32;
            let mean = (0..rays.len()).fold(Vec3::ZERO, |sum, i| sum + p(i).as_vec()) / n;
            ((0..rays.len()).map(|i| (p(i).as_vec() - mean).length_squared()).sum::<f32>() / n).sqrt()
        };
        for film in [Point2::new(180.0, 120.0), Point2::new(230.0, 140.0)] {
            // A pixel is 3.2 mm wide there; the lens's own faults blur by less than a quarter of that.
            assert!(spot(film, 2.0) < 0.8e-3, "{}", spot(film, 2.0));
            // The circle of confusion of an entrance pupil of about 7.3 mm.
            for (z, blur) in [(1.0, 0.5), (4.0, 1.0)] {
                let expected = blur * 3.65e-3 / 2f32.sqrt();
                assert!((spot(film, z) / expected - 1.0).abs() < 0.1, "{} {expected}", spot(film, z));
            }
        }
    }

    /// Irradiance on the film under radiance 1: the lens's throughput over its whole rear plane, by quadrature.
    fn throughput(model: &Realistic, film: Point2) -> f64 {
        const N: usize = 500;
        let start = model.film_point(film.x as f64, film.y as f64);
        let reach = 0.018;
        let z = model.rear_z;
        let sum: f64 = grid(N)
            .map(|u| {
                let at = |u: f32| (2.0 * u as f64 - 1.0) * reach;
                let d = [at(u.x) - start[0], at(u.y) - start[1], z];
                let passed = model.lens.trace_to_scene(LensRay { o: start, d }).map_or(0.0, |(_, weight)| weight);
                passed * z * z / dot(d, d).powi(2)
            })
            .sum();
        sum * (2.0 * reach / N as f64).powi(2)
    }

    // Quadratures on grids: both sides are within 0.5 % of their limits, so a pupil's box that cuts off 1.5 % is seen.
    #[test]
    fn weights_add_up_to_the_throughput_of_the_lens() {
        for (aperture, shape) in [
            (17.1, ApertureShape::Circular),
            (6.0, ApertureShape::Circular),
            (12.0, ApertureShape::Gaussian),
            (14.0, ApertureShape::Pentagon),
            (14.0, ApertureShape::Star),
            (14.0, ApertureShape::Square),
            (6.0, ApertureShape::Image(FileDesc { name: "bar.png".into(), path: "bar.png".into() })),
        ] {
            let camera = camera(aperture, 3.0, shape.clone());
            for film in [[180.0, 120.0], [300.0, 70.0], [5.0, 5.0], [180.0, 230.0]].map(Point2::from) {
                const N: usize = 300;
                let weights = grid(N).filter_map(|u| camera.generate_ray(film, u, 0.5)).map(|ray| ray.weight as f64);
                let mean = weights.sum::<f64>() / (N * N) as f64;
                let exact = throughput(model(&camera), film);
                assert!((mean / exact - 1.0).abs() < 0.01, "{aperture} {shape:?} {film:?}: {mean} {exact}");
            }
        }
    }

    #[test]
    fn pupils_waste_few_rays_and_tiny_apertures_are_found() {
        for (aperture, at_least) in [(17.1, 0.6), (6.0, 0.68), (0.05, 0.3)] {
            let camera = camera(aperture, 3.0, ApertureShape::Circular);
            let film = Point2::new(180.0, 120.0);
            let passed = grid(100).filter(|&u| camera.generate_ray(film, u, 0.5).is_some()).count();
            assert!(passed as f64 > at_least * 1e4, "{aperture}: {passed}");
        }
    }
}
