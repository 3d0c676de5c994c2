//! Where a ray goes from a surface, and with what density: uniform, cosine, by the BSDF (B29); at glass by Fresnel or by a coin (B35).
//!
//! B29 prints 1/(2 pi) and (w.n)/pi for surfaces that reflect. Where light also passes to the other side, both sides get half.
//!
//! Ideal mirrors and glass have no density to be met by uniform or cosine-weighted directions. B34's rule is followed there: they
//! are a distinct case, drawn with probability 1, without cosine. Where a surface has both kinds of lobes (a varnish over a diffuse
//! base) a coin decides between them, since the slide says nothing. [`Deltas::Missed`] is A62: what chance cannot find is not found.

use super::walk::Vertex;
use crate::registry::{OptionEntry, OptionRange, Options, words};
use irradiant_core::bxdf::{BsdfSample, Sides, TransportMode};
use irradiant_core::sampler::ScatterDraws;
use irradiant_math::{Frame, Point2, Vec3, warp};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::PI;

words! {
    /// The density of directions (B29).
    pub enum DirectionPdf {
        /// By the BSDF, about in proportion to f cos.
        Bsdf = "bsdf",
        /// Cosine-weighted, cos / pi.
        Cosine = "cosine",
        /// Uniform over the hemisphere, 1/(2 pi).
        Uniform = "uniform",
    }
}

words! {
    /// How glass chooses between reflection and refraction (B35).
    pub enum GlassChoice {
        /// In proportion to Fresnel's reflectance.
        Fresnel = "fresnel",
        /// By a coin, probability 1/2 each: the same picture with more noise.
        Constant = "constant",
    }
}

pub(crate) const DIRECTIONS: OptionEntry = OptionEntry {
    name: "directions",
    range: OptionRange::Word(DirectionPdf::WORDS),
    default: DirectionPdf::Bsdf.value(),
    doc: "density of the next direction (B29); mirrors and glass are always sampled as such (B34)",
};

pub(crate) const GLASS: OptionEntry = OptionEntry {
    name: "glass",
    range: OptionRange::Word(GlassChoice::WORDS),
    default: GlassChoice::Fresnel.value(),
    doc: "how glass chooses between reflection and refraction (B35)",
};

/// Whether directions that are not drawn from the BSDF find ideal mirrors and glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deltas {
    /// As a distinct case (B34).
    Found,
    /// Not at all (A62).
    Missed,
}

/// How directions are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Directions {
    /// With what density.
    pub pdf: DirectionPdf,
    /// At glass.
    pub glass: GlassChoice,
    /// Mirrors and glass.
    pub deltas: Deltas,
}

/// A direction that was drawn.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Unit, away from the surface.
    pub wi: Vec3,
    /// The slides' BRDF cos / pdf, by wavelength; not black.
    pub weight: SampledSpectrum,
    /// The largest `weight`, freed of the eta^2 by which refraction scales radiance: what roulette may look at.
    pub brightness: f32,
    /// Density per solid angle, to be compared with that of a light sample; 0 where it is specular.
    pub pdf: f32,
    /// Along a delta: no light sample can compete.
    pub specular: bool,
}

impl Directions {
    /// As an entry's options `directions` and `glass` say.
    pub fn of(options: &Options) -> Self {
        let (pdf, glass) = (DirectionPdf::of(options.word("directions")), GlassChoice::of(options.word("glass")));
        Self { pdf, glass, deltas: Deltas::Found }
    }

    /// Draws the next direction; `None` if nothing is scattered there.
    pub fn sample(&self, p: &Vertex, draws: &ScatterDraws) -> Option<Step> {
        let Some(share) = self.broad_share(p) else { return self.sample_bsdf(p, draws.lobe, draws.uv, 1.0) };
        if draws.lobe < share {
            return self.sample_broad(p, draws.uv, share);
        }
        // What the BSDF would have drawn of its broad lobes is drawn by the other side of the coin.
        let lobe = ((draws.lobe - share) / (1.0 - share)).min(1.0 - f32::EPSILON / 2.0);
        self.sample_bsdf(p, lobe, draws.uv, 1.0 - share).filter(|step| step.specular)
    }

    /// The density of [`Directions::sample`] at a direction, per solid angle, deltas not counted.
    pub fn pdf(&self, p: &Vertex, wi: Vec3) -> f32 {
        match self.broad_share(p) {
            None => p.bsdf.pdf(p.at.wo, wi, TransportMode::Radiance, Sides::All),
            Some(share) => share * self.broad_pdf(p, wi),
        }
    }

    /// The chance that the density of `pdf` is used and not the BSDF's own; `None` if that does not come into question.
    fn broad_share(&self, p: &Vertex) -> Option<f32> {
        let flags = p.bsdf.flags();
        match (self.pdf, self.deltas, flags.is_specular(), flags.is_non_specular()) {
            (DirectionPdf::Bsdf, ..) | (_, Deltas::Found, _, false) => None,
            (_, Deltas::Found, true, true) => Some(0.5),
            (_, Deltas::Found, false, true) | (_, Deltas::Missed, ..) => Some(1.0),
        }
    }

    /// By the BSDF, weighed against the chance that it was asked.
    fn sample_bsdf(&self, p: &Vertex, lobe: f32, uv: Point2, chance: f32) -> Option<Step> {
        let flags = p.bsdf.flags();
        let two_sided_delta =
            flags.is_specular() && !flags.is_non_specular() && flags.is_reflective() && flags.is_transmissive();
        let (sides, lobe, coin) = match self.glass {
            GlassChoice::Constant if two_sided_delta && lobe < 0.5 => (Sides::Reflection, 2.0 * lobe, 0.5),
            GlassChoice::Constant if two_sided_delta => (Sides::Transmission, 2.0 * lobe - 1.0, 0.5),
            GlassChoice::Constant | GlassChoice::Fresnel => (Sides::All, lobe, 1.0),
        };
        let BsdfSample { f, wi, pdf, lobe, eta, pdf_is_proportional } =
            p.bsdf.sample(p.at.wo, lobe, uv, TransportMode::Radiance, sides)?;
        let weight = f * (p.bsdf.abs_cos(wi) / (pdf * coin * chance));
        if weight.is_black() {
            return None;
        }
        let specular = lobe.is_specular();
        let brightness = weight.max_component() * if lobe.is_transmissive() { eta * eta } else { 1.0 };
        let pdf = match (specular, pdf_is_proportional) {
            (true, _) => 0.0,
            (false, true) => p.bsdf.pdf(p.at.wo, wi, TransportMode::Radiance, Sides::All),
            (false, false) => pdf,
        };
        Some(Step { wi, weight, brightness, pdf, specular })
    }

    /// Uniform or cosine-weighted over the sides to which the surface scatters.
    fn sample_broad(&self, p: &Vertex, uv: Point2, share: f32) -> Option<Step> {
        let n = p.bsdf.frame.z;
        let mut uv = uv;
        let flags = p.bsdf.flags();
        let same_side = match (flags.is_reflective(), flags.is_transmissive()) {
            (true, true) => {
                let first = uv.x < 0.5;
                uv.x = if first { 2.0 * uv.x } else { 2.0 * uv.x - 1.0 };
                first
            }
            (true, false) => true,
            (false, true) => false,
            (false, false) => return None,
        };
        let local = match self.pdf {
            DirectionPdf::Uniform => warp::uniform_hemisphere(uv),
            DirectionPdf::Cosine | DirectionPdf::Bsdf => warp::cosine_hemisphere(uv),
        };
        let up = if (p.at.wo.dot(n) > 0.0) == same_side { n } else { -n };
        let wi = Frame::from_z(up).from_local(local);
        let pdf = share * self.broad_pdf(p, wi);
        if !(pdf > 0.0) {
            return None;
        }
        let weight = p.bsdf.f(p.at.wo, wi, TransportMode::Radiance) * (p.bsdf.abs_cos(wi) / pdf);
        if weight.is_black() {
            return None;
        }
        Some(Step { wi, weight, brightness: weight.max_component(), pdf, specular: false })
    }

    fn broad_pdf(&self, p: &Vertex, wi: Vec3) -> f32 {
        let flags = p.bsdf.flags();
        let n = p.bsdf.frame.z;
        let same_side = p.at.wo.dot(n) * wi.dot(n) > 0.0;
        let side = match (flags.is_reflective(), flags.is_transmissive()) {
            (true, true) => 0.5,
            (reflective, transmissive) => f32::from(u8::from(if same_side { reflective } else { transmissive })),
        };
        side * match self.pdf {
            DirectionPdf::Uniform => 1.0 / (2.0 * PI),
            DirectionPdf::Cosine | DirectionPdf::Bsdf => p.bsdf.abs_cos(wi) / PI,
        }
    }
}
