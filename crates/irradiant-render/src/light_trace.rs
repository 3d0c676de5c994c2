//! Light tracing: paths begin at lights and are seen by the camera at each surface they meet (Dutré, Lafortune and Willems
//! 1993; "particle tracing" in Veach 1997). Strong where path tracing is weak: caustics, even of point lights, which no
//! path from the camera finds.
//!
//! Each sample traces one path from a light, whose contributions go to whichever pixels show them, and one ray from the
//! camera, for lights that are seen directly and for the film's layers. It cannot see what the camera sees by way of
//! smooth mirrors and glass: no path from a light meets a pinhole by itself. The picture lacks it, and the header says so.

use crate::camera_samples::{CameraSample, for_each_sample};
use crate::integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
use crate::light_walk::{Arrival, shading_correction, start, walk};
use crate::registry::IntegratorEntry;
use crate::simple_path::environment;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_math::{Normal3, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightTraceIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "lighttrace",
    promise: "paths from lights, seen by the camera at each surface they meet: caustics even of point lights; what the camera \
              sees in smooth mirrors and through glass is missing",
    source: "lecture B, slides on rendering algorithms (B10), as an independent witness; pbrt-v4's \"lightpath\"",
    options: &[],
    make: |_, max_depth| Box::new(LightTraceIntegrator { max_depth }),
};

/// What the header says of pictures that lack what only paths from the camera find.
const UNSEEN: &str = "what the camera sees by way of delta lobes";

impl Integrator for LightTraceIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let mut splats = Splats::default();
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            self.light_path(scene, sample, camera_ray.ray.time, &mut splats, stats);
            directly_seen(scene, sample, camera_ray, lambda, layers)
        });
        splats.into_tile(tile);
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        match scene.light_path_obstacle() {
            None => Ok(()),
            Some(why) => Err(format!("lighttrace cannot make this picture: {why}; bdpt and path can")),
        }
    }

    fn splats(&self) -> bool {
        true
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        let lobes = Limit::Unfound(UNSEEN, &[SceneHas::DeltaLobes]);
        let curves = Limit::Unfound("what lamps that are curves shine on", &[SceneHas::CurvedLamps]);
        depth.into_iter().chain([lobes, curves]).collect()
    }
}

impl LightTraceIntegrator {
    /// The sample's path from a light: what the camera sees of each of its vertices.
    fn light_path(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        time: f32,
        splats: &mut Splats,
        stats: &mut RenderStats,
    ) {
        let mut lambda = sample.lambda;
        splats.begin_path();
        let Some(start) = start(scene, &sample.stream, &lambda, time) else { return };
        walk(scene, &start, &sample.stream, &mut lambda, self.max_depth, stats, |arrival, lambda, stats| {
            see(scene, sample, arrival, lambda, splats, stats);
        });
    }
}

/// What the camera sees of power that arrives at a surface.
fn see(
    scene: &Scene,
    sample: &CameraSample,
    arrival: &Arrival,
    lambda: &Wavelengths,
    splats: &mut Splats,
    stats: &mut RenderStats,
) {
    let Arrival { at, bsdf, power, depth } = arrival;
    if !bsdf.flags().is_non_specular() {
        return;
    }
    let Some(seen) = scene.connect_camera(at.p, sample.stream.light_path_lens(*depth), at.time) else { return };
    let cos = bsdf.abs_cos(seen.w) * shading_correction(at, bsdf.frame.z, at.wo, seen.w);
    let brought = *power * bsdf.f(at.wo, seen.w, TransportMode::Importance) * (cos * seen.film_area);
    if brought.is_black() {
        return;
    }
    stats.shadow_rays += 1;
    if scene.is_visible(at, seen.origin, Vec3::ZERO, Normal3::ZERO) {
        scene.splat(seen.film, brought, lambda, |x, y, rgb| splats.add(x, y, rgb));
    }
}

/// Light that the camera's own ray meets first, and the film's layers.
fn directly_seen(
    scene: &Scene,
    sample: &CameraSample,
    camera_ray: &CameraRay,
    lambda: &mut Wavelengths,
    layers: &mut [f32],
) -> SampledSpectrum {
    let mut radiance = SampledSpectrum::ZERO;
    let mut ray = camera_ray.ray;
    loop {
        let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
            return radiance + environment(scene, &ray, lambda);
        };
        let at = scene.geometry.interaction(&ray, &hit);
        if let Some(light) = at.light {
            radiance += scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
        }
        let footprint = scene.texture_context(&at, Some(camera_ray));
        // Of the layers only: light keeps its wavelengths.
        let mut own = *lambda;
        let mix = sample.stream.mix(0);
        match scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut own, mix) {
            Some(bsdf) => {
                if !layers.is_empty() {
                    scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
                }
                return radiance;
            }
            None => ray = at.spawn_ray(ray.d),
        }
    }
}

/// What paths from lights bring to pixels, path by path: what one path brings to one pixel comes as one sum, so that
/// the film's error bars are right.
#[derive(Debug, Default)]
pub(crate) struct Splats {
    list: Vec<(i32, i32, [f32; 3])>,
    /// Where the present path begins in the list.
    path: usize,
}

impl Splats {
    /// Another path begins.
    pub fn begin_path(&mut self) {
        self.path = self.list.len();
    }

    /// Adds to what the path brings to a pixel.
    pub fn add(&mut self, x: i32, y: i32, rgb: [f32; 3]) {
        match self.list[self.path..].iter_mut().find(|s| (s.0, s.1) == (x, y)) {
            Some((_, _, sum)) => (0..3).for_each(|c| sum[c] += rgb[c]),
            None => self.list.push((x, y, rgb)),
        }
    }

    /// Hands everything to the film.
    pub fn into_tile(self, tile: &mut FilmTile) {
        for (x, y, rgb) in self.list {
            tile.splat(x, y, rgb);
        }
    }
}
