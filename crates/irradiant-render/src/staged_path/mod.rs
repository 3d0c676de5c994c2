//! The path estimator's stages over many paths: [`PathIntegrator`]'s samples, to the bit, several at a time.
//!
//! The paths of a batch go from vertex to vertex together. A stage is a plain loop over the numbers of all paths, side by side in arrays
//! that stay in the cache ([`lanes`](irradiant_math::lanes)), which calls the functions that code for one path calls and is compiled for the
//! vectors of the processor ([`Kernel`]): random numbers, surfaces, points of lamps, scattered directions, what they bring,
//! roulette. Between them, path by path: rays, materials.
//!
//! Only what is common is computed in lanes: flat triangles, diffuse surfaces and rough metals, the light tree, rectangular and spherical lamps, an image of
//! the sky. For the rest each vertex is asked alone, by the functions that [`PathIntegrator::follow`] calls, and its answers are put into the
//! lanes. That loop stays the specification.
//!
//! In reading order: this file (the walk), `batch` (what paths carry), `lamps` (light of lamps, met and sampled), `split` (several light samples
//! at a vertex), `kernels` (the stages in lanes), `shared` (what `sharedpath` does otherwise at its first two vertices).

mod batch;
mod kernels;
mod lamps;
mod shared;
mod split;

pub(crate) use batch::{Batch, Plain};

use crate::camera_samples::{BatchSample, Beginnings};
use crate::integrator::RenderStats;
use crate::path::{PathIntegrator, Walk};
use crate::record::NoRecord;
use batch::{Surface, nowhere};
use irradiant_core::bxdf::Bxdf;
use irradiant_core::interaction::Interaction;
use irradiant_core::sampler::StreamLanes;
use irradiant_core::scene::Scene;
use irradiant_math::Frame;
use irradiant_spectrum::{Basis, SampledSpectrum};
use kernels::{Surfaces, Survive};

/// How many hits further on memory is asked for.
const AHEAD: usize = 8;

impl PathIntegrator {
    /// Whether this scene's paths may go in batches.
    pub(crate) fn has_stages(&self, scene: &Scene) -> bool {
        !self.regularize && scene.layers.channels() == 0 && StreamLanes::can_hold(&scene.sampler.stream([0, 0], 0))
    }

    /// What the camera rays of some samples see, whose first hits are known: into `radiance`, all zero before.
    pub(crate) fn radiance_of_batch(
        &self,
        b: &mut Batch,
        scene: &Scene,
        samples: &mut [BatchSample],
        begin: Beginnings,
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let n = b.begin(scene, samples, &begin);
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
        samples: &mut [BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        loop {
            n = self.meet(b, n, depth, scene, samples, radiance, stats);
            if n == 0 || self.is_at_limit(depth) {
                return;
            }
            let choice = self.light_choice_at(scene, depth);
            b.draw(n, depth, scene, choice, self.plays_roulette(depth + 1));
            b.light_samples(n, choice, scene, samples, radiance, stats);
            b.scatter(n, scene);
            depth += 1;
            n = self.go_on(b, n, depth, scene, stats);
        }
    }

    /// What rays meet that have been traced: ends the paths that leave the scene, finds out how light scatters where the others are, and adds
    /// what is emitted there. How many stay.
    fn meet(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &mut [BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) -> usize {
        let (n, n_flat) = self.arrive(b, n, depth, scene, samples, radiance);
        if n_flat > 0 {
            scene.geometry.level().run(Surfaces(b, n));
        }
        self.shade(b, depth, scene, samples, radiance, stats);
        b.light_of_lamps(depth, scene, radiance);
        n
    }

    /// Ends the paths that leave the scene, and finds out how light scatters at plain flat triangles. How many stay, and how many of them meet flat
    /// triangles.
    fn arrive(
        &self,
        b: &mut Batch,
        mut n: usize,
        depth: u32,
        scene: &Scene,
        samples: &[BatchSample],
        radiance: &mut [SampledSpectrum],
    ) -> (usize, usize) {
        b.forget_vertices();
        let sees_light = !scene.lights.environments().is_empty();
        let (mut i, mut n_flat) = (0, 0);
        while i < n {
            if let Some(Some(hit)) = b.met.get(i + AHEAD) {
                scene.geometry.prefetch_flat_triangle(hit);
            }
            let Some(hit) = &b.met[i] else {
                if sees_light {
                    let s = b.sample[i] as usize;
                    radiance[s] += self.escaped(scene, &b.walk(i, depth), &samples[s].lambda, &mut NoRecord);
                }
                // The last one takes its place.
                n -= 1;
                b.shift(i, n);
                continue;
            };
            let flat = scene.geometry.flat_triangle(hit, &mut b.triangles, i);
            if let Some((material, light)) = flat {
                n_flat += 1;
                b.surface[i] = Surface::Flat(material, light);
                if b.set_plain(i, scene, material, &samples[b.sample[i] as usize].lambda) {
                    b.flat_lamps.extend(light.map(|light| (i as u32, light)));
                } else {
                    b.uncommon.push(i as u32);
                }
            } else {
                b.surface[i] = Surface::Other;
                b.uncommon.push(i as u32);
            }
            i += 1;
        }
        (n, n_flat)
    }

    /// How light scatters where paths are and it is not known yet, and what is emitted there.
    fn shade(
        &self,
        b: &mut Batch,
        depth: u32,
        scene: &Scene,
        samples: &mut [BatchSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        for k in 0..b.flat_lamps.len() {
            let (i, light) = b.flat_lamps[k];
            let (i, s) = (i as usize, b.sample[i as usize] as usize);
            b.meet_lamp(i, scene, light, b.triangles.uv(i), &samples[s].lambda);
        }
        for k in 0..b.uncommon.len() {
            let i = b.uncommon[k] as usize;
            let s = b.sample[i] as usize;
            if let Surface::Flat(material, light) = b.surface[i] {
                let lambda = samples[s].lambda;
                let (frame, textures, after) = (b.at.frame(i), &scene.textures, &mut samples[s].lambda);
                if let Some(bsdf) = scene.materials.plain_bsdf(material, frame, textures, &nowhere(), after) {
                    b.set_alone(i, bsdf);
                    if let Some(light) = light {
                        b.meet_lamp(i, scene, light, b.triangles.uv(i), &lambda);
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
        sample: &mut BatchSample,
        radiance: &mut SampledSpectrum,
        stats: &mut RenderStats,
    ) {
        let Some(hit) = b.met[i] else { return };
        let ray = b.ray(i);
        let mut at = Interaction::unknown(&ray, hit.t);
        let lambda = sample.lambda;
        scene.geometry.fill_in_plainly(&ray, &hit, &mut at, |material, light| {
            b.is_plain_lamp(light) && !matches!(b.plain(scene, material, &lambda), Plain::Other)
        });
        let frame = if b.set_plain(i, scene, at.material, &lambda) {
            Frame::from_z_near_x(at.ns.as_vec(), at.dpdus)
        } else {
            let sees_texture = depth == 0 && scene.materials.is_textured(at.material);
            let camera_ray = if sees_texture { sample.camera_ray(scene) } else { None };
            let footprint = scene.texture_context(&at, camera_ray.as_ref());
            let stream = sample.stream(scene);
            let (mix, mut after) = (stream.mix(depth), lambda);
            let bsdf = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut after, mix);
            let Some(bsdf) = bsdf else {
                // An interface: the path would come to its next vertex one step after the others.
                b.set_gone(i);
                let mut walk = b.walk(i, depth);
                self.go_alone(&mut walk, radiance, scene, sample, stats);
                return;
            };
            sample.lambda = after;
            match bsdf.bxdf {
                Bxdf::Diffuse(diffuse) => b.set_diffuse(i, diffuse.reflectance),
                Bxdf::Conductor(metal) if !metal.facets().is_smooth() => b.set_metal(i, metal),
                _ => b.set_alone(i, bsdf),
            }
            bsdf.frame
        };
        b.at.set(i, &at, &frame);
        if let Some(light) = at.light {
            b.meet_lamp(i, scene, light, at.uv, &lambda);
        }
    }

    #[inline(never)]
    fn go_alone(
        &self,
        walk: &mut Walk,
        radiance: &mut SampledSpectrum,
        scene: &Scene,
        sample: &mut BatchSample,
        stats: &mut RenderStats,
    ) {
        let (Some(ray), stream) = (sample.camera_ray(scene), sample.stream(scene)) else { return };
        self.follow(walk, radiance, None, scene, &ray, &stream, &mut sample.lambda, &mut [], stats, &mut NoRecord);
    }

    /// Plays roulette and traces the rays of paths that go on, `depth` scattering events by then. How many do.
    fn go_on(&self, b: &mut Batch, n: usize, depth: u32, scene: &Scene, stats: &mut RenderStats) -> usize {
        let directions = b.count_going(n);
        scene.geometry.level().run(Survive { batch: b, n, roulette: self.roulette, depth });
        stats.scatterings += directions;
        stats.longest_path = stats.longest_path.max(if directions > 0 { depth } else { 0 });
        let n = b.leave(n, scene);
        stats.bounce_rays += n as u64;
        b.light_choice = self.light_choice_at(scene, depth - 1);
        if self.is_at_limit(depth) && only_the_sky_counts(scene) {
            return those_that_escape(b, n, scene);
        }
        scene.geometry.intersect_rays(&mut b.rays, true, &scene.alpha(), &mut b.met[..n]);
        n
    }
}

/// Whether all that matters at the end of the longest paths is whether they leave the scene: no surface shines or lets them pass, or ends
/// wavelengths by dispersion, for which the path's other light is counted differently.
fn only_the_sky_counts(scene: &Scene) -> bool {
    scene.geometry.emitters().is_empty() && !scene.materials.may_pass() && scene.basis() == Basis::Rgb
}

/// Ends the paths whose rays meet anything. How many leave the scene.
fn those_that_escape(b: &mut Batch, n: usize, scene: &Scene) -> usize {
    scene.geometry.occluded_rays(&mut b.rays, &scene.alpha());
    let mut escaping = 0;
    for i in 0..n {
        if b.rays.is_blocked(i) {
            continue;
        }
        b.shift(escaping, i);
        b.met[escaping] = None;
        escaping += 1;
    }
    escaping
}
