//! Looking into a render: paths taken apart, light at a point, the books of energy, checks of single claims.
//!
//! # Layout
//! In reading order: [`story`] (one sample's path as data, with an account of its densities), [`tally`] (means with
//! errors), [`view`] (pictures of the scene without a film: from the camera, and through it from outside), [`incident`](mod@incident)
//! (light at a point, the rendering equation's residual), [`audit`](mod@audit) (where the lamps' energy goes),
//! [`dimensions`](mod@dimensions) (which random numbers a path uses), [`reflection`] (the reflection equation by two roads), [`light_claims`]
//! (densities that sum to one, darkness off the lights).
//!
//! Nothing here is on the way of a render; everything is a pure function of its arguments.

pub mod audit;
pub mod dimensions;
pub mod incident;
pub mod light_claims;
pub mod reflection;
pub mod story;
pub mod tally;
pub mod view;

pub use audit::{AuditSettings, AuditWatch, EnergyAudit, audit, watched_audit};
pub use dimensions::{DimensionAudit, dimensions};
pub use incident::{Incident, IncidentSettings, Residual, incident, residuals};
pub use story::{PathStory, replay};
pub use tally::Tally;
