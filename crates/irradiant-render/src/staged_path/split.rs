//! Several light samples at a vertex, as [`split_light`](crate::light_samples) takes them: the first of all paths, then the second of all.

use super::batch::{Batch, SpectrumLanes};
use super::kernels::Choose;
use super::lamps::Whose;
use crate::camera_samples::BatchSample;
use crate::integrator::RenderStats;
use crate::light_samples::{LightChoice, Reservoir, all_are_sampled};
use irradiant_core::interaction::LightId;
use irradiant_core::light::TargetLanes;
use irradiant_core::light_sampler::{PickedLight, PointLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{Floats, LANES};
use irradiant_spectrum::SampledSpectrum;

/// The light samples that were chosen among several, one of each path.
#[repr(C, align(64))]
pub(super) struct ChosenLanes {
    /// Sums and numbers by which they are chosen ([`Reservoir`]).
    number: Floats,
    total: Floats,
    kept: Floats,
    pub targets: TargetLanes,
    pub picked: [u32; LANES],
    pub is_delta: [u32; LANES],
    pub brought: SpectrumLanes,
}

impl ChosenLanes {
    pub const NONE: Self = Self {
        number: [0.0; LANES],
        total: [0.0; LANES],
        kept: [0.0; LANES],
        targets: TargetLanes::NONE,
        picked: [0; LANES],
        is_delta: [0; LANES],
        brought: SpectrumLanes::ZERO,
    };

    /// None yet.
    fn begin(&mut self, n: usize, numbers: &Floats) {
        self.number[..n].copy_from_slice(&numbers[..n]);
        self.total[..n].fill(0.0);
        self.kept[..n].fill(0.0);
    }

    /// [`Reservoir::takes`] of a lane.
    #[inline(always)]
    pub fn takes(&mut self, i: usize, weight: f32) -> bool {
        let mut reservoir = Reservoir { number: self.number[i], total: self.total[i], kept: self.kept[i] };
        let is_taken = reservoir.takes(weight);
        (self.number[i], self.total[i], self.kept[i]) = (reservoir.number, reservoir.total, reservoir.kept);
        is_taken
    }

    /// Whether there is one.
    #[inline(always)]
    pub fn has_one(&self, i: usize) -> bool {
        self.kept[i] != 0.0
    }

    /// What it brings.
    #[inline(always)]
    pub fn light(&self, i: usize) -> SampledSpectrum {
        let reservoir = Reservoir { number: self.number[i], total: self.total[i], kept: self.kept[i] };
        self.brought.at(i) * reservoir.stands_for()
    }
}

impl Batch {
    /// Light samples of each path, the choice of the light split into several strata.
    pub(super) fn split_light_samples(
        &mut self,
        n: usize,
        choice: LightChoice,
        scene: &Scene,
        samples: &[BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        // A path's are added to each other first, since sums depend on the order.
        let mut sums = [SampledSpectrum::ZERO; LANES];
        let sums = &mut sums[..radiance.len()];
        self.seek_light(n);
        if choice.is_resampled {
            let [_, _, _, numbers] = &self.light.0;
            self.chosen.begin(n, numbers);
        }
        if all_are_sampled(scene, choice.splits) {
            let seeking = std::mem::take(&mut self.seeking);
            for light in 0..scene.lights.len() as u32 {
                for &i in &seeking {
                    self.pick(i as usize, PickedLight { id: LightId(light), pmf: 1.0 }, 1.0, choice);
                }
                self.next_light_samples(n, choice, scene, samples, sums, stats);
            }
            self.seeking = seeking;
        } else {
            let splits = choice.splits;
            self.pick_split(n, splits, scene);
            let most = self.light_counts[..n].iter().copied().max().unwrap_or(0);
            for k in 0..most {
                for i in 0..n {
                    self.pmf[i] = 0.0;
                    if k < self.light_counts[i] {
                        let (picked, times) = self.light_picks[i * splits as usize + k as usize];
                        self.pick(i, picked, times as f32 / splits as f32, choice);
                    }
                }
                self.next_light_samples(n, choice, scene, samples, sums, stats);
            }
        }
        if choice.is_resampled {
            self.test_light(n, Whose::Chosen, scene, samples, sums, stats);
        }
        for i in 0..n {
            let s = self.sample[i] as usize;
            radiance[s] += sums[s];
        }
    }

    /// One more light sample of each path that has picked a light: what it brings, or a candidate more to choose from.
    fn next_light_samples(
        &mut self,
        n: usize,
        choice: LightChoice,
        scene: &Scene,
        samples: &[BatchSample],
        sums: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        if !self.sample_picked(n, scene, samples) {
            return;
        }
        if choice.is_resampled {
            self.bring_alone();
            scene.geometry.level().run(Choose(self, n));
        } else {
            self.arriving_light(n, scene, samples, sums, stats);
        }
    }

    /// Puts a light into a lane that stands for a share of the strata.
    #[inline(always)]
    fn pick(&mut self, i: usize, picked: PickedLight, share: f32, choice: LightChoice) {
        (self.picked[i], self.pmf[i]) = (picked.id.0, picked.pmf);
        (self.light_times[i], self.light_share[i]) = (choice.tests_by_chance(picked.pmf), share);
    }

    /// The lights that the strata of each path that seeks light pick, as [`PickedLights`](crate::light_samples::PickedLights) has them.
    fn pick_split(&mut self, n: usize, splits: u32, scene: &Scene) {
        self.light_counts[..n].fill(0);
        self.light_picks.clear();
        self.light_picks.resize(n * splits as usize, (PickedLight { id: LightId(0), pmf: 0.0 }, 0));
        let level = scene.geometry.level();
        for stratum in 0..splits {
            for i in 0..n {
                self.light_pick[i] = self.light.pick_in_stratum(i, stratum, splits);
            }
            let at = PointLanes { p: &self.at.p, p_error: &self.at.p_error, n: &self.at.n, ns: &self.at.ns };
            let (picked, pmf) = (&mut self.picked, &mut self.pmf);
            scene.light_sampler.sample_lanes(level, &self.seeking, at, &self.light_pick, &mut self.tree, picked, pmf);
            for &i in &self.seeking {
                let i = i as usize;
                if !(self.pmf[i] > 0.0) {
                    continue;
                }
                let light = PickedLight { id: LightId(self.picked[i]), pmf: self.pmf[i] };
                let picks = &mut self.light_picks[i * splits as usize..(i + 1) * splits as usize];
                let count = self.light_counts[i] as usize;
                // Most samplers pick a light in strata side by side.
                match picks[..count].iter_mut().rev().find(|(known, _)| known.id == light.id) {
                    Some((_, times)) => *times += 1,
                    None => {
                        picks[count] = (light, 1);
                        self.light_counts[i] += 1;
                    }
                }
            }
        }
    }
}
