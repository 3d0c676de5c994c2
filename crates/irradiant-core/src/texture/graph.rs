//! The nodes of the texture graph and what they compute. Nodes name their inputs by value or by index; there are no
//! cycles and the depth is bounded, both by the compiler.

use super::image::Grade;
use super::mapping::{self, Mapping};
use super::procedural;
use super::{FloatNodeId, FloatValue, ImageId, SpectrumNodeId, SpectrumValue, Textures};
use crate::interaction::TextureContext;
use irradiant_math::noise::{fbm, turbulence};
use irradiant_math::{Affine, Vec3};
use irradiant_spectrum::{
    Basis, ColorSpace, RgbAlbedo, RgbIlluminant, RgbUnbounded, Role, SampledSpectrum, Wavelengths,
};

/// Ways of combining textures, the same for numbers and spectra.
#[derive(Clone, Debug)]
pub enum BasicNode<V> {
    /// A product.
    Scale {
        /// What.
        tex: V,
        /// By how much.
        scale: FloatValue,
    },
    /// `(1 - amount) tex1 + amount tex2`.
    Mix {
        /// First.
        tex1: V,
        /// Second.
        tex2: V,
        /// Share of the second.
        amount: FloatValue,
    },
    /// `tex1` where the normal is along a direction, `tex2` across it, by the cosine between.
    DirectionMix {
        /// Along.
        tex1: V,
        /// Across.
        tex2: V,
        /// Unit, render space.
        direction: Vec3,
    },
    /// Bilinear between corners, extended beyond the unit square.
    Bilerp {
        /// At (0, 0), (1, 0), (0, 1), (1, 1).
        corners: [V; 4],
        /// (s, t).
        mapping: Mapping,
    },
    /// Squares.
    Checkerboard {
        /// Even.
        tex1: V,
        /// Odd.
        tex2: V,
        /// (s, t).
        mapping: Mapping,
    },
    /// Cubes.
    SolidCheckerboard {
        /// Even.
        tex1: V,
        /// Odd.
        tex2: V,
        /// Where the cubes are.
        texture_from_render: Box<Affine>,
    },
    /// Polka dots.
    Dots {
        /// In dots.
        inside: V,
        /// Elsewhere.
        outside: V,
        /// (s, t).
        mapping: Mapping,
    },
}

/// A texture of numbers.
#[derive(Clone, Debug)]
pub enum FloatNode {
    /// A combination.
    Basic(BasicNode<FloatValue>),
    /// An image.
    Image {
        /// Which.
        image: ImageId,
        /// (s, t).
        mapping: Mapping,
        /// Scale and inversion.
        grade: Grade,
    },
    /// Fractional Brownian motion.
    Fbm(Octaves),
    /// Turbulence.
    Wrinkled(Octaves),
    /// Wind over water.
    Windy(Box<Affine>),
}

/// Noise summed over octaves.
#[derive(Clone, Debug)]
pub struct Octaves {
    /// Where it is.
    pub texture_from_render: Box<Affine>,
    /// How many.
    pub count: u32,
    /// Strength of each relative to the one before.
    pub omega: f32,
}

/// A texture of spectra.
#[derive(Clone, Debug)]
pub enum SpectrumNode {
    /// A combination.
    Basic(BasicNode<SpectrumValue>),
    /// An image.
    Image {
        /// Which.
        image: ImageId,
        /// (s, t).
        mapping: Mapping,
        /// Scale and inversion.
        grade: Grade,
        /// What its colours are of.
        role: Role,
    },
    /// Marble.
    Marble {
        /// The noise.
        octaves: Octaves,
        /// Frequency.
        scale: f32,
        /// Strength of the noise.
        variation: f32,
        /// What its colours are of.
        role: Role,
    },
}

/// What nodes combine.
pub(super) trait Blend: Copy {
    const ZERO: Self;
    fn times(self, factor: f32) -> Self;
    fn plus(self, other: Self) -> Self;

    /// `(1 - t) a + t b`, computing neither if it has no weight.
    #[inline]
    fn lerp(t: f32, a: impl FnOnce() -> Self, b: impl FnOnce() -> Self) -> Self {
        let first = if t == 1.0 { Self::ZERO } else { a() };
        let second = if t == 0.0 { Self::ZERO } else { b() };
        first.times(1.0 - t).plus(second.times(t))
    }
}

impl Blend for f32 {
    const ZERO: Self = 0.0;
    #[inline]
    fn times(self, factor: f32) -> Self {
        self * factor
    }
    #[inline]
    fn plus(self, other: Self) -> Self {
        self + other
    }
}

impl Blend for SampledSpectrum {
    const ZERO: Self = SampledSpectrum::ZERO;
    #[inline]
    fn times(self, factor: f32) -> Self {
        self * factor
    }
    #[inline]
    fn plus(self, other: Self) -> Self {
        self + other
    }
}

impl<V: Copy> BasicNode<V> {
    /// The value, given those of its inputs.
    fn value<T: Blend>(&self, textures: &Textures, at: &TextureContext, input: impl Fn(V) -> T) -> T {
        match self {
            Self::Scale { tex, scale } => match textures.filtered_float(*scale, at) {
                0.0 => T::ZERO,
                scale => input(*tex).times(scale),
            },
            Self::Mix { tex1, tex2, amount } => {
                T::lerp(textures.filtered_float(*amount, at), || input(*tex1), || input(*tex2))
            }
            Self::DirectionMix { tex1, tex2, direction } => {
                T::lerp(at.n.dot(*direction).abs(), || input(*tex2), || input(*tex1))
            }
            Self::Bilerp { corners: [v00, v10, v01, v11], mapping } => {
                let c = mapping.map(at);
                let low = input(*v00).times(1.0 - c.s).plus(input(*v10).times(c.s));
                let high = input(*v01).times(1.0 - c.s).plus(input(*v11).times(c.s));
                low.times(1.0 - c.t).plus(high.times(c.t))
            }
            Self::Checkerboard { tex1, tex2, mapping } => {
                T::lerp(procedural::checkerboard(&mapping.map(at)), || input(*tex1), || input(*tex2))
            }
            Self::SolidCheckerboard { tex1, tex2, texture_from_render } => {
                let c = mapping::solid(texture_from_render, at);
                T::lerp(procedural::solid_checkerboard(&c), || input(*tex1), || input(*tex2))
            }
            Self::Dots { inside, outside, mapping } => {
                let c = mapping.map(at);
                input(if procedural::in_polka_dot(c.s, c.t) { *inside } else { *outside })
            }
        }
    }

    /// How many nodes a lookup visits, given those of its inputs.
    pub(super) fn visits(&self, input: impl Fn(V) -> u32, float: impl Fn(FloatValue) -> u32) -> u32 {
        let inputs: &[V] = match self {
            Self::Scale { tex, .. } => &[*tex],
            Self::Bilerp { corners, .. } => corners,
            Self::Mix { tex1: a, tex2: b, .. }
            | Self::DirectionMix { tex1: a, tex2: b, .. }
            | Self::Checkerboard { tex1: a, tex2: b, .. }
            | Self::SolidCheckerboard { tex1: a, tex2: b, .. }
            | Self::Dots { inside: a, outside: b, .. } => &[*a, *b],
        };
        let factor = match self {
            Self::Scale { scale: v, .. } | Self::Mix { amount: v, .. } => float(*v),
            _ => 0,
        };
        inputs.iter().fold(factor.saturating_add(1), |sum, &v| sum.saturating_add(input(v)))
    }

    /// The mean over the surface, given those of its inputs: exact for boards, dots and bilinear patches over whole
    /// periods, and where factors are independent.
    pub(super) fn mean<T: Blend>(&self, textures: &Textures, input: impl Fn(V) -> T) -> T {
        let half = |a: V, b: V| input(a).times(0.5).plus(input(b).times(0.5));
        match self {
            Self::Scale { tex, scale } => input(*tex).times(textures.mean_float(*scale)),
            Self::Mix { tex1, tex2, amount } => T::lerp(textures.mean_float(*amount), || input(*tex1), || input(*tex2)),
            Self::DirectionMix { tex1, tex2, .. }
            | Self::Checkerboard { tex1, tex2, .. }
            | Self::SolidCheckerboard { tex1, tex2, .. } => half(*tex1, *tex2),
            Self::Bilerp { corners, .. } => corners.iter().fold(T::ZERO, |sum, &v| sum.plus(input(v).times(0.25))),
            Self::Dots { inside, outside, .. } => T::lerp(procedural::DOT_SHARE, || input(*outside), || input(*inside)),
        }
    }
}

impl Textures {
    /// A number, at a footprint that is final.
    #[inline]
    pub(super) fn filtered_float(&self, v: FloatValue, at: &TextureContext) -> f32 {
        match v {
            FloatValue::Constant(value) => value,
            FloatValue::Node(id) => self.float_node(id, at),
        }
    }

    fn float_node(&self, id: FloatNodeId, at: &TextureContext) -> f32 {
        match &self.float_nodes[id.0 as usize] {
            FloatNode::Basic(node) => node.value(self, at, |v| self.filtered_float(v, at)),
            FloatNode::Image { image, mapping, grade } => self.images[image.0 as usize].float(&mapping.map(at), *grade),
            FloatNode::Fbm(o) => {
                let c = mapping::solid(&o.texture_from_render, at);
                fbm(c.p, c.dpdx, c.dpdy, o.omega, o.count)
            }
            FloatNode::Wrinkled(o) => {
                let c = mapping::solid(&o.texture_from_render, at);
                turbulence(c.p, c.dpdx, c.dpdy, o.omega, o.count)
            }
            FloatNode::Windy(space) => procedural::windy(&mapping::solid(space, at)),
        }
    }

    /// A spectrum, at a footprint that is final.
    #[inline]
    pub(super) fn filtered_spectrum(
        &self,
        v: SpectrumValue,
        at: &TextureContext,
        lambda: &Wavelengths,
    ) -> SampledSpectrum {
        match v {
            SpectrumValue::Constant(id) => self.spectra[id.0 as usize].sample(lambda),
            SpectrumValue::Node(id) => self.spectrum_node(id, at, lambda),
        }
    }

    fn spectrum_node(&self, id: SpectrumNodeId, at: &TextureContext, lambda: &Wavelengths) -> SampledSpectrum {
        match &self.spectrum_nodes[id.0 as usize] {
            SpectrumNode::Basic(node) => node.value(self, at, |v| self.filtered_spectrum(v, at, lambda)),
            SpectrumNode::Image { image, mapping, grade, role } => {
                let image = &self.images[image.0 as usize];
                self.spectrum_of(image.rgb(&mapping.map(at), *grade), *role, image.space, lambda)
            }
            SpectrumNode::Marble { octaves: o, scale, variation, role } => {
                let c = mapping::solid(&o.texture_from_render, at);
                let rgb = procedural::marble(&c, o.count, o.omega, *scale, *variation);
                self.spectrum_of(rgb, *role, ColorSpace::srgb(), lambda)
            }
        }
    }

    /// What a colour stands for. Reflectances are clamped to [0, 1].
    #[inline]
    pub(super) fn spectrum_of(
        &self,
        rgb: [f32; 3],
        role: Role,
        space: &'static ColorSpace,
        lambda: &Wavelengths,
    ) -> SampledSpectrum {
        if lambda.basis == Basis::Rgb {
            let mut rgb = if role == Role::Reflectance { rgb.map(|v| v.min(1.0)) } else { rgb };
            if space != self.space {
                rgb = self.space.from_xyz(space.to_xyz(rgb)).map(|v| v.max(0.0));
            }
            return SampledSpectrum([rgb[0], rgb[1], rgb[2], rgb[1]]);
        }
        match role {
            Role::Reflectance => RgbAlbedo::new(rgb, space).sample(lambda),
            Role::Unbounded => RgbUnbounded::new(rgb, space).sample(lambda),
            Role::Illuminant => RgbIlluminant::new(rgb, space).sample(lambda),
        }
    }
}
