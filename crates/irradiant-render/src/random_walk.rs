//! Uniform random directions at every vertex, emission counted where it is met: the first estimator anyone writes
//! (pbrt-v4's `randomwalk`). Noisy beyond use for small lights; blind to delta lights and mirrors.

use crate::camera_samples::for_each_sample;
use crate::integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
use crate::registry::IntegratorEntry;
use crate::simple_path::environment;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_math::warp;
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::PI;

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomWalkIntegrator {
    /// Scattering events at most; `None`: ended by roulette alone.
    pub max_depth: Option<u32>,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "randomwalk",
    promise: "uniform random directions at every vertex, emission counted where it is met",
    source: "pbrt-v4's randomwalk; A43 without importance sampling",
    options: &[],
    make: |_, max_depth| Box::new(RandomWalkIntegrator { max_depth }),
};

impl Integrator for RandomWalkIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            let mut ray = camera_ray.ray;
            let mut radiance = SampledSpectrum::ZERO;
            let mut throughput = SampledSpectrum::ONE;
            let mut depth = 0;
            loop {
                let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                    radiance += throughput * environment(scene, &ray, lambda);
                    break;
                };
                let at = scene.geometry.interaction(&ray, &hit);
                if let Some(light) = at.light {
                    radiance += throughput * scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
                }
                let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
                let mix = sample.stream.mix(depth);
                let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix)
                else {
                    ray = at.spawn_ray(ray.d);
                    stats.bounce_rays += 1;
                    continue;
                };
                if depth == 0 && !layers.is_empty() {
                    scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
                }
                if self.max_depth.is_some_and(|limit| depth >= limit) {
                    break;
                }
                let draws = sample.stream.scatter(depth);
                let wi = warp::uniform_sphere(draws.uv);
                let cosine = wi.dot(bsdf.frame.z).abs();
                throughput *= bsdf.f(at.wo, wi, TransportMode::Radiance) * (cosine * 4.0 * PI);
                if throughput.is_black() {
                    break;
                }
                depth += 1;
                stats.scatterings += 1;
                stats.longest_path = stats.longest_path.max(depth);
                if self.max_depth.is_none() && depth > 3 {
                    let survival = throughput.max_component().clamp(0.05, 0.95);
                    if draws.roulette >= survival {
                        break;
                    }
                    throughput *= 1.0 / survival;
                }
                ray = at.spawn_ray(wi);
                stats.bounce_rays += 1;
            }
            radiance
        });
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        let lights = Limit::Unfound("delta lights", &[SceneHas::DeltaLights]);
        let lobes = Limit::Unfound("delta lobes", &[SceneHas::DeltaLobes]);
        depth.into_iter().chain([lights, lobes]).collect()
    }
}
