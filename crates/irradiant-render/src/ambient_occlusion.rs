//! The fraction of the hemisphere above the first surface that is open (pbrt-v4's `ambientocclusion`).

use crate::camera_samples::for_each_sample;
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::{IntegratorEntry, OptionEntry, OptionRange, Value};
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_math::{Frame, warp};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::PI;

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientOcclusionIntegrator {
    /// Cosine-weighted directions (else uniform); the result is the same.
    pub cos_sample: bool,
    /// Occluders farther than this do not count, scene units.
    pub max_distance: f32,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "ambientocclusion",
    promise: "the fraction of the hemisphere above the first surface that is open",
    source: "pbrt-v4's ambientocclusion",
    options: &[
        OptionEntry {
            name: "cossample",
            range: OptionRange::Flag,
            default: Value::Flag(true),
            doc: "cosine-weighted directions (else uniform); the result is the same",
        },
        OptionEntry {
            name: "maxdistance",
            range: OptionRange::Number(0.0, f32::INFINITY),
            default: Value::Number(f32::INFINITY),
            doc: "occluders farther than this do not count, scene units",
        },
    ],
    make: |options, _| {
        Box::new(AmbientOcclusionIntegrator {
            cos_sample: options.flag("cossample"),
            max_distance: options.number("maxdistance"),
        })
    },
};

impl Integrator for AmbientOcclusionIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            let mut ray = camera_ray.ray;
            loop {
                let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                    return SampledSpectrum::ZERO;
                };
                let at = scene.geometry.interaction(&ray, &hit);
                let footprint = scene.texture_context(&at, Some(camera_ray));
                let mix = sample.stream.mix(0);
                let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix)
                else {
                    ray = at.spawn_ray(ray.d);
                    continue;
                };
                if !layers.is_empty() {
                    scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
                }
                let u = sample.stream.scatter(0).uv;
                let (local, pdf) = if self.cos_sample {
                    let w = warp::cosine_hemisphere(u);
                    (w, w.z.abs() / PI)
                } else {
                    (warp::uniform_hemisphere(u), 1.0 / (2.0 * PI))
                };
                let n = at.n.face_forward(at.wo).as_vec();
                let wi = Frame::from_z(n).from_local(local);
                if !(pdf > 0.0) {
                    return SampledSpectrum::ZERO;
                }
                stats.scatterings += 1;
                stats.longest_path = stats.longest_path.max(1);
                stats.shadow_rays += 1;
                if scene.geometry.occluded(&at.spawn_ray(wi), self.max_distance, &scene.alpha()) {
                    return SampledSpectrum::ZERO;
                }
                // Divided by pi so that a fully open point is white.
                return scene.white(lambda) * (local.z / (PI * pdf));
            }
        });
    }

    fn scatters(&self) -> bool {
        false
    }

    fn limits(&self) -> Vec<Limit> {
        vec![Limit::OtherQuantity("ambient occlusion")]
    }
}
