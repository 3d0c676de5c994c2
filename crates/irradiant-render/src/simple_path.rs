//! Path tracing without multiple importance sampling, with its two kinds of importance sampling switchable: the
//! textbook's second estimator (pbrt-v4's `simplepath`).

use crate::camera_samples::for_each_sample;
use crate::integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER, OptionEntry, OptionRange, Value};
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::film::FilmTile;
use irradiant_core::interaction::ReferencePoint;
use irradiant_core::light::SampleMode;
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::scene::Scene;
use irradiant_math::{Ray, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SimplePathIntegrator {
    /// Scattering events at most; `None` ends paths only by absorption, escape and roulette.
    pub max_depth: Option<u32>,
    /// Sample lights at each vertex; lights met by chance then count only where no sample could find them.
    pub sample_lights: bool,
    /// Sample directions by the BSDF (else uniformly).
    pub sample_bsdf: bool,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "simplepath",
    promise: "path tracing without multiple importance sampling; light sampling and BSDF sampling can be switched off",
    source: "pbrt-v4's simplepath",
    options: &[
        OptionEntry {
            name: "samplelights",
            range: OptionRange::Flag,
            default: Value::Flag(true),
            doc: "sample a light at each vertex (else light is found by chance)",
        },
        OptionEntry {
            name: "samplebsdf",
            range: OptionRange::Flag,
            default: Value::Flag(true),
            doc: "sample directions by the BSDF (else uniformly)",
        },
        LIGHT_SAMPLER,
    ],
    make: |options, max_depth| {
        Box::new(SimplePathIntegrator {
            max_depth,
            sample_lights: options.flag("samplelights"),
            sample_bsdf: options.flag("samplebsdf"),
        })
    },
};

impl Integrator for SimplePathIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            let mut ray = camera_ray.ray;
            let mut radiance = SampledSpectrum::ZERO;
            let mut throughput = SampledSpectrum::ONE;
            let mut count_emission = true;
            let mut previous: Option<ReferencePoint> = None;
            let mut depth = 0;
            loop {
                let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                    if count_emission {
                        radiance += throughput * environment(scene, &ray, lambda);
                    }
                    break;
                };
                let at = scene.geometry.interaction(&ray, &hit);
                // A light that samples cannot draw (a curve) counts whenever it is met.
                let drawable = |light| match &previous {
                    Some(p) => scene.lights.get(light).pdf_hit(p, ray.d, &(&at).into()) > 0.0,
                    None => false,
                };
                if let Some(light) = at.light.filter(|&l| count_emission || !drawable(l)) {
                    radiance += throughput * scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
                }
                let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
                let mix = sample.stream.mix(depth);
                let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix)
                else {
                    // Light samples do not pass interfaces: what lies behind one must be found by chance.
                    count_emission = true;
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
                if self.sample_lights && bsdf.flags().is_non_specular() {
                    let draws = sample.stream.light(depth);
                    if let Some(PickedLight { id: light, pmf }) =
                        scene.light_sampler.sample(&at.reference(), draws.pick)
                        && let Some(s) =
                            scene.lights.get(light).sample(&at.reference(), draws.uv, lambda, SampleMode::Complete)
                    {
                        let f = bsdf.f(at.wo, s.wi, TransportMode::Radiance) * s.wi.dot(bsdf.frame.z).abs();
                        let arriving = s.radiance * scene.opacity(&s);
                        if !(f.is_black() || arriving.is_black()) {
                            stats.shadow_rays += 1;
                            if !scene.is_occluded(&at, &s) {
                                radiance += throughput * f * arriving * (1.0 / (pmf * s.pdf));
                            }
                        }
                    }
                }
                let draws = sample.stream.scatter(depth);
                let wi = if self.sample_bsdf {
                    let Some(s) = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All) else {
                        break;
                    };
                    throughput *= s.f * (s.wi.dot(bsdf.frame.z).abs() / s.pdf);
                    count_emission = !self.sample_lights || s.lobe.is_specular();
                    s.wi
                } else {
                    let (wi, pdf) = uniform_direction(
                        at.wo,
                        bsdf.frame.z,
                        bsdf.flags().is_reflective(),
                        bsdf.flags().is_transmissive(),
                        draws.uv,
                    );
                    throughput *= bsdf.f(at.wo, wi, TransportMode::Radiance) * (wi.dot(bsdf.frame.z).abs() / pdf);
                    count_emission = !self.sample_lights;
                    wi
                };
                if throughput.is_black() {
                    break;
                }
                depth += 1;
                stats.scatterings += 1;
                stats.longest_path = stats.longest_path.max(depth);
                // With a depth limit, as pbrt, no roulette; without one paths must end.
                if self.max_depth.is_none() && depth > 3 {
                    let survival = throughput.max_component().clamp(0.05, 0.95);
                    if draws.roulette >= survival {
                        break;
                    }
                    throughput *= 1.0 / survival;
                }
                previous = Some(at.reference());
                ray = at.spawn_ray(wi);
                stats.bounce_rays += 1;
            }
            radiance
        });
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        // What chance cannot find.
        let lights = (!self.sample_lights).then_some(Limit::Unfound("delta lights", &[SceneHas::DeltaLights]));
        let lobes = (!self.sample_bsdf).then_some(Limit::Unfound("delta lobes", &[SceneHas::DeltaLobes]));
        // Without lights or lobes they are lost with these.
        let caustics =
            Limit::caustics_of_delta_lights(self.max_depth).filter(|_| self.sample_lights && self.sample_bsdf);
        depth.into_iter().chain(lights).chain(lobes).chain(caustics).collect()
    }
}

/// All environments along a ray.
pub(crate) fn environment(scene: &Scene, ray: &Ray, lambda: &Wavelengths) -> SampledSpectrum {
    scene
        .lights
        .environments()
        .iter()
        .fold(SampledSpectrum::ZERO, |sum, &l| sum + scene.lights.get(l).escaped(ray, lambda))
}

/// Uniform over the directions that the surface can scatter to: a hemisphere or the sphere.
fn uniform_direction(
    wo: Vec3,
    n: Vec3,
    reflective: bool,
    transmissive: bool,
    u: irradiant_math::Point2,
) -> (Vec3, f32) {
    if reflective && transmissive {
        return (warp::uniform_sphere(u), 1.0 / (4.0 * PI));
    }
    let local = warp::uniform_hemisphere(u);
    let wi = irradiant_math::Frame::from_z(n).from_local(local);
    let same_side = wo.dot(n) * wi.dot(n) > 0.0;
    (if same_side == reflective { wi } else { -wi }, 1.0 / (2.0 * PI))
}
