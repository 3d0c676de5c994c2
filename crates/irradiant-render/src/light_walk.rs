//! Paths that begin at lights: their start, and the walk that light tracing and photon mapping share.
//!
//! Such a path carries power (for paths from the camera: importance). Where shading normals differ from geometric ones,
//! and where light is refracted, its scattering is the adjoint of the camera path's, not the same function
//! (Veach 1997, chapter 5): models are asked for [`TransportMode::Importance`], and each event is scaled by
//! [`shading_correction`].

use crate::integrator::RenderStats;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{BsdfSample, Sides, TransportMode};
use irradiant_core::interaction::{Interaction, LightId};
use irradiant_core::light::EmittedRay;
use irradiant_core::sampler::{SampleStream, ScatterDraws};
use irradiant_core::scene::Scene;
use irradiant_math::{Normal3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// A ray on its way from a light.
#[derive(Clone, Copy, Debug)]
pub struct LightStart {
    /// Of which light.
    pub light: LightId,
    /// The probability with which it was picked.
    pub pmf: f32,
    /// What was drawn.
    pub emitted: EmittedRay,
    /// The ray; of lights at infinity from outside of the scene.
    pub ray: Ray,
    /// What it carries: radiance times cosine over all densities; W/nm.
    pub power: SampledSpectrum,
}

/// Draws a light by power, a place on it and a direction. `None` when there is no light, or nothing was drawn.
pub fn start(scene: &Scene, stream: &SampleStream, lambda: &Wavelengths, time: f32) -> Option<LightStart> {
    let draws = stream.emission();
    let picked = scene.emission_sampler().sample(draws.pick)?;
    let light = scene.lights.get(picked.id);
    let emitted = light.emit(draws.position, draws.direction, lambda, time)?;
    let cos = cos_at_light(emitted.normal, emitted.ray.d);
    let density = picked.pmf * emitted.pdf_position * emitted.pdf_direction;
    let power = emitted.radiance * (scene.emitted_opacity(&emitted) * cos / density);
    if power.is_black() || !(density > 0.0) {
        return None;
    }
    let ray = if light.bounds().is_none() { scene.from_outside(&emitted.ray) } else { emitted.ray };
    Some(LightStart { light: picked.id, pmf: picked.pmf, emitted, ray, power })
}

/// The cosine at a light's surface; 1 where it has none.
#[inline]
pub(crate) fn cos_at_light(normal: Normal3, w: Vec3) -> f32 {
    if normal == Normal3::ZERO { 1.0 } else { normal.dot(w).abs() }
}

/// What power that arrives from `wo` and leaves to `wi` is scaled by beside the model's `f |cos_shading(wi)|`, so that light
/// paths and camera paths agree (Veach 1997, eq. 5.19). 0 where the surface is seen edge-on.
#[inline]
pub fn shading_correction(at: &Interaction, ns: Vec3, wo: Vec3, wi: Vec3) -> f32 {
    let n = at.n;
    let below = n.dot(wo).abs() * ns.dot(wi).abs();
    if below > 0.0 { ns.dot(wo).abs() * n.dot(wi).abs() / below } else { 0.0 }
}

/// A direction drawn for power, and what it changes the power by.
pub(crate) fn scatter_power(
    at: &Interaction,
    bsdf: &Bsdf,
    draws: &ScatterDraws,
) -> Option<(BsdfSample, SampledSpectrum)> {
    let sample = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Importance, Sides::All)?;
    let correction = shading_correction(at, bsdf.frame.z, at.wo, sample.wi);
    let weight = sample.f * (bsdf.abs_cos(sample.wi) * correction / sample.pdf);
    (!weight.is_black()).then_some((sample, weight))
}

/// After this many events even a path that loses nothing is ended now and then, so that closed scenes of albedo 1 end.
const LONG_PATH: u32 = 128;

/// Chance to go on after `depth` events, of a path that has kept `kept` of what it began with.
#[inline]
pub(crate) fn survival(kept: &SampledSpectrum, depth: u32) -> f32 {
    if depth <= 1 {
        return 1.0;
    }
    kept.max_component().min(if depth < LONG_PATH { 1.0 } else { 0.95 })
}

/// Power that arrives at a surface.
#[derive(Clone, Copy)]
pub struct Arrival<'a> {
    /// Where; `wo` is where it comes from.
    pub at: &'a Interaction,
    /// How it will scatter.
    pub bsdf: &'a Bsdf,
    /// W/nm.
    pub power: SampledSpectrum,
    /// Scattering events so far.
    pub depth: u32,
}

/// Walks from a light from surface to surface, telling `visit` of each before the power is scattered. Ends by absorption,
/// escape, Russian roulette, or after `max_depth` scattering events.
pub fn walk(
    scene: &Scene,
    start: &LightStart,
    stream: &SampleStream,
    lambda: &mut Wavelengths,
    max_depth: Option<u32>,
    stats: &mut RenderStats,
    mut visit: impl FnMut(&Arrival, &Wavelengths, &mut RenderStats),
) {
    let mut ray = start.ray;
    let mut power = start.power;
    let mut kept = SampledSpectrum::ONE;
    let mut depth = 0;
    loop {
        if max_depth.is_some_and(|limit| depth >= limit) {
            break;
        }
        stats.bounce_rays += 1;
        let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { break };
        let at = scene.geometry.interaction(&ray, &hit);
        let footprint = scene.texture_context(&at, None);
        let mix = stream.light_path_mix(depth);
        let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
            ray = at.spawn_ray(ray.d);
            continue;
        };
        visit(&Arrival { at: &at, bsdf: &bsdf, power, depth }, lambda, stats);
        let draws = stream.light_path_scatter(depth);
        let Some((sample, weight)) = scatter_power(&at, &bsdf, &draws) else { break };
        power *= weight;
        kept *= weight;
        depth += 1;
        stats.scatterings += 1;
        stats.longest_path = stats.longest_path.max(depth);
        let survival = survival(&kept, depth);
        if survival < 1.0 {
            if draws.roulette >= survival {
                break;
            }
            power *= 1.0 / survival;
            kept *= 1.0 / survival;
        }
        ray = at.spawn_ray(sample.wi);
    }
}
