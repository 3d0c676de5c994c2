//! The reflection equation by two roads (A20): Lr = integral of f Li cos, by Monte Carlo with the model's own sampling and by
//! quadrature, for five models under four skies.

use super::Tally;
use irradiant_core::bxdf::{
    Bxdf, Coat, Conductor, Diffuse, Ggx, GlossyPaint, Retroreflective, Sides, ThinFilm, ThinFilmPaint, TransportMode,
};
use irradiant_math::elementary::{cos, sin};
use irradiant_math::hash::Pcg32;
use irradiant_math::{Point2, Vec3};
use irradiant_spectrum::SampledSpectrum;
use std::f64::consts::PI;

/// Incident radiance over the hemisphere, in the local frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sky {
    /// 1 everywhere.
    Even,
    /// Brighter towards the zenith: 1 + 2 cos.
    Overcast,
    /// Bright on one side: (1 + x)^2.
    Window,
    /// A soft sun: a bump of about 20 degrees around a direction, over a dim sky.
    Sun,
}

impl Sky {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Even, Self::Overcast, Self::Window, Self::Sun];

    /// Radiance from direction `w`, unit.
    pub fn radiance(self, w: Vec3) -> f64 {
        let sun = Vec3::new(-0.5, 0.3, 0.812_403_84);
        match self {
            Self::Even => 1.0,
            Self::Overcast => 1.0 + 2.0 * f64::from(w.z.max(0.0)),
            Self::Window => f64::from((1.0 + w.x) * (1.0 + w.x)),
            Self::Sun => 0.1 + 30.0 * f64::from(w.dot(sun).max(0.0)).powi(24),
        }
    }
}

/// The five models: matt, metal, lacquer, road sign, interference paint. Smooth enough for quadrature, rough enough for
/// sampling to matter.
pub fn models() -> Vec<(&'static str, Bxdf)> {
    let splat = SampledSpectrum::splat;
    let gold = Conductor::new(
        SampledSpectrum([1.4, 0.9, 0.3, 0.2]),
        SampledSpectrum([1.9, 2.2, 2.9, 3.6]),
        Ggx::new(0.35, 0.35),
    );
    let film = ThinFilm::new(450.0, splat(1.9), splat(1.0), splat(6.5), 1.0, [430.0, 500.0, 580.0, 660.0]);
    vec![
        ("diffuse", Bxdf::Diffuse(Diffuse::new(SampledSpectrum([0.2, 0.4, 0.6, 0.8])))),
        ("rough gold", Bxdf::Conductor(gold)),
        ("glossy paint", Bxdf::GlossyPaint(GlossyPaint::new(&Coat::lossless(1.5, 0.4), splat(0.6)))),
        ("road sign", Bxdf::Retroreflective(Retroreflective::new(splat(0.7), splat(0.4), Ggx::new(0.3, 0.3)))),
        ("thin-film paint", Bxdf::ThinFilmPaint(ThinFilmPaint::new(film, Ggx::new(0.4, 0.4), None))),
    ]
}

/// One (BRDF, sky) pair.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Name of the model.
    pub model: &'static str,
    /// The sky.
    pub sky: Sky,
    /// Reflected radiance by Monte Carlo, averaged over four wavelengths, and its standard error.
    pub monte_carlo: (f64, f64),
    /// Samples that were not finite and are left out; 0 of a right model.
    pub refused: u64,
    /// By quadrature, and by how much halving its steps still changed it.
    pub quadrature: (f64, f64),
}

impl Pair {
    /// Their difference in standard errors, what quadrature does not know included; infinite where samples were refused.
    pub fn z(&self) -> f64 {
        if self.refused > 0 {
            return f64::INFINITY;
        }
        (self.monte_carlo.0 - self.quadrature.0) / self.monte_carlo.1.hypot(self.quadrature.1)
    }
}

/// All twenty pairs, seen from `wo` (local, above the surface).
pub fn reflection_pairs(wo: Vec3, samples: u32, seed: u64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (model, bxdf) in models() {
        for (i, sky) in Sky::ALL.into_iter().enumerate() {
            let mut random = Pcg32::new(seed, i as u64);
            let mut tally = Tally::<1>::default();
            for _ in 0..samples {
                let (lobe, u) = (random.next_f32(), Point2::new(random.next_f32(), random.next_f32()));
                let sample = bxdf.sample(wo, lobe, u, TransportMode::Radiance, Sides::All);
                tally
                    .add([sample
                        .map_or(0.0, |s| f64::from((s.f * (s.wi.z.abs() / s.pdf)).average()) * sky.radiance(s.wi))]);
            }
            let (coarse, fine) = (quadrature(&bxdf, wo, sky, 96), quadrature(&bxdf, wo, sky, 192));
            let monte_carlo = (tally.mean()[0], tally.error()[0]);
            pairs.push(Pair {
                model,
                sky,
                monte_carlo,
                refused: tally.refused(),
                quadrature: (fine, (fine - coarse).abs()),
            });
        }
    }
    pairs
}

/// The midpoint rule in (theta, phi).
fn quadrature(bxdf: &Bxdf, wo: Vec3, sky: Sky, n: u32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n {
        let t = (f64::from(i) + 0.5) / f64::from(n);
        let theta = (0.5 * PI * t) as f32;
        let (sin_theta, cos_theta) = (sin(theta), cos(theta));
        for j in 0..2 * n {
            let phi = (PI * (f64::from(j) + 0.5) / f64::from(n)) as f32;
            let w = Vec3::new(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta);
            let f = bxdf.f(wo, w, TransportMode::Radiance).average();
            sum += f64::from(f * cos_theta * sin_theta) * sky.radiance(w);
        }
    }
    sum * (0.5 * PI / f64::from(n)) * (PI / f64::from(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A20. 100,000 samples: standard errors of up to 1.4 % (under the sun), so that a bias of 10 % in any pair is seen; 4.9
    /// of them.
    #[test]
    fn sampling_and_quadrature_agree_for_twenty_pairs() {
        let pairs = reflection_pairs(Vec3::new(0.48, -0.36, 0.8), 100_000, 20);
        assert_eq!(pairs.len(), 20);
        for p in &pairs {
            assert!(p.z().abs() < 4.9, "{p:?} z {}", p.z());
            let error = p.monte_carlo.1.hypot(p.quadrature.1);
            assert!(6.9 * error < 0.1 * p.quadrature.0, "{p:?} could hide a bias");
        }
        // Under an even sky a diffuse surface returns its reflectance.
        assert!((pairs[0].quadrature.0 - 0.5).abs() < 1e-4, "{:?}", pairs[0]);
    }
}
