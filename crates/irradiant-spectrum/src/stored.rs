//! Spectra at rest: what a scene stores and a path evaluates, in either basis.
//!
//! Evaluation is exact in the form each spectrum was given, and agrees with pbrt-v4's: tables are
//! interpolated linearly and 0 outside their range; dense tables are read at the nearest nanometre.
//! Colour comes in by its [`Role`], which decides how RGB becomes a spectrum and how a spectrum
//! becomes RGB for a render in the RGB basis.

use crate::emission::Blackbody;
use crate::photometry::{DENSE_LENGTH, xyz_of};
use crate::rgb::{RgbAlbedo, RgbIlluminant, RgbUnbounded, lanes};
use crate::table::{Table, eval_dense, sample_dense};
use crate::{Basis, ColorSpace, LAMBDA_MAX, LAMBDA_MIN, SampledSpectrum, Wavelengths, matrix};
use std::sync::Arc;

/// What a spectrum is of, which decides its translation to and from RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Reflectance or transmittance in [0, 1]: RGB as seen under the colour space's white, so a constant is grey.
    Reflectance,
    /// Emission: RGB of the light itself, so that the colour space's illuminant is (1, 1, 1).
    Illuminant,
    /// Non-negative and dimensionless or per length (metals' eta and k, scattering coefficients): translated like a
    /// reflectance, that is, averaged with the colour space's matching curves under its white, but not bounded by 1.
    Unbounded,
}

/// The forms a spectrum can have. Big tables are shared.
#[derive(Clone, Debug)]
pub enum Curve {
    /// The same at every wavelength.
    Constant(f32),
    /// 360..=830 nm at 1 nm, read at the nearest nanometre.
    Dense(Arc<[f32; DENSE_LENGTH]>),
    /// Linear between given points.
    PiecewiseLinear(Arc<Table>),
    /// Planck's law, normalised to its peak.
    Blackbody(Blackbody),
    /// RGB as a reflectance.
    RgbAlbedo(RgbAlbedo),
    /// RGB of any size.
    RgbUnbounded(RgbUnbounded),
    /// RGB as light.
    RgbIlluminant(RgbIlluminant),
}

/// A spectral distribution over wavelength, ready in both bases. Cloning is cheap.
#[derive(Clone, Debug)]
pub struct Spectrum {
    curve: Curve,
    role: Role,
    /// Linear RGB in the space it was built for, or moved to by [`Spectrum::in_space`].
    rgb: [f32; 3],
}

/// Why a table is not a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumError {
    /// No entries.
    Empty,
    /// The columns differ in length: (wavelengths, values).
    LengthMismatch(usize, usize),
    /// The entry of this index does not have a larger wavelength than the one before it, or is not a number.
    NotIncreasing(usize),
    /// The value of this index is infinite or not a number.
    NotFinite(usize),
    /// More than 65,535 entries.
    TooLong(usize),
}

impl std::fmt::Display for SpectrumError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "the spectrum has no entries"),
            Self::LengthMismatch(l, v) => write!(f, "{l} wavelengths but {v} values"),
            Self::NotIncreasing(i) => {
                write!(f, "wavelengths must increase, but entry {i} does not exceed the one before it")
            }
            Self::NotFinite(i) => write!(f, "the value of entry {i} is not a finite number"),
            Self::TooLong(n) => write!(f, "{n} entries; at most 65535 are supported"),
        }
    }
}

impl std::error::Error for SpectrumError {}

impl Spectrum {
    /// The same `value` at every wavelength.
    pub fn constant(value: f32, role: Role, space: &'static ColorSpace) -> Self {
        let rgb = match role {
            // Exactly grey, without the rounding of an integral.
            Role::Reflectance | Role::Unbounded => [value; 3],
            Role::Illuminant => rgb_of(|_| value, role, space),
        };
        Self { curve: Curve::Constant(value), role, rgb }
    }

    /// Values at 360..=830 nm in 1 nm steps, read at the nearest nanometre.
    pub fn dense(values: &[f32; DENSE_LENGTH], role: Role, space: &'static ColorSpace) -> Self {
        Self::from_curve(Curve::Dense(Arc::new(*values)), role, space)
    }

    /// `f` of the wavelength at 360..=830 nm in 1 nm steps, read at the nearest nanometre.
    pub fn dense_from_fn(f: impl Fn(f32) -> f32, role: Role, space: &'static ColorSpace) -> Self {
        Self::dense(&std::array::from_fn(|i| f(LAMBDA_MIN + i as f32)), role, space)
    }

    /// Linear between (`lambda` nm, `values`), 0 outside; an error says which entry is wrong.
    pub fn piecewise_linear(
        lambda: &[f32],
        values: &[f32],
        role: Role,
        space: &'static ColorSpace,
    ) -> Result<Self, SpectrumError> {
        if lambda.len() != values.len() {
            return Err(SpectrumError::LengthMismatch(lambda.len(), values.len()));
        }
        if lambda.is_empty() {
            return Err(SpectrumError::Empty);
        }
        if lambda.len() > usize::from(u16::MAX) {
            return Err(SpectrumError::TooLong(lambda.len()));
        }
        if !lambda[0].is_finite() {
            return Err(SpectrumError::NotIncreasing(0));
        }
        if let Some(i) = (1..lambda.len()).find(|&i| !(lambda[i - 1] < lambda[i] && lambda[i].is_finite())) {
            return Err(SpectrumError::NotIncreasing(i));
        }
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            return Err(SpectrumError::NotFinite(i));
        }
        Ok(Self::from_table(Table::new(lambda, values), role, space))
    }

    /// From pairs wavelength, value, wavelength, value, … as scene files and `.spd` files list them.
    pub fn interleaved(pairs: &[f32], role: Role, space: &'static ColorSpace) -> Result<Self, SpectrumError> {
        let lambda: Vec<f32> = pairs.iter().step_by(2).copied().collect();
        let values: Vec<f32> = pairs.iter().skip(1).step_by(2).copied().collect();
        Self::piecewise_linear(&lambda, &values, role, space)
    }

    /// A black body of `temperature` K, normalised to 1 at its peak (which may lie outside the visible); 0 for 0 K.
    pub fn blackbody(temperature: f32, role: Role, space: &'static ColorSpace) -> Self {
        Self::from_curve(Curve::Blackbody(Blackbody::new(temperature, 1.0)), role, space)
    }

    /// The spectrum that linear `rgb` of `space` stands for in `role`.
    pub fn rgb(rgb: [f32; 3], role: Role, space: &'static ColorSpace) -> Self {
        match role {
            Role::Reflectance => Self::rgb_albedo(rgb, space),
            Role::Illuminant => Self::rgb_illuminant(rgb, space),
            Role::Unbounded => Self::rgb_unbounded(rgb, space),
        }
    }

    /// RGB as a reflectance; components are clamped to [0, 1].
    pub fn rgb_albedo(rgb: [f32; 3], space: &'static ColorSpace) -> Self {
        let s = RgbAlbedo::new(rgb, space);
        Self { curve: Curve::RgbAlbedo(s), role: Role::Reflectance, rgb: s.rgb }
    }

    /// RGB of any non-negative size.
    pub fn rgb_unbounded(rgb: [f32; 3], space: &'static ColorSpace) -> Self {
        let s = RgbUnbounded::new(rgb, space);
        Self { curve: Curve::RgbUnbounded(s), role: Role::Unbounded, rgb: s.rgb }
    }

    /// RGB as light: times the illuminant of `space`.
    pub fn rgb_illuminant(rgb: [f32; 3], space: &'static ColorSpace) -> Self {
        let s = RgbIlluminant::new(rgb, space);
        Self { curve: Curve::RgbIlluminant(s), role: Role::Illuminant, rgb: s.color.rgb }
    }

    pub(crate) fn from_table(table: Table, role: Role, space: &'static ColorSpace) -> Self {
        Self::from_curve(Curve::PiecewiseLinear(Arc::new(table)), role, space)
    }

    fn from_curve(curve: Curve, role: Role, space: &'static ColorSpace) -> Self {
        let mut s = Self { curve, role, rgb: [0.0; 3] };
        s.rgb = rgb_of(|l| s.eval(l), role, space);
        s
    }

    /// What form it has.
    pub fn curve(&self) -> &Curve {
        &self.curve
    }

    /// What it is of.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Its linear RGB in the space it was built for or moved to; never negative for colours within the gamut,
    /// and clamped at 0 outside it.
    pub fn to_rgb(&self) -> [f32; 3] {
        self.rgb
    }

    /// The same spectrum whose RGB lanes are of `space`: for a render whose RGB is not the one the author wrote in.
    pub fn in_space(&self, space: &'static ColorSpace) -> Self {
        let rgb = match &self.curve {
            Curve::RgbIlluminant(s) if s.space == space => s.color.rgb,
            Curve::Constant(c) if self.role != Role::Illuminant => [*c; 3],
            _ => rgb_of(|l| self.eval(l), self.role, space),
        };
        Self { rgb, ..self.clone() }
    }

    /// The same spectrum in another role, with RGB lanes of `space`.
    pub fn with_role(&self, role: Role, space: &'static ColorSpace) -> Self {
        Self { role, ..self.clone() }.in_space(space)
    }

    /// Every value times `factor`.
    pub fn scaled(&self, factor: f32) -> Self {
        let unbounded =
            |s: &RgbUnbounded| RgbUnbounded { rgb: s.rgb.map(|v| v * factor), scale: s.scale * factor, ..*s };
        let curve = match &self.curve {
            Curve::Constant(c) => Curve::Constant(c * factor),
            Curve::Dense(v) => Curve::Dense(Arc::new(v.map(|v| v * factor))),
            Curve::PiecewiseLinear(t) => Curve::PiecewiseLinear(Arc::new(t.scaled(factor))),
            Curve::Blackbody(b) => Curve::Blackbody(Blackbody::new(b.temperature, b.scale * factor)),
            Curve::RgbAlbedo(s) => Curve::RgbUnbounded(RgbUnbounded {
                rgb: s.rgb.map(|v| v * factor),
                scale: factor,
                polynomial: s.polynomial,
            }),
            Curve::RgbUnbounded(s) => Curve::RgbUnbounded(unbounded(s)),
            Curve::RgbIlluminant(s) => {
                Curve::RgbIlluminant(RgbIlluminant { color: unbounded(&s.color), space: s.space })
            }
        };
        Self { curve, role: self.role, rgb: self.rgb.map(|v| v * factor) }
    }

    /// The same spectrum tabulated at 1 nm: what pbrt-v4's lights do with any emission, and fast.
    pub fn to_dense(&self) -> Self {
        let values = std::array::from_fn(|i| self.eval(LAMBDA_MIN + i as f32));
        Self { curve: Curve::Dense(Arc::new(values)), role: self.role, rgb: self.rgb }
    }

    /// The value at `lambda` nm.
    pub fn eval(&self, lambda: f32) -> f32 {
        match &self.curve {
            Curve::Constant(c) => *c,
            Curve::Dense(values) => eval_dense(values, lambda),
            Curve::PiecewiseLinear(table) => table.eval(lambda),
            Curve::Blackbody(b) => b.eval(lambda),
            Curve::RgbAlbedo(s) => s.polynomial.eval(lambda),
            Curve::RgbUnbounded(s) => s.scale * s.polynomial.eval(lambda),
            Curve::RgbIlluminant(s) => {
                s.color.scale * s.color.polynomial.eval(lambda) * eval_dense(s.space.illuminant(), lambda)
            }
        }
    }

    /// The values in the lanes of `wavelengths`: at its wavelengths, or as RGB.
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        if wavelengths.basis == Basis::Rgb {
            return lanes(self.rgb);
        }
        match &self.curve {
            Curve::Constant(c) => SampledSpectrum::splat(*c),
            Curve::Dense(values) => sample_dense(values, wavelengths),
            Curve::PiecewiseLinear(table) => {
                // Written out, as `map` would be called.
                let [a, b, c, d] = wavelengths.lambda;
                SampledSpectrum([table.eval(a), table.eval(b), table.eval(c), table.eval(d)])
            }
            Curve::Blackbody(b) => SampledSpectrum(wavelengths.lambda.map(|l| b.eval(l))),
            Curve::RgbAlbedo(s) => s.polynomial.sample(wavelengths),
            Curve::RgbUnbounded(s) => s.polynomial.sample(wavelengths) * s.scale,
            Curve::RgbIlluminant(s) => s.sample(wavelengths),
        }
    }

    /// An upper bound of the value over 360..=830 nm, tight for all but RGB illuminants, and of the RGB lanes.
    pub fn max_value(&self) -> f32 {
        let spectral = match &self.curve {
            Curve::Constant(c) => *c,
            Curve::Dense(values) => largest(&values[..]),
            Curve::PiecewiseLinear(table) => largest(table.values()),
            Curve::Blackbody(b) => b.scale,
            Curve::RgbAlbedo(s) => s.polynomial.max_value(),
            Curve::RgbUnbounded(s) => s.scale * s.polynomial.max_value(),
            Curve::RgbIlluminant(s) => s.color.scale * s.color.polynomial.max_value() * largest(s.space.illuminant()),
        };
        largest(&self.rgb).max(spectral)
    }

    /// Whether the spectrum is a constant, and which: so that callers can skip evaluating it.
    pub fn as_constant(&self) -> Option<f32> {
        match self.curve {
            Curve::Constant(c) => Some(c),
            _ => None,
        }
    }

    /// Whether it depends on wavelength at all (a table of equal values covering 360..=830 nm does not).
    pub fn is_constant(&self) -> bool {
        match &self.curve {
            Curve::Constant(_) => true,
            Curve::Dense(v) => v.iter().all(|x| x == &v[0]),
            Curve::PiecewiseLinear(t) => {
                t.values().iter().all(|x| x == &t.values()[0])
                    && t.eval(LAMBDA_MIN) == t.values()[0]
                    && t.eval(LAMBDA_MAX) == t.values()[0]
            }
            Curve::RgbAlbedo(s) => s.polynomial.is_constant(),
            Curve::RgbUnbounded(s) => s.polynomial.is_constant(),
            Curve::Blackbody(_) | Curve::RgbIlluminant(_) => false,
        }
    }
}

fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(f32::NEG_INFINITY, f32::max)
}

/// Linear RGB of a spectrum in `space`, by its role. Negative components (outside the gamut) become 0.
fn rgb_of(f: impl Fn(f32) -> f32, role: Role, space: &ColorSpace) -> [f32; 3] {
    let white = space.illuminant();
    let xyz = xyz_of(|i| {
        let v = f64::from(f(LAMBDA_MIN + i as f32));
        match role {
            Role::Illuminant => v,
            Role::Reflectance | Role::Unbounded => v * f64::from(white[i]),
        }
    });
    matrix::apply(&space.rgb_from_xyz_exact, xyz).map(|v| v.max(0.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CIE_Y_INTEGRAL, Sensor, named, spectrum_to_photometric, spectrum_to_xyz};

    fn srgb() -> &'static ColorSpace {
        ColorSpace::srgb()
    }

    fn one_of_each() -> Vec<Spectrum> {
        vec![
            Spectrum::constant(0.7, Role::Unbounded, srgb()),
            Spectrum::dense_from_fn(|l| l / 1000.0, Role::Reflectance, srgb()),
            Spectrum::interleaved(&[400.0, 0.2, 500.5, 0.8, 700.0, 0.5], Role::Reflectance, srgb()).unwrap(),
            Spectrum::blackbody(5000.0, Role::Illuminant, srgb()),
            Spectrum::rgb_albedo([0.2, 0.5, 0.1], srgb()),
            Spectrum::rgb_unbounded([2.0, 5.0, 1.0], srgb()),
            Spectrum::rgb_illuminant([20.0, 5.0, 1.0], srgb()),
        ]
    }

    #[test]
    fn sampling_is_evaluation_and_stays_below_the_maximum() {
        for s in one_of_each() {
            for u in 0..50 {
                let w = Wavelengths::sample_uniform(u as f32 / 50.0, 360.0, 830.0);
                let got = s.sample(&w);
                for lane in 0..4 {
                    let v = s.eval(w.lambda[lane]);
                    assert!((got[lane] - v).abs() <= 1e-6 * v.abs(), "{s:?}");
                    assert!(v <= s.max_value() * 1.000_01, "{s:?}");
                }
            }
            let rgb = s.sample(&Wavelengths::rgb());
            assert_eq!([rgb[0], rgb[1], rgb[2], rgb[3]], [s.rgb[0], s.rgb[1], s.rgb[2], s.rgb[1]]);
        }
    }

    #[test]
    fn bad_tables_say_what_is_wrong() {
        let make = |l: &[f32], v: &[f32]| Spectrum::piecewise_linear(l, v, Role::Unbounded, srgb()).err();
        assert_eq!(make(&[], &[]), Some(SpectrumError::Empty));
        assert_eq!(make(&[1.0], &[]), Some(SpectrumError::LengthMismatch(1, 0)));
        assert_eq!(make(&[400.0, 500.0, 500.0], &[0.0; 3]), Some(SpectrumError::NotIncreasing(2)));
        assert_eq!(make(&[400.0, f32::NAN], &[0.0; 2]), Some(SpectrumError::NotIncreasing(1)));
        assert_eq!(make(&[400.0, 500.0], &[0.0, f32::INFINITY]), Some(SpectrumError::NotFinite(1)));
        assert_eq!(
            Spectrum::interleaved(&[400.0], Role::Unbounded, srgb()).err(),
            Some(SpectrumError::LengthMismatch(1, 0))
        );
    }

    #[test]
    fn rgb_light_is_its_rgb_and_white_is_one() {
        for name in ColorSpace::NAMES {
            let space = ColorSpace::named(name).unwrap();
            let white = Spectrum::rgb_illuminant([1.0; 3], space);
            let xyz = spectrum_to_xyz(&white);
            assert!((xyz[1] - 1.0).abs() < 1e-4, "{name}: {xyz:?}");
            assert!((spectrum_to_photometric(&white) / CIE_Y_INTEGRAL - 1.0).abs() < 1e-4);
            // Only the illuminant counts.
            let red = Spectrum::rgb_illuminant([9.0, 1.0, 1.0], space);
            assert_eq!(spectrum_to_photometric(&red), spectrum_to_photometric(&white));
            // The stored RGB is what integrating the spectrum gives.
            let rgb = rgb_of(|l| red.eval(l), Role::Illuminant, space);
            if name == "srgb" {
                for (got, want) in rgb.into_iter().zip([9.0, 1.0, 1.0]) {
                    assert!((got - want).abs() < 0.02, "{rgb:?}");
                }
            }
            // Constants are grey under the space's own white, and the illuminant is (1, 1, 1).
            assert_eq!(Spectrum::constant(0.4, Role::Reflectance, space).to_rgb(), [0.4; 3]);
            let table = Spectrum::dense(space.illuminant(), Role::Illuminant, space);
            for v in table.to_rgb() {
                assert!((v - 1.0).abs() < 1e-4, "{name}: {:?}", table.to_rgb());
            }
        }
    }

    #[test]
    fn a_reflectance_keeps_its_look_in_another_space() {
        let s = Spectrum::rgb_albedo([0.7, 0.3, 0.2], srgb());
        let moved = s.in_space(ColorSpace::rec2020());
        let m = srgb().convert_to(ColorSpace::rec2020());
        for (got, row) in moved.to_rgb().into_iter().zip(m) {
            // Both whites are D65, so moving is the matrix.
            assert!((got - (row[0] * 0.7 + row[1] * 0.3 + row[2] * 0.2)).abs() < 3e-3, "{:?}", moved.to_rgb());
        }
        assert_eq!(moved.eval(500.0), s.eval(500.0));
        for (got, want) in s.in_space(srgb()).to_rgb().into_iter().zip([0.7, 0.3, 0.2]) {
            assert!((got - want).abs() < 2e-3);
        }
    }

    #[test]
    fn scaling_and_tabulating_keep_the_values() {
        for s in one_of_each() {
            let (scaled, dense) = (s.scaled(3.0), s.to_dense());
            for l in (360..=830).step_by(10) {
                let v = s.eval(l as f32);
                assert!((scaled.eval(l as f32) - 3.0 * v).abs() <= 1e-5 * v, "{s:?} {l}");
                assert_eq!(dense.eval(l as f32), v);
            }
            assert!((scaled.to_rgb()[1] - 3.0 * s.to_rgb()[1]).abs() < 1e-4 * s.to_rgb()[1]);
        }
    }

    // Gold must be yellow in the RGB basis.
    #[test]
    fn metals_translate_to_rgb() {
        let (eta, k) = (named("metal-Au-eta").unwrap().to_rgb(), named("metal-Au-k").unwrap().to_rgb());
        let r: [f32; 3] =
            std::array::from_fn(|i| ((eta[i] - 1.0).powi(2) + k[i] * k[i]) / ((eta[i] + 1.0).powi(2) + k[i] * k[i]));
        assert!(r[0] > 0.9 && (0.6..0.9).contains(&r[1]) && (0.2..0.5).contains(&r[2]), "{r:?}");
    }

    #[test]
    fn constants_are_known_as_such() {
        assert_eq!(Spectrum::constant(0.5, Role::Reflectance, srgb()).as_constant(), Some(0.5));
        let flat = |l: [f32; 2]| Spectrum::piecewise_linear(&l, &[2.0, 2.0], Role::Unbounded, srgb()).unwrap();
        assert!(flat([300.0, 900.0]).is_constant() && !flat([400.0, 900.0]).is_constant());
        assert!(Spectrum::rgb_albedo([0.3; 3], srgb()).is_constant());
        assert!(!Spectrum::rgb_albedo([0.3, 0.3, 0.4], srgb()).is_constant());
    }

    // A Monte Carlo estimate by the path of a render: 20,000 fixed stratified draws. Its error is below 2e-4,
    // so a bias of 5e-4 is seen; nothing is random, so there are no false alarms.
    #[test]
    fn d65_reaches_the_film_as_its_xyz() {
        let d65 = named("stdillum-D65").unwrap().to_dense();
        let sensor = Sensor::cie1931();
        for terminate in [false, true] {
            let mut sum = [0.0f64; 3];
            let n = 20_000;
            for i in 0..n {
                let mut w = Wavelengths::sample_visible((i as f32 + 0.5) / n as f32);
                if terminate {
                    w.terminate_secondary();
                }
                let rgb = sensor.to_rgb(d65.sample(&w) / CIE_Y_INTEGRAL, &w);
                for c in 0..3 {
                    sum[c] += f64::from(rgb[c]) / f64::from(n);
                }
            }
            let exact = spectrum_to_xyz(&d65);
            for c in 0..3 {
                // The film integrates over [360, 830]; the sums have half a nanometre more at either end, where all is dark.
                assert!((sum[c] / exact[c] - 1.0).abs() < 5e-4, "{sum:?} for {exact:?}");
            }
        }
    }
}
