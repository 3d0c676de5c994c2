//! Whether light counts that a ray meets by chance.
//!
//! Lecture B's rule (B38): no, since shadow rays have counted it already, except where the eye looks or the ray came from a mirror or
//! glass, at which no shadow ray was sent. Lecture A's pseudo-code (A54) has the first exception and forgets the second: lamps are
//! black in its mirrors, and there are no caustics. Lecture B's pseudo-code (B24) has neither; they are in its notes only.
//!
//! Two exceptions that both lectures forget are made by the rule `specular`: a light that samples cannot draw (a curve), and one
//! behind a surface of material `interface`, which a ray passes and a shadow ray does not.
//!
//! The alternative is to count both, each by its weight (B32). Weights of light met by chance and of light samples come from the same
//! densities, so that they sum to 1: see [`EmissionRule::light_sample_weight`].

use super::direct_light::DirectLight;
use super::walk::Met;
use crate::integrator::{Limit, SceneHas};
use crate::path::power_heuristic;
use crate::registry::{OptionEntry, OptionRange, words};
use irradiant_core::interaction::ReferencePoint;
use irradiant_core::light::SampleMode;
use irradiant_core::scene::Scene;

words! {
    /// When light counts that a ray meets.
    pub enum EmissionRule {
        /// Never: lamps themselves are black (B24 as printed).
        Never = "never",
        /// Where the eye looks at it, and nowhere else (A54 as printed).
        Eye = "eye",
        /// Where the eye looks at it, and after mirrors and glass (B38).
        Specular = "specular",
        /// Always, beside light samples: counts it twice (B38's rule switched off; biased).
        Always = "always",
        /// Weighed against light samples by the balance heuristic (B32).
        Balance = "balance",
        /// Weighed against light samples by the power heuristic (B32).
        Power = "power",
    }
}

impl EmissionRule {
    /// The option, for an estimator whose slide has this rule.
    pub(crate) const fn option(self) -> OptionEntry {
        OptionEntry {
            name: "emission",
            range: OptionRange::Word(Self::WORDS),
            default: self.value(),
            doc: "when light counts that a ray meets by chance (B38)",
        }
    }
}

/// Where the last scattering event was, and how the ray came to leave it.
#[derive(Clone, Copy, Debug)]
pub struct Previous {
    /// The surface.
    pub reference: ReferencePoint,
    /// Density of the ray's direction per solid angle.
    pub pdf: f32,
    /// Along a delta.
    pub specular: bool,
}

impl EmissionRule {
    /// The weight of light that a ray meets. `previous` is where the ray left, `None` for the eye; `lights` is how lights were sampled
    /// there.
    pub fn weight(self, scene: &Scene, met: &Met, previous: Option<&Previous>, lights: &DirectLight) -> f32 {
        let unsampled = |p: &Previous, mode| {
            p.specular || met.behind_interface || !(met.light_pdf(scene, &p.reference, mode) > 0.0)
        };
        let count = |yes: bool| f32::from(u8::from(yes));
        match (self, previous) {
            (Self::Never, _) => 0.0,
            (Self::Always, _) | (Self::Eye | Self::Specular | Self::Balance | Self::Power, None) => 1.0,
            (Self::Eye, Some(_)) => 0.0,
            (Self::Specular, Some(p)) => count(unsampled(p, SampleMode::Complete)),
            (Self::Balance | Self::Power, Some(p)) if unsampled(p, SampleMode::Compensated) => 1.0,
            (Self::Balance | Self::Power, Some(p)) => {
                let light_pdf = met.light_pdf(scene, &p.reference, SampleMode::Compensated);
                self.heuristic(p.pdf, lights.density(scene, &p.reference, met.light, light_pdf))
            }
        }
    }

    /// The weight of a light sample of density `light`, where the next direction would be drawn with density `direction`.
    pub fn light_sample_weight(self, light: f32, direction: f32) -> f32 {
        match self {
            Self::Never | Self::Eye | Self::Specular | Self::Always => 1.0,
            Self::Balance | Self::Power => self.heuristic(light, direction),
        }
    }

    /// The weight of the technique with density `a` beside another with density `b` (Veach and Guibas 1995).
    fn heuristic(self, a: f32, b: f32) -> f32 {
        match self {
            Self::Balance if a > 0.0 => a / (a + b),
            Self::Balance => 0.0,
            Self::Never | Self::Eye | Self::Specular | Self::Always | Self::Power => power_heuristic(a, b),
        }
    }

    /// How completely lights must be sampled beside this rule.
    pub fn sample_mode(self) -> SampleMode {
        match self {
            Self::Never | Self::Eye | Self::Specular | Self::Always => SampleMode::Complete,
            Self::Balance | Self::Power => SampleMode::Compensated,
        }
    }

    /// What it does to the picture.
    pub fn limit(self) -> Option<Limit> {
        match self {
            Self::Never => {
                Some(Limit::Unfound("lamps that the eye sees, directly or by mirrors and glass", &[SceneHas::Lamps]))
            }
            Self::Eye => Some(Limit::Unfound(
                "lamps seen by mirrors and glass, and their caustics",
                &[SceneHas::Lamps, SceneHas::UnsampledWays],
            )),
            Self::Always => Some(Limit::Bias("lamps met by chance count beside light samples".into())),
            Self::Specular | Self::Balance | Self::Power => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_both_ways_to_find_a_light_sum_to_one() {
        for rule in [EmissionRule::Balance, EmissionRule::Power] {
            for (a, b) in [(1.0, 1.0), (1e-10, 3.0), (1e15, 1e-15), (0.0, 2.0), (5.0, 0.0), (0.3, 7.0)] {
                assert!((rule.heuristic(a, b) + rule.heuristic(b, a) - 1.0).abs() < 1e-6, "{rule:?} {a} {b}");
            }
        }
        assert_eq!(EmissionRule::Balance.heuristic(1.0, 3.0), 0.25);
        assert_eq!(EmissionRule::Power.heuristic(1.0, 3.0), 0.1);
    }
}
