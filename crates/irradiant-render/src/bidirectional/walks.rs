//! The two walks of a sample: vertices with the densities that both directions would find them with.

use super::BidirectionalIntegrator;
use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_walk::{LightStart, scatter_power, start, survival};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{BsdfSample, Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::interaction::Interaction;
use irradiant_core::scene::Scene;
use irradiant_math::{Normal3, Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// A surface that a walk has met.
pub(super) struct Vertex {
    pub at: Interaction,
    pub bsdf: Bsdf,
    /// What arrives here over the density of having come: importance from the camera, power from a light.
    pub carried: SampledSpectrum,
    /// Density per area with which its own walk found it.
    pub forward: f32,
    /// Density per area with which a walk the other way, coming from the vertex after next, would find it. Known once the
    /// next vertex has scattered.
    pub reverse: f32,
    /// Its walk went on by a delta.
    pub delta: bool,
}

/// A lamp that the camera's walk has passed because its material, a mix, came to an interface: it shines and scatters
/// nothing.
pub(super) struct Passed {
    pub at: Interaction,
    /// Surfaces before it.
    pub surfaces: usize,
    pub carried: SampledSpectrum,
    pub forward: f32,
}

/// How a walk from the camera ended, if it left the scene.
pub(super) struct Escape {
    pub ray: Ray,
    pub carried: SampledSpectrum,
    /// Density of its direction per solid angle.
    pub pdf: f32,
}

/// Where a walk from a light began.
pub(super) struct LightEnd {
    pub start: LightStart,
    /// No surface: its density is one of directions.
    pub infinite: bool,
    /// Of the place; at infinity, of the direction. With the light's probability.
    pub forward: f32,
    /// With which a walk from the camera would find it.
    pub reverse: f32,
}

/// Storage for the walks of a sample.
#[derive(Default)]
pub(super) struct Walks {
    /// Surfaces from the camera on: the first is what it looks at.
    pub camera: Vec<Vertex>,
    /// Lamps that the camera's walk has met and passed.
    pub passed: Vec<Passed>,
    /// How the camera's walk left the scene.
    pub escape: Option<Escape>,
    /// The light.
    pub light_end: Option<LightEnd>,
    /// Surfaces from the light on.
    pub light: Vec<Vertex>,
}

/// Density per area at `p` of a density per solid angle at `from`; `n` is zero where there is no surface.
#[inline]
pub(super) fn per_area(pdf: f32, from: Point3, p: Point3, n: Normal3) -> f32 {
    let offset = p - from;
    let d2 = offset.length_squared();
    if !(d2 > 0.0) {
        return 0.0;
    }
    let cos = if n == Normal3::ZERO { 1.0 } else { n.dot(offset).abs() / d2.sqrt() };
    pdf * cos / d2
}

/// Density of a direction that was drawn, as the weights count it: all strategies ask the same function, which is not quite
/// the density of the draw for layered models.
#[inline]
fn forwards(s: &BsdfSample, bsdf: &Bsdf, wo: Vec3, mode: TransportMode) -> f32 {
    if s.lobe.is_specular() {
        return 1.0;
    }
    let pdf = bsdf.pdf(wo, s.wi, mode, Sides::All);
    if pdf > 0.0 { pdf } else { s.pdf }
}

/// Density of a direction for the other walk, as the weights count it.
#[inline]
fn reversed(delta: bool, bsdf: &Bsdf, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
    if delta { 1.0 } else { bsdf.pdf(wo, wi, mode, Sides::All) }
}

impl BidirectionalIntegrator {
    /// From the camera: as a path tracer walks, keeping its vertices.
    pub(super) fn walk_from_camera(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        camera_ray: &CameraRay,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        walks: &mut Walks,
        stats: &mut RenderStats,
    ) {
        let (camera, mut ray) = (&mut walks.camera, camera_ray.ray);
        let mut carried = SampledSpectrum::ONE;
        let mut eta_scale = 1.0;
        let mut pdf = 0.0;
        walks.escape = None;
        walks.passed.clear();
        camera.clear();
        loop {
            let depth = camera.len() as u32;
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                walks.escape = Some(Escape { ray, carried, pdf });
                break;
            };
            let at = scene.geometry.interaction(&ray, &hit);
            let footprint = scene.texture_context(&at, None);
            let mix = sample.stream.mix(depth);
            let bsdf = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix);
            let forward = match camera.last() {
                None => self.camera_density(scene, camera_ray.ray.o, at.p, at.n, |distance| {
                    scene.camera.film_area(&camera_ray.ray, distance)
                }),
                Some(previous) => per_area(pdf, previous.at.p, at.p, at.n),
            };
            let Some(bsdf) = bsdf else {
                if at.light.is_some() {
                    walks.passed.push(Passed { at, surfaces: camera.len(), carried, forward });
                }
                ray = at.spawn_ray(ray.d);
                stats.bounce_rays += 1;
                continue;
            };
            if depth == 0 && !layers.is_empty() {
                scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
            }
            camera.push(Vertex { at, bsdf, carried, forward, reverse: 0.0, delta: false });
            if self.max_depth.is_some_and(|limit| depth >= limit) {
                break;
            }
            let draws = sample.stream.scatter(depth);
            let Some(s) = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All) else { break };
            let delta = s.lobe.is_specular();
            let weight = s.f * (bsdf.abs_cos(s.wi) / s.pdf);
            carried *= weight;
            pdf = forwards(&s, &bsdf, at.wo, TransportMode::Radiance);
            if carried.is_black() {
                break;
            }
            let back = reversed(delta, &bsdf, s.wi, at.wo, TransportMode::Importance);
            finish(camera, delta, back);
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(depth + 1);
            if s.lobe.is_transmissive() {
                eta_scale *= s.eta * s.eta;
            }
            let survival = survival(&(carried * eta_scale), depth + 1);
            if survival < 1.0 {
                if draws.roulette >= survival {
                    break;
                }
                carried *= 1.0 / survival;
            }
            ray = at.spawn_ray(s.wi);
            stats.bounce_rays += 1;
        }
    }

    /// From a light.
    pub(super) fn walk_from_light(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        time: f32,
        lambda: &mut Wavelengths,
        walks: &mut Walks,
        stats: &mut RenderStats,
    ) {
        let light = &mut walks.light;
        light.clear();
        walks.light_end = None;
        let Some(start) = start(scene, &sample.stream, lambda, time) else { return };
        let infinite = scene.lights.get(start.light).bounds().is_none();
        let emitted = start.emitted;
        let of_end = if infinite { emitted.pdf_direction } else { emitted.pdf_position };
        let end = walks.light_end.insert(LightEnd { start, infinite, forward: start.pmf * of_end, reverse: 0.0 });
        let (mut ray, mut carried) = (start.ray, start.power);
        let mut kept = SampledSpectrum::ONE;
        let mut pdf = 0.0;
        loop {
            let depth = light.len() as u32;
            // The last vertex is one that scatters.
            if self.max_depth.is_some_and(|limit| depth >= limit) {
                break;
            }
            stats.bounce_rays += 1;
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { break };
            let at = scene.geometry.interaction(&ray, &hit);
            let footprint = scene.texture_context(&at, None);
            let mix = sample.stream.light_path_mix(depth);
            let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
                ray = at.spawn_ray(ray.d);
                continue;
            };
            let forward = match light.last() {
                Some(previous) => per_area(pdf, previous.at.p, at.p, at.n),
                None if infinite => facing_density(emitted.pdf_position, emitted.normal, ray.d) * at.n.dot(ray.d).abs(),
                None => per_area(emitted.pdf_direction, emitted.ray.o, at.p, at.n),
            };
            light.push(Vertex { at, bsdf, carried, forward, reverse: 0.0, delta: false });
            let draws = sample.stream.light_path_scatter(depth);
            let Some((s, weight)) = scatter_power(&at, &bsdf, &draws) else { break };
            let delta = s.lobe.is_specular();
            carried *= weight;
            kept *= weight;
            pdf = forwards(&s, &bsdf, at.wo, TransportMode::Importance);
            let back = reversed(delta, &bsdf, s.wi, at.wo, TransportMode::Radiance);
            if depth == 0 {
                end.reverse = if infinite { back } else { per_area(back, at.p, emitted.ray.o, emitted.normal) };
            }
            finish(light, delta, back);
            stats.scatterings += 1;
            let survival = survival(&kept, depth + 1);
            if survival < 1.0 {
                if draws.roulette >= survival {
                    break;
                }
                carried *= 1.0 / survival;
                kept *= 1.0 / survival;
            }
            ray = at.spawn_ray(s.wi);
        }
    }

    /// Density per area with which a sample of some pixel looks at `p` from `from`, all rendered pixels being alike.
    pub(super) fn camera_density(
        &self,
        scene: &Scene,
        from: Point3,
        p: Point3,
        n: Normal3,
        film_area: impl FnOnce(f32) -> f32,
    ) -> f32 {
        let offset = p - from;
        let distance = offset.length();
        let cos = n.dot(offset).abs() / distance;
        film_area(distance) * cos / scene.bounds().area() as f32
    }
}

/// Density per area that faces `w`, of one per area of a surface (none: it faces already).
#[inline]
pub(super) fn facing_density(pdf: f32, normal: Normal3, w: Vec3) -> f32 {
    if normal == Normal3::ZERO { pdf } else { pdf / normal.dot(w).abs() }
}

/// Writes down how the walk went on from its last vertex, and what the other walk makes of the one before.
fn finish(walk: &mut [Vertex], delta: bool, back: f32) {
    if let [.., before, last] = walk {
        before.reverse = per_area(back, last.at.p, before.at.p, before.at.n);
    }
    if let Some(last) = walk.last_mut() {
        last.delta = delta;
    }
}
