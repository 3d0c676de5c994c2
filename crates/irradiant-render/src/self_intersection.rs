//! Path tracing on textbook intersection, with the lectures' remedies against rays that meet the surface they leave
//! (A63 to A68): what each does to a picture.
//!
//! One light sample and one BSDF sample at each vertex, without MIS; light met by chance counts where no sample could have
//! drawn it. With `robust`, the default, rays and hits are those of production.

use crate::camera_samples::for_each_sample;
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER, OptionEntry, OptionRange, Value, words};
use crate::simple_path::environment;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::geometry::textbook::{Departure, Remedy, Textbook};
use irradiant_core::interaction::Interaction;
use irradiant_core::light::{LightSample, SampleMode};
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::scene::Scene;
use irradiant_math::{Point2, Ray, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::sync::OnceLock;

words! {
    /// How rays leave surfaces.
    pub enum Leaving {
        /// error bounds at each hit; production's
        Robust = "robust",
        /// nothing: single precision, from o + t d
        Nothing = "none",
        /// hits nearer than `epsilon` along the ray do not count (A67)
        Epsilon = "epsilon",
        /// the primitive that the ray leaves does not count, if it is flat (A66)
        Skip = "skip-id",
        /// from the hit put back on its surface, single precision (A68)
        Project = "project",
        /// double precision throughout (A65)
        Double = "fp64",
    }
}

/// What can be set.
#[derive(Debug)]
pub struct SelfIntersectionIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    leaving: Leaving,
    epsilon: f32,
    /// Made from the scene at the first work unit.
    surfaces: OnceLock<Surfaces>,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "selfintersection",
    promise: "path tracing that leaves surfaces by one of the lectures' remedies against self-intersection",
    source: "Berkeley CS184 lecture 13, \"Floating-Point Precision Remedies\" (A63 to A68)",
    options: &[
        OptionEntry {
            name: "leaving",
            range: OptionRange::Word(Leaving::WORDS),
            default: Leaving::Robust.value(),
            doc: "how rays leave surfaces",
        },
        OptionEntry {
            name: "epsilon",
            range: OptionRange::Number(0.0, 1e9),
            default: Value::Number(1e-4),
            doc: "scene units, for leaving=epsilon (A67)",
        },
        LIGHT_SAMPLER,
    ],
    make: |options, max_depth| {
        Box::new(SelfIntersectionIntegrator::new(
            max_depth,
            Leaving::of(options.word("leaving")),
            options.number("epsilon"),
        ))
    },
};

/// A surface on a path, however it was found.
#[derive(Clone, Copy)]
pub enum Place {
    /// By production's geometry.
    Robust(Interaction),
    /// By a textbook's.
    Textbook(Departure),
}

impl Place {
    /// The surface.
    pub fn at(&self) -> &Interaction {
        match self {
            Self::Robust(at) => at,
            Self::Textbook(d) => &d.at,
        }
    }
}

/// A scene's surfaces under a way of leaving them.
#[derive(Debug)]
pub struct Surfaces {
    textbook: Option<Textbook>,
}

impl Surfaces {
    /// Of a scene.
    pub fn new(scene: &Scene, leaving: Leaving, epsilon: f32) -> Self {
        let remedy = match leaving {
            Leaving::Robust => None,
            Leaving::Nothing => Some(Remedy::Nothing),
            Leaving::Epsilon => Some(Remedy::FixedOffset(epsilon)),
            Leaving::Skip => Some(Remedy::SkipLast),
            Leaving::Project => Some(Remedy::Project),
            Leaving::Double => Some(Remedy::Double),
        };
        Self { textbook: remedy.map(|remedy| Textbook::new(&scene.geometry, remedy)) }
    }

    /// Bytes of what is copied from the scene: 0 for `robust`.
    pub fn memory_bytes(&self) -> usize {
        self.textbook.as_ref().map_or(0, Textbook::memory_bytes)
    }

    /// The closest surface on a ray from the camera.
    pub fn first(&self, scene: &Scene, ray: &Ray) -> Option<Place> {
        match &self.textbook {
            None => robust(scene, ray),
            Some(textbook) => textbook.first(&scene.geometry, ray, &scene.alpha()).map(Place::Textbook),
        }
    }

    /// The closest surface on a ray that leaves another.
    pub fn next(&self, scene: &Scene, from: &Place, w: Vec3) -> Option<Place> {
        match (&self.textbook, from) {
            (Some(textbook), Place::Textbook(d)) => {
                textbook.next(&scene.geometry, d, w, &scene.alpha()).map(Place::Textbook)
            }
            _ => robust(scene, &from.at().spawn_ray(w)),
        }
    }

    /// Whether something stands between a surface and the end of a light sample.
    pub fn is_occluded(&self, scene: &Scene, from: &Place, sample: &LightSample) -> bool {
        match (&self.textbook, from) {
            (Some(textbook), Place::Textbook(d)) => {
                textbook.blocker(&scene.geometry, d, sample.wi, &sample.target, &scene.alpha()).is_some()
            }
            _ => scene.is_occluded(from.at(), sample),
        }
    }
}

fn robust(scene: &Scene, ray: &Ray) -> Option<Place> {
    let hit = scene.geometry.intersect(ray, f32::INFINITY, &scene.alpha())?;
    Some(Place::Robust(scene.geometry.interaction(ray, &hit)))
}

impl SelfIntersectionIntegrator {
    /// `epsilon` in scene units, for `Leaving::Epsilon` only.
    pub fn new(max_depth: Option<u32>, leaving: Leaving, epsilon: f32) -> Self {
        Self { max_depth, leaving, epsilon, surfaces: OnceLock::new() }
    }
}

impl Integrator for SelfIntersectionIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let surfaces = self.surfaces.get_or_init(|| Surfaces::new(scene, self.leaving, self.epsilon));
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            let mut found = surfaces.first(scene, &camera_ray.ray);
            let mut d = camera_ray.ray.d;
            let mut from = camera_ray.ray.o;
            let mut radiance = SampledSpectrum::ZERO;
            let mut throughput = SampledSpectrum::ONE;
            let mut count_emission = true;
            let mut depth = 0;
            loop {
                let Some(place) = found else {
                    if count_emission {
                        let ray = Ray::new(from, d, camera_ray.ray.time);
                        radiance += throughput * environment(scene, &ray, lambda);
                    }
                    break;
                };
                let at = *place.at();
                if let Some(light) = at.light.filter(|_| count_emission) {
                    radiance += throughput * scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
                }
                let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
                let mix = sample.stream.mix(depth);
                from = at.p;
                let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix)
                else {
                    count_emission = true;
                    found = surfaces.next(scene, &place, d);
                    stats.bounce_rays += 1;
                    continue;
                };
                if depth == 0 && !layers.is_empty() {
                    scene.layers.fill(layers, scene, camera_ray, &at, &footprint, &bsdf, lambda);
                }
                if self.max_depth.is_some_and(|limit| depth >= limit) {
                    break;
                }
                if bsdf.flags().is_non_specular() {
                    let draws = sample.stream.light(depth);
                    let reference = at.reference();
                    if let Some(PickedLight { id, pmf }) = scene.light_sampler.sample(&reference, draws.pick)
                        && let Some(s) = scene.lights.get(id).sample(&reference, draws.uv, lambda, SampleMode::Complete)
                    {
                        let f = bsdf.f(at.wo, s.wi, TransportMode::Radiance) * bsdf.abs_cos(s.wi);
                        let arriving = s.radiance * scene.opacity(&s);
                        if !(f.is_black() || arriving.is_black()) {
                            stats.shadow_rays += 1;
                            if !surfaces.is_occluded(scene, &place, &s) {
                                radiance += throughput * f * arriving * (1.0 / (pmf * s.pdf));
                            }
                        }
                    }
                }
                let draws = sample.stream.scatter(depth);
                let Some(s) = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All) else {
                    break;
                };
                throughput *= s.f * (bsdf.abs_cos(s.wi) / s.pdf);
                if throughput.is_black() {
                    break;
                }
                count_emission = s.lobe.is_specular();
                depth += 1;
                stats.scatterings += 1;
                stats.longest_path = stats.longest_path.max(depth);
                if depth > 3 {
                    let survival = throughput.max_component().clamp(0.05, 0.95);
                    if draws.roulette >= survival {
                        break;
                    }
                    throughput *= 1.0 / survival;
                }
                d = s.wi;
                found = surfaces.next(scene, &place, d);
                stats.bounce_rays += 1;
            }
            radiance
        });
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        let leaving = match self.leaving {
            Leaving::Robust => None,
            Leaving::Epsilon => Some(Limit::Bias(format!("self-intersection epsilon={}", self.epsilon))),
            Leaving::Nothing | Leaving::Skip | Leaving::Project | Leaving::Double => {
                let Value::Word(word) = self.leaving.value() else { return Vec::new() };
                Some(Limit::Bias(format!("self-intersection {word}")))
            }
        };
        depth.into_iter().chain(Limit::caustics_of_delta_lights(self.max_depth)).chain(leaving).collect()
    }
}

/// What [`self_hits`] counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SelfHits {
    /// Pixels whose first surface has a light on the side that is seen.
    pub lit: u64,
    /// Of them: pixels from which that light is not to be seen. In a scene of one convex body, its own doing.
    pub blocked: u64,
    /// Pixels whose ray meets something.
    pub met: u64,
}

/// Looks from the middle of each pixel at the scene, and from the surface there at each light that it faces (A64). In a
/// scene of one convex body and lights outside of it nothing can stand in the way: `blocked` counts acne.
pub fn self_hits(scene: &Scene, leaving: Leaving, epsilon: f32) -> SelfHits {
    let surfaces = Surfaces::new(scene, leaving, epsilon);
    let middle = Point2::new(0.5, 0.5);
    let lambda = scene.sample_wavelengths(0.5);
    let bounds = scene.bounds();
    let mut hits = SelfHits { lit: 0, blocked: 0, met: 0 };
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let film = Point2::new(x as f32 + 0.5, y as f32 + 0.5);
            let Some(CameraRay { ray, .. }) = scene.camera.generate_ray(film, middle, 0.5) else { continue };
            let Some(place) = surfaces.first(scene, &ray) else { continue };
            hits.met += 1;
            let at = place.at();
            let outside = at.n.face_forward(at.wo);
            let mut lit = false;
            let mut blocked = false;
            for light in scene.lights.as_slice() {
                let sample = light.sample(&at.reference(), middle, &lambda, SampleMode::Complete);
                let Some(s) = sample.filter(|s| s.wi.dot_normal(outside) > 1e-4) else { continue };
                lit = true;
                blocked |= surfaces.is_occluded(scene, &place, &s);
            }
            hits.lit += u64::from(lit);
            hits.blocked += u64::from(blocked);
        }
    }
    hits
}
