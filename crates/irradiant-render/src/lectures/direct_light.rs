//! Light that comes straight from sampled points of lights: one light with p_i (A26, A59), or all of them in turn (A58).
//!
//! A26's note: "only one random sample over all lights". A58 loops over all N lights with M samples each; A59 picks one with
//! probability p_i, whose weight is 1/(p_i p_L), and may average N such. A60 asks for one sample only of a light that is a point,
//! whatever M is. Which light is picked is the option `lightsampler` ("how would you importance sample intelligently?").
//! Another answer is [`Lights::Resampled`] (Talbot, Cline and Egbert 2005, "Importance resampling for global illumination").
//!
//! A27: `scene.shadowIntersection(p, wi)` has no end of the ray among its arguments. A24 and A25 then need it to mean "the first thing
//! in that direction does not emit", A26 "something is between p and the sampled point". Both are here ([`Shadow`]), and the reading
//! of a reader who takes it at its word, "something is in that direction": then the lamp is in its own way, and every area light
//! is dark, and every point light that has a wall behind it. Only the second is right in A26: with the first a lamp shines through others, and a wall behind a point light hides it.

use super::emission::EmissionRule;
use super::walk::{Vertex, Walk};
use crate::integrator::{Limit, SceneHas};
use crate::registry::{OptionEntry, OptionRange, Options, words};
use irradiant_core::bxdf::TransportMode;
use irradiant_core::interaction::{LightId, ReferencePoint};
use irradiant_core::light::LightSample;
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::sampler::LightDraws;
use irradiant_core::scene::Scene;
use irradiant_math::Vec3;
use irradiant_spectrum::SampledSpectrum;

words! {
    /// Which lights are sampled at a vertex.
    pub enum Lights {
        /// One, picked with p_i; `samples` times (A26, A59).
        One = "one",
        /// Each in turn, `samples` times, points once (A58, A60).
        All = "all",
        /// The best of `samples` candidates, each of one light picked with p_i: chosen at random by what it would bring if nothing stood in the way, with one shadow ray (A59).
        Resampled = "resampled",
    }
}

words! {
    /// What `shadowIntersection` asks (A27).
    pub enum Shadow {
        /// Is something between the surface and the sampled point? (A26).
        Segment = "segment",
        /// Is the first thing in that direction no emitter? Light behind a light shines through; biased (A24's meaning).
        FirstHit = "firsthit",
        /// Is anything in that direction? A lamp is in its own way and dark, and what stands behind a point light hides it (the call as it is written).
        Anything = "anything",
    }
}

pub(crate) const LIGHTS: OptionEntry = OptionEntry {
    name: "lights",
    range: OptionRange::Word(Lights::WORDS),
    default: Lights::One.value(),
    doc: "which lights are sampled at a vertex (A58, A59)",
};

pub(crate) const SHADOW: OptionEntry = OptionEntry {
    name: "shadow",
    range: OptionRange::Word(Shadow::WORDS),
    default: Shadow::Segment.value(),
    doc: "what a shadow ray asks (A27)",
};

/// How lights are sampled at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectLight {
    /// Which.
    pub lights: Lights,
    /// How often.
    pub samples: u32,
    /// What is in the way.
    pub shadow: Shadow,
}

impl DirectLight {
    /// As an entry's options `lights`, `samples` and `shadow` say.
    pub fn of(options: &Options) -> Self {
        Self {
            lights: Lights::of(options.word("lights")),
            samples: options.count("samples"),
            shadow: Shadow::of(options.word("shadow")),
        }
    }

    /// The slides' `DirectLightingSampleLights(p, wo)`; exactly 0 where all lobes are deltas (A62).
    ///
    /// `first` are the numbers of the first sample. `rule` and `direction_pdf` (of the next direction, per solid angle) say how a
    /// sample is weighed against finding the same light by chance.
    pub fn estimate(
        &self,
        walk: &mut Walk,
        p: &Vertex,
        first: LightDraws,
        rule: EmissionRule,
        direction_pdf: impl Fn(Vec3) -> f32,
    ) -> SampledSpectrum {
        let mut sum = SampledSpectrum::ZERO;
        if !p.bsdf.flags().is_non_specular() {
            return sum;
        }
        let mut first = Some(first);
        match self.lights {
            Lights::One => {
                for _ in 0..self.samples {
                    let draws = first.take().unwrap_or_else(|| walk.another_light());
                    let picked = walk.scene.light_sampler.sample(&p.at.reference(), draws.pick);
                    if let Some(PickedLight { id, pmf }) = picked {
                        sum += self.one_sample(walk, p, id, &draws, self.samples as f32 * pmf, rule, &direction_pdf);
                    }
                }
            }
            Lights::Resampled => sum = self.best_candidate(walk, p, first.take(), rule, &direction_pdf),
            Lights::All => {
                for i in 0..walk.scene.lights.as_slice().len() as u32 {
                    let id = LightId(i);
                    // All samples of a point are the same.
                    let samples = if walk.scene.lights.get(id).is_delta() { 1 } else { self.samples };
                    for _ in 0..samples {
                        let draws = first.take().unwrap_or_else(|| walk.another_light());
                        sum += self.one_sample(walk, p, id, &draws, samples as f32, rule, &direction_pdf);
                    }
                }
            }
        }
        sum
    }

    /// One sample of one light, of which there are `number` on average at this vertex: weight 1/(number p_L).
    fn one_sample(
        &self,
        walk: &mut Walk,
        p: &Vertex,
        light: LightId,
        draws: &LightDraws,
        number: f32,
        rule: EmissionRule,
        direction_pdf: &impl Fn(Vec3) -> f32,
    ) -> SampledSpectrum {
        match candidate(walk, p, light, draws, number, number, rule, direction_pdf) {
            Some(c) if !self.is_blocked(walk, p, &c.sample) => c.brings,
            _ => SampledSpectrum::ZERO,
        }
    }

    /// Resampling: of several candidates one is kept, in proportion to its brightness; it stands for the sum of all.
    fn best_candidate(
        &self,
        walk: &mut Walk,
        p: &Vertex,
        mut first: Option<LightDraws>,
        rule: EmissionRule,
        direction_pdf: &impl Fn(Vec3) -> f32,
    ) -> SampledSpectrum {
        let mut total = 0.0;
        let mut kept: Option<(Candidate, f32)> = None;
        for _ in 0..self.samples {
            let draws = first.take().unwrap_or_else(|| walk.another_light());
            let picked = walk.scene.light_sampler.sample(&p.at.reference(), draws.pick);
            let Some(PickedLight { id, pmf }) = picked else { continue };
            let number = self.samples as f32 * pmf;
            let Some(c) = candidate(walk, p, id, &draws, number, pmf, rule, direction_pdf) else { continue };
            let brightness = c.brings.average();
            total += brightness;
            if draws.resample * total < brightness {
                kept = Some((c, brightness));
            }
        }
        match kept {
            Some((c, brightness)) if !self.is_blocked(walk, p, &c.sample) => c.brings * (total / brightness),
            _ => SampledSpectrum::ZERO,
        }
    }

    /// The slides' `shadowIntersection`.
    fn is_blocked(&self, walk: &mut Walk, p: &Vertex, sample: &LightSample) -> bool {
        let scene = walk.scene;
        walk.stats.shadow_rays += 1;
        match self.shadow {
            Shadow::Segment => scene.is_occluded(&p.at, sample),
            Shadow::FirstHit => {
                let ray = p.at.spawn_ray(sample.wi);
                let first = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha());
                first.is_some_and(|hit| scene.geometry.interaction(&ray, &hit).light.is_none())
            }
            Shadow::Anything => scene.geometry.occluded(&p.at.spawn_ray(sample.wi), f32::INFINITY, &scene.alpha()),
        }
    }

    /// The density with which [`DirectLight::estimate`] finds a direction to `light` from `from`, all samples together, where one sample
    /// of that light has density `light_pdf`.
    pub fn density(&self, scene: &Scene, from: &ReferencePoint, light: LightId, light_pdf: f32) -> f32 {
        let chance = match self.lights {
            Lights::One => self.samples as f32 * scene.light_sampler.pmf(from, light),
            // The density of a candidate. That of the chosen one is not known; both techniques use the same weights, which is enough.
            Lights::Resampled => scene.light_sampler.pmf(from, light),
            Lights::All => self.samples as f32,
        };
        chance * light_pdf
    }

    /// What the shadow test does to the picture.
    pub fn limit(&self) -> Option<Limit> {
        match self.shadow {
            Shadow::Segment => None,
            Shadow::FirstHit => Some(Limit::Bias("shadow rays end at the first emitter".into())),
            Shadow::Anything => Some(Limit::Unfound(
                "lights that stand in front of something or of themselves",
                &[SceneHas::PlacedLights],
            )),
        }
    }
}

/// A light sample and what it brings if nothing is in the way, all weights included; not black.
struct Candidate {
    sample: LightSample,
    brings: SampledSpectrum,
}

/// Draws a point of a light, of which there are `number` on average at this vertex; `weighed` is their number for weights against
/// directions. `None` where it brings nothing.
fn candidate(
    walk: &Walk,
    p: &Vertex,
    light: LightId,
    draws: &LightDraws,
    number: f32,
    weighed: f32,
    rule: EmissionRule,
    direction_pdf: &impl Fn(Vec3) -> f32,
) -> Option<Candidate> {
    let scene = walk.scene;
    let sample = scene.lights.get(light).sample(&p.at.reference(), draws.uv, walk.lambda, rule.sample_mode())?;
    let f = p.bsdf.f(p.at.wo, sample.wi, TransportMode::Radiance) * p.bsdf.abs_cos(sample.wi);
    let arriving = sample.radiance * scene.opacity(&sample);
    let weight = match sample.is_delta {
        true => 1.0,
        false => rule.light_sample_weight(weighed * sample.pdf, direction_pdf(sample.wi)),
    };
    let brings = f * arriving * (weight / (number * sample.pdf));
    (!brings.is_black()).then_some(Candidate { sample, brings })
}
