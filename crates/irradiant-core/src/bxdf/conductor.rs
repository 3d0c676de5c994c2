//! Metals: mirror reflection weighted by the complex Fresnel reflectance, off a smooth or a rough surface.
//!
//! Torrance and Sparrow 1967 with GGX facets; single scattering, so rough metals lose some energy (as pbrt-v4's do).

use super::fresnel::fresnel_conductor;
use super::microfacet::Ggx;
use super::{BsdfSample, Lobe, Sides};
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// A metal. Two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    eta: SampledSpectrum,
    k: SampledSpectrum,
    pub(super) facets: Ggx,
}

/// The rough or smooth mirror lobe shared by all opaque mirrors: `fresnel(cos)` of the facet angle times GGX.
#[inline]
pub(super) fn mirror_f_and_pdf(
    facets: &Ggx,
    wo: Vec3,
    wi: Vec3,
    fresnel: impl FnOnce(f32) -> SampledSpectrum,
) -> (SampledSpectrum, f32) {
    if facets.is_smooth() {
        return (SampledSpectrum::ZERO, 0.0);
    }
    match mirror_lobe(facets, wo, wi) {
        (lobe, true) => (fresnel(lobe.cos) * lobe.value, lobe.pdf),
        (_, false) => (SampledSpectrum::ZERO, 0.0),
    }
}

/// A rough mirror lobe without Fresnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorLobe {
    /// Cosine with the facet.
    pub cos: f32,
    /// To be multiplied with the facet's reflectance, 1/sr.
    pub value: f32,
    /// 1/sr.
    pub pdf: f32,
}

/// The lobe of facets that are not smooth, and whether these directions are on one side, where it is of use.
#[inline(always)]
pub fn mirror_lobe(facets: &Ggx, wo: Vec3, wi: Vec3) -> (MirrorLobe, bool) {
    let h = wo + wi;
    let length_squared = h.length_squared();
    let m = h / length_squared.sqrt();
    let lobe = MirrorLobe { cos: wo.dot(m).abs(), value: facets.reflection(wo, wi, m), pdf: facets.bounded_pdf(wo, m) };
    (lobe, !(wo.z * wi.z <= 0.0) & (length_squared != 0.0))
}

/// A sample of [`mirror_f_and_pdf`]; a delta in the mirror direction when smooth.
#[inline]
pub(super) fn mirror_sample(
    facets: &Ggx,
    wo: Vec3,
    u: Point2,
    sides: Sides,
    fresnel: impl FnOnce(f32) -> SampledSpectrum,
) -> Option<BsdfSample> {
    if !sides.reflection() {
        return None;
    }
    if facets.is_smooth() {
        let wi = Vec3::new(-wo.x, -wo.y, wo.z);
        let cos = wo.z.abs();
        return Some(BsdfSample::new(fresnel(cos) / cos, wi, 1.0, Lobe::SPECULAR_REFLECTION));
    }
    let wi = facets.sample_bounded_reflection(wo, u)?;
    let (f, pdf) = mirror_f_and_pdf(facets, wo, wi, fresnel);
    Some(BsdfSample::new(f, wi, pdf, Lobe::GLOSSY_REFLECTION))
}

impl Conductor {
    /// A metal of index `eta + i k` relative to the outside, with GGX facets.
    #[inline]
    pub fn new(eta: SampledSpectrum, k: SampledSpectrum, facets: Ggx) -> Self {
        Self { eta, k, facets }
    }

    /// Its facets.
    #[inline]
    pub fn facets(&self) -> Ggx {
        self.facets
    }

    /// Its index, `eta + i k`, relative to the outside.
    #[inline]
    pub fn index(&self) -> (SampledSpectrum, SampledSpectrum) {
        (self.eta, self.k)
    }

    /// The fraction reflected by a facet at this angle, per lane.
    #[inline(always)]
    pub fn fresnel(&self, cos_i: f32) -> SampledSpectrum {
        fresnel_conductor(cos_i, self.eta, self.k)
    }

    #[inline]
    pub(super) fn flags(&self) -> Lobe {
        if self.facets.is_smooth() { Lobe::SPECULAR_REFLECTION } else { Lobe::GLOSSY_REFLECTION }
    }

    /// How rough it is: the smaller of its facets' alphas.
    #[inline]
    pub fn alpha(&self) -> f32 {
        let [x, y] = self.facets.alphas();
        x.min(y)
    }

    #[inline]
    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        mirror_f_and_pdf(&self.facets, wo, wi, |cos| self.fresnel(cos))
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Point2, sides: Sides) -> Option<BsdfSample> {
        mirror_sample(&self.facets, wo, u, sides, |cos| self.fresnel(cos))
    }
}
