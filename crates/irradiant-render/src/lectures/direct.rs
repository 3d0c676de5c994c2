//! Direct light (A24 to A27, A58, A59, B32): what the eye sees of lamps, and of surfaces lit by lamps alone (0 and 1 bounce, A55).
//!
//! - `technique=uniform`, A24 `DirectLightingSampleUniform`: pdf = 1/(2 pi). Where it meets a lamp depends on the lamp's size only.
//! - `technique=cosine`: the same with B29's second density.
//! - `technique=bsdf`, A25 `DirectLightingSampleBRDF`: exact for a mirror that shows a lamp.
//! - `technique=lights`, A26 `DirectLightingSampleLights`, with the options of A58, A59 and A27.
//! - `technique=balance` and `power`: light samples beside one BSDF sample, each weighed (B32).
//!
//! A24 and A25 ask `shadowIntersection(p, wi)` and then `intersect(p, wi)`. Read as "the first thing that the ray meets does not emit"
//! (A27) both are one ray here. They cannot meet a point light (A62): its light is exactly 0. Nor can A24 and A26 see a lamp
//! in a mirror.

use super::direct_light::{DirectLight, LIGHTS, Lights, SHADOW, Shadow};
use super::directions::{Deltas, DirectionPdf, Directions, GlassChoice};
use super::emission::{EmissionRule, Previous};
use super::walk::{self, Vertex, Walk};
use super::{SAMPLES, unsampled_lights};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER, OptionEntry, OptionRange, words};
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_spectrum::SampledSpectrum;

words! {
    /// How directions towards light are found.
    pub enum LightTechnique {
        /// By sampling lights (A26).
        Lights = "lights",
        /// Uniform over the hemisphere (A24).
        Uniform = "uniform",
        /// Cosine-weighted over the hemisphere (B29).
        Cosine = "cosine",
        /// By sampling the BSDF (A25).
        Bsdf = "bsdf",
        /// Lights and one BSDF sample, balance heuristic (B32).
        Balance = "balance",
        /// Lights and one BSDF sample, power heuristic (B32).
        Power = "power",
    }
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "direct",
    promise: "emission and direct light, by sampling directions, BSDFs, lights, or both",
    source: "lecture A, A24 to A27, A58, A59; lecture B, B32",
    options: &[
        OptionEntry {
            name: "technique",
            range: OptionRange::Word(LightTechnique::WORDS),
            default: LightTechnique::Lights.value(),
            doc: "how directions towards light are found (A21)",
        },
        OptionEntry {
            doc: "samples: of directions or the BSDF with those techniques; else of lights, N of one light each (A59) or M of each (A58)",
            ..SAMPLES
        },
        LIGHTS,
        SHADOW,
        LIGHT_SAMPLER,
    ],
    make: |options, max_depth| {
        Box::new(DirectIntegrator {
            technique: LightTechnique::of(options.word("technique")),
            lights: DirectLight::of(options),
            emission_only: max_depth == Some(0),
        })
    },
};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectIntegrator {
    /// How directions are found.
    pub technique: LightTechnique,
    /// How lights are sampled; its number of samples is also that of directions.
    pub lights: DirectLight,
    /// A depth limit of 0: no direct light.
    pub emission_only: bool,
}

impl Integrator for DirectIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| {
            let mut radiance = SampledSpectrum::ZERO;
            let eye = walk.camera_ray.ray;
            let seen = walk.look(&eye, 0, |met| radiance += met.emitted);
            match seen.filter(|_| !self.emission_only) {
                Some(p) => radiance + self.direct_light(walk, &p),
                None => radiance,
            }
        });
    }

    fn limits(&self) -> Vec<Limit> {
        let mut limits = vec![Limit::MaxDepth(if self.emission_only { 0 } else { 1 })];
        let lamps = || EmissionRule::Eye.limit();
        match self.technique {
            _ if self.emission_only => {}
            LightTechnique::Lights => limits.extend(lamps().into_iter().chain(self.lights.limit())),
            LightTechnique::Uniform | LightTechnique::Cosine => {
                limits.extend([unsampled_lights()].into_iter().chain(lamps()))
            }
            LightTechnique::Bsdf => limits.push(unsampled_lights()),
            LightTechnique::Balance | LightTechnique::Power => limits.extend(self.lights.limit()),
        }
        limits
    }
}

impl DirectIntegrator {
    fn direct_light(&self, walk: &mut Walk, p: &Vertex) -> SampledSpectrum {
        let by = |pdf, deltas| Directions { pdf, glass: GlassChoice::Fresnel, deltas };
        let bsdf = by(DirectionPdf::Bsdf, Deltas::Found);
        walk.scattered(1);
        match self.technique {
            LightTechnique::Uniform => self.by_directions(walk, p, &by(DirectionPdf::Uniform, Deltas::Missed)),
            LightTechnique::Cosine => self.by_directions(walk, p, &by(DirectionPdf::Cosine, Deltas::Missed)),
            LightTechnique::Bsdf => self.by_directions(walk, p, &bsdf),
            LightTechnique::Lights => {
                let draws = walk.stream.light(0);
                self.lights.estimate(walk, p, draws, EmissionRule::Eye, |_| 0.0)
            }
            LightTechnique::Balance => self.by_both(walk, p, &bsdf, EmissionRule::Balance),
            LightTechnique::Power => self.by_both(walk, p, &bsdf, EmissionRule::Power),
        }
    }

    /// A24 and A25: 1/N sum of L f cos / pdf over directions that meet light.
    fn by_directions(&self, walk: &mut Walk, p: &Vertex, directions: &Directions) -> SampledSpectrum {
        let mut sum = SampledSpectrum::ZERO;
        for i in 0..self.lights.samples {
            let draws = if i == 0 { walk.stream.scatter(0) } else { walk.another_scatter() };
            if let Some(step) = directions.sample(p, &draws) {
                walk.look(&p.at.spawn_ray(step.wi), 1, |met| sum += step.weight * met.emitted);
            }
        }
        sum / self.lights.samples as f32
    }

    /// B32: light samples and one direction, weighed against each other.
    fn by_both(&self, walk: &mut Walk, p: &Vertex, directions: &Directions, rule: EmissionRule) -> SampledSpectrum {
        let draws = walk.stream.light(0);
        let mut sum = self.lights.estimate(walk, p, draws, rule, |wi| directions.pdf(p, wi));
        if let Some(step) = directions.sample(p, &walk.stream.scatter(0)) {
            let previous = Previous { reference: p.at.reference(), pdf: step.pdf, specular: step.specular };
            let scene = walk.scene;
            walk.look(&p.at.spawn_ray(step.wi), 1, |met| {
                sum += step.weight * met.emitted * rule.weight(scene, met, Some(&previous), &self.lights);
            });
        }
        sum
    }
}

/// The plainest: one sample of one light.
impl Default for DirectLight {
    fn default() -> Self {
        Self { lights: Lights::One, samples: 1, shadow: Shadow::Segment }
    }
}
