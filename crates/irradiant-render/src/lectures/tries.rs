//! Lecture A's first two sums over paths: "try 1" (A43) and "try 2" (A50).
//!
//! ```text
//! EstRadianceIn(x, w)
//!   p = intersectScene(x, w);
//!   L = p.emittedLight(-w);
//!   wi, pdf = p.brdf.sampleDirection(-w);
//!   cpdf = continuationProbability(p.brdf, wi);     // try 2 only
//!   if (random01() < cpdf)                          // try 2 only
//!     L += EstRadianceIn(p, wi) * p.brdf(wi, -w) * costheta / pdf / cpdf;
//!   return L;
//! ```
//!
//! Light is found only where a ray happens to meet it: exactly 0 of point lights, and much noise of small lamps ("still extremely
//! noisy!"). Mirrors and glass are right.
//!
//! Gaps of the slides: the case that p is nothing; the recursion of try 1 has no end (the slide says so), hence the safety stop of
//! [`super::roulette`]; `continuationProbability` is left open, likewise.

use super::directions::{DIRECTIONS, Directions, GLASS};
use super::roulette::{Policy, Q, Roulette, STOP, spared};
use super::walk::{self, Walk};
use super::{depth_limit, unsampled_lights};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::IntegratorEntry;
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_math::Ray;
use irradiant_spectrum::SampledSpectrum;

/// Try 1 by name.
pub const TRY_1: IntegratorEntry = IntegratorEntry {
    name: "try1",
    promise: "recursion along sampled directions without end; light counts where it is met",
    source: "lecture A, A43 \"Try 1: Monte Carlo Sum over Paths\"",
    options: &[DIRECTIONS, GLASS, STOP],
    make: |options, max_depth| {
        let (directions, roulette) = (Directions::of(options), Roulette::none(options.count("stop")));
        Box::new(TryIntegrator { max_depth, directions, roulette })
    },
};

/// Try 2 by name.
pub const TRY_2: IntegratorEntry = IntegratorEntry {
    name: "try2",
    promise: "recursion along sampled directions, ended by Russian roulette; light counts where it is met",
    source: "lecture A, A50 \"Try 2: Russian Roulette Monte Carlo over Paths\"",
    options: &[DIRECTIONS, GLASS, Policy::Bsdf.option(), Q, spared(0), STOP],
    make: |options, max_depth| {
        Box::new(TryIntegrator { max_depth, directions: Directions::of(options), roulette: Roulette::of(options) })
    },
};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TryIntegrator {
    /// Scattering events at most.
    pub max_depth: Option<u32>,
    /// Where rays go.
    pub directions: Directions,
    /// When they end.
    pub roulette: Roulette,
}

impl Integrator for TryIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| {
            let eye = walk.camera_ray.ray;
            self.radiance_in(walk, &eye, 0, 1.0)
        });
    }

    fn limits(&self) -> Vec<Limit> {
        depth_limit(self.max_depth).chain(self.roulette.limit(self.max_depth)).chain([unsampled_lights()]).collect()
    }
}

impl TryIntegrator {
    /// The slides' `EstRadianceIn(x, w)`: what comes along a ray after `depth` events that left `carried` of its brightness.
    fn radiance_in(&self, walk: &mut Walk, ray: &Ray, depth: u32, carried: f32) -> SampledSpectrum {
        let mut radiance = SampledSpectrum::ZERO;
        let Some(p) = walk.look(ray, depth, |met| radiance += met.emitted) else { return radiance };
        if self.max_depth.is_some_and(|limit| depth >= limit) {
            return radiance;
        }
        if self.roulette.stops(depth) {
            walk.stats.stopped_paths += 1;
            return radiance;
        }
        let draws = walk.stream.scatter(depth);
        let Some(step) = self.directions.sample(&p, &draws) else { return radiance };
        let carried = carried * step.brightness;
        let survival = self.roulette.survival(depth, &step, carried);
        if draws.roulette < survival && carried > 0.0 {
            walk.scattered(depth + 1);
            let incoming = self.radiance_in(walk, &p.at.spawn_ray(step.wi), depth + 1, carried / survival);
            radiance += incoming * step.weight * (1.0 / survival);
        }
        radiance
    }
}
