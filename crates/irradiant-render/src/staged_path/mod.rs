//! The path estimator's stages over many paths: [`PathIntegrator`]'s samples, to the bit, several at a time.
//!
//! The paths of a batch go from vertex to vertex together. A stage is a plain loop over the numbers of all paths, side by side in arrays
//! that stay in the cache ([`lanes`](irradiant_math::lanes)), which calls the functions that code for one path calls and is compiled for the
//! vectors of the processor ([`Kernel`]): random numbers, surfaces, points of lamps, scattered directions. Between them, path by path: rays,
//! spectra, roulette.
//!
//! Only what is common is computed in lanes: flat triangles, diffuse surfaces and rough metals, the light tree, rectangular and spherical lamps, an image of
//! the sky. For the rest each vertex is asked alone, by the functions that [`PathIntegrator::follow`] calls, and its answers are put into the
//! lanes. That loop stays the specification.
//!
//! In reading order: this file (the walk), `batch` (what paths carry), `lamps` (light of lamps, met and sampled), `kernels` (the stages in
//! lanes).

mod batch;
mod kernels;
mod lamps;

pub(crate) use batch::Batch;

use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::path::{PathIntegrator, Roulette, Walk, survival_probability};
use crate::record::NoRecord;
use batch::{Plain, Scattering, Surface, nowhere};
use irradiant_core::bxdf::{Bxdf, Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::geometry::Hit;
use irradiant_core::interaction::Interaction;
use irradiant_core::sampler::{SampleStream, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::{Frame, Ray, offset_ray_origin};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use kernels::{Numbers, PlacesOfBounces, PlacesOfCamera, Scatter, Surfaces};
use std::f32::consts::FRAC_1_PI;

impl PathIntegrator {
    /// Whether this scene's paths may go in batches.
    pub(crate) fn has_stages(&self, scene: &Scene) -> bool {
        self.light_splits == 1
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
        let (level, sky) = (scene.geometry.level(), scene.lights.sky().map(|(_, sky)| sky));
        let mut n = 0;
        for (s, sample) in samples.iter().enumerate() {
            let Some(camera_ray) = &sample.camera_ray else { continue };
            let ray = &camera_ray.ray;
            b.o.set(n, ray.o.to_array());
            b.d.set(n, ray.d.to_array());
            b.time[n] = ray.time;
            b.streams.set(n, &sample.stream);
            (b.throughput[n], b.roulette_scale[n]) = (SampledSpectrum::ONE, 1.0);
            (b.met[n], b.sample[n]) = (hits[s], s as u32);
            n += 1;
        }
        if let Some(sky) = sky
            && b.met[..n].iter().any(Option::is_none)
        {
            level.run(PlacesOfCamera(b, n, sky));
            for i in 0..n {
                b.escape_place[i] = b.met[i].map_or_else(|| Some(b.place(i, sky)), |_| None);
            }
        }
        let mut depth = 0;
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
            b.light_of_lamps(depth, scene, radiance);
            if self.is_at_limit(depth) {
                return;
            }
            level.run(Numbers(b, n, depth));
            b.light_samples(n, depth, scene, samples, radiance, stats);
            level.run(Scatter(b, n));
            if let Some(sky) = sky {
                level.run(PlacesOfBounces(b, n, sky));
            }
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
        b.lamps_met.clear();
        for i in 0..n {
            let s = b.sample[i] as usize;
            b.is_metal[i] = 0;
            let is_known = match b.surface[i] {
                Surface::Flat(material, light) => {
                    let lambda = samples[s].lambda;
                    let is_known = match b.plain(scene, material, &lambda) {
                        Plain::Diffuse(reflectance) => {
                            b.set_diffuse(i, reflectance);
                            true
                        }
                        Plain::Metal(metal) => {
                            b.set_metal(i, metal);
                            true
                        }
                        Plain::Other => {
                            let (frame, textures, after) = (b.at.frame(i), &scene.textures, &mut samples[s].lambda);
                            let bsdf = scene.materials.plain_bsdf(material, frame, textures, &nowhere(), after);
                            bsdf.map(|bsdf| b.set_alone(i, bsdf)).is_some()
                        }
                    };
                    if let (true, Some(light)) = (is_known, light) {
                        b.meet_lamp(i, scene, light, b.triangles.uv(i), &lambda);
                    }
                    is_known
                }
                Surface::Other => false,
            };
            if !is_known {
                self.shade_alone(b, i, depth, scene, &mut samples[s], &mut radiance[s], stats);
            }
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
        let lambda = sample.lambda;
        let frame = match b.plain(scene, at.material, &lambda) {
            Plain::Diffuse(reflectance) => {
                b.set_diffuse(i, reflectance);
                Frame::from_z_near_x(at.ns.as_vec(), at.dpdus)
            }
            Plain::Metal(metal) => {
                b.set_metal(i, metal);
                Frame::from_z_near_x(at.ns.as_vec(), at.dpdus)
            }
            Plain::Other => {
                let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
                let (mix, mut after) = (sample.stream.mix(depth), lambda);
                let bsdf = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut after, mix);
                let Some(bsdf) = bsdf else {
                    // An interface: the path would come to its next vertex one step after the others.
                    b.scattering[i] = Scattering::Gone;
                    let mut walk = b.walk(i, depth);
                    self.go_alone(&mut walk, radiance, scene, camera_ray, &sample.stream, &mut sample.lambda, stats);
                    return;
                };
                sample.lambda = after;
                match bsdf.bxdf {
                    Bxdf::Diffuse(diffuse) => b.set_diffuse(i, diffuse.reflectance),
                    Bxdf::Conductor(metal) if !metal.facets().is_smooth() => b.set_metal(i, metal),
                    _ => b.set_alone(i, bsdf),
                }
                bsdf.frame
            }
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
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
    ) {
        self.follow(walk, radiance, None, scene, camera_ray, stream, lambda, &mut [], stats, &mut NoRecord);
    }

    /// Plays roulette and traces the rays of paths that go on, `depth` scattering events by then. How many do.
    fn go_on(&self, b: &mut Batch, n: usize, depth: u32, scene: &Scene, stats: &mut RenderStats) -> usize {
        let sky = scene.lights.sky().map(|(_, sky)| sky);
        let mut stay = 0;
        for i in 0..n {
            let mut throughput = b.throughput[i];
            let (mut roulette_scale, mut specular) = (b.roulette_scale[i], false);
            let (wi, o, bsdf_pdf);
            match b.scattering[i] {
                Scattering::Gone => continue,
                Scattering::Diffuse => {
                    let f = b.reflectance[i] * FRAC_1_PI;
                    if f.is_black() || b.next_factor[i] < 0.0 {
                        continue;
                    }
                    throughput *= f * b.next_factor[i];
                    (wi, o, bsdf_pdf) = (b.next_d.vector(i), b.next_o.point(i), b.next_pdf[i]);
                }
                Scattering::Metal => {
                    if b.next_factor[i] < 0.0 {
                        continue;
                    }
                    let f = b.metal_f(i);
                    if f.is_black() || !f.is_finite() {
                        continue;
                    }
                    throughput *= f * b.next_factor[i];
                    (wi, o, bsdf_pdf) = (b.next_d.vector(i), b.next_o.point(i), b.next_pdf[i]);
                }
                Scattering::Alone(k) => {
                    let (bsdf, wo) = (&b.bsdfs[k as usize], b.at.wo.vector(i));
                    let [_, _, lobe, _] = &b.scatter.0;
                    let sample = bsdf.sample(wo, lobe[i], b.scatter.uv(i), TransportMode::Radiance, Sides::All);
                    let Some(sample) = sample else { continue };
                    throughput *= sample.f * (sample.wi.dot(bsdf.frame.z).abs() / sample.pdf);
                    specular = sample.lobe.is_specular();
                    if sample.lobe.is_transmissive() {
                        roulette_scale *= sample.eta * sample.eta;
                    }
                    wi = sample.wi;
                    o = offset_ray_origin(b.at.p.point(i), b.at.p_error.vector(i), b.at.n.normal(i), wi);
                    bsdf_pdf = if sample.pdf_is_proportional && !specular {
                        bsdf.pdf(wo, wi, TransportMode::Radiance, Sides::All)
                    } else {
                        sample.pdf
                    };
                }
            }
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
            let [p, p_error, n, ns] = &mut b.previous;
            p.set(stay, b.at.p.point(i).to_array());
            p_error.set(stay, b.at.p_error.vector(i).to_array());
            n.set(stay, b.at.n.normal(i).to_array());
            ns.set(stay, b.at.ns.normal(i).to_array());
            (b.bsdf_pdf[stay], b.specular[stay]) = (bsdf_pdf, specular);
            (b.throughput[stay], b.roulette_scale[stay]) = (throughput, roulette_scale);
            let ray = Ray::new(o, wi, b.time[i]);
            b.o.set(stay, ray.o.to_array());
            b.d.set(stay, ray.d.to_array());
            b.time[stay] = ray.time;
            b.streams.shift(stay, i);
            b.sample[stay] = b.sample[i];
            b.escape_place[stay] = match b.scattering[i] {
                Scattering::Alone(_) => scene.lights.place_of_escape(wi),
                Scattering::Diffuse | Scattering::Metal | Scattering::Gone => sky.map(|sky| b.place(i, sky)),
            };
            b.rays[stay] = ray;
            stay += 1;
        }
        scene.geometry.intersect_scattered(&b.rays[..stay], &scene.alpha(), &mut b.met[..stay]);
        stay
    }
}
