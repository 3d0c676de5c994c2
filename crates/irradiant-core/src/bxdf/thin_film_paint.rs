//! Paint whose hue flops with angle: flakes carrying an interference film, bare or under a clear coat. Our own model.
//!
//! | parameter | range | default |
//! |---|---|---|
//! | thickness | nm, 0 to about 2000: of the film | 500 |
//! | film eta | 1 to 3: index of the film | 2.4 |
//! | base eta, k | index of the opaque base (aluminium by default) | |
//! | alpha | [0, 1]: how much the flakes' orientations vary | 0.2 |
//! | coat | index and facets of a clear coat; none by default | |
//!
//! The reflectance is the Airy sum of one film per wavelength ([`ThinFilm`]) on GGX facets; what a peak of order m at
//! normal incidence, `lambda = 2 n d / (m - 1/2)` or `2 n d / m`, moves to at angle is `lambda sqrt(1 - sin^2 / n^2)`:
//! towards blue. In the RGB basis the lanes' nominal wavelengths stand for the primaries: only indicative.

use super::coat::CoatWeights;
use super::coated::{CoatOverMirror, Filling, WalkLimits};
use super::conductor::{mirror_f_and_pdf, mirror_sample};
use super::dielectric::Dielectric;
use super::fresnel::ThinFilm;
use super::layers::Base;
use super::microfacet::Ggx;
use super::{BsdfSample, Lobe, Sides, TransportMode};
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// Flakes with an interference film. Two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinFilmPaint {
    flakes: Flakes,
    coat: Option<CoatOverMirror>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Flakes {
    film: ThinFilm,
    facets: Ggx,
}

impl ThinFilmPaint {
    /// Flakes of this film and these facets; under a coat if given.
    ///
    /// The film's `outside` index must then be the coat's. The coat absorbs nothing and all paths in it are summed.
    pub fn new(film: ThinFilm, facets: Ggx, coat: Option<Dielectric>) -> Self {
        let coat = coat.map(|interface| CoatOverMirror {
            interface,
            thickness: 0.0,
            filling: Filling::NONE,
            limits: WalkLimits::UNLIMITED,
            weights: CoatWeights::Exact,
        });
        Self { flakes: Flakes { film, facets }, coat }
    }

    pub(super) fn coat(&self) -> Option<&CoatOverMirror> {
        self.coat.as_ref()
    }

    pub(super) fn facets(&self) -> &Ggx {
        &self.flakes.facets
    }

    pub(super) fn flags(&self) -> Lobe {
        match &self.coat {
            Some(coat) => coat.flags(self.flakes.facets.is_smooth()),
            None if self.flakes.facets.is_smooth() => Lobe::SPECULAR_REFLECTION,
            None => Lobe::GLOSSY_REFLECTION,
        }
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match &self.coat {
            Some(coat) => coat.pdf(&self.flakes.facets, wo, wi),
            // The lobe's colour does not matter to its density.
            None => mirror_f_and_pdf(&self.flakes.facets, wo, wi, |_| SampledSpectrum::ONE).1,
        }
    }

    pub(super) fn f_and_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        match &self.coat {
            Some(coat) => coat.f_and_pdf(&self.flakes, &self.flakes.facets, wo, wi, mode),
            None => self.flakes.f_and_pdf(wo, wi),
        }
    }

    pub(super) fn sample(&self, wo: Vec3, uc: f32, u: Point2, mode: TransportMode, sides: Sides) -> Option<BsdfSample> {
        if !sides.reflection() {
            return None;
        }
        match &self.coat {
            Some(coat) => coat.sample(&self.flakes, &self.flakes.facets, wo, uc, u, mode),
            None => self.flakes.sample(wo, u),
        }
    }

    pub(super) fn regularize(&mut self) {
        self.flakes.facets.regularize();
        if let Some(coat) = &mut self.coat {
            coat.interface.facets.regularize();
        }
    }
}

impl Base for Flakes {
    fn is_specular(&self) -> bool {
        self.facets.is_smooth()
    }

    fn f_and_pdf(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        mirror_f_and_pdf(&self.facets, wo, wi, |cos| self.film.reflectance(cos))
    }

    fn sample(&self, wo: Vec3, u: Point2) -> Option<BsdfSample> {
        mirror_sample(&self.facets, wo, u, Sides::Reflection, |cos| self.film.reflectance(cos))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // The peak of order m is where the phase 4 pi n d cos / lambda is a multiple of 2 pi (both interfaces turn the phase
    // alike up to the metal's own): it moves to shorter wavelengths by the factor cos of the angle within the film.
    #[test]
    fn the_peak_moves_to_blue_by_the_cosine_in_the_film() {
        let (n, d) = (1.6f32, 450.0f32);
        let peak = |cos: f32| {
            (380..780)
                .map(|l| {
                    let lambda = [l as f32; 4];
                    // A strong dielectric contrast, without the metal's wavelength-dependent phase.
                    let film = ThinFilm::new(
                        d,
                        SampledSpectrum::splat(n),
                        SampledSpectrum::splat(4.0),
                        SampledSpectrum::ZERO,
                        1.0,
                        lambda,
                    );
                    (film.reflectance(cos)[0], l)
                })
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .map(|(_, l)| l as f32)
                .unwrap()
        };
        let at = |cos: f32| (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
        // n d = 720: both steps go up in index, so the peak is at 2 n d / 2 = 720 nm.
        assert!((peak(1.0) - 720.0).abs() <= 1.0, "{}", peak(1.0));
        for cos in [0.9, 0.7, 0.5] {
            assert!((peak(cos) - 720.0 * at(cos)).abs() < 3.0, "{cos}: {}", peak(cos));
        }
    }
}
