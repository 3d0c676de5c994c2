//! How light scatters at a point, in the local frame: z is the shading normal, `wo` and `wi` point away from it.
//!
//! A [`Bxdf`] is made fresh at each hit from numbers only, answers `f`, `pdf` and `sample`, and is thrown away. It
//! does not know of textures, of geometry or of render space; [`Bsdf`](crate::bsdf::Bsdf) places it in a frame.
//!
//! In reading order: [`fresnel`] and [`microfacet`] (interfaces), [`diffuse`], [`conductor`], [`dielectric`] (the simple
//! models), [`coat`] (what a clear coat does to a diffuse base), `layers` (the random walk between a coat and any
//! base), [`coated`] (coated diffuse and conductor), [`glossy_paint`], [`retroreflective`], [`thin_film_paint`] (models
//! of our own), `spread` (what counts as glossy), [`lobe_view`] (any model's lobes as numbers to plot).
//!
//! Contract, tested over every model at the end of this folder (`tests.rs`): values and densities are finite and
//! non-negative for all directions, 0 where `wo.z` or `wi.z` is 0; `f` has no cosine; energy is at most 1; what
//! `sample` returns satisfies E[f cos / pdf] = albedo; `f` is reciprocal, up to the squared index in transmission.
//!
//! Semantics and expected values follow pbrt-v4 (Pharr, Jakob and Humphreys 2023, "Physically Based Rendering", 4th
//! edition, chapters 9 and 14), except for the models of our own.

pub mod fresnel;
pub mod microfacet;

pub mod conductor;
pub mod dielectric;
pub mod diffuse;

pub mod coat;
pub mod coated;
mod layers;
pub mod lobe_view;
mod spread;

pub mod glossy_paint;
pub mod retroreflective;
pub mod thin_film_paint;

#[cfg(test)]
mod tests;

pub use coat::{Coat, CoatWeights};
pub use coated::{CoatedConductor, CoatedDiffuse, Filling, WalkLimits};
pub use conductor::Conductor;
pub use dielectric::{Dielectric, ThinDielectric};
pub use diffuse::{Diffuse, DiffuseTransmission};
pub use fresnel::ThinFilm;
pub use glossy_paint::GlossyPaint;
pub use microfacet::Ggx;
pub use retroreflective::Retroreflective;
pub use spread::Spread;
pub use thin_film_paint::ThinFilmPaint;

use irradiant_math::hash::Pcg32;
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::ops::{BitAnd, BitOr, BitOrAssign};

/// What a path carries backwards: radiance from a light, or importance from a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// The path began at the camera; `wi` leads towards light.
    Radiance,
    /// The path began at a light.
    Importance,
}

impl TransportMode {
    /// The other mode.
    #[inline]
    pub fn flip(self) -> Self {
        match self {
            Self::Radiance => Self::Importance,
            Self::Importance => Self::Radiance,
        }
    }
}

/// Which sides a sample may leave to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// Both.
    All,
    /// The side of `wo`.
    Reflection,
    /// The other side.
    Transmission,
}

impl Sides {
    /// Whether reflection is allowed.
    #[inline]
    pub fn reflection(self) -> bool {
        self != Self::Transmission
    }

    /// Whether transmission is allowed.
    #[inline]
    pub fn transmission(self) -> bool {
        self != Self::Reflection
    }
}

/// A set of properties of scattering: where to (reflection, transmission) and how (diffuse, glossy, specular).
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Lobe(pub u8);

impl std::fmt::Debug for Lobe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words = ["reflection", "transmission", "diffuse", "glossy", "specular"];
        // How, then where to: "specular transmission".
        let named: Vec<&str> = (0..5).rev().filter(|bit| self.0 >> bit & 1 == 1).map(|bit| words[bit]).collect();
        f.write_str(if named.is_empty() { "nothing" } else { "" })?;
        f.write_str(&named.join(" "))
    }
}

impl Lobe {
    /// Nothing scatters.
    pub const NONE: Self = Self(0);
    /// To the side of `wo`.
    pub const REFLECTION: Self = Self(1);
    /// To the other side.
    pub const TRANSMISSION: Self = Self(2);
    /// Broadly.
    pub const DIFFUSE: Self = Self(4);
    /// Concentrated about a direction.
    pub const GLOSSY: Self = Self(8);
    /// In one direction (a delta).
    pub const SPECULAR: Self = Self(16);
    /// Diffuse reflection.
    pub const DIFFUSE_REFLECTION: Self = Self(1 | 4);
    /// Diffuse transmission.
    pub const DIFFUSE_TRANSMISSION: Self = Self(2 | 4);
    /// Glossy reflection.
    pub const GLOSSY_REFLECTION: Self = Self(1 | 8);
    /// Glossy transmission.
    pub const GLOSSY_TRANSMISSION: Self = Self(2 | 8);
    /// Specular reflection.
    pub const SPECULAR_REFLECTION: Self = Self(1 | 16);
    /// Specular transmission.
    pub const SPECULAR_TRANSMISSION: Self = Self(2 | 16);

    /// Whether any property of `other` is among these.
    #[inline]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether there is a delta.
    #[inline]
    pub const fn is_specular(self) -> bool {
        self.intersects(Self::SPECULAR)
    }

    /// Whether there is a lobe that light sampling can reach.
    #[inline]
    pub const fn is_non_specular(self) -> bool {
        self.intersects(Self(Self::DIFFUSE.0 | Self::GLOSSY.0))
    }

    /// Whether anything is reflected.
    #[inline]
    pub const fn is_reflective(self) -> bool {
        self.intersects(Self::REFLECTION)
    }

    /// Whether anything is transmitted.
    #[inline]
    pub const fn is_transmissive(self) -> bool {
        self.intersects(Self::TRANSMISSION)
    }

    /// Whether there is a diffuse lobe.
    #[inline]
    pub const fn is_diffuse(self) -> bool {
        self.intersects(Self::DIFFUSE)
    }

    /// Whether there is a glossy lobe.
    #[inline]
    pub const fn is_glossy(self) -> bool {
        self.intersects(Self::GLOSSY)
    }
}

impl BitOr for Lobe {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Lobe {
    #[inline]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl BitAnd for Lobe {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

/// A direction drawn from a BSDF, with its value and density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// 1/sr, without cosine; for a delta, the reflected fraction over the cosine. The path's weight is `f |cos| / pdf`.
    pub f: SampledSpectrum,
    /// Unit, away from the surface.
    pub wi: Vec3,
    /// 1/sr over directions; for a delta a probability. To be used for multiple importance sampling as it is.
    pub pdf: f32,
    /// What was drawn.
    pub lobe: Lobe,
    /// Transmitted over incident index; 1 for reflection.
    pub eta: f32,
    /// The true density is not known; `pdf` is what [`Bxdf::pdf`] says of `wi`, and `f` is scaled so that `f |cos| / pdf`
    /// is the right weight. Multiple importance sampling with `pdf` is unbiased: both techniques use the same function.
    pub pdf_is_proportional: bool,
}

impl BsdfSample {
    /// A sample that stays in its medium and whose density is exact.
    #[inline]
    pub fn new(f: SampledSpectrum, wi: Vec3, pdf: f32, lobe: Lobe) -> Self {
        Self { f, wi, pdf, lobe, eta: 1.0, pdf_is_proportional: false }
    }
}

/// A scattering model in its local frame. Plain values, made at the hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bxdf {
    /// Ideal diffuse reflection.
    Diffuse(Diffuse),
    /// Ideal diffuse reflection and transmission.
    DiffuseTransmission(DiffuseTransmission),
    /// Metal.
    Conductor(Conductor),
    /// Interface between clear media.
    Dielectric(Dielectric),
    /// Clear pane.
    ThinDielectric(ThinDielectric),
    /// Clear coat over a diffuse base.
    CoatedDiffuse(CoatedDiffuse),
    /// Clear coat over a metal.
    CoatedConductor(CoatedConductor),
    /// Reflection back to where the light came from.
    Retroreflective(Retroreflective),
    /// Clear coat over a diffuse base, losing nothing.
    GlossyPaint(GlossyPaint),
    /// Interference film over an opaque base, bare or clear-coated.
    ThinFilmPaint(ThinFilmPaint),
}

/// A direction a model can answer for: unit, finite, not in the surface.
#[inline(always)]
pub fn is_usable(w: Vec3) -> bool {
    w.z != 0.0 && (w.length_squared() - 1.0).abs() < 0.01
}

impl Bxdf {
    /// What this model can do.
    #[inline]
    pub fn flags(&self) -> Lobe {
        match self {
            Self::Diffuse(b) => b.flags(),
            Self::DiffuseTransmission(b) => b.flags(),
            Self::Conductor(b) => b.flags(),
            Self::Dielectric(b) => b.flags(),
            Self::ThinDielectric(_) => Lobe::REFLECTION | Lobe::TRANSMISSION | Lobe::SPECULAR,
            Self::CoatedDiffuse(b) => b.flags(),
            Self::CoatedConductor(b) => b.flags(),
            Self::Retroreflective(b) => b.flags(),
            Self::GlossyPaint(b) => b.flags(),
            Self::ThinFilmPaint(b) => b.flags(),
        }
    }

    /// Scattered radiance per incident irradiance, 1/sr, without cosine; deltas are 0.
    ///
    /// 0 for directions in the surface, of wrong length or NaN. Layered models with rough or filled coats estimate it by
    /// a random walk seeded by the directions: the same directions give the same value, its mean is right.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> SampledSpectrum {
        self.f_and_pdf(wo, wi, mode).0
    }

    /// The density with which [`Bxdf::sample`] draws `wi`, 1/sr; deltas are 0.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode, which: Sides) -> f32 {
        if !(is_usable(wo) && is_usable(wi)) {
            return 0.0;
        }
        if !(if wo.z * wi.z > 0.0 { which.reflection() } else { which.transmission() }) {
            return 0.0;
        }
        let pdf = match self {
            Self::Diffuse(b) => b.f_and_pdf(wo, wi).1,
            Self::DiffuseTransmission(b) => b.f_and_pdf(wo, wi, which).1,
            Self::Conductor(b) => b.f_and_pdf(wo, wi).1,
            Self::Dielectric(b) => b.f_and_pdf(wo, wi, mode, which).1,
            Self::ThinDielectric(_) => 0.0,
            Self::CoatedDiffuse(b) => b.pdf(wo, wi),
            Self::CoatedConductor(b) => b.pdf(wo, wi),
            Self::Retroreflective(b) => b.f_and_pdf(wo, wi).1,
            Self::GlossyPaint(b) => b.pdf(wo, wi),
            Self::ThinFilmPaint(b) => b.pdf(wo, wi),
        };
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Value and density at once, for light sampling: as [`Bxdf::f`] and [`Bxdf::pdf`] with both sides, sharing work.
    #[inline]
    pub fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        if !(is_usable(wo) && is_usable(wi)) {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let (f, pdf) = match self {
            Self::Diffuse(b) => b.f_and_pdf(wo, wi),
            Self::DiffuseTransmission(b) => b.f_and_pdf(wo, wi, Sides::All),
            Self::Conductor(b) => b.f_and_pdf(wo, wi),
            Self::Dielectric(b) => {
                let (f, pdf) = b.f_and_pdf(wo, wi, mode, Sides::All);
                (SampledSpectrum::splat(f), pdf)
            }
            Self::ThinDielectric(_) => (SampledSpectrum::ZERO, 0.0),
            Self::CoatedDiffuse(b) => b.f_and_pdf(wo, wi, mode),
            Self::CoatedConductor(b) => b.f_and_pdf(wo, wi, mode),
            Self::Retroreflective(b) => b.f_and_pdf(wo, wi),
            Self::GlossyPaint(b) => b.f_and_pdf(wo, wi),
            Self::ThinFilmPaint(b) => b.f_and_pdf(wo, wi, mode),
        };
        // Denormal cosines can overflow a lobe; such directions carry no light.
        if f.is_finite() && pdf.is_finite() { (f, pdf) } else { (SampledSpectrum::ZERO, 0.0) }
    }

    /// Draws `wi` about in proportion to `f cos`; `None` if nothing is scattered.
    ///
    /// `uc` chooses the lobe, `u` the direction, all in [0, 1).
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, which: Sides) -> Option<BsdfSample> {
        if !is_usable(wo) {
            return None;
        }
        let sample = match self {
            Self::Diffuse(b) => b.sample(wo, u, which),
            Self::DiffuseTransmission(b) => b.sample(wo, uc, u, mode, which),
            Self::Conductor(b) => b.sample(wo, u, which),
            Self::Dielectric(b) => b.sample(wo, uc, u, mode, which),
            Self::ThinDielectric(b) => b.sample(wo, uc, which),
            Self::CoatedDiffuse(b) => b.sample(wo, uc, u, mode, which),
            Self::CoatedConductor(b) => b.sample(wo, uc, u, mode, which),
            Self::Retroreflective(b) => b.sample(wo, uc, u, which),
            Self::GlossyPaint(b) => b.sample(wo, uc, u, which),
            Self::ThinFilmPaint(b) => b.sample(wo, uc, u, mode, which),
        }?;
        let good = sample.pdf > 0.0
            && sample.pdf.is_finite()
            && sample.f.is_finite()
            && !sample.f.is_black()
            && is_usable(sample.wi);
        good.then_some(sample)
    }

    /// Roughens sharp lobes (biased: for path regularisation only), as pbrt-v4: alphas below 0.3 become 0.1 to 0.3.
    pub fn regularize(&mut self) {
        match self {
            Self::Conductor(b) => b.facets.regularize(),
            Self::Dielectric(b) => b.facets.regularize(),
            Self::CoatedDiffuse(b) => b.regularize(),
            Self::CoatedConductor(b) => b.regularize(),
            Self::Retroreflective(b) => b.regularize(),
            Self::ThinFilmPaint(b) => b.regularize(),
            Self::Diffuse(_) | Self::DiffuseTransmission(_) | Self::ThinDielectric(_) | Self::GlossyPaint(_) => {}
        }
    }

    /// An estimate of the hemispherical-directional reflectance (with transmittance) seen from `wo`, from `n` samples.
    ///
    /// Radiance transport; transmitted light counts with its squared index ratio. Deterministic for the same arguments.
    pub fn rho_hd(&self, wo: Vec3, n: u32) -> SampledSpectrum {
        let mut random = Pcg32::new(0x1d0_b5df, 0x7);
        let mut sum = SampledSpectrum::ZERO;
        for i in 0..n {
            // Stratified in u.x; the rest is random.
            let uc = random.next_f32();
            let x = (i as f32 + random.next_f32()) / n as f32;
            let u = Point2::new(x.min(irradiant_math::elementary::ONE_MINUS_EPSILON), random.next_f32());
            if let Some(s) = self.sample(wo, uc, u, TransportMode::Radiance, Sides::All) {
                sum += s.f * (s.wi.z.abs() / s.pdf);
            }
        }
        if n == 0 { sum } else { sum / n as f32 }
    }
}
