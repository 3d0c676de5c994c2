//! From a description to a scene: each floor compiles its own part; here they are put together in the one order that
//! works.

use super::{Facts, LayerPlan, Scene, SceneAlpha};
use crate::camera::{self, FootprintEstimator};
use crate::film::PixelBounds;
use crate::film::filter::Filter;
use crate::geometry::Geometry;
use crate::light::Lights;
use crate::light_sampler::LightSampler;
use crate::material::Materials;
use crate::sampler::Sampler;
use crate::texture::Textures;
use irradiant_scene::desc::{ColorSpaceName, FilmDesc, SceneDesc};
use irradiant_scene::{Assets, Diagnostic, Diagnostics};
use irradiant_spectrum::{Basis, ColorSpace, Role, Sensor, Spectrum};

/// What a caller may set over the description.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Spectral, or three numbers.
    pub basis: Basis,
    /// Image size, pixels.
    pub resolution: Option<[u32; 2]>,
    /// The part to render: x0, x1, y0, y1 in fractions.
    pub crop: Option<[f32; 4]>,
    /// Samples per pixel.
    pub samples_per_pixel: Option<u32>,
    /// Seed.
    pub seed: Option<u64>,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self { basis: Basis::Spectral, resolution: None, crop: None, samples_per_pixel: None, seed: None }
    }
}

/// A scene, unless there were errors, and what there is to say.
pub struct Compiled {
    /// None when there are errors.
    pub scene: Option<Scene>,
    /// All of them.
    pub diagnostics: Diagnostics,
}

/// The colour space of a name.
pub fn color_space(name: ColorSpaceName) -> &'static ColorSpace {
    match name {
        ColorSpaceName::Srgb => ColorSpace::srgb(),
        ColorSpaceName::DciP3 => ColorSpace::dci_p3(),
        ColorSpaceName::Rec2020 => ColorSpace::rec2020(),
        ColorSpaceName::Aces2065_1 => ColorSpace::aces2065_1(),
    }
}

impl Scene {
    /// Compiles a description; never fails early: all errors come at once.
    pub fn compile(desc: &SceneDesc, assets: &dyn Assets, options: &CompileOptions) -> Compiled {
        let mut diagnostics = Diagnostics::default();
        let scene = compile(desc, assets, options, &mut diagnostics);
        Compiled { scene: scene.filter(|_| !diagnostics.has_errors()), diagnostics }
    }
}
