//! Bern, Rendering Algorithms: the rendering equation and Monte Carlo path tracing.

mod convergence;
mod densities;
mod equation;
mod paths;
mod surfaces;

use crate::row::Row;

/// By topic, in the lecture's order.
pub const ROWS: &[&[Row]] = &[equation::ROWS, paths::ROWS, densities::ROWS, surfaces::ROWS, convergence::ROWS];
