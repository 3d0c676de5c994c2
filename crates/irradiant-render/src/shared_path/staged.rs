//! Shared paths by the stages of `staged_path`, and the sum over a block in lanes: the same bits as one path at a time.

use super::blocks::{
    BLOCKS, Blocks, GiveByMetal, GiveEvenly, Leaving, Meet, Meeting, Model, Respond, Sixteen, Spectra, set_spectrum,
    spectrum,
};
use super::sky::SharedSky;
use super::sky_lanes::Outlooks;
use super::{Incoming, PIXELS, blocks_of, film_rgb, pixels_of};
use crate::camera_samples::{BatchSample, SampleBatch};
use crate::integrator::{RenderStats, Renderer};
use crate::path::PathIntegrator;
use crate::staged_path::{Batch, Plain};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Bxdf, TransportMode};
use irradiant_core::geometry::Hit;
use irradiant_core::interaction::{Interaction, TextureContext};
use irradiant_core::scene::Scene;
use irradiant_math::{Ray, Vec3};
use irradiant_spectrum::{Basis, N_WAVELENGTHS, SampledSpectrum, Wavelengths};

/// What is needed to join the vertices of a batch, kept from one to the next.
struct Joints {
    /// Of a block's second vertices with its first ones.
    meetings: Vec<Meeting>,
    rays: Vec<Ray>,
    ends: Vec<f32>,
    blocked: Vec<bool>,
    /// First vertices as materials see them, where they were asked for.
    places: Vec<Option<(Interaction, TextureContext)>>,
    /// What the sensor makes of light that is shared, for each block.
    shared: Vec<[Sixteen; 3]>,
}

/// Takes units' samples, many at a time, of a scene that has stages for `path`.
pub(super) fn renderer<'a>(path: PathIntegrator, sky_tests: u32, scene: &'a Scene) -> Renderer<'a> {
    let (mut batch, mut samples) = (Batch::new(scene), SampleBatch::new());
    let (mut blocks, mut joints, mut outlooks) = (Blocks::new(), Joints::new(), Outlooks::new());
    let sky = SharedSky::of(scene, &path, sky_tests);
    Box::new(move |unit, tile, stats| {
        let mut take = |samples: &mut SampleBatch| {
            samples.trace(scene, PIXELS);
            let (samples, begin) = samples.traced();
            let hits = begin.hits;
            stats.camera_rays += samples.iter().filter(|sample| sample.camera_weight.is_some()).count() as u64;
            path.shared_batch(&mut batch, scene, sky.as_ref(), samples, begin, &mut blocks, stats);
            if let Some(sky) = &sky {
                outlooks.share(scene, sky, samples, &mut blocks, stats);
            }
            joints.share(scene, samples, hits, &mut blocks, stats);
            for (s, sample) in samples.iter().enumerate() {
                let ([x, y], b) = (sample.pixel, &unit.bounds);
                if x < b.x0 || x >= b.x1 || y < b.y0 || y >= b.y1 {
                    continue;
                }
                stats.paths += 1;
                let [r, g, b] = &joints.shared[s / PIXELS];
                let shared = [r[s % PIXELS], g[s % PIXELS], b[s % PIXELS]];
                let rgb = film_rgb(scene, sample.camera_weight, &sample.lambda, blocks.own[s], shared)
                    .map(|c| c * sample.filter_weight);
                if !tile.add(x, y, rgb, &[]) {
                    stats.refuse(x, y, sample.index);
                }
            }
        };
        // Batches of about the same size.
        let all = blocks_of(&unit.bounds).count() * unit.samples.len();
        let together = PIXELS * all.div_ceil(all.div_ceil(BLOCKS).max(1));
        let mut n = 0;
        for block in blocks_of(&unit.bounds) {
            for index in unit.samples.clone() {
                for pixel in pixels_of(&block) {
                    n = samples.put(scene, pixel, index..index + 1);
                }
                if n == together {
                    take(&mut samples);
                    n = 0;
                }
            }
        }
        if n > 0 {
            take(&mut samples);
        }
    })
}

impl Joints {
    fn new() -> Self {
        Self {
            meetings: vec![Meeting::NONE; PIXELS],
            rays: Vec::new(),
            ends: Vec::new(),
            blocked: Vec::new(),
            places: Vec::new(),
            shared: Vec::new(),
        }
    }

    /// Brings the light of all second vertices to all first ones of their blocks.
    fn share(
        &mut self,
        scene: &Scene,
        samples: &[BatchSample],
        hits: &[Option<Hit>],
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) {
        self.shared.clear();
        self.shared.resize(samples.len().div_ceil(PIXELS), [[0.0; PIXELS]; 3]);
        if samples.iter().any(|sample| sample.lambda.basis != Basis::Rgb) {
            self.places.clear();
            self.places.resize(samples.len(), None);
        }
        for begin in (0..samples.len()).step_by(PIXELS) {
            self.rays.clear();
            let mut rays = [0; PIXELS + 1];
            for own in 0..PIXELS {
                self.join(scene, samples, hits, blocks, begin + own);
                rays[own + 1] = self.rays.len();
            }
            self.ends.clear();
            self.ends.resize(self.rays.len(), 1.0);
            self.blocked.clear();
            self.blocked.resize(self.rays.len(), false);
            // Those to one second vertex travel together, unless rays are sorted anyway.
            let all = [0, self.rays.len()];
            for of_one in if scene.geometry.sorts_rays() { &all[..] } else { &rays[..] }.windows(2).map(|w| w[0]..w[1])
            {
                let (rays, ends) = (&self.rays[of_one.clone()], &self.ends[of_one.clone()]);
                scene.geometry.occluded_batch(rays, ends, &scene.alpha(), &mut self.blocked[of_one]);
            }
            stats.shadow_rays += self.rays.len() as u64;
            for own in 0..PIXELS {
                let Some(second) = &blocks.seconds[begin + own] else { continue };
                let meeting = &mut self.meetings[own];
                let mut answers = self.blocked[rays[own]..rays[own + 1]].iter();
                for i in (0..PIXELS).filter(|i| *i != own) {
                    if meeting.is_joined[i] != 0 && answers.next() == Some(&true) {
                        meeting.is_joined[i] = 0;
                    }
                }
                let (lambda, shared) = (&samples[begin + own].lambda, &mut self.shared[begin / PIXELS]);
                give(scene, meeting, &second.light, blocks, lambda, shared);
            }
        }
    }

    /// Joins one second vertex, if there is one, to its block's first ones.
    fn join(&mut self, scene: &Scene, samples: &[BatchSample], hits: &[Option<Hit>], blocks: &mut Blocks, s: usize) {
        let Some(second) = &blocks.seconds[s] else { return };
        let (begin, own) = (s / PIXELS * PIXELS, s % PIXELS);
        let receivers = &mut blocks.receivers[s / PIXELS];
        let side = match second.light {
            Leaving::Evenly { normal, .. } => Some(normal),
            Leaving::By { .. } => None,
        };
        let lambda = &samples[s].lambda;
        // In the RGB basis wavelengths are always the same.
        let is_spectral = lambda.basis != Basis::Rgb;
        let mut is_known = [!is_spectral; PIXELS];
        if is_spectral {
            let mut last = None;
            for i in 0..PIXELS {
                let Some(material) = receivers.materials[i].filter(|_| receivers.models[i] == Model::Plain) else {
                    continue;
                };
                let plain = match last {
                    Some((known, plain)) if known == material => plain,
                    _ => Plain::of(scene, material, lambda),
                };
                last = Some((material, plain));
                is_known[i] = match plain {
                    Plain::Diffuse(reflectance) => {
                        receivers.set_diffuse(i, reflectance);
                        true
                    }
                    Plain::Metal(metal) => {
                        receivers.set_metal(i, &metal);
                        true
                    }
                    Plain::Other => false,
                };
            }
        }
        let meeting = &mut self.meetings[own];
        scene.geometry.level().run(Meet { receivers, place: &second.place, side, out: meeting });
        meeting.set(own, second.carried * second.pdf, second.pdf);
        meeting.wo.set(own, second.wo.to_array());
        for i in (0..PIXELS).filter(|i| *i != own) {
            let r = begin + i;
            let is_alone = match receivers.models[i] {
                Model::Nothing => false,
                Model::Alone(_) => true,
                Model::Plain => !is_known[i] && samples[r].lambda != *lambda,
            };
            if is_alone && meeting.leaves[i] != 0 {
                let wi = -meeting.wo.vector(i);
                let scattered = match receivers.models[i] {
                    Model::Alone(k) if samples[r].lambda == *lambda => {
                        let (bsdf, wo) = &blocks.alone[k as usize];
                        let (f, pdf) = bsdf.f_and_pdf(*wo, wi, TransportMode::Radiance);
                        Some((f * bsdf.abs_cos(wi), pdf))
                    }
                    _ => scattered_at(scene, &samples[r], hits[r].as_ref(), &mut self.places[r], lambda, wi),
                };
                let (f_cos, pdf) = scattered.unwrap_or((SampledSpectrum::ZERO, 0.0));
                meeting.set(i, f_cos, pdf);
            }
            if meeting.is_joined[i] != 0 {
                self.rays.push(Ray::new(meeting.o.point(i), meeting.d.vector(i), receivers.time));
            }
        }
    }
}

/// What a first vertex scatters along its path of light that comes from `wi`, with the cosine, and the density with which it finds it, 1/sr,
/// for another path's wavelengths.
fn scattered_at(
    scene: &Scene,
    sample: &BatchSample,
    hit: Option<&Hit>,
    place: &mut Option<(Interaction, TextureContext)>,
    lambda: &Wavelengths,
    wi: Vec3,
) -> Option<(SampledSpectrum, f32)> {
    if place.is_none() {
        let camera_ray = sample.camera_ray(scene)?;
        let at = scene.geometry.interaction(&camera_ray.ray, hit?);
        *place = Some((at, scene.texture_context(&at, Some(&camera_ray))));
    }
    let (at, footprint) = place.as_ref()?;
    let stream = sample.stream(scene);
    let (mix, mut lambda) = (stream.mix(0), *lambda);
    let bsdf = scene.materials.bsdf(at.material, &scene.textures, at, footprint, &mut lambda, mix)?;
    let (f, pdf) = bsdf.f_and_pdf(at.wo, wi, TransportMode::Radiance);
    Some((f * bsdf.abs_cos(wi), pdf))
}

/// Adds to `sums` what the sensor makes of the light that a second vertex gives to the first ones that it is joined to.
fn give(
    scene: &Scene,
    meeting: &Meeting,
    light: &Leaving,
    blocks: &Blocks,
    lambda: &Wavelengths,
    sums: &mut [Sixteen; 3],
) {
    let level = scene.geometry.level();
    let mut given = [[0.0; PIXELS]; N_WAVELENGTHS];
    let mut respond = |radiance: &Spectra| match lambda.basis {
        Basis::Rgb => {
            let scale = scene.sensor_response(SampledSpectrum::ONE, lambda);
            level.run(Respond { radiance, scale, sums });
        }
        Basis::Spectral => {
            for i in (0..PIXELS).filter(|i| meeting.is_joined[*i] != 0) {
                let response = scene.sensor_response(spectrum(radiance, i), lambda);
                (0..3).for_each(|c| sums[c][i] += response[c]);
            }
        }
    };
    match light {
        Leaving::Evenly { radiance, .. } => {
            level.run(GiveEvenly { meeting, radiance: *radiance, out: &mut given });
            respond(&given);
        }
        Leaving::By { bsdf, incoming } => {
            let bsdf = &blocks.bsdfs[*bsdf as usize];
            for (_, light) in &blocks.incoming[incoming.clone()] {
                match &bsdf.bxdf {
                    Bxdf::Conductor(metal) => {
                        level.run(GiveByMetal { meeting, frame: &bsdf.frame, metal, light, out: &mut given });
                    }
                    _ => give_alone(meeting, bsdf, light, &mut given),
                }
                respond(&given);
            }
        }
    }
}

/// As [`GiveByMetal`], of any model.
fn give_alone(meeting: &Meeting, bsdf: &Bsdf, light: &Incoming, given: &mut Spectra) {
    let mut f = [SampledSpectrum::ZERO; PIXELS];
    let mut total = 0.0;
    for i in (0..PIXELS).filter(|i| meeting.is_joined[*i] != 0) {
        let (value, pdf) = bsdf.f_and_pdf(meeting.wo.vector(i), light.wi, TransportMode::Radiance);
        f[i] = value;
        let pdf = if light.found_by_bsdf && !value.is_black() { pdf } else { 0.0 };
        total += meeting.pdf[i] * (light.light_pdf + pdf);
    }
    let is_any = total > 0.0;
    let radiance = light.radiance * (bsdf.abs_cos(light.wi) / total);
    for i in 0..PIXELS {
        let is_joined = is_any && meeting.is_joined[i] != 0;
        let value = if is_joined { spectrum(&meeting.f, i) * f[i] * radiance } else { SampledSpectrum::ZERO };
        set_spectrum(given, i, value);
    }
}
