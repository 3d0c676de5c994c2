//! When a path ends: Russian roulette by several policies (A46 to A49, B23, B25), or not at all.
//!
//! All give the same expectation. They differ in cost and noise, and one of them in more than that: B25 says that a constant
//! q = 0.5 "should work fine", but the variance of a constant q is finite in a closed white room only where albedo^2 < 1 - q, that is
//! below an albedo of 0.707. Beyond it averages do not settle. The throughput policy has no such limit.
//!
//! The slides leave open:
//! - `continuationProbability(p.brdf, wi)` (A50). Here the policy `bsdf` takes the step's BRDF cos / pdf, at most 1: low where the BRDF
//!   is low in the next direction (A47), and it makes weights of 1 of a diffuse path.
//! - whether q1 is the first vertex or the second (B25 counts from 1, its pseudo-code from 0). Here `spared` steps are never ended.
//! - what ends a path that loses nothing. Here policies that look at the light carried survive with at most 0.95 after
//!   [`LONG_PATH`] events, as in production.
//!
//! Without roulette (A43: "infinite recursion!") a path ends by itself only if it leaves the scene or is absorbed. There is a safety stop
//! after a number of events; it truncates, so it stands in the label, and the paths that it ended are counted in
//! [`RenderStats::stopped_paths`].
//!
//! [`RenderStats::stopped_paths`]: crate::integrator::RenderStats::stopped_paths

use super::directions::Step;
use crate::integrator::Limit;
use crate::registry::{OptionEntry, OptionRange, Options, Value, words};

words! {
    /// Whether a path goes on.
    pub enum Policy {
        /// It does, until it leaves the scene, is absorbed, or meets a limit.
        None = "none",
        /// With probability 1 - q after the spared steps (B25).
        Constant = "constant",
        /// By what the surface scatters in the next direction (A47, A50).
        Bsdf = "bsdf",
        /// By what the path still carries.
        Throughput = "throughput",
    }
}

impl Policy {
    /// The option, for an estimator whose slide has this policy.
    pub(crate) const fn option(self) -> OptionEntry {
        OptionEntry {
            name: "roulette",
            range: OptionRange::Word(Self::WORDS),
            default: self.value(),
            doc: "when a path ends at random (A47, B23)",
        }
    }
}

pub(crate) const Q: OptionEntry = OptionEntry {
    name: "q",
    range: OptionRange::Number(0.05, 0.95),
    default: Value::Number(0.5),
    doc: "chance to end a path at each step, with roulette=constant (B25); of finite variance only where albedo^2 < 1 - q",
};

/// The option of the steps that roulette spares.
pub(crate) const fn spared(default: u32) -> OptionEntry {
    OptionEntry {
        name: "spared",
        range: OptionRange::Count(0, 16),
        default: Value::Count(default),
        doc: "first steps that roulette never ends (B25: \"usually q1 = q2 = 0\")",
    }
}

pub(crate) const STOP: OptionEntry = OptionEntry {
    name: "stop",
    range: OptionRange::Count(1, MAX_STOP),
    default: Value::Count(200),
    doc: "safety stop after so many scattering events, where no roulette is played; the paths that it ends are counted and reported (A43)",
};

/// The recursive estimators need stack for each event.
const MAX_STOP: u32 = 500;

/// After this many events even a path that loses nothing is ended now and then.
pub const LONG_PATH: u32 = 128;

/// When paths end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roulette {
    /// By what.
    pub policy: Policy,
    /// The constant policy's chance of an end.
    pub q: f32,
    /// First steps that are not played for.
    pub spared: u32,
    /// Without roulette: events after which a path is stopped.
    pub stop: u32,
}

impl Roulette {
    /// As an entry's options `roulette`, `q`, `spared` and `stop` say.
    pub fn of(options: &Options) -> Self {
        Self {
            policy: Policy::of(options.word("roulette")),
            q: options.number("q"),
            spared: options.count("spared"),
            stop: options.count("stop"),
        }
    }

    /// No roulette: "try 1" with its safety stop.
    pub fn none(stop: u32) -> Self {
        Self { policy: Policy::None, q: 0.0, spared: 0, stop }
    }

    /// The slides' `cpdf` and 1 - q[k]: the chance to go on with the step after `depth` events, in (0, 1]. `carried` is the path's
    /// brightness with that step ([`Step::brightness`] multiplied up).
    pub fn survival(&self, depth: u32, step: &Step, carried: f32) -> f32 {
        if depth < self.spared {
            return 1.0;
        }
        let most = if depth < LONG_PATH { 1.0 } else { 0.95 };
        match self.policy {
            Policy::None => 1.0,
            Policy::Constant => 1.0 - self.q,
            Policy::Bsdf => step.brightness.min(most),
            Policy::Throughput => carried.min(most),
        }
    }

    /// True when the safety stop ends a path after so many events.
    pub fn stops(&self, depth: u32) -> bool {
        self.policy == Policy::None && depth >= self.stop
    }

    /// What the safety stop leaves out, where no depth limit comes before it.
    pub fn limit(&self, max_depth: Option<u32>) -> Option<Limit> {
        let reached = self.policy == Policy::None && max_depth.is_none_or(|limit| limit > self.stop);
        reached.then(|| Limit::Truncation(format!("safety stop after {} events", self.stop)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_math::Vec3;
    use irradiant_spectrum::SampledSpectrum;

    #[test]
    fn policies_say_what_their_slides_say() {
        let step = |brightness| Step {
            wi: Vec3::Z,
            weight: SampledSpectrum::splat(brightness),
            brightness,
            pdf: 1.0,
            specular: false,
        };
        let with = |policy, spared| Roulette { policy, q: 0.3, spared, stop: 9 };
        assert_eq!(with(Policy::Constant, 2).survival(1, &step(0.2), 0.1), 1.0);
        assert_eq!(with(Policy::Constant, 2).survival(2, &step(0.2), 0.1), 0.7);
        assert_eq!(with(Policy::Bsdf, 0).survival(0, &step(0.2), 0.1), 0.2);
        assert_eq!(with(Policy::Throughput, 0).survival(0, &step(0.2), 0.1), 0.1);
        assert_eq!(with(Policy::Bsdf, 0).survival(LONG_PATH, &step(1.0), 1.0), 0.95);
        assert_eq!(with(Policy::None, 0).survival(1000, &step(0.2), 0.1), 1.0);
        assert!(with(Policy::None, 0).stops(9) && !with(Policy::Bsdf, 0).stops(9));
        assert!(with(Policy::None, 0).limit(Some(9)).is_none() && with(Policy::None, 0).limit(None).is_some());
    }
}
