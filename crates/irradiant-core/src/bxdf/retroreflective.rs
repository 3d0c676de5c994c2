//! Road signs and safety vests: light returns towards where it came from. A model of our own.
//!
//! | parameter | range | default |
//! |---|---|---|
//! | retroreflectance | [0, 1]: fraction sent back, less what the facets shadow | 0.8 |
//! | reflectance | [0, 1]: of the diffuse ground, lit by what is not sent back | 0.2 |
//! | alpha | (0, 1]: width of the returned lobe | 0.1 |
//!
//! The lobe is a GGX mirror lobe of the *back vector* (Belcour, Pacanowski, Delahaie, Laville-Geay and Eupherte 2014,
//! "Bidirectional reflectance distribution function measurements and analysis of retroreflective materials"):
//! `f(wo, wi) = g(M wo, wi)`, with M half a turn about the normal and g the mirror lobe. Since g(a, b) = g(b, a) =
//! g(M a, M b) and M M = 1, f is reciprocal; it has g's energy and g's sampler. The ground reflects
//! `(1 - retroreflectance) reflectance`, so no more than 1 leaves in all.

use super::microfacet::Ggx;
use super::{BsdfSample, Lobe, Sides};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::FRAC_1_PI;

/// A retroreflective surface. Two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retroreflective {
    returned: SampledSpectrum,
    ground: SampledSpectrum,
    facets: Ggx,
    /// The chance of sampling the returned lobe.
    returned_probability: f32,
}

/// Half a turn about the normal.
#[inline]
fn half_turn(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

impl Retroreflective {
    /// A surface that returns and diffusely reflects these fractions; smooth facets are given alpha 1e-3.
    #[inline]
    pub fn new(retroreflectance: SampledSpectrum, reflectance: SampledSpectrum, facets: Ggx) -> Self {
        let facets = if facets.is_smooth() { Ggx::new(1e-3, 1e-3) } else { facets };
        let ground = (1.0 - retroreflectance) * reflectance;
        let (a, b) = (retroreflectance.max_component(), ground.max_component());
        let returned_probability = if a + b > 0.0 { a / (a + b) } else { 0.0 };
        Self { returned: retroreflectance, ground, facets, returned_probability }
    }

    pub(super) fn facets(&self) -> &Ggx {
        &self.facets
    }

    /// Whether the returned lobe scatters more than the ground does.
    pub(super) fn returns_more(&self, wo: Vec3, wi: Vec3) -> bool {
        let back = half_turn(wo);
        let h = back + wi;
        let returned = self.facets.reflection(back, wi, h / h.length());
        self.returned.average() * returned > self.ground.average() * FRAC_1_PI
    }

    pub(super) fn flags(&self) -> Lobe {
        let a = if self.returned.is_black() { Lobe::NONE } else { Lobe::GLOSSY_REFLECTION };
        let b = if self.ground.is_black() { Lobe::NONE } else { Lobe::DIFFUSE_REFLECTION };
        a | b
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        if wo.z * wi.z <= 0.0 {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let back = half_turn(wo);
        let h = back + wi;
        let m = h / h.length();
        let f = self.returned * self.facets.reflection(back, wi, m) + self.ground * FRAC_1_PI;
        let p = self.returned_probability;
        (f, p * self.facets.bounded_pdf(back, m) + (1.0 - p) * wi.z.abs() * FRAC_1_PI)
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, sides: Sides) -> Option<BsdfSample> {
        if !sides.reflection() {
            return None;
        }
        let (wi, lobe) = if uc < self.returned_probability {
            (self.facets.sample_bounded_reflection(half_turn(wo), u)?, Lobe::GLOSSY_REFLECTION)
        } else {
            let mut wi = cosine_hemisphere(u);
            wi.z = wi.z.copysign(wo.z);
            (wi, Lobe::DIFFUSE_REFLECTION)
        };
        let (f, pdf) = self.f_and_pdf(wo, wi);
        Some(BsdfSample::new(f, wi, pdf, lobe))
    }

    pub(super) fn regularize(&mut self) {
        self.facets.regularize();
    }
}
