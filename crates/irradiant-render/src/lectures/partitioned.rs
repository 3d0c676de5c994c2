//! Lecture A's path tracer (A52 to A54): at each point direct light by sampling lights, indirect light by recursion along a sampled
//! direction, Russian roulette.
//!
//! ```text
//! EstRadianceIn(x, w)
//!   p = intersectScene(x, w);
//!   return ZeroBounceRadiance(p, -w) + AtLeastOneBounceRadiance(p, -w);
//!
//! AtLeastOneBounceRadiance(p, wo)
//!   L = OneBounceRadiance(p, wo);
//!   wi, pdf = p.brdf.sampleDirection(wo);
//!   p' = intersectScene(p, wi);
//!   cpdf = continuationProbability(p.brdf, wi, wo);
//!   if (random01() < cpdf)
//!     L += AtLeastOneBounceRadiance(p', -wi) * p.brdf(wi, wo) * costheta / pdf / cpdf;
//!   return L;
//! ```
//!
//! What is wrong or missing on the slide:
//! - p and p' may be nothing.
//! - p' is traced before the roulette decides whether it is wanted. So it is here: the wasted rays show in the statistics.
//! - Emission counts for the eye's ray alone. A lamp in a mirror is black, and light that glass focuses is lost: run it with its default
//!   `emission=eye` to see that. The remedy is lecture B's (B38), `emission=specular`; `emission=power` is the better one (B32), and
//!   `emission=always`, the rule switched off, counts direct light twice where surfaces are diffuse.

use super::emission::{EmissionRule, Previous};
use super::path_options::PathOptions;
use super::roulette::Policy;
use super::walk::{self, Vertex, Walk};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::IntegratorEntry;
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_spectrum::SampledSpectrum;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "partitioned",
    promise: "direct light by light samples, indirect light by recursion with roulette; as printed, emission counts for the eye alone",
    source: "lecture A, A52 to A54 \"Path Tracing Pseudocode\"",
    options: &PathOptions::entries(EmissionRule::Eye, Policy::Bsdf, 0),
    make: |options, max_depth| Box::new(PartitionedIntegrator(PathOptions::of(options, max_depth))),
};

/// The recursion of the slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartitionedIntegrator(pub PathOptions);

impl Integrator for PartitionedIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| self.radiance_in(walk));
    }

    fn limits(&self) -> Vec<Limit> {
        self.0.limits()
    }
}

impl PartitionedIntegrator {
    /// The slide's `EstRadianceIn`, for the eye's ray.
    fn radiance_in(&self, walk: &mut Walk) -> SampledSpectrum {
        let PathOptions { emission, lights, .. } = &self.0;
        let (scene, eye) = (walk.scene, walk.camera_ray.ray);
        let mut zero_bounce = SampledSpectrum::ZERO;
        let p = walk.look(&eye, 0, |met| zero_bounce += met.emitted * emission.weight(scene, met, None, lights));
        match p {
            Some(p) if !self.0.ends(walk, 0) => zero_bounce + self.at_least_one_bounce(walk, &p, 0, 1.0),
            _ => zero_bounce,
        }
    }

    /// The slide's `AtLeastOneBounceRadiance(p, wo)`: what p scatters towards the eye, `depth` events before it having left `carried`.
    fn at_least_one_bounce(&self, walk: &mut Walk, p: &Vertex, depth: u32, carried: f32) -> SampledSpectrum {
        let PathOptions { emission, lights, directions, roulette, .. } = &self.0;
        let scene = walk.scene;
        let draws = walk.stream.light(depth);
        let mut radiance = lights.estimate(walk, p, draws, *emission, |wi| directions.pdf(p, wi));

        let draws = walk.stream.scatter(depth);
        let Some(step) = directions.sample(p, &draws) else { return radiance };
        // The next point, before the roulette, as on the slide; with it the light that the slide forgets, if it is to count.
        let previous = Previous { reference: p.at.reference(), pdf: step.pdf, specular: step.specular };
        let mut incoming = SampledSpectrum::ZERO;
        let next = walk.look(&p.at.spawn_ray(step.wi), depth + 1, |met| {
            incoming += met.emitted * emission.weight(scene, met, Some(&previous), lights);
        });

        let carried = carried * step.brightness;
        let survival = roulette.survival(depth, &step, carried);
        if draws.roulette < survival && carried > 0.0 {
            walk.scattered(depth + 1);
            if let Some(next) = next
                && !self.0.ends(walk, depth + 1)
            {
                incoming += self.at_least_one_bounce(walk, &next, depth + 1, carried / survival);
            }
            radiance += incoming * step.weight * (1.0 / survival);
        }
        radiance
    }
}
