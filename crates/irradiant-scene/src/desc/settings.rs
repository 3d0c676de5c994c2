//! Sampler, integrator, options.

use crate::span::{Span, Spanned};

/// The sampler.
#[derive(Clone, Debug)]
pub struct SamplerDesc {
    /// Which.
    pub kind: SamplerKind,
    /// Samples per pixel.
    pub samples_per_pixel: Spanned<u32>,
    /// Seed; default from the options.
    pub seed: Option<u64>,
    /// Where it was said.
    pub span: Span,
}

impl Default for SamplerDesc {
    fn default() -> Self {
        Self { kind: SamplerKind::ZSobol, samples_per_pixel: Spanned::unplaced(16), seed: None, span: Span::NONE }
    }
}

/// How a low-discrepancy sampler is randomised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Randomization {
    /// Not at all.
    None,
    /// Digit permutations (Halton, Sobol).
    PermuteDigits,
    /// Owen scrambling by a fast hash.
    #[default]
    FastOwen,
    /// Owen scrambling.
    Owen,
}

/// pbrt-v4's samplers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Independent uniform numbers.
    Independent,
    /// Jittered strata of x by y.
    Stratified {
        /// Strata in x.
        x: u32,
        /// Strata in y.
        y: u32,
        /// Jittered (else centred).
        jitter: bool,
    },
    /// Halton points.
    Halton(Randomization),
    /// Sobol points over the image plane.
    Sobol(Randomization),
    /// 2D Sobol points, shuffled and padded.
    PaddedSobol(Randomization),
    /// Padded Sobol points along a Morton curve over the image: blue-noise error.
    ZSobol,
    /// Progressive multi-jittered (0,2) points.
    Pmj02bn,
}

/// The integrator.
#[derive(Clone, Debug)]
pub struct IntegratorDesc {
    /// Which.
    pub kind: IntegratorKind,
    /// Scattering events at most (0: emission only). pbrt's default is 5, and that is a truncation.
    pub max_depth: Spanned<u32>,
    /// True when the scene itself stated `maxdepth`.
    pub max_depth_stated: bool,
    /// Blur sharp lobes after the first non-specular bounce (biased).
    pub regularize: bool,
    /// How lights are chosen.
    pub light_sampler: LightSamplerKind,
    /// Where it was said.
    pub span: Span,
}

impl Default for IntegratorDesc {
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: Spanned::unplaced(5),
            max_depth_stated: false,
            regularize: false,
            light_sampler: LightSamplerKind::Bvh,
            span: Span::NONE,
        }
    }
}

/// The integrators that can be asked for; readers map others to these with a warning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegratorKind {
    /// Path tracing with MIS.
    Path,
    /// Path tracing without MIS.
    SimplePath {
        /// Sample lights directly.
        sample_lights: bool,
        /// Sample the BSDF (else uniformly).
        sample_bsdf: bool,
    },
    /// Paths from camera and lights, joined in all ways.
    Bidirectional,
    /// Paths from lights, seen by the camera.
    LightTrace,
    /// Progressive photon mapping.
    Photon {
        /// Paths from lights in each pass; 0: one for each pixel.
        paths_per_pass: u32,
        /// Radius of the first pass, scene units, finite and not negative; 0: by the size of pixels.
        radius: f32,
    },
    /// Uniform directions, emission only.
    RandomWalk,
    /// Fraction of the hemisphere that is open.
    AmbientOcclusion {
        /// Cosine-weighted directions.
        cos_sample: bool,
        /// Occluders farther than this do not count, scene units.
        max_distance: f32,
    },
}

/// How lights are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightSamplerKind {
    /// All alike.
    Uniform,
    /// By power.
    Power,
    /// By a tree of bounds.
    #[default]
    Bvh,
    /// All lights, one at a time (pbrt: "exhaustive").
    Exhaustive,
}

/// Where the origin of render space lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RenderSpace {
    /// World axes, origin at the camera.
    #[default]
    CameraWorld,
    /// The camera's own space.
    Camera,
    /// World space.
    World,
}

/// `Option` statements that change pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OptionsDesc {
    /// Samples at pixel centres only.
    pub disable_pixel_jitter: bool,
    /// Textures without filtering (point lookup in the finest level).
    pub disable_texture_filtering: bool,
    /// The same wavelengths in each sample.
    pub disable_wavelength_jitter: bool,
    /// All materials diffuse.
    pub force_diffuse: bool,
    /// Seed.
    pub seed: u64,
    /// Origin of render space.
    pub render_space: RenderSpace,
    /// Edge length for displacement, scene units (no displacement is rendered yet).
    pub displacement_edge_scale: Option<f32>,
}
