//! Light of lamps: those that paths meet, and those that are sampled at vertices.

use super::batch::{Batch, MetLamp};
use super::kernels::{SampleRectangles, SampleSky, SampleSpheres, Weigh};
use crate::camera_samples::BatchSample;
use crate::integrator::RenderStats;
use crate::light_samples::{LightChoice, all_are_sampled, strata};
use crate::path::power_heuristic;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::geometry::EmitterShape;
use irradiant_core::interaction::LightId;
use irradiant_core::light::{AreaAlpha, AreaRadiance, Light, LightHit, SampleMode};
use irradiant_core::light_sampler::{LightSampler, PointLanes};
use irradiant_core::scene::Scene;
use irradiant_math::Point2;
use irradiant_spectrum::{Basis, SampledSpectrum, Wavelengths};

/// All of [`Compensated`](SampleMode::Compensated): hits are weighed against samples.
const MODE: SampleMode = SampleMode::Compensated;

/// Whether there is nothing to pick: one light, at all places.
pub(super) fn has_one_light(scene: &Scene) -> bool {
    matches!(scene.light_sampler, LightSampler::Uniform(_)) && scene.lights.len() == 1
}

/// A lamp that shines evenly, of a shape that may have lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainLamp {
    /// Of its light, with what its opacity leaves.
    radiance: SampledSpectrum,
    two_sided: u32,
}

impl PlainLamp {
    fn of(scene: &Scene, id: LightId, lambda: &Wavelengths) -> Option<Self> {
        match scene.lights.get(id) {
            Light::Area(lamp) => match (&lamp.shape, &lamp.radiance, lamp.alpha) {
                (
                    EmitterShape::Rectangle(_) | EmitterShape::Sphere(_),
                    AreaRadiance::Uniform(emission),
                    AreaAlpha::Constant(alpha),
                ) => {
                    let radiance = emission.sample(lambda) * lamp.scale * alpha;
                    Some(Self { radiance, two_sided: u32::from(lamp.two_sided) })
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// What is known of all lights, where it is the same for all paths: in the RGB basis, and where they are few enough to stay in a cache.
    pub fn all(scene: &Scene) -> Vec<Option<Self>> {
        const FEW: usize = 1 << 13;
        let known = if scene.basis() == Basis::Rgb && scene.lights.len() <= FEW { scene.lights.len() } else { 0 };
        (0..known as u32).map(|id| Self::of(scene, LightId(id), &Wavelengths::rgb())).collect()
    }
}

impl Batch {
    /// A path meets a lamp: what that emits is still to be weighed.
    #[inline]
    pub fn meet_lamp(&mut self, i: usize, scene: &Scene, light: LightId, uv: Point2, lambda: &Wavelengths) {
        let emitted = scene.lights.get(light).emitted(self.at.n.normal(i), uv, self.at.wo.vector(i), lambda);
        if !emitted.is_black() {
            self.lamps_met.push(MetLamp { lane: i as u32, light, uv, emitted });
        }
    }

    /// Whether a light, if any, is known to shine evenly.
    pub fn is_plain_lamp(&self, light: Option<LightId>) -> bool {
        light.is_none_or(|id| matches!(self.known_lamps.get(id.0 as usize), Some(Some(_))))
    }

    /// The light of the lamps that paths meet, weighed against having sampled it.
    pub fn light_of_lamps(&mut self, depth: u32, scene: &Scene, radiance: &mut [SampledSpectrum]) {
        // Whose weight is asked for: not what the camera sees, by itself or in mirrors, nor where all lights are sampled.
        self.seeking.clear();
        let all_are_sampled = all_are_sampled(scene, self.light_choice.splits);
        for met in self.lamps_met.iter().filter(|met| depth > 0 && !self.specular[met.lane as usize]) {
            (self.picked[met.lane as usize], self.pmf[met.lane as usize]) = (met.light.0, 1.0);
            if !all_are_sampled {
                self.seeking.push(met.lane);
            }
        }
        let [p, p_error, n, ns] = &self.previous;
        let from = PointLanes { p, p_error, n, ns };
        if !self.seeking.is_empty() {
            let level = scene.geometry.level();
            let (picked, tree, pmf) = (&self.picked, &mut self.tree, &mut self.pmf);
            scene.light_sampler.pmf_lanes(level, &self.seeking, from, picked, tree, pmf);
        }
        for met in &self.lamps_met {
            let i = met.lane as usize;
            let (mut light_pdf, mut bsdf_pdf) = (0.0, 0.0);
            if depth > 0 {
                bsdf_pdf = self.bsdf_pdf[i];
                if !self.specular[i] {
                    let hit = LightHit { p: self.at.p.point(i), n: self.at.n.normal(i), uv: met.uv };
                    let pdf = scene.lights.get(met.light).pdf_hit(&from.reference(i), self.d.vector(i), &hit);
                    light_pdf = self.light_choice.tests_by_chance(self.pmf[i]) * pdf;
                }
            }
            let weight = if light_pdf > 0.0 { power_heuristic(bsdf_pdf, light_pdf) } else { 1.0 };
            radiance[self.sample[i] as usize] += self.throughput.at(i) * met.emitted * weight;
        }
    }

    /// A light sample of each path, or several.
    pub fn light_samples(
        &mut self,
        n: usize,
        choice: LightChoice,
        scene: &Scene,
        samples: &[BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        if strata(scene, choice.splits) > 1 {
            self.split_light_samples(n, choice, scene, samples, radiance, stats);
            return;
        }
        self.pick_lights(n, scene);
        if self.sample_picked(n, scene, samples) {
            self.arriving_light(n, scene, samples, radiance, stats);
        }
    }

    /// Points of the lights that have been picked, and how they are weighed. Whether there are any.
    pub(super) fn sample_picked(&mut self, n: usize, scene: &Scene, samples: &[BatchSample]) -> bool {
        let any = self.sample_lamps(n, scene, samples) | self.sample_alone(scene, samples);
        if any {
            scene.geometry.level().run(Weigh(self, n));
        }
        if let Some(sky) = self.shared_sky {
            self.keep_sky_samples(n, sky);
        }
        any
    }

    /// A light of each path whose surface scatters light that it is not known where to look for.
    pub(super) fn pick_lights(&mut self, n: usize, scene: &Scene) {
        self.seek_light(n);
        if has_one_light(scene) {
            for &i in &self.seeking {
                (self.picked[i as usize], self.pmf[i as usize]) = (0, 1.0);
            }
        } else {
            let at = PointLanes { p: &self.at.p, p_error: &self.at.p_error, n: &self.at.n, ns: &self.at.ns };
            let [_, _, pick, _] = &self.light.0;
            let (level, tree) = (scene.geometry.level(), &mut self.tree);
            scene.light_sampler.sample_lanes(level, &self.seeking, at, pick, tree, &mut self.picked, &mut self.pmf);
        }
        self.light_times[..n].copy_from_slice(&self.pmf[..n]);
        self.light_share[..n].fill(1.0);
    }

    /// Paths whose surfaces scatter light that it is not known where to look for; no light is picked yet.
    pub(super) fn seek_light(&mut self, n: usize) {
        self.pmf[..n].fill(0.0);
        self.seeking.resize(n, 0);
        // Put down in any case, and kept where it counts: a branch would be guessed wrong often.
        let mut k = 0;
        for i in 0..n {
            self.seeking[k] = i as u32;
            k += self.seeks[i] as usize;
        }
        self.seeking.truncate(k);
    }

    /// Has the shape of a plain lamp in the lanes of its kind. Whether there are lanes for it.
    #[inline(always)]
    fn hold(&mut self, i: usize, id: LightId, scene: &Scene) -> bool {
        if self.rectangle[i] == id.0 {
            return true;
        }
        if self.sphere[i] == id.0 {
            self.spheres.ask(i);
            return true;
        }
        self.hold_another(i, id, scene)
    }

    fn hold_another(&mut self, i: usize, id: LightId, scene: &Scene) -> bool {
        let Light::Area(lamp) = scene.lights.get(id) else { return false };
        match &lamp.shape {
            EmitterShape::Rectangle(rectangle) => {
                self.rectangles.set(i, rectangle);
                self.rectangle[i] = id.0;
                true
            }
            EmitterShape::Sphere(sphere) => {
                let is_ball = self.spheres.set(i, sphere);
                if is_ball {
                    self.sphere[i] = id.0;
                    self.spheres.ask(i);
                }
                is_ball
            }
            EmitterShape::Triangle(_)
            | EmitterShape::Bilinear(_)
            | EmitterShape::Disk(_)
            | EmitterShape::Cylinder(_)
            | EmitterShape::Curve(_) => false,
        }
    }

    /// Points of those lamps that have lanes; the others are put down to be asked alone. Whether there are any.
    fn sample_lamps(&mut self, n: usize, scene: &Scene, samples: &[BatchSample]) -> bool {
        let sky = scene.lights.sky();
        self.light_alone.clear();
        self.sky.begin();
        let (mut any_rectangle, mut any_sphere) = (false, false);
        for i in 0..n {
            self.spheres.forget(i);
            if !(self.pmf[i] > 0.0) {
                continue;
            }
            let id = LightId(self.picked[i]);
            let lamp = match self.known_lamps.get(id.0 as usize) {
                Some(known) => *known,
                None => PlainLamp::of(scene, id, &samples[self.sample[i] as usize].lambda),
            };
            if let Some(lamp) = lamp
                && self.hold(i, id, scene)
            {
                any_rectangle |= self.rectangle[i] == id.0;
                any_sphere |= self.sphere[i] == id.0;
                self.arriving.set(i, lamp.radiance);
                (self.is_delta[i], self.two_sided[i]) = (0, lamp.two_sided);
                continue;
            }
            match sky {
                Some((sky, _)) if sky == id => self.sky.ask(i),
                _ => self.light_alone.push(i as u32),
            }
        }
        let level = scene.geometry.level();
        if any_rectangle {
            level.run(SampleRectangles(self, n));
        }
        if any_sphere {
            level.run(SampleSpheres(self, n));
            self.light_alone.extend((0..n as u32).filter(|&i| self.spheres.is_left(i as usize)));
        }
        let mut any_sky = false;
        if let Some((_, sky)) = sky.filter(|_| !self.sky.wanted().is_empty()) {
            level.run(SampleSky(self, n, sky));
            for k in 0..self.sky.wanted().len() {
                let i = self.sky.wanted()[k] as usize;
                match self.sky.radiance(i, sky, &samples[self.sample[i] as usize].lambda) {
                    Some(radiance) => {
                        self.arriving.set(i, radiance);
                        self.is_delta[i] = 0;
                        any_sky = true;
                    }
                    None => self.pmf[i] = 0.0,
                }
            }
        }
        any_rectangle | any_sphere | any_sky
    }

    /// Light samples that are asked alone. Whether there are any.
    fn sample_alone(&mut self, scene: &Scene, samples: &[BatchSample]) -> bool {
        let mut any = false;
        for j in 0..self.light_alone.len() {
            let i = self.light_alone[j] as usize;
            let lambda = &samples[self.sample[i] as usize].lambda;
            let light = scene.lights.get(LightId(self.picked[i]));
            let Some(sample) = light.sample(&self.at.reference(i), self.light.uv(i), lambda, MODE) else {
                self.pmf[i] = 0.0;
                continue;
            };
            self.arriving.set(i, sample.radiance * scene.opacity(&sample));
            self.targets.set(i, &sample);
            self.is_delta[i] = u32::from(sample.is_delta);
            any = true;
        }
        any
    }

    /// What light samples bring to models of their own.
    pub(super) fn bring_alone(&mut self) {
        for k in 0..self.bsdfs.len() {
            let i = self.bsdf_lanes[k] as usize;
            let (bsdf, wi) = (&self.bsdfs[k], self.targets.wi.vector(i));
            if self.pmf[i] != 0.0 {
                let (f, pdf) = bsdf.f_and_pdf(self.at.wo.vector(i), wi, TransportMode::Radiance);
                let (light, counts) = self.bring(i, f * wi.dot(bsdf.frame.z).abs(), pdf);
                self.brought.set(i, light);
                self.brings[i] = u32::from(counts);
            }
        }
    }

    /// What light samples bring, unless something is in the way.
    pub(super) fn arriving_light(
        &mut self,
        n: usize,
        scene: &Scene,
        samples: &[BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        self.bring_alone();
        self.test_light(n, Whose::Drawn, scene, samples, radiance, stats);
    }

    /// Adds what light samples bring that have been weighed, unless something is in the way.
    pub(super) fn test_light(
        &mut self,
        n: usize,
        whose: Whose,
        scene: &Scene,
        samples: &[BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let asking = match whose {
            Whose::Drawn => self.ask(n, Self::counts),
            Whose::Chosen => self.ask(n, |b, i| b.chosen.has_one(i)),
        };
        self.look_for_obstacles(asking, whose, scene, samples, stats);
        for (k, &i) in self.asking[..asking].iter().enumerate() {
            let (i, s) = (i as usize, self.sample[i as usize] as usize);
            let light = match whose {
                Whose::Drawn => self.brought.at(i),
                Whose::Chosen => self.chosen.light(i),
            };
            radiance[s] += if self.rays.is_blocked(k) { SampledSpectrum::ZERO } else { light };
        }
    }

    /// Puts down the lanes that ask what is in the way of their light. How many do.
    fn ask(&mut self, n: usize, asks: impl Fn(&Self, usize) -> bool) -> usize {
        // Put down in any case, and kept where it counts: a branch would be guessed wrong often.
        let mut asking = 0;
        for i in 0..n {
            self.asking[asking] = i as u32;
            asking += usize::from(asks(self, i));
        }
        asking
    }

    /// Finds out whether anything is in the way of the light of the lanes that ask.
    fn look_for_obstacles(
        &mut self,
        asking: usize,
        whose: Whose,
        scene: &Scene,
        samples: &[BatchSample],
        stats: &mut RenderStats,
    ) {
        let (targets, lights, is_delta) = match whose {
            Whose::Drawn => (&self.targets, &self.picked, &self.is_delta),
            Whose::Chosen => (&self.chosen.targets, &self.chosen.picked, &self.chosen.is_delta),
        };
        self.rays.clear();
        for &i in &self.asking[..asking] {
            targets.put_ray(i as usize, self.time[i as usize], &mut self.rays);
        }
        stats.shadow_rays += asking as u64;
        scene.geometry.occluded_rays(&mut self.rays, &scene.alpha());
        if !scene.materials.may_pass() {
            return;
        }
        // Lights that no ray meets are seen through interfaces: `Scene::is_occluded`.
        for (k, &i) in self.asking[..asking].iter().enumerate() {
            let i = i as usize;
            if is_delta[i] != 0 && self.rays.is_blocked(k) {
                let lambda = &samples[self.sample[i] as usize].lambda;
                let (light, at) = (scene.lights.get(LightId(lights[i])), self.at.reference(i));
                let sample = light.sample(&at, self.light.uv(i), lambda, MODE);
                self.rays.set_blocked(k, sample.is_none_or(|sample| scene.is_occluded(&self.interaction(i), &sample)));
            }
        }
    }
}

/// Light samples of a batch's paths.
#[derive(Clone, Copy)]
pub(super) enum Whose {
    /// Those that were drawn last.
    Drawn,
    /// Those that were chosen among several.
    Chosen,
}
