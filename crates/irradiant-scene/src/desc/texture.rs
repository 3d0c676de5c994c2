//! Textures.

use super::{ColorSpaceName, FileDesc, SpannedFloat, SpannedSpectrum};
use crate::span::{Span, Spanned};
use irradiant_math::Transform;

/// A named texture.
#[derive(Clone, Debug)]
pub struct TextureDesc<K> {
    /// Its name; generated for inline ones.
    pub name: String,
    /// What kind.
    pub kind: K,
    /// World from texture space, for 3D mappings.
    pub world_from_texture: Transform,
    /// Where it was said.
    pub span: Span,
}

/// (s, t) from a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MappingDesc {
    /// s = u_scale u + u_delta, t = v_scale v + v_delta.
    Uv {
        /// Scale in u.
        u_scale: f32,
        /// Scale in v.
        v_scale: f32,
        /// Shift in u.
        u_delta: f32,
        /// Shift in v.
        v_delta: f32,
    },
    /// Spherical angles about the texture-space origin.
    Spherical,
    /// Cylindrical about the texture-space z axis.
    Cylindrical,
    /// Projection on two texture-space vectors.
    Planar {
        /// First.
        v1: [f32; 3],
        /// Second.
        v2: [f32; 3],
        /// Shift of s.
        u_delta: f32,
        /// Shift of t.
        v_delta: f32,
    },
}

impl Default for MappingDesc {
    fn default() -> Self {
        Self::Uv { u_scale: 1.0, v_scale: 1.0, u_delta: 0.0, v_delta: 0.0 }
    }
}

/// How an image is looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImageFilter {
    /// Nearest texel of the finest level.
    Point,
    /// Bilinear in one level.
    #[default]
    Bilinear,
    /// Linear between levels too.
    Trilinear,
    /// Elliptically weighted average.
    Ewa,
}

/// What is outside the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImageWrap {
    /// The image again.
    #[default]
    Repeat,
    /// Zero.
    Black,
    /// The border texel.
    Clamp,
    /// Octahedral neighbour.
    OctahedralSphere,
}

/// How stored numbers stand for linear ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncodingDesc {
    /// Not stated: sRGB for PNG (8 and 16 bits) and other 8-bit formats, linear for floating-point ones.
    Default,
    /// As stored.
    Linear,
    /// sRGB curve.
    Srgb,
    /// A power curve.
    Gamma(f32),
}

/// A texture from an image file.
#[derive(Clone, Debug)]
pub struct ImageMapDesc {
    /// The file.
    pub file: Spanned<FileDesc>,
    /// Lookup.
    pub filter: ImageFilter,
    /// For EWA.
    pub max_anisotropy: f32,
    /// Border.
    pub wrap: ImageWrap,
    /// Curve.
    pub encoding: EncodingDesc,
    /// Factor.
    pub scale: f32,
    /// One minus the value.
    pub invert: bool,
    /// (s, t).
    pub mapping: MappingDesc,
    /// Colour space of RGB images without chromaticities of their own.
    pub color_space: ColorSpaceName,
}

/// The textures that exist for numbers and for spectra alike; `P` is the parameter type.
#[derive(Clone, Debug)]
pub enum BasicTexture<P> {
    /// A value.
    Constant(P),
    /// A product: `tex` times a number.
    Scale {
        /// What is scaled.
        tex: P,
        /// By how much.
        scale: SpannedFloat,
    },
    /// `(1 - amount) tex1 + amount tex2`.
    Mix {
        /// At amount 0.
        tex1: P,
        /// At amount 1.
        tex2: P,
        /// In [0, 1].
        amount: SpannedFloat,
    },
    /// `tex1` where the normal is along `dir`, `tex2` across it.
    DirectionMix {
        /// Along.
        tex1: P,
        /// Across.
        tex2: P,
        /// World-space direction.
        dir: [f32; 3],
    },
    /// Bilinear between the corners of the unit square.
    Bilerp {
        /// At (0, 0).
        v00: P,
        /// At (0, 1).
        v01: P,
        /// At (1, 0).
        v10: P,
        /// At (1, 1).
        v11: P,
        /// (s, t).
        mapping: MappingDesc,
    },
    /// Two textures in squares (or cubes).
    Checkerboard {
        /// Even squares.
        tex1: P,
        /// Odd squares.
        tex2: P,
        /// 2 or 3 dimensions.
        dimension: u32,
        /// (s, t) for dimension 2.
        mapping: MappingDesc,
    },
    /// Random polka dots.
    Dots {
        /// In dots.
        inside: P,
        /// Elsewhere.
        outside: P,
        /// (s, t).
        mapping: MappingDesc,
    },
    /// From an image file.
    ImageMap(ImageMapDesc),
    /// From a ptex file (not rendered yet: a constant of `mean`).
    Ptex {
        /// The file.
        file: Spanned<FileDesc>,
        /// Factor.
        scale: f32,
    },
}

/// Textures of numbers.
#[derive(Clone, Debug)]
pub enum FloatTextureKind {
    /// As for spectra.
    Basic(BasicTexture<SpannedFloat>),
    /// Fractional Brownian motion.
    Fbm {
        /// Number of octaves.
        octaves: i32,
        /// Falloff per octave.
        omega: f32,
    },
    /// Its absolute-value variant.
    Wrinkled {
        /// Number of octaves.
        octaves: i32,
        /// Falloff per octave.
        omega: f32,
    },
    /// Wind over water.
    Windy,
}

/// Textures of spectra. Values are reflectances unless they stand in a light (pbrt's "unbounded" for eta, k).
#[derive(Clone, Debug)]
pub enum SpectrumTextureKind {
    /// As for numbers.
    Basic(BasicTexture<SpannedSpectrum>),
    /// Veined stone.
    Marble {
        /// Number of octaves.
        octaves: i32,
        /// Falloff per octave.
        omega: f32,
        /// Frequency.
        scale: f32,
        /// Strength of the perturbation.
        variation: f32,
    },
}
