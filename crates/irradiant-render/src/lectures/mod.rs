//! The estimators of the two lectures that this system implements, as their slides have them: for teaching, for comparison, and as
//! witnesses of the production estimator.
//!
//! Lecture A is Berkeley CS184/284A "Global Illumination & Path Tracing"; lecture B is Bern "Rendering Algorithms: path tracing"
//! (Zwicker 2014). Ids such as A54 and B38 are rows of the project's ledger, one for each claim of a slide.
//!
//! Four questions have several answers on the slides, and each is an option of its own, in a file of its own:
//! - where does a ray go from a surface? [`directions`] (B29; at glass B35);
//! - does light count that a ray meets by chance? [`emission`] (B38, B32);
//! - how are lights sampled? [`direct_light`] (A26, A58, A59; what stands in the way, A27);
//! - when does a path end? [`roulette`] (A43, A47, B23, B25).
//!
//! The estimators put them together: [`direct`] (A24 to A27), [`tries`] (A43, A50), [`partitioned`] (A52 to A54), [`iterative`] (B22,
//! B24), [`per_length`] (B20), [`distribution`] (B12). What all share of meeting surfaces is in [`walk`].
//!
//! # What the slides leave out
//! None of the pseudo-code says what happens when a ray meets nothing. Here it then finds what light comes from outside
//! (environments), by the same rule as that of surfaces, and the path ends. Surfaces of material `interface` are passed, as
//! everywhere in this house. Each file says what else its slide leaves open or has wrong.
//!
//! Where an estimator cannot see something it returns exactly 0 for it, and its label ([`crate::integrator::Integrator::limits`]) says what.

pub mod direct;
pub mod direct_light;
pub mod directions;
pub mod distribution;
pub mod emission;
pub mod iterative;
pub mod partitioned;
pub mod path_options;
pub mod per_length;
pub mod roulette;
pub mod tries;
pub mod walk;

use crate::integrator::{Limit, SceneHas};
use crate::registry::{OptionEntry, OptionRange, Value};

/// The option of estimators that take several light samples at a vertex.
pub(crate) const SAMPLES: OptionEntry = OptionEntry {
    name: "samples",
    range: OptionRange::Count(1, 4096),
    default: Value::Count(1),
    doc: "light samples at a vertex: N of one light each (A59), M of each light (A58), or candidates of which one is kept (resampled)",
};

/// The depth limit as a label has it, if it cuts anything off.
fn depth_limit(max_depth: Option<u32>) -> impl Iterator<Item = Limit> {
    max_depth.map(Limit::MaxDepth).into_iter()
}

/// What estimators leave out that find light only by chance.
fn unsampled_lights() -> Limit {
    Limit::Unfound("delta lights", &[SceneHas::DeltaLights])
}
