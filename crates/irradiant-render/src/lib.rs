//! What walks the scene: integrators, scheduling and sessions.
//!
//! # Layout
//! [`integrator`] (the interface), [`path`] (the main story), its neighbours; paths from lights ([`light_walk`]) in
//! [`light_trace`], [`bidirectional`] and [`photon`]; [`lectures`] (the slides' own estimators), [`registry`] (all by name, with
//! options), [`record`] (what a path tells of itself), [`expression`] and [`layered_path`] (pictures of kinds of paths, from
//! one run), then [`schedule`] and [`session`]: which work, and who does it.
#![forbid(unsafe_code)]
// `!(x > 0.0)` is how this house says "not positive, or NaN".
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod ambient_occlusion;
pub mod bidirectional;
pub mod camera_samples;
pub mod expression;
pub mod inspect;
pub mod integrator;
pub mod layered_path;
pub mod lectures;
mod light_samples;
pub mod light_trace;
pub mod light_walk;
pub mod path;
pub mod photon;
pub mod random_walk;
pub mod record;
pub mod registry;
pub mod schedule;
pub mod self_intersection;
pub mod session;
pub mod shared_path;
pub mod simple_path;
mod staged_path;
pub mod truncation;

pub use integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
pub use session::{Progress, Session, SessionSettings};
