//! One path for each length (B19, B20): a sum of integrals, one for the paths of each length, each by a path of its own. A path of
//! length k is built in k - 1 steps, then a light is sampled from its last vertex.
//!
//! Lecture B counts length as lecture A counts bounces: length 0 is emission, length 1 direct light. (Its figure of lengths 3 to 7
//! counts vertices.)
//!
//! A path of length k needs k - 1 steps and a shadow ray, so lengths up to n cost O(n^2) rays; [`super::iterative`] reuses each
//! beginning of one path for O(n) (B22). The statistics count both.
//!
//! The slides leave open where the sum ends ("what should be the maximum path length?" is asked of the reused path). Here roulette is
//! played for each length in turn: the lengths after it come with probability 1 - q and weight 1/(1 - q). Policies that look at
//! what a path carries do not apply, since the next length is another path.
//!
//! With `emission=specular` the last vertex also sends a ray, for lamps that its mirror shows; as the slide has it (`never`) it does
//! not.

use super::direct_light::{DirectLight, LIGHTS, SHADOW};
use super::directions::{DIRECTIONS, Directions, GLASS};
use super::emission::{EmissionRule, Previous};
use super::roulette::{Q, spared};
use super::walk::{self, Vertex, Walk};
use super::{SAMPLES, depth_limit};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER};
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_spectrum::SampledSpectrum;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "perlength",
    promise: "a path of its own for each length, with a light sample at its end; as printed, no emission counts",
    source: "lecture B, B19, B20 \"Construct random path\"",
    options: &[EmissionRule::Never.option(), LIGHTS, SAMPLES, SHADOW, LIGHT_SAMPLER, DIRECTIONS, GLASS, Q, spared(2)],
    make: |options, max_depth| {
        Box::new(PerLengthIntegrator {
            max_depth,
            emission: EmissionRule::of(options.word("emission")),
            lights: DirectLight::of(options),
            directions: Directions::of(options),
            q: options.number("q"),
            spared: options.count("spared"),
        })
    },
};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerLengthIntegrator {
    /// Greatest length.
    pub max_depth: Option<u32>,
    /// When light counts that a ray meets.
    pub emission: EmissionRule,
    /// How lights are sampled.
    pub lights: DirectLight,
    /// Where rays go.
    pub directions: Directions,
    /// The chance to end the sum after a length; not played if there is a greatest one.
    pub q: f32,
    /// First lengths after which it does not end.
    pub spared: u32,
}

impl Integrator for PerLengthIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| self.sum_over_lengths(walk));
    }

    fn limits(&self) -> Vec<Limit> {
        depth_limit(self.max_depth)
            .chain(self.emission.limit())
            .chain(self.lights.limit())
            .chain(Limit::caustics_of_delta_lights(self.max_depth))
            .collect()
    }
}

impl PerLengthIntegrator {
    fn sum_over_lengths(&self, walk: &mut Walk) -> SampledSpectrum {
        let scene = walk.scene;
        let eye = walk.camera_ray.ray;
        let mut sum = SampledSpectrum::ZERO;
        walk.look(&eye, 0, |met| sum += met.emitted * self.emission.weight(scene, met, None, &self.lights));
        let mut weight = 1.0;
        for length in 1u32.. {
            if self.max_depth.is_some_and(|most| length > most) {
                break;
            }
            if self.max_depth.is_none() && length > self.spared {
                if walk.another_scatter().roulette < self.q {
                    break;
                }
                weight /= 1.0 - self.q;
            }
            sum += self.path_of_length(walk, length) * weight;
        }
        sum
    }

    /// Radiance by one random path of `length` scattering events.
    fn path_of_length(&self, walk: &mut Walk, length: u32) -> SampledSpectrum {
        let scene = walk.scene;
        let mut ray = walk.camera_ray.ray;
        let mut alpha = SampledSpectrum::ONE;
        walk.stats.camera_rays += 1;
        for k in 0..length {
            let Some(p) = walk.look(&ray, k, |_| {}) else { break };
            let is_last = k + 1 == length;
            if is_last {
                let draws = walk.another_light();
                let lit = self.lights.estimate(walk, &p, draws, self.emission, |wi| self.directions.pdf(&p, wi));
                return alpha * (lit + self.met_from(walk, &p, length, scene));
            }
            let draws = walk.another_scatter();
            let Some(step) = self.directions.sample(&p, &draws) else { break };
            walk.scattered(k + 1);
            alpha *= step.weight;
            if alpha.is_black() {
                break;
            }
            ray = p.at.spawn_ray(step.wi);
        }
        SampledSpectrum::ZERO
    }

    /// Lamps that the last vertex meets by a direction of its own, where the rule lets them count.
    fn met_from(&self, walk: &mut Walk, p: &Vertex, length: u32, scene: &Scene) -> SampledSpectrum {
        let mut sum = SampledSpectrum::ZERO;
        if matches!(self.emission, EmissionRule::Never | EmissionRule::Eye) {
            return sum;
        }
        let draws = walk.another_scatter();
        if let Some(step) = self.directions.sample(p, &draws) {
            let previous = Previous { reference: p.at.reference(), pdf: step.pdf, specular: step.specular };
            walk.scattered(length);
            walk.look(&p.at.spawn_ray(step.wi), length, |met| {
                sum += step.weight * met.emitted * self.emission.weight(scene, met, Some(&previous), &self.lights);
            });
        }
        sum
    }
}
