//! Ideal diffuse surfaces: equal radiance in all directions, reflected or transmitted.
//!
//! Lambert 1760. `f = reflectance / pi`; the pdf is exact.

use super::{BsdfSample, Lobe, Sides, TransportMode};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::FRAC_1_PI;

/// Ideal diffuse reflection. Two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflected fraction, in [0, 1].
    pub reflectance: SampledSpectrum,
}

impl Diffuse {
    /// A surface that reflects this fraction of the light.
    #[inline]
    pub fn new(reflectance: SampledSpectrum) -> Self {
        Self { reflectance }
    }

    #[inline]
    pub(super) fn flags(&self) -> Lobe {
        if self.reflectance.is_black() { Lobe::NONE } else { Lobe::DIFFUSE_REFLECTION }
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        if wo.z * wi.z > 0.0 {
            (self.reflectance * FRAC_1_PI, wi.z.abs() * FRAC_1_PI)
        } else {
            (SampledSpectrum::ZERO, 0.0)
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Point2, sides: Sides) -> Option<BsdfSample> {
        if !sides.reflection() {
            return None;
        }
        let mut wi = cosine_hemisphere(u);
        let pdf = wi.z * FRAC_1_PI;
        wi.z = wi.z.copysign(wo.z);
        Some(BsdfSample::new(self.reflectance * FRAC_1_PI, wi, pdf, Lobe::DIFFUSE_REFLECTION))
    }
}

/// Ideal diffuse reflection and transmission, as of a leaf or a paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Fraction reflected, in [0, 1].
    pub reflectance: SampledSpectrum,
    /// Fraction transmitted, in [0, 1]; with the reflectance at most 1.
    pub transmittance: SampledSpectrum,
}

impl DiffuseTransmission {
    /// A surface that reflects and transmits these fractions.
    #[inline]
    pub fn new(reflectance: SampledSpectrum, transmittance: SampledSpectrum) -> Self {
        Self { reflectance, transmittance }
    }

    #[inline]
    pub(super) fn flags(&self) -> Lobe {
        let r = if self.reflectance.is_black() { Lobe::NONE } else { Lobe::DIFFUSE_REFLECTION };
        let t = if self.transmittance.is_black() { Lobe::NONE } else { Lobe::DIFFUSE_TRANSMISSION };
        r | t
    }

    /// The chance of reflection, or `None` if nothing can be drawn.
    #[inline]
    fn reflection_probability(&self, sides: Sides) -> Option<f32> {
        let r = if sides.reflection() { self.reflectance.max_component() } else { 0.0 };
        let t = if sides.transmission() { self.transmittance.max_component() } else { 0.0 };
        (r + t > 0.0).then(|| r / (r + t))
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3, sides: Sides) -> (SampledSpectrum, f32) {
        let reflection = self.reflection_probability(sides).unwrap_or(0.0);
        let transmission = if sides.transmission() && !self.transmittance.is_black() { 1.0 - reflection } else { 0.0 };
        let (f, probability) =
            if wo.z * wi.z > 0.0 { (self.reflectance, reflection) } else { (self.transmittance, transmission) };
        (f * FRAC_1_PI, probability * wi.z.abs() * FRAC_1_PI)
    }

    #[inline]
    pub(super) fn sample(
        &self,
        wo: Vec3,
        uc: f32,
        u: Point2,
        _mode: TransportMode,
        sides: Sides,
    ) -> Option<BsdfSample> {
        let reflection = self.reflection_probability(sides)?;
        let mut wi = cosine_hemisphere(u);
        let cosine_pdf = wi.z * FRAC_1_PI;
        if uc < reflection {
            wi.z = wi.z.copysign(wo.z);
            let pdf = cosine_pdf * reflection;
            Some(BsdfSample::new(self.reflectance * FRAC_1_PI, wi, pdf, Lobe::DIFFUSE_REFLECTION))
        } else {
            wi.z = wi.z.copysign(-wo.z);
            let pdf = cosine_pdf * (1.0 - reflection);
            Some(BsdfSample::new(self.transmittance * FRAC_1_PI, wi, pdf, Lobe::DIFFUSE_TRANSMISSION))
        }
    }
}
