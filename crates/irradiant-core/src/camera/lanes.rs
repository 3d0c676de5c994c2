//! Rays of many samples side by side.

use super::projective::FlatScreen;
use super::{Camera, Model};
use irradiant_math::Point2;
use irradiant_math::lanes::{Floats, LANES, Triples, whole};

/// Where samples are on the film and on the lens, and the rays that leave the camera there.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct CameraLanes {
    /// Places on the film, pixels.
    pub film: [Floats; 2],
    /// Places on the lens, of the unit square.
    pub lens: [Floats; 2],
    /// Fractions of the shutter's interval.
    pub time_u: Floats,
    /// Origins, render space.
    pub o: Triples,
    /// Directions, unit.
    pub d: Triples,
    /// Times.
    pub time: Floats,
    /// What the radiance counts for; negative where the camera sees nothing.
    pub weight: Floats,
}

impl CameraLanes {
    /// Of nothing yet.
    pub const NONE: Self = Self {
        film: [[0.0; LANES]; 2],
        lens: [[0.0; LANES]; 2],
        time_u: [0.0; LANES],
        o: Triples::ZERO,
        d: Triples::ZERO,
        time: [0.0; LANES],
        weight: [0.0; LANES],
    };

    /// A lane's place on the film.
    #[inline(always)]
    pub fn film(&self, i: usize) -> Point2 {
        Point2::new(self.film[0][i], self.film[1][i])
    }

    /// A lane's place on the lens.
    #[inline(always)]
    pub fn lens(&self, i: usize) -> Point2 {
        Point2::new(self.lens[0][i], self.lens[1][i])
    }

    /// How far the ray of a lane goes: not at all where the camera sees nothing.
    #[inline(always)]
    pub fn end(&self, i: usize) -> f32 {
        if self.weight[i] < 0.0 { 0.0 } else { f32::INFINITY }
    }

    /// The rays of `n` lanes through a screen that rests.
    #[inline(always)]
    fn fill(&mut self, n: usize, camera: &Camera, screen: &impl FlatScreen) {
        for i in whole(n) {
            let ray = screen.ray(self.film(i), self.lens(i));
            self.o.set(i, ray.o.to_array());
            self.d.set(i, (ray.d * ray.inverse_length()).to_array());
            self.time[i] = camera.time(self.time_u[i]);
            self.weight[i] = ray.weight;
        }
    }
}

impl Camera {
    /// For `n` lanes the rays of [`Camera::generate_ray`], to the bit; where the camera sees nothing, rays of no use. Flat screens at rest are
    /// computed side by side, other cameras one ray after another.
    #[inline(always)]
    pub fn rays(&self, n: usize, lanes: &mut CameraLanes) {
        match (&self.model, &self.motion) {
            (Model::Perspective(model), None) => lanes.fill(n, self, model),
            (Model::Orthographic(model), None) => lanes.fill(n, self, model),
            (Model::Perspective(_) | Model::Orthographic(_) | Model::Spherical(_) | Model::Realistic(_), _) => {
                for i in 0..n {
                    let seen = self.generate_ray(lanes.film(i), lanes.lens(i), lanes.time_u[i]);
                    lanes.weight[i] = seen.as_ref().map_or(-1.0, |seen| seen.weight);
                    if let Some(seen) = seen {
                        lanes.o.set(i, seen.ray.o.to_array());
                        lanes.d.set(i, seen.ray.d.to_array());
                        lanes.time[i] = seen.ray.time;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Setup, orthographic, perspective, realistic};
    use super::*;
    use crate::geometry::{Kernel, Level};
    use irradiant_math::Ray;
    use irradiant_scene::desc::CameraKind;
    use irradiant_scene::desc::camera::ApertureShape;
    use irradiant_testkit::Rng;

    struct Look<'a>(&'a Camera, &'a mut CameraLanes);

    impl Kernel for Look<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.0.rays(N, self.1);
        }
    }

    /// Not whole vectors.
    const N: usize = 233;

    // With lenses and without, on the film and beyond it, where a real lens is blind; all levels: as one ray at a time, to the bit.
    #[test]
    fn lanes_have_the_rays_of_single_samples() {
        let kinds = [
            perspective(40.0, 0.0, 1e6),
            perspective(60.0, 0.1, 3.0),
            orthographic([-2.0, 2.0, -1.0, 1.0], 0.0, 1e6),
            orthographic([-2.0, 2.0, -1.0, 1.0], 0.2, 4.0),
            CameraKind::Spherical { equirectangular: true },
            realistic(10.0, 2.0, ApertureShape::Circular),
        ];
        let mut blind = 0;
        for kind in kinds {
            let camera = Setup::new(kind, [64, 32]).compile().camera;
            let mut rng = Rng::new(5);
            let mut lanes = CameraLanes::NONE;
            for i in 0..N {
                (lanes.film[0][i], lanes.film[1][i]) = (80.0 * rng.next_f32() - 8.0, 48.0 * rng.next_f32() - 8.0);
                (lanes.lens[0][i], lanes.lens[1][i]) = (rng.next_f32(), rng.next_f32());
                lanes.time_u[i] = rng.next_f32();
            }
            for level in Level::available() {
                level.run(Look(&camera, &mut lanes));
                for i in 0..N {
                    let single = camera.generate_ray(lanes.film(i), lanes.lens(i), lanes.time_u[i]);
                    assert_eq!(lanes.end(i) > 0.0, single.is_some(), "{level:?}");
                    blind += usize::from(single.is_none());
                    let Some(single) = single else { continue };
                    let ray = Ray::new(lanes.o.point(i), lanes.d.vector(i), lanes.time[i]);
                    assert_eq!((ray, lanes.weight[i]), (single.ray, single.weight), "{level:?}");
                }
            }
        }
        assert!(blind > 0, "every place of the real lens sees something");
    }
}
