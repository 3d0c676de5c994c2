//! Spectra of light sources given by a temperature: black bodies and daylight.

use crate::elementary::exp;
use crate::stored::{Role, Spectrum};
use crate::table::Table;
use crate::{CIE_Y_INTEGRAL, ColorSpace};

/// Radiance emitted by a black body, W / (m^2 sr m), at `lambda` nm and `temperature` K; 0 for `temperature` <= 0.
///
/// Planck's law with the constants of pbrt-v4 (CODATA 2010). `f64`; for tables, not for transport.
pub fn blackbody(lambda: f64, temperature: f64) -> f64 {
    if temperature <= 0.0 {
        return 0.0;
    }
    const C: f64 = 299_792_458.0;
    const H: f64 = 6.626_069_57e-34;
    const KB: f64 = 1.380_648_8e-23;
    let l = lambda * 1e-9;
    let exponent = (H * C) / (l * KB * temperature);
    (2.0 * H * C * C) / (l * l * l * l * l * (f64::from(exp(exponent as f32)) - 1.0))
}

/// A black body, normalised to 1 at its peak, times `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blackbody {
    /// K.
    pub temperature: f32,
    /// What multiplies the normalised spectrum.
    pub scale: f32,
    /// Second radiation constant over temperature, nm.
    c2_over_t: f32,
    /// Makes the peak `scale`: (um)^5.
    factor: f32,
}

impl Blackbody {
    pub(crate) fn new(temperature: f32, scale: f32) -> Self {
        let temperature = temperature.max(0.0);
        let c2_over_t = 1.438_776_9e7 / f64::from(temperature);
        // Wien: the peak lies where c2 / (lambda T) = 4.965114.
        let peak = 2.897_772_1e-3 / f64::from(temperature) * 1e6;
        let factor = f64::from(scale) * peak.powi(5) * (f64::from(exp((c2_over_t / (peak * 1e3)) as f32)) - 1.0);
        if temperature > 0.0 && factor.is_finite() {
            Self { temperature, scale, c2_over_t: c2_over_t as f32, factor: factor as f32 }
        } else {
            Self { temperature, scale, c2_over_t: 0.0, factor: 0.0 }
        }
    }

    #[inline]
    pub(crate) fn eval(&self, lambda: f32) -> f32 {
        if self.factor == 0.0 {
            return 0.0;
        }
        let um = lambda * 1e-3;
        let um2 = um * um;
        self.factor / (um2 * um2 * um * (exp(self.c2_over_t / lambda) - 1.0))
    }
}

/// The daylight of correlated colour temperature `temperature` K, normalised like pbrt-v4's: a CIE D series
/// spectrum above 4000 K, below it a black body of unit luminance. 0.01 of the D series' usual scale.
pub fn daylight(temperature: f32, space: &'static ColorSpace) -> Spectrum {
    use crate::data::illuminants::{S0, S1, S2};
    // c2 was revised from 1.4380 to 1.4388 cm K after the D series was named.
    let cct = f64::from(temperature) * 1.4388 / 1.4380;
    if cct < 4000.0 {
        let black = Spectrum::blackbody(cct as f32, Role::Illuminant, space).to_dense();
        let y = crate::spectrum_to_photometric(&black);
        return if y > 0.0 { black.scaled(CIE_Y_INTEGRAL / y) } else { black };
    }
    // CIE 15:2004, equations 3.3 to 3.5.
    let x = if cct <= 7000.0 {
        -4.607e9 / (cct * cct * cct) + 2.9678e6 / (cct * cct) + 0.09911e3 / cct + 0.244_063
    } else {
        -2.0064e9 / (cct * cct * cct) + 1.9018e6 / (cct * cct) + 0.24748e3 / cct + 0.23704
    };
    let y = -3.0 * x * x + 2.87 * x - 0.275;
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    let m1 = (-1.3515 - 1.7703 * x + 5.9114 * y) / m;
    let m2 = (0.03 - 31.4424 * x + 30.0717 * y) / m;
    let lambda: Vec<f32> = (0..S0.len()).map(|i| 300.0 + 5.0 * i as f32).collect();
    let values: Vec<f32> = (0..S0.len())
        .map(|i| ((f64::from(S0[i]) + f64::from(S1[i]) * m1 + f64::from(S2[i]) * m2) * 0.01) as f32)
        .collect();
    Spectrum::from_table(Table::new(&lambda, &values), Role::Illuminant, space).to_dense()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{named, spectrum_to_xyz};

    fn srgb() -> &'static ColorSpace {
        ColorSpace::srgb()
    }

    #[test]
    fn blackbodies_peak_at_one_and_follow_planck() {
        let s = Spectrum::blackbody(5000.0, Role::Illuminant, srgb());
        assert!((s.eval(579.55) - 1.0).abs() < 1e-5);
        for l in [400.0f64, 800.0] {
            let planck = blackbody(l, 5000.0) / blackbody(579.554_42, 5000.0);
            assert!((f64::from(s.eval(l as f32)) / planck - 1.0).abs() < 1e-4, "{l}");
        }
        assert_eq!(Spectrum::blackbody(0.0, Role::Illuminant, srgb()).eval(500.0), 0.0);
        assert_eq!(Spectrum::blackbody(-5.0, Role::Illuminant, srgb()).eval(500.0), 0.0);
        assert!(Spectrum::blackbody(100.0, Role::Illuminant, srgb()).eval(400.0).is_finite());
    }

    // D65 at 5003 and 6504 K within the rounding of the published tables.
    #[test]
    fn daylight_is_the_d_series() {
        let d65 = named("stdillum-D65").unwrap();
        let made = daylight(6500.0, srgb());
        for l in (360..=830).step_by(10) {
            let (a, b) = (d65.eval(l as f32) / d65.eval(560.0), made.eval(l as f32));
            assert!((a - b).abs() < 3e-3, "{l}: {a} {b}");
        }
        let cool = spectrum_to_xyz(&daylight(10_000.0, srgb()));
        assert!((cool[0] / cool.iter().sum::<f64>() - 0.2788).abs() < 1e-3);
        let warm = spectrum_to_xyz(&daylight(2856.0, srgb()));
        assert!((warm[1] - 1.0).abs() < 1e-4 && (warm[0] / warm.iter().sum::<f64>() - 0.4476).abs() < 2e-3);
    }
}
