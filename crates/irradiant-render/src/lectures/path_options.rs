//! What can be set on the lectures' two path tracers, [`super::partitioned`] and [`super::iterative`], and what follows from it.

use super::direct_light::{DirectLight, LIGHTS, SHADOW};
use super::directions::{DIRECTIONS, Directions, GLASS};
use super::emission::EmissionRule;
use super::roulette::{Policy, Q, Roulette, STOP, spared};
use super::walk::Walk;
use super::{SAMPLES, depth_limit};
use crate::integrator::Limit;
use crate::registry::{LIGHT_SAMPLER, OptionEntry, Options};

/// What can be set on the lectures' path tracers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathOptions {
    /// Scattering events at most.
    pub max_depth: Option<u32>,
    /// When light counts that a ray meets.
    pub emission: EmissionRule,
    /// How lights are sampled.
    pub lights: DirectLight,
    /// Where rays go.
    pub directions: Directions,
    /// When they end.
    pub roulette: Roulette,
}

impl PathOptions {
    /// The options, with the defaults of a slide.
    pub(crate) const fn entries(emission: EmissionRule, roulette: Policy, unplayed: u32) -> [OptionEntry; 11] {
        [
            emission.option(),
            LIGHTS,
            SAMPLES,
            SHADOW,
            LIGHT_SAMPLER,
            DIRECTIONS,
            GLASS,
            roulette.option(),
            Q,
            spared(unplayed),
            STOP,
        ]
    }

    /// As an entry's options say.
    pub fn of(options: &Options, max_depth: Option<u32>) -> Self {
        Self {
            max_depth,
            emission: EmissionRule::of(options.word("emission")),
            lights: DirectLight::of(options),
            directions: Directions::of(options),
            roulette: Roulette::of(options),
        }
    }

    /// What they leave out or change.
    pub fn limits(&self) -> Vec<Limit> {
        depth_limit(self.max_depth)
            .chain(self.roulette.limit(self.max_depth))
            .chain(self.emission.limit())
            .chain(self.lights.limit())
            .chain(Limit::caustics_of_delta_lights(self.max_depth))
            .collect()
    }

    /// Whether scattering is cut off after `depth` events; counts the paths that the safety stop ends.
    pub fn ends(&self, walk: &mut Walk, depth: u32) -> bool {
        let stopped = self.roulette.stops(depth) && self.max_depth.is_none_or(|limit| depth < limit);
        walk.stats.stopped_paths += u64::from(stopped);
        stopped || self.max_depth.is_some_and(|limit| depth >= limit)
    }
}
