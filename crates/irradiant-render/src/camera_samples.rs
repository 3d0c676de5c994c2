//! The loop that camera-based integrators share: each sample of each pixel of a work unit, from the camera's random
//! numbers to the film.

use crate::integrator::{RenderStats, WorkUnit};
use irradiant_core::camera::{CameraLanes, CameraRay};
use irradiant_core::film::FilmTile;
use irradiant_core::geometry::{Hit, Kernel, RayBatch};
use irradiant_core::sampler::{BlockLanes, CameraDraws, SampleStream, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{Floats, LANES, Triples, WHOLE, whole};
use irradiant_math::{Point2, Point3, Ray, Vec3};
use irradiant_spectrum::{Basis, SampledSpectrum, Wavelengths};
use std::ops::Range;

/// A sample on its way: random numbers, wavelengths, the camera's ray.
#[derive(Clone, Copy)]
pub struct CameraSample<'a> {
    /// Pixel.
    pub pixel: [i32; 2],
    /// Sample index.
    pub index: u32,
    /// Its random numbers.
    pub stream: SampleStream<'a>,
    /// Its wavelengths, before any vertex has ended the secondary ones.
    pub lambda: Wavelengths,
    /// Weight of the pixel filter (mean 1).
    pub filter_weight: f32,
    /// The ray; none where the camera sees nothing (vignetting).
    pub camera_ray: Option<CameraRay>,
}

/// Draws the camera's part of a sample.
#[inline]
pub fn camera_sample(scene: &Scene, pixel: [i32; 2], index: u32) -> CameraSample<'_> {
    let stream = scene.sampler.stream(pixel, index);
    camera_sample_by(scene, pixel, index, stream, stream.camera())
}

/// As [`camera_sample`], by these numbers.
#[inline]
pub fn camera_sample_by<'a>(
    scene: &'a Scene,
    pixel: [i32; 2],
    index: u32,
    stream: SampleStream<'a>,
    draws: CameraDraws,
) -> CameraSample<'a> {
    let lens = if scene.camera.has_lens() { stream.lens() } else { LENS_CENTER };
    let lambda = scene.sample_wavelengths(draws.wavelength);
    let filtered = scene.filter.sample(scene.film_draw(draws.film));
    let film = Point2::new(on_film(pixel[0], filtered.offset[0]), on_film(pixel[1], filtered.offset[1]));
    let camera_ray = scene.camera.generate_ray(film, lens, draws.time);
    CameraSample { pixel, index, stream, lambda, filter_weight: filtered.weight, camera_ray }
}

/// Where rays pass a camera that has no lens.
const LENS_CENTER: Point2 = Point2 { x: 0.5, y: 0.5 };

/// A coordinate on the film, pixels, so far from the middle of a pixel.
#[inline(always)]
fn on_film(pixel: i32, offset: f32) -> f32 {
    pixel as f32 + 0.5 + offset
}

/// Camera rays that are traced together.
///
/// Neighbours in the picture go the same way, so that their walks through the tree are one walk: in the Cornell box a camera ray
/// then takes 0.6 of the instructions.
const TOGETHER: usize = 64;

/// Samples are taken in squares of so many pixels a side: those of a few samples per pixel fill a batch with neighbours.
const SQUARE: usize = 4;

/// Takes all samples of a unit. `radiance` estimates what a camera ray sees (W m^-2 sr^-1 nm^-1 at the sample's
/// wavelengths, which it may reduce to one), and may fill the film's layers.
pub fn for_each_sample(
    scene: &Scene,
    unit: &WorkUnit,
    tile: &mut FilmTile,
    stats: &mut RenderStats,
    mut radiance: impl FnMut(&CameraSample, &CameraRay, &mut Wavelengths, &mut [f32], &mut RenderStats) -> SampledSpectrum,
) {
    let mut layers = vec![0f32; scene.layers.channels()];
    for_each_place(unit, |pixel, index| {
        let sample = camera_sample(scene, pixel, index);
        add_sample(scene, &sample, tile, &mut layers, stats, &mut radiance);
    });
}

/// As [`for_each_sample`], for estimators that begin with the closest surface along the camera ray: `radiance` is told what
/// [`Geometry::intersect`](irradiant_core::geometry::Geometry::intersect) says of it, to the bit. Many rays are traced at once.
///
/// Two steps go before it, each taken for many samples before the next: `seek` and `approach` may ask for the memory that the
/// step after them reads.
pub fn for_each_first_hit<A, B>(
    scene: &Scene,
    unit: &WorkUnit,
    tile: &mut FilmTile,
    stats: &mut RenderStats,
    seek: impl Fn(&CameraSample, Option<Hit>) -> A,
    approach: impl Fn(A) -> B,
    mut radiance: impl FnMut(
        &CameraSample,
        &CameraRay,
        Option<Hit>,
        B,
        &mut Wavelengths,
        &mut [f32],
        &mut RenderStats,
    ) -> SampledSpectrum,
) {
    let mut layers = vec![0f32; scene.layers.channels()];
    let mut samples: Vec<CameraSample> = Vec::with_capacity(TOGETHER);
    let mut rays: Vec<Ray> = Vec::with_capacity(TOGETHER);
    let mut ends: Vec<f32> = Vec::with_capacity(TOGETHER);
    let mut hits = [None; TOGETHER];
    let mut sought: Vec<A> = Vec::with_capacity(TOGETHER);
    let mut approached: Vec<B> = Vec::with_capacity(TOGETHER);
    let mut take = |samples: &mut Vec<CameraSample>| {
        gather(samples, &mut rays, &mut ends);
        let hits = &mut hits[..rays.len()];
        scene.geometry.intersect_batch(&rays, &ends, &scene.alpha(), hits);
        sought.extend(samples.iter().zip(hits.iter()).map(|(sample, hit)| seek(sample, *hit)));
        approached.extend(sought.drain(..).map(&approach));
        for ((sample, hit), approached) in samples.drain(..).zip(hits).zip(approached.drain(..)) {
            add_sample(scene, &sample, tile, &mut layers, stats, |sample, ray, lambda, layers, stats| {
                radiance(sample, ray, *hit, approached, lambda, layers, stats)
            });
        }
    };
    for_each_place(unit, |pixel, index| {
        samples.push(camera_sample(scene, pixel, index));
        if samples.len() == TOGETHER {
            take(&mut samples);
        }
    });
    take(&mut samples);
}

/// A sample of a batch: what is not in lanes.
#[derive(Clone, Copy)]
pub(crate) struct BatchSample {
    /// Pixel.
    pub pixel: [i32; 2],
    /// Sample index.
    pub index: u32,
    /// Its wavelengths; once a vertex has ended the secondary ones, without those.
    pub lambda: Wavelengths,
    /// Weight of the pixel filter (mean 1).
    pub filter_weight: f32,
    /// What its camera ray counts for; none where the camera sees nothing.
    pub camera_weight: Option<f32>,
    film: Point2,
    lens: Point2,
    time_u: f32,
}

impl BatchSample {
    /// Its random numbers, named anew.
    pub fn stream<'a>(&self, scene: &'a Scene) -> SampleStream<'a> {
        scene.sampler.stream(self.pixel, self.index)
    }

    /// Its camera ray, made anew: few ask for the ray's neighbours.
    pub fn camera_ray(&self, scene: &Scene) -> Option<CameraRay> {
        scene.camera.generate_ray(self.film, self.lens, self.time_u)
    }
}

/// What a batch's samples begin with.
pub(crate) struct Beginnings<'a> {
    pub streams: &'a StreamLanes,
    pub rays: &'a CameraLanes,
    /// What the rays meet first.
    pub hits: &'a [Option<Hit>],
}

/// What taking many samples at once needs memory for: kept from one unit to the next.
pub(crate) struct SampleBatch {
    /// Samples put down.
    n: usize,
    pixels: [[i32; 2]; LANES],
    indices: [u32; LANES],
    samples: Vec<BatchSample>,
    streams: StreamLanes,
    /// The camera's numbers, and where on the lens.
    numbers: [BlockLanes; 2],
    filter_weights: Floats,
    camera: CameraLanes,
    rays: RayBatch,
    hits: [Option<Hit>; LANES],
    seen: [SampledSpectrum; LANES],
    rgb: Triples,
    refused: Vec<usize>,
}

impl SampleBatch {
    /// Of nothing yet.
    // Apart, so that what is made on the stack first is gone from it afterwards.
    #[inline(never)]
    pub fn new() -> Box<Self> {
        Box::new(Self {
            n: 0,
            pixels: [[0; 2]; LANES],
            indices: [0; LANES],
            samples: Vec::with_capacity(LANES),
            streams: StreamLanes::NONE,
            numbers: [BlockLanes::ZERO; 2],
            filter_weights: [0.0; LANES],
            camera: CameraLanes::NONE,
            rays: RayBatch::NONE,
            hits: [None; LANES],
            seen: [SampledSpectrum::ZERO; LANES],
            rgb: Triples::ZERO,
            refused: Vec::new(),
        })
    }

    /// As [`for_each_first_hit`], of estimators that take many samples at once: [`LANES`] at most, of streams that
    /// [have lanes](StreamLanes::can_hold), for films without layers. `radiance` is told the samples, what they begin with, and where to put
    /// what they see, which is zero so far.
    pub fn for_each(
        &mut self,
        scene: &Scene,
        unit: &WorkUnit,
        tile: &mut FilmTile,
        stats: &mut RenderStats,
        mut radiance: impl FnMut(&mut [BatchSample], Beginnings, &mut [SampledSpectrum], &mut RenderStats),
    ) {
        // Batches of about the same size, in whole vectors: a last one of a few samples would waste most of its stages.
        let all = unit.bounds.area() * unit.samples.len();
        let together = all.div_ceil(all.div_ceil(LANES).max(1)).next_multiple_of(WHOLE).min(LANES);
        for_each_pixel(unit, |pixel| {
            let mut samples = unit.samples.clone();
            while !samples.is_empty() {
                let end = samples.end.min(samples.start.saturating_add((together - self.n) as u32));
                if self.put(scene, pixel, samples.start..end) == together {
                    self.take(scene, tile, stats, &mut radiance);
                }
                samples.start = end;
            }
        });
        self.take(scene, tile, stats, &mut radiance);
    }

    /// Takes the samples that have been put down.
    fn take(
        &mut self,
        scene: &Scene,
        tile: &mut FilmTile,
        stats: &mut RenderStats,
        radiance: &mut impl FnMut(&mut [BatchSample], Beginnings, &mut [SampledSpectrum], &mut RenderStats),
    ) {
        self.trace(scene, 1);
        let n = self.samples.len();
        self.seen[..n].fill(SampledSpectrum::ZERO);
        let begin = Beginnings { streams: &self.streams, rays: &self.camera, hits: &self.hits[..n] };
        radiance(&mut self.samples, begin, &mut self.seen[..n], stats);
        scene.geometry.level().run(AddToFilm { batch: self, scene, tile });
        stats.paths += n as u64;
        stats.camera_rays += self.camera.weight[..n].iter().filter(|weight| !(**weight < 0.0)).count() as u64;
        for i in self.refused.drain(..) {
            let BatchSample { pixel: [x, y], index, .. } = self.samples[i];
            stats.refuse(x, y, index);
        }
    }

    /// Puts down samples of a pixel. How many there are now, [`LANES`] at most.
    #[inline]
    pub fn put(&mut self, scene: &Scene, pixel: [i32; 2], samples: Range<u32>) -> usize {
        self.streams.set(self.n, &scene.sampler, pixel, samples.clone());
        for index in samples {
            (self.pixels[self.n], self.indices[self.n]) = (pixel, index);
            self.n += 1;
        }
        self.n
    }

    /// Draws the camera's part of the samples that have been put down and traces its rays. So many samples, one after another, share the time
    /// of the first.
    pub fn trace(&mut self, scene: &Scene, of_one_time: usize) {
        self.draw(scene, of_one_time);
        let hits = &mut self.hits[..self.rays.len()];
        scene.geometry.intersect_rays(&mut self.rays, false, &scene.alpha(), hits);
    }

    /// The samples that have been traced, and what they begin with.
    pub fn traced(&mut self) -> (&mut [BatchSample], Beginnings<'_>) {
        let n = self.samples.len();
        let begin = Beginnings { streams: &self.streams, rays: &self.camera, hits: &self.hits[..n] };
        (&mut self.samples, begin)
    }

    fn draw(&mut self, scene: &Scene, of_one_time: usize) {
        scene.geometry.level().run(DrawRays { batch: self, scene, of_one_time });
        let n = std::mem::take(&mut self.n);
        self.samples.clear();
        let (camera, [_, _, wavelength, _]) = (&self.camera, &self.numbers[0].0);
        self.rays.take(n, &camera.o, &camera.d, &camera.time, |i| camera.end(i));
        self.samples.extend((0..n).map(|i| BatchSample {
            pixel: self.pixels[i],
            index: self.indices[i],
            lambda: scene.sample_wavelengths(wavelength[i]),
            filter_weight: self.filter_weights[i],
            camera_weight: (!(camera.weight[i] < 0.0)).then_some(camera.weight[i]),
            film: camera.film(i),
            lens: camera.lens(i),
            time_u: camera.time_u[i],
        }));
    }
}

/// What [`camera_sample_by`] draws for the samples that have been put down: random numbers, places on the film, rays.
struct DrawRays<'a> {
    batch: &'a mut SampleBatch,
    scene: &'a Scene,
    of_one_time: usize,
}

impl Kernel for DrawRays<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { batch: SampleBatch { n, pixels, streams, numbers, filter_weights, camera, .. }, scene, of_one_time } =
            self;
        let (n, [draws, lens]) = (*n, numbers);
        streams.camera(n, scene.basis() == Basis::Spectral, draws);
        if scene.camera.has_lens() {
            streams.lens(n, lens);
            for i in whole(n) {
                (camera.lens[0][i], camera.lens[1][i]) = (lens.uv(i).x, lens.uv(i).y);
            }
        } else {
            camera.lens = [[LENS_CENTER.x; LANES], [LENS_CENTER.y; LANES]];
        }
        for i in whole(n) {
            let u = scene.film_draw(draws.uv(i));
            (camera.film[0][i], camera.film[1][i]) = (u.x, u.y);
        }
        scene.filter.sample_lanes(n, &mut camera.film, filter_weights);
        for i in whole(n) {
            let ([x, y], at) = (pixels[i], camera.film(i));
            (camera.film[0][i], camera.film[1][i]) = (on_film(x, at.x), on_film(y, at.y));
        }
        let [_, _, _, time_u] = &draws.0;
        camera.time_u = *time_u;
        if of_one_time > 1 {
            for i in 0..n {
                camera.time_u[i] = time_u[i - i % of_one_time];
            }
        }
        scene.camera.rays(n, camera);
    }
}

/// As [`add_sample`], of what the samples of a batch have seen.
struct AddToFilm<'a> {
    batch: &'a mut SampleBatch,
    scene: &'a Scene,
    tile: &'a mut FilmTile,
}

impl Kernel for AddToFilm<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self {
            batch: SampleBatch { samples, pixels, filter_weights, camera, seen, rgb, refused, .. },
            scene,
            tile,
        } = self;
        let n = samples.len();
        // All of one kind of wavelengths, or one after another.
        let rgb_basis = Wavelengths::rgb();
        if scene.basis() == Basis::Rgb {
            for i in whole(n) {
                let seen = scene.film_rgb(seen[i] * camera.weight[i], &rgb_basis);
                rgb.set(i, seen);
            }
        } else {
            for i in 0..n {
                rgb.set(i, scene.film_rgb(seen[i] * camera.weight[i], &samples[i].lambda));
            }
        }
        for i in whole(n) {
            let weight = filter_weights[i];
            let sees = !(camera.weight[i] < 0.0);
            let weighted = |x: f32| if sees { x * weight } else { 0.0 };
            rgb.set(i, [weighted(rgb.x[i]), weighted(rgb.y[i]), weighted(rgb.z[i])]);
        }
        tile.add_lanes(&pixels[..n], rgb, refused);
    }
}

/// The camera rays of samples and how far they go. Where the camera sees nothing, a ray without length stands in.
fn gather(samples: &[CameraSample], rays: &mut Vec<Ray>, ends: &mut Vec<f32>) {
    rays.clear();
    ends.clear();
    for sample in samples {
        let nothing = || (Ray::new(Point3::ZERO, Vec3::Z, 0.0), 0.0);
        let (ray, end) = sample.camera_ray.map_or_else(nothing, |camera_ray| (camera_ray.ray, f32::INFINITY));
        rays.push(ray);
        ends.push(end);
    }
}

/// Each sample of each pixel, neighbours one after another.
fn for_each_place(unit: &WorkUnit, mut visit: impl FnMut([i32; 2], u32)) {
    for_each_pixel(unit, |pixel| unit.samples.clone().for_each(|index| visit(pixel, index)));
}

/// Each pixel, neighbours one after another.
fn for_each_pixel(unit: &WorkUnit, mut visit: impl FnMut([i32; 2])) {
    let b = &unit.bounds;
    for top in (b.y0..b.y1).step_by(SQUARE) {
        for left in (b.x0..b.x1).step_by(SQUARE) {
            for y in top..b.y1.min(top + SQUARE as i32) {
                for x in left..b.x1.min(left + SQUARE as i32) {
                    visit([x, y]);
                }
            }
        }
    }
}

/// Takes one sample. `layers` is scratch space.
#[inline]
fn add_sample(
    scene: &Scene,
    sample: &CameraSample,
    tile: &mut FilmTile,
    layers: &mut [f32],
    stats: &mut RenderStats,
    radiance: impl FnOnce(&CameraSample, &CameraRay, &mut Wavelengths, &mut [f32], &mut RenderStats) -> SampledSpectrum,
) {
    stats.paths += 1;
    layers.fill(0.0);
    let mut rgb = [0.0; 3];
    if let Some(camera_ray) = &sample.camera_ray {
        stats.camera_rays += 1;
        let mut lambda = sample.lambda;
        let l = radiance(sample, camera_ray, &mut lambda, layers, stats) * camera_ray.weight;
        let [r, g, b] = scene.film_rgb(l, &lambda);
        rgb = [r * sample.filter_weight, g * sample.filter_weight, b * sample.filter_weight];
        scene.layers.add_buckets(l, &lambda, layers);
        layers.iter_mut().for_each(|value| *value *= sample.filter_weight);
    }
    let [x, y] = sample.pixel;
    if !tile.add(x, y, rgb, layers) {
        stats.refuse(x, y, sample.index);
    }
}
