//! What a user may set over what the scene says.

use crate::aov::Aov;
use irradiant_render::registry::IntegratorChoice;
use irradiant_scene::desc::SamplerKind;
use std::time::Duration;

/// The basis of colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMode {
    /// Four wavelengths a path.
    #[default]
    Spectral,
    /// Three numbers in the film's colour space: the same code in another basis. Dispersion and measured spectra are
    /// reduced to three numbers.
    Rgb,
}

/// A depth limit to use instead of the scene's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaxDepth {
    /// No limit: unbiased.
    None,
    /// At most this many scattering events.
    Limit(u32),
}

/// Settings of a render; `None` and the default mean what the scene says.
#[derive(Clone, Debug, Default)]
pub struct RenderSettings {
    /// Samples per pixel.
    pub samples_per_pixel: Option<u32>,
    /// Stop after this time.
    pub time_limit: Option<Duration>,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// Where they come from.
    pub sampler: Option<SamplerKind>,
    /// Worker threads; 0: one per core.
    pub threads: usize,
    /// Width and height, pixels.
    pub resolution: Option<[u32; 2]>,
    /// The part to render: x0, x1, y0, y1 as fractions of the image.
    pub crop: Option<[f32; 4]>,
    /// Integrator, with its options; none of the scene's options remain.
    pub integrator: Option<IntegratorChoice>,
    /// Options of the integrator (the scene's, if no other is given), each as `key=value`; what
    /// [`IntegratorChoice::with_words`] takes.
    pub estimator: Vec<String>,
    /// Layers by kinds of paths, for the integrator `path`.
    pub aovs: Vec<Aov>,
    /// Depth limit.
    pub max_depth: Option<MaxDepth>,
    /// Basis of colour.
    pub color: ColorMode,
    /// Films that would take more memory than this, bytes, are refused before anything is reserved; 4 GiB by default.
    pub max_film_bytes: Option<u64>,
    /// Scene content that is not honoured is an error.
    pub strict: bool,
}
