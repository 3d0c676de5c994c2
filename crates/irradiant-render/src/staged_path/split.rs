//! Several light samples at a vertex, as [`split_light`](crate::light_samples) takes them: the first of all paths, then the second of all.

use super::batch::Batch;
use super::kernels::Weigh;
use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_samples::{PickedLights, all_are_sampled, samples_by_chance};
use crate::path::PathIntegrator;
use irradiant_core::interaction::LightId;
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::scene::Scene;
use irradiant_math::lanes::LANES;
use irradiant_spectrum::SampledSpectrum;

impl PathIntegrator {
    /// Light samples of each path, the choice of the light split into `splits` strata, more than one.
    pub(super) fn split_light_samples(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        splits: u32,
        scene: &Scene,
        samples: &[CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        // A path's are added to each other first, since sums depend on the order.
        let mut sums = [SampledSpectrum::ZERO; LANES];
        let sums = &mut sums[..radiance.len()];
        let level = scene.geometry.level();
        let mut round = |b: &mut Batch, pick: &dyn Fn(usize) -> Option<(PickedLight, f32)>| {
            let pick = |_: &Batch, i: usize| {
                pick(i).map(|(picked, share)| (picked, samples_by_chance(picked.pmf, splits), share))
            };
            if self.draw_lights(b, n, depth, scene, samples, sums, stats, pick) {
                level.run(Weigh(b, n));
                self.arriving_light(b, n, scene, sums, stats);
            }
        };
        if all_are_sampled(scene, splits) {
            for light in 0..scene.lights.len() {
                let picked = PickedLight { id: LightId(light as u32), pmf: 1.0 };
                round(b, &|_| Some((picked, 1.0)));
            }
        } else {
            let mut picks = std::mem::take(&mut b.light_picks);
            let mut begin = [0; LANES + 1];
            picks.clear();
            for i in 0..n {
                begin[i] = picks.len();
                if b.scatters(i) {
                    let draws = b.light.light_draws(i);
                    picks.extend(PickedLights::of(scene, &b.at.reference(i), &draws, splits).iter());
                }
            }
            begin[n] = picks.len();
            let most = (0..n).map(|i| begin[i + 1] - begin[i]).max().unwrap_or(0);
            for k in 0..most {
                round(b, &|i| picks[begin[i]..begin[i + 1]].get(k).copied());
            }
            b.light_picks = picks;
        }
        for i in 0..n {
            let s = b.sample[i] as usize;
            radiance[s] += sums[s];
        }
    }
}
