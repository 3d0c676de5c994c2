//! Small pictures as numbers with error bars, taken apart by what each path contributed.
//!
//! An [`Estimator`] tells every contribution that it adds, so that one run gives the picture and any division of it: by
//! bounces, by technique, by the kinds of scattering on the way.

use cpu_time::ThreadTime;
use irradiant::core::bxdf::Lobe;
use irradiant::core::camera::CameraRay;
use irradiant::core::film::{DevelopOptions, FilmTile};
use irradiant::core::interaction::LightId;
use irradiant::core::sampler::SampleStream;
use irradiant::core::scene::Scene;
use irradiant::image::Image;
use irradiant::math::Ray;
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::renderer::path::{PathIntegrator, Roulette};
use irradiant::renderer::record::{Contribution, PathRecorder, Scattering, Technique};
use irradiant::renderer::{Integrator, RenderStats, WorkUnit};
use irradiant::spectrum::{SampledSpectrum, Wavelengths};
use irradiant_testkit::Mean;

/// One contribution to a sample.
pub struct Part<'a> {
    /// Scattering events between eye and light.
    pub bounces: u32,
    /// Radiance that reaches the eye, all weights included.
    pub radiance: SampledSpectrum,
    /// A ray met the light; else the light was sampled.
    pub by_hit: bool,
    /// The light.
    pub light: LightId,
    /// The lobes that scattering chose, from the eye on. Of a sampled light the last vertex is missing: it is never specular.
    pub lobes: &'a [Lobe],
}

/// What estimates radiance along a camera ray and tells of what it is the sum.
pub trait Estimator: Sync {
    /// One sample. What is told adds up to what is returned (but for rounding).
    fn sample(
        &self,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
        tell: &mut dyn FnMut(&Part),
    ) -> SampledSpectrum;
}

/// The production integrator.
#[derive(Default)]
pub struct Production {
    /// Scattering events at most.
    pub max_depth: Option<u32>,
    /// When paths end by chance.
    pub roulette: Roulette,
    /// Whether each surface asks one light, which the light sampler picks, and does not choose among candidates.
    pub one_light: bool,
}

impl Production {
    /// With at most so many scattering events.
    pub fn limited(depth: u32) -> Self {
        Self { max_depth: Some(depth), ..Self::default() }
    }
}

struct Telling<'a> {
    tell: &'a mut dyn FnMut(&Part),
    lobes: Vec<Lobe>,
}

impl PathRecorder for Telling<'_> {
    fn begin(&mut self, _: &Wavelengths) {
        self.lobes.clear();
    }

    fn scattering(&mut self, s: &Scattering) {
        self.lobes.push(s.lobe);
    }

    fn contribution(&mut self, c: &Contribution) {
        (self.tell)(&Part {
            bounces: c.bounces,
            radiance: c.radiance,
            by_hit: c.technique == Technique::Hit,
            light: c.light,
            lobes: &self.lobes,
        });
    }
}

impl Estimator for Production {
    fn sample(
        &self,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
        tell: &mut dyn FnMut(&Part),
    ) -> SampledSpectrum {
        let mut integrator =
            PathIntegrator { max_depth: self.max_depth, roulette: self.roulette, ..Default::default() };
        if self.one_light {
            integrator.light_candidates = 1;
        }
        let mut telling = Telling { tell, lobes: Vec::new() };
        integrator.radiance(scene, camera_ray, stream, lambda, &mut [], stats, &mut telling)
    }
}

/// A picture of means with the variances of these means.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    /// Pixels per row.
    pub width: usize,
    /// Samples per pixel.
    pub spp: u32,
    /// Linear RGB.
    pub mean: Vec<[f64; 3]>,
    /// Of each of `mean`.
    pub variance: Vec<[f64; 3]>,
    /// What was done for it (all parts of one run share it).
    pub stats: RenderStats,
}

impl Estimate {
    /// Mean over the picture and its standard error, by channel.
    pub fn total(&self) -> [(f64, f64); 3] {
        let n = self.mean.len() as f64;
        std::array::from_fn(|c| {
            let mean = self.mean.iter().map(|p| p[c]).sum::<f64>() / n;
            (mean, self.variance.iter().map(|p| p[c]).sum::<f64>().sqrt() / n)
        })
    }

    /// The picture's mean as its only pixel: for light that so few paths bring that its tiles do not know their noise.
    pub fn as_one(&self) -> Self {
        let total = self.total();
        let (mean, variance) = (vec![total.map(|t| t.0)], vec![total.map(|t| t.1 * t.1)]);
        Self { width: 1, spp: self.spp, mean, variance, stats: self.stats.clone() }
    }

    /// Mean over picture and channels.
    pub fn grey(&self) -> f64 {
        self.total().iter().map(|t| t.0).sum::<f64>() / 3.0
    }

    /// Variance of one sample of the green channel, mean over pixels.
    pub fn sample_variance(&self) -> f64 {
        self.variance.iter().map(|v| v[1]).sum::<f64>() / self.mean.len() as f64 * f64::from(self.spp)
    }

    /// The sum of two independent estimates, scaled.
    pub fn plus(&self, scale: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for i in 0..sum.mean.len() {
            for c in 0..3 {
                sum.mean[i][c] += scale * other.mean[i][c];
                sum.variance[i][c] += scale * scale * other.variance[i][c];
            }
        }
        sum
    }

    /// Part of the picture: pixels for which `keep(x, y)`, as one row.
    pub fn region(&self, keep: impl Fn(usize, usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.mean.len()).filter(|i| keep(i % self.width, i / self.width)).collect();
        Self {
            width: kept.len(),
            spp: self.spp,
            mean: kept.iter().map(|&i| self.mean[i]).collect(),
            variance: kept.iter().map(|&i| self.variance[i]).collect(),
            stats: self.stats.clone(),
        }
    }

    /// Root mean square of the difference to a reference, relative to the reference's mean, green channel.
    pub fn rmse(&self, reference: &Self) -> f64 {
        let n = self.mean.len() as f64;
        let square: f64 = self.mean.iter().zip(&reference.mean).map(|(a, b)| (a[1] - b[1]).powi(2)).sum();
        (square / n).sqrt() / (reference.mean.iter().map(|p| p[1]).sum::<f64>() / n)
    }

    /// As a picture.
    pub fn image(&self) -> Image {
        Image::from_fn(self.width, self.mean.len() / self.width.max(1), ["R", "G", "B"], |x, y| {
            self.mean[y * self.width + x].map(|v| v as f32)
        })
    }
}

/// Takes `spp` samples of every pixel; parts go to the channel that `classify` names (none: nowhere). Returns the channels and
/// then the whole.
pub fn take_apart(
    scene: &Scene,
    estimator: &dyn Estimator,
    spp: u32,
    channels: usize,
    classify: &dyn Fn(&Part) -> Option<usize>,
) -> Vec<Estimate> {
    let bounds = scene.bounds();
    let mut stats = RenderStats::default();
    let mut parts: Vec<Estimate> = vec![Estimate { width: bounds.width(), spp, ..Estimate::default() }; channels + 1];
    let mut sums = vec![SampledSpectrum::ZERO; channels + 1];
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let mut means = vec![[Mean::new(); 3]; channels + 1];
            for index in 0..spp {
                let sample = camera_sample(scene, [x, y], index);
                sums.fill(SampledSpectrum::ZERO);
                let mut lambda = sample.lambda;
                stats.paths += 1;
                let mut weight = sample.filter_weight;
                if let Some(ray) = &sample.camera_ray {
                    let mut tell = |part: &Part| {
                        if let Some(channel) = classify(part) {
                            sums[channel] += part.radiance;
                        }
                    };
                    let all = estimator.sample(scene, ray, &sample.stream, &mut lambda, &mut stats, &mut tell);
                    sums[channels] = all;
                    weight *= ray.weight;
                }
                for (sum, mean) in sums.iter().zip(&mut means) {
                    let rgb = scene.film_rgb(*sum, &lambda);
                    (0..3).for_each(|c| mean[c].add(f64::from(rgb[c] * weight)));
                }
            }
            for (part, mean) in parts.iter_mut().zip(&means) {
                part.mean.push(std::array::from_fn(|c| mean[c].mean()));
                part.variance.push(std::array::from_fn(|c| mean[c].variance() / f64::from(spp)));
            }
        }
    }
    parts.iter_mut().for_each(|p| p.stats = stats.clone());
    parts
}

/// The picture as a whole.
pub fn whole(scene: &Scene, estimator: &dyn Estimator, spp: u32) -> Estimate {
    take_apart(scene, estimator, spp, 0, &|_| None).remove(0)
}

/// The picture by any of the program's integrators: what the film develops, with its pixels' own variances (which lack light
/// that lands in other pixels than its sample's), and this thread's CPU seconds.
pub fn by_integrator(scene: &Scene, integrator: &dyn Integrator, spp: u32) -> (Estimate, f64) {
    let bounds = scene.bounds();
    let start = ThreadTime::now();
    let mut film = scene.new_film();
    let mut tile = FilmTile::new(bounds, scene.layers.channels());
    let mut stats = RenderStats::default();
    integrator.render(scene, &WorkUnit { bounds, samples: 0..spp }, &mut tile, &mut stats);
    film.merge_tile(&tile);
    let seconds = start.elapsed().as_secs_f64();
    let image = film.develop(DevelopOptions::default());
    let mut estimate = Estimate { width: bounds.width(), spp, stats, ..Estimate::default() };
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let (u, v) = ((x - bounds.x0) as usize, (y - bounds.y0) as usize);
            estimate.mean.push(std::array::from_fn(|c| f64::from(image.get(u, v, c))));
            let pixel = film.pixel(x, y);
            estimate.variance.push(pixel.variance().map(|v| v / f64::from(pixel.count.max(1))));
        }
    }
    (estimate, seconds)
}

/// One sample of what a ray of one's own sees, and the parts of it by bounces in `by_bounce` (added).
pub fn along(scene: &Scene, estimator: &dyn Estimator, ray: Ray, index: u32, by_bounce: &mut [f64]) -> f64 {
    // A camera ray is only the bearer here; which pixel says which random numbers.
    let sample = camera_sample(scene, [(index >> 16) as i32, 7], index & 0xffff);
    let Some(mut camera_ray) = camera_sample(scene, [0, 0], 0).camera_ray else { return 0.0 };
    camera_ray.ray = ray;
    let mut lambda = sample.lambda;
    let mut stats = RenderStats::default();
    let all = estimator.sample(scene, &camera_ray, &sample.stream, &mut lambda, &mut stats, &mut |part| {
        if let Some(slot) = by_bounce.get_mut(part.bounces as usize) {
            *slot += f64::from(part.radiance[1]);
        }
    });
    f64::from(all[1])
}
