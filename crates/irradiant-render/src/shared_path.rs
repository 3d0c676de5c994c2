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
//! What is shared: second vertices on diffuse surfaces, whose light does not depend on where it is seen from, for first vertices on diffuse
//! surfaces. All else (direct light at the first vertex, lamps that the path meets, other materials) is each pixel's own, as in
//! [`path`](crate::path).
//!
//! Errors of the pixels of a block go together: a picture has less noise per pixel but what is left is blotchy, and the mean over
//! many pixels has the error that [`path`](crate::path) would give it. All of a block share the time; each path has wavelengths of its
//! own, at which it is seen by all, or blocks would be tinted.

use crate::camera_samples::{CameraSample, camera_sample_by};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::path::{PathIntegrator, Previous, Walk, direct_light, pick_light, survival_probability};
use crate::record::{Contribution, NoRecord, PathRecorder};
use crate::registry::{IntegratorEntry, LIGHT_SAMPLER, OptionEntry, OptionRange, Value};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Bxdf, Sides, TransportMode};
use irradiant_core::film::{FilmTile, PixelBounds};
use irradiant_core::interaction::{Interaction, ReferencePoint, TextureContext};
use irradiant_core::sampler::CameraDraws;
use irradiant_core::scene::Scene;
use irradiant_math::{Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Side of a block, pixels.
///
/// Relative variance times CPU time in the benchmark's Cornell box and interior, against `path`: 3 pixels 0.22 and 0.36, 4 pixels 0.12 and 0.22,
/// 6 pixels 0.19 and 0.32. Aligned blocks of powers of two are best because the samples of such blocks are stratified together (`zsobol`);
/// blocks that lie elsewhere in each sample look better, since their borders do not show, but 4 pixels are then at 0.20 and 0.34.
const SIDE: i32 = 4;
/// Pixels of a block.
const PIXELS: usize = (SIDE * SIDE) as usize;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "sharedpath",
    promise: "path tracing whose indirect light is shared among the pixels of a block",
    source: "Bekaert, Sbert and Halton 2002",
    options: &[
        OptionEntry {
            name: "lights",
            range: OptionRange::Count(1, 64),
            default: Value::Count(1),
            doc: "light samples at the first surface of each path",
        },
        LIGHT_SAMPLER,
    ],
    make: |options, max_depth| Box::new(SharedPathIntegrator { max_depth, light_samples: options.count("lights") }),
};

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedPathIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Light samples at the first surface, 1 or more.
    pub light_samples: u32,
}

/// A surface that the camera sees.
struct First {
    at: Interaction,
    footprint: TextureContext,
    /// At the wavelengths of its own path.
    bsdf: Bsdf,
    /// What the path carries after it: f cos / pdf.
    carried: SampledSpectrum,
}

/// A surface that a path meets next, with the light that it scatters (its own emission is not shared).
struct Second {
    place: ReferencePoint,
    wo: Vec3,
    light: Scattered,
}

/// Light that leaves a surface.
// Kept from block to block: a box would be allocated at each surface.
#[allow(clippy::large_enum_variant)]
enum Scattered {
    /// The same radiance in all directions of the side of this normal.
    Evenly { normal: Vec3, radiance: SampledSpectrum },
    /// As its BSDF has it.
    By { bsdf: Bsdf, incoming: Vec<Incoming> },
}

/// Light that arrives at a second vertex, by one sample of it.
struct Incoming {
    wi: Vec3,
    /// Arriving radiance.
    radiance: SampledSpectrum,
    /// Density with which light samples find it, 1/sr; 0 where they cannot.
    light_pdf: f32,
    /// Whether drawing directions from the BSDF finds it.
    found_by_bsdf: bool,
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

/// A second vertex as a first vertex sees it.
#[derive(Clone, Copy)]
struct Pair {
    giver: u8,
    receiver: u8,
    /// Density with which the receiver's BSDF finds the vertex, per area.
    pdf: f32,
    /// What the light there is multiplied with on its way to the camera.
    f: SampledSpectrum,
    /// From the second to the first.
    wo: Vec3,
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
    pairs: Vec<Pair>,
}

impl Integrator for SharedPathIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let bounds = &unit.bounds;
        let mut scratch = Scratch::default();
        scratch.layers.resize(scene.layers.channels() * PIXELS, 0.0);
        let channels = scene.layers.channels();
        for block in blocks(bounds) {
            for index in unit.samples.clone() {
                self.block(scene, &block, index, &mut scratch, stats);
                for (i, member) in scratch.members.iter().enumerate() {
                    let [x, y] = member.sample.pixel;
                    if x < bounds.x0 || x >= bounds.x1 || y < bounds.y0 || y >= bounds.y1 {
                        continue;
                    }
                    stats.paths += 1;
                    if !tile.add(x, y, member.rgb(scene), &scratch.layers[i * channels..(i + 1) * channels]) {
                        stats.refuse(x, y, index);
                    }
                }
            }
        }
    }

    fn check(&self, scene: &Scene) -> Result<(), String> {
        if scene.materials.may_pass() {
            return Err(
                "sharedpath cannot join surfaces through mixes that hold an interface; --integrator path can".into()
            );
        }
        Ok(())
    }

    fn limits(&self) -> Vec<Limit> {
        self.max_depth.map(Limit::MaxDepth).into_iter().chain(Limit::caustics_of_delta_lights(self.max_depth)).collect()
    }
}

impl SharedPathIntegrator {
    /// The paths of one sample of a block's pixels, with all light that they bring to their pixels.
    fn block<'a>(
        &self,
        scene: &'a Scene,
        block: &PixelBounds,
        index: u32,
        scratch: &mut Scratch<'a>,
        stats: &mut RenderStats,
    ) {
        let Scratch { members, layers, camera_rays, ends, .. } = scratch;
        let time = scene.sampler.stream([block.x0, block.y0], index).camera().time;
        members.clear();
        for y in block.y0..block.y1 {
            for x in block.x0..block.x1 {
                let stream = scene.sampler.stream([x, y], index);
                let draws = CameraDraws { time, ..stream.camera() };
                let sample = camera_sample_by(scene, [x, y], index, stream, draws);
                members.push(Member {
                    lambda: sample.lambda,
                    sample,
                    radiance: SampledSpectrum::ZERO,
                    shared: [0.0; 3],
                    first: None,
                    second: None,
                });
            }
        }
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
            self.trace(scene, member, walk, &mut lambda, layers, stats);
            member.lambda = lambda;
        }
        share(scene, scratch, stats);
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
    ) {
        let path = PathIntegrator { max_depth: self.max_depth, ..PathIntegrator::default() };
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
        let count = self.light_samples;
        if bsdf.flags().is_non_specular() {
            for i in 0..count {
                let draws = if count == 1 {
                    stream.light(0)
                } else {
                    scene.sampler.stream(member.sample.pixel, member.sample.index * count + i).light(0)
                };
                let (one, n) = (SampledSpectrum::ONE, count as f32);
                member.radiance +=
                    direct_light(scene, &at, &bsdf, &one, lambda, &draws, None, n, 0, stats, &mut NoRecord);
            }
        }
        if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_some() {
            return;
        }
        if let Some(previous) = &mut walk.previous {
            previous.bsdf_pdf /= count as f32;
        }
        if gains(&bsdf) {
            member.first = Some(First { at, footprint, bsdf, carried: walk.throughput });
            self.second(&path, scene, member, walk, lambda, stats);
        } else {
            member.radiance += go_on(&path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
        }
    }

    /// The second vertex of a path whose first can be shared.
    fn second(
        &self,
        path: &PathIntegrator,
        scene: &Scene,
        member: &mut Member,
        mut walk: Walk,
        lambda: &mut Wavelengths,
        stats: &mut RenderStats,
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
        if !is_shared(&bsdf) {
            let mut radiance = SampledSpectrum::ZERO;
            if bsdf.flags().is_non_specular() {
                let draws = stream.light(1);
                radiance += direct_light(
                    scene,
                    &at,
                    &bsdf,
                    &walk.throughput,
                    lambda,
                    &draws,
                    None,
                    1.0,
                    1,
                    stats,
                    &mut NoRecord,
                );
            }
            if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_none() {
                radiance += go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
            }
            member.radiance += radiance;
            return;
        }
        let light = match bsdf.bxdf {
            Bxdf::Diffuse(_) => {
                // From here on light counts as it leaves this surface; roulette goes by what arrives at the camera.
                walk.eta_scale = walk.throughput.max_component();
                walk.throughput = SampledSpectrum::ONE;
                let draws = stream.light(1);
                let one = SampledSpectrum::ONE;
                let mut radiance =
                    direct_light(scene, &at, &bsdf, &one, lambda, &draws, None, 1.0, 1, stats, &mut NoRecord);
                if path.scatter(scene, &at, &bsdf, &mut walk, &stream, stats, &mut NoRecord).is_none() {
                    radiance += go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
                }
                let normal = bsdf.frame.z * 1f32.copysign(at.wo.dot(bsdf.frame.z));
                Scattered::Evenly { normal, radiance }
            }
            _ => {
                let incoming = self.incoming(path, scene, member, &at, &bsdf, walk, lambda, stats);
                Scattered::By { bsdf, incoming }
            }
        };
        member.second = Some(Second { place: at.reference(), wo: at.wo, light });
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
    ) -> Vec<Incoming> {
        let stream = &member.sample.stream;
        let mut incoming = Vec::with_capacity(4);
        if let Some(pick) = pick_light(scene, at, lambda, &stream.light(1), None)
            && !pick.arriving.is_black()
        {
            stats.shadow_rays += 1;
            if !scene.is_occluded(at, &pick.sample) {
                incoming.push(Incoming {
                    wi: pick.sample.wi,
                    radiance: pick.arriving,
                    light_pdf: pick.pdf,
                    found_by_bsdf: !pick.sample.is_delta,
                });
            }
        }
        let draws = stream.scatter(1);
        let Some(drawn) = bsdf.sample(at.wo, draws.lobe, draws.uv, TransportMode::Radiance, Sides::All) else {
            return incoming;
        };
        walk.depth += 1;
        stats.scatterings += 1;
        stats.longest_path = stats.longest_path.max(walk.depth);
        walk.throughput *= drawn.f * (bsdf.abs_cos(drawn.wi) / drawn.pdf);
        let survival = survival_probability(&walk.throughput, walk.eta_scale, walk.depth);
        if walk.throughput.is_black() || draws.roulette >= survival {
            return incoming;
        }
        walk.eta_scale *= walk.throughput.max_component();
        walk.throughput = SampledSpectrum::splat(1.0 / survival);
        walk.previous = Some(Previous { reference: at.reference(), bsdf_pdf: 1.0, specular: false });
        walk.ray = at.spawn_ray(drawn.wi);
        walk.escape_place = scene.lights.place_of_escape(drawn.wi);
        stats.bounce_rays += 1;
        walk.met = scene.geometry.intersect(&walk.ray, f32::INFINITY, &scene.alpha());
        // Lamps that light samples could have found; then all else.
        let mut lamps = Lamps(drawn.wi, &mut incoming);
        match walk.met {
            None => _ = path.escaped(scene, &walk, lambda, &mut lamps),
            Some(hit) => {
                let met = scene.geometry.interaction(&walk.ray, &hit);
                if met.light.is_some() {
                    path.emitted(scene, &walk, &met, lambda, &mut lamps);
                }
            }
        }
        walk.previous = Some(Previous { reference: at.reference(), bsdf_pdf: 0.0, specular: false });
        let radiance = go_on(path, scene, member, &mut walk, lambda, stats, &mut NoRecord);
        incoming.push(Incoming { wi: drawn.wi, radiance, light_pdf: 0.0, found_by_bsdf: true });
        incoming
    }
}

/// Catches what a ray sees of lamps that light samples find too, unweighted.
struct Lamps<'a>(Vec3, &'a mut Vec<Incoming>);

impl PathRecorder for Lamps<'_> {
    fn contribution(&mut self, c: &Contribution) {
        if c.light_pdf > 0.0 && c.mis_weight > 0.0 {
            let radiance = c.radiance * (1.0 / c.mis_weight);
            self.1.push(Incoming { wi: self.0, radiance, light_pdf: c.light_pdf, found_by_bsdf: true });
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

/// Whether a vertex of this kind can be shared: directions are drawn with the very density that is stated, and no lobe is a delta.
fn is_shared(bsdf: &Bsdf) -> bool {
    match bsdf.bxdf {
        Bxdf::Diffuse(_) | Bxdf::DiffuseTransmission(_) | Bxdf::Conductor(_) => !bsdf.flags().is_specular(),
        _ => false,
    }
}

/// First vertices on metals with facets of a smaller alpha do not take part: what lights one pixel's mirror image is of no use to its
/// neighbour's.
const LEAST_ALPHA: f32 = 0.04;

/// Whether a first vertex of this kind gains from what its neighbours' paths find.
fn gains(bsdf: &Bsdf) -> bool {
    is_shared(bsdf) && !matches!(&bsdf.bxdf, Bxdf::Conductor(metal) if metal.alpha() < LEAST_ALPHA)
}

impl Member<'_> {
    /// What the film gets.
    fn rgb(&self, scene: &Scene) -> [f32; 3] {
        let Some(camera_ray) = &self.sample.camera_ray else { return [0.0; 3] };
        let own = scene.sensor_response(self.radiance * camera_ray.weight, &self.lambda);
        let response = std::array::from_fn(|c| own[c] + self.shared[c] * camera_ray.weight);
        scene.film_rgb_of_response(response).map(|c| c * self.sample.filter_weight)
    }

    /// Scattering at the first vertex for another path's wavelengths.
    fn bsdf_at(&self, scene: &Scene, first: &First, lambda: &Wavelengths) -> Option<Bsdf> {
        if *lambda == self.lambda {
            return Some(first.bsdf);
        }
        let mix = self.sample.stream.mix(0);
        let (at, mut lambda) = (&first.at, *lambda);
        scene.materials.bsdf(at.material, &scene.textures, at, &first.footprint, &mut lambda, mix)
    }
}

/// The blocks that have a pixel in `bounds`, aligned to multiples of their side, so that a pixel's companions do not depend on what is rendered.
fn blocks(bounds: &PixelBounds) -> impl Iterator<Item = PixelBounds> {
    let first = |low: i32| low.div_euclid(SIDE) * SIDE;
    let (left, right) = (first(bounds.x0), bounds.x1);
    (first(bounds.y0)..bounds.y1).step_by(SIDE as usize).flat_map(move |y0| {
        (left..right).step_by(SIDE as usize).map(move |x0| PixelBounds { x0, y0, x1: x0 + SIDE, y1: y0 + SIDE })
    })
}

/// Brings the light of all second vertices to all first ones.
fn share(scene: &Scene, scratch: &mut Scratch, stats: &mut RenderStats) {
    let Scratch { members, layers, rays, ends, blocked, pairs, .. } = scratch;
    rays.clear();
    pairs.clear();
    for (j, giver) in members.iter().enumerate() {
        let Some(second) = &giver.second else { continue };
        for (i, receiver) in members.iter().enumerate() {
            let Some(first) = &receiver.first else { continue };
            let d = second.place.p - first.at.p;
            let r2 = d.length_squared();
            let wi = d * (1.0 / r2.sqrt());
            if let Scattered::Evenly { normal, .. } = second.light
                && !(wi.dot(normal) < 0.0)
            {
                continue;
            }
            let Some(bsdf) = receiver.bsdf_at(scene, first, &giver.lambda) else { continue };
            let (f, pdf) = bsdf.f_and_pdf(first.at.wo, wi, TransportMode::Radiance);
            // Per area instead of solid angle.
            let there = wi.dot_normal(second.place.n).abs() / r2;
            let pdf = pdf * there;
            if !(pdf > 0.0) || !pdf.is_finite() {
                continue;
            }
            let f = f * (bsdf.abs_cos(wi) * there);
            pairs.push(Pair { giver: j as u8, receiver: i as u8, pdf, f, wo: -wi });
            if i != j {
                let ReferencePoint { p, p_error, n, .. } = second.place;
                rays.push(first.at.spawn_ray_to(p, p_error, n));
            }
        }
    }
    ends.clear();
    ends.resize(rays.len(), 1.0);
    blocked.clear();
    blocked.resize(rays.len(), false);
    // Those to one second vertex travel together.
    let mut first = 0;
    for to_one in pairs.chunk_by(|a, b| a.giver == b.giver) {
        let count = to_one.iter().filter(|p| p.giver != p.receiver).count();
        let these = first..first + count;
        scene.geometry.occluded_batch(&rays[these.clone()], &ends[these.clone()], &scene.alpha(), &mut blocked[these]);
        first += count;
    }
    stats.shadow_rays += rays.len() as u64;
    let mut answers = blocked.iter();
    pairs.retain(|pair| pair.giver == pair.receiver || answers.next() != Some(&true));

    let channels = scene.layers.channels();
    let mut rest = &pairs[..];
    for j in 0..members.len() {
        let (seen, others) = rest.split_at(rest.partition_point(|p| usize::from(p.giver) <= j));
        rest = others;
        let (Some(second), Some(first)) = (members[j].second.take(), &members[j].first) else { continue };
        // Where numbers are too coarse to see again what the path saw, at grazing angles, it keeps what it found.
        let own = [Pair { giver: j as u8, receiver: j as u8, pdf: 1.0, f: first.carried, wo: second.wo }];
        let seen = if seen.iter().any(|p| p.receiver == p.giver) { seen } else { &own };
        let lambda = members[j].lambda;
        second.light.give(seen, |receiver, radiance| {
            let member = &mut members[receiver];
            let response = scene.sensor_response(radiance, &lambda);
            (0..3).for_each(|c| member.shared[c] += response[c]);
            let weight = member.sample.camera_ray.map_or(0.0, |c| c.weight);
            scene.layers.add_buckets(
                radiance * weight,
                &lambda,
                &mut layers[receiver * channels..(receiver + 1) * channels],
            );
        });
    }
}

impl Scattered {
    /// Gives each first vertex that sees this one its share: its member and the radiance that reaches the camera.
    fn give(&self, seen: &[Pair], mut to: impl FnMut(usize, SampledSpectrum)) {
        match self {
            Self::Evenly { radiance, .. } => {
                let total: f32 = seen.iter().map(|p| p.pdf).sum();
                for pair in seen {
                    to(usize::from(pair.receiver), pair.f * *radiance * (1.0 / total));
                }
            }
            Self::By { bsdf, incoming } => {
                for light in incoming {
                    let mut f = [SampledSpectrum::ZERO; PIXELS];
                    let mut total = 0.0;
                    for (pair, f) in seen.iter().zip(&mut f) {
                        let (value, pdf) = bsdf.f_and_pdf(pair.wo, light.wi, TransportMode::Radiance);
                        *f = value;
                        total += pair.pdf * (light.light_pdf + if light.found_by_bsdf { pdf } else { 0.0 });
                    }
                    if !(total > 0.0) {
                        continue;
                    }
                    let radiance = light.radiance * (bsdf.abs_cos(light.wi) / total);
                    for (pair, f) in seen.iter().zip(&f) {
                        to(usize::from(pair.receiver), pair.f * *f * radiance);
                    }
                }
            }
        }
    }
}
