//! Joining the walks of a sample, in all ways.

use super::BidirectionalIntegrator;
use super::walks::{LightEnd, Vertex, Walks, facing_density, per_area};
use super::weights::{Density, PathDensities};
use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_trace::Splats;
use crate::light_walk::shading_correction;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::interaction::{Interaction, LightId};
use irradiant_core::light::{Light, LightHit, LightTarget, SampleMode};
use irradiant_core::scene::Scene;
use irradiant_math::{Normal3, Point2, Point3, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// The light's end of a path, as found by a ray or by a light sample.
struct End {
    light: LightId,
    /// A point of the light; of lights at infinity only `n` matters, of portals.
    hit: LightHit,
    /// At infinity.
    infinite: bool,
    /// Towards the light from the vertex next to it, unit.
    to_light: Vec3,
    /// Density with which the camera's walk finds it, and a light sample: per area, at infinity per solid angle.
    by_walk: f32,
    by_sample: f32,
}

impl BidirectionalIntegrator {
    /// What the walks bring to the sample's own pixel; other pixels' part goes to `splats`.
    pub(super) fn join(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        walks: &Walks,
        lambda: &Wavelengths,
        densities: &mut PathDensities,
        splats: &mut Splats,
        stats: &mut RenderStats,
    ) -> SampledSpectrum {
        let lens_can_be_joined = scene.light_path_obstacle().is_none();
        densities.lens_can_be_joined = lens_can_be_joined;
        let mut radiance = SampledSpectrum::ZERO;
        // Lamps and skies that the camera's walk has met.
        for (k, v) in walks.camera.iter().enumerate() {
            radiance += self.met(scene, walks, k, (&v.at, v.carried, v.forward), lambda, densities);
        }
        for v in &walks.passed {
            radiance += self.met(scene, walks, v.surfaces, (&v.at, v.carried, v.forward), lambda, densities);
        }
        if walks.escape.is_some() {
            radiance += self.escaped(scene, walks, lambda, densities);
        }
        // Light samples.
        for k in 0..walks.camera.len() {
            radiance += self.light_sample(scene, sample, walks, k, lambda, densities, stats);
        }
        // Both walks.
        if let Some(end) = &walks.light_end {
            for i in 0..walks.light.len() {
                if lens_can_be_joined {
                    self.lens(scene, sample, walks, end, i, lambda, densities, splats, stats);
                }
                for k in 0..walks.camera.len() {
                    radiance += self.surfaces(scene, walks, end, i, k, densities, stats);
                }
            }
        }
        radiance
    }

    /// Emission of what the camera's walk has met after `k` surfaces (where, what it carries, with which density): strategy
    /// s = 0.
    fn met(
        &self,
        scene: &Scene,
        walks: &Walks,
        k: usize,
        (at, carried, forward): (&Interaction, SampledSpectrum, f32),
        lambda: &Wavelengths,
        densities: &mut PathDensities,
    ) -> SampledSpectrum {
        let Some(id) = at.light.filter(|_| self.wants(0, k + 2)) else { return SampledSpectrum::ZERO };
        let light = scene.lights.get(id);
        let emitted = light.emitted(at.n, at.uv, at.wo, lambda) * carried;
        if emitted.is_black() {
            return emitted;
        }
        let weight = || {
            let before = k.checked_sub(1).map(|k| &walks.camera[k]);
            let to_light = -at.wo;
            let by_sample = before.filter(|b| !b.delta).map_or(0.0, |b| {
                let reference = b.at.reference();
                let pdf = light.pdf_hit(&reference, to_light, &at.into());
                per_area(scene.light_sampler.pmf(&reference, id) * pdf, b.at.p, at.p, at.n)
            });
            let hit = LightHit::from(at);
            let end = End { light: id, hit, infinite: false, to_light, by_walk: forward, by_sample };
            self.weight_of_met(scene, walks, k, &end, densities)
        };
        self.share(0, k + 2, weight).map_or(SampledSpectrum::ZERO, |share| emitted * share)
    }

    /// Environments that the camera's walk has escaped to: strategy s = 0.
    fn escaped(
        &self,
        scene: &Scene,
        walks: &Walks,
        lambda: &Wavelengths,
        densities: &mut PathDensities,
    ) -> SampledSpectrum {
        let Some(escape) = &walks.escape else { return SampledSpectrum::ZERO };
        // As if the sky were the next surface.
        let k = walks.camera.len();
        let mut sum = SampledSpectrum::ZERO;
        if !self.wants(0, k + 2) {
            return sum;
        }
        for &id in scene.lights.environments() {
            let light = scene.lights.get(id);
            let emitted = light.escaped(&escape.ray, lambda) * escape.carried;
            if emitted.is_black() {
                continue;
            }
            let weight = || {
                let before = k.checked_sub(1).map(|k| &walks.camera[k]);
                let to_light = escape.ray.d;
                let by_sample = before.filter(|b| !b.delta).map_or(0.0, |b| {
                    let reference = b.at.reference();
                    scene.light_sampler.pmf(&reference, id)
                        * light.pdf_escaped(&reference, to_light, SampleMode::Complete)
                });
                let end = End { light: id, hit: nowhere(), infinite: true, to_light, by_walk: escape.pdf, by_sample };
                self.weight_of_met(scene, walks, k, &end, densities)
            };
            if let Some(share) = self.share(0, k + 2, weight) {
                sum += emitted * share;
            }
        }
        sum
    }

    /// The weight of a light that the walk from the camera has met after its first `k` surfaces.
    fn weight_of_met(&self, scene: &Scene, walks: &Walks, k: usize, end: &End, densities: &mut PathDensities) -> f32 {
        densities.light_sample = end.by_sample;
        densities.vertices.clear();
        let mut first = self.end_density(scene, end);
        first.from_camera = end.by_walk;
        densities.vertices.push(first);
        densities.light_can_be_met = true;
        camera_densities(&walks.camera[..k], densities);
        if let Some(next) = k.checked_sub(1).map(|k| &walks.camera[k]) {
            // What the light would do; the vertex after is as the walk left it.
            densities.vertices[1].from_light = self.found_by_light(scene, end, next.at.p, next.at.n);
            densities.vertices[1].connectible = !next.delta;
        }
        self.finished(0, densities)
    }

    /// A light sample from the camera's `k`th surface: strategy s = 1.
    fn light_sample(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        walks: &Walks,
        k: usize,
        lambda: &Wavelengths,
        densities: &mut PathDensities,
        stats: &mut RenderStats,
    ) -> SampledSpectrum {
        let here = &walks.camera[k];
        let black = SampledSpectrum::ZERO;
        if !here.bsdf.flags().is_non_specular() || !self.wants(1, k + 2) {
            return black;
        }
        let draws = sample.stream.light(k as u32);
        let reference = here.at.reference();
        let Some(picked) = scene.light_sampler.sample(&reference, draws.pick) else { return black };
        let light = scene.lights.get(picked.id);
        let Some(s) = light.sample(&reference, draws.uv, lambda, SampleMode::Complete) else { return black };
        let f = here.bsdf.f(here.at.wo, s.wi, TransportMode::Radiance) * here.bsdf.abs_cos(s.wi);
        let pdf = picked.pmf * s.pdf;
        let brought = here.carried * f * s.radiance * (scene.opacity(&s) / pdf);
        if brought.is_black() || !(pdf > 0.0) {
            return black;
        }
        stats.shadow_rays += 1;
        if !scene.is_lit(&here.at, &s) {
            return black;
        }
        let weight = || {
            let hit = match s.target {
                LightTarget::Infinite => nowhere(),
                LightTarget::Point(p) => LightHit { p, ..nowhere() },
                LightTarget::Surface { p, n, uv, .. } => LightHit { p, n, uv },
            };
            let infinite = s.target == LightTarget::Infinite;
            let at = &here.at;
            let on_light = |pdf: f32| {
                if infinite || s.is_delta && hit.n == Normal3::ZERO { pdf } else { per_area(pdf, at.p, hit.p, hit.n) }
            };
            let by_walk = on_light(here.bsdf.pdf(at.wo, s.wi, TransportMode::Radiance, Sides::All));
            let end = End { light: picked.id, hit, infinite, to_light: s.wi, by_walk, by_sample: on_light(pdf) };
            densities.light_sample = end.by_sample;
            densities.light_can_be_met = !s.is_delta;
            densities.vertices.clear();
            let mut first = self.end_density(scene, &end);
            first.from_camera = end.by_walk;
            densities.vertices.push(first);
            camera_densities(&walks.camera[..k + 1], densities);
            densities.vertices[1].from_light = self.found_by_light(scene, &end, at.p, at.n);
            densities.vertices[1].connectible = true;
            self.reach_back(walks, k, 2, s.wi, densities);
            self.finished(1, densities)
        };
        self.share(1, k + 2, weight).map_or(black, |share| brought * share)
    }

    /// The light's `i`th surface as the lens sees it: t = 1.
    fn lens(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        walks: &Walks,
        end: &LightEnd,
        i: usize,
        lambda: &Wavelengths,
        densities: &mut PathDensities,
        splats: &mut Splats,
        stats: &mut RenderStats,
    ) {
        let y = &walks.light[i];
        let s = i + 2;
        if !y.bsdf.flags().is_non_specular() || !self.wants(s, 1) {
            return;
        }
        let Some(seen) = scene.connect_camera(y.at.p, sample.stream.light_path_lens(i as u32), y.at.time) else {
            return;
        };
        let f = y.bsdf.f(y.at.wo, seen.w, TransportMode::Importance);
        let cos = y.bsdf.abs_cos(seen.w) * shading_correction(&y.at, y.bsdf.frame.z, y.at.wo, seen.w);
        let brought = y.carried * f * (cos * seen.film_area);
        if brought.is_black() {
            return;
        }
        stats.shadow_rays += 1;
        if !scene.is_visible(&y.at, seen.origin, Vec3::ZERO, Normal3::ZERO) {
            return;
        }
        let weight = || {
            self.light_densities(scene, walks, end, i, densities);
            densities.vertices[s - 1].from_camera =
                self.camera_density(scene, seen.origin, y.at.p, y.at.n, |_| seen.film_area);
            self.reach_to_light(walks, end, i, seen.w, densities);
            densities.vertices.push(Density { connectible: true, ..Density::default() });
            self.finished(s, densities)
        };
        if let Some(share) = self.share(s, 1, weight) {
            scene.splat(seen.film, brought * share, lambda, |x, y, rgb| splats.add(x, y, rgb));
        }
    }

    /// The light's `i`th surface and the camera's `k`th.
    fn surfaces(
        &self,
        scene: &Scene,
        walks: &Walks,
        end: &LightEnd,
        i: usize,
        k: usize,
        densities: &mut PathDensities,
        stats: &mut RenderStats,
    ) -> SampledSpectrum {
        let (y, z) = (&walks.light[i], &walks.camera[k]);
        let black = SampledSpectrum::ZERO;
        let (s, t) = (i + 2, k + 2);
        if !self.wants(s, t) || !y.bsdf.flags().is_non_specular() || !z.bsdf.flags().is_non_specular() {
            return black;
        }
        let offset = z.at.p - y.at.p;
        let d2 = offset.length_squared();
        if !(d2 > 0.0) {
            return black;
        }
        // From the light to the camera.
        let w = offset * (1.0 / d2.sqrt());
        let at_y = y.bsdf.f(y.at.wo, w, TransportMode::Importance)
            * (y.bsdf.abs_cos(w) * shading_correction(&y.at, y.bsdf.frame.z, y.at.wo, w));
        if at_y.is_black() {
            return black;
        }
        let at_z = z.bsdf.f(z.at.wo, -w, TransportMode::Radiance) * z.bsdf.abs_cos(w);
        let brought = y.carried * at_y * at_z * z.carried * (1.0 / d2);
        if brought.is_black() {
            return black;
        }
        stats.shadow_rays += 1;
        if !scene.is_visible(&z.at, y.at.p, y.at.p_error, y.at.n) {
            return black;
        }
        let weight = || {
            self.light_densities(scene, walks, end, i, densities);
            let back = z.bsdf.pdf(z.at.wo, -w, TransportMode::Radiance, Sides::All);
            densities.vertices[s - 1].from_camera = per_area(back, z.at.p, y.at.p, y.at.n);
            self.reach_to_light(walks, end, i, w, densities);
            camera_densities(&walks.camera[..k + 1], densities);
            let on = y.bsdf.pdf(y.at.wo, w, TransportMode::Importance, Sides::All);
            densities.vertices[s].from_light = per_area(on, y.at.p, z.at.p, z.at.n);
            densities.vertices[s].connectible = true;
            self.reach_back(walks, k, s + 1, -w, densities);
            self.finished(s, densities)
        };
        self.share(s, t, weight).map_or(black, |share| brought * share)
    }

    fn finished(&self, s: usize, densities: &PathDensities) -> f32 {
        densities.weight(s, self.heuristic)
    }

    /// The light itself in the eyes of its own walk.
    fn end_density(&self, scene: &Scene, end: &End) -> Density {
        let light = scene.lights.get(end.light);
        let (position, direction) = light.pdf_emit(&end.hit, -end.to_light);
        let of_end = if end.infinite { direction } else { position };
        // What is a delta is one place or direction, and is it for every strategy.
        let sole = match light {
            Light::Point(_) | Light::Distant(_) | Light::Spot(_) | Light::Goniometric(_) | Light::Projection(_) => true,
            Light::Area(_) | Light::UniformInfinite(_) | Light::ImageInfinite(_) | Light::PortalInfinite(_) => false,
        };
        let of_end = if sole { 1.0 } else { of_end };
        let from_light = scene.emission_sampler().pmf(end.light) * of_end;
        Density { from_light, from_camera: 0.0, connectible: true }
    }

    /// Density per area with which the light's walk finds `p` next.
    fn found_by_light(&self, scene: &Scene, end: &End, p: Point3, n: Normal3) -> f32 {
        let light = scene.lights.get(end.light);
        let (position, direction) = light.pdf_emit(&end.hit, -end.to_light);
        if end.infinite {
            let facing = facing_density(position, light.emission_normal(), end.to_light);
            facing * n.dot(end.to_light).abs()
        } else {
            per_area(direction, end.hit.p, p, n)
        }
    }

    /// The light's walk up to its `i`th surface, as it walked.
    fn light_densities(&self, scene: &Scene, walks: &Walks, end: &LightEnd, i: usize, densities: &mut PathDensities) {
        let light = scene.lights.get(end.start.light);
        densities.vertices.clear();
        let first = Density { from_light: end.forward, from_camera: end.reverse, connectible: true };
        densities.vertices.push(first);
        densities.light_can_be_met = !light.is_delta();
        let walked = walks.light[..=i].iter().map(|v| Density {
            from_light: v.forward,
            from_camera: v.reverse,
            connectible: !v.delta,
        });
        densities.vertices.extend(walked);
        densities.vertices[i + 1].connectible = true;
        // What a light sample from the first surface would have done.
        let y = &walks.light[0].at;
        let (emitted, reference) = (&end.start.emitted, y.reference());
        let pmf = scene.light_sampler.pmf(&reference, end.start.light);
        densities.light_sample = if end.infinite {
            let pdf = if light.is_delta() { 1.0 } else { light.pdf_escaped(&reference, y.wo, SampleMode::Complete) };
            pmf * pdf
        } else if emitted.normal == Normal3::ZERO {
            pmf
        } else {
            let hit = LightHit { p: emitted.ray.o, n: emitted.normal, uv: emitted.uv };
            per_area(pmf * light.pdf_hit(&reference, y.wo, &hit), y.p, hit.p, hit.n)
        };
    }

    /// What the camera's walk, coming from direction `w` to the light's `i`th surface, makes of the vertex before.
    fn reach_to_light(&self, walks: &Walks, end: &LightEnd, i: usize, w: Vec3, densities: &mut PathDensities) {
        let y = &walks.light[i];
        let pdf = y.bsdf.pdf(w, y.at.wo, TransportMode::Radiance, Sides::All);
        let emitted = &end.start.emitted;
        densities.vertices[i].from_camera = match i.checked_sub(1).map(|i| &walks.light[i].at) {
            Some(before) => per_area(pdf, y.at.p, before.p, before.n),
            None if end.infinite => pdf,
            None => per_area(pdf, y.at.p, emitted.ray.o, emitted.normal),
        };
    }

    /// What the light's walk, coming from direction `w` to the camera's `k`th surface, makes of the vertex after, which is
    /// number `index` of the path.
    fn reach_back(&self, walks: &Walks, k: usize, index: usize, w: Vec3, densities: &mut PathDensities) {
        let z = &walks.camera[k];
        if let Some(after) = k.checked_sub(1).map(|k| &walks.camera[k].at) {
            let pdf = z.bsdf.pdf(w, z.at.wo, TransportMode::Importance, Sides::All);
            densities.vertices[index].from_light = per_area(pdf, z.at.p, after.p, after.n);
        }
    }
}

/// The camera's walk, from its last surface back to the lens.
fn camera_densities(walk: &[Vertex], densities: &mut PathDensities) {
    let walked =
        walk.iter().rev().map(|v| Density { from_light: v.reverse, from_camera: v.forward, connectible: !v.delta });
    densities.vertices.extend(walked);
    densities.vertices.push(Density { connectible: true, ..Density::default() });
}

/// Of lights without a place.
fn nowhere() -> LightHit {
    LightHit { p: Point3::ZERO, n: Normal3::ZERO, uv: Point2::ZERO }
}
