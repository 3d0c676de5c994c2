//! Progressive photon mapping (Hachisuka, Ogaki and Jensen 2008) in its probabilistic form (Knaus and Zwicker 2011,
//! "Progressive photon mapping: a probabilistic approach"): independent passes with a radius that shrinks from one to the next,
//! whose pictures are averaged.
//!
//! Sample `i` of a pixel belongs to pass `i`: paths from lights leave photons where they meet surfaces after at least one
//! scattering event; the camera's ray goes on through mirrors and glass to the first surface that scatters otherwise, takes
//! direct light there as `path` does, and indirect light from the photons within the radius. Good at what no other
//! estimator here finds: caustics of small lights seen in mirrors and through glass.
//!
//! Biased: light is blurred over the radius, by an amount in proportion to its square; and consistent: the mean over
//! N passes has a bias of order `N^(alpha - 1)` and a variance of order `N^-alpha`, which both vanish (Knaus and Zwicker 2011,
//! section 3.3). The header names the radius.
//!
//! All of a pass share the time in the shutter, so that photons and rays see the same scene, and the wavelengths, so that a
//! photon's power means something to a ray (as pbrt-v4's sppm). Their noise is one for the whole picture and goes with the
//! number of passes.
//!
//! In reading order: this file, [`map`], [`passes`].

pub mod map;
mod passes;

use crate::camera_samples::{CameraSample, for_each_sample};
use crate::integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
use crate::light_walk::{shading_correction, start, survival, walk};
use crate::path::power_heuristic;
use crate::registry::{IntegratorEntry, OptionEntry, OptionRange, Value};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::interaction::{Interaction, ReferencePoint};
use irradiant_core::light::SampleMode;
use irradiant_core::scene::Scene;
use irradiant_math::Point2;
use irradiant_spectrum::{N_WAVELENGTHS, SampledSpectrum, Wavelengths};
use map::{Photon, PhotonMap};
use passes::Passes;
use std::f32::consts::PI;
use std::sync::OnceLock;

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonSettings {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Paths from lights in each pass; `None`: one for each pixel that is rendered.
    pub paths_per_pass: Option<u32>,
    /// Radius of the first pass, scene units, > 0; `None`: that of a few pixels where the camera looks.
    pub radius: Option<f32>,
    /// How slowly the radius shrinks, in (0, 1]: 2/3 makes error fall fastest, 1 keeps the radius, and its bias.
    pub alpha: f32,
}

impl Default for PhotonSettings {
    fn default() -> Self {
        Self { max_depth: None, paths_per_pass: None, radius: None, alpha: 0.67 }
    }
}

/// Progressive photon mapping.
#[derive(Debug)]
pub struct PhotonIntegrator {
    settings: PhotonSettings,
    /// What the settings leave open, as the scene decides.
    decided: OnceLock<Decided>,
    passes: Passes,
}

/// A pure function of settings and scene.
#[derive(Clone, Copy, Debug)]
struct Decided {
    paths: u32,
    radius: f32,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "photon",
    promise: "progressive photon mapping: passes of photons gathered within a radius that shrinks; biased by the radius, and \
              consistent: caustics of small lights seen in mirrors and through glass",
    source: "lecture B's \"next time: photon mapping\" (B46); Knaus and Zwicker 2011; pbrt-v4's \"sppm\"",
    options: &[
        OptionEntry {
            name: "paths",
            range: OptionRange::Count(0, 1 << 28),
            default: Value::Count(0),
            doc: "paths from lights in each pass, which is one sample of each pixel; 0 is one for each pixel",
        },
        OptionEntry {
            name: "radius",
            range: OptionRange::Number(0.0, 1e9),
            default: Value::Number(0.0),
            doc: "radius of the first pass in scene units; 0 is two pixels at the median distance of what the camera sees",
        },
        OptionEntry {
            name: "alpha",
            range: OptionRange::Number(0.01, 1.0),
            default: Value::Number(0.67),
            doc: "how slowly the radius shrinks; 1 keeps it, and its bias (B41)",
        },
    ],
    make: |options, max_depth| {
        let (paths, radius) = (options.count("paths"), options.number("radius"));
        Box::new(PhotonIntegrator::new(PhotonSettings {
            max_depth,
            paths_per_pass: (paths > 0).then_some(paths),
            radius: (radius > 0.0).then_some(radius),
            alpha: options.number("alpha"),
        }))
    },
};

/// Surfaces that face ways farther apart than this (cosine) are not one surface, however near.
const SAME_SURFACE: f32 = 0.5;

impl Integrator for PhotonIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let decided = self.decided(scene);
        for index in unit.samples.clone() {
            let shared = Shared::of(scene, index);
            let radius = radius_of_pass(decided.radius, self.settings.alpha, index);
            let pass = self.passes.get(index, decided.paths);
            let map = pass.map(radius, |path, photons| {
                self.trace(scene, index, path, decided.paths, &shared, photons, stats);
            });
            let one = WorkUnit { bounds: unit.bounds, samples: index..index + 1 };
            for_each_sample(scene, &one, tile, stats, |sample, camera_ray, lambda, layers, stats| {
                *lambda = shared.lambda;
                match shared.ray(scene, sample, camera_ray) {
                    Some(ray) => self.radiance(scene, sample, &ray, map, radius, lambda, layers, stats),
                    None => SampledSpectrum::ZERO,
                }
            });
        }
    }

    fn samples_per_unit(&self) -> u32 {
        1
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        self.decided(scene);
        Ok(())
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.settings.max_depth.map(Limit::MaxDepth);
        // Before a scene has decided the settings may leave it open.
        let radius = self.decided.get().map(|d| d.radius).or(self.settings.radius);
        let radius = radius.map_or("of two pixels".into(), |r| r.to_string());
        let bias = format!("photon radius {radius} at first, alpha {}", self.settings.alpha);
        let curves = Limit::Unfound("photons of lamps that are curves", &[SceneHas::CurvedLamps]);
        depth.into_iter().chain([curves, Limit::Bias(bias)]).collect()
    }
}

/// What a pass has in common.
struct Shared {
    lambda: Wavelengths,
    /// Fraction of the shutter's interval.
    time: f32,
}

impl Shared {
    fn of(scene: &Scene, index: u32) -> Self {
        // The numbers of a pixel that no film has.
        let draws = scene.sampler.stream([-1, -1], index).camera();
        Self { lambda: scene.sample_wavelengths(draws.wavelength), time: draws.time }
    }

    /// The sample's ray at the pass's time.
    fn ray(&self, scene: &Scene, sample: &CameraSample, drawn: &CameraRay) -> Option<CameraRay> {
        let [open, close] = scene.camera.shutter();
        if open == close {
            return Some(*drawn);
        }
        let offset = scene.filter.sample(scene.film_draw(sample.stream.camera().film)).offset;
        let [x, y] = sample.pixel.map(|x| x as f32 + 0.5);
        let lens = if scene.camera.has_lens() { sample.stream.lens() } else { Point2::new(0.5, 0.5) };
        scene.camera.generate_ray(Point2::new(x + offset[0], y + offset[1]), lens, self.time)
    }
}

/// Where the last scattering event was, for weighing a light that the next ray meets.
struct Previous {
    reference: ReferencePoint,
    pdf: f32,
    delta: bool,
}

impl PhotonIntegrator {
    /// What the settings leave open is decided by the first scene; one integrator is for one scene.
    pub fn new(settings: PhotonSettings) -> Self {
        Self { settings, decided: OnceLock::new(), passes: Passes::default() }
    }

    fn decided(&self, scene: &Scene) -> Decided {
        *self.decided.get_or_init(|| {
            let pixels = scene.bounds().area().min(1 << 26) as u32;
            let paths = self.settings.paths_per_pass.unwrap_or(pixels).max(1);
            Decided { paths, radius: self.settings.radius.unwrap_or_else(|| automatic_radius(scene)) }
        })
    }

    /// The photons of one path from a light.
    fn trace(
        &self,
        scene: &Scene,
        pass: u32,
        path: u32,
        paths: u32,
        shared: &Shared,
        photons: &mut Vec<Photon>,
        stats: &mut RenderStats,
    ) {
        let stream = scene.sampler.photon(pass, path);
        let mut lambda = shared.lambda;
        let Some(start) = start(scene, &stream, &lambda, scene.camera.time(shared.time)) else { return };
        walk(scene, &start, &stream, &mut lambda, self.settings.max_depth, stats, |arrival, lambda, _| {
            // Direct light is not left to photons.
            if arrival.depth == 0 || !arrival.bsdf.flags().is_non_specular() {
                return;
            }
            let (at, ns) = (arrival.at, arrival.bsdf.frame.z);
            // Power through the surface, not through the one that its shading normal pretends.
            let scale = shading_correction(at, ns, at.wo, at.n.as_vec()) * at.n.dot(ns).abs();
            let power = arrival.power * (scale / paths as f32);
            if power.is_finite() {
                let single_wavelength = lambda.secondary_terminated();
                photons.push(Photon { p: at.p, n: at.n, w: at.wo, power, depth: arrival.depth, single_wavelength });
            }
        });
    }

    /// What the camera's ray sees.
    fn radiance(
        &self,
        scene: &Scene,
        sample: &CameraSample,
        camera_ray: &CameraRay,
        map: &PhotonMap,
        radius: f32,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        stats: &mut RenderStats,
    ) -> SampledSpectrum {
        let mut ray = camera_ray.ray;
        let mut radiance = SampledSpectrum::ZERO;
        let mut throughput = SampledSpectrum::ONE;
        let mut eta_scale = 1.0;
        let mut depth = 0;
        let mut previous: Option<Previous> = None;
        loop {
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                for &id in scene.lights.environments() {
                    let light = scene.lights.get(id);
                    let weight = weight_of_met(previous.as_ref(), |p| {
                        scene.light_sampler.pmf(p, id) * light.pdf_escaped(p, ray.d, SampleMode::Compensated)
                    });
                    radiance += throughput * light.escaped(&ray, lambda) * weight;
                }
                break;
            };
            let at = scene.geometry.interaction(&ray, &hit);
            if let Some(id) = at.light {
                let light = scene.lights.get(id);
                let weight = weight_of_met(previous.as_ref(), |p| {
                    scene.light_sampler.pmf(p, id) * light.pdf_hit(p, ray.d, &(&at).into())
                });
                radiance += throughput * light.emitted(at.n, at.uv, at.wo, lambda) * weight;
            }
            let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
            let mix = sample.stream.mix(depth);
            let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
                // Light samples do not pass interfaces: what lies behind one must be met.
                ray = at.spawn_ray(ray.d);
                if let Some(p) = &mut previous {
                    p.delta = true;
                }
                stats.bounce_rays += 1;
                continue;
            };
            if depth == 0 && !layers.is_empty() {
                scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
            }
            // Beyond the first surface that is no mirror only lights count.
            let gathered = previous.as_ref().is_some_and(|p| p.pdf > 0.0);
            if gathered || self.settings.max_depth.is_some_and(|limit| depth >= limit) {
                break;
            }
            if bsdf.flags().is_non_specular() {
                radiance += throughput * direct(scene, sample, &at, &bsdf, depth, lambda, stats);
                radiance += throughput * self.gather(map, radius, &at, &bsdf, depth, lambda);
            }
            let draws = sample.stream.scatter(depth);
            let Some(s) = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All) else { break };
            throughput *= s.f * (bsdf.abs_cos(s.wi) / s.pdf);
            depth += 1;
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(depth);
            let delta = s.lobe.is_specular();
            let pdf = if delta {
                0.0
            } else {
                bsdf.pdf(at.wo, s.wi, TransportMode::Radiance, Sides::All).max(f32::MIN_POSITIVE)
            };
            if s.lobe.is_transmissive() {
                eta_scale *= s.eta * s.eta;
            }
            let survival = survival(&(throughput * eta_scale), depth);
            if throughput.is_black() || draws.roulette >= survival {
                break;
            }
            throughput *= 1.0 / survival;
            previous = Some(Previous { reference: at.reference(), pdf, delta });
            ray = at.spawn_ray(s.wi);
            stats.bounce_rays += 1;
        }
        radiance
    }

    /// Indirect light from the photons within the radius: power over the area of a disk.
    fn gather(
        &self,
        map: &PhotonMap,
        radius: f32,
        at: &Interaction,
        bsdf: &Bsdf,
        depth: u32,
        lambda: &Wavelengths,
    ) -> SampledSpectrum {
        let mut sum = SampledSpectrum::ZERO;
        let single = lambda.secondary_terminated();
        map.for_each_near(at.p, |photon| {
            let too_deep = self.settings.max_depth.is_some_and(|limit| photon.depth + depth + 1 > limit);
            if too_deep || photon.n.as_vec().dot_normal(at.n) < SAME_SURFACE {
                return;
            }
            let mut power = photon.power;
            if photon.single_wavelength && !single {
                // The first wavelength stands for all.
                power = SampledSpectrum::from_fn(|i| if i == 0 { N_WAVELENGTHS as f32 * power.0[0] } else { 0.0 });
            }
            sum += bsdf.f(at.wo, photon.w, TransportMode::Radiance) * power;
        });
        sum * (1.0 / (PI * radius * radius))
    }
}

/// The radius of pass `index` when that of pass 0 is `first`: r^2 shrinks by (i + alpha) / (i + 1), i = 1, 2, ... (Knaus
/// and Zwicker 2011, eq. 20).
pub fn radius_of_pass(first: f32, alpha: f32, index: u32) -> f32 {
    let alpha = f64::from(alpha);
    let shrunk: f64 = (1..=u64::from(index)).map(|i| (i as f64 + alpha) / (i as f64 + 1.0)).product();
    (f64::from(first) * shrunk.sqrt()) as f32
}

/// Weight of a light that a ray has met, against a light sample of density `by_sample` from where it came.
fn weight_of_met(previous: Option<&Previous>, by_sample: impl FnOnce(&ReferencePoint) -> f32) -> f32 {
    match previous {
        Some(p) if !p.delta => {
            let by_sample = by_sample(&p.reference);
            if by_sample > 0.0 { power_heuristic(p.pdf, by_sample) } else { 1.0 }
        }
        Some(_) | None => 1.0,
    }
}

/// Light straight from one sampled point of one sampled light, weighed against the chance that the next ray meets it.
fn direct(
    scene: &Scene,
    sample: &CameraSample,
    at: &Interaction,
    bsdf: &Bsdf,
    depth: u32,
    lambda: &Wavelengths,
    stats: &mut RenderStats,
) -> SampledSpectrum {
    let (draws, reference, black) = (sample.stream.light(depth), at.reference(), SampledSpectrum::ZERO);
    let Some(picked) = scene.light_sampler.sample(&reference, draws.pick) else { return black };
    let Some(s) = scene.lights.get(picked.id).sample(&reference, draws.uv, lambda, SampleMode::Compensated) else {
        return black;
    };
    let (f, bsdf_pdf) = bsdf.f_and_pdf(at.wo, s.wi, TransportMode::Radiance);
    let pdf = picked.pmf * s.pdf;
    let brought = f * s.radiance * (bsdf.abs_cos(s.wi) * scene.opacity(&s) / pdf);
    if brought.is_black() {
        return black;
    }
    stats.shadow_rays += 1;
    if scene.is_occluded(at, &s) {
        return black;
    }
    brought * if s.is_delta { 1.0 } else { power_heuristic(pdf, bsdf_pdf) }
}

/// Four pixels wide at the median distance of what the camera sees; a hundredth of the scene where it sees nothing.
/// Over 256 rays spread over the film; not a function of the number of samples.
pub fn automatic_radius(scene: &Scene) -> f32 {
    const SIDE: u32 = 16;
    const PIXELS: f32 = 2.0;
    let b = scene.bounds();
    let middle = Point2::new(0.5, 0.5);
    let mut widths: Vec<f32> = (0..SIDE * SIDE)
        .filter_map(|i| {
            let (u, v) = (((i % SIDE) as f32 + 0.5) / SIDE as f32, ((i / SIDE) as f32 + 0.5) / SIDE as f32);
            let film = Point2::new(b.x0 as f32 + u * b.width() as f32, b.y0 as f32 + v * b.height() as f32);
            let ray = scene.camera.generate_ray(film, middle, 0.5)?.ray;
            let beside = scene.camera.generate_ray(Point2::new(film.x + 1.0, film.y), middle, 0.5)?.ray;
            let hit = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha())?;
            let width = ray.at(hit.t).distance(beside.at(hit.t));
            (width > 0.0 && width.is_finite()).then_some(width)
        })
        .collect();
    widths.sort_unstable_by(f32::total_cmp);
    match widths.get(widths.len() / 2) {
        Some(width) => PIXELS * width,
        None => {
            let (_, radius) = scene.geometry.bounds().bounding_sphere();
            if radius > 0.0 && radius.is_finite() { 0.01 * radius } else { 1.0 }
        }
    }
}
