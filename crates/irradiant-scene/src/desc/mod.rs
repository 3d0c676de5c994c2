//! One struct per thing one can say about a scene, with pbrt-v4's meanings, units and defaults.
//!
//! Readers fill these; a value that the author can get wrong is [`Spanned`]. Ids index the vectors of [`SceneDesc`];
//! the reader has already resolved names (unknown names are its errors). Range checks are the compiler's.

pub mod camera;
pub mod film;
pub mod light;
pub mod material;
pub mod settings;
pub mod shape;
pub mod texture;

pub use camera::{CameraDesc, CameraKind};
pub use film::{FilmDesc, FilmKind, FilterDesc, FilterKind};
pub use light::{AreaLightDesc, LightDesc, LightKind, PortalDesc};
pub use material::{MaterialDesc, MaterialKind, RoughnessDesc};
pub use settings::{
    IntegratorDesc, IntegratorKind, LightSamplerKind, OptionsDesc, Randomization, RenderSpace, SamplerDesc, SamplerKind,
};
pub use shape::{CurveData, CurveStyle, MeshData, ShapeDesc, ShapeKind};
pub use texture::{FloatTextureKind, ImageMapDesc, MappingDesc, SpectrumTextureKind, TextureDesc};

use crate::span::{Span, Spanned};
use irradiant_math::Transform;
use std::path::PathBuf;
use std::sync::Arc;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
    )*};
}

ids! {
    /// Index into [`SceneDesc::float_textures`].
    FloatTextureRef;
    /// Index into [`SceneDesc::spectrum_textures`].
    SpectrumTextureRef;
    /// Index into [`SceneDesc::materials`].
    MaterialRef;
    /// Index into [`SceneDesc::objects`].
    ObjectRef;
}

/// A scene as its author described it.
#[derive(Clone, Debug, Default)]
pub struct SceneDesc {
    /// `Option` statements.
    pub options: OptionsDesc,
    /// The camera.
    pub camera: CameraDesc,
    /// The film.
    pub film: FilmDesc,
    /// The pixel filter.
    pub filter: FilterDesc,
    /// The sampler.
    pub sampler: SamplerDesc,
    /// The integrator.
    pub integrator: IntegratorDesc,
    /// Textures of single numbers.
    pub float_textures: Vec<TextureDesc<FloatTextureKind>>,
    /// Textures of spectra.
    pub spectrum_textures: Vec<TextureDesc<SpectrumTextureKind>>,
    /// Materials, named and not.
    pub materials: Vec<MaterialDesc>,
    /// Lights that are not shapes.
    pub lights: Vec<LightDesc>,
    /// Shapes that stand in the scene itself.
    pub shapes: Vec<ShapeDesc>,
    /// Objects for instancing.
    pub objects: Vec<ObjectDesc>,
    /// Instances of them.
    pub instances: Vec<InstanceDesc>,
}

/// A named group of shapes that instances place in the scene.
#[derive(Clone, Debug)]
pub struct ObjectDesc {
    /// Its name.
    pub name: String,
    /// Its shapes; their transforms are the whole current transform where each was said (that of `ObjectBegin`
    /// included), and that is the object's own space: an instance's transform comes on top, as in pbrt-v4.
    pub shapes: Vec<ShapeDesc>,
    /// Where it was begun.
    pub span: Span,
}

/// A copy of an object.
#[derive(Clone, Debug)]
pub struct InstanceDesc {
    /// Which.
    pub object: ObjectRef,
    /// World from the object's own space.
    pub world_from_object: MotionDesc,
    /// Where it was said.
    pub span: Span,
}

/// A transform that may change over the shutter: `start` up to `start_time`, `end` from `end_time` on, and in between
/// the interpolation of their translations, rotations and scales (pbrt's `AnimatedTransform`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionDesc {
    /// At and before `start_time`.
    pub start: Transform,
    /// At and after `end_time`.
    pub end: Transform,
    /// In the camera's shutter units.
    pub start_time: f64,
    /// In the camera's shutter units.
    pub end_time: f64,
}

impl Default for MotionDesc {
    fn default() -> Self {
        Self::still(Transform::IDENTITY)
    }
}

impl MotionDesc {
    /// The same at all times.
    pub const fn still(t: Transform) -> Self {
        Self { start: t, end: t, start_time: 0.0, end_time: 1.0 }
    }

    /// True when start and end differ.
    pub fn is_animated(&self) -> bool {
        self.start.m != self.end.m
    }
}

/// The colour spaces of pbrt-v4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpaceName {
    /// BT.709 primaries, D65.
    #[default]
    Srgb,
    /// DCI-P3 primaries, D65 as in pbrt.
    DciP3,
    /// BT.2020 primaries, D65.
    Rec2020,
    /// ACES AP0 primaries, ACES white (about D60).
    Aces2065_1,
}

impl ColorSpaceName {
    /// The name that scene files use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DciP3 => "dci-p3",
            Self::Rec2020 => "rec2020",
            Self::Aces2065_1 => "aces2065-1",
        }
    }

    /// All of them.
    pub const ALL: [Self; 4] = [Self::Srgb, Self::DciP3, Self::Rec2020, Self::Aces2065_1];
}

/// A spectrum as said in a scene. Its role (reflectance, illuminant, unbounded) follows from where it stands.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumDesc {
    /// The same at all wavelengths.
    Constant(f32),
    /// Three numbers in a colour space.
    Rgb([f32; 3], ColorSpaceName),
    /// Black body at a temperature in kelvin, scaled to a maximum of 1.
    Blackbody(f32),
    /// One of the built-in measured spectra ("metal-Au-eta", "glass-BK7", "stdillum-D65", ...).
    Named(String),
    /// Samples (wavelength in nm, value), ascending wavelengths, from the scene or a file.
    Samples(Arc<[(f32, f32)]>),
}

/// A number or a texture of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatParam {
    /// A number.
    Value(f32),
    /// A texture.
    Texture(FloatTextureRef),
}

/// A spectrum or a texture of spectra.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumParam {
    /// A spectrum.
    Value(SpectrumDesc),
    /// A texture.
    Texture(SpectrumTextureRef),
}

impl Default for SpectrumDesc {
    fn default() -> Self {
        Self::Constant(1.0)
    }
}

/// A file that a scene mentions: the name as written and the path that it means.
#[derive(Clone, Debug, PartialEq)]
pub struct FileDesc {
    /// As written.
    pub name: String,
    /// As resolved by the assets.
    pub path: PathBuf,
}

/// A [`FloatParam`] with its place.
pub type SpannedFloat = Spanned<FloatParam>;
/// A [`SpectrumParam`] with its place.
pub type SpannedSpectrum = Spanned<SpectrumParam>;
