//! Path tracing whose paths are shared among neighbouring pixels.
//!
//! Bekaert, Sbert and Halton 2002, "Accelerating path tracing by re-using paths" (Eurographics Workshop on Rendering): the
//! second surface of a path from one pixel, with all light that arrives there, also lights the first surfaces of its
//! neighbours. Sixteen pixels of a block trace a path each; each of their second vertices is then connected to each of their
//! first ones by a shadow ray, and a pixel has sixteen samples of indirect light for little more than the price of one.
//!
//! Path i, with its first vertex x_i, finds the second vertex y with the density p_i(y) = pdf_i cos_y / r_i^2 wherever it sees y. All of a
//! block's paths are samples of one mixture by the balance heuristic (Veach and Guibas 1995): a pixel's estimate is the sum over the block's
//! second vertices of f_i(y) V_i(y) L(y) / sum over k of p_k(y) V_k(y). It is unbiased, and bounded where the BSDF is: the pixel's own path is in
//! the sum.
//!
//! Which pixels take part must not depend on what their paths do, or the sum over k would not be the density of what is there: a first vertex
//! takes part as soon as the camera sees it, also when its own path draws no direction; and no path ends because it is of no use to its own pixel.
//!
//! What is shared: second vertices on diffuse surfaces, leaves and rough metals, for first vertices on the same; and, for these too, the sky, if it is the only
//! environment and has no portal ([`sky`]). All else (direct light of lamps at the first vertex, lamps that the path meets, other materials) is each pixel's own, as
//! in [`path`](crate::path) with one candidate.
//!
//! Errors of the pixels of a block go together: a picture has less noise per pixel but what is left is blotchy, and the mean over
//! many pixels has the error that [`path`](crate::path) would give it. All of a block share the time; each path has wavelengths of its
//! own, at which it is seen by all, or blocks would be tinted.

pub(crate) mod blocks;
mod share;
pub(crate) mod sky;
mod sky_lanes;
mod staged;

use crate::camera_samples::{CameraSample, camera_sample_by};
use crate::integrator::{Integrator, Limit, RenderStats, Renderer, WorkUnit};
use crate::light_samples::{LightChoice, check_splits, direct_light, pick_light, sky_sample};
use crate::path::{PathIntegrator, Previous, Walk, lights_option, survival_probability};
use crate::record::{Contribution, NoRecord, PathRecorder};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER, OptionEntry, OptionRange, Value};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{BsdfSample, Bxdf, Sides, TransportMode};
use irradiant_core::film::{FilmTile, PixelBounds};
use irradiant_core::interaction::{Interaction, ReferencePoint, TextureContext};
use irradiant_core::sampler::{CameraDraws, ScatterDraws};
use irradiant_core::scene::Scene;
use irradiant_math::{Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use sky::{GLIMPSES, Glimpse, SharedSky};
use std::ops::Range;

/// Side of a block, pixels.
///
/// Relative variance times CPU time in the benchmark's Cornell box and interior, against `path`: 3 pixels 0.22 and 0.36, 4 pixels 0.12 and 0.22,
/// 6 pixels 0.19 and 0.32. Aligned blocks of powers of two are best because the samples of such blocks are stratified together (`zsobol`);
/// blocks that lie elsewhere in each sample look better, since their borders do not show, but 4 pixels are then at 0.20 and 0.34.
const SIDE: i32 = 4;
/// Pixels of a block.
pub(crate) const PIXELS: usize = (SIDE * SIDE) as usize;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "sharedpath",
    promise: "path tracing whose indirect light, and that of the sky, is shared among the pixels of a block",
    source: "Bekaert, Sbert and Halton 2002; of the sky by systematic sampling, Madow 1949",
    options: &[lights_option(8), SKY, LIGHT_SAMPLER],
    make: |options, max_depth| {
        let (light_splits, sky_tests) = (options.count("lights"), options.count("sky"));
        Box::new(SharedPathIntegrator { max_depth, light_splits, sky_tests })
    },
};

const SKY: OptionEntry = OptionEntry {
    name: "sky",
    range: OptionRange::Count(0, GLIMPSES as u32),
    default: Value::Count(4),
    doc: "directions to the sky that neighbouring pixels found and a pixel tests too; 0: the sky is not shared",
};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedPathIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Strata of the choice of a light at the first surface, 1 to 64.
    pub light_splits: u32,
    /// Directions to the sky, found by others of its block, that a pixel tests for each sample; 0: the sky is not shared.
    pub sky_tests: u32,
}

/// A surface that the camera sees.
struct First {
    at: Interaction,
    footprint: TextureContext,
    /// At the wavelengths of its own path.
    bsdf: Bsdf,
}

/// A surface that a path meets next, with the light that it scatters (its own emission is not shared).
pub(crate) struct Second<L = Scattered> {
    pub place: ReferencePoint,
    pub wo: Vec3,
    /// Density with which its own path's first vertex found it, 1/sr.
    pub pdf: f32,
    /// What the path carries there: f cos / pdf.
    pub carried: SampledSpectrum,
    pub light: L,
}

/// Light that leaves a surface.
// A box would be allocated at each surface.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Scattered {
    /// The same radiance in all directions of the side of this normal.
    Evenly { normal: Vec3, radiance: SampledSpectrum },
    /// As its BSDF has it.
    By { bsdf: Bsdf, incoming: Range<usize> },
}

/// Light that arrives at a second vertex, by one sample of it.
pub(crate) struct Incoming {
    pub wi: Vec3,
    /// Arriving radiance.
    pub radiance: SampledSpectrum,
    /// Density with which light samples find it, 1/sr; 0 where they cannot.
    pub light_pdf: f32,
    /// Whether drawing directions from the BSDF finds it.
    pub found_by_bsdf: bool,
}

/// A path of the block.
struct Member<'a> {
    sample: CameraSample<'a>,
    /// The path's wavelengths, of which dispersion may have ended three.
    lambda: Wavelengths,
    /// What is the pixel's own.
    radiance: SampledSpectrum,
    /// What the sensor makes of light that is shared, its own path's and others'.
    shared: [f32; 3],
    first: Option<First>,
    second: Option<Second>,
}

/// How a path looks for the sky from its first vertex, if that takes part.
struct Looks<'a> {
    sky: Option<&'a SharedSky<'a>>,
    /// By a light sample, if it draws one, which may be of another light.
    light: Option<Option<Glimpse>>,
    /// Along the direction that it takes.
    drawn: Option<Glimpse>,
}

/// What blocks need not allocate anew.
#[derive(Default)]
struct Scratch<'a> {
    members: Vec<Member<'a>>,
    /// Of the film, for each member in turn.
    layers: Vec<f32>,
    camera_rays: Vec<Ray>,
    rays: Vec<Ray>,
    ends: Vec<f32>,
    blocked: Vec<bool>,
    pairs: Vec<share::Pair>,
    /// Of all second vertices that scatter by their BSDF.
    incoming: Vec<Incoming>,
    /// Directions to the sky: the members' light samples, then those of their BSDFs.
    glimpses: [Option<Glimpse>; GLIMPSES],
    /// First vertices that draw light samples.
    seeking: u32,
}

impl Integrator for SharedPathIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        self.renderer(scene)(unit, tile, stats);
    }

    fn renderer<'a>(&'a self, scene: &'a Scene) -> Renderer<'a> {
        let path = self.path();
        if path.has_stages(scene) {
            staged::renderer(path, self.sky_tests, scene)
        } else {
            Box::new(move |unit, tile, stats| self.render_alone(scene, unit, tile, stats))
        }
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        check_splits("light_splits", self.light_splits)?;
        if scene.materials.may_pass() {
            return Err(
                "sharedpath cannot join surfaces through mixes that hold an interface; --integrator path can".into()
            );
        }
        if scene.materials.are_forced_diffuse() {
            return Err(
                "sharedpath cannot share surfaces of Option \"forcediffuse\", whose albedo depends on the view; --integrator path can".into()
            );
        }
        Ok(())
    }

    fn limits(&self) -> Vec<Limit> {
        self.max_depth.map(Limit::MaxDepth).into_iter().chain(Limit::caustics_of_delta_lights(self.max_depth)).collect()
    }
}

impl SharedPathIntegrator {
    /// By whose rules paths go where nothing is shared.
    fn path(&self) -> PathIntegrator {
        let (max_depth, light_splits) = (self.max_depth, self.light_splits);
        PathIntegrator { max_depth, light_splits, light_candidates: 1, ..PathIntegrator::default() }
    }

    /// As [`Integrator::render`], one path at a time: the specification of what is done for many at once where the scene allows it, the same
    /// bits.
    pub fn render_alone(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let bounds = &unit.bounds;
        let mut scratch = Scratch::default();
        scratch.layers.resize(scene.layers.channels() * PIXELS, 0.0);
        let sky = SharedSky::of(scene, &self.path(), self.sky_tests);
        let channels = scene.layers.channels();
        for block in blocks_of(bounds) {
            for index in unit.samples.clone() {
                self.block(scene, sky.as_ref(), &block, index, &mut scratch, stats);
                for (i, member) in scratch.members.iter().enumerate() {
                    let [x, y] = member.sample.pixel;
                    if x < bounds.x0 || x >= bounds.x1 || y < bounds.y0 || y >= bounds.y1 {
                        continue;
                    }
                    stats.paths += 1;
                    let CameraSample { camera_ray, filter_weight, .. } = member.sample;
                    let camera_weight = camera_ray.map(|ray| ray.weight);
                    if !tile.add(
                        x,
                        y,
                        film_rgb(scene, camera_weight, &member.lambda, member.radiance, member.shared)
                            .map(|c| c * filter_weight),
                        &scratch.layers[i * channels..(i + 1) * channels],
                    ) {
                        stats.refuse(x, y, index);
                    }
                }
            }
        }
    }

    /// The paths of one sample of a block's pixels, with all light that they bring to their pixels.
    fn block<'a>(
        &self,
        scene: &'a Scene,
        sky: Option<&SharedSky>,
        block: &PixelBounds,
        index: u32,
        scratch: &mut Scratch<'a>,
        stats: &mut RenderStats,
    ) {
        let Scratch { members, layers, camera_rays, ends, incoming, glimpses, seeking, .. } = scratch;
        incoming.clear();
        (*glimpses, *seeking) = ([None; GLIMPSES], 0);
        members.clear();
        members.extend(samples_of_block(scene, block, index).map(|sample| Member {
            lambda: sample.lambda,
            sample,
            radiance: SampledSpectrum::ZERO,
            shared: [0.0; 3],
            first: None,
            second: None,
        }));
        layers.fill(0.0);
        // Where the camera sees nothing, a ray without length stands in.
        camera_rays.clear();
        ends.clear();
        for member in members.iter() {
            let nothing = || (Ray::new(Point3::ZERO, Vec3::Z, 0.0), 0.0);
            let (ray, end) = member.sample.camera_ray.map_or_else(nothing, |c| (c.ray, f32::INFINITY));
            camera_rays.push(ray);
            ends.push(end);
        }
        let mut hits = [None; PIXELS];
        scene.geometry.intersect_batch(camera_rays, ends, &scene.alpha(), &mut hits[..members.len()]);

        let channels = scene.layers.channels();
        for (i, member) in members.iter_mut().enumerate() {
            let Some(camera_ray) = member.sample.camera_ray else { continue };
            stats.camera_rays += 1;
            let layers = &mut layers[i * channels..(i + 1) * channels];
            let mut lambda = member.lambda;
            let walk = Walk::from_camera(camera_ray.ray, hits[i]);
            let mut looks = Looks { sky, light: None, drawn: None };
            self.trace(scene, member, walk, &mut lambda, layers, stats, incoming, &mut looks);
            member.lambda = lambda;
            (glimpses[i], glimpses[PIXELS + i]) = (looks.light.flatten(), looks.drawn);
            *seeking += u32::from(looks.light.is_some());
        }
        share::share(scene, scratch, stats);
        if let Some(sky) = sky {
            sky::share_sky(scene, sky, scratch, stats);
        }
        let Scratch { members, layers, .. } = scratch;
        for (i, member) in members.iter().enumerate() {
            let layers = &mut layers[i * channels..(i + 1) * channels];
            let weight = member.sample.camera_ray.map_or(0.0, |c| c.weight);
            scene.layers.add_buckets(member.radiance * weight, &member.lambda, layers);
            layers.iter_mut().for_each(|value| *value *= member.sample.filter_weight);
        }
    }

    /// A path, and what is its pixel's own.
    fn trace(
        &self,
        scene: &Scene,
        member: &mut Member,
        mut walk: Walk,
        lambda: &mut Wavelengths,
        layers: &mut [f32],
        stats: &mut RenderStats,
        incoming: &mut Vec<Incoming>,
        looks: &mut Looks,
    ) {
        let path = self.path();
        let Some(camera_ray) = member.sample.camera_ray else { return };
        let stream = member.sample.stream;

        // The first vertex.
        let Some(hit) = walk.met else {
            member.radiance += path.escaped(scene, &walk, lambda, &mut NoRecord);
            return;
        };
        let at = scene.geometry.interaction(&walk.ray, &hit);
        if at.light.is_some() {
            member.radiance += path.emitted(scene, &walk, &at, lambda, &mut NoRecord);
        }
        let footprint = scene.texture_context(&at, Some(&camera_ray));
        let mix = stream.mix(0);
        let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
            return;
        };
        if !layers.is_empty() {
            scene.layers.fill(layers, scene, &camera_ray, &at, &footprint, &bsdf, lambda);
        }
        if path.is_at_limit(0) {
            return;
        }
        let sky = looks.sky.filter(|_| gains(&bsdf));
        if bsdf.flags().is_non_specular() {
            let (draws, one) = (stream.light(0), SampledSpectrum::ONE);
            let choice = path.light_choice_at(scene, 0);
            if let Some(sky) = sky {
                looks.light = Some(sky_sample(scene, &at, &draws, choice.splits, sky));
            }
            let except = sky.map(|sky| sky.id);
            member.radiance +=
                direct_light(scene, &at, &bsdf, &one, lambda, &draws, None, choice, except, 0, stats, &mut NoRecord);
        }
        if gains(&bsdf) {
            let drawn = draw(&bsdf, at.wo, &stream.scatter(0));
            if let Some(sample) = &drawn {
                walk.turn(&bsdf, sample, stats);
                path.go(scene, &at, &bsdf, sample, &mut walk, stats);
            }
            member.first = Some(First { at, footprint, bsdf });
            if let Some(BsdfSample { pdf, wi, .. }) = drawn {
                if let Some(sky) = sky {
                    let sees = walk.met.is_none();
                    looks.drawn = Some(Glimpse { point: sky.sky.look(wi, None), factor: 1.0, sees });
                    if sees {
                        return;
                    }
                }
                self.second(&path, scene, member, walk, pdf, lambda, stats, incoming);
            }
        } else if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_none() {
            member.radiance += go_on(&path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
        }
    }

    /// The second vertex of a path whose first can be shared and drew it with density `pdf`.
    fn second(
        &self,
        path: &PathIntegrator,
        scene: &Scene,
        member: &mut Member,
        mut walk: Walk,
        pdf: f32,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
        incoming: &mut Vec<Incoming>,
    ) {
        let stream = member.sample.stream;
        let Some(hit) = walk.met else {
            member.radiance += path.escaped(scene, &walk, lambda, &mut NoRecord);
            return;
        };
        let at = scene.geometry.interaction(&walk.ray, &hit);
        if at.light.is_some() {
            member.radiance += path.emitted(scene, &walk, &at, lambda, &mut NoRecord);
        }
        let footprint = scene.texture_context(&at, None);
        let mix = stream.mix(1);
        let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, lambda, mix) else {
            return;
        };
        if path.is_at_limit(1) {
            return;
        }
        let direct_light = |throughput, lambda: &_, stats: &mut _| {
            let draws = stream.light(1);
            direct_light(
                scene,
                &at,
                &bsdf,
                throughput,
                lambda,
                &draws,
                None,
                LightChoice::ONE,
                None,
                1,
                stats,
                &mut NoRecord,
            )
        };
        if !is_shared(&bsdf) {
            if walk.throughput.is_black() {
                return;
            }
            let mut radiance = SampledSpectrum::ZERO;
            if bsdf.flags().is_non_specular() {
                radiance += direct_light(&walk.throughput, lambda, stats);
            }
            if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_none() {
                radiance += go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
            }
            member.radiance += radiance;
            return;
        }
        // From here on light counts as it leaves this surface; roulette goes by what arrives at the camera.
        let carried = walk.throughput;
        walk.roulette_scale = carried.max_component().max(LEAST_IMPORTANCE);
        walk.throughput = SampledSpectrum::ONE;
        let light = match bsdf.bxdf {
            Bxdf::Diffuse(_) => {
                let mut radiance = direct_light(&walk.throughput, lambda, stats);
                if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_none() {
                    radiance += go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
                }
                let normal = bsdf.frame.z * 1f32.copysign(at.wo.dot(bsdf.frame.z));
                Scattered::Evenly { normal, radiance }
            }
            _ => {
                let begin = incoming.len();
                self.incoming(path, scene, member, &at, &bsdf, walk, lambda, stats, incoming);
                Scattered::By { bsdf, incoming: begin..incoming.len() }
            }
        };
        member.second = Some(Second { place: at.reference(), wo: at.wo, pdf, carried, light });
    }

    /// Light that arrives at a second vertex: by a light sample, and by a direction drawn from the BSDF.
    fn incoming(
        &self,
        path: &PathIntegrator,
        scene: &Scene,
        member: &Member,
        at: &Interaction,
        bsdf: &Bsdf,
        mut walk: Walk,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
        incoming: &mut Vec<Incoming>,
    ) {
        let stream = &member.sample.stream;
        if bsdf.flags().is_non_specular()
            && let Some(pick) = pick_light(scene, at, lambda, &stream.light(1))
            && !pick.radiance.is_black()
        {
            stats.shadow_rays += 1;
            if !scene.is_occluded(at, &pick.sample) {
                incoming.push(Incoming {
                    wi: pick.sample.wi,
                    radiance: pick.radiance,
                    light_pdf: pick.pdf,
                    found_by_bsdf: !pick.sample.is_delta,
                });
            }
        }
        let draws = stream.scatter(1);
        let Some(drawn) = draw(bsdf, at.wo, &draws) else { return };
        walk.turn(bsdf, &drawn, stats);
        // By one number, not by colours, and never to nothing: others see the surface from elsewhere.
        let importance = walk.roulette_scale * walk.throughput.max_component().max(LEAST_IMPORTANCE);
        let survival = survival_probability(&SampledSpectrum::splat(importance), 1.0, walk.depth);
        if draws.roulette >= survival {
            return;
        }
        walk.roulette_scale = importance;
        walk.throughput = SampledSpectrum::splat(1.0 / survival);
        path.go(scene, at, bsdf, &drawn, &mut walk, stats);
        // What lamps send this way is weighed later, when it is known who sees the surface. So they are asked for twice: with any density of
        // the direction (1), when [`Lamps`] catches what light samples find too and divides the weight out; and with none, when
        // the rest of the path brings but what they cannot find.
        walk.previous = Some(Previous {
            reference: at.reference(),
            bsdf_pdf: 1.0,
            specular: false,
            light_choice: LightChoice::ONE,
        });
        let mut lamps = Lamps(drawn.wi, |light| incoming.push(light));
        match walk.met {
            None => _ = path.escaped(scene, &walk, lambda, &mut lamps),
            Some(hit) => {
                let met = scene.geometry.interaction(&walk.ray, &hit);
                if met.light.is_some() {
                    path.emitted(scene, &walk, &met, lambda, &mut lamps);
                }
            }
        }
        walk.previous = Some(Previous {
            reference: at.reference(),
            bsdf_pdf: 0.0,
            specular: false,
            light_choice: LightChoice::ONE,
        });
        let radiance = go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
        incoming.push(Incoming { wi: drawn.wi, radiance, light_pdf: 0.0, found_by_bsdf: true });
    }
}

/// Catches what a ray sees of lamps that light samples find too, unweighted.
pub(crate) struct Lamps<F>(pub Vec3, pub F);

impl<F: FnMut(Incoming)> PathRecorder for Lamps<F> {
    fn contribution(&mut self, c: &Contribution) {
        if c.light_pdf > 0.0 && c.mis_weight > 0.0 {
            let radiance = c.radiance * (1.0 / c.mis_weight);
            (self.1)(Incoming { wi: self.0, radiance, light_pdf: c.light_pdf, found_by_bsdf: true });
        }
    }
}

/// The rest of a path, by the ordinary rules.
fn go_on<R: PathRecorder>(
    path: &PathIntegrator,
    scene: &Scene,
    member: &Member,
    walk: &mut Walk,
    lambda: &mut Wavelengths,
    stats: &mut RenderStats,
    recorder: &mut R,
) -> SampledSpectrum {
    let Some(camera_ray) = &member.sample.camera_ray else { return SampledSpectrum::ZERO };
    let mut radiance = SampledSpectrum::ZERO;
    let stream = &member.sample.stream;
    path.follow(walk, &mut radiance, None, scene, camera_ray, stream, lambda, &mut [], stats, recorder);
    radiance
}

/// Draws a direction, if there is one.
fn draw(bsdf: &Bsdf, wo: Vec3, draws: &ScatterDraws) -> Option<BsdfSample> {
    bsdf.sample(wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All)
}

/// Whether a vertex of this kind can be shared: directions are drawn with the very density that is stated, and no lobe is a delta.
pub(crate) fn is_shared(bsdf: &Bsdf) -> bool {
    match bsdf.bxdf {
        Bxdf::Diffuse(_) | Bxdf::DiffuseTransmission(_) | Bxdf::Conductor(_) => !bsdf.flags().is_specular(),
        _ => false,
    }
}

/// What roulette takes a path's own pixel to be worth at least, since others may see more of what the path finds.
pub(crate) const LEAST_IMPORTANCE: f32 = 0.1;

/// First vertices on metals with facets of a smaller alpha do not take part: what lights one pixel's mirror image is of no use to its
/// neighbour's.
pub(crate) const LEAST_ALPHA: f32 = 0.04;

/// Whether a first vertex of this kind gains from what its neighbours' paths find.
pub(crate) fn gains(bsdf: &Bsdf) -> bool {
    is_shared(bsdf) && !matches!(&bsdf.bxdf, Bxdf::Conductor(metal) if metal.alpha() < LEAST_ALPHA)
}

impl Member<'_> {
    /// Scattering at the first vertex for another path's wavelengths.
    fn bsdf_at(&self, scene: &Scene, first: &First, lambda: &Wavelengths) -> Option<Bsdf> {
        let mix = self.sample.stream.mix(0);
        let (at, mut lambda) = (&first.at, *lambda);
        scene.materials.bsdf(at.material, &scene.textures, at, &first.footprint, &mut lambda, mix)
    }
}

/// The blocks that have a pixel in `bounds`, aligned to multiples of their side, so that a pixel's companions do not depend on what is rendered.
fn blocks_of(bounds: &PixelBounds) -> impl Iterator<Item = PixelBounds> {
    let first = |low: i32| low.div_euclid(SIDE) * SIDE;
    let (left, right) = (first(bounds.x0), bounds.x1);
    (first(bounds.y0)..bounds.y1).step_by(SIDE as usize).flat_map(move |y0| {
        (left..right).step_by(SIDE as usize).map(move |x0| PixelBounds { x0, y0, x1: x0 + SIDE, y1: y0 + SIDE })
    })
}

/// A block's pixels, row by row.
fn pixels_of(block: &PixelBounds) -> impl Iterator<Item = [i32; 2]> + use<> {
    let PixelBounds { x0, x1, y0, y1 } = *block;
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| [x, y]))
}

/// The samples of one index of a block's pixels, row by row. They share the time.
fn samples_of_block<'a>(
    scene: &'a Scene,
    block: &PixelBounds,
    index: u32,
) -> impl Iterator<Item = CameraSample<'a>> + use<'a> {
    let time = scene.sampler.stream([block.x0, block.y0], index).camera().time;
    pixels_of(block).map(move |pixel| {
        let stream = scene.sampler.stream(pixel, index);
        camera_sample_by(scene, pixel, index, stream, CameraDraws { time, ..stream.camera() })
    })
}

/// What the film gets of a sample, but for the filter's weight: of its own radiance at its wavelengths, and of what the sensor makes of light that
/// is shared.
fn film_rgb(
    scene: &Scene,
    camera_weight: Option<f32>,
    lambda: &Wavelengths,
    radiance: SampledSpectrum,
    shared: [f32; 3],
) -> [f32; 3] {
    let Some(weight) = camera_weight else { return [0.0; 3] };
    let [r, g, b] = scene.sensor_response(radiance * weight, lambda);
    let [more_r, more_g, more_b] = shared;
    scene.film_rgb_of_response([r + more_r * weight, g + more_g * weight, b + more_b * weight])
}
