//! Looking into a render: paths taken apart, light at a point, the books of energy, checks of single claims.
//!
//! # Layout
//! In reading order: [`story`] (one sample's path as data, with an account of its densities), [`tally`] (means with
//! errors), [`view`] (pictures of the scene without a film: from the camera, and through it from outside).
//!
//! Nothing here is on the way of a render; everything is a pure function of its arguments.

pub mod story;
pub mod tally;
pub mod view;

pub use story::{PathStory, replay};
pub use tally::Tally;
