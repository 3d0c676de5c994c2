//! Shared paths by the stages of `staged_path`, and the sum over a block in lanes: the same bits as one path at a time.

use super::blocks::{BLOCKS, Blocks, Lobes, Meet, Meeting, Mirror, Model, NOWHERE, Receivers, Three};
use super::{Incoming, PIXELS, Scattered, SharedPathIntegrator, blocks_of, film_rgb, samples_of_block};
use crate::camera_samples::{CameraSample, gather};
use crate::integrator::{RenderStats, WorkUnit};
use crate::path::PathIntegrator;
use crate::staged_path::{Batch, Plain};
use irradiant_core::bxdf::{Bxdf, TransportMode};
use irradiant_core::film::FilmTile;
use irradiant_core::geometry::{Hit, Level};
use irradiant_core::interaction::{Interaction, TextureContext};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::LANES;
use irradiant_math::{Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

/// A first vertex and a second one.
struct Pair {
    receiver: u8,
    /// Whether they are of one path.
    is_own: bool,
    /// Density with which the receiver's BSDF finds the second vertex, per area.
    pdf: f32,
    /// What the light there is multiplied with on its way to the camera.
    f: SampledSpectrum,
    /// From the second to the first.
    wo: Vec3,
}

/// A second vertex with those that see it.
struct Giver {
    sample: usize,
    pairs: Range<usize>,
    rays: Range<usize>,
}

/// What batches need not allocate anew.
struct Joints {
    meeting: Meeting,
    pairs: Vec<Pair>,
    givers: Vec<Giver>,
    rays: Vec<Ray>,
    ends: Vec<f32>,
    blocked: Vec<bool>,
    /// First vertices as materials see them, where they were asked for.
    places: Vec<Option<(Interaction, TextureContext)>>,
    /// What the sensor makes of light that is shared, for each sample.
    shared: Vec<[f32; 3]>,
}

impl SharedPathIntegrator {
    /// Takes a unit's samples, many at a time.
    pub(super) fn render_in_batches(
        &self,
        path: &PathIntegrator,
        scene: &Scene,
        unit: &WorkUnit,
        tile: &mut FilmTile,
        stats: &mut RenderStats,
    ) {
        let mut batch = Batch::new(scene);
        let mut blocks = Blocks::new();
        let mut joints = Joints {
            meeting: Meeting::NONE,
            pairs: Vec::new(),
            givers: Vec::new(),
            rays: Vec::new(),
            ends: Vec::new(),
            blocked: Vec::new(),
            places: Vec::new(),
            shared: Vec::new(),
        };
        let mut samples: Vec<CameraSample> = Vec::with_capacity(BLOCKS * PIXELS);
        let mut hits = [None; LANES];
        let mut take = |samples: &mut Vec<CameraSample>| {
            gather(samples, &mut joints.rays, &mut joints.ends);
            let hits = &mut hits[..samples.len()];
            scene.geometry.intersect_batch(&joints.rays, &joints.ends, &scene.alpha(), hits);
            stats.camera_rays += samples.iter().filter(|sample| sample.camera_ray.is_some()).count() as u64;
            path.shared_batch(&mut batch, scene, samples, hits, &mut blocks, stats);
            joints.share(scene, samples, hits, &blocks, stats);
            for (s, sample) in samples.iter().enumerate() {
                let ([x, y], b) = (sample.pixel, &unit.bounds);
                if x < b.x0 || x >= b.x1 || y < b.y0 || y >= b.y1 {
                    continue;
                }
                stats.paths += 1;
                let rgb = film_rgb(scene, sample, &sample.lambda, blocks.own[s], joints.shared[s]);
                if !tile.add(x, y, rgb, &[]) {
                    stats.refuse(x, y, sample.index);
                }
            }
            samples.clear();
        };
        for block in blocks_of(&unit.bounds) {
            for index in unit.samples.clone() {
                samples.extend(samples_of_block(scene, &block, index));
                if samples.len() == BLOCKS * PIXELS {
                    take(&mut samples);
                }
            }
        }
        take(&mut samples);
    }
}

impl Joints {
    /// Brings the light of all second vertices to all first ones of their blocks.
    fn share(
        &mut self,
        scene: &Scene,
        samples: &[CameraSample],
        hits: &[Option<Hit>],
        blocks: &Blocks,
        stats: &mut RenderStats,
    ) {
        self.shared.clear();
        self.shared.resize(samples.len(), [0.0; 3]);
        self.places.clear();
        self.places.resize(samples.len(), None);
        self.pairs.clear();
        self.givers.clear();
        self.rays.clear();
        for s in 0..samples.len() {
            self.join(scene, samples, hits, blocks, s);
        }
        self.ends.clear();
        self.ends.resize(self.rays.len(), 1.0);
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        for giver in &self.givers {
            let these = giver.rays.clone();
            let blocked = &mut self.blocked[these.clone()];
            scene.geometry.occluded_batch(&self.rays[these.clone()], &self.ends[these], &scene.alpha(), blocked);
        }
        stats.shadow_rays += self.rays.len() as u64;
        let level = scene.geometry.level();
        for giver in &self.givers {
            let Some(second) = &blocks.seconds[giver.sample] else { continue };
            let lambda = &samples[giver.sample].lambda;
            let shared = &mut self.shared[giver.sample / PIXELS * PIXELS..];
            let mut answers = self.blocked[giver.rays.clone()].iter();
            let mut seen: [&Pair; PIXELS] = [&NO_PAIR; PIXELS];
            let mut n = 0;
            for pair in &self.pairs[giver.pairs.clone()] {
                if pair.is_own || answers.next() != Some(&true) {
                    seen[n] = pair;
                    n += 1;
                }
            }
            give(&second.light, &seen[..n], &blocks.incoming, level, |receiver, radiance| {
                let response = scene.sensor_response(radiance, lambda);
                (0..3).for_each(|c| shared[receiver][c] += response[c]);
            });
        }
    }

    /// Joins one second vertex, if there is one, to its block's first ones.
    fn join(&mut self, scene: &Scene, samples: &[CameraSample], hits: &[Option<Hit>], blocks: &Blocks, s: usize) {
        let Some(second) = &blocks.seconds[s] else { return };
        let (block, own) = (s / PIXELS, s % PIXELS);
        let receivers = &blocks.receivers[block];
        let side = match second.light {
            Scattered::Evenly { normal, .. } => Some(normal),
            Scattered::By { .. } => None,
        };
        let meeting = &mut self.meeting;
        scene.geometry.level().run(Meet { receivers, place: &second.place, side, out: meeting });
        let (first_pair, first_ray) = (self.pairs.len(), self.rays.len());
        for i in 0..PIXELS {
            let (there, wi) = (meeting.there[i], meeting.wi.vector(i));
            let (f_cos, pdf, wo) = if i == own {
                (second.carried * second.pdf, second.pdf, second.wo)
            } else {
                if meeting.leaves[i] == 0 {
                    continue;
                }
                let r = block * PIXELS + i;
                let scattered = if samples[s].lambda == samples[r].lambda {
                    scattered(receivers, i, meeting, blocks)
                } else {
                    scattered_at(
                        receivers,
                        i,
                        meeting,
                        scene,
                        &samples[r],
                        &hits[r],
                        &mut self.places[r],
                        &samples[s].lambda,
                    )
                };
                let Some((f_cos, pdf)) = scattered else { continue };
                (f_cos, pdf, -wi)
            };
            let pdf = pdf * there;
            // Directions in which nothing is scattered are never drawn.
            if !(pdf > 0.0) || !pdf.is_finite() || f_cos.is_black() {
                continue;
            }
            self.pairs.push(Pair { receiver: i as u8, is_own: i == own, pdf, f: f_cos * there, wo });
            if i != own {
                self.rays.push(Ray::new(meeting.o.point(i), meeting.d.vector(i), receivers.time));
            }
        }
        let (pairs, rays) = (first_pair..self.pairs.len(), first_ray..self.rays.len());
        self.givers.push(Giver { sample: s, pairs, rays });
    }
}

const NO_PAIR: Pair = Pair { receiver: 0, is_own: false, pdf: 0.0, f: SampledSpectrum::ZERO, wo: Vec3::ZERO };

/// What a first vertex scatters along its path of light from a second one, with the cosine, and the density with which it finds it, 1/sr.
#[inline(always)]
fn scattered(receivers: &Receivers, i: usize, meeting: &Meeting, blocks: &Blocks) -> Option<(SampledSpectrum, f32)> {
    match &receivers.models[i] {
        Model::Nothing => None,
        Model::Diffuse(f) => Some((*f * meeting.cosine[i], meeting.pdf[i])),
        Model::Metal(metal) => metal_lobe(metal, i, meeting),
        Model::Alone(k) => {
            let (bsdf, wo) = &blocks.alone[*k as usize];
            let wi = meeting.wi.vector(i);
            let (f, pdf) = bsdf.f_and_pdf(*wo, wi, TransportMode::Radiance);
            Some((f * bsdf.abs_cos(wi), pdf))
        }
    }
}

/// As [`scattered`], for another path's wavelengths.
#[inline(never)]
fn scattered_at(
    receivers: &Receivers,
    i: usize,
    meeting: &Meeting,
    scene: &Scene,
    sample: &CameraSample,
    hit: &Option<Hit>,
    place: &mut Option<(Interaction, TextureContext)>,
    lambda: &Wavelengths,
) -> Option<(SampledSpectrum, f32)> {
    if matches!(receivers.models[i], Model::Nothing) {
        return None;
    }
    if let Some(material) = receivers.materials[i]
        && !matches!(receivers.models[i], Model::Alone(_))
    {
        match Plain::of(scene, material, lambda) {
            Plain::Diffuse(reflectance) => {
                return Some((reflectance * FRAC_1_PI * meeting.cosine[i], meeting.pdf[i]));
            }
            Plain::Metal(metal) => return metal_lobe(&metal, i, meeting),
            Plain::Other => {}
        }
    }
    let camera_ray = sample.camera_ray.as_ref()?;
    if place.is_none() {
        let at = scene.geometry.interaction(&camera_ray.ray, hit.as_ref()?);
        *place = Some((at, scene.texture_context(&at, Some(camera_ray))));
    }
    let (at, footprint) = place.as_ref()?;
    let (mix, mut lambda) = (sample.stream.mix(0), *lambda);
    let bsdf = scene.materials.bsdf(at.material, &scene.textures, at, footprint, &mut lambda, mix)?;
    let wi = meeting.wi.vector(i);
    let (f, pdf) = bsdf.f_and_pdf(at.wo, wi, TransportMode::Radiance);
    Some((f * bsdf.abs_cos(wi), pdf))
}

#[inline(always)]
fn metal_lobe(metal: &irradiant_core::bxdf::Conductor, i: usize, meeting: &Meeting) -> Option<(SampledSpectrum, f32)> {
    if !(meeting.pdf[i] > 0.0) {
        return None;
    }
    let f = metal.fresnel(meeting.lobe[0][i]) * meeting.lobe[1][i];
    f.is_finite().then(|| (f * meeting.cosine[i], meeting.pdf[i]))
}

/// As [`Scattered::give`], in lanes where light leaves a metal.
fn give(
    light: &Scattered,
    seen: &[&Pair],
    arriving: &[(u32, Incoming)],
    level: Level,
    mut to: impl FnMut(usize, SampledSpectrum),
) {
    match light {
        Scattered::Evenly { radiance, .. } => {
            let total: f32 = seen.iter().map(|p| p.pdf).sum();
            for pair in seen {
                to(usize::from(pair.receiver), pair.f * *radiance * (1.0 / total));
            }
        }
        Scattered::By { bsdf, incoming } => {
            let mut wo: Three = NOWHERE;
            seen.iter().enumerate().for_each(|(i, pair)| wo.set(i, pair.wo.to_array()));
            let mut lobes = Lobes::NONE;
            for (_, light) in &arriving[incoming.clone()] {
                let mut f = [SampledSpectrum::ZERO; PIXELS];
                let mut total = 0.0;
                let metal = match &bsdf.bxdf {
                    Bxdf::Conductor(metal) => Some(metal),
                    _ => None,
                };
                if let Some(metal) = metal {
                    let (frame, facets, wi) = (&bsdf.frame, metal.facets(), light.wi);
                    level.run(Mirror { frame, facets, wi, wo: &wo, out: &mut lobes });
                }
                for (i, (pair, f)) in seen.iter().zip(&mut f).enumerate() {
                    let (value, pdf) = match metal {
                        Some(metal) => {
                            let value = metal.fresnel(lobes.cos[i]) * lobes.value[i];
                            if value.is_finite() { (value, lobes.pdf[i]) } else { (SampledSpectrum::ZERO, 0.0) }
                        }
                        None => bsdf.f_and_pdf(pair.wo, light.wi, TransportMode::Radiance),
                    };
                    *f = value;
                    let pdf = if light.found_by_bsdf && !value.is_black() { pdf } else { 0.0 };
                    total += pair.pdf * (light.light_pdf + pdf);
                }
                if !(total > 0.0) {
                    continue;
                }
                let radiance = light.radiance * (bsdf.abs_cos(light.wi) / total);
                for (pair, f) in seen.iter().zip(&f) {
                    to(usize::from(pair.receiver), pair.f * *f * radiance);
                }
            }
        }
    }
}
