//! The loop that camera-based integrators share: each sample of each pixel of a work unit, from the camera's random
//! numbers to the film.

use crate::integrator::{RenderStats, WorkUnit};
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::geometry::{Hit, Kernel};
use irradiant_core::sampler::{BlockLanes, CameraDraws, SampleStream, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{LANES, WHOLE};
use irradiant_math::{Point2, Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

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
    camera_sample_of(scene, pixel, index, stream, draws, lens)
}

/// Where rays pass a camera that has no lens.
const LENS_CENTER: Point2 = Point2 { x: 0.5, y: 0.5 };

/// As [`camera_sample`], by these numbers.
#[inline(always)]
fn camera_sample_of<'a>(
    scene: &'a Scene,
    pixel: [i32; 2],
    index: u32,
    stream: SampleStream<'a>,
    draws: CameraDraws,
    lens: Point2,
) -> CameraSample<'a> {
    let lambda = scene.sample_wavelengths(draws.wavelength);
    let filtered = scene.filter.sample(scene.film_draw(draws.film));
    let film = Point2::new(pixel[0] as f32 + 0.5 + filtered.offset[0], pixel[1] as f32 + 0.5 + filtered.offset[1]);
    let camera_ray = scene.camera.generate_ray(film, lens, draws.time);
    CameraSample { pixel, index, stream, lambda, filter_weight: filtered.weight, camera_ray }
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

/// What taking many samples at once needs memory for: kept from one unit to the next.
pub(crate) struct SampleBatch<'a> {
    /// Samples put down: pixel, index, random numbers.
    places: Vec<([i32; 2], u32, SampleStream<'a>)>,
    samples: Vec<CameraSample<'a>>,
    streams: StreamLanes,
    /// The camera's numbers, and where on the lens.
    numbers: [BlockLanes; 2],
    rays: Vec<Ray>,
    ends: Vec<f32>,
    hits: [Option<Hit>; LANES],
    seen: [SampledSpectrum; LANES],
    layers: Vec<f32>,
}

impl<'a> SampleBatch<'a> {
    /// For a scene's samples.
    pub fn new(scene: &Scene) -> Self {
        Self {
            places: Vec::with_capacity(LANES),
            samples: Vec::with_capacity(LANES),
            streams: StreamLanes::NONE,
            numbers: [BlockLanes::ZERO; 2],
            rays: Vec::with_capacity(LANES),
            ends: Vec::with_capacity(LANES),
            hits: [None; LANES],
            seen: [SampledSpectrum::ZERO; LANES],
            layers: vec![0f32; scene.layers.channels()],
        }
    }

    /// As [`for_each_first_hit`], of estimators that take many samples at once: [`LANES`] at most, of streams that
    /// [have lanes](StreamLanes::can_hold). `radiance` is told the samples, their first hits, and where to put what they see, which is zero
    /// so far.
    pub fn for_each(
        &mut self,
        scene: &'a Scene,
        unit: &WorkUnit,
        tile: &mut FilmTile,
        stats: &mut RenderStats,
        mut radiance: impl FnMut(&mut [CameraSample], &[Option<Hit>], &mut [SampledSpectrum], &mut RenderStats),
    ) {
        // Batches of about the same size, in whole vectors: a last one of a few samples would waste most of its stages.
        let all = unit.bounds.area() * unit.samples.len();
        let together = all.div_ceil(all.div_ceil(LANES).max(1)).next_multiple_of(WHOLE).min(LANES);
        for_each_place(unit, |pixel, index| {
            if self.put(scene, pixel, index) == together {
                self.take(scene, tile, stats, &mut radiance);
            }
        });
        self.take(scene, tile, stats, &mut radiance);
    }

    /// Takes the samples that have been put down.
    fn take(
        &mut self,
        scene: &'a Scene,
        tile: &mut FilmTile,
        stats: &mut RenderStats,
        radiance: &mut impl FnMut(&mut [CameraSample], &[Option<Hit>], &mut [SampledSpectrum], &mut RenderStats),
    ) {
        self.trace(scene, 1);
        let (hits, seen) = (&self.hits[..self.samples.len()], &mut self.seen[..self.samples.len()]);
        seen.fill(SampledSpectrum::ZERO);
        radiance(&mut self.samples, hits, seen, stats);
        for (sample, seen) in self.samples.iter().zip(seen) {
            add_sample(scene, sample, tile, &mut self.layers, stats, |_, _, _, _, _| *seen);
        }
    }

    /// Puts down a sample. How many there are now, [`LANES`] at most.
    pub fn put(&mut self, scene: &'a Scene, pixel: [i32; 2], index: u32) -> usize {
        let stream = scene.sampler.stream(pixel, index);
        self.streams.set(self.places.len(), &stream);
        self.places.push((pixel, index, stream));
        self.places.len()
    }

    /// Draws the camera's part of the samples that have been put down and traces its rays. So many samples, one after another, share the time
    /// of the first.
    pub fn trace(&mut self, scene: &'a Scene, of_one_time: usize) {
        self.draw(scene, of_one_time);
        gather(&self.samples, &mut self.rays, &mut self.ends);
        let hits = &mut self.hits[..self.samples.len()];
        scene.geometry.intersect_batch(&self.rays, &self.ends, &scene.alpha(), hits);
    }

    /// The samples that have been traced, and what they meet.
    pub fn traced(&mut self) -> (&mut [CameraSample<'a>], &[Option<Hit>]) {
        let n = self.samples.len();
        (&mut self.samples, &self.hits[..n])
    }

    fn draw(&mut self, scene: &'a Scene, of_one_time: usize) {
        self.samples.clear();
        let has_lens = scene.camera.has_lens();
        scene.geometry.level().run(CameraNumbers {
            n: self.places.len(),
            streams: &self.streams,
            has_lens,
            numbers: &mut self.numbers,
        });
        let [camera, lens] = &self.numbers;
        for (i, (pixel, index, stream)) in self.places.drain(..).enumerate() {
            let lens = if has_lens { lens.uv(i) } else { LENS_CENTER };
            let time = camera.camera_draws(i - i % of_one_time).time;
            let draws = CameraDraws { time, ..camera.camera_draws(i) };
            self.samples.push(camera_sample_of(scene, pixel, index, stream, draws, lens));
        }
    }
}

/// The camera's random numbers.
struct CameraNumbers<'a> {
    n: usize,
    streams: &'a StreamLanes,
    has_lens: bool,
    numbers: &'a mut [BlockLanes; 2],
}

impl Kernel for CameraNumbers<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let [camera, lens] = self.numbers;
        self.streams.camera(self.n, camera);
        if self.has_lens {
            self.streams.lens(self.n, lens);
        }
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
    let b = &unit.bounds;
    for top in (b.y0..b.y1).step_by(SQUARE) {
        for left in (b.x0..b.x1).step_by(SQUARE) {
            for y in top..b.y1.min(top + SQUARE as i32) {
                for x in left..b.x1.min(left + SQUARE as i32) {
                    unit.samples.clone().for_each(|index| visit([x, y], index));
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
