//! Textures: numbers and spectra that vary over surfaces.
//!
//! What a material or light holds is a [`FloatValue`] or a [`SpectrumValue`]: a constant, or a node of the scene's one
//! texture graph. Constants are folded when the scene is compiled, so the common case is a number. [`Textures`] owns
//! the nodes, the decoded images and the constant spectra, and answers what a value is at a hit.
//!
//! In reading order: [`mapping`] (from hits to texture coordinates), [`procedural`] (patterns that formulas make),
//! [`image`] (pictures), [`graph`] (nodes), `compile` (from the description).
//!
//! Does not know of materials, lights or files' syntax. Semantics and expected values follow pbrt-v4 (Pharr, Jakob and
//! Humphreys 2023, "Physically Based Rendering", 4th edition, chapter 10).
//!
//! # Footprints
//! A [`TextureContext`] says how position and parameters change from pixel to pixel; images, checkerboards and noise are
//! averaged over that. Where [`Textures::needs_footprint`] is false nobody looks, and contexts may be points.

pub mod graph;
pub mod image;
pub mod mapping;
pub mod procedural;

mod compile;
#[cfg(test)]
mod tests;

pub use image::ImageTexture;
pub use mapping::Mapping;

use crate::interaction::TextureContext;
use graph::{FloatNode, SpectrumNode};
use image::ImageKey;
use irradiant_math::{Transform, Vec3};
use irradiant_scene::desc::{FloatParam, FloatTextureRef};
use irradiant_spectrum::{ColorSpace, Role, SampledSpectrum, Spectrum, Wavelengths};
use std::collections::BTreeMap;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
    )*};
}

ids! {
    /// Index of a texture of numbers.
    FloatNodeId;
    /// Index of a texture of spectra.
    SpectrumNodeId;
    /// Index of a constant spectrum.
    SpectrumId;
    /// Index of a decoded image.
    ImageId;
}

/// A number, the same everywhere or from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatValue {
    /// The number.
    Constant(f32),
    /// The texture.
    Node(FloatNodeId),
}

/// A spectrum, the same everywhere or from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpectrumValue {
    /// The spectrum.
    Constant(SpectrumId),
    /// The texture.
    Node(SpectrumNodeId),
}

impl SpectrumValue {
    /// Whether it comes from a texture.
    #[inline]
    pub fn is_textured(self) -> bool {
        matches!(self, Self::Node(_))
    }
}

impl FloatValue {
    /// Whether it comes from a texture.
    #[inline]
    pub fn is_textured(self) -> bool {
        matches!(self, Self::Node(_))
    }

    /// The number, if it is the same everywhere.
    #[inline]
    pub fn as_constant(self) -> Option<f32> {
        match self {
            Self::Constant(v) => Some(v),
            Self::Node(_) => None,
        }
    }
}

/// All textures of a scene.
#[derive(Clone, Debug)]
pub struct Textures {
    float_nodes: Vec<FloatNode>,
    spectrum_nodes: Vec<SpectrumNode>,
    images: Vec<ImageTexture>,
    spectra: Vec<Spectrum>,
    /// By reference of the description.
    floats: Vec<FloatValue>,
    /// By reference of the description and role; filled as they are asked for.
    spectrum_textures: BTreeMap<(u32, u8), SpectrumValue>,
    /// `None` for images that could not be read.
    image_ids: BTreeMap<ImageKey, Option<ImageId>>,
    visits: Visits,
    /// The render's own RGB.
    space: &'static ColorSpace,
    render_from_world: Transform,
    /// Whether footprints are ignored.
    unfiltered: bool,
    footprint_needed: bool,
    /// How many the author described.
    described: usize,
}

/// How many nodes a lookup of each node visits.
#[derive(Clone, Debug, Default)]
struct Visits {
    floats: Vec<u32>,
    spectra: Vec<u32>,
}

impl Textures {
    /// A number at a hit.
    #[inline]
    pub fn float(&self, v: FloatValue, at: &TextureContext) -> f32 {
        match v {
            FloatValue::Constant(value) => value,
            FloatValue::Node(_) if self.unfiltered => self.filtered_float(v, &without_footprint(at)),
            FloatValue::Node(_) => self.filtered_float(v, at),
        }
    }

    /// A spectrum at a hit. Images and constants of reflectances are in [0, 1]; combinations of them may not be.
    #[inline]
    pub fn spectrum(&self, v: SpectrumValue, at: &TextureContext, lambda: &Wavelengths) -> SampledSpectrum {
        match v {
            SpectrumValue::Constant(id) => self.spectra[id.0 as usize].sample(lambda),
            SpectrumValue::Node(_) if self.unfiltered => self.filtered_spectrum(v, &without_footprint(at), lambda),
            SpectrumValue::Node(_) => self.filtered_spectrum(v, at, lambda),
        }
    }

    /// The spectrum, if it is the same everywhere.
    #[inline]
    pub fn constant_spectrum(&self, v: SpectrumValue) -> Option<&Spectrum> {
        match v {
            SpectrumValue::Constant(id) => self.spectra.get(id.0 as usize),
            SpectrumValue::Node(_) => None,
        }
    }

    /// What a reference of the description became; 1 for one that does not exist.
    #[inline]
    pub fn float_value(&self, texture: FloatTextureRef) -> FloatValue {
        self.floats.get(texture.0 as usize).copied().unwrap_or(FloatValue::Constant(1.0))
    }

    /// What a parameter of the description became.
    #[inline]
    pub fn float_param(&self, param: FloatParam) -> FloatValue {
        match param {
            FloatParam::Value(v) => FloatValue::Constant(v),
            FloatParam::Texture(t) => self.float_value(t),
        }
    }

    /// The number that a reference of the description is everywhere, if it is.
    pub fn constant_float(&self, texture: FloatTextureRef) -> Option<f32> {
        self.float_value(texture).as_constant()
    }

    /// The mean of a texture over a surface that shows all of it evenly; noise counts as 0 (turbulence as 0.4).
    pub fn mean_float(&self, v: FloatValue) -> f32 {
        let FloatValue::Node(id) = v else { return v.as_constant().unwrap_or(0.0) };
        match &self.float_nodes[id.0 as usize] {
            FloatNode::Basic(node) => node.mean(self, |v| self.mean_float(v)),
            FloatNode::Image { image, grade, .. } => {
                let mip = &self.images[image.0 as usize].mip;
                let v = grade.scale * mip.texel(mip.levels() - 1, 0, 0, 0);
                if grade.invert { (1.0 - v).max(0.0) } else { v }
            }
            FloatNode::Wrinkled(_) => 0.4,
            FloatNode::Fbm(_) | FloatNode::Windy(_) => 0.0,
        }
    }

    /// The mean of a texture over a surface that shows all of it evenly.
    pub fn mean_spectrum(&self, v: SpectrumValue, lambda: &Wavelengths) -> SampledSpectrum {
        let SpectrumValue::Node(id) = v else {
            return self.constant_spectrum(v).map_or(SampledSpectrum::ZERO, |s| s.sample(lambda));
        };
        match &self.spectrum_nodes[id.0 as usize] {
            SpectrumNode::Basic(node) => node.mean(self, |v| self.mean_spectrum(v, lambda)),
            SpectrumNode::Image { image, grade, role, .. } => {
                let texture = &self.images[image.0 as usize];
                let mip = &texture.mip;
                let rgb = std::array::from_fn(|c| {
                    let v = grade.scale * mip.texel(mip.levels() - 1, 0, 0, c.min(mip.channels() - 1));
                    (if grade.invert { 1.0 - v } else { v }).max(0.0)
                });
                self.spectrum_of(rgb, *role, texture.space, lambda)
            }
            // The mean of the curve over its parameter, to two digits.
            SpectrumNode::Marble { role, .. } => {
                self.spectrum_of([0.79, 0.79, 0.81], *role, ColorSpace::srgb(), lambda)
            }
        }
    }

    /// Numbers of textures described, of images in memory, and bytes that these take.
    pub fn counts(&self) -> (usize, usize, usize) {
        (self.described, self.images.len(), self.images.iter().map(|i| i.mip.bytes_used()).sum())
    }

    /// Whether anything looks at footprints: ask when materials and lights are compiled, which may add textures.
    pub fn needs_footprint(&self) -> bool {
        self.footprint_needed && !self.unfiltered
    }

    /// Whether footprints are ignored (`Option "disabletexturefiltering"`).
    pub fn ignores_footprints(&self) -> bool {
        self.unfiltered
    }

    /// To be called by whoever looks at footprints of contexts beside the textures themselves (bump maps).
    pub(crate) fn require_footprint(&mut self) {
        self.footprint_needed = true;
    }
}

/// The same place, looked up at a point.
#[cold]
fn without_footprint(at: &TextureContext) -> TextureContext {
    TextureContext { dpdx: Vec3::ZERO, dpdy: Vec3::ZERO, dudx: 0.0, dudy: 0.0, dvdx: 0.0, dvdy: 0.0, ..*at }
}

/// A number for each role, to be a key.
fn role_key(role: Role) -> u8 {
    match role {
        Role::Reflectance => 0,
        Role::Unbounded => 1,
        Role::Illuminant => 2,
    }
}
