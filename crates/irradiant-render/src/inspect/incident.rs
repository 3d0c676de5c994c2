//! Light at a point: what arrives there from everywhere, and whether the rendering equation holds (B09, A31, B05).
//!
//! Incident radiance is path traced along each direction. Light that no direction can find (point and distant lights) is
//! added where it is scattered, as a sum and not an integral. Depth limits count from the point: what arrives there has one
//! scattering event less to go.

use super::Tally;
use super::view::{Grid, grid};
use crate::integrator::RenderStats;
use crate::path::PathIntegrator;
use crate::record::NoRecord;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::interaction::Interaction;
use irradiant_core::light::SampleMode;
use irradiant_core::sampler::{SampleStream, Sampler};
use irradiant_core::scene::Scene;
use irradiant_math::hash::hash2;
use irradiant_math::{Frame, Point2, Ray, Vec3, warp};
use irradiant_scene::desc::SamplerKind;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// An estimate in the film's RGB with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub rgb: [f64; 3],
    /// Its standard error.
    pub error: [f64; 3],
    /// Samples that were not finite and are left out.
    pub refused: u64,
}

impl Estimate {
    fn of(tally: &Tally<3>) -> Self {
        Self { rgb: tally.mean(), error: tally.error(), refused: tally.refused() }
    }

    /// Differences from another estimate in joint standard errors; 0 where both are the same number.
    pub fn z(&self, other: &Self) -> [f64; 3] {
        std::array::from_fn(|c| {
            let difference = self.rgb[c] - other.rgb[c];
            if difference == 0.0 { 0.0 } else { difference / self.error[c].hypot(other.error[c]) }
        })
    }
}

/// What to estimate.
#[derive(Clone, Copy, Debug)]
pub struct IncidentSettings {
    /// Side of the picture of the hemisphere, pixels.
    pub side: usize,
    /// Paths for each of its pixels.
    pub samples: u32,
    /// Of the random numbers.
    pub seed: u64,
}

/// Light at the surface that a ray meets.
#[derive(Clone, Debug)]
pub struct Incident {
    /// The surface.
    pub at: Interaction,
    /// Incident radiance over the hemisphere around the shading normal on the ray's side: a disk in which a direction lies at
    /// its component along the surface, so that equal areas are equal irradiance (Nusselt). 0 outside of the disk.
    pub hemisphere: Grid<[f32; 3]>,
    /// The tangents that are the picture's right and up, and the normal that is its middle.
    pub frame: Frame,
    /// Irradiance from that hemisphere, without point and distant lights.
    pub irradiance: Estimate,
    /// What the surface scatters towards the ray's origin: the integral of f L cos over the directions of the picture
    /// (and of the other side, if it transmits), mirrors and point and distant lights included.
    pub scattered: Estimate,
    /// The same by the path tracer, which samples lights and the BSDF.
    pub path_traced: Estimate,
    /// Emitted by the surface towards the ray's origin; part of neither.
    pub emitted: [f32; 3],
}

/// Measures the light at the surface that `ray` meets; `None` where it meets none.
pub fn incident(
    scene: &Scene,
    integrator: &PathIntegrator,
    ray: &Ray,
    settings: &IncidentSettings,
) -> Option<Incident> {
    let point = SurfacePoint::met_by(scene, integrator, ray)?;
    let sampler =
        |salt: u64| Sampler::new(SamplerKind::Independent, settings.samples, [1, 1], hash2(settings.seed, salt));
    let (of_hemisphere, of_rest, of_path) = (sampler(1), sampler(2), sampler(3));
    let side = settings.side.max(1);

    // The disk, a row at a time; each sample also counts for the integrals.
    let normal = point.at.ns.face_forward(point.at.wo).as_vec();
    let frame = Frame::from_z_near_x(normal, point.at.dpdus);
    let rows = grid(1, side, |_, y| {
        let mut row = Vec::with_capacity(side);
        for x in 0..side {
            let mut pixel = Tally::<6>::default();
            for index in 0..settings.samples {
                let stream = of_hemisphere.stream([x as i32, y as i32], index);
                let draws = stream.camera();
                let at = |i: usize, u: f32| 2.0 * (i as f32 + u) / side as f32 - 1.0;
                let (right, up) = (at(x, draws.film.x), -at(y, draws.film.y));
                let z2 = 1.0 - right * right - up * up;
                let mut lambda = scene.sample_wavelengths(draws.wavelength);
                if !(z2 > 0.0) {
                    pixel.add([0.0; 6]);
                    continue;
                }
                let w = frame.from_local(Vec3::new(right, up, z2.sqrt()));
                let bsdf = point.bsdf(&mut lambda, &stream);
                let l = point.arriving(w, &stream, &mut lambda);
                // The cosine with the shading normal is in the picture's measure already, unless relief has turned it.
                let f = bsdf.map_or(SampledSpectrum::ZERO, |b| {
                    b.f(point.at.wo, w, TransportMode::Radiance) * (b.abs_cos(w) / z2.sqrt())
                });
                let [r, g, b] = scene.film_rgb(l, &lambda).map(f64::from);
                let [fr, fg, fb] = scene.film_rgb(l * f, &lambda).map(f64::from);
                pixel.add([r, g, b, fr, fg, fb]);
            }
            row.push(pixel);
        }
        row
    });
    // A pixel is an area of the disk: (2 / side)^2.
    let area = 4.0 / (side * side) as f64;
    let (mut sum, mut square) = ([0.0; 6], [0.0; 6]);
    for pixel in rows.values.iter().flatten() {
        for c in 0..6 {
            sum[c] += pixel.mean()[c] * area;
            square[c] += (pixel.error()[c] * area).powi(2);
        }
    }
    let refused = rows.values.iter().flatten().map(Tally::refused).sum();
    let part = |first: usize| Estimate {
        rgb: std::array::from_fn(|c| sum[first + c]),
        error: std::array::from_fn(|c| square[first + c].sqrt()),
        refused,
    };
    // Of a pixel that the rim cuts, the mean over its part inside.
    let inside = |i: usize, j: usize| {
        let n = 16;
        let at = |i: usize, k: usize| 2.0 * (i as f32 + (k as f32 + 0.5) / n as f32) / side as f32 - 1.0;
        let hits = (0..n * n).filter(|k| at(i, k % n).powi(2) + at(j, k / n).powi(2) < 1.0).count();
        hits as f64 / (n * n) as f64
    };
    let values = rows.values.iter().flatten().enumerate().map(|(i, pixel)| {
        let share = inside(i % side, i / side);
        std::array::from_fn(|c| if share > 0.0 { (pixel.mean()[c] / share) as f32 } else { 0.0 })
    });
    let hemisphere = Grid { width: side, height: side, values: values.collect() };

    // What the picture does not hold: mirrors, point and distant lights, the other side.
    let many = settings.samples.saturating_mul((side * side / 4).max(1) as u32).min(1 << 20);
    let rest = average(many, |index| {
        let stream = of_rest.stream([0, 0], index);
        let mut lambda = scene.sample_wavelengths(stream.camera().wavelength);
        let l = point.rest(normal, &stream, &mut lambda);
        scene.film_rgb(l, &lambda).map(f64::from)
    });
    let path_traced = average(many, |index| {
        let stream = of_path.stream([0, 0], index);
        let mut lambda = scene.sample_wavelengths(stream.camera().wavelength);
        let all = point.leaving(&stream, &mut lambda) - point.emitted(&lambda);
        scene.film_rgb(all, &lambda).map(f64::from)
    });
    let (disk, rest) = (part(3), Estimate::of(&rest));
    let scattered = Estimate {
        rgb: std::array::from_fn(|c| disk.rgb[c] + rest.rgb[c]),
        error: std::array::from_fn(|c| disk.error[c].hypot(rest.error[c])),
        refused: disk.refused + rest.refused,
    };
    let lambda = scene.sample_wavelengths(0.5);
    Some(Incident {
        at: point.at,
        hemisphere,
        frame,
        irradiance: part(0),
        scattered,
        path_traced: Estimate::of(&path_traced),
        emitted: scene.film_rgb(point.emitted(&lambda), &lambda),
    })
}

/// The rendering equation at one point and direction.
#[derive(Clone, Copy, Debug)]
pub struct Residual {
    /// The point.
    pub at: Interaction,
    /// Radiance that leaves it, by the path tracer.
    pub left: Estimate,
    /// Emitted plus the integral of f L cos, by BSDF sampling alone.
    pub right: Estimate,
}

/// Tests the rendering equation at random points (A31): what the camera sees in random pixels, or what is met from there
/// after one or two uniformly random turns. Points that nothing leaves are kept: both sides must say so. Fewer points than
/// asked for where rays leave the scene.
pub fn residuals(scene: &Scene, integrator: &PathIntegrator, points: u32, samples: u32, seed: u64) -> Vec<Residual> {
    let sampler = |salt: u64| Sampler::new(SamplerKind::Independent, samples, [1, 1], hash2(seed, salt));
    let (of_points, of_left, of_right) = (sampler(4), sampler(5), sampler(6));
    let found = grid(1, points as usize, |_, i| {
        let pixel = [i as i32, 0];
        let ray = random_ray(scene, &of_points.stream(pixel, 0))?;
        let point = SurfacePoint::met_by(scene, integrator, &ray)?;
        let (mut left, mut right) = (Tally::default(), Tally::default());
        for index in 0..samples {
            let stream = of_left.stream(pixel, index);
            let mut lambda = scene.sample_wavelengths(stream.camera().wavelength);
            let l = point.leaving(&stream, &mut lambda);
            left.add(scene.film_rgb(l, &lambda).map(f64::from));
            let stream = of_right.stream(pixel, index);
            let mut lambda = scene.sample_wavelengths(stream.camera().wavelength);
            let emitted = point.emitted(&lambda);
            let l = emitted + point.scattered_by_bsdf(&stream, &mut lambda);
            right.add(scene.film_rgb(l, &lambda).map(f64::from));
        }
        Some(Residual { at: point.at, left: Estimate::of(&left), right: Estimate::of(&right) })
    });
    found.values.into_iter().flatten().collect()
}

/// All points together: the mean of left less right over the mean of left, in luminance-like green, with its error.
pub fn mean_residual(residuals: &[Residual]) -> (f64, f64) {
    let (mut difference, mut variance, mut left) = (0.0, 0.0, 0.0);
    for r in residuals {
        difference += r.left.rgb[1] - r.right.rgb[1];
        variance += r.left.error[1].powi(2) + r.right.error[1].powi(2);
        left += r.left.rgb[1];
    }
    if left > 0.0 { (difference / left, variance.sqrt() / left) } else { (difference, variance.sqrt()) }
}

fn average(samples: u32, value: impl Fn(u32) -> [f64; 3] + Sync) -> Tally<3> {
    // In rows of a fixed length, so that the sum does not depend on threads.
    const ROW: u32 = 256;
    let rows = grid(1, samples.div_ceil(ROW) as usize, |_, row| {
        let mut tally = Tally::<3>::default();
        let first = row as u32 * ROW;
        (first..samples.min(first + ROW)).for_each(|i| tally.add(value(i)));
        tally
    });
    let mut all = Tally::default();
    rows.values.iter().for_each(|row| all.merge(row));
    all
}

/// A ray into the scene: from the camera, then turned up to twice.
fn random_ray(scene: &Scene, stream: &SampleStream) -> Option<Ray> {
    let bounds = scene.bounds();
    let [x, y, turns, _] = stream.block(0);
    let film = Point2::new(bounds.x0 as f32 + x * bounds.width() as f32, bounds.y0 as f32 + y * bounds.height() as f32);
    let mut ray = scene.camera.generate_ray(film, Point2::new(0.5, 0.5), 0.5)?.ray;
    for turn in 0..(3.0 * turns) as u32 {
        let hit = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha())?;
        let at = scene.geometry.interaction(&ray, &hit);
        let [u, v, _, _] = stream.block(1 + turn);
        let w = warp::uniform_sphere(Point2::new(u, v));
        let outside = at.n.face_forward(at.wo).as_vec();
        ray = at.spawn_ray(if w.dot(outside) < 0.0 { -w } else { w });
    }
    Some(ray)
}

/// A surface with the ray that met it.
struct SurfacePoint<'a> {
    scene: &'a Scene,
    /// For light that leaves the point.
    integrator: PathIntegrator,
    ray: Ray,
    at: Interaction,
}

impl<'a> SurfacePoint<'a> {
    /// The first surface that is none of an interface.
    fn met_by(scene: &'a Scene, integrator: &PathIntegrator, ray: &Ray) -> Option<Self> {
        let hit = scene.geometry.intersect(ray, f32::INFINITY, &scene.alpha())?;
        let at = scene.geometry.interaction(ray, &hit);
        Some(Self { scene, integrator: *integrator, ray: *ray, at })
    }

    fn bsdf(&self, lambda: &mut Wavelengths, stream: &SampleStream) -> Option<Bsdf> {
        let scene = self.scene;
        let footprint = scene.texture_context(&self.at, None);
        scene.materials.bsdf(self.at.material, &scene.textures, &self.at, &footprint, lambda, stream.mix(BEYOND_DEPTH))
    }

    fn emitted(&self, lambda: &Wavelengths) -> SampledSpectrum {
        let at = &self.at;
        let light = at.light.map(|l| self.scene.lights.get(l).emitted(at.n, at.uv, at.wo, lambda));
        light.unwrap_or(SampledSpectrum::ZERO)
    }

    /// Radiance that leaves towards the ray's origin.
    fn leaving(&self, stream: &SampleStream, lambda: &mut Wavelengths) -> SampledSpectrum {
        trace(self.scene, &self.integrator, &self.ray, stream, lambda)
    }

    /// Radiance that arrives from direction `w`.
    fn arriving(&self, w: Vec3, stream: &SampleStream, lambda: &mut Wavelengths) -> SampledSpectrum {
        let Some(max_depth) = self.integrator.max_depth.map_or(Some(None), |n| n.checked_sub(1).map(Some)) else {
            return SampledSpectrum::ZERO;
        };
        trace(self.scene, &PathIntegrator { max_depth, ..self.integrator }, &self.at.spawn_ray(w), stream, lambda)
    }

    /// Scattered light of lights that no direction finds.
    fn by_delta_lights(&self, bsdf: &Bsdf, u: Point2, lambda: &Wavelengths) -> SampledSpectrum {
        if self.integrator.max_depth == Some(0) {
            return SampledSpectrum::ZERO;
        }
        let mut sum = SampledSpectrum::ZERO;
        for light in self.scene.lights.as_slice().iter().filter(|l| l.is_delta()) {
            let sample = light.sample(&self.at.reference(), u, lambda, SampleMode::Complete);
            let Some(s) = sample else { continue };
            let f = bsdf.f(self.at.wo, s.wi, TransportMode::Radiance) * bsdf.abs_cos(s.wi);
            if !f.is_black() && !self.scene.is_occluded(&self.at, &s) {
                sum += f * s.radiance * self.scene.opacity(&s) * (1.0 / s.pdf);
            }
        }
        sum
    }

    /// One sample of the right side's integral, drawn by the BSDF alone.
    fn scattered_by_bsdf(&self, stream: &SampleStream, lambda: &mut Wavelengths) -> SampledSpectrum {
        let Some(bsdf) = self.bsdf(lambda, stream) else { return SampledSpectrum::ZERO };
        let [u, v, lobe, _] = stream.block(BEYOND);
        let [a, b, _, _] = stream.block(BEYOND + 1);
        let mut sum = self.by_delta_lights(&bsdf, Point2::new(a, b), lambda);
        if let Some(s) = bsdf.sample(self.at.wo, lobe, Point2::new(u, v), TransportMode::Radiance, Sides::All) {
            sum += s.f * (bsdf.abs_cos(s.wi) / s.pdf) * self.arriving(s.wi, stream, lambda);
        }
        sum
    }

    /// What integrating over the hemisphere around `normal` leaves out: delta lights and lobes, the other side.
    fn rest(&self, normal: Vec3, stream: &SampleStream, lambda: &mut Wavelengths) -> SampledSpectrum {
        let Some(bsdf) = self.bsdf(lambda, stream) else { return SampledSpectrum::ZERO };
        let [u, v, lobe, _] = stream.block(BEYOND);
        let [a, b, c, d] = stream.block(BEYOND + 1);
        let mut sum = self.by_delta_lights(&bsdf, Point2::new(a, b), lambda);
        if bsdf.flags().is_specular()
            && let Some(s) = bsdf.sample(self.at.wo, lobe, Point2::new(u, v), TransportMode::Radiance, Sides::All)
            && s.lobe.is_specular()
        {
            sum += s.f * (bsdf.abs_cos(s.wi) / s.pdf) * self.arriving(s.wi, stream, lambda);
        }
        if bsdf.flags().is_non_specular() && bsdf.flags().is_transmissive() {
            let w = Frame::from_z(-normal).from_local(warp::uniform_hemisphere(Point2::new(c, d)));
            let f = bsdf.f(self.at.wo, w, TransportMode::Radiance) * (bsdf.abs_cos(w) * 2.0 * PI);
            if !f.is_black() {
                sum += f * self.arriving(w, stream, lambda);
            }
        }
        sum
    }
}

/// Blocks of numbers that no path reaches.
const BEYOND: u32 = 1 << 20;
/// A vertex that no path reaches: the point's own choice among mixed materials must not be that of the first surface met.
const BEYOND_DEPTH: u32 = 1 << 18;

fn trace(
    scene: &Scene,
    integrator: &PathIntegrator,
    ray: &Ray,
    stream: &SampleStream,
    lambda: &mut Wavelengths,
) -> SampledSpectrum {
    let mut stats = RenderStats::default();
    integrator.radiance(scene, &CameraRay::alone(*ray), stream, lambda, &mut [], &mut stats, &mut NoRecord)
}
