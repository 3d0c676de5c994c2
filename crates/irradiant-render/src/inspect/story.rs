//! One sample's path as data: what happened, and an account of its densities.
//!
//! [`replay`] takes the sample again with a [`PathRecorder`] and then keeps the books a second time, in `f64` and apart from
//! the path's own: it draws each direction and each light again, multiplies values and densities separately, and divides
//! once. What a contribution was worth must be what comes out (the lectures' "each path is weighted by 1 over its
//! probability"). It also asks each model for the density of the direction that it drew, which no sampling code computes.

use crate::camera_samples::camera_sample;
use crate::integrator::RenderStats;
use crate::light_samples::{LightChoice, PickedLights};
use crate::path::PathIntegrator;
use crate::record::{Contribution, PathEnd, PathRecorder, Scattering, Technique};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::interaction::{Interaction, LightId};
use irradiant_core::light::{LightTarget, SampleMode};
use irradiant_core::light_sampler::PickedLight;
use irradiant_core::sampler::SampleStream;
use irradiant_core::scene::Scene;
use irradiant_math::{Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Where a connection to a light ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightEnd {
    /// A point of the light, render space.
    Point(Point3),
    /// Out of the scene, unit.
    Direction(Vec3),
}

/// What became of a vertex's light sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightOutcome {
    /// It brought light.
    Lit,
    /// Something stood in the way.
    Blocked,
    /// The light does not shine here, or the surface does not scatter it.
    Black,
    /// It was a candidate, and another one was tested.
    PassedOver,
}

/// The light that a vertex asked.
#[derive(Clone, Copy, Debug)]
pub struct LightTry {
    /// Which.
    pub light: LightId,
    /// Where the sample lies.
    pub to: LightEnd,
    /// What came of it.
    pub outcome: LightOutcome,
}

/// A scattering event, drawn again.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// What the path recorded.
    pub scattering: Scattering,
    /// f |cos| of the direction, by wavelength.
    pub f_cos: SampledSpectrum,
    /// The density by the model's own density function, per steradian; `None` for a delta, which has none, and for models
    /// that estimate it.
    pub pdf_evaluated: Option<f32>,
}

/// A surface that the path met.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Where, and what of.
    pub at: Interaction,
    /// The lights that it asked.
    pub lights: Vec<LightTry>,
    /// How the path went on; `None` at its end.
    pub step: Option<Step>,
}

/// The books of one contribution, kept apart from the path's own arithmetic.
#[derive(Clone, Copy, Debug)]
pub struct Account {
    /// Product of f |cos| over all scattering events times the light's radiance, by wavelength.
    pub value: [f64; 4],
    /// Product of all densities that the path's directions, its survival and its light were drawn with.
    pub density: f64,
    /// The density that the path's weight contains: value times weight over contribution.
    pub density_in_weight: f64,
    /// Of `density`, the chance with which a light sample was chosen among candidates; 1 where it was not.
    pub chance_among_candidates: f64,
}

impl Account {
    /// |density in weight / product of densities - 1|.
    pub fn difference(&self) -> f64 {
        (self.density_in_weight / self.density - 1.0).abs()
    }
}

/// Light that the path found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// What the path recorded.
    pub contribution: Contribution,
    /// Scattering events before the connection: index of the vertex that it starts from is one less; 0 is the eye.
    pub from: u32,
    /// Where the light is.
    pub to: LightEnd,
    /// Its books; `None` behind an interface, which the recorder does not tell of.
    pub account: Option<Account>,
}

/// A path, from the eye on.
#[derive(Clone, Debug)]
pub struct PathStory {
    /// Column and row.
    pub pixel: [i32; 2],
    /// Sample index.
    pub sample: u32,
    /// The ray from the camera, render space.
    pub camera_ray: Ray,
    /// Wavelengths at the start.
    pub lambda: Wavelengths,
    /// Dispersion ended all wavelengths but the first.
    pub secondary_ended: bool,
    /// Surfaces, in order.
    pub vertices: Vec<Vertex>,
    /// The direction in which it left the scene.
    pub escape: Option<Vec3>,
    /// Light, in the order in which it was found.
    pub found: Vec<Found>,
    /// Why it ended.
    pub end: PathEnd,
    /// The sample's radiance.
    pub radiance: SampledSpectrum,
    /// What the film was given.
    pub rgb: [f32; 3],
    /// What the film's red, green and blue are of each wavelength's radiance: sensor, wavelengths' densities, the camera's and the pixel
    /// filter's weights, and what the scene's `maxcomponentvalue` leaves. `rgb` is the sum of radiance times these.
    pub film_from_radiance: [SampledSpectrum; 3],
}

impl PathStory {
    /// The largest [`Account::difference`] of its contributions; 0 without any.
    pub fn largest_difference(&self) -> f64 {
        self.found.iter().filter_map(|f| f.account).map(|a| a.difference()).fold(0.0, f64::max)
    }

    /// Points along the path, the camera's first; what follows an escape is not among them.
    pub fn points(&self) -> Vec<Point3> {
        std::iter::once(self.camera_ray.o).chain(self.vertices.iter().map(|v| v.at.p)).collect()
    }
}

/// Takes a sample again and tells its story; `None` where the camera sees nothing (vignetting).
// Inline: this listening copy of the path loop is then compiled where it is asked for and not beside the renders' own, whose
// inlining it would change. (callgrind, the built-in scene: a render's instructions are the same with and without it.)
#[inline]
pub fn replay(scene: &Scene, integrator: &PathIntegrator, pixel: [i32; 2], sample: u32) -> Option<PathStory> {
    let drawn = camera_sample(scene, pixel, sample);
    let camera_ray = drawn.camera_ray?;
    let mut lambda = drawn.lambda;
    let mut recorder = Recorder::default();
    let mut stats = RenderStats::default();
    let radiance =
        integrator.radiance(scene, &camera_ray, &drawn.stream, &mut lambda, &mut [], &mut stats, &mut recorder);
    let rgb = scene.film_rgb(radiance * camera_ray.weight, &lambda).map(|c| c * drawn.filter_weight);
    let limit = scene.limit_factor(radiance * camera_ray.weight, &lambda);
    let weight = camera_ray.weight * drawn.filter_weight * limit;
    let of_lane: [[f32; 3]; 4] = std::array::from_fn(|i| {
        let lane = SampledSpectrum::from_fn(|j| if i == j { weight } else { 0.0 });
        scene.film_rgb_of_part(lane, &lambda)
    });
    let film_from_radiance = std::array::from_fn(|c| SampledSpectrum::from_fn(|i| of_lane[i][c]));
    let mut story = PathStory {
        pixel,
        sample,
        camera_ray: camera_ray.ray,
        lambda: drawn.lambda,
        secondary_ended: lambda.secondary_terminated() && !drawn.lambda.secondary_terminated(),
        vertices: recorder.vertices.iter().map(|&at| Vertex { at, lights: vec![], step: None }).collect(),
        escape: recorder.escape,
        found: Vec::new(),
        end: recorder.end.unwrap_or(PathEnd::Absorbed),
        radiance,
        rgb,
        film_from_radiance,
    };
    let mut bookkeeper =
        Bookkeeper { scene, camera_ray: &camera_ray, stream: &drawn.stream, value: [1.0; 4], density: 1.0 };
    bookkeeper.keep(integrator, &recorder, &mut story);
    Some(story)
}

#[derive(Default)]
struct Recorder {
    vertices: Vec<Interaction>,
    scatterings: Vec<Scattering>,
    contributions: Vec<Contribution>,
    /// Lights whose samples were tested by a ray, with the vertex.
    tested: Vec<(u32, LightId)>,
    escape: Option<Vec3>,
    end: Option<PathEnd>,
}

impl PathRecorder for Recorder {
    fn vertex(&mut self, _depth: u32, at: &Interaction, _bsdf: &Bsdf) {
        self.vertices.push(*at);
    }

    fn escape(&mut self, _depth: u32, direction: Vec3) {
        self.escape = Some(direction);
    }

    fn light_tested(&mut self, depth: u32, light: LightId) {
        self.tested.push((depth, light));
    }

    fn contribution(&mut self, c: &Contribution) {
        self.contributions.push(*c);
    }

    fn scattering(&mut self, s: &Scattering) {
        self.scatterings.push(*s);
    }

    fn end(&mut self, why: PathEnd) {
        self.end = Some(why);
    }
}

/// A light sample, drawn again.
struct Asked {
    light: LightId,
    to: LightEnd,
    /// f |cos|, by wavelength.
    f_cos: [f64; 4],
    arriving: SampledSpectrum,
    /// With which it was drawn, shares of strata included.
    density: f64,
    /// What it would bring if nothing were in the way, but for a factor of all at the vertex.
    expected: f64,
}

/// Multiplies values and densities apart from each other.
struct Bookkeeper<'a> {
    scene: &'a Scene,
    camera_ray: &'a CameraRay,
    stream: &'a SampleStream<'a>,
    value: [f64; 4],
    density: f64,
}

impl Bookkeeper<'_> {
    fn keep(&mut self, integrator: &PathIntegrator, recorder: &Recorder, story: &mut PathStory) {
        let scene = self.scene;
        let mut lambda = story.lambda;
        let mut any_non_specular = false;
        let found = |technique, bounces| {
            recorder.contributions.iter().filter(move |c| c.technique == technique && c.bounces == bounces)
        };
        for depth in 0..recorder.vertices.len() as u32 {
            let at = recorder.vertices[depth as usize];
            for c in found(Technique::Hit, depth) {
                let account = (at.light == Some(c.light)).then(|| {
                    self.account(c, scene.lights.get(c.light).emitted(at.n, at.uv, at.wo, &lambda), [1.0; 4], 1.0)
                });
                story.found.push(Found { contribution: *c, from: depth, to: LightEnd::Point(at.p), account });
            }
            let footprint = scene.texture_context(&at, (depth == 0).then_some(self.camera_ray));
            let mix = self.stream.mix(depth);
            let Some(mut bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut lambda, mix)
            else {
                continue;
            };
            if integrator.regularize && any_non_specular {
                bsdf.regularize();
            }
            let scattering = recorder.scatterings.get(depth as usize);
            let asks = bsdf.flags().is_non_specular() && integrator.max_depth.is_none_or(|limit| depth < limit);
            if asks {
                let choice = integrator.light_choice_at(scene, depth);
                let picked = PickedLights::of(scene, &at.reference(), &self.stream.light(depth), choice.splits);
                let asked = picked
                    .iter()
                    .filter_map(|(light, share)| self.ask(&at, &bsdf, &lambda, depth, light, share, choice));
                let asked: Vec<Asked> = asked.collect();
                let total: f64 = asked.iter().map(|asked| asked.expected).sum();
                let is_tested = |light| recorder.tested.contains(&(depth, light));
                let any_is_tested = asked.iter().any(|asked| is_tested(asked.light));
                for asked in asked {
                    let outcome = match found(Technique::LightSample, depth + 1).find(|c| c.light == asked.light) {
                        Some(c) => {
                            let chance = if choice.is_resampled { asked.expected / total } else { 1.0 };
                            let account = self.account(c, asked.arriving, asked.f_cos, asked.density * chance);
                            let account = Some(Account { chance_among_candidates: chance, ..account });
                            story.found.push(Found { contribution: *c, from: depth + 1, to: asked.to, account });
                            LightOutcome::Lit
                        }
                        None if !(asked.expected > 0.0) => LightOutcome::Black,
                        None if any_is_tested && !is_tested(asked.light) => LightOutcome::PassedOver,
                        None => LightOutcome::Blocked,
                    };
                    let tried = LightTry { light: asked.light, to: asked.to, outcome };
                    story.vertices[depth as usize].lights.push(tried);
                }
            }
            if let Some(s) = scattering {
                any_non_specular |= !s.lobe.is_specular();
                story.vertices[depth as usize].step = self.step(&at, &bsdf, depth, s);
            }
        }
        if let Some(direction) = story.escape {
            let bounces = recorder.scatterings.len() as u32;
            let from = recorder.vertices.last().map_or(self.camera_ray.ray.o, |at| at.p);
            let time = self.camera_ray.ray.time;
            for c in found(Technique::Hit, bounces) {
                let light = scene.lights.get(c.light);
                let emitted = light.escaped(&Ray::new(from, direction, time), &lambda);
                let account = light.is_environment().then(|| self.account(c, emitted, [1.0; 4], 1.0));
                let to = LightEnd::Direction(direction);
                story.found.push(Found { contribution: *c, from: bounces, to, account });
            }
        }
    }

    /// The books of a contribution that scatters by `f_cos` towards light of `emitted`, drawn with `light_pdf`.
    fn account(&self, c: &Contribution, emitted: SampledSpectrum, f_cos: [f64; 4], light_pdf: f64) -> Account {
        let value: [f64; 4] = std::array::from_fn(|i| self.value[i] * f_cos[i] * f64::from(emitted[i]));
        let density = self.density * light_pdf;
        // By the wavelength that carries most.
        let best = (0..4).max_by(|&a, &b| c.radiance[a].total_cmp(&c.radiance[b])).unwrap_or(0);
        let density_in_weight = value[best] * f64::from(c.mis_weight) / f64::from(c.radiance[best]);
        Account { value, density, density_in_weight, chance_among_candidates: 1.0 }
    }

    /// Asks a light of the vertex again that stands for a `share` of those that were picked.
    fn ask(
        &self,
        at: &Interaction,
        bsdf: &Bsdf,
        lambda: &Wavelengths,
        depth: u32,
        PickedLight { id: light, pmf }: PickedLight,
        share: f32,
        choice: LightChoice,
    ) -> Option<Asked> {
        let scene = self.scene;
        let draws = self.stream.light(depth);
        let sample = scene.lights.get(light).sample(&at.reference(), draws.uv, lambda, SampleMode::Compensated)?;
        let (f, bsdf_pdf) = bsdf.f_and_pdf(at.wo, sample.wi, TransportMode::Radiance);
        let cos = f64::from(bsdf.abs_cos(sample.wi));
        let f_cos: [f64; 4] = std::array::from_fn(|i| f64::from(f[i]) * cos);
        let arriving = sample.radiance * scene.opacity(&sample);
        let to = match sample.target {
            LightTarget::Point(p) | LightTarget::Surface { p, .. } => LightEnd::Point(p),
            LightTarget::Infinite => LightEnd::Direction(sample.wi),
        };
        let density = f64::from(pmf) / f64::from(share) * f64::from(sample.pdf);
        let light_pdf = f64::from(choice.tests_by_chance(pmf)) * f64::from(sample.pdf);
        let found_by_bsdf = f64::from(bsdf_pdf).powi(2) / light_pdf.powi(2);
        let weight = if sample.is_delta { 1.0 } else { 1.0 / (1.0 + found_by_bsdf) };
        let brought = (0..4).map(|i| self.value[i] * f_cos[i] * f64::from(arriving[i])).sum::<f64>();
        Some(Asked { light, to, f_cos, arriving, density, expected: brought * weight / density })
    }

    /// Draws the direction again and goes on.
    fn step(&mut self, at: &Interaction, bsdf: &Bsdf, depth: u32, recorded: &Scattering) -> Option<Step> {
        let draws = self.stream.scatter(depth);
        let sample = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All)?;
        let f_cos = sample.f * bsdf.abs_cos(sample.wi);
        for i in 0..4 {
            self.value[i] *= f64::from(f_cos[i]);
        }
        self.density *= f64::from(sample.pdf) * f64::from(recorded.survival.min(1.0));
        let exact = !sample.lobe.is_specular() && !sample.pdf_is_proportional;
        let pdf_evaluated = exact.then(|| bsdf.pdf(at.wo, sample.wi, TransportMode::Radiance, Sides::All));
        Some(Step { scattering: *recorded, f_cos, pdf_evaluated })
    }
}
