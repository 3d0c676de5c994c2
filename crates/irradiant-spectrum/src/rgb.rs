//! Colour triples as spectra: reflectances, unbounded colours, lights.
//!
//! Small plain values, cheap enough to make at every texture look-up. The scaling is pbrt-v4's: what is not a
//! reflectance is uplifted at half its size, and light is multiplied by the illuminant of its colour space.

use crate::table::sample_dense;
use crate::uplift::SigmoidPolynomial;
use crate::{Basis, ColorSpace, SampledSpectrum, Wavelengths};

/// An sRGB-like triple seen as a reflectance: plain data, cheap enough to make at every texture look-up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RgbAlbedo {
    /// The triple, clamped to [0, 1].
    pub rgb: [f32; 3],
    /// Its spectrum.
    pub polynomial: SigmoidPolynomial,
}

impl RgbAlbedo {
    /// The reflectance `rgb` of `space`, clamped to [0, 1].
    #[inline]
    pub fn new(rgb: [f32; 3], space: &ColorSpace) -> Self {
        let rgb = rgb.map(|v| v.max(0.0).min(1.0));
        Self { rgb, polynomial: space.uplift(rgb) }
    }

    /// The reflectance at each wavelength, in [0, 1].
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        match wavelengths.basis {
            Basis::Spectral => self.polynomial.sample(wavelengths),
            Basis::Rgb => lanes(self.rgb),
        }
    }
}

/// A triple of any non-negative size: `scale` times a reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RgbUnbounded {
    /// The triple.
    pub rgb: [f32; 3],
    /// Twice the largest component, as pbrt-v4.
    pub scale: f32,
    /// The spectrum of `rgb / scale`.
    pub polynomial: SigmoidPolynomial,
}

impl RgbUnbounded {
    /// The spectrum of `rgb` of `space`; negative components (and NaN) become 0.
    #[inline]
    pub fn new(rgb: [f32; 3], space: &ColorSpace) -> Self {
        let rgb = rgb.map(|v| v.max(0.0));
        let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
        let polynomial = space.uplift(if scale > 0.0 { rgb.map(|v| v / scale) } else { [0.0; 3] });
        Self { rgb, scale, polynomial }
    }

    /// The value at each wavelength.
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        match wavelengths.basis {
            Basis::Spectral => self.polynomial.sample(wavelengths) * self.scale,
            Basis::Rgb => lanes(self.rgb),
        }
    }
}

/// A triple seen as light: an unbounded colour times the colour space's illuminant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RgbIlluminant {
    /// The colour without the illuminant.
    pub color: RgbUnbounded,
    /// Whose illuminant.
    pub space: &'static ColorSpace,
}

impl RgbIlluminant {
    /// Light that is `rgb` of `space`; (1, 1, 1) is the illuminant, with Y = 1.
    #[inline]
    pub fn new(rgb: [f32; 3], space: &'static ColorSpace) -> Self {
        Self { color: RgbUnbounded::new(rgb, space), space }
    }

    /// The value at each wavelength, relative spectral radiance.
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        match wavelengths.basis {
            Basis::Spectral => self.color.sample(wavelengths) * sample_dense(self.space.illuminant(), wavelengths),
            Basis::Rgb => lanes(self.color.rgb),
        }
    }
}

/// RGB in the lanes of the RGB basis.
#[inline]
pub(crate) fn lanes(rgb: [f32; 3]) -> SampledSpectrum {
    SampledSpectrum([rgb[0], rgb[1], rgb[2], rgb[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spectrum;
    use crate::table::eval_dense;

    fn srgb() -> &'static ColorSpace {
        ColorSpace::srgb()
    }

    // Other scales give the same colour by another spectrum, and pictures that differ from pbrt-v4's after a bounce.
    #[test]
    fn unbounded_colors_are_uplifted_at_half_their_size() {
        let half = srgb().uplift([0.2, 0.5, 0.1]);
        let (unbounded, light) =
            (Spectrum::rgb_unbounded([2.0, 5.0, 1.0], srgb()), Spectrum::rgb_illuminant([2.0, 5.0, 1.0], srgb()));
        for l in [400.0, 500.0, 600.0, 700.0] {
            assert!((unbounded.eval(l) - 10.0 * half.eval(l)).abs() < 1e-5);
            let d65 = eval_dense(srgb().illuminant(), l);
            assert!((light.eval(l) - 10.0 * half.eval(l) * d65).abs() < 1e-5);
        }
        let black = Spectrum::rgb_illuminant([0.0; 3], srgb());
        assert_eq!((black.eval(500.0), black.max_value()), (0.0, 0.0));
    }
}
