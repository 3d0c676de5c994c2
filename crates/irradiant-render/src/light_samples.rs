//! Light samples of the production estimators: light that arrives at a surface straight from sampled points of lights.
//!
//! One light is picked by the scene's light sampler. Or the choice is split (ledger A59): the interval of the number that picks is cut into
//! N equal strata, each picks a light, and each light that is picked is sampled once, whatever the number of strata it is in, all with the
//! same place on them. Where there is a stratum for each light, nothing is left to chance: each light is sampled once. A scene with one light costs
//! and brings what it does with one sample, stratification included.
//!
//! Of the lights that are picked, each is tested by a ray; or they are candidates, of which one is tested: by chance, in proportion to what each would
//! bring if nothing were in the way, so that one term, divided by its chance, stands for the sum (resampling: Talbot, Cline and Egbert 2005). Which pays
//! where is told in decision 8.

use crate::integrator::RenderStats;
use crate::path::power_heuristic;
use crate::record::{Contribution, PathRecorder, Technique};
use crate::shared_path::sky::{Glimpse, SharedSky};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::interaction::{Interaction, LightId, ReferencePoint};
use irradiant_core::light::{LightSample, PixelRun, SampleMode};
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::sampler::LightDraws;
use irradiant_core::scene::Scene;
use irradiant_math::Point2;
use irradiant_math::elementary::ONE_MINUS_EPSILON;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Strata of a choice at most.
pub(crate) const MOST_SPLITS: u32 = 64;

/// That so many strata can be had; options cannot say others, programs can.
pub(crate) fn check_splits(name: &str, splits: u32) -> Result<(), String> {
    match splits {
        1..=MOST_SPLITS => Ok(()),
        _ => Err(format!("{name} is {splits}; take 1 to {MOST_SPLITS}")),
    }
}

/// How lights are sampled at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LightChoice {
    /// Strata of the choice of a light, [`MOST_SPLITS`] at most.
    pub splits: u32,
    /// Whether the lights that these pick are candidates, of which one is tested; only where there are several of both.
    pub is_resampled: bool,
}

impl LightChoice {
    /// One light.
    pub const ONE: Self = Self { splits: 1, is_resampled: false };

    /// How often a light is tested at a vertex, as a weight: the average number where a sampler picks a light in strata side by side, a little
    /// more where it does not (`power`); of candidates, as if each were as good as the others.
    #[inline]
    pub fn tests_of(self, scene: &Scene, at: &ReferencePoint, light: LightId) -> f32 {
        let pmf = if all_are_sampled(scene, self.splits) { 1.0 } else { scene.light_sampler.pmf(at, light) };
        self.tests_by_chance(pmf)
    }

    /// As [`LightChoice::tests_of`], of a light that is picked with the chance `pmf`, 1 where all are.
    #[inline(always)]
    pub fn tests_by_chance(self, pmf: f32) -> f32 {
        let picks = (pmf * self.splits as f32).min(1.0);
        if self.is_resampled { picks / self.splits as f32 } else { picks }
    }
}

/// A sample of the light that arrives straight from lamps, unless something is in the way.
pub(crate) struct ArrivingLight {
    pub light: LightId,
    pub sample: LightSample,
    /// Its radiance where it arrives, W m^-2 sr^-1 nm^-1, opacity included.
    pub radiance: SampledSpectrum,
    /// The density with which it was drawn, all lights together, 1/sr.
    pub pdf: f32,
}

/// Picks a light and a point of it.
#[inline(always)]
pub(crate) fn pick_light(
    scene: &Scene,
    at: &Interaction,
    lambda: &Wavelengths,
    draws: &LightDraws,
) -> Option<ArrivingLight> {
    let picked = scene.light_sampler.sample(&at.reference(), draws.pick)?;
    sample_light(scene, at, lambda, picked, draws.uv, None)
}

/// A point of a light that has been picked.
#[inline(always)]
fn sample_light(
    scene: &Scene,
    at: &Interaction,
    lambda: &Wavelengths,
    PickedLight { id: light, pmf }: PickedLight,
    uv: Point2,
    prepared: Option<PixelRun>,
) -> Option<ArrivingLight> {
    let reference = at.reference();
    let mode = SampleMode::Compensated;
    let sample = match (scene.lights.sky(), prepared) {
        (Some((id, sky)), Some(run)) if id == light => sky.arrive(run, lambda, mode),
        _ => scene.lights.get(light).sample(&reference, uv, lambda, mode),
    }?;
    let radiance = sample.radiance * scene.opacity(&sample);
    Some(ArrivingLight { light, radiance, pdf: pmf * sample.pdf, sample })
}

/// Whether there is a stratum for each light.
#[inline]
pub(crate) fn all_are_sampled(scene: &Scene, splits: u32) -> bool {
    splits > 1 && scene.lights.len() <= splits as usize
}

/// Light that arrives straight from sampled points of sampled lights and is scattered along the path. Where the light `except` is picked, it
/// is not sampled: others see to it.
#[inline(always)]
pub(crate) fn direct_light<R: PathRecorder>(
    scene: &Scene,
    at: &Interaction,
    bsdf: &Bsdf,
    throughput: &SampledSpectrum,
    lambda: &Wavelengths,
    draws: &LightDraws,
    prepared: Option<PixelRun>,
    choice: LightChoice,
    except: Option<LightId>,
    depth: u32,
    stats: &mut RenderStats,
    recorder: &mut R,
) -> SampledSpectrum {
    if strata(scene, choice.splits) > 1 {
        return split_light(
            scene, at, bsdf, throughput, lambda, draws, prepared, choice, except, depth, stats, recorder,
        );
    }
    if let Some(picked) = scene.light_sampler.sample(&at.reference(), draws.pick)
        && except != Some(picked.id)
        && let Some(arriving) = sample_light(scene, at, lambda, picked, draws.uv, prepared)
        && let Some(brought) = scattered(at, bsdf, throughput, arriving, picked.pmf, 1.0)
    {
        return brought.unless_blocked(scene, at, 1.0, depth, stats, recorder);
    }
    SampledSpectrum::ZERO
}

/// As [`direct_light`], with several strata.
// Apart, so that the path loop holds one light sample's code only.
#[inline(never)]
fn split_light<R: PathRecorder>(
    scene: &Scene,
    at: &Interaction,
    bsdf: &Bsdf,
    throughput: &SampledSpectrum,
    lambda: &Wavelengths,
    draws: &LightDraws,
    prepared: Option<PixelRun>,
    choice: LightChoice,
    except: Option<LightId>,
    depth: u32,
    stats: &mut RenderStats,
    recorder: &mut R,
) -> SampledSpectrum {
    // What all bring, or the one that is chosen.
    let mut sum = SampledSpectrum::ZERO;
    let (mut chosen, mut reservoir) = (None, Reservoir::new(draws.resample));
    for (picked, share) in PickedLights::of(scene, &at.reference(), draws, choice.splits).iter() {
        let samples = choice.tests_by_chance(picked.pmf);
        if except != Some(picked.id)
            && let Some(arriving) = sample_light(scene, at, lambda, picked, draws.uv, prepared)
            && let Some(brought) = scattered(at, bsdf, throughput, arriving, samples, share)
        {
            if !choice.is_resampled {
                sum += brought.unless_blocked(scene, at, 1.0, depth, stats, recorder);
            } else if reservoir.takes(brought.radiance.average()) {
                chosen = Some(brought);
            }
        }
    }
    if let Some(chosen) = chosen {
        sum = chosen.unless_blocked(scene, at, reservoir.stands_for(), depth, stats, recorder);
    }
    sum
}

/// Of weights that come one after another, keeps one by chance, in proportion (one number serves for all: what is left of it after a decision
/// is spread over the whole interval again).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reservoir {
    /// In [0, 1), as far as rounding goes.
    pub number: f32,
    /// The sum of all weights, and the one that is kept.
    pub total: f32,
    pub kept: f32,
}

impl Reservoir {
    /// Empty.
    #[inline(always)]
    pub fn new(number: f32) -> Self {
        Self { number, total: 0.0, kept: 0.0 }
    }

    /// Adds a weight. Whether it is kept from now on. What is not a number is taken, and what comes after it, and neither stands for a number.
    #[inline(always)]
    pub fn takes(&mut self, weight: f32) -> bool {
        let total = self.total + weight;
        let chance = weight / total;
        let refuses = (weight == 0.0) | (self.number >= chance);
        let (from, width) = if refuses { (chance, 1.0 - chance) } else { (0.0, chance) };
        let number = ((self.number - from) / width).min(ONE_MINUS_EPSILON);
        self.number = if weight == 0.0 { self.number } else { number };
        (self.total, self.kept) = (total, if refuses { self.kept } else { weight });
        !refuses
    }

    /// The inverse of the chance with which what is kept was.
    #[inline(always)]
    pub fn stands_for(&self) -> f32 {
        self.total / self.kept
    }
}

/// The sample of the sky among the light samples at a first vertex, if there is one; whether it is seen is not known yet.
pub(crate) fn sky_sample(
    scene: &Scene,
    at: &Interaction,
    draws: &LightDraws,
    splits: u32,
    sky: &SharedSky,
) -> Option<Glimpse> {
    let picked = PickedLights::of(scene, &at.reference(), draws, splits);
    let (PickedLight { pmf, .. }, share) = picked.iter().find(|(picked, _)| picked.id == sky.id)?;
    Some(Glimpse { point: sky.sky.draw(draws.uv)?, factor: sky.factor(share, pmf), sees: false })
}

/// Strata into which a choice of light is split: one light needs no choice.
#[inline]
pub(crate) fn strata(scene: &Scene, splits: u32) -> u32 {
    if splits > 1 && scene.lights.as_slice().len() == 1 { 1 } else { splits }
}

/// The lights that are sampled at a vertex, each once.
pub(crate) struct PickedLights {
    strata: u32,
    /// With the number of strata that picked it.
    lights: [(PickedLight, u32); MOST_SPLITS as usize],
    count: usize,
}

impl PickedLights {
    /// Of `splits` strata, [`MOST_SPLITS`] at most.
    pub fn of(scene: &Scene, at: &ReferencePoint, draws: &LightDraws, splits: u32) -> Self {
        let none = (PickedLight { id: LightId(0), pmf: 0.0 }, 0);
        let strata = strata(scene, splits);
        let mut picked = Self { strata, lights: [none; MOST_SPLITS as usize], count: 0 };
        if all_are_sampled(scene, strata) {
            for (i, light) in picked.lights.iter_mut().take(scene.lights.len()).enumerate() {
                *light = (PickedLight { id: LightId(i as u32), pmf: 1.0 }, strata);
            }
            picked.count = scene.lights.len();
            return picked;
        }
        for stratum in 0..strata {
            let pick = draws.pick_in_stratum(stratum, strata);
            if let Some(light) = scene.light_sampler.sample(at, pick) {
                picked.add(light);
            }
        }
        picked
    }

    fn add(&mut self, light: PickedLight) {
        // Most samplers pick a light in strata side by side.
        let known = self.lights[..self.count].iter_mut().rev().find(|(known, _)| known.id == light.id);
        if let Some((_, times)) = known {
            *times += 1;
        } else if let Some(free) = self.lights.get_mut(self.count) {
            *free = (light, 1);
            self.count += 1;
        }
    }

    /// In the order in which they were picked, with the share of the strata that picked them.
    pub fn iter(&self) -> impl Iterator<Item = (PickedLight, f32)> {
        self.lights[..self.count].iter().map(|&(light, times)| (light, times as f32 / self.strata as f32))
    }
}

/// What one light sample brings along the path, unless something is in the way.
struct Brought {
    light: LightId,
    sample: LightSample,
    radiance: SampledSpectrum,
    mis_weight: f32,
    light_pdf: f32,
    bsdf_pdf: f32,
}

/// What one light sample would bring; it counts for the `share` of all samples at the vertex. Its light has `samples` there on average. Nothing
/// where no light comes from there or is scattered.
#[inline(always)]
fn scattered(
    at: &Interaction,
    bsdf: &Bsdf,
    throughput: &SampledSpectrum,
    arriving: ArrivingLight,
    samples: f32,
    share: f32,
) -> Option<Brought> {
    let ArrivingLight { light, sample, radiance: arriving, pdf } = arriving;
    let (f, bsdf_pdf) = bsdf.f_and_pdf(at.wo, sample.wi, TransportMode::Radiance);
    let f = f * sample.wi.dot(bsdf.frame.z).abs();
    if f.is_black() || arriving.is_black() {
        return None;
    }
    // Weigh against the chance that the BSDF would have found this light; it never finds a delta.
    let light_pdf = samples * sample.pdf;
    let mis_weight = if sample.is_delta { 1.0 } else { power_heuristic(light_pdf, bsdf_pdf) };
    let radiance = *throughput * f * arriving * (mis_weight * share / pdf);
    let bsdf_pdf = if sample.is_delta { 0.0 } else { bsdf_pdf };
    Some(Brought { light, sample, radiance, mis_weight, light_pdf, bsdf_pdf })
}

impl Brought {
    /// Tests it by a ray; it counts so many times.
    #[inline(always)]
    fn unless_blocked<R: PathRecorder>(
        self,
        scene: &Scene,
        at: &Interaction,
        times: f32,
        depth: u32,
        stats: &mut RenderStats,
        recorder: &mut R,
    ) -> SampledSpectrum {
        let Self { light, sample, radiance, mis_weight, light_pdf, bsdf_pdf } = self;
        stats.shadow_rays += 1;
        recorder.light_tested(depth, light);
        if scene.is_occluded(at, &sample) {
            return SampledSpectrum::ZERO;
        }
        let radiance = radiance * times;
        recorder.contribution(&Contribution {
            bounces: depth + 1,
            technique: Technique::LightSample,
            light,
            wi: sample.wi,
            radiance,
            mis_weight,
            light_pdf,
            bsdf_pdf,
        });
        radiance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each weight is kept in proportion, and counts for all: 10^5 marks side by side, so that shares are right to 10^-4. What is left of a mark
    /// is spread evenly again.
    #[test]
    fn reservoirs_keep_weights_in_proportion() {
        let weights = [0.0, 3.0, 0.5, 0.0, 1e-3, 6.5, 2.0];
        let sum: f32 = weights.iter().sum();
        let (n, mut kept, mut left) = (100_000, [0; 7], [0; 10]);
        for i in 0..n {
            let mut reservoir = Reservoir::new((i as f32 + 0.5) / n as f32);
            let mut last = None;
            for (k, weight) in weights.into_iter().enumerate() {
                if reservoir.takes(weight) {
                    last = Some(k);
                }
            }
            let last = last.expect("there are weights above 0");
            kept[last] += 1;
            left[(reservoir.number * 10.0) as usize] += 1;
            assert!((reservoir.stands_for() * weights[last] / sum - 1.0).abs() < 1e-5, "{reservoir:?}");
        }
        for (kept, weight) in kept.into_iter().zip(weights) {
            assert!((kept as f32 / n as f32 - weight / sum).abs() < 1e-4, "{kept} of {weight}");
        }
        assert!(left.into_iter().all(|left| (left as f32 / n as f32 - 0.1).abs() < 2e-3), "{left:?}");
        // Nothing has no reservoir, and what is wrong is not hidden.
        let mut empty = Reservoir::new(0.3);
        assert!(!empty.takes(0.0) && empty.kept == 0.0);
        for wrong in [f32::NAN, f32::INFINITY] {
            let mut reservoir = Reservoir::new(0.9);
            assert!(reservoir.takes(1.0) && reservoir.takes(wrong));
            reservoir.takes(2.0);
            assert!(!reservoir.stands_for().is_finite(), "{reservoir:?}");
        }
    }

    #[test]
    fn strata_are_1_to_64() {
        let check = |splits| check_splits("light_splits", splits);
        assert!(check(1).is_ok() && check(MOST_SPLITS).is_ok());
        assert!(check(0).is_err() && check(MOST_SPLITS + 1).is_err());
    }
}
