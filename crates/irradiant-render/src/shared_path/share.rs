//! The sum over a block: each second vertex to each first one that sees it.

use super::{Incoming, PIXELS, Scattered, Scratch};
use crate::integrator::RenderStats;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::interaction::ReferencePoint;
use irradiant_core::scene::Scene;
use irradiant_math::Vec3;
use irradiant_spectrum::SampledSpectrum;

/// A second vertex as a first vertex sees it.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    giver: u8,
    receiver: u8,
    /// Density with which the receiver's BSDF finds the vertex, per area.
    pdf: f32,
    /// What the light there is multiplied with on its way to the camera.
    f: SampledSpectrum,
    /// From the second to the first.
    wo: Vec3,
}

/// Brings the light of all second vertices to all first ones.
pub(super) fn share(scene: &Scene, scratch: &mut Scratch, stats: &mut RenderStats) {
    let Scratch { members, layers, rays, ends, blocked, pairs, incoming, .. } = scratch;
    rays.clear();
    pairs.clear();
    for (j, giver) in members.iter().enumerate() {
        let Some(second) = &giver.second else { continue };
        // Nobody needs to be asked whether he sees what is dark.
        if second.light.is_black(incoming) {
            continue;
        }
        let ReferencePoint { p, p_error, n, .. } = second.place;
        for (i, receiver) in members.iter().enumerate() {
            let Some(first) = &receiver.first else { continue };
            let d = p - first.at.p;
            let r2 = d.length_squared();
            let wi = d * (1.0 / r2.sqrt());
            // From density per solid angle to density per area.
            let there = wi.dot_normal(n).abs() / r2;
            let (f_cos, pdf, wo) = if i == j {
                (second.carried * second.pdf, second.pdf, second.wo)
            } else {
                if let Scattered::Evenly { normal, .. } = second.light
                    && !(wi.dot(normal) < 0.0)
                {
                    continue;
                }
                let anew;
                let bsdf = if giver.lambda == receiver.lambda {
                    &first.bsdf
                } else {
                    anew = receiver.bsdf_at(scene, first, &giver.lambda);
                    let Some(bsdf) = &anew else { continue };
                    bsdf
                };
                let (f, pdf) = bsdf.f_and_pdf(first.at.wo, wi, TransportMode::Radiance);
                (f * bsdf.abs_cos(wi), pdf, -wi)
            };
            let pdf = pdf * there;
            // Directions in which nothing is scattered are never drawn.
            if !(pdf > 0.0) || !pdf.is_finite() || f_cos.is_black() {
                continue;
            }
            pairs.push(Pair { giver: j as u8, receiver: i as u8, pdf, f: f_cos * there, wo });
            if i != j {
                rays.push(first.at.spawn_ray_to(p, p_error, n));
            }
        }
    }
    ends.clear();
    ends.resize(rays.len(), 1.0);
    blocked.clear();
    blocked.resize(rays.len(), false);
    // Those to one second vertex travel together.
    let mut first = 0;
    for to_one in pairs.chunk_by(|a, b| a.giver == b.giver) {
        let count = to_one.iter().filter(|p| p.giver != p.receiver).count();
        let these = first..first + count;
        scene.geometry.occluded_batch(&rays[these.clone()], &ends[these.clone()], &scene.alpha(), &mut blocked[these]);
        first += count;
    }
    stats.shadow_rays += rays.len() as u64;
    let mut answers = blocked.iter();
    pairs.retain(|pair| pair.giver == pair.receiver || answers.next() != Some(&true));

    let channels = scene.layers.channels();
    let mut rest = &pairs[..];
    for j in 0..members.len() {
        let (seen, others) = rest.split_at(rest.partition_point(|p| usize::from(p.giver) <= j));
        rest = others;
        let Some(second) = members[j].second.take() else { continue };
        let lambda = members[j].lambda;
        second.light.give(seen, incoming, |receiver, radiance| {
            let member = &mut members[receiver];
            let response = scene.sensor_response(radiance, &lambda);
            (0..3).for_each(|c| member.shared[c] += response[c]);
            let weight = member.sample.camera_ray.map_or(0.0, |c| c.weight);
            scene.layers.add_buckets(
                radiance * weight,
                &lambda,
                &mut layers[receiver * channels..(receiver + 1) * channels],
            );
        });
    }
}

impl Scattered {
    /// Whether no light leaves.
    fn is_black(&self, arriving: &[Incoming]) -> bool {
        match self {
            Self::Evenly { radiance, .. } => radiance.is_black(),
            Self::By { incoming, .. } => arriving[incoming.clone()].iter().all(|light| light.radiance.is_black()),
        }
    }

    /// Gives each first vertex that sees this one its share: its member and the radiance that reaches the camera.
    fn give(&self, seen: &[Pair], arriving: &[Incoming], mut to: impl FnMut(usize, SampledSpectrum)) {
        match self {
            Self::Evenly { radiance, .. } => {
                let total: f32 = seen.iter().map(|p| p.pdf).sum();
                for pair in seen {
                    to(usize::from(pair.receiver), pair.f * *radiance * (1.0 / total));
                }
            }
            Self::By { bsdf, incoming } => {
                for light in &arriving[incoming.clone()] {
                    let mut f = [SampledSpectrum::ZERO; PIXELS];
                    let mut total = 0.0;
                    for (pair, f) in seen.iter().zip(&mut f) {
                        let (value, pdf) = bsdf.f_and_pdf(pair.wo, light.wi, TransportMode::Radiance);
                        *f = value;
                        total += pair.pdf
                            * (light.light_pdf + if light.found_by_bsdf && !value.is_black() { pdf } else { 0.0 });
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
}
