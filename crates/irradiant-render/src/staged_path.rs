//! The path estimator's stages over many paths: [`PathIntegrator`]'s samples, to the bit, several at a time.
//!
//! The paths of a batch go from vertex to vertex together. A stage is a plain loop over the numbers of all paths, side by side in arrays
//! that stay in the cache ([`lanes`](irradiant_math::lanes)), which calls the functions that code for one path calls and is compiled for the
//! vectors of the processor ([`Kernel`]): random numbers, surfaces, points of lamps, scattered directions. Between them, path by path: rays,
//! spectra, roulette.
//!
//! Only what is common is computed in lanes: flat triangles, diffuse scattering, rectangular lamps. For the rest each vertex is asked alone,
//! by the functions that [`PathIntegrator::follow`] calls, and its answers are put into the lanes. That loop stays the specification.

use crate::camera_samples::CameraSample;
use crate::integrator::RenderStats;
use crate::light_samples::direct_light;
use crate::path::{PathIntegrator, Previous, Roulette, Walk, power_heuristic, survival_probability};
use crate::record::NoRecord;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Bxdf, Diffuse, Sides, TransportMode, is_usable};
use irradiant_core::camera::CameraRay;
use irradiant_core::geometry::{EmitterShape, Hit, Kernel, RectangleLanes, SurfaceLanes, TriangleLanes};
use irradiant_core::interaction::{Interaction, LightId, MaterialId, ReferencePoint, TextureContext};
use irradiant_core::light::{AreaAlpha, AreaRadiance, Light, PixelLine, SampleMode};
use irradiant_core::light_sampler::LightSampler;
use irradiant_core::sampler::{BlockLanes, SampleStream, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3, offset_ray_origin};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::FRAC_1_PI;

/// How a path's vertex scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scattering {
    /// Diffusely, by the reflectance of its lane.
    Diffuse,
    /// By a model of its own: its place among those of the batch.
    Alone(u32),
    /// Not here: the path has been taken to its end.
    Gone,
}

/// What a path meets.
#[derive(Clone, Copy, Debug)]
enum Surface {
    /// A flat triangle of this material, perhaps a lamp.
    Flat(MaterialId, Option<LightId>),
    /// Something else.
    Other,
}

/// What the paths of a batch carry, side by side.
#[repr(C, align(64))]
pub(crate) struct Batch {
    // Between vertices.
    o: Triples,
    d: Triples,
    time: Floats,
    streams: StreamLanes,
    previous: [Triples; 4],
    bsdf_pdf: Floats,
    specular: [bool; LANES],
    throughput: [SampledSpectrum; LANES],
    roulette_scale: Floats,
    met: [Option<Hit>; LANES],
    escape_place: [Option<Point2>; LANES],
    /// Which of the batch's samples.
    sample: [u32; LANES],

    // At a vertex.
    surface: [Surface; LANES],
    triangles: TriangleLanes,
    at: SurfaceLanes,
    scattering: [Scattering; LANES],
    reflectance: [SampledSpectrum; LANES],
    bsdfs: Vec<Bsdf>,
    light: BlockLanes,
    scatter: BlockLanes,

    // Light samples.
    lamps: RectangleLanes,
    /// The lamp that each lane holds.
    lamp: [u32; LANES],
    two_sided: [u32; LANES],
    arriving: [SampledSpectrum; LANES],
    /// The chance with which the lamp was picked; 0 where none is sampled.
    pmf: Floats,
    /// Of diffuse surfaces the cosine where it is scattered, and the weight of the sample over its density.
    light_cosine: Floats,
    light_factor: Floats,
    /// Paths whose light samples are taken alone.
    light_alone: Vec<(u32, Option<PixelLine>)>,

    // Directions of diffuse surfaces.
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
            previous: [Triples::ZERO; 4],
            bsdf_pdf: [0.0; LANES],
            specular: [false; LANES],
            throughput: [SampledSpectrum::ZERO; LANES],
            roulette_scale: [0.0; LANES],
            met: [None; LANES],
            escape_place: [None; LANES],
            sample: [0; LANES],
            surface: [Surface::Other; LANES],
            triangles: TriangleLanes::NONE,
            at: SurfaceLanes::ZERO,
            scattering: [Scattering::Gone; LANES],
            reflectance: [SampledSpectrum::ZERO; LANES],
            bsdfs: Vec::with_capacity(LANES),
            light: BlockLanes::ZERO,
            scatter: BlockLanes::ZERO,
            lamps: RectangleLanes::NONE,
            lamp: [NO_LAMP; LANES],
            two_sided: [0; LANES],
            arriving: [SampledSpectrum::ZERO; LANES],
            pmf: [0.0; LANES],
            light_cosine: [0.0; LANES],
            light_factor: [0.0; LANES],
            light_alone: Vec::with_capacity(LANES),
            next_o: Triples::ZERO,
            next_d: Triples::ZERO,
            next_pdf: [0.0; LANES],
            next_factor: [0.0; LANES],
        })
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> Ray {
        Ray::new(self.o.point(i), self.d.vector(i), self.time[i])
    }

    /// A path on its way to what it meets.
    fn walk(&self, i: usize, depth: u32) -> Walk {
        let previous = (depth > 0).then(|| {
            let [p, p_error, n, ns] = &self.previous;
            let reference =
                ReferencePoint { p: p.point(i), p_error: p_error.vector(i), n: n.normal(i), ns: ns.normal(i) };
            Previous { reference, bsdf_pdf: self.bsdf_pdf[i], specular: self.specular[i], light_splits: 1 }
        });
        Walk {
            throughput: self.throughput[i],
            depth,
            roulette_scale: self.roulette_scale[i],
            previous,
            // Only regularisation asks, which has no stages.
            any_non_specular: depth > 0,
            escape_place: self.escape_place[i],
            ..Walk::from_camera(self.ray(i), self.met[i])
        }
    }

    /// What a path carries goes from lane `from` to lane `to`.
    #[inline(always)]
    fn shift(&mut self, to: usize, from: usize) {
        if to == from {
            return;
        }
        self.o.shift(to, from);
        self.d.shift(to, from);
        self.time[to] = self.time[from];
        self.streams.shift(to, from);
        self.previous.iter_mut().for_each(|t| t.shift(to, from));
        self.bsdf_pdf[to] = self.bsdf_pdf[from];
        self.specular[to] = self.specular[from];
        self.throughput[to] = self.throughput[from];
        self.roulette_scale[to] = self.roulette_scale[from];
        self.met[to] = self.met[from];
        self.escape_place[to] = self.escape_place[from];
        self.sample[to] = self.sample[from];
    }

    /// All that lights look at.
    fn interaction(&self, i: usize) -> Interaction {
        let n: Normal3 = self.at.n.normal(i);
        Interaction {
            p: self.at.p.point(i),
            p_error: self.at.p_error.vector(i),
            n,
            ns: self.at.ns.normal(i),
            wo: self.at.wo.vector(i),
            ..Interaction::unknown(&self.ray(i), 0.0)
        }
    }
}

/// Flat surfaces.
struct Surfaces<'a>(&'a mut Batch, usize);

impl Kernel for Surfaces<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        b.triangles.surfaces(n, &b.d, &mut b.at);
    }
}

/// The random numbers of a vertex.
struct Numbers<'a>(&'a mut Batch, usize, u32);

impl Kernel for Numbers<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n, depth) = self;
        b.streams.light(n, depth, &mut b.light);
        b.streams.scatter(n, depth, &mut b.scatter);
    }
}

/// Points of lamps, and how much of their light diffuse surfaces scatter along the path.
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
            let light_pdf = b.pmf[i] * b.lamps.pdf[i];
            let cosine = wi.dot(frame.z).abs();
            b.light_factor[i] = power_heuristic(light_pdf, pdf) / light_pdf;
            b.light_cosine[i] = if scatters { cosine } else { 0.0 };
        }
    }
}

/// Directions that diffuse surfaces scatter to, and the rays that go there.
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
            b.escape_place[n] = hits[s].map_or_else(|| scene.lights.place_of_escape(ray.d), |_| None);
            (b.throughput[n], b.roulette_scale[n]) = (SampledSpectrum::ONE, 1.0);
            (b.met[n], b.sample[n]) = (hits[s], s as u32);
            n += 1;
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
        // Nothing varies over plain materials, so that any place will do.
        let nowhere = TextureContext::without_footprint(Point3::ZERO, Normal3::ZERO, Point2::ZERO, 0);
        b.bsdfs.clear();
        for i in 0..n {
            let s = b.sample[i] as usize;
            if let Surface::Flat(material, light) = b.surface[i] {
                let (lambda, mut after) = (&samples[s].lambda, samples[s].lambda);
                let diffuse = scene.materials.plain_diffuse(material, &scene.textures, &nowhere, lambda);
                let scattering = if let Some(reflectance) = diffuse {
                    b.reflectance[i] = reflectance;
                    Some(Scattering::Diffuse)
                } else {
                    let frame = b.at.frame(i);
                    let bsdf = scene.materials.plain_bsdf(material, frame, &scene.textures, &nowhere, &mut after);
                    bsdf.map(|bsdf| {
                        b.bsdfs.push(bsdf);
                        Scattering::Alone(b.bsdfs.len() as u32 - 1)
                    })
                };
                if let Some(scattering) = scattering {
                    b.scattering[i] = scattering;
                    if light.is_some() {
                        let at = Interaction { light, uv: b.triangles.uv(i), ..b.interaction(i) };
                        radiance[s] += self.emitted(scene, &b.walk(i, depth), &at, lambda, &mut NoRecord);
                    }
                    if diffuse.is_none() {
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
        b.scattering[i] = if let Bxdf::Diffuse(diffuse) = &bsdf.bxdf {
            b.reflectance[i] = diffuse.reflectance;
            Scattering::Diffuse
        } else {
            b.bsdfs.push(bsdf);
            Scattering::Alone(b.bsdfs.len() as u32 - 1)
        };
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
            LightSampler::Uniform(_) if scene.lights.as_slice().len() == 1 => Some((LightId(0), 1.0)),
            _ => None,
        };
        let (sky, mode) = (scene.lights.sky(), SampleMode::Compensated);
        b.light_alone.clear();
        let mut any = false;
        for i in 0..n {
            b.pmf[i] = 0.0;
            let scatters = match b.scattering[i] {
                Scattering::Diffuse => !b.reflectance[i].is_black(),
                Scattering::Alone(k) => b.bsdfs[k as usize].flags().is_non_specular(),
                Scattering::Gone => false,
            };
            if !scatters {
                continue;
            }
            let draws = b.light.light_draws(i);
            let picked = only.or_else(|| {
                scene.light_sampler.sample(&b.at.reference(i), draws.pick).map(|picked| (picked.id, picked.pmf))
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
                b.arriving[i] = emission.sample(&samples[b.sample[i] as usize].lambda) * lamp.scale * alpha;
                b.pmf[i] = pmf;
                any = true;
            } else {
                let line = sky.filter(|(sky, _)| *sky == id).map(|(_, sky)| sky.seek(draws.uv, mode));
                b.light_alone.push((i as u32, line));
            }
        }
        if any {
            scene.geometry.level().run(SampleLamps(b, n));
            self.light_of_lamps(b, n, scene, radiance, stats);
        }
        let runs = |line: &Option<PixelLine>| line.zip(sky).map(|(line, (_, sky))| sky.approach(line, mode));
        let prepared: Vec<_> = b.light_alone.iter().map(|(_, line)| runs(line)).collect();
        for (&(i, _), run) in b.light_alone.iter().zip(prepared) {
            let i = i as usize;
            let s = b.sample[i] as usize;
            let diffuse = || Bsdf::new(b.at.frame(i), Bxdf::Diffuse(Diffuse::new(b.reflectance[i])));
            let made;
            let bsdf = if let Scattering::Alone(k) = b.scattering[i] {
                &b.bsdfs[k as usize]
            } else {
                made = diffuse();
                &made
            };
            radiance[s] += direct_light(
                scene,
                &b.interaction(i),
                bsdf,
                &b.throughput[i],
                &samples[s].lambda,
                &b.light.light_draws(i),
                run,
                1,
                depth,
                stats,
                &mut NoRecord,
            );
        }
    }

    /// What sampled points of rectangular lamps bring, unless something is in the way.
    fn light_of_lamps(
        &self,
        b: &mut Batch,
        n: usize,
        scene: &Scene,
        radiance: &mut [SampledSpectrum],
        stats: &mut RenderStats,
    ) {
        let alpha = scene.alpha();
        for i in 0..n {
            if !(b.pmf[i] > 0.0 && b.lamps.pdf[i] > 0.0) {
                continue;
            }
            let (f, factor) = match b.scattering[i] {
                Scattering::Alone(k) => {
                    let (bsdf, wi) = (&b.bsdfs[k as usize], b.lamps.wi.vector(i));
                    let (f, pdf) = bsdf.f_and_pdf(b.at.wo.vector(i), wi, TransportMode::Radiance);
                    let light_pdf = b.pmf[i] * b.lamps.pdf[i];
                    (f * wi.dot(bsdf.frame.z).abs(), power_heuristic(light_pdf, pdf) / light_pdf)
                }
                Scattering::Diffuse | Scattering::Gone => {
                    (b.reflectance[i] * FRAC_1_PI * b.light_cosine[i], b.light_factor[i])
                }
            };
            if f.is_black() || b.arriving[i].is_black() {
                continue;
            }
            stats.shadow_rays += 1;
            let segment = Ray::new(b.lamps.segment_o.point(i), b.lamps.segment_d.vector(i), b.time[i]);
            if scene.geometry.occluded_between(&segment, &alpha) {
                continue;
            }
            radiance[b.sample[i] as usize] += b.throughput[i] * f * b.arriving[i] * factor;
        }
    }

    /// Plays roulette and traces the rays of paths that go on, `depth` scattering events by then. How many do.
    fn go_on(&self, b: &mut Batch, n: usize, depth: u32, scene: &Scene, stats: &mut RenderStats) -> usize {
        let alpha = scene.alpha();
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
            b.escape_place[stay] = scene.lights.place_of_escape(wi);
            b.met[stay] = scene.geometry.intersect(&ray, f32::INFINITY, &alpha);
            stay += 1;
        }
        stay
    }
}
