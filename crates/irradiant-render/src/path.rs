//! Path tracing with multiple importance sampling: the production estimator.
//!
//! L = sum over i of K^i(Le): at each vertex a light sample (at the first one several, if asked for) and one BSDF sample, combined by the
//! power heuristic (Veach and Guibas 1995), ended by Russian roulette on the throughput. Wavelengths: the four of a path
//! share one set of decisions whose densities do not depend on wavelength, so that no wavelength weighting is needed;
//! a dispersive vertex ends the secondary ones.
//!
//! Here is one path at a time, which is the specification and what recorders see; plain pictures go by the
//! stages of `staged_path`, the same bits.

use crate::camera_samples::{CameraSample, SampleBatch, for_each_first_hit};
use crate::integrator::{Integrator, Limit, RenderStats, Renderer, WorkUnit};
use crate::light_samples::{LightChoice, MOST_SPLITS, check_splits, direct_light};
use crate::record::{Contribution, NoRecord, PathEnd, PathRecorder, Scattering, Technique};
use crate::registry::{OptionEntry, OptionRange, Options, Value, words};
use crate::staged_path::Batch;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{BsdfSample, Sides, TransportMode};
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::geometry::Hit;
use irradiant_core::interaction::{Interaction, ReferencePoint};
use irradiant_core::light::{PixelLine, PixelRun, SampleMode};
use irradiant_core::sampler::{LightDraws, SampleStream};
use irradiant_core::scene::Scene;
use irradiant_math::{Point2, Ray};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Blur sharp lobes after the first non-specular bounce. Biased.
    pub regularize: bool,
    /// When paths end by chance.
    pub roulette: Roulette,
    /// Strata of the choice of a light at the first surface, 1 to 64: each light that is picked is tested.
    pub light_splits: u32,
    /// Light samples of which one is tested at the first two surfaces, unless `light_splits` says otherwise, 1 to 64: so many that are picked, or each
    /// light in turn if there are no more than four times as many, nor than 64. One in scenes with coats weighted as in pbrt-v4.
    pub light_candidates: u32,
}

/// When paths end by chance; the expected picture is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Roulette {
    /// When they carry little.
    #[default]
    Throughput,
    /// At each event with this chance, in (0, 1): for looking at light of many bounces, which ends early by throughput.
    Constant(f32),
}

words! {
    /// When a path ends by chance.
    enum Ends {
        /// When it carries little.
        Throughput = "throughput",
        /// At each event with the chance q: shows light of many bounces with less noise, the picture with more.
        Constant = "constant",
    }
}

impl Default for PathIntegrator {
    fn default() -> Self {
        Self {
            max_depth: None,
            regularize: false,
            roulette: Roulette::default(),
            light_splits: 1,
            light_candidates: CANDIDATES,
        }
    }
}

impl Integrator for PathIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        if self.has_stages(scene) {
            self.renderer(scene)(unit, tile, stats);
            return;
        }
        // Under a sky, the first lookups of many paths are prepared together, since they wait for memory; in vain where
        // another light is picked.
        let sky = scene.lights.sky().map(|(_, sky)| sky);
        let mode = SampleMode::Compensated;
        let seek = |sample: &CameraSample, hit: Option<Hit>| -> Option<Sought> {
            Some(match hit {
                Some(_) => {
                    let draws = sample.stream.light(0);
                    Sought::Light(draws, sky?.seek(draws.uv, mode))
                }
                None => Sought::Escape(sky?.place(sample.camera_ray?.ray.d)),
            })
        };
        let approach = |sought: Option<Sought>| match (sought, sky) {
            (Some(Sought::Light(draws, line)), Some(sky)) => (Some((draws, sky.approach(line, mode))), None),
            (Some(Sought::Escape(place)), _) => (None, Some(place)),
            _ => (None, None),
        };
        for_each_first_hit(
            scene,
            unit,
            tile,
            stats,
            seek,
            approach,
            |sample, camera_ray, hit, (light, escape), lambda, layers, stats| {
                let first = FirstHit { hit, light, escape };
                self.radiance_from(first, scene, camera_ray, &sample.stream, lambda, layers, stats, &mut NoRecord)
            },
        );
    }

    fn renderer<'a>(&'a self, scene: &'a Scene) -> Renderer<'a> {
        if !self.has_stages(scene) {
            return Box::new(move |unit, tile, stats| self.render(scene, unit, tile, stats));
        }
        let (mut paths, mut batch) = (Batch::new(scene), SampleBatch::new());
        Box::new(move |unit, tile, stats| {
            batch.for_each(scene, unit, tile, stats, |samples, begin, radiance, stats| {
                self.radiance_of_batch(&mut paths, scene, samples, begin, radiance, stats);
            });
        })
    }

    fn check(&self, _: &Scene) -> Result<(), String> {
        check_splits("light_splits", self.light_splits)?;
        check_splits("light_candidates", self.light_candidates)
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        let regularize = self.regularize.then(|| Limit::Bias("regularize".into()));
        // With `regularize` too: thin glass, glossy paint and indices of 1 stay sharp.
        depth.into_iter().chain(Limit::caustics_of_delta_lights(self.max_depth)).chain(regularize).collect()
    }
}

/// How lights are sampled at the first surface, by default with so many samples.
pub(crate) const fn lights_option(default: u32) -> OptionEntry {
    OptionEntry {
        name: "lights",
        range: OptionRange::Count(1, MOST_SPLITS),
        default: Value::Count(default),
        doc: "light samples at the first surface: one of each light, or of so many lights that are picked (A59)",
    }
}

/// Of how many lights, picked by the light sampler, one is tested. (Figures: decision 8.)
const CANDIDATES: u32 = 2;

/// Lights are taken in turn instead if there are no more than so many times as many: a turn spares the walk through the tree.
const TURNS_PER_PICK: usize = 4;

/// So many surfaces choose among candidates; what others gain is not worth the time.
const CHOOSING: u32 = 2;

/// Of how many lights one is tested.
const CANDIDATES_OPTION: OptionEntry = OptionEntry {
    name: "candidates",
    range: OptionRange::Count(1, MOST_SPLITS),
    default: Value::Count(CANDIDATES),
    doc: "light samples drawn at the first two surfaces, of which a ray tests one, chosen in proportion to what each would bring if nothing stood in the way (A59): of so many lights that are picked or, if the scene has at most four times as many lights, and at most 64, of each; 1: no choice. Not under `coats weighted as in pbrt-v4`. At the first surface `lights` goes before, if above 1",
};

/// By name.
pub const ENTRY: crate::registry::IntegratorEntry = {
    use crate::registry::{IntegratorEntry, LIGHT_SAMPLER};
    IntegratorEntry {
        name: "path",
        promise: "the production estimator: path tracing with multiple importance sampling and roulette on the throughput",
        source: "A52 with B32; Veach and Guibas 1995",
        options: &[
            OptionEntry {
                name: "regularize",
                range: OptionRange::Flag,
                default: Value::Flag(false),
                doc: "blur sharp lobes after the first non-specular bounce; biased",
            },
            OptionEntry {
                name: "roulette",
                range: OptionRange::Word(Ends::WORDS),
                default: Ends::Throughput.value(),
                doc: "when a path ends by chance (A46, A47)",
            },
            OptionEntry {
                name: "q",
                range: OptionRange::Number(0.01, 0.95),
                default: Value::Number(0.1),
                doc: "chance to end a path at each event, with roulette=constant; of finite variance only where albedo^2 < 1 - q (B25)",
            },
            lights_option(1),
            CANDIDATES_OPTION,
            LIGHT_SAMPLER,
        ],
        make: |options, max_depth| Box::new(PathIntegrator::of(options, max_depth)),
    }
};

/// What a path under a sky will look up first.
enum Sought {
    /// A light sample at the first hit: its random numbers, and the first step to it.
    Light(LightDraws, PixelLine),
    /// The point of the sky that the camera sees.
    Escape(Point2),
}

/// What is known of a path when it begins.
struct FirstHit {
    /// What the camera ray meets.
    hit: Option<Hit>,
    /// The random numbers of its first light sample, which has been prepared.
    light: Option<(LightDraws, PixelRun)>,
    /// What it sees of the sky if it meets nothing.
    escape: Option<Point2>,
}

/// Where the last scattering event was, for weighing a light that the next ray meets.
pub(crate) struct Previous {
    pub reference: ReferencePoint,
    pub bsdf_pdf: f32,
    pub specular: bool,
    /// How lights are sampled there.
    pub light_choice: LightChoice,
}

/// A path on its way: the next ray, what it meets, and what the path carries there.
pub(crate) struct Walk {
    pub ray: Ray,
    pub met: Option<Hit>,
    pub throughput: SampledSpectrum,
    /// Scattering events so far.
    pub depth: u32,
    /// What roulette multiplies the throughput with: eta^2 for each refraction, since radiance is scaled by 1/eta^2 there, which is no
    /// loss; and what the path carried to the place from which its throughput is counted, where that is not the camera.
    pub roulette_scale: f32,
    pub previous: Option<Previous>,
    pub any_non_specular: bool,
    /// What the ray sees of the sky if it meets nothing, where that has been looked up.
    pub escape_place: Option<Point2>,
}

impl Walk {
    /// As it leaves the camera.
    #[inline]
    pub fn from_camera(ray: Ray, met: Option<Hit>) -> Self {
        Self {
            ray,
            met,
            throughput: SampledSpectrum::ONE,
            depth: 0,
            roulette_scale: 1.0,
            previous: None,
            any_non_specular: false,
            escape_place: None,
        }
    }

    /// Counts a direction that has been drawn, and what the path carries there.
    #[inline(always)]
    pub fn turn(&mut self, bsdf: &Bsdf, sample: &BsdfSample, stats: &mut RenderStats) {
        self.depth += 1;
        stats.scatterings += 1;
        stats.longest_path = stats.longest_path.max(self.depth);
        self.throughput *= sample.f * (sample.wi.dot(bsdf.frame.z).abs() / sample.pdf);
        self.any_non_specular |= !sample.lobe.is_specular();
        if sample.lobe.is_transmissive() {
            self.roulette_scale *= sample.eta * sample.eta;
        }
    }
}

impl PathIntegrator {
    /// As [`ENTRY`]'s options say.
    pub fn of(options: &Options, max_depth: Option<u32>) -> Self {
        let roulette = match Ends::of(options.word("roulette")) {
            Ends::Throughput => Roulette::Throughput,
            Ends::Constant => Roulette::Constant(options.number("q")),
        };
        Self {
            max_depth,
            regularize: options.flag("regularize"),
            roulette,
            light_splits: options.count("lights"),
            light_candidates: options.count("candidates"),
        }
    }

    /// Whether a path ends at a surface after so many scattering events.
    #[inline]
    pub(crate) fn is_at_limit(&self, depth: u32) -> bool {
        self.max_depth.is_some_and(|limit| depth >= limit)
    }

    /// Whether a path may end by chance at its scattering event of this number.
    pub(crate) fn plays_roulette(&self, depth: u32) -> bool {
        depth > SPARED || matches!(self.roulette, Roulette::Constant(_))
    }

    /// How lights are sampled at the surface after so many scattering events.
    #[inline]
    pub(crate) fn light_choice_at(&self, scene: &Scene, depth: u32) -> LightChoice {
        if depth == 0 && self.light_splits > 1 {
            return LightChoice { splits: self.light_splits, is_resampled: false };
        }
        let (lights, candidates) = (scene.lights.len(), self.light_candidates);
        // What coats weighted as in pbrt-v4 look like depends on the weights between light and BSDF samples, which are pbrt's with one light.
        if depth >= CHOOSING || candidates == 1 || lights <= 1 || scene.materials.uses_pbrt_coat_weights() {
            return LightChoice::ONE;
        }
        let takes_turns = lights <= (TURNS_PER_PICK * candidates as usize).min(MOST_SPLITS as usize);
        LightChoice { splits: if takes_turns { lights as u32 } else { candidates }, is_resampled: true }
    }

    /// What the camera ray sees, by one random path. Fills the layers of the film at the first surface.
    pub fn radiance<R: PathRecorder>(
        &self,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        stats: &mut RenderStats,
        recorder: &mut R,
    ) -> SampledSpectrum {
        let hit = scene.geometry.intersect(&camera_ray.ray, f32::INFINITY, &scene.alpha());
        let first = FirstHit { hit, light: None, escape: None };
        self.radiance_from(first, scene, camera_ray, stream, lambda, layers, stats, recorder)
    }

    /// As [`PathIntegrator::radiance`], of a path whose beginning is known.
    fn radiance_from<R: PathRecorder>(
        &self,
        first: FirstHit,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        stats: &mut RenderStats,
        recorder: &mut R,
    ) -> SampledSpectrum {
        let mut radiance = SampledSpectrum::ZERO;
        let mut walk = Walk { escape_place: first.escape, ..Walk::from_camera(camera_ray.ray, first.hit) };
        recorder.begin(lambda);
        let why = self.follow(
            &mut walk,
            &mut radiance,
            first.light,
            scene,
            camera_ray,
            stream,
            lambda,
            layers,
            stats,
            recorder,
        );
        recorder.end(why);
        radiance
    }

    /// From what the path's ray meets to the path's end; `radiance` is what the path brings. `light` is the prepared light sample of a
    /// first surface.
    #[inline(always)]
    pub(crate) fn follow<R: PathRecorder>(
        &self,
        walk: &mut Walk,
        radiance: &mut SampledSpectrum,
        light: Option<(LightDraws, PixelRun)>,
        scene: &Scene,
        camera_ray: &CameraRay,
        stream: &SampleStream,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        stats: &mut RenderStats,
        recorder: &mut R,
    ) -> PathEnd {
        loop {
            let depth = walk.depth;
            let Some(hit) = walk.met else {
                *radiance += self.escaped(scene, walk, lambda, recorder);
                return PathEnd::Escaped;
            };
            let mut at = Interaction::unknown(&walk.ray, hit.t);
            scene.geometry.fill_in(&walk.ray, &hit, &mut at);

            // Light that the ray meets by itself.
            if at.light.is_some() {
                *radiance += self.emitted(scene, walk, &at, lambda, recorder);
            }

            let footprint = scene.texture_context(&at, (depth == 0).then_some(camera_ray));
            let mix = stream.mix(depth);
            let mut scattering = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix);
            let Some(bsdf) = &mut scattering else {
                // An interface: no surface, only a boundary. Weighing lights across it would need its light sampling too.
                walk.ray = at.spawn_ray(walk.ray.d);
                if let Some(p) = &mut walk.previous {
                    p.specular = true;
                }
                stats.bounce_rays += 1;
                walk.met = scene.geometry.intersect(&walk.ray, f32::INFINITY, &scene.alpha());
                continue;
            };
            recorder.vertex(depth, &at, bsdf);
            if depth == 0 && !layers.is_empty() {
                scene.layers.fill(layers, scene, camera_ray, &at, &footprint, bsdf, lambda);
            }
            if self.is_at_limit(depth) {
                return PathEnd::MaxDepth;
            }
            if self.regularize && walk.any_non_specular {
                bsdf.regularize();
            }

            // Direct light: a sample of one light, or of several.
            if bsdf.flags().is_non_specular() {
                let (draws, run) = match light {
                    Some((draws, run)) if depth == 0 => (draws, Some(run)),
                    _ => (stream.light(depth), None),
                };
                *radiance += direct_light(
                    scene,
                    &at,
                    bsdf,
                    &walk.throughput,
                    lambda,
                    &draws,
                    run,
                    self.light_choice_at(scene, depth),
                    None,
                    depth,
                    stats,
                    recorder,
                );
            }

            let ended = self.scatter(scene, &at, bsdf, walk, stream, stats, recorder);
            if let Some(why) = ended {
                return why;
            }
        }
    }

    /// Draws a direction at a vertex, plays roulette, and traces the next ray. Why the path ended, if it did.
    #[inline(always)]
    pub(crate) fn scatter<R: PathRecorder>(
        &self,
        scene: &Scene,
        at: &Interaction,
        bsdf: &Bsdf,
        walk: &mut Walk,
        stream: &SampleStream,
        stats: &mut RenderStats,
        recorder: &mut R,
    ) -> Option<PathEnd> {
        let draws = stream.scatter(walk.depth);
        let sample = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All);
        let Some(sample) = sample else { return Some(PathEnd::Absorbed) };
        walk.turn(bsdf, &sample, stats);
        if walk.throughput.is_black() {
            return Some(PathEnd::Absorbed);
        }

        // Russian roulette: end paths that carry little.
        let survival = match self.roulette {
            Roulette::Throughput => survival_probability(&walk.throughput, walk.roulette_scale, walk.depth),
            Roulette::Constant(q) => 1.0 - q,
        };
        recorder.scattering(&Scattering {
            depth: walk.depth - 1,
            wi: sample.wi,
            lobe: sample.lobe,
            pdf: sample.pdf,
            throughput: walk.throughput,
            survival,
        });
        if survival < 1.0 {
            if draws.roulette >= survival {
                return Some(PathEnd::Roulette);
            }
            walk.throughput *= 1.0 / survival;
        }
        self.go(scene, at, bsdf, &sample, walk, stats);
        None
    }

    /// Traces the ray of a direction that has been drawn.
    #[inline(always)]
    pub(crate) fn go(
        &self,
        scene: &Scene,
        at: &Interaction,
        bsdf: &Bsdf,
        sample: &BsdfSample,
        walk: &mut Walk,
        stats: &mut RenderStats,
    ) {
        let specular = sample.lobe.is_specular();
        let bsdf_pdf = if sample.pdf_is_proportional && !specular {
            bsdf.pdf(at.wo, sample.wi, TransportMode::Radiance, Sides::All)
        } else {
            sample.pdf
        };
        let light_choice = self.light_choice_at(scene, walk.depth - 1);
        walk.previous = Some(Previous { reference: at.reference(), bsdf_pdf, specular, light_choice });
        walk.ray = at.spawn_ray(sample.wi);
        walk.escape_place = scene.lights.place_of_escape(sample.wi);
        stats.bounce_rays += 1;
        walk.met = scene.geometry.intersect(&walk.ray, f32::INFINITY, &scene.alpha());
    }

    /// Light from environments that an escaping ray sees, weighed against having sampled them.
    pub(crate) fn escaped<R: PathRecorder>(
        &self,
        scene: &Scene,
        walk: &Walk,
        lambda: &Wavelengths,
        recorder: &mut R,
    ) -> SampledSpectrum {
        let (ray, depth, previous) = (&walk.ray, walk.depth, walk.previous.as_ref());
        recorder.escape(depth, ray.d);
        let mut sum = SampledSpectrum::ZERO;
        for &light in scene.lights.environments() {
            let from = previous.filter(|p| !p.specular).map(|p| &p.reference);
            let mode = SampleMode::Compensated;
            let (emitted, pdf) = scene.lights.get(light).escaped_and_pdf(ray, walk.escape_place, from, lambda, mode);
            if emitted.is_black() {
                continue;
            }
            let light_pdf = previous
                .filter(|p| !p.specular)
                .map_or(0.0, |p| p.light_choice.tests_of(scene, &p.reference, light) * pdf);
            let bsdf_pdf = previous.map_or(0.0, |p| p.bsdf_pdf);
            let weight = if light_pdf > 0.0 { power_heuristic(bsdf_pdf, light_pdf) } else { 1.0 };
            let radiance = walk.throughput * emitted * weight;
            sum += radiance;
            recorder.contribution(&Contribution {
                bounces: depth,
                technique: Technique::Hit,
                light,
                wi: ray.d,
                radiance,
                mis_weight: weight,
                light_pdf,
                bsdf_pdf,
            });
        }
        sum
    }

    /// Light that the surface emits towards where the ray came from, weighed against having sampled it.
    pub(crate) fn emitted<R: PathRecorder>(
        &self,
        scene: &Scene,
        walk: &Walk,
        at: &Interaction,
        lambda: &Wavelengths,
        recorder: &mut R,
    ) -> SampledSpectrum {
        let (ray, depth, previous) = (&walk.ray, walk.depth, walk.previous.as_ref());
        let Some(light) = at.light else { return SampledSpectrum::ZERO };
        let emitted = scene.lights.get(light).emitted(at.n, at.uv, at.wo, lambda);
        if emitted.is_black() {
            return SampledSpectrum::ZERO;
        }
        let light_pdf = previous.filter(|p| !p.specular).map_or(0.0, |p| {
            p.light_choice.tests_of(scene, &p.reference, light)
                * scene.lights.get(light).pdf_hit(&p.reference, ray.d, &at.into())
        });
        let bsdf_pdf = previous.map_or(0.0, |p| p.bsdf_pdf);
        let weight = if light_pdf > 0.0 { power_heuristic(bsdf_pdf, light_pdf) } else { 1.0 };
        let radiance = walk.throughput * emitted * weight;
        recorder.contribution(&Contribution {
            bounces: depth,
            technique: Technique::Hit,
            light,
            wi: ray.d,
            radiance,
            mis_weight: weight,
            light_pdf,
            bsdf_pdf,
        });
        radiance
    }
}

/// Veach's power heuristic (beta = 2) for one sample of each of two techniques: the weight of the one with density `a`.
/// Densities whose squares overflow count as infinite.
#[inline(always)]
pub fn power_heuristic(a: f32, b: f32) -> f32 {
    let (a, b) = (a * a, b * b);
    if a.is_infinite() {
        1.0
    } else if a > 0.0 {
        a / (a + b)
    } else {
        0.0
    }
}

/// So many events end no path by chance that it carries little.
const SPARED: u32 = 1;

/// After this many events even a path that loses nothing is ended now and then, so that closed scenes of albedo 1 end.
const LONG_PATH: u32 = 128;

/// The rule by which paths survive ([`Roulette::Throughput`]), in words.
pub const SURVIVAL_RULE: &str = "1 after the first event; later twice the largest throughput, eta^2 of refractions taken out; at most 1, from 128 events on 0.95";

/// Throughput below which paths are ended by chance.
///
/// 64 samples per pixel of a Cornell box in RGB, error (relMSE) times CPU time against 1: roulette below 1 (as pbrt-v4)
/// 1.00; below 1/2 0.65; below 1/4 0.63; by the square root of the throughput 0.75; none for one event more 0.85, for
/// three more 0.74. Nearer to 1 is cheaper a sample, which matters where paths end early anyway. By stages, and in the benchmark's other four
/// scenes: decision 7.
const ROULETTE_BELOW: f32 = 0.5;

/// Chance to go on: the largest throughput, with the scale of [`Walk`] for roulette, over [`ROULETTE_BELOW`]; 1 for the first two
/// events.
#[inline(always)]
pub(crate) fn survival_probability(throughput: &SampledSpectrum, roulette_scale: f32, depth: u32) -> f32 {
    if depth <= SPARED {
        return 1.0;
    }
    let carried = (*throughput * roulette_scale).max_component();
    let most = if depth < LONG_PATH { 1.0 } else { 0.95 };
    (carried * (1.0 / ROULETTE_BELOW)).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heuristic_weights_sum_to_one() {
        for (a, b) in [(1.0, 1.0), (1e-10, 3.0), (1e15, 1e-15), (0.0, 2.0), (5.0, 0.0)] {
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6, "{a} {b}");
        }
        assert_eq!(power_heuristic(1e30, 1.0), 1.0);
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
    }

    #[test]
    fn roulette_spares_the_first_bounces_and_glass() {
        let dim = SampledSpectrum::splat(0.25);
        assert_eq!(survival_probability(&dim, 1.0, 1), 1.0);
        assert_eq!(survival_probability(&dim, 1.0, 2), 0.25 / ROULETTE_BELOW);
        assert_eq!(survival_probability(&dim, 1.5, 2), 0.375 / ROULETTE_BELOW);
        assert_eq!(survival_probability(&dim, 2.25, 2), 1.0);
        assert_eq!(survival_probability(&SampledSpectrum::ONE, 1.0, LONG_PATH), 0.95);
    }
}
