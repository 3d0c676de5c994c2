//! What a depth limit leaves out: an estimate from a few paths without limit.

use crate::camera_samples::camera_sample;
use crate::integrator::RenderStats;
use crate::path::PathIntegrator;
use crate::record::{Contribution, PathRecorder};
use irradiant_core::scene::Scene;
use irradiant_math::hash::mix64;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Light after more scattering events than a limit allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissingLight {
    /// Its luminance over that of what the limit leaves.
    pub share: f64,
    /// One standard error of `share`, about. Not to be trusted where few paths found light beyond the limit.
    pub standard_error: f64,
    /// Paths followed.
    pub paths: u64,
    /// Of them: those that found light beyond the limit.
    pub found: u64,
}

/// Sorts a path's contributions by the limit.
struct Split {
    max_depth: u32,
    within: SampledSpectrum,
    beyond: SampledSpectrum,
}

impl PathRecorder for Split {
    fn begin(&mut self, _lambda: &Wavelengths) {
        (self.within, self.beyond) = (SampledSpectrum::ZERO, SampledSpectrum::ZERO);
    }

    fn contribution(&mut self, c: &Contribution) {
        if c.bounces > self.max_depth {
            self.beyond += c.radiance;
        } else {
            self.within += c.radiance;
        }
    }
}

/// Estimates what `path`'s limit leaves out, from `paths` of the picture's own samples, in pixels drawn evenly, followed
/// without limit. `None` without a limit, or where these paths find no light. A pure function of its arguments.
pub fn missing_light(scene: &Scene, path: &PathIntegrator, paths: u32) -> Option<MissingLight> {
    let max_depth = path.max_depth?;
    let unlimited = PathIntegrator { max_depth: None, ..*path };
    let bounds = scene.bounds();
    let mut stats = RenderStats::default();
    let mut split = Split { max_depth, within: SampledSpectrum::ZERO, beyond: SampledSpectrum::ZERO };
    let mut pairs = Vec::with_capacity(paths as usize);
    for i in 0..u64::from(paths) {
        let bits = mix64(i ^ 0x7a11_0f1e_a5ed_0b1c);
        let at = (bits >> 32) as usize % bounds.area().max(1);
        let pixel = [bounds.x0 + (at % bounds.width()) as i32, bounds.y0 + (at / bounds.width()) as i32];
        let sample = camera_sample(scene, pixel, bits as u32 % scene.samples_per_pixel);
        let mut pair = [0.0; 2];
        if let Some(camera_ray) = &sample.camera_ray {
            let mut lambda = sample.lambda;
            let stream = &sample.stream;
            unlimited.radiance(scene, camera_ray, stream, &mut lambda, &mut [], &mut stats, &mut split);
            let weight = camera_ray.weight * sample.filter_weight;
            pair = [split.within, split.beyond].map(|radiance| {
                let rgb = scene.film_rgb_of_part(radiance * weight, &lambda);
                f64::from(scene.color_space().luminance(rgb))
            });
        }
        if pair.iter().all(|y| y.is_finite()) {
            pairs.push(pair);
        }
    }
    // A ratio of means, its error by the usual linearisation.
    let sum = |c: usize| pairs.iter().map(|p| p[c]).sum::<f64>();
    let (within, beyond) = (sum(0), sum(1));
    if !(within > 0.0) {
        return None;
    }
    let share = beyond / within;
    let residual: f64 = pairs.iter().map(|p| (p[1] - share * p[0]) * (p[1] - share * p[0])).sum();
    let found = pairs.iter().filter(|p| p[1] > 0.0).count() as u64;
    Some(MissingLight { share, standard_error: residual.sqrt() / within, paths: pairs.len() as u64, found })
}
