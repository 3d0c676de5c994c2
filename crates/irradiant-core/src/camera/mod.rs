//! Where paths begin: from a place on the film to a ray into the scene.
//!
//! # Layout
//! In reading order: this file ([`Camera`], [`CameraRay`]); `projective` (perspective and orthographic), `spherical`,
//! `realistic` (through real glass: `lens`, its `exit_pupil`, its `aperture`); [`footprint`](FootprintEstimator) (how far
//! apart neighbouring pixels are at a surface); `lanes` (many rays side by side); `importance` (the camera as light meets it); `compile` (from the description).
//!
//! # Conventions
//! Film positions are in pixels of the full image, (0, 0) at the top left corner, so pixel (x, y) covers x to x + 1. Camera
//! space looks along +z with +y up and +x to the right (left-handed), in scene units. Rays leave in render space.
//!
//! Behaviour is pbrt-v4's (Pharr, Jakob and Humphreys 2023, chapter 5). It does not know of spectra, sensors or filters.

mod aperture;
mod compile;
mod exit_pupil;
mod footprint;
mod importance;
mod lanes;
mod lens;
mod projective;
mod realistic;
mod spherical;
#[cfg(test)]
mod tests;

pub use compile::{CompiledCamera, compile};
pub use footprint::FootprintEstimator;
pub use importance::CameraConnection;
pub use lanes::CameraLanes;

use crate::interaction::Interaction;
use irradiant_math::elementary::lerp;
use irradiant_math::{Affine, AnimatedTransform, Point2, Point3, Ray, Vec3};
use projective::{FlatScreen, Orthographic, Perspective};
use realistic::Realistic;
use spherical::Spherical;

/// A ray from the camera, how much it counts, and where its neighbours are.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray, render space, unit direction.
    pub ray: Ray,
    /// What its radiance counts for: 1 for ideal cameras; vignetting and pupil area of real lenses, >= 0.
    pub weight: f32,
    pub(crate) offsets: Offsets,
    /// False where the lens blocks the neighbours.
    pub(crate) has_offsets: bool,
}

/// What to add to a ray to have its neighbours, one (scaled) pixel further in x and in y. Directions need not be unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Offsets {
    pub origin_x: Vec3,
    pub direction_x: Vec3,
    pub origin_y: Vec3,
    pub direction_y: Vec3,
}

impl Offsets {
    pub(crate) const ZERO: Self =
        Self { origin_x: Vec3::ZERO, direction_x: Vec3::ZERO, origin_y: Vec3::ZERO, direction_y: Vec3::ZERO };
}

impl CameraRay {
    /// A ray that no camera made, of weight 1 and without neighbours: for walking a scene from anywhere. Textures at its
    /// first hit are filtered as at later ones.
    pub fn alone(ray: Ray) -> Self {
        Self { ray, weight: 1.0, offsets: Offsets::ZERO, has_offsets: false }
    }

    /// Where the neighbouring rays meet the tangent plane of the hit, relative to the hit: the changes of position from one
    /// pixel to the next in x and in y, scaled for the number of samples. `None` without neighbours, or where the plane
    /// is seen edge-on.
    #[inline]
    pub fn position_change(&self, at: &Interaction) -> Option<[Vec3; 2]> {
        if !self.has_offsets {
            return None;
        }
        let meet = |origin: Vec3, direction: Vec3| {
            let (o, d) = (self.ray.o + origin, self.ray.d + direction);
            let to_hit = at.p - o;
            let t = to_hit.dot_normal(at.n) / d.dot_normal(at.n);
            d * t - to_hit
        };
        let o = &self.offsets;
        let changes = [meet(o.origin_x, o.direction_x), meet(o.origin_y, o.direction_y)];
        (changes[0].is_finite() && changes[1].is_finite()).then_some(changes)
    }

    /// Change of the hit's z coordinate from one pixel to the next in x and in y, in another space; scaled for the number of
    /// samples as texture footprints are (pbrt-v4's "dzdx", "dzdy"). Zero where [`CameraRay::position_change`] is `None`.
    pub fn depth_slope(&self, at: &Interaction, space_from_render: &Affine) -> [f32; 2] {
        self.position_change(at).map_or([0.0; 2], |changes| changes.map(|v| space_from_render.vector(v).z))
    }
}

/// Makes rays. Immutable.
#[derive(Clone, Debug)]
pub struct Camera {
    shutter: [f32; 2],
    /// Neighbours are this part of a pixel away.
    footprint_scale: f32,
    /// Render from camera space; when it moves, the model stays in camera space, else the model is in render space.
    motion: Option<Box<AnimatedTransform>>,
    model: Model,
}

#[derive(Clone, Debug)]
enum Model {
    Perspective(Perspective),
    Orthographic(Orthographic),
    Spherical(Spherical),
    Realistic(Box<Realistic>),
}

/// A ray of a model in the model's space: not normalised, neighbours unscaled.
#[derive(Clone, Copy, Debug)]
struct ModelRay {
    o: Point3,
    d: Vec3,
    weight: f32,
    offsets: Option<Offsets>,
}

impl ModelRay {
    /// What makes the direction a unit vector.
    #[inline(always)]
    fn inverse_length(&self) -> f32 {
        1.0 / self.d.length()
    }
}

impl Camera {
    /// The ray through a place on the film (pixels) and a place on the lens (unit square), at a fraction `time_u` of the
    /// shutter's interval. `None` where the lens lets nothing through.
    ///
    /// About 20 ns, 60 ns for spherical and for moving cameras; real glass takes some 75 ns per surface, neighbours included.
    #[inline]
    pub fn generate_ray(&self, film: Point2, lens: Point2, time_u: f32) -> Option<CameraRay> {
        self.scaled_ray(film, lens, time_u, self.footprint_scale)
    }

    /// True when rays depend on a place on the lens.
    #[inline]
    pub fn has_lens(&self) -> bool {
        match &self.model {
            Model::Perspective(model) => model.has_lens(),
            Model::Orthographic(model) => model.has_lens(),
            Model::Spherical(_) => false,
            Model::Realistic(_) => true,
        }
    }

    /// The shutter's time at a fraction of its interval.
    #[inline(always)]
    pub fn time(&self, time_u: f32) -> f32 {
        lerp(time_u, self.shutter[0], self.shutter[1])
    }

    /// Times of opening and closing.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    #[inline]
    fn scaled_ray(&self, film: Point2, lens: Point2, time_u: f32, footprint_scale: f32) -> Option<CameraRay> {
        let mut ray = match &self.model {
            Model::Perspective(model) => model.ray(film, lens),
            Model::Orthographic(model) => model.ray(film, lens),
            Model::Spherical(model) => model.ray(film),
            Model::Realistic(model) => model.ray(film, lens)?,
        };
        let time = self.time(time_u);
        if let Some(motion) = &self.motion {
            moved(&mut ray, &motion.at(time));
        }
        // Neighbours of the normalised ray lie on the same lines when their offsets are scaled alike.
        let inverse_length = ray.inverse_length();
        let offsets = ray.offsets.map(|o| Offsets {
            origin_x: o.origin_x * footprint_scale,
            direction_x: o.direction_x * (footprint_scale * inverse_length),
            origin_y: o.origin_y * footprint_scale,
            direction_y: o.direction_y * (footprint_scale * inverse_length),
        });
        Some(CameraRay {
            ray: Ray::new(ray.o, ray.d * inverse_length, time),
            weight: ray.weight,
            offsets: offsets.unwrap_or(Offsets::ZERO),
            has_offsets: offsets.is_some(),
        })
    }
}

fn moved(ray: &mut ModelRay, render_from_camera: &Affine) {
    ray.o = render_from_camera.point(ray.o);
    ray.d = render_from_camera.vector(ray.d);
    ray.offsets = ray.offsets.map(|o| Offsets {
        origin_x: render_from_camera.vector(o.origin_x),
        direction_x: render_from_camera.vector(o.direction_x),
        origin_y: render_from_camera.vector(o.origin_y),
        direction_y: render_from_camera.vector(o.direction_y),
    });
}
