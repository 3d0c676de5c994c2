//! The books of energy (B08): what the lights emit is absorbed by surfaces or leaves the scene.
//!
//! Light is traced from the lamps, a light picked by its power, rays drawn by [`Light::emit`](irradiant_core::light::Light::emit).
//! The two sides of the books are estimated apart: how a particle goes on is drawn from the BSDF, and what its surface
//! absorbs is one minus the albedo by *other* random numbers, the smooth lobes evaluated in directions by the cosine alone. So they
//! balance only if sampling and evaluation agree, if nothing slips through surfaces, and if particles through glass
//! keep their power. Spectra are integrated over wavelengths: watts, in the scene's scale of its lights.

use super::Tally;
use super::view::grid;
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Sides, TransportMode};
use irradiant_core::geometry::AlphaTextures;
use irradiant_core::interaction::{Interaction, MaterialId, TextureContext};
use irradiant_core::light_sampler::PowerSampler;
use irradiant_core::sampler::Sampler;
use irradiant_core::scene::Scene;
use irradiant_math::{Point2, Vec3, warp};
use irradiant_scene::desc::SamplerKind;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// What to trace.
#[derive(Clone, Copy, Debug)]
pub struct AuditSettings {
    /// Particles.
    pub paths: u64,
    /// As the render's: light after more scattering events is left out there, and counted as such here. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Of the random numbers.
    pub seed: u64,
}

/// A power with its standard error, W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// The estimate.
    pub watts: f64,
    /// Its standard error.
    pub error: f64,
}

/// The books. All in watts.
#[derive(Clone, Debug)]
pub struct EnergyAudit {
    /// By the lights' own formula, without opacity; of lights at infinity what crosses the scene's disk.
    pub emitted_by_formula: f64,
    /// As traced.
    pub emitted: Power,
    /// By surfaces.
    pub absorbed: Power,
    /// Left the scene, or never met it.
    pub escaped: Power,
    /// Still under way at the depth limit.
    pub cut_off: Power,
    /// Emitted less all of the above: 0 within its error (which is not the sum of theirs: they go together).
    pub missing: Power,
    /// Absorbed by each material, by its number.
    pub by_material: Vec<(MaterialId, Power)>,
    /// Particles traced.
    pub paths: u64,
    /// Particles that Russian roulette ended; it takes nothing from the mean.
    pub ended_by_roulette: u64,
    /// Mean number of scattering events.
    pub mean_events: f64,
}

impl EnergyAudit {
    /// How far the books are from balance, in standard errors.
    pub fn z(&self) -> f64 {
        if self.missing.watts == 0.0 { 0.0 } else { self.missing.watts / self.missing.error }
    }
}

const EMITTED: usize = 0;
const ABSORBED: usize = 1;
const ESCAPED: usize = 2;
const CUT_OFF: usize = 3;
const MISSING: usize = 4;

/// Blocks of random numbers: of the light, then of each vertex.
const FIRST_VERTEX: u32 = 4;
const PER_VERTEX: u32 = 3;
/// Particles in one chunk: the result does not depend on threads.
const CHUNK: u64 = 2048;
/// After this many events even particles that lose nothing are ended now and then.
const LONG: u32 = 128;

#[derive(Clone)]
struct Chunk {
    sides: Tally<5>,
    materials: Vec<Tally<1>>,
    roulette: u64,
    events: u64,
}

/// Traces light from the lamps on all cores and keeps the books; `None` in a scene without light.
pub fn audit(scene: &Scene, settings: &AuditSettings) -> Option<EnergyAudit> {
    let lights = scene.lights.as_slice();
    let picker = PowerSampler::new(lights)?;
    let chunks = settings.paths.div_ceil(CHUNK).max(1);
    let sampler = Sampler::new(SamplerKind::Independent, 1, [1, 1], settings.seed ^ 0x9e37_79b9_7f4a_7c15);
    let all = grid(1, chunks as usize, |_, chunk| {
        let n = CHUNK.min(settings.paths - (chunk as u64 * CHUNK).min(settings.paths));
        let nothing = Chunk {
            sides: Tally::default(),
            materials: vec![Tally::default(); scene.materials.len()],
            roulette: 0,
            events: 0,
        };
        let mut particle = Particle {
            scene,
            picker: &picker,
            max_depth: settings.max_depth,
            sums: [0.0; 5],
            materials: vec![0.0; scene.materials.len()],
            books: nothing,
        };
        for i in 0..n {
            particle.trace(&sampler, [chunk as i32, 1], i as u32);
        }
        particle.books
    });
    let mut books = all.values.into_iter();
    let mut total = books.next()?;
    for chunk in books {
        total.sides.merge(&chunk.sides);
        total.materials.iter_mut().zip(&chunk.materials).for_each(|(a, b)| a.merge(b));
        total.roulette += chunk.roulette;
        total.events += chunk.events;
    }
    let power = |i: usize| Power { watts: total.sides.mean()[i], error: total.sides.error()[i] };
    let by_material = total
        .materials
        .iter()
        .enumerate()
        .map(|(i, t)| (MaterialId(i as u32), Power { watts: t.mean()[0], error: t.error()[0] }));
    // Powers by formula at many wavelengths, evenly drawn.
    let by_formula = (0..512)
        .map(|i| {
            let lambda = scene.sample_wavelengths((i as f32 + 0.5) / 512.0);
            lights.iter().map(|l| watts(l.power(&lambda), &lambda)).sum::<f64>()
        })
        .sum::<f64>()
        / 512.0;
    Some(EnergyAudit {
        emitted_by_formula: by_formula,
        emitted: power(EMITTED),
        absorbed: power(ABSORBED),
        escaped: power(ESCAPED),
        cut_off: power(CUT_OFF),
        missing: power(MISSING),
        by_material: by_material.filter(|(_, p)| p.watts != 0.0).collect(),
        paths: total.sides.count(),
        ended_by_roulette: total.roulette,
        mean_events: total.events as f64 / total.sides.count().max(1) as f64,
    })
}

/// The integral over wavelengths that a spectrum of power per nanometre estimates.
fn watts(power: SampledSpectrum, lambda: &Wavelengths) -> f64 {
    f64::from(power.safe_div(lambda.pdf()).average())
}

struct Particle<'a> {
    scene: &'a Scene,
    picker: &'a PowerSampler,
    max_depth: Option<u32>,
    sums: [f64; 5],
    materials: Vec<f64>,
    books: Chunk,
}

impl Particle<'_> {
    fn trace(&mut self, sampler: &Sampler, pixel: [i32; 2], index: u32) {
        self.sums = [0.0; 5];
        self.materials.fill(0.0);
        let stream = sampler.stream(pixel, index);
        self.follow(&|block| stream.block(block), &stream);
        self.sums[MISSING] = self.sums[EMITTED] - self.sums[ABSORBED] - self.sums[ESCAPED] - self.sums[CUT_OFF];
        self.books.sides.add(self.sums);
        for (tally, &sum) in self.books.materials.iter_mut().zip(&self.materials) {
            tally.add([sum]);
        }
    }

    fn follow(&mut self, block: &dyn Fn(u32) -> [f32; 4], stream: &irradiant_core::sampler::SampleStream) {
        let scene = self.scene;
        let ([pick, wavelength, time, _], [x, y, dx, dy]) = (block(0), block(1));
        let mut lambda = scene.sample_wavelengths(wavelength);
        let Some(picked) = self.picker.sample(pick) else { return };
        let time = scene.camera.time(time);
        let light = scene.lights.get(picked.id);
        let Some(emitted) = light.emit(Point2::new(x, y), Point2::new(dx, dy), &lambda, time) else { return };
        let cos =
            if emitted.normal.length_squared() > 0.0 { emitted.ray.d.dot_normal(emitted.normal).abs() } else { 1.0 };
        let there = emitted.alpha.map_or(1.0, |alpha| {
            let at = TextureContext::without_footprint(emitted.ray.o, emitted.normal, alpha.uv, 0);
            scene.alpha().alpha(alpha.texture, &at).clamp(0.0, 1.0)
        });
        let weight = cos * there / (emitted.pdf_position * emitted.pdf_direction * picked.pmf);
        let mut power = emitted.radiance * weight;
        if power.is_black() || !power.is_finite() {
            return;
        }
        self.sums[EMITTED] += watts(power, &lambda);
        let start = power.max_component();
        let mut ray = emitted.ray;
        let mut depth = 0;
        loop {
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else {
                self.sums[ESCAPED] += watts(power, &lambda);
                return;
            };
            let at = scene.geometry.interaction(&ray, &hit);
            let footprint = scene.texture_context(&at, None);
            let mix = stream.mix(depth + 1000);
            let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &footprint, &mut lambda, mix)
            else {
                ray = at.spawn_ray(ray.d);
                continue;
            };
            if self.max_depth.is_some_and(|limit| depth >= limit) {
                self.sums[CUT_OFF] += watts(power, &lambda);
                return;
            }
            let first = FIRST_VERTEX + depth * PER_VERTEX;
            let (scatter, other) = (block(first), [block(first + 1), block(first + 2)]);
            let kept = albedo(&bsdf, &at, other);
            let lost = watts(power, &lambda) - watts(power * kept, &lambda);
            self.sums[ABSORBED] += lost;
            if let Some(sum) = self.materials.get_mut(at.material.0 as usize) {
                *sum += lost;
            }
            let u = Point2::new(scatter[0], scatter[1]);
            let Some(s) = bsdf.sample(at.wo, scatter[2], u, TransportMode::Importance, Sides::All) else { return };
            power *= s.f * (bsdf.abs_cos(s.wi) * shading_correction(&bsdf, &at, s.wi) / s.pdf);
            depth += 1;
            self.books.events += 1;
            if power.is_black() {
                return;
            }
            let most = if depth < LONG { 1.0 } else { 0.95 };
            let survival = if depth < 2 { 1.0 } else { (power.max_component() / start).min(most) };
            if scatter[3] >= survival {
                self.books.roulette += 1;
                return;
            }
            power *= 1.0 / survival;
            ray = at.spawn_ray(s.wi);
        }
    }
}

/// What shading normals do to light that travels from the lamps (Veach 1997, section 5.3.2): 1 where they are the
/// geometric ones.
fn shading_correction(bsdf: &Bsdf, at: &Interaction, wi: Vec3) -> f32 {
    let numerator = bsdf.abs_cos(at.wo) * wi.dot_normal(at.n).abs();
    let denominator = at.wo.dot_normal(at.n).abs() * bsdf.abs_cos(wi);
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

/// An estimate of the share of light from `wo` that goes on: smooth lobes evaluated in directions by the cosine, mirrors by drawing them.
fn albedo(bsdf: &Bsdf, at: &Interaction, [a, b]: [[f32; 4]; 2]) -> SampledSpectrum {
    let flags = bsdf.flags();
    // About the cosine, on the sides that the model scatters to.
    let sides = if flags.is_reflective() && flags.is_transmissive() { 2.0 } else { 1.0 };
    let up = if sides == 2.0 { a[2] < 0.5 } else { flags.is_reflective() };
    let local = warp::cosine_hemisphere(Point2::new(a[0], a[1]));
    let w = bsdf.frame.from_local(local);
    let w = if (w.dot(bsdf.frame.z) * at.wo.dot(bsdf.frame.z) > 0.0) == up { w } else { -w };
    let mut kept = SampledSpectrum::ZERO;
    if flags.is_non_specular() {
        let weight = sides * PI * shading_correction(bsdf, at, w);
        kept += bsdf.f(at.wo, w, TransportMode::Importance) * weight;
    }
    if flags.is_specular()
        && let Some(s) = bsdf.sample(at.wo, b[0], Point2::new(b[1], b[2]), TransportMode::Importance, Sides::All)
        && s.lobe.is_specular()
    {
        kept += s.f * (bsdf.abs_cos(s.wi) * shading_correction(bsdf, at, s.wi) / s.pdf);
    }
    kept
}
