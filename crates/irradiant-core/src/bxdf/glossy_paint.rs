//! Semi-gloss paint and plastic that lose nothing: white highlights over a coloured body. A model of our own.
//!
//! | parameter | range | default |
//! |---|---|---|
//! | reflectance | [0, 1]: of the pigmented body, inside | 0.5 |
//! | eta | > 1: index of the binder | 1.5 |
//! | roughness alpha | [0, 1]: of its surface | 0.1 |
//!
//! A diffuse body under a clear coat with all internal reflections summed: light that the surface does not reflect
//! enters, is coloured at each return, and leaves the same way. In a white furnace a body of reflectance 1 vanishes
//! exactly, up to the table's rounding (tested: below 0.3 %). Reciprocal. See [`Coat::lossless`].

use super::coat::Coat;
use super::coated::{CoatedDiffuse, Filling, WalkLimits};
use super::{BsdfSample, Lobe, Sides, TransportMode};
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// A glossy paint. Two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlossyPaint {
    body: CoatedDiffuse,
}

impl GlossyPaint {
    /// A paint with this body reflectance under a coat from [`Coat::lossless`].
    #[inline]
    pub fn new(coat: &Coat, reflectance: SampledSpectrum) -> Self {
        Self { body: CoatedDiffuse::new(coat, reflectance, Filling::NONE, WalkLimits::UNLIMITED) }
    }

    pub(super) fn body(&self) -> &CoatedDiffuse {
        &self.body
    }

    pub(super) fn flags(&self) -> Lobe {
        self.body.flags()
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.body.pdf(wo, wi)
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        self.body.f_and_pdf(wo, wi, TransportMode::Radiance)
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, sides: Sides) -> Option<BsdfSample> {
        self.body.sample(wo, uc, u, TransportMode::Radiance, sides)
    }
}
