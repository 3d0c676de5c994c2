//! The wavelengths a path carries, how they are drawn, and when all but the first end.
//!
//! Drawing is pbrt-v4's: one stratified sample rotated into four, by a density close to the eye's
//! sensitivity (Radziszewski, Boryczko and Alda 2009, "An improved technique for full spectral
//! rendering", J. WSCG 17, with the constants of pbrt-v4 `SampleVisibleWavelengths`).

use crate::elementary::{exp, ln};
use crate::{LAMBDA_MAX, LAMBDA_MIN, N_WAVELENGTHS, SampledSpectrum};

/// What the lanes of a [`SampledSpectrum`] mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Each lane is a wavelength in nm.
    Spectral,
    /// Lanes are linear red, green, blue in the render's colour space; lane 3 repeats green,
    /// so that arithmetic on it is never NaN unless it is NaN elsewhere. It never reaches the film.
    Rgb,
}

/// The wavelengths of one path and the density, per nm, with which each was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelengths {
    /// nm. In the RGB basis nominal wavelengths of the primaries.
    pub lambda: [f32; N_WAVELENGTHS],
    /// 1/nm; 0 for a terminated lane. 1 in the RGB basis.
    pub pdf: [f32; N_WAVELENGTHS],
    /// What the lanes mean.
    pub basis: Basis,
}

/// The hyperbolic tangent that `u` chooses, by which the visible-weighted density is uniform.
#[inline(always)]
fn visible_height(u: f32) -> f32 {
    0.856_910_62 - 1.827_502 * u
}

/// A wavelength in nm by the visible-weighted density, from `u` in [0, 1].
#[inline]
pub fn sample_visible_wavelength(u: f32) -> f32 {
    // atanh(y) = ln((1 + y) / (1 - y)) / 2; |y| < 0.971 here, so neither end loses digits.
    let y = visible_height(u);
    538.0 - 138.888_89 * 0.5 * ln((1.0 + y) / (1.0 - y))
}

/// The density, per nm, of [`sample_visible_wavelength`]; 0 outside [360, 830] nm.
#[inline]
pub fn visible_wavelength_pdf(lambda: f32) -> f32 {
    if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
        return 0.0;
    }
    // 1 / cosh(x)^2 = 4 e / (1 + e)^2 with e = exp(-2 |x|), which cannot overflow.
    let e = exp(-2.0 * (0.0072 * (lambda - 538.0)).abs());
    0.003_939_804_2 * 4.0 * e / ((1.0 + e) * (1.0 + e))
}

impl Wavelengths {
    /// Four wavelengths by the visible-weighted density, from one `u` in [0, 1): `u + i/4`, wrapped.
    ///
    /// Each wavelength alone has density `pdf`; together they are stratified.
    #[inline]
    pub fn sample_visible(u: f32) -> Self {
        let rotated: [f32; N_WAVELENGTHS] = std::array::from_fn(|i| {
            let rotated = u + i as f32 / N_WAVELENGTHS as f32;
            if rotated > 1.0 { rotated - 1.0 } else { rotated }
        });
        // As sample_visible_wavelength, lane by lane in each step, which LLVM makes packed instructions of (4 times
        // faster): ln of (1 + y) / (1 - y) = 2^k m, with m in [sqrt(1/2), sqrt(2)), as k ln 2 + 2 atanh((m - 1) / (m + 1)).
        const SQRT_HALF: u32 = 0x3f35_04f3;
        let y = rotated.map(visible_height);
        let ratio = y.map(|y| ((1.0 + y) / (1.0 - y)).to_bits().wrapping_sub(SQRT_HALF));
        let k = ratio.map(|bits| ((bits as i32) >> 23) as f32);
        let m = ratio.map(|bits| f32::from_bits((bits & 0x007f_ffff).wrapping_add(SQRT_HALF)));
        let s = m.map(|m| (m - 1.0) / (m + 1.0));
        // Series to s^9, |s| < 0.172: error 1e-9.
        let half_ln: [f32; N_WAVELENGTHS] = std::array::from_fn(|i| {
            let (s, z) = (s[i], s[i] * s[i]);
            let tail = z * (0.333_333_33 + z * (0.2 + z * (0.142_857_14 + z * 0.111_111_11)));
            k[i] * (0.5 * std::f32::consts::LN_2) + (s + s * tail)
        });
        // Rounding may step a hair outside the range, where the pdf would be 0.
        let lambda = half_ln.map(|h| (538.0 - 138.888_89 * h).clamp(LAMBDA_MIN, LAMBDA_MAX));
        // 1 / cosh(atanh y)^2 = 1 - y^2: visible_wavelength_pdf without its exponential.
        let pdf = y.map(|y| 0.003_939_804_2 * (1.0 - y) * (1.0 + y));
        Self { lambda, pdf, basis: Basis::Spectral }
    }

    /// Four wavelengths uniformly in `[lo, hi]` nm, from one `u` in [0, 1): equally spaced, wrapped.
    #[inline]
    pub fn sample_uniform(u: f32, lo: f32, hi: f32) -> Self {
        let mut lambda = [0.0; N_WAVELENGTHS];
        let step = (hi - lo) / N_WAVELENGTHS as f32;
        for i in 0..N_WAVELENGTHS {
            let l = lo + u * (hi - lo) + i as f32 * step;
            lambda[i] = if l > hi { lo + (l - hi) } else { l };
        }
        Self { lambda, pdf: [1.0 / (hi - lo); N_WAVELENGTHS], basis: Basis::Spectral }
    }

    /// The RGB basis: lanes r, g, b and a copy of g.
    #[inline]
    pub const fn rgb() -> Self {
        Self { lambda: [611.4, 549.1, 464.3, 549.1], pdf: [1.0; N_WAVELENGTHS], basis: Basis::Rgb }
    }

    /// The densities as a spectrum, 1/nm.
    #[inline]
    pub fn pdf(&self) -> SampledSpectrum {
        SampledSpectrum(self.pdf)
    }

    /// End all wavelengths but the first, whose density is divided by [`N_WAVELENGTHS`].
    ///
    /// For events at which wavelengths part ways (dispersion). The film, which averages the lanes over
    /// their densities, stays unbiased: the first lane now stands for all. Does nothing the second
    /// time, nor in the RGB basis (dispersion is then done at green's index for all).
    #[inline]
    pub fn terminate_secondary(&mut self) {
        if self.basis == Basis::Rgb || self.secondary_terminated() {
            return;
        }
        self.pdf = [self.pdf[0] / N_WAVELENGTHS as f32, 0.0, 0.0, 0.0];
    }

    /// Whether only the first wavelength is still carried.
    #[inline]
    pub fn secondary_terminated(&self) -> bool {
        self.pdf[1] == 0.0 && self.pdf[2] == 0.0 && self.pdf[3] == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of `L(lambda) / pdf` over `n` equally spaced draws, by one way of drawing.
    fn integral(n: usize, draw: impl Fn(f32) -> Wavelengths, f: impl Fn(f32) -> f64) -> f64 {
        let mut sum = 0.0;
        for i in 0..n {
            let w = draw((i as f32 + 0.5) / n as f32);
            for lane in 0..N_WAVELENGTHS {
                if w.pdf[lane] > 0.0 {
                    sum += f(w.lambda[lane]) / f64::from(w.pdf[lane]);
                }
            }
        }
        sum / (n * N_WAVELENGTHS) as f64
    }

    // A quadrature with 20,000 nodes, not a random test: an error of 1e-4 in the density is seen.
    #[test]
    fn four_lanes_are_four_single_wavelengths() {
        for i in 0..100_000 {
            let u = i as f32 / 100_000.0;
            let w = Wavelengths::sample_visible(u);
            for k in 0..N_WAVELENGTHS {
                let rotated = u + k as f32 / N_WAVELENGTHS as f32;
                let single = sample_visible_wavelength(if rotated > 1.0 { rotated - 1.0 } else { rotated });
                assert!((w.lambda[k] - single).abs() < 2e-4, "{u} {k}: {} {single}", w.lambda[k]);
                let pdf = visible_wavelength_pdf(w.lambda[k]);
                assert!((w.pdf[k] / pdf - 1.0).abs() < 2e-5, "{u} {k}: {} {pdf}", w.pdf[k]);
            }
        }
    }

    #[test]
    fn every_way_of_drawing_integrates_alike() {
        let f = |l: f32| (-((f64::from(l) - 560.0) / 60.0).powi(2)).exp();
        let exact: f64 = (0..470_000).map(|i| f(360.0005 + i as f32 * 0.001) * 0.001).sum();
        let visible = integral(20_000, Wavelengths::sample_visible, f);
        let uniform = integral(20_000, |u| Wavelengths::sample_uniform(u, 360.0, 830.0), f);
        let terminated = integral(
            20_000,
            |u| {
                let mut w = Wavelengths::sample_visible(u);
                w.terminate_secondary();
                w
            },
            f,
        );
        for (name, got) in [("visible", visible), ("uniform", uniform), ("terminated", terminated)] {
            assert!((got / exact - 1.0).abs() < 1e-4, "{name}: {got} for {exact}");
        }
    }

    // 400,000 independent draws, 100,000 by each lane, in 47 cells of 10 nm. A density 2 % off in half of the samples is
    // seen; false-alarm rate 1e-6.
    #[test]
    fn wavelengths_follow_their_density() {
        let mut counts = [0u64; 47];
        let mut rng = irradiant_testkit::Rng::new(1);
        for i in 0..400_000 {
            let lambda = Wavelengths::sample_visible(rng.next_f32()).lambda[i % 4];
            counts[(((lambda - 360.0) / 10.0) as usize).min(46)] += 1;
        }
        let probabilities: Vec<f64> = (0..47)
            .map(|cell| {
                let pdf = |l: f64| f64::from(visible_wavelength_pdf(l as f32));
                let left = 360.0 + f64::from(cell) * 10.0;
                irradiant_testkit::integrate_interval(pdf, left, left + 10.0, 1e-7)
            })
            .collect();
        let report = irradiant_testkit::chi2_counts(&counts, &probabilities);
        assert!((report.integral - 1.0).abs() < 1e-4, "{report:?}");
        assert!(report.detectable_ratio(1e-6) < 0.025, "{}", report.detectable_ratio(1e-6));
        report.assert_above(1e-6, "visible wavelengths");
    }

    #[test]
    fn draws_stay_in_range_at_both_ends() {
        for u in [0.0, 1e-7, 0.25, 0.5, 0.75, 0.999_999_94] {
            let w = Wavelengths::sample_visible(u);
            assert!(w.lambda.iter().all(|l| (LAMBDA_MIN..=LAMBDA_MAX).contains(l)), "{w:?}");
            assert!(w.pdf.iter().all(|&p| p > 0.0), "{w:?}");
        }
    }

    #[test]
    fn ending_the_secondary_wavelengths_happens_once_and_only_spectrally() {
        let mut w = Wavelengths::sample_visible(0.3);
        let hero = w.pdf[0];
        assert!(!w.secondary_terminated());
        w.terminate_secondary();
        w.terminate_secondary();
        assert!(w.secondary_terminated());
        assert_eq!(w.pdf, [hero / 4.0, 0.0, 0.0, 0.0]);
        let mut rgb = Wavelengths::rgb();
        rgb.terminate_secondary();
        assert_eq!(rgb, Wavelengths::rgb());
    }
}
