//! The path estimator's stages over many paths: [`PathIntegrator`]'s samples, to the bit, several at a time.
//!
//! The paths of a batch go from vertex to vertex together. A stage is a plain loop over the numbers of all paths, side by side in arrays
//! that stay in the cache ([`lanes`](irradiant_math::lanes)), which calls the functions that code for one path calls and is compiled for the
//! vectors of the processor ([`Kernel`]): random numbers, surfaces, points of lamps, scattered directions. Between them, path by path: rays,
//! spectra, roulette.
//!
//! Only what is common is computed in lanes: flat triangles, diffuse surfaces and rough metals, rectangular lamps. For the rest each vertex is asked alone,
//! by the functions that [`PathIntegrator::follow`] calls, and its answers are put into the lanes. That loop stays the specification.
//!
//! In reading order: this file (the walk), `batch` (what paths carry), `kernels` (the stages in lanes), `split` (several light samples at a
//! vertex), `shared` (what `sharedpath` does otherwise at its first two vertices).

mod batch;
mod kernels;
mod shared;
mod split;

pub(crate) use batch::{Batch, Plain};

use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_samples::{direct_light, strata};
use crate::path::{PathIntegrator, Roulette, Walk, survival_probability};
use crate::record::NoRecord;
use batch::{Scattering, Surface, nowhere};
use irradiant_core::bxdf::{Bxdf, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::geometry::{EmitterShape, Hit};
use irradiant_core::interaction::{Interaction, LightId};
use irradiant_core::light::{AreaAlpha, AreaRadiance, Light, PixelLine, SampleMode};
use irradiant_core::light_sampler::{LightSampler, PickedLight};
use irradiant_core::sampler::{SampleStream, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::LANES;
use irradiant_spectrum::{Basis, SampledSpectrum, Wavelengths};
use kernels::{Numbers, SampleLamps, Scatter, Surfaces, Weigh};
use std::f32::consts::FRAC_1_PI;

impl PathIntegrator {
    /// Whether this scene's paths may go in batches.
    pub(crate) fn has_stages(&self, scene: &Scene) -> bool {
        (self.light_splits == 1 || !scene.materials.may_pass())
            && !self.regularize
            && scene.layers.channels() == 0
            && StreamLanes::can_hold(&scene.sampler.stream([0, 0], 0))
    }

    /// What the camera rays of some samples see, whose first hits are known: into `radiance`, all zero before.
    pub(crate) fn radiance_of_batch(
        &self,
        b: &mut Batch,
        scene: &Scene,
        samples: &mut [CameraSample],
        hits: &[Option<Hit>],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let n = b.begin(scene, samples, hits);
        self.walk_on(b, n, 0, scene, samples, radiance, stats);
    }

    /// Takes `n` paths of `depth` scattering events each, whose rays are in the lanes with what they meet, to their ends. What they bring is
    /// added to `radiance`.
    fn walk_on(
        &self,
        b: &mut Batch,
        mut n: usize,
        mut depth: u32,
        scene: &Scene,
        samples: &mut [CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let level = scene.geometry.level();
        loop {
            let (stay, n_flat) = self.arrive(b, n, depth, scene, samples, radiance);
            n = stay;
            if n == 0 {
                return;
            }
            if n_flat > 0 {
                level.run(Surfaces(b, n));
            }
            self.shade(b, n, depth, scene, samples, radiance, stats);
            if self.is_at_limit(depth) {
                return;
            }
            level.run(Numbers(b, n, depth));
            self.light_samples(b, n, depth, scene, samples, radiance, stats);
            level.run(Scatter(b, n));
            depth += 1;
            n = self.go_on(b, n, depth, scene, stats);
        }
    }

    /// Ends the paths that leave the scene. How many stay, and how many of them meet flat triangles.
    fn arrive(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &[CameraSample],
        radiance: &mut [SampledSpectrum],
    ) -> (usize, usize) {
        let (mut stay, mut n_flat) = (0, 0);
        for i in 0..n {
            let s = b.sample[i] as usize;
            let Some(hit) = &b.met[i] else {
                radiance[s] += self.escaped(scene, &b.walk(i, depth), &samples[s].lambda, &mut NoRecord);
                continue;
            };
            let flat = scene.geometry.flat_triangle(hit, &mut b.triangles, stay);
            n_flat += usize::from(flat.is_some());
            b.surface[stay] = flat.map_or(Surface::Other, |(material, light)| Surface::Flat(material, light));
            b.shift(stay, i);
            stay += 1;
        }
        (stay, n_flat)
    }

    /// How light scatters where paths are, and what is emitted there.
    fn shade(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &mut [CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        b.bsdfs.clear();
        for i in 0..n {
            let s = b.sample[i] as usize;
            b.is_metal[i] = 0;
            if let Surface::Flat(material, light) = b.surface[i] {
                let lambda = samples[s].lambda;
                let mut after = lambda;
                let plain = match b.known.get_mut(material.0 as usize) {
                    Some(known) if lambda.basis == Basis::Rgb => {
                        *known.get_or_insert_with(|| Plain::of(scene, material, &lambda))
                    }
                    _ => Plain::of(scene, material, &lambda),
                };
                let is_known = match plain {
                    Plain::Diffuse(reflectance) => {
                        b.set_diffuse(i, reflectance);
                        true
                    }
                    Plain::Metal(metal) => {
                        b.set_metal(i, metal);
                        true
                    }
                    Plain::Other => {
                        let frame = b.at.frame(i);
                        let bsdf = scene.materials.plain_bsdf(material, frame, &scene.textures, &nowhere(), &mut after);
                        bsdf.map(|bsdf| b.set_alone(i, bsdf)).is_some()
                    }
                };
                if is_known {
                    if light.is_some() {
                        let at = Interaction { light, uv: b.triangles.uv(i), ..b.interaction(i) };
                        radiance[s] += self.emitted(scene, &b.walk(i, depth), &at, &lambda, &mut NoRecord);
                    }
                    if matches!(b.scattering[i], Scattering::Alone(_)) {
                        samples[s].lambda = after;
                    }
                    continue;
                }
            }
            self.shade_alone(b, i, depth, scene, &mut samples[s], &mut radiance[s], stats);
        }
    }

    /// The same for one path, whatever it meets.
    fn shade_alone(
        &self,
        b: &mut Batch,
        i: usize,
        depth: u32,
        scene: &Scene,
        sample: &mut CameraSample,
        radiance: &mut SampledSpectrum,
        stats: &mut RenderStats,
    ) {
        let (Some(hit), Some(camera_ray)) = (&b.met[i], &sample.camera_ray) else { return };
        let ray = b.ray(i);
        let mut at = Interaction::unknown(&ray, hit.t);
        scene.geometry.fill_in(&ray, hit, &mut at);
        let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
        let (mix, mut after) = (sample.stream.mix(depth), sample.lambda);
        let bsdf = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut after, mix);
        let Some(bsdf) = bsdf else {
            // An interface: the path would come to its next vertex one step after the others.
            b.scattering[i] = Scattering::Gone;
            let mut walk = b.walk(i, depth);
            self.go_alone(&mut walk, radiance, scene, camera_ray, &sample.stream, &mut sample.lambda, stats);
            return;
        };
        if at.light.is_some() {
            *radiance += self.emitted(scene, &b.walk(i, depth), &at, &sample.lambda, &mut NoRecord);
        }
        sample.lambda = after;
        b.at.set(i, &at, &bsdf.frame);
        match bsdf.bxdf {
            Bxdf::Diffuse(diffuse) => b.set_diffuse(i, diffuse.reflectance),
            Bxdf::Conductor(metal) if !metal.facets().is_smooth() => b.set_metal(i, metal),
            _ => b.set_alone(i, bsdf),
        }
    }

    #[inline(never)]
    fn go_alone(
        &self,
        walk: &mut Walk,
        radiance: &mut SampledSpectrum,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
    ) {
        self.follow(walk, radiance, None, scene, camera_ray, stream, lambda, &mut [], stats, &mut NoRecord);
    }

    /// A light sample of each path.
    fn light_samples(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &[CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let only = match &scene.light_sampler {
            LightSampler::Uniform(_) if scene.lights.as_slice().len() == 1 => {
                Some(PickedLight { id: LightId(0), pmf: 1.0 })
            }
            _ => None,
        };
        let splits = self.light_splits_at(depth);
        if strata(scene, splits) > 1 {
            self.split_light_samples(b, n, depth, splits, scene, samples, radiance, stats);
            return;
        }
        let pick = |b: &Batch, i: usize| {
            let picked =
                only.or_else(|| scene.light_sampler.sample(&b.at.reference(i), b.light.light_draws(i).pick))?;
            Some((picked, picked.pmf, 1.0))
        };
        if self.draw_lights(b, n, depth, scene, samples, radiance, stats, pick) {
            scene.geometry.level().run(Weigh(b, n));
            self.arriving_light(b, n, scene, radiance, stats);
        }
    }

    /// Draws a point of the light that `pick` says for each path, with the average number of its samples there and the share of all
    /// samples that this one stands for. Whether there is any.
    fn draw_lights(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &[CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
        pick: impl Fn(&Batch, usize) -> Option<(PickedLight, f32, f32)>,
    ) -> bool {
        let (sky, mode) = (scene.lights.sky(), SampleMode::Compensated);
        b.light_alone.clear();
        let mut any = false;
        for i in 0..n {
            b.pmf[i] = 0.0;
            if !b.scatters(i) {
                continue;
            }
            let Some((picked, times, share)) = pick(b, i) else { continue };
            (b.light_times[i], b.light_share[i]) = (times, share);
            let PickedLight { id, pmf } = picked;
            if let Light::Area(lamp) = scene.lights.get(id)
                && let (EmitterShape::Rectangle(rectangle), AreaRadiance::Uniform(emission), AreaAlpha::Constant(alpha)) =
                    (&lamp.shape, &lamp.radiance, lamp.alpha)
            {
                if b.lamp[i] != id.0 {
                    b.lamps.set(i, rectangle);
                    (b.lamp[i], b.two_sided[i]) = (id.0, u32::from(lamp.two_sided));
                }
                b.arriving[i] = emission.sample(&samples[b.sample[i] as usize].lambda) * lamp.scale * alpha;
                (b.pmf[i], b.is_delta[i]) = (pmf, 0);
                any = true;
            } else {
                let line = sky.filter(|(sky, _)| *sky == id).map(|(_, sky)| sky.seek(b.light.uv(i), mode));
                b.light_alone.push((i as u32, picked, line));
            }
        }
        let level = scene.geometry.level();
        if any {
            level.run(SampleLamps(b, n));
        }
        // The way to a point of the sky is waiting for memory: each step for all.
        let approach = |line: Option<PixelLine>| line.zip(sky).map(|(line, (_, sky))| sky.approach(line, mode));
        b.light_runs.clear();
        b.light_runs.extend(b.light_alone.iter().map(|&(.., line)| approach(line)));
        let may_pass = scene.materials.may_pass();
        for j in 0..b.light_alone.len() {
            let ((i, picked, _), run) = (b.light_alone[j], b.light_runs[j]);
            let i = i as usize;
            let s = b.sample[i] as usize;
            let lambda = &samples[s].lambda;
            let light = scene.lights.get(picked.id);
            if may_pass && light.is_delta() {
                radiance[s] += self.light_alone(b, i, depth, scene, lambda, stats);
                continue;
            }
            let sample = match (run, sky) {
                (Some(run), Some((_, sky))) => sky.arrive(run, lambda, mode),
                _ => light.sample(&b.at.reference(i), b.light.uv(i), lambda, mode),
            };
            let Some(sample) = sample else { continue };
            b.arriving[i] = sample.radiance * scene.opacity(&sample);
            b.targets.set(i, &sample);
            (b.pmf[i], b.is_delta[i]) = (picked.pmf, u32::from(sample.is_delta));
            any = true;
        }
        any
    }

    /// A light sample of one path.
    #[cold]
    fn light_alone(
        &self,
        b: &Batch,
        i: usize,
        depth: u32,
        scene: &Scene,
        lambda: &Wavelengths,
        stats: &mut RenderStats,
    ) -> SampledSpectrum {
        direct_light(
            scene,
            &b.interaction(i),
            &b.bsdf(i),
            &b.throughput[i],
            lambda,
            &b.light.light_draws(i),
            None,
            1,
            depth,
            stats,
            &mut NoRecord,
        )
    }

    /// What light samples bring, unless something is in the way.
    fn arriving_light(
        &self,
        b: &mut Batch,
        n: usize,
        scene: &Scene,
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        b.shadow_rays.clear();
        b.shadow_ends.clear();
        b.shadow_light.clear();
        for i in 0..n {
            // Not a comparison that NaN fails: what is wrong must reach the film, which counts it.
            if b.pmf[i] == 0.0 || b.targets.pdf[i] == 0.0 {
                continue;
            }
            let (f, factor) = match b.scattering[i] {
                Scattering::Diffuse => (b.reflectance[i] * FRAC_1_PI, b.light_factor[i]),
                Scattering::Metal => (b.metal_f(i), b.light_factor[i]),
                Scattering::Alone(k) => {
                    let (bsdf, wi) = (&b.bsdfs[k as usize], b.targets.wi.vector(i));
                    let (f, pdf) = bsdf.f_and_pdf(b.at.wo.vector(i), wi, TransportMode::Radiance);
                    b.light_cosine[i] = wi.dot(bsdf.frame.z).abs();
                    (f, b.light_weight(i, pdf))
                }
                Scattering::Gone => continue,
            };
            let f = f * b.light_cosine[i];
            if f.is_black() || b.arriving[i].is_black() || !f.is_finite() {
                continue;
            }
            let (ray, end) = b.targets.ray(i, b.time[i]);
            b.shadow_rays.push(ray);
            b.shadow_ends.push(end);
            b.shadow_light.push((b.sample[i], b.throughput[i] * f * b.arriving[i] * factor));
        }
        stats.shadow_rays += b.shadow_rays.len() as u64;
        let mut occluded = [false; LANES];
        let occluded = &mut occluded[..b.shadow_rays.len()];
        scene.geometry.occluded_batch(&b.shadow_rays, &b.shadow_ends, &scene.alpha(), occluded);
        for (&(s, light), occluded) in b.shadow_light.iter().zip(occluded) {
            if !*occluded {
                radiance[s as usize] += light;
            }
        }
    }

    /// Plays roulette and traces the rays of paths that go on, `depth` scattering events by then. How many do.
    fn go_on(&self, b: &mut Batch, n: usize, depth: u32, scene: &Scene, stats: &mut RenderStats) -> usize {
        let mut stay = 0;
        for i in 0..n {
            let Some(turn) = b.turn(i) else { continue };
            let mut throughput = b.throughput[i] * turn.weight;
            let roulette_scale = b.roulette_scale[i] * turn.scale;
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(depth);
            if throughput.is_black() {
                continue;
            }
            let survival = match self.roulette {
                Roulette::Throughput => survival_probability(&throughput, roulette_scale, depth),
                Roulette::Constant(q) => 1.0 - q,
            };
            if survival < 1.0 {
                if b.scatter.roulette(i) >= survival {
                    continue;
                }
                throughput *= 1.0 / survival;
            }
            stats.bounce_rays += 1;
            b.leave(stay, i, &turn, throughput, roulette_scale, scene);
            stay += 1;
        }
        b.light_splits = self.light_splits_at(depth - 1);
        scene.geometry.intersect_scattered(&b.rays[..stay], &scene.alpha(), &mut b.met[..stay]);
        stay
    }
}
