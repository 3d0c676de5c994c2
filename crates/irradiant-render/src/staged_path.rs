//! The path estimator's stages over many paths: [`PathIntegrator`]'s samples, to the bit, several at a time.
//!
//! The paths of a batch go from vertex to vertex together. A stage is a plain loop over the numbers of all paths, side by side in arrays
//! that stay in the cache ([`lanes`](irradiant_math::lanes)), which calls the functions that code for one path calls and is compiled for the
//! vectors of the processor ([`Kernel`]): random numbers, surfaces, points of lamps, scattered directions. Between them, path by path: rays,
//! spectra, roulette.
//!
//! Only what is common has stages: flat triangles of plain diffuse materials, rectangular lamps. A path that meets something else goes on
//! alone, by [`PathIntegrator::follow`], which stays the specification; another kind of lamp is sampled alone.

use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_samples::direct_light;
use crate::path::{PathIntegrator, Previous, Roulette, Walk, power_heuristic, survival_probability};
use crate::record::NoRecord;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Bxdf, Diffuse, is_usable};
use irradiant_core::camera::CameraRay;
use irradiant_core::geometry::{EmitterShape, Hit, Kernel, RectangleLanes, SurfaceLanes, TriangleLanes};
use irradiant_core::interaction::{Interaction, LightId, MaterialId, ReferencePoint, TextureContext};
use irradiant_core::light::{AreaAlpha, AreaRadiance, Light};
use irradiant_core::light_sampler::LightSampler;
use irradiant_core::sampler::{BlockLanes, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3, offset_ray_origin};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::FRAC_1_PI;

/// What the paths of a batch carry, side by side.
#[repr(C, align(64))]
pub(crate) struct Batch {
    // Between vertices.
    o: Triples,
    d: Triples,
    time: Floats,
    streams: StreamLanes,
    previous_p: Triples,
    previous_p_error: Triples,
    previous_n: Triples,
    bsdf_pdf: Floats,
    throughput: [SampledSpectrum; LANES],
    met: [Option<Hit>; LANES],
    /// Which of the batch's samples.
    sample: [u32; LANES],

    // At a vertex.
    triangles: TriangleLanes,
    at: SurfaceLanes,
    reflectance: [SampledSpectrum; LANES],
    light_met: [Option<LightId>; LANES],
    light: BlockLanes,
    scatter: BlockLanes,

    // Light samples.
    lamps: RectangleLanes,
    /// The lamp that each lane holds.
    lamp: [u32; LANES],
    two_sided: [u32; LANES],
    arriving: [SampledSpectrum; LANES],
    pmf: Floats,
    /// The cosine where it is scattered, the weight of the sample over its density; 0 where nothing is.
    light_cosine: Floats,
    light_factor: Floats,

    // Directions.
    next_o: Triples,
    next_d: Triples,
    next_pdf: Floats,
    /// cos / pdf; negative where nothing is scattered.
    next_factor: Floats,
}

const NO_LAMP: u32 = u32::MAX;

impl Batch {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            o: Triples::ZERO,
            d: Triples::ZERO,
            time: [0.0; LANES],
            streams: StreamLanes::NONE,
            previous_p: Triples::ZERO,
            previous_p_error: Triples::ZERO,
            previous_n: Triples::ZERO,
            bsdf_pdf: [0.0; LANES],
            throughput: [SampledSpectrum::ZERO; LANES],
            met: [None; LANES],
            sample: [0; LANES],
            triangles: TriangleLanes::NONE,
            at: SurfaceLanes::ZERO,
            reflectance: [SampledSpectrum::ZERO; LANES],
            light_met: [None; LANES],
            light: BlockLanes::ZERO,
            scatter: BlockLanes::ZERO,
            lamps: RectangleLanes::NONE,
            lamp: [NO_LAMP; LANES],
            two_sided: [0; LANES],
            arriving: [SampledSpectrum::ZERO; LANES],
            pmf: [0.0; LANES],
            light_cosine: [0.0; LANES],
            light_factor: [0.0; LANES],
            next_o: Triples::ZERO,
            next_d: Triples::ZERO,
            next_pdf: [0.0; LANES],
            next_factor: [0.0; LANES],
        })
    }

    /// A path on its way to what it meets.
    fn walk(&self, i: usize, depth: u32) -> Walk {
        let ray = Ray::new(self.o.point(i), self.d.vector(i), self.time[i]);
        let previous = (depth > 0).then(|| {
            let n = self.previous_n.normal(i);
            let (p, p_error) = (self.previous_p.point(i), self.previous_p_error.vector(i));
            Previous {
                reference: ReferencePoint { p, p_error, n, ns: n },
                bsdf_pdf: self.bsdf_pdf[i],
                specular: false,
                light_splits: 1,
            }
        });
        Walk {
            throughput: self.throughput[i],
            depth,
            previous,
            any_non_specular: depth > 0,
            ..Walk::from_camera(ray, self.met[i])
        }
    }

    /// What it carries goes from lane `from` to lane `to`.
    #[inline(always)]
    fn shift(&mut self, to: usize, from: usize) {
        self.o.shift(to, from);
        self.d.shift(to, from);
        self.time[to] = self.time[from];
        self.streams.shift(to, from);
        self.previous_p.shift(to, from);
        self.previous_p_error.shift(to, from);
        self.previous_n.shift(to, from);
        self.bsdf_pdf[to] = self.bsdf_pdf[from];
        self.throughput[to] = self.throughput[from];
        self.sample[to] = self.sample[from];
    }

    #[inline(always)]
    fn reference(&self, i: usize) -> ReferencePoint {
        let n = self.at.n.normal(i);
        ReferencePoint { p: self.at.p.point(i), p_error: self.at.p_error.vector(i), n, ns: n }
    }

    /// All that lamps look at.
    fn interaction(&self, i: usize) -> Interaction {
        let ray = Ray::new(self.o.point(i), self.d.vector(i), self.time[i]);
        let n: Normal3 = self.at.n.normal(i);
        Interaction {
            p: self.at.p.point(i),
            p_error: self.at.p_error.vector(i),
            n,
            ns: n,
            uv: self.triangles.uv(i),
            wo: self.at.wo.vector(i),
            light: self.light_met[i],
            ..Interaction::unknown(&ray, self.met[i].map_or(0.0, |hit| hit.t))
        }
    }
}

/// Surfaces, and the random numbers there.
struct Arrive<'a>(&'a mut Batch, usize, u32);

impl Kernel for Arrive<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n, depth) = self;
        b.triangles.surfaces(n, &b.d, &mut b.at);
        b.streams.light(n, depth, &mut b.light);
        b.streams.scatter(n, depth, &mut b.scatter);
    }
}

/// Points of lamps, and how much of their light goes along the path.
struct SampleLamps<'a>(&'a mut Batch, usize);

impl Kernel for SampleLamps<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        let [u, v, ..] = &b.light.0;
        b.lamps.sample(n, &b.at, [u, v], &b.two_sided);
        for i in whole(n) {
            let frame = b.at.frame(i);
            let wi = b.lamps.wi.vector(i);
            let (local_o, local_i) = (frame.to_local(b.at.wo.vector(i)), frame.to_local(wi));
            let pdf = local_i.z.abs() * FRAC_1_PI;
            let scatters = is_usable(local_o) & is_usable(local_i) & (local_o.z * local_i.z > 0.0);
            let sample_pdf = b.lamps.pdf[i];
            let weight = power_heuristic(b.pmf[i] * sample_pdf, pdf);
            let factor = weight / (b.pmf[i] * sample_pdf);
            b.light_cosine[i] = wi.dot(frame.z).abs();
            b.light_factor[i] = factor;
            b.lamps.pdf[i] = if scatters { sample_pdf } else { 0.0 };
        }
    }
}

/// Scattered directions, and the rays that go there.
struct Scatter<'a>(&'a mut Batch, usize);

impl Kernel for Scatter<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        for i in whole(n) {
            let frame = b.at.frame(i);
            let wo = frame.to_local(b.at.wo.vector(i));
            let drawn = cosine_hemisphere(b.scatter.uv(i));
            let pdf = drawn.z * FRAC_1_PI;
            let local = Vec3::new(drawn.x, drawn.y, drawn.z.copysign(wo.z));
            let is_good = is_usable(wo) & (pdf > 0.0) & (pdf < f32::INFINITY) & is_usable(local);
            let wi = frame.from_local(local);
            let factor = wi.dot(frame.z).abs() / pdf;
            let o: Point3 = offset_ray_origin(b.at.p.point(i), b.at.p_error.vector(i), b.at.n.normal(i), wi);
            b.next_d.set(i, wi.to_array());
            b.next_o.set(i, o.to_array());
            b.next_pdf[i] = pdf;
            b.next_factor[i] = if is_good { factor } else { -1.0 };
        }
    }
}

impl PathIntegrator {
    /// Whether this scene's paths may go in batches.
    pub(crate) fn has_stages(&self, scene: &Scene) -> bool {
        let mut streams = StreamLanes::NONE;
        self.light_splits == 1
            && !self.regularize
            && scene.layers.channels() == 0
            && streams.set(0, &scene.sampler.stream([0, 0], 0))
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
        let level = scene.geometry.level();
        let mut n = 0;
        for (s, sample) in samples.iter().enumerate() {
            let Some(camera_ray) = &sample.camera_ray else { continue };
            let ray = &camera_ray.ray;
            b.o.set(n, ray.o.to_array());
            b.d.set(n, ray.d.to_array());
            b.time[n] = ray.time;
            b.streams.set(n, &sample.stream);
            (b.throughput[n], b.met[n], b.sample[n]) = (SampledSpectrum::ONE, hits[s], s as u32);
            n += 1;
        }
        let mut depth = 0;
        loop {
            n = self.arrive(b, n, depth, scene, samples, radiance, stats);
            if n == 0 {
                return;
            }
            level.run(Arrive(b, n, depth));
            for i in 0..n {
                if b.light_met[i].is_some() {
                    let s = b.sample[i] as usize;
                    let (walk, at) = (b.walk(i, depth), b.interaction(i));
                    radiance[s] += self.emitted(scene, &walk, &at, &samples[s].lambda, &mut NoRecord);
                }
            }
            if self.is_at_limit(depth) {
                return;
            }
            self.light_samples(b, n, depth, scene, samples, radiance, stats);
            level.run(Scatter(b, n));
            depth += 1;
            n = self.go_on(b, n, depth, scene, stats);
        }
    }

    /// Sorts paths by what they meet: those that have stages stay, the others are taken to their ends. How many stay.
    fn arrive(
        &self,
        b: &mut Batch,
        n: usize,
        depth: u32,
        scene: &Scene,
        samples: &mut [CameraSample],
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) -> usize {
        let mut stay = 0;
        for i in 0..n {
            let s = b.sample[i] as usize;
            let Some(hit) = b.met[i] else {
                radiance[s] += self.escaped(scene, &b.walk(i, depth), &samples[s].lambda, &mut NoRecord);
                continue;
            };
            if let Some((material, light)) = scene.geometry.flat_triangle(&hit, &mut b.triangles, stay)
                && let Some(reflectance) = plain_reflectance(scene, material, &samples[s].lambda)
            {
                b.shift(stay, i);
                b.met[stay] = Some(hit);
                (b.reflectance[stay], b.light_met[stay]) = (reflectance, light);
                stay += 1;
            } else {
                let sample = &mut samples[s];
                if let Some(camera_ray) = &sample.camera_ray {
                    let mut walk = b.walk(i, depth);
                    self.go_alone(
                        &mut walk,
                        &mut radiance[s],
                        scene,
                        camera_ray,
                        &sample.stream,
                        &mut sample.lambda,
                        stats,
                    );
                }
            }
        }
        stay
    }

    #[inline(never)]
    fn go_alone(
        &self,
        walk: &mut Walk,
        radiance: &mut SampledSpectrum,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &irradiant_core::sampler::SampleStream,
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
            LightSampler::Uniform(_) if scene.lights.as_slice().len() == 1 => Some((LightId(0), 1.0)),
            _ => None,
        };
        let mut any = false;
        for i in 0..n {
            b.pmf[i] = 0.0;
            if b.reflectance[i].is_black() {
                continue;
            }
            let s = b.sample[i] as usize;
            let draws = b.light.light_draws(i);
            let picked = only.or_else(|| {
                scene.light_sampler.sample(&b.reference(i), draws.pick).map(|picked| (picked.id, picked.pmf))
            });
            let Some((id, pmf)) = picked else { continue };
            if let Light::Area(lamp) = scene.lights.get(id)
                && let (EmitterShape::Rectangle(rectangle), AreaRadiance::Uniform(emission), AreaAlpha::Constant(alpha)) =
                    (&lamp.shape, &lamp.radiance, lamp.alpha)
            {
                if b.lamp[i] != id.0 {
                    b.lamps.set(i, rectangle);
                    (b.lamp[i], b.two_sided[i]) = (id.0, u32::from(lamp.two_sided));
                }
                b.arriving[i] = emission.sample(&samples[s].lambda) * lamp.scale * alpha;
                b.pmf[i] = pmf;
                any = true;
            } else {
                let at = b.interaction(i);
                let bsdf = Bsdf::new(b.at.frame(i), Bxdf::Diffuse(Diffuse::new(b.reflectance[i])));
                radiance[s] += direct_light(
                    scene,
                    &at,
                    &bsdf,
                    &b.throughput[i],
                    &samples[s].lambda,
                    &draws,
                    None,
                    1,
                    depth,
                    stats,
                    &mut NoRecord,
                );
            }
        }
        if !any {
            return;
        }
        scene.geometry.level().run(SampleLamps(b, n));
        let alpha = scene.alpha();
        for i in 0..n {
            if !(b.pmf[i] > 0.0 && b.lamps.pdf[i] > 0.0) {
                continue;
            }
            let f = b.reflectance[i] * FRAC_1_PI * b.light_cosine[i];
            if f.is_black() || b.arriving[i].is_black() {
                continue;
            }
            stats.shadow_rays += 1;
            let segment = Ray::new(b.lamps.segment_o.point(i), b.lamps.segment_d.vector(i), b.time[i]);
            if scene.geometry.occluded_between(&segment, &alpha) {
                continue;
            }
            radiance[b.sample[i] as usize] += b.throughput[i] * f * b.arriving[i] * b.light_factor[i];
        }
    }

    /// Plays roulette and traces the rays of paths that go on. How many do.
    fn go_on(&self, b: &mut Batch, n: usize, depth: u32, scene: &Scene, stats: &mut RenderStats) -> usize {
        let alpha = scene.alpha();
        let mut stay = 0;
        for i in 0..n {
            let f = b.reflectance[i] * FRAC_1_PI;
            if f.is_black() || b.next_factor[i] < 0.0 {
                continue;
            }
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(depth);
            let mut throughput = b.throughput[i];
            throughput *= f * b.next_factor[i];
            if throughput.is_black() {
                continue;
            }
            let survival = match self.roulette {
                Roulette::Throughput => survival_probability(&throughput, 1.0, depth),
                Roulette::Constant(q) => 1.0 - q,
            };
            if survival < 1.0 {
                if b.scatter.roulette(i) >= survival {
                    continue;
                }
                throughput *= 1.0 / survival;
            }
            stats.bounce_rays += 1;
            b.previous_p.set(stay, b.at.p.point(i).to_array());
            b.previous_p_error.set(stay, b.at.p_error.vector(i).to_array());
            b.previous_n.set(stay, b.at.n.normal(i).to_array());
            b.bsdf_pdf[stay] = b.next_pdf[i];
            b.throughput[stay] = throughput;
            let ray = Ray::new(b.next_o.point(i), b.next_d.vector(i), b.time[i]);
            b.o.set(stay, ray.o.to_array());
            b.d.set(stay, ray.d.to_array());
            b.time[stay] = ray.time;
            b.streams.shift(stay, i);
            b.sample[stay] = b.sample[i];
            b.met[stay] = scene.geometry.intersect(&ray, f32::INFINITY, &alpha);
            stay += 1;
        }
        stay
    }
}

/// What a material reflects that has stages.
#[inline]
fn plain_reflectance(scene: &Scene, material: MaterialId, lambda: &Wavelengths) -> Option<SampledSpectrum> {
    // Nothing varies over it, so that any place will do.
    let nowhere = TextureContext::without_footprint(Point3::ZERO, Normal3::ZERO, Point2::ZERO, 0);
    scene.materials.plain_diffuse(material, &scene.textures, &nowhere, lambda)
}
