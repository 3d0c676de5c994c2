//! What happens at an ideal interface: reflection and refraction of directions, and how much light takes each way.
//!
//! Unpolarised light throughout. Directions point away from the surface. Knows nothing of roughness.
//! Sources: Fresnel's equations in the form of Lagarde 2013, "Memo on Fresnel equations"; thin films by the Airy sum
//! (Born and Wolf, "Principles of Optics", 7.6; Belcour and Barla 2017, "A practical extension to microfacet theory
//! for the modeling of varying iridescence", of which only the per-wavelength reflectance is needed here).

use irradiant_math::Vec3;
use irradiant_math::elementary::sin_cos;
use irradiant_spectrum::SampledSpectrum;

/// The mirror direction of `w` about the unit vector `n`; both point away from the surface.
#[inline]
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * w.dot(n)) - w
}

/// The refracted direction of `w` at a facet with unit normal `n`, and the relative index met on the way.
///
/// `eta` is the index on the side opposite `n` over the index on the side of `n`. The second value is
/// transmitted over incident index: `eta` when `w` is on the side of `n`, else `1/eta`. `None` on total reflection.
#[inline]
pub fn refract(w: Vec3, n: Vec3, eta: f32) -> Option<(Vec3, f32)> {
    let cos_i = w.dot(n);
    let (cos_i, n, eta) = if cos_i < 0.0 { (-cos_i, -n, 1.0 / eta) } else { (cos_i, n, eta) };
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let inverse = 1.0 / eta;
    Some((n * (cos_i * inverse - cos_t) - w * inverse, eta))
}

/// The fraction of light reflected at a dielectric interface, in [0, 1].
///
/// `cos_i` is signed: positive on the side of the normal. `eta` is the index below over that above the normal.
/// 1 at grazing incidence and beyond the critical angle.
#[inline]
pub fn fresnel_dielectric(cos_i: f32, eta: f32) -> f32 {
    let (cos_i, eta) = if cos_i > 0.0 { (cos_i, eta) } else { (-cos_i, 1.0 / eta) };
    let cos_i = cos_i.min(1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    // (a/b)^2 + (c/d)^2 with one division.
    let (a, b) = (eta * cos_i - cos_t, eta * cos_i + cos_t);
    let (c, d) = (cos_i - eta * cos_t, cos_i + eta * cos_t);
    let (ad, bc, bd) = (a * d, b * c, b * d);
    0.5 * (ad * ad + bc * bc) / (bd * bd)
}

/// The fraction of light reflected by a conductor of index `eta + i k` relative to the outside, per lane, in [0, 1].
///
/// `cos_i` in [0, 1], from the facet normal.
#[inline(always)]
pub fn fresnel_conductor(cos_i: f32, eta: SampledSpectrum, k: SampledSpectrum) -> SampledSpectrum {
    // Written out: loops over lanes are not taken for vectors inside loops over paths.
    let at = |lane: usize| fresnel_conductor_at(cos_i, eta.0[lane], k.0[lane]);
    SampledSpectrum([at(0), at(1), at(2), at(3)])
}

/// As [`fresnel_conductor`], of one lane.
#[inline(always)]
pub fn fresnel_conductor_at(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    let (eta2, k2) = (eta * eta, k * k);
    // (a + i b)^2 = (eta + i k)^2 - sin^2: a cos-like pair inside the metal.
    let t = eta2 - k2 - sin2;
    let a2_plus_b2 = (t * t + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (a2_plus_b2 + t)).max(0.0).sqrt();
    let (p, q) = (a2_plus_b2 + cos2, 2.0 * cos_i * a);
    let perpendicular = (p - q) / (p + q);
    let (p, q) = (cos2 * a2_plus_b2 + sin2 * sin2, q * sin2);
    0.5 * perpendicular * (1.0 + (p - q) / (p + q))
}

/// One transparent film on an opaque base: its reflectance interferes, so it depends on wavelength and angle.
///
/// Build once per hit with [`ThinFilm::new`]; evaluate per angle with [`ThinFilm::reflectance`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinFilm {
    /// Index of the film over that of the outside.
    film_eta: SampledSpectrum,
    /// Real and imaginary index of the base over that of the outside.
    base_eta: SampledSpectrum,
    base_k: SampledSpectrum,
    /// Radians of round-trip phase at normal incidence, `4 pi n d / lambda`.
    phase: SampledSpectrum,
}

#[derive(Clone, Copy)]
struct Complex {
    re: f32,
    im: f32,
}

impl Complex {
    #[inline]
    fn new(re: f32, im: f32) -> Self {
        Self { re, im }
    }

    #[inline]
    fn add(self, b: Self) -> Self {
        Self::new(self.re + b.re, self.im + b.im)
    }

    #[inline]
    fn sub(self, b: Self) -> Self {
        Self::new(self.re - b.re, self.im - b.im)
    }

    #[inline]
    fn mul(self, b: Self) -> Self {
        Self::new(self.re * b.re - self.im * b.im, self.re * b.im + self.im * b.re)
    }

    #[inline]
    fn norm(self) -> f32 {
        self.re * self.re + self.im * self.im
    }

    #[inline]
    fn div(self, b: Self) -> Self {
        let n = b.norm();
        let c = self.mul(Self::new(b.re, -b.im));
        Self::new(c.re / n, c.im / n)
    }

    /// The root with non-negative real part.
    #[inline]
    fn sqrt(self) -> Self {
        let modulus = self.norm().sqrt();
        let re = (0.5 * (modulus + self.re)).max(0.0).sqrt();
        let im = (0.5 * (modulus - self.re)).max(0.0).sqrt();
        Self::new(re, if self.im < 0.0 { -im } else { im })
    }
}

impl ThinFilm {
    /// The film at four wavelengths: `thickness` and `lambda` in nm; indices absolute, outside included.
    ///
    /// `film_eta`, `base_eta` and `base_k` are per lane, `outside` is the index above the film (1 for air, the coat's
    /// under a coat). Thickness 0 is the bare base.
    pub fn new(
        thickness: f32,
        film_eta: SampledSpectrum,
        base_eta: SampledSpectrum,
        base_k: SampledSpectrum,
        outside: f32,
        lambda: [f32; 4],
    ) -> Self {
        Self {
            film_eta: film_eta / outside,
            base_eta: base_eta / outside,
            base_k: base_k / outside,
            phase: SampledSpectrum::from_fn(|i| {
                4.0 * std::f32::consts::PI * film_eta[i] * thickness.max(0.0) / lambda[i]
            }),
        }
    }

    /// The fraction of light reflected at incidence `cos_i` in [0, 1], per lane, in [0, 1].
    ///
    /// All orders of reflection within the film are summed (Airy). Beyond the critical angle of the film, 1.
    #[inline]
    pub fn reflectance(&self, cos_i: f32) -> SampledSpectrum {
        let cos_i = cos_i.clamp(0.0, 1.0);
        let sin2 = 1.0 - cos_i * cos_i;
        SampledSpectrum::from_fn(|i| {
            let n1 = self.film_eta[i];
            let cos_1 = (1.0 - sin2 / (n1 * n1)).max(0.0).sqrt();
            if cos_1 == 0.0 {
                return 1.0;
            }
            // Inside the base cos is complex; n cos = sqrt(n^2 - sin^2) with the decaying root.
            let n2 = Complex::new(self.base_eta[i], self.base_k[i]);
            let n2_squared = n2.mul(n2);
            let n2_cos = n2_squared.sub(Complex::new(sin2, 0.0)).sqrt();
            let (sin_phase, cos_phase) = sin_cos(self.phase[i] * cos_1);
            let turn = Complex::new(cos_phase, sin_phase);
            let airy = |r01: f32, r12: Complex| {
                let back = r12.mul(turn);
                let top = Complex::new(r01, 0.0).add(back);
                let bottom = Complex::new(1.0, 0.0).add(Complex::new(r01 * back.re, r01 * back.im));
                top.norm() / bottom.norm()
            };
            // Perpendicular.
            let n1_cos = Complex::new(n1 * cos_1, 0.0);
            let r01 = (cos_i - n1 * cos_1) / (cos_i + n1 * cos_1);
            let perpendicular = airy(r01, n1_cos.sub(n2_cos).div(n1_cos.add(n2_cos)));
            // Parallel: n2^2 n1 cos1 against n1^2 n2 cos2.
            let p = n2_squared.mul(n1_cos);
            let q = Complex::new(n1 * n1 * n2_cos.re, n1 * n1 * n2_cos.im);
            let r01 = (n1 * cos_i - cos_1) / (n1 * cos_i + cos_1);
            let parallel = airy(r01, p.sub(q).div(p.add(q)));
            (0.5 * (perpendicular + parallel)).clamp(0.0, 1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refraction_obeys_snell_and_is_reversible() {
        for eta in [1.5, 1.0 / 1.5, 2.4, 1.0] {
            for (x, z) in [(0.0, 1.0), (0.6, 0.8), (0.6, -0.8), (-0.3, 0.5)] {
                let w = Vec3::new(x, 0.1, z).normalize();
                let n = Vec3::new(0.1, -0.2, 1.0).normalize();
                let Some((t, ratio)) = refract(w, n, eta) else {
                    assert_eq!(fresnel_dielectric(w.dot(n), eta), 1.0);
                    continue;
                };
                assert!((t.length() - 1.0).abs() < 1e-5);
                assert!((w.cross(n).length() - ratio * t.cross(n).length()).abs() < 1e-5);
                assert!(t.dot(n) * w.dot(n) < 0.0);
                let (back, _) = refract(t, n, eta).unwrap();
                assert!((back - w).length() < 1e-5);
                // Stokes: both sides reflect alike along conjugate directions.
                let (a, b) = (fresnel_dielectric(w.dot(n), eta), fresnel_dielectric(t.dot(n), eta));
                assert!((a - b).abs() < 1e-5, "{a} {b}");
            }
        }
    }

    #[test]
    fn known_reflectances() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
        assert_eq!(fresnel_dielectric(0.0, 1.5), 1.0);
        assert_eq!(fresnel_dielectric(-0.5, 1.5), 1.0);
        // Brewster's angle: only the perpendicular half is left.
        let brewster = 1.0 / (1.0f32 + 1.5 * 1.5).sqrt();
        let perpendicular = ((1.0 - 2.25) / (1.0 + 2.25f32)).powi(2);
        assert!((fresnel_dielectric(brewster, 1.5) - 0.5 * perpendicular).abs() < 1e-6);
        // Silver near 550 nm, ((n-1)^2 + k^2) / ((n+1)^2 + k^2).
        let f = fresnel_conductor(1.0, SampledSpectrum::splat(0.055), SampledSpectrum::splat(3.32));
        let exact = (0.945f32.powi(2) + 3.32f32.powi(2)) / (1.055f32.powi(2) + 3.32f32.powi(2));
        assert!((f[2] - exact).abs() < 1e-5);
        assert_eq!(fresnel_conductor(0.0, SampledSpectrum::ONE, SampledSpectrum::ONE), SampledSpectrum::ONE);
        // Without absorption a conductor is a dielectric.
        for cos_i in [0.1, 0.5, 0.9] {
            let f = fresnel_conductor(cos_i, SampledSpectrum::splat(1.5), SampledSpectrum::ZERO);
            assert!((f[0] - fresnel_dielectric(cos_i, 1.5)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_film_of_no_thickness_is_not_there() {
        let (eta, k) = (SampledSpectrum([0.2, 0.9, 1.1, 2.5]), SampledSpectrum([3.9, 2.4, 2.1, 0.0]));
        let film = ThinFilm::new(0.0, SampledSpectrum::splat(1.7), eta, k, 1.0, [450.0, 550.0, 600.0, 650.0]);
        for cos_i in [1.0, 0.7, 0.3, 0.05] {
            let (a, b) = (film.reflectance(cos_i), fresnel_conductor(cos_i, eta, k));
            for lane in 0..4 {
                assert!((a[lane] - b[lane]).abs() < 2e-5, "{cos_i} {a:?} {b:?}");
            }
        }
    }

    // Born and Wolf: a quarter-wave film of index n on glass N reflects ((N - n^2)/(N + n^2))^2; a half wave is absent.
    #[test]
    fn quarter_and_half_wave_films() {
        let (n, glass) = (1.38f32, 1.52f32);
        let quarter = 550.0 / (4.0 * n);
        let film = ThinFilm::new(
            quarter,
            SampledSpectrum::splat(n),
            SampledSpectrum::splat(glass),
            SampledSpectrum::ZERO,
            1.0,
            [550.0, 275.0, 550.0, 275.0],
        );
        let r = film.reflectance(1.0);
        let exact = ((glass - n * n) / (glass + n * n)).powi(2);
        assert!((r[0] - exact).abs() < 1e-6, "{r:?} {exact}");
        assert!((r[1] - ((glass - 1.0) / (glass + 1.0)).powi(2)).abs() < 1e-6);
    }
}
