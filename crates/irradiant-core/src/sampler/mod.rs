//! Random numbers: a sample's are a pure function of (seed, pixel, sample index, named dimension).
//!
//! Numbers come in named blocks of four dimensions ([`CameraDraws`], [`LightDraws`], [`ScatterDraws`]): adding a draw in
//! one model does not shift all others, and a block's four dimensions are stratified together. [`Sampler::stream`]
//! names a sample; its methods compute blocks on demand, in any order. A sample may have a path from a light beside the
//! one from the camera ([`SampleStream::emission`]).
//!
//! All of pbrt-v4's samplers are here by name; where an implementation differs, the variant's doc says how. Expected
//! values never depend on the sampler.

mod lanes;

pub use lanes::{BlockLanes, StreamLanes};

use irradiant_math::Point2;
use irradiant_math::elementary::ONE_MINUS_EPSILON;
use irradiant_math::hash::{hash2, hash4, mix32, permutation_element, unit_f32};
use irradiant_math::sequence::DigitPermutations;
use irradiant_math::sequence::{
    N_SOBOL_DIMENSIONS, PRIMES, SobolPixels, morton_encode_2, nested_uniform_scramble_base2,
    owen_scrambled_radical_inverse, owen_sobol_2d, owen_sobol_4d, owen_sobol_4d_of_reversed, radical_inverse,
    scrambled_radical_inverse, sobol_4d, sobol_64,
};
use irradiant_scene::desc::{Randomization, SamplerKind};
use std::cell::RefCell;
use std::sync::Arc;

/// The camera's numbers, each in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraDraws {
    /// Where in the pixel filter.
    pub film: Point2,
    /// When in the shutter.
    pub time: f32,
    /// Which wavelengths.
    pub wavelength: f32,
}

/// Numbers for sampling a light at a vertex, each in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightDraws {
    /// Which light.
    pub pick: f32,
    /// Where on it.
    pub uv: Point2,
    /// One to spare, for resampling.
    pub resample: f32,
}

impl LightDraws {
    /// [`LightDraws::pick`] squeezed into stratum `i` of `count` equal ones.
    #[inline]
    pub fn pick_in_stratum(&self, i: u32, count: u32) -> f32 {
        ((self.pick + i as f32) / count as f32).min(ONE_MINUS_EPSILON)
    }
}

/// Numbers for scattering at a vertex, each in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatterDraws {
    /// Which lobe.
    pub lobe: f32,
    /// Which direction.
    pub uv: Point2,
    /// Russian roulette.
    pub roulette: f32,
}

/// Numbers for the start of a path at a light, each in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionDraws {
    /// Which light.
    pub pick: f32,
    /// Where on it.
    pub position: Point2,
    /// Which way.
    pub direction: Point2,
}

/// Blocks of a vertex: light (of a path from a light: lens), scatter, mix.
const BLOCKS_PER_VERTEX: u32 = 3;
/// The first block of the path from a light that belongs to the sample: two for its start, then those of its vertices.
/// Farther than any path from the camera comes.
const LIGHT_PATH: u32 = 0x0100_0000;
const EMISSION_BLOCKS: u32 = 2;
const CAMERA_BLOCKS: u32 = 2;
/// Blocks that belong to no vertex; beyond those of vertices, below those of mixes inside mixes.
const BRANCH_BLOCKS: u32 = 0x1000_0000;

/// A kind of sampler with its settings.
#[derive(Clone, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    seed: u64,
    samples_per_pixel: u32,
    log2_samples: u32,
    log2_size: u32,
    /// The seed of `zsobol`'s first 2^32 points in the first 2^16 pixels each way: most samples'.
    first_seed: u32,
    global: Option<Arc<SobolPixels>>,
    permutations: Arc<[DigitPermutations]>,
}

/// One sample's numbers.
#[derive(Clone, Copy, Debug)]
pub struct SampleStream<'a> {
    sampler: &'a Sampler,
    source: Source<'a>,
}

/// Which blocks of numbers a sample asked for, in order: for auditing integrators.
#[derive(Debug, Default)]
pub struct DrawLog(RefCell<Vec<u32>>);

impl DrawLog {
    /// The blocks, in the order in which they were asked for.
    pub fn blocks(&self) -> Vec<u32> {
        self.0.borrow().clone()
    }
}

/// What a block of numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawKind {
    /// Film, wavelengths, time.
    Camera,
    /// The place on the lens.
    Lens,
    /// Light sampling at the vertex after so many scattering events.
    Light(u32),
    /// Scattering there, and the roulette that follows.
    Scatter(u32),
    /// Choices among mixed materials there.
    Mix(u32),
}

impl DrawKind {
    /// What the block of a number is for.
    pub fn of(block: u32) -> Self {
        let Some(vertex) = block.checked_sub(CAMERA_BLOCKS) else {
            return if block == 0 { Self::Camera } else { Self::Lens };
        };
        let depth = vertex / BLOCKS_PER_VERTEX;
        match vertex % BLOCKS_PER_VERTEX {
            0 => Self::Light(depth),
            1 => Self::Scatter(depth),
            _ => Self::Mix(depth),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    /// Hashes of this and the block; written down.
    Logged { key: u64, log: &'a DrawLog },
    /// Hashes of this and the block.
    Independent { key: u64 },
    /// A point of a scrambled Sobol sequence whose seed is mixed with the block. Its index has its bits reversed, as all
    /// blocks want it.
    Padded { reversed_index: u32, seed: u32, randomization: Randomization },
    /// As `Padded`, two dimensions at a time.
    Pairs { index: u32, seed: u32 },
    /// Stratum `index` of x by y.
    Stratified { index: u32, seed: u32, x: u32, y: u32, jitter: bool },
    /// Point `index` of a Halton sequence scrambled by `seed`.
    Halton { index: u32, seed: u32, randomization: Randomization },
    /// Point `index` of one Sobol sequence over the image; the pixel for dimensions 0 and 1.
    Global { index: u64, pixel: [u32; 2], log2_size: u32, fallback: (u32, u32), randomization: Randomization },
}

impl Sampler {
    /// For an image of `resolution` pixels with `samples_per_pixel` planned (more may be drawn; they are then less well
    /// stratified).
    pub fn new(kind: SamplerKind, samples_per_pixel: u32, resolution: [u32; 2], seed: u64) -> Self {
        let log2_size = resolution[0].max(resolution[1]).max(1).next_power_of_two().trailing_zeros();
        let global = matches!(kind, SamplerKind::Sobol(_)).then(|| SobolPixels::new(log2_size)).flatten();
        let permutations = match kind {
            SamplerKind::Halton(Randomization::PermuteDigits) => {
                (0..PRIMES.len()).map(|i| DigitPermutations::new(i, hash2(seed, i as u64) as u32)).collect()
            }
            _ => Arc::from([]),
        };
        Self {
            kind,
            seed,
            samples_per_pixel,
            log2_samples: samples_per_pixel.max(1).next_power_of_two().trailing_zeros(),
            log2_size,
            first_seed: hash4(seed, 0, 0, 0) as u32,
            global: global.map(Arc::new),
            permutations,
        }
    }

    /// The name that scene files use.
    pub fn name(&self) -> &'static str {
        match self.kind {
            SamplerKind::Independent => "independent",
            SamplerKind::Stratified { .. } => "stratified",
            SamplerKind::Halton(_) => "halton",
            SamplerKind::Sobol(_) => "sobol",
            SamplerKind::PaddedSobol(_) => "paddedsobol",
            SamplerKind::ZSobol => "zsobol",
            SamplerKind::Pmj02bn => "pmj02bn",
        }
    }

    /// The numbers of a sample. Pixels may be negative.
    #[inline]
    pub fn stream(&self, pixel: [i32; 2], index: u32) -> SampleStream<'_> {
        let (x, y) = (pixel[0] as u32, pixel[1] as u32);
        let pixel_word = (x as u64) << 32 | y as u64;
        let pixel_seed = || hash2(self.seed, pixel_word) as u32;
        let source = match self.kind {
            SamplerKind::Independent => Source::Independent { key: hash4(self.seed, pixel_word, index as u64, 0) },
            SamplerKind::Stratified { x, y, jitter } => {
                Source::Stratified { index, seed: pixel_seed(), x: x.max(1), y: y.max(1), jitter }
            }
            SamplerKind::Halton(randomization) => Source::Halton { index, seed: pixel_seed(), randomization },
            SamplerKind::PaddedSobol(randomization) => {
                Source::Padded { reversed_index: index.reverse_bits(), seed: pixel_seed(), randomization }
            }
            SamplerKind::Pmj02bn => Source::Pairs { index, seed: pixel_seed() },
            // Ahmed and Wonka 2020: consecutive runs of the sequence along a Morton curve over the image, so that
            // neighbouring pixels' errors cancel. The nested shuffle is base 2 here. Theirs in base 4 pairs pixels in all three ways at random, also
            // by the diagonal: of independent samples' error after a Gaussian of 1 pixel 0.46, 0.160, 0.081 are left with 1, 4, 16 samples where base 2
            // leaves 0.42, 0.155, 0.079 (decision 7, with pictures and what OpenQMC's tables leave). A Hilbert curve instead of Morton's: 0.425, 0.155, 0.077.
            SamplerKind::ZSobol => {
                let along = morton_encode_2(x & 0xffff, y & 0xffff) as u64;
                let index = (along << self.log2_samples) + index as u64;
                // Beyond 2^32 points the sequence starts again, scrambled anew.
                let beyond = [index >> 32, (x >> 16) as u64, (y >> 16) as u64];
                let seed = match beyond {
                    [0, 0, 0] => self.first_seed,
                    [run, x, y] => hash4(self.seed, run, x, y) as u32,
                };
                Source::Padded {
                    reversed_index: (index as u32).reverse_bits(),
                    seed,
                    randomization: Randomization::FastOwen,
                }
            }
            SamplerKind::Sobol(randomization) => match &self.global {
                Some(global) if (x | y) >> self.log2_size == 0 => Source::Global {
                    index: global.index(index as u64, x, y),
                    pixel: [x, y],
                    log2_size: self.log2_size,
                    fallback: (index, pixel_seed()),
                    randomization,
                },
                _ => Source::Padded { reversed_index: index.reverse_bits(), seed: pixel_seed(), randomization },
            },
        };
        SampleStream { sampler: self, source }
    }

    /// The numbers of photon `index` of a pass of a picture made of photons: of one pass stratified over the photons,
    /// but for `independent`.
    #[inline]
    pub fn photon(&self, pass: u32, index: u32) -> SampleStream<'_> {
        // Of no pixel: the last word keeps these apart from the pixels' numbers.
        let source = match self.kind {
            SamplerKind::Independent => {
                Source::Independent { key: hash4(self.seed, u64::from(pass), u64::from(index), 1) }
            }
            SamplerKind::Stratified { .. }
            | SamplerKind::Halton(_)
            | SamplerKind::Sobol(_)
            | SamplerKind::PaddedSobol(_)
            | SamplerKind::ZSobol
            | SamplerKind::Pmj02bn => Source::Padded {
                reversed_index: index.reverse_bits(),
                seed: hash4(self.seed, u64::from(pass), 0, 2) as u32,
                randomization: Randomization::FastOwen,
            },
        };
        SampleStream { sampler: self, source }
    }

    /// Samples per pixel that the strata are laid out for.
    pub fn samples_per_pixel(&self) -> u32 {
        self.samples_per_pixel
    }
}

impl<'a> SampleStream<'a> {
    /// Independent numbers of a sample, whose blocks are written down as they are asked for.
    pub fn logged(sampler: &'a Sampler, key: u64, log: &'a DrawLog) -> Self {
        Self { sampler, source: Source::Logged { key, log } }
    }
}

impl SampleStream<'_> {
    /// The camera's numbers.
    #[inline]
    pub fn camera(&self) -> CameraDraws {
        let [x, y, wavelength, time] = self.block(0);
        CameraDraws { film: Point2::new(x, y), time, wavelength }
    }

    /// Where on the lens; for cameras that have one.
    #[inline]
    pub fn lens(&self) -> Point2 {
        let [x, y, _, _] = self.block(1);
        Point2::new(x, y)
    }

    /// Numbers for light sampling at the vertex after `depth` scattering events.
    #[inline]
    pub fn light(&self, depth: u32) -> LightDraws {
        self.light_block(CAMERA_BLOCKS + depth * BLOCKS_PER_VERTEX)
    }

    /// Numbers for scattering at the vertex after `depth` scattering events.
    #[inline]
    pub fn scatter(&self, depth: u32) -> ScatterDraws {
        self.scatter_block(CAMERA_BLOCKS + 1 + depth * BLOCKS_PER_VERTEX)
    }

    /// Numbers for a light sample beyond the one of each vertex, for estimators that take several; `i` below 2^28 names it among all
    /// such blocks of the sample.
    pub fn another_light(&self, i: u32) -> LightDraws {
        self.light_block(BRANCH_BLOCKS + i)
    }

    /// Numbers for a direction beyond the one of each vertex, as [`SampleStream::another_light`].
    pub fn another_scatter(&self, i: u32) -> ScatterDraws {
        self.scatter_block(BRANCH_BLOCKS + i)
    }

    #[inline]
    fn light_block(&self, block: u32) -> LightDraws {
        let [u, v, pick, resample] = self.block(block);
        LightDraws { pick, uv: Point2::new(u, v), resample }
    }

    #[inline]
    fn scatter_block(&self, block: u32) -> ScatterDraws {
        let [u, v, lobe, roulette] = self.block(block);
        ScatterDraws { lobe, uv: Point2::new(u, v), roulette }
    }

    /// A number for choosing among mixed materials at the vertex after `depth` scattering events.
    #[inline]
    pub fn mix(&self, depth: u32) -> MixDraw<'_> {
        MixDraw { stream: self, block: CAMERA_BLOCKS + 2 + depth * BLOCKS_PER_VERTEX }
    }

    /// Numbers for the start of the sample's path from a light.
    #[inline]
    pub fn emission(&self) -> EmissionDraws {
        let [x, y, u, v] = self.block(LIGHT_PATH);
        let [pick, ..] = self.block(LIGHT_PATH + 1);
        EmissionDraws { pick, position: Point2::new(x, y), direction: Point2::new(u, v) }
    }

    /// Where on the lens the vertex after `depth` scattering events of the path from a light is seen from.
    #[inline]
    pub fn light_path_lens(&self, depth: u32) -> Point2 {
        let [x, y, _, _] = self.block(LIGHT_PATH + EMISSION_BLOCKS + depth * BLOCKS_PER_VERTEX);
        Point2::new(x, y)
    }

    /// Numbers for scattering at the vertex after `depth` scattering events of the path from a light.
    #[inline]
    pub fn light_path_scatter(&self, depth: u32) -> ScatterDraws {
        let [u, v, lobe, roulette] = self.block(LIGHT_PATH + EMISSION_BLOCKS + 1 + depth * BLOCKS_PER_VERTEX);
        ScatterDraws { lobe, uv: Point2::new(u, v), roulette }
    }

    /// As [`SampleStream::mix`], for the path from a light.
    #[inline]
    pub fn light_path_mix(&self, depth: u32) -> MixDraw<'_> {
        MixDraw { stream: self, block: LIGHT_PATH + EMISSION_BLOCKS + 2 + depth * BLOCKS_PER_VERTEX }
    }

    /// Four numbers in [0, 1), stratified together over a pixel's samples; different blocks are independent.
    #[inline]
    pub fn block(&self, block: u32) -> [f32; 4] {
        match self.source {
            Source::Padded { reversed_index, seed, randomization } => {
                let index = || reversed_index.reverse_bits();
                let seed = mix32(seed ^ block.wrapping_mul(0x9e37_79b9));
                match randomization {
                    Randomization::FastOwen | Randomization::Owen => owen_sobol_4d_of_reversed(reversed_index, seed),
                    Randomization::None => sobol_4d(nested_uniform_scramble_base2(index(), seed)).map(unit_f32),
                    Randomization::PermuteDigits => {
                        let v = sobol_4d(nested_uniform_scramble_base2(index(), seed));
                        std::array::from_fn(|d| unit_f32(v[d] ^ mix32(seed.wrapping_add(d as u32 + 1))))
                    }
                }
            }
            _ => self.other_block(block),
        }
    }

    /// The samplers that are not the fast path.
    #[inline(never)]
    fn other_block(&self, block: u32) -> [f32; 4] {
        match self.source {
            Source::Padded { .. } => unreachable!("handled by the caller"),
            Source::Logged { key, log } => {
                log.0.borrow_mut().push(block);
                SampleStream { source: Source::Independent { key }, ..*self }.other_block(block)
            }
            Source::Independent { key } => {
                let (a, b) = (hash2(key, 2 * block as u64), hash2(key, 2 * block as u64 + 1));
                [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32].map(unit_f32)
            }
            Source::Pairs { index, seed } => {
                let seed = mix32(seed ^ block.wrapping_mul(0x9e37_79b9));
                let ([a, b], [c, d]) = (owen_sobol_2d(index, seed), owen_sobol_2d(index, mix32(seed ^ 0x5bd1_e995)));
                [a, b, c, d]
            }
            Source::Stratified { index, seed, x, y, jitter } => {
                let n = x.saturating_mul(y);
                let seed = mix32(seed ^ block.wrapping_mul(0x9e37_79b9) ^ (index / n).wrapping_mul(0x85eb_ca6b));
                let noise = |d: u32| {
                    if jitter { unit_f32(hash4(seed as u64, index as u64, d as u64, 1) as u32) } else { 0.5 }
                };
                let stratum = |d: u32| permutation_element(index % n, n, mix32(seed.wrapping_add(d)));
                let pair = stratum(0);
                let linear = |d: u32| ((stratum(d) as f32 + noise(d)) / n as f32).min(ONE_MINUS);
                [
                    (((pair % x) as f32 + noise(0)) / x as f32).min(ONE_MINUS),
                    (((pair / x) as f32 + noise(1)) / y as f32).min(ONE_MINUS),
                    linear(2),
                    linear(3),
                ]
            }
            Source::Halton { index, seed, randomization } => std::array::from_fn(|d| {
                let dimension = 4 * block as usize + d;
                if dimension >= PRIMES.len() {
                    return owen_sobol_4d(index, mix32(seed ^ block.wrapping_mul(0x9e37_79b9)))[d];
                }
                let dimension_seed = mix32(seed ^ (dimension as u32).wrapping_mul(0x9e37_79b9));
                match randomization {
                    Randomization::FastOwen | Randomization::Owen => {
                        owen_scrambled_radical_inverse(dimension, index as u64, dimension_seed)
                    }
                    // Without a scramble of its own each pixel takes another stretch of the sequence.
                    Randomization::None => radical_inverse(dimension, index as u64 + (seed >> 12) as u64),
                    Randomization::PermuteDigits => scrambled_radical_inverse(
                        &self.sampler.permutations[dimension],
                        index as u64 + (seed >> 12) as u64,
                    ),
                }
                .min(ONE_MINUS)
            }),
            Source::Global { index, pixel, log2_size, fallback, randomization } => std::array::from_fn(|d| {
                let dimension = 4 * block as usize + d;
                if dimension >= N_SOBOL_DIMENSIONS {
                    return owen_sobol_4d(fallback.0, mix32(fallback.1 ^ block.wrapping_mul(0x9e37_79b9)))[d];
                }
                let v = sobol_64(index, dimension);
                if dimension < 2 {
                    // The point's place inside its pixel.
                    let inside = (v as u64) << log2_size & 0xffff_ffff;
                    debug_assert_eq!((v as u64) << log2_size >> 32, pixel[dimension] as u64);
                    return unit_f32(inside as u32);
                }
                let dimension_seed = hash2(self.sampler.seed, dimension as u64) as u32;
                match randomization {
                    Randomization::None => unit_f32(v),
                    Randomization::PermuteDigits => unit_f32(v ^ dimension_seed),
                    _ => unit_f32(nested_uniform_scramble_base2(v, dimension_seed)),
                }
            }),
        }
    }
}

const ONE_MINUS: f32 = 1.0 - f32::EPSILON / 2.0;

/// A number that is computed only if a mixed material asks.
#[derive(Clone, Copy, Debug)]
pub struct MixDraw<'a> {
    stream: &'a SampleStream<'a>,
    block: u32,
}

impl MixDraw<'_> {
    /// The `i`th number for mixes inside mixes, in [0, 1).
    #[inline]
    pub fn get(&self, i: u32) -> f32 {
        self.stream.block(self.block + (i / 4).wrapping_mul(0x4000_0000))[(i % 4) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [SamplerKind; 12] = [
        SamplerKind::Independent,
        SamplerKind::Stratified { x: 8, y: 8, jitter: true },
        SamplerKind::Halton(Randomization::Owen),
        SamplerKind::Halton(Randomization::PermuteDigits),
        SamplerKind::Halton(Randomization::None),
        SamplerKind::Sobol(Randomization::FastOwen),
        SamplerKind::Sobol(Randomization::None),
        SamplerKind::PaddedSobol(Randomization::FastOwen),
        SamplerKind::PaddedSobol(Randomization::PermuteDigits),
        SamplerKind::PaddedSobol(Randomization::None),
        SamplerKind::ZSobol,
        SamplerKind::Pmj02bn,
    ];

    #[test]
    fn numbers_are_in_range_and_pure() {
        for kind in ALL {
            let sampler = Sampler::new(kind, 64, [100, 80], 7);
            for (x, y, i) in [(0, 0, 0), (99, 79, 63), (5, 70, 1000), (-3, 4, 2)] {
                for block in [0, 1, 2, 17, 400] {
                    let a = sampler.stream([x, y], i).block(block);
                    assert!(a.iter().all(|u| (0.0..1.0).contains(u)), "{kind:?} {a:?}");
                    assert_eq!(a, sampler.stream([x, y], i).block(block));
                }
            }
        }
    }

    /// Means and mean products over pixels and samples: 5 sigma for independent samples is a bias of 1 % here; the false
    /// alarm rate is below 1e-4 over all checks (and low-discrepancy samples are far inside).
    #[test]
    fn numbers_are_uniform_and_blocks_are_uncorrelated() {
        for kind in ALL {
            if matches!(kind, SamplerKind::Halton(Randomization::None) | SamplerKind::Sobol(Randomization::None)) {
                continue; // Deterministic points: no expectation to speak of.
            }
            let sampler = Sampler::new(kind, 64, [32, 32], 3);
            let (mut sums, mut products, mut n) = ([0f64; 8], [0f64; 4], 0.0);
            for y in 0..32 {
                for x in 0..32 {
                    for i in 0..64 {
                        let stream = sampler.stream([x, y], i);
                        let (a, b) = (stream.block(2), stream.block(3));
                        for d in 0..4 {
                            sums[d] += a[d] as f64;
                            sums[4 + d] += b[d] as f64;
                            products[d] += (a[d] as f64 - 0.5) * (b[(d + 1) % 4] as f64 - 0.5);
                        }
                        n += 1.0;
                    }
                }
            }
            for s in sums {
                assert!((s / n - 0.5).abs() < 5.0 * (1.0 / 12.0f64 / n).sqrt(), "{kind:?} mean {}", s / n);
            }
            for p in products {
                assert!((p / n).abs() < 5.0 * (1.0 / 144.0f64 / n).sqrt(), "{kind:?} product {}", p / n);
            }
        }
    }

    #[test]
    fn low_discrepancy_samplers_stratify_each_dimension_of_each_pixel() {
        for kind in ALL {
            if matches!(kind, SamplerKind::Independent | SamplerKind::Halton(_) | SamplerKind::Sobol(_)) {
                continue;
            }
            let sampler = Sampler::new(kind, 64, [64, 64], 11);
            for (pixel, block) in [([3, 9], 0), ([60, 2], 2), ([17, 33], 31)] {
                for d in 0..4 {
                    let strata = if matches!(kind, SamplerKind::Stratified { .. }) && d < 2 { 8 } else { 64 };
                    let mut seen = vec![0; strata];
                    for i in 0..64 {
                        seen[(sampler.stream(pixel, i).block(block)[d] * strata as f32) as usize] += 1;
                    }
                    assert!(seen.iter().all(|&n| n == 64 / strata), "{kind:?} dimension {d}: {seen:?}");
                }
            }
        }
    }

    /// Squared error of a smooth 4-D integral over many pixels, relative to independent samples.
    fn relative_error(kind: SamplerKind) -> f64 {
        let error = |kind| {
            let sampler = Sampler::new(kind, 64, [64, 64], 5);
            let mut total = 0.0;
            for y in 0..24 {
                for x in 0..24 {
                    let mean = (0..64)
                        .map(|i| {
                            let u = sampler.stream([x, y], i).block(3);
                            u.iter().map(|u| 1.5 * (*u as f64).sqrt()).product::<f64>()
                        })
                        .sum::<f64>()
                        / 64.0;
                    total += (mean - 1.0) * (mean - 1.0);
                }
            }
            total
        };
        error(kind) / error(SamplerKind::Independent)
    }

    #[test]
    fn low_discrepancy_lowers_the_error_of_smooth_integrals() {
        for (kind, bound) in [
            (SamplerKind::ZSobol, 0.05),
            (SamplerKind::PaddedSobol(Randomization::FastOwen), 0.05),
            // In bases 41 to 59 sixty-four points are hardly stratified.
            (SamplerKind::Halton(Randomization::Owen), 0.5),
            (SamplerKind::Pmj02bn, 0.4),
            (SamplerKind::Stratified { x: 8, y: 8, jitter: true }, 0.4),
        ] {
            let ratio = relative_error(kind);
            assert!(ratio < bound, "{kind:?}: {ratio}");
        }
    }

    #[test]
    fn a_morton_ordered_block_of_pixels_is_stratified_together() {
        // 4 x 4 pixels of 4 samples: 64 consecutive points, one in each 64th.
        let sampler = Sampler::new(SamplerKind::ZSobol, 4, [64, 64], 1);
        let mut seen = [0; 64];
        for y in 8..12 {
            for x in 20..24 {
                for i in 0..4 {
                    seen[(sampler.stream([x, y], i).block(5)[0] * 64.0) as usize] += 1;
                }
            }
        }
        assert_eq!(seen, [1; 64]);
    }
}
