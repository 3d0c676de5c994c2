//! A scattering model placed in a frame: the one place where render space and the local frame meet.
//!
//! `f` carries no cosine. Which side a direction is on is decided by the *shading* normal alone, as in pbrt-v4.

use crate::bxdf::{BsdfSample, Bxdf, Lobe, Sides, Spread, TransportMode};
use irradiant_math::{Frame, Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// A [`Bxdf`] in a shading frame. Directions are in render space, unit, away from the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// The shading frame; its z is the shading normal.
    pub frame: Frame,
    /// The model.
    pub bxdf: Bxdf,
}

// Made and copied at every hit.
const _: () = assert!(size_of::<Bsdf>() <= 256);

impl Bsdf {
    /// The model in this frame.
    #[inline]
    pub fn new(frame: Frame, bxdf: Bxdf) -> Self {
        Self { frame, bxdf }
    }

    /// What the model can do.
    #[inline]
    pub fn flags(&self) -> Lobe {
        self.bxdf.flags()
    }

    /// Scattered radiance per incident irradiance, 1/sr, without cosine; deltas are 0.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> SampledSpectrum {
        self.bxdf.f(self.frame.to_local(wo), self.frame.to_local(wi), mode)
    }

    /// The density of [`Bsdf::sample`], 1/sr; deltas are 0.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode, which: Sides) -> f32 {
        self.bxdf.pdf(self.frame.to_local(wo), self.frame.to_local(wi), mode, which)
    }

    /// [`Bsdf::f`] and [`Bsdf::pdf`] (both sides) at once, cheaper than both.
    #[inline]
    pub fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        self.bxdf.f_and_pdf(self.frame.to_local(wo), self.frame.to_local(wi), mode)
    }

    /// Draws a direction; `None` if nothing is scattered. `uc` chooses the lobe, `u` the direction, in [0, 1).
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, which: Sides) -> Option<BsdfSample> {
        let mut sample = self.bxdf.sample(self.frame.to_local(wo), uc, u, mode, which)?;
        sample.wi = self.frame.from_local(sample.wi);
        Some(sample)
    }

    /// The cosine of a direction with the shading normal, without sign: what `f` must be multiplied with.
    #[inline]
    pub fn abs_cos(&self, w: Vec3) -> f32 {
        w.dot(self.frame.z).abs()
    }

    /// How far light of this pair of directions is spread, deltas left out.
    pub fn spread(&self, wo: Vec3, wi: Vec3) -> Spread {
        self.bxdf.spread(self.frame.to_local(wo), self.frame.to_local(wi))
    }

    /// Where lobes of light from `wo` that may be narrow have their peaks: see [`Bxdf::peaks`].
    pub fn peaks(&self, wo: Vec3) -> [Option<Vec3>; 2] {
        self.bxdf.peaks(self.frame.to_local(wo)).map(|peak| peak.map(|w| self.frame.from_local(w)))
    }

    /// Whether the directions lie on different sides.
    #[inline]
    pub fn is_transmitted(&self, wo: Vec3, wi: Vec3) -> bool {
        wo.dot(self.frame.z) * wi.dot(self.frame.z) < 0.0
    }

    /// Roughens sharp lobes (biased: for path regularisation only).
    pub fn regularize(&mut self) {
        self.bxdf.regularize();
    }

    /// An estimate of the hemispherical-directional reflectance seen from `wo`, from `n` samples.
    pub fn rho_hd(&self, wo: Vec3, n: u32) -> SampledSpectrum {
        self.bxdf.rho_hd(self.frame.to_local(wo), n)
    }
}
