//! Lecture B's path tracer (B22 to B24): one path from the eye, extended step by step, lit once at each vertex, so that "each eye ray
//! contributes one path of each length".
//!
//! ```text
//! alpha = 1
//! hitRecord = shoot primary ray
//! k = 0
//! while(true)
//!     x = sample a point on a light source with pdf p_w(x)
//!     c = c + alpha*shade(hitRecord,x)/(p_w(x))
//!     break with probability q[k]
//!     hitRecord = shoot ray along w_i with pdf p_w(w_i)
//!     alpha = alpha*BRDF(w_o,w_i)*cos/(p_w(w_i)*(1-q[k]))
//!     k++
//! ```
//!
//! What is wrong or missing on the slide: the rays may meet nothing; no emission is added, not even where the eye sees a lamp (only the
//! notes have it, B38: `emission=specular`); deltas are a distinct case in the notes only (B34). With the default `emission=never` lamps
//! are black, as printed. Where a material is ideally specular shade() is 0.
//!
//! Its notes recommend q1 = q2 = 0, then q = 0.5 (B25): the default here, and where surfaces are bright a variance that is not finite
//! (see [`super::roulette`]).

use super::emission::{EmissionRule, Previous};
use super::path_options::PathOptions;
use super::roulette::Policy;
use super::walk::{self, Walk};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::IntegratorEntry;
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_spectrum::SampledSpectrum;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "iterative",
    promise: "one path extended step by step and lit at each vertex, all its beginnings reused; as printed, no emission counts",
    source: "lecture B, B22 to B25 \"Path tracing pseudocode\"",
    options: &PathOptions::entries(EmissionRule::Never, Policy::Constant, 2),
    make: |options, max_depth| Box::new(IterativeIntegrator(PathOptions::of(options, max_depth))),
};

/// The loop of the slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IterativeIntegrator(pub PathOptions);

impl Integrator for IterativeIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| self.color(walk));
    }

    fn limits(&self) -> Vec<Limit> {
        self.0.limits()
    }
}

impl IterativeIntegrator {
    fn color(&self, walk: &mut Walk) -> SampledSpectrum {
        let PathOptions { emission, lights, directions, roulette, .. } = &self.0;
        let scene = walk.scene;
        let mut color = SampledSpectrum::ZERO;
        let mut alpha = SampledSpectrum::ONE;
        let mut carried = 1.0;
        let mut ray = walk.camera_ray.ray;
        let mut previous: Option<Previous> = None;
        let mut k = 0;
        loop {
            let hit_record = walk.look(&ray, k, |met| {
                color += alpha * met.emitted * emission.weight(scene, met, previous.as_ref(), lights);
            });
            let Some(p) = hit_record else { break };
            if self.0.ends(walk, k) {
                break;
            }
            let draws = walk.stream.light(k);
            color += alpha * lights.estimate(walk, &p, draws, *emission, |wi| directions.pdf(&p, wi));

            // q[k] may depend on the direction, so that is drawn first; the ray is not traced before the roulette.
            let draws = walk.stream.scatter(k);
            let Some(step) = directions.sample(&p, &draws) else { break };
            carried *= step.brightness;
            let survival = roulette.survival(k, &step, carried);
            if draws.roulette >= survival || !(carried > 0.0) {
                break;
            }
            alpha *= step.weight * (1.0 / survival);
            carried /= survival;
            previous = Some(Previous { reference: p.at.reference(), pdf: step.pdf, specular: step.specular });
            ray = p.at.spawn_ray(step.wi);
            k += 1;
            walk.scattered(k);
        }
        color
    }
}
