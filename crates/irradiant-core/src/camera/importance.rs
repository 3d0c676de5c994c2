//! The camera as light meets it: where on the film a point appears, and how much film stands for how much of it.
//!
//! For paths that begin at lights. A pixel shows the mean over film and lens of the radiance along [`Camera::generate_ray`];
//! put as an integral over points of the scene, each part of a surface counts with the film that shows it. That film
//! area, in square pixels per unit area facing the camera, is all there is to a camera's importance: times one over the
//! lens area it is Veach's `We cos / d^2` (Veach 1997, section 8.3.2), here for radiance that is not scaled by the cosine at the
//! film (pbrt-v4's convention for sensors, and this camera's).
//!
//! Cameras with a flat screen have it; spherical and realistic ones do not yet ([`Camera::can_connect`]).

use super::projective::Screen;
use super::{Camera, Model};
use irradiant_math::warp::uniform_disk_concentric;
use irradiant_math::{Affine, Point2, Point3, Ray, Vec3};

/// A point as the camera sees it, before visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraConnection {
    /// Where it appears, pixels of the full image; perhaps outside of it.
    pub film: Point2,
    /// Where the ray through that place of the film starts that goes through the point.
    pub origin: Point3,
    /// From the point to `origin`, unit.
    pub w: Vec3,
    /// Square pixels of film for a unit of area at the point that faces the camera.
    pub film_area: f32,
}

impl Camera {
    /// True when [`Camera::connect`] knows this kind of camera.
    pub fn can_connect(&self) -> bool {
        self.screen().is_some()
    }

    /// How a point of render space is seen from a place on the lens (unit square; any will do for a pinhole) at a time of
    /// the shutter. `None` from behind, and for cameras that are not supported.
    ///
    /// The place on the lens is drawn as [`Camera::generate_ray`] draws it, so the mean over `lens` of the radiance that
    /// goes to `origin`, times `film_area` and the cosine at the point, is the film's measurement.
    pub fn connect(&self, p: Point3, lens: Point2, time: f32) -> Option<CameraConnection> {
        let screen = self.screen_at(time)?;
        let (origin, film, film_area) = match screen.parallel {
            None => {
                let offset = screen.lens.map_or(Vec3::ZERO, |axes| {
                    let u = uniform_disk_concentric(lens);
                    axes[0] * u.x + axes[1] * u.y
                });
                let origin = screen.origin + offset;
                let d = p - origin;
                // To the plane of focus, on the line that the ray takes.
                let normal = screen.dx.cross(screen.dy);
                let along = screen.corner.dot(normal) / d.dot(normal);
                if !(along > 0.0 && along.is_finite()) {
                    return None;
                }
                let distance = d.length();
                let film_area = screen.film_per_steradian(d * (1.0 / distance)) / (distance * distance);
                (origin, offset + d * along, film_area)
            }
            Some(forward) => {
                let to_p = p - screen.origin;
                let along = to_p.dot(forward) / forward.length_squared();
                if !(along > 0.0) {
                    return None;
                }
                (p - forward * along, to_p - forward * along, 1.0 / screen.dx.cross(screen.dy).length())
            }
        };
        let w = (origin - p).normalize();
        let film = screen.film(film - screen.corner);
        let good =
            film.x.is_finite() && film.y.is_finite() && film_area > 0.0 && film_area.is_finite() && w.is_finite();
        good.then_some(CameraConnection { film, origin, w, film_area })
    }

    /// [`CameraConnection::film_area`] of the point at `distance` along a ray that this camera made; 0 for cameras that
    /// are not supported. Over the number of pixels: the density, per area facing the ray, with which a camera that
    /// looks at all of them alike finds that point.
    pub fn film_area(&self, ray: &Ray, distance: f32) -> f32 {
        let Some(screen) = self.screen_at(ray.time) else { return 0.0 };
        match screen.parallel {
            None => screen.film_per_steradian(ray.d) / (distance * distance),
            Some(_) => 1.0 / screen.dx.cross(screen.dy).length(),
        }
    }

    /// In the model's space.
    fn screen(&self) -> Option<Screen> {
        match &self.model {
            Model::Perspective(model) => Some(model.screen()),
            Model::Orthographic(model) => Some(model.screen()),
            Model::Spherical(_) | Model::Realistic(_) => None,
        }
    }

    /// In render space.
    fn screen_at(&self, time: f32) -> Option<Screen> {
        let screen = self.screen()?;
        Some(match &self.motion {
            None => screen,
            Some(motion) => screen.moved(&motion.at(time)),
        })
    }
}

impl Screen {
    fn moved(&self, a: &Affine) -> Self {
        Self {
            origin: a.point(self.origin),
            corner: a.vector(self.corner),
            dx: a.vector(self.dx),
            dy: a.vector(self.dy),
            lens: self.lens.map(|axes| axes.map(|v| a.vector(v))),
            parallel: self.parallel.map(|v| a.vector(v)),
        }
    }

    /// Film position of a point of the screen's plane, relative to the corner.
    fn film(&self, v: Vec3) -> Point2 {
        let normal = self.dx.cross(self.dy);
        let (across_x, across_y) = (self.dy.cross(normal), self.dx.cross(normal));
        Point2::new(v.dot(across_x) / self.dx.dot(across_x), v.dot(across_y) / self.dy.dot(across_y))
    }

    /// Square pixels for a steradian about the unit direction `d`, from any place on the lens: the lens is parallel to the
    /// screen, so all places are as far from its plane.
    fn film_per_steradian(&self, d: Vec3) -> f32 {
        let normal = self.dx.cross(self.dy);
        let pixel = normal.length();
        let normal = normal * (1.0 / pixel);
        let (height, cos) = (self.corner.dot(normal), d.dot(normal).abs());
        // Area = solid angle (height / cos)^2 / cos.
        height * height / (pixel * cos * cos * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Setup;
    use super::*;
    use irradiant_math::Transform;
    use irradiant_scene::Spanned;
    use irradiant_scene::desc::{CameraKind, MotionDesc};
    use irradiant_testkit::{Mean, Rng, assert_mean_close};

    fn said<T>(value: T) -> Spanned<T> {
        Spanned::unplaced(value)
    }

    fn perspective(lens_radius: f32, window: Option<[f32; 4]>) -> CameraKind {
        CameraKind::Perspective {
            fov: said(50.0),
            lens_radius: said(lens_radius),
            focal_distance: said(3.0),
            frame_aspect_ratio: None,
            screen_window: window.map(said),
        }
    }

    fn orthographic(lens_radius: f32) -> CameraKind {
        CameraKind::Orthographic {
            lens_radius: said(lens_radius),
            focal_distance: said(3.0),
            frame_aspect_ratio: None,
            screen_window: Some(said([-2.0, 1.5, -1.0, 1.25])),
        }
    }

    /// Every kind: pinhole, off-centre window, lens, parallel, parallel with a lens, moving, mirrored.
    fn cameras() -> Vec<Camera> {
        let turned = Transform::rotate(33.0, [0.3, 1.0, 0.2]).unwrap().compose(&Transform::translate(1.0, 2.0, -0.5));
        let mirrored = Transform::scale(-1.0, 1.0, 1.0).unwrap().compose(&turned);
        let moving = MotionDesc {
            start: turned,
            end: Transform::rotate(80.0, [1.0, 0.0, 0.3]).unwrap().compose(&turned),
            start_time: 0.0,
            end_time: 1.0,
        };
        [
            (perspective(0.0, None), MotionDesc::still(turned)),
            (perspective(0.0, Some([-0.2, 1.4, -0.9, 0.3])), MotionDesc::still(mirrored)),
            (perspective(0.2, None), MotionDesc::still(turned)),
            (perspective(0.2, None), moving),
            (orthographic(0.0), MotionDesc::still(turned)),
            (orthographic(0.3), MotionDesc::still(turned)),
        ]
        .into_iter()
        .map(|(kind, motion)| {
            let mut setup = Setup::new(kind, [40, 30]);
            setup.camera_from_world = motion;
            setup.compile().camera
        })
        .collect()
    }

    fn u2(rng: &mut Rng) -> Point2 {
        Point2::new(rng.next_f32(), rng.next_f32())
    }

    #[test]
    fn points_of_a_ray_are_seen_where_the_ray_came_from() {
        let mut rng = Rng::new(3);
        for (i, camera) in cameras().iter().enumerate() {
            assert!(camera.can_connect());
            for _ in 0..500 {
                let film = Point2::new(44.0 * rng.next_f32() - 2.0, 34.0 * rng.next_f32() - 2.0);
                let lens = u2(&mut rng);
                let ray = camera.generate_ray(film, lens, rng.next_f32()).unwrap().ray;
                let distance = 0.2 + 8.0 * rng.next_f32();
                let p = ray.at(distance);
                let seen = camera.connect(p, lens, ray.time).unwrap();
                assert!((seen.film.x - film.x).abs() < 2e-3 && (seen.film.y - film.y).abs() < 2e-3, "{i}: {seen:?}");
                assert!((seen.origin - ray.o).length() < 1e-4 && (seen.w + ray.d).length() < 1e-4, "{i}: {seen:?}");
                let again = camera.film_area(&ray, distance);
                assert!((seen.film_area / again - 1.0).abs() < 1e-3, "{i}: {} {again}", seen.film_area);
                assert!(camera.connect(ray.at(-distance), lens, ray.time).is_none(), "{i}: behind");
            }
        }
    }

    /// The film shows all of a plane that crosses its view: the integral of film area over the plane, drawn by rays over
    /// the whole film and by points of the plane alike, is the area of the film. A factor of 3.5 % would be seen.
    #[test]
    fn the_film_that_stands_for_a_plane_is_the_whole_film() {
        for (i, camera) in cameras().iter().enumerate() {
            let mut rng = Rng::new(70 + i as u64);
            let time = 0.4;
            let middle = camera.generate_ray(Point2::new(20.0, 15.0), Point2::new(0.5, 0.5), time).unwrap().ray;
            let center = middle.at(4.0);
            // Slanted, and large enough to fill the view.
            let n = (middle.d + Vec3::new(0.2, 0.15, -0.1)).normalize();
            let frame = irradiant_math::Frame::from_z(n);
            let half = 5.0;
            let mean = Mean::of(800_000, || {
                let p = center
                    + frame.x * (half * (2.0 * rng.next_f32() - 1.0))
                    + frame.y * (half * (2.0 * rng.next_f32() - 1.0));
                let Some(seen) = camera.connect(p, u2(&mut rng), time) else { return 0.0 };
                let inside = (0.0..40.0).contains(&seen.film.x) && (0.0..30.0).contains(&seen.film.y);
                if inside { f64::from(seen.film_area * seen.w.dot(n).abs() * 4.0 * half * half) } else { 0.0 }
            });
            assert!(mean.detectable_bias(4.9) < 0.035, "{i}: {}", mean.detectable_bias(4.9));
            assert_mean_close(&mean, 1200.0, 4.9);
        }
    }

    #[test]
    fn other_cameras_say_that_they_cannot() {
        for kind in [
            CameraKind::Spherical { equirectangular: true },
            super::super::tests::realistic(5.0, 2.0, irradiant_scene::desc::camera::ApertureShape::Circular),
        ] {
            let camera = Setup::new(kind, [8, 8]).compile().camera;
            assert!(!camera.can_connect());
            assert!(camera.connect(Point3::new(0.0, 0.0, 3.0), Point2::new(0.5, 0.5), 0.0).is_none());
        }
    }
}
