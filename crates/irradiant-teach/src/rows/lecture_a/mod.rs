//! Berkeley CS184, lecture 13: global illumination and path tracing.

mod bounces;
mod equation;
mod estimators;
mod first_look;
mod many_lights;
mod materials;
mod operators;
mod precision;
mod progress;
mod roulette;

use crate::row::Row;

/// By topic, in the lecture's order.
pub const ROWS: &[&[Row]] = &[
    first_look::ROWS,
    materials::ROWS,
    equation::ROWS,
    estimators::ROWS,
    operators::ROWS,
    bounces::ROWS,
    roulette::ROWS,
    many_lights::ROWS,
    precision::ROWS,
    progress::ROWS,
];
