//! What counts as glossy and what as diffuse, for path expressions and reports.
//!
//! The answer depends on the surface and the pair of directions, never on which lobe a sampler happened to draw: so a path
//! has one description whatever found it, and pictures of kinds of paths are pictures of sets of paths.

use super::coat::CoatForm;
use super::coated::{CoatOverMirror, CoatedDiffuse};
use super::fresnel::{fresnel_dielectric, refract};
use super::microfacet::Ggx;
use super::{Bxdf, CoatWeights};
use irradiant_math::Vec3;
use std::f32::consts::FRAC_1_PI;

/// How far a scattering event that is no delta spreads light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spread {
    /// About a direction: facets of alpha below [`Spread::GLOSSY_ALPHA`].
    Glossy,
    /// Broadly.
    Diffuse,
}

impl Spread {
    /// Facets whose alpha is less are glossy: where pbrt-v4's regularisation, too, takes lobes for sharp.
    pub const GLOSSY_ALPHA: f32 = 0.3;

    /// Of facets; the geometric mean of both alphas counts.
    fn of(facets: &Ggx) -> Self {
        let [x, y] = facets.alphas();
        if x * y < Self::GLOSSY_ALPHA * Self::GLOSSY_ALPHA { Self::Glossy } else { Self::Diffuse }
    }
}

impl Bxdf {
    /// How far light of this pair of directions is spread, deltas left out; where a broad and a narrow lobe overlap, that of
    /// the lobe that scatters more.
    pub fn spread(&self, wo: Vec3, wi: Vec3) -> Spread {
        match self {
            Self::Diffuse(_) | Self::DiffuseTransmission(_) => Spread::Diffuse,
            Self::Conductor(b) => Spread::of(&b.facets),
            Self::Dielectric(b) => Spread::of(&b.facets),
            Self::ThinDielectric(_) => Spread::Glossy,
            Self::CoatedDiffuse(b) => b.spread(wo, wi),
            Self::GlossyPaint(b) => b.body().spread(wo, wi),
            Self::CoatedConductor(b) => b.coat().spread(b.facets()),
            Self::Retroreflective(b) => {
                if b.returns_more(wo, wi) {
                    Spread::of(b.facets())
                } else {
                    Spread::Diffuse
                }
            }
            Self::ThinFilmPaint(b) => b.coat().map_or(Spread::of(b.facets()), |coat| coat.spread(b.facets())),
        }
    }

    /// Where the lobes of light from `wo` that may be narrow have their peaks, whatever their width: the mirror direction, the
    /// refracted one, the way back. Unit, local frame. None of models that scatter broadly only.
    ///
    /// At grazing angles a rough lobe's maximum lies off these directions; they are where to look, not where it is.
    pub fn peaks(&self, wo: Vec3) -> [Option<Vec3>; 2] {
        let mirror = Some(Vec3::new(-wo.x, -wo.y, wo.z));
        match self {
            Self::Diffuse(_) | Self::DiffuseTransmission(_) => [None, None],
            // All that a smooth coat adds is a delta.
            Self::CoatedDiffuse(b) if b.coat().interface.is_specular() => [None, None],
            Self::Conductor(_)
            | Self::CoatedDiffuse(_)
            | Self::CoatedConductor(_)
            | Self::GlossyPaint(_)
            | Self::ThinFilmPaint(_) => [mirror, None],
            Self::Dielectric(b) => [mirror, refract(wo, Vec3::Z, b.eta()).map(|(wi, _)| wi)],
            Self::ThinDielectric(_) => [mirror, Some(-wo)],
            Self::Retroreflective(_) => [Some(wo), None],
        }
    }

    /// Whether evaluation is brighter than sampling, as pbrt-v4's is ([`CoatWeights::Pbrt`]): rough coats over anything but a mirror.
    pub fn is_evaluated_as_pbrt(&self) -> bool {
        match self {
            Self::CoatedDiffuse(b) => b.coat().has_pbrt_weights(),
            Self::CoatedConductor(b) => {
                let coat = b.coat();
                let mirror = b.facets().is_smooth() && coat.filling.albedo.is_black();
                coat.weights == CoatWeights::Pbrt && !coat.interface.is_specular() && !mirror
            }
            Self::Diffuse(_)
            | Self::DiffuseTransmission(_)
            | Self::Conductor(_)
            | Self::Dielectric(_)
            | Self::ThinDielectric(_)
            | Self::Retroreflective(_)
            | Self::GlossyPaint(_)
            | Self::ThinFilmPaint(_) => false,
        }
    }
}

impl CoatedDiffuse {
    fn spread(&self, wo: Vec3, wi: Vec3) -> Spread {
        let interface = &self.coat().interface;
        if interface.is_specular() {
            return Spread::Diffuse;
        }
        let h = wo + wi;
        let m = h / h.length();
        let coat = fresnel_dielectric(wo.dot(m).abs(), interface.eta) * interface.facets.reflection(wo, wi, m);
        let through = if self.coat().form == CoatForm::Unknown {
            1.0
        } else {
            self.coat().enter(wo.z.abs()) * self.coat().enter(wi.z.abs())
        };
        let base = self.reflectance().average() * FRAC_1_PI * through;
        if coat > base { Spread::of(&interface.facets) } else { Spread::Diffuse }
    }
}

impl CoatOverMirror {
    /// The rougher of coat and base tells; what fills the coat scatters broadly.
    fn spread(&self, base: &Ggx) -> Spread {
        let coat = if self.interface.is_specular() { Spread::Glossy } else { Spread::of(&self.interface.facets) };
        let filled = !self.filling.albedo.is_black();
        if filled || coat == Spread::Diffuse || Spread::of(base) == Spread::Diffuse {
            Spread::Diffuse
        } else {
            Spread::Glossy
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::coat::{Coat, CoatWeights};
    use super::super::{Conductor, Dielectric, Diffuse, GlossyPaint, Retroreflective};
    use super::*;
    use irradiant_spectrum::SampledSpectrum;

    const UP: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    fn tilted(x: f32) -> Vec3 {
        Vec3::new(x, 0.0, (1.0 - x * x).sqrt())
    }

    #[test]
    fn a_highlight_is_glossy_and_the_body_around_it_is_not() {
        let grey = SampledSpectrum::splat(0.5);
        let coat = Coat::lossless(1.5, 0.1);
        let paint = Bxdf::GlossyPaint(GlossyPaint::new(&coat, grey));
        assert_eq!(paint.spread(tilted(0.5), tilted(-0.5)), Spread::Glossy);
        assert_eq!(paint.spread(tilted(0.5), tilted(0.5)), Spread::Diffuse);
        let sign = Bxdf::Retroreflective(Retroreflective::new(grey, grey, Ggx::new(0.1, 0.1)));
        assert_eq!(sign.spread(tilted(0.5), tilted(0.5)), Spread::Glossy);
        assert_eq!(sign.spread(tilted(0.5), tilted(-0.5)), Spread::Diffuse);
    }

    #[test]
    fn the_spread_is_the_same_from_both_ends() {
        let grey = SampledSpectrum::splat(0.5);
        let rough = Bxdf::CoatedDiffuse(CoatedDiffuse::new(
            &Coat::new(1.5, Ggx::new(0.2, 0.2), 0.01, CoatWeights::Exact),
            grey,
            super::super::Filling::NONE,
            super::super::WalkLimits::PBRT,
        ));
        for i in -9..10 {
            for j in -9..10 {
                let (a, b) = (tilted(i as f32 * 0.1), tilted(j as f32 * 0.1));
                assert_eq!(rough.spread(a, b), rough.spread(b, a), "{i} {j}");
                assert_eq!(rough.spread(a, b), rough.spread(-a, -b), "{i} {j}");
            }
        }
    }

    #[test]
    fn facets_are_glossy_below_three_tenths() {
        let metal = |alpha: f32| {
            let (eta, k) = (SampledSpectrum::splat(0.2), SampledSpectrum::splat(3.0));
            Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(alpha, alpha))).spread(UP, UP)
        };
        assert_eq!((metal(0.29), metal(0.31)), (Spread::Glossy, Spread::Diffuse));
        let glass = Bxdf::Dielectric(Dielectric::new(1.5, Ggx::new(0.2, 0.2)));
        assert_eq!(glass.spread(UP, -UP), Spread::Glossy);
        assert_eq!(Bxdf::Diffuse(Diffuse::new(SampledSpectrum::ONE)).spread(UP, UP), Spread::Diffuse);
    }
}
