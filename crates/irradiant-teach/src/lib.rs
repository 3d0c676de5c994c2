//! The two lectures that Irradiant implements, as checks that run.
//!
//! Each claim of the lectures is a [`Row`]: what the slide says, what we measure, and a function that measures it. A row passes
//! only through a measurement that could have failed; it reports the quantity, its bound, and the error that would have been
//! seen. Rows that another row covers inherit that row's result by name. [`teach`] runs rows and [`page`] makes one
//! self-contained HTML page of what they found.
//!
//! A fault ([`faults`]) makes an estimator, a density or a scene wrong on purpose, here and nowhere else, to show that the row's
//! check bites.
//!
//! # Layout
//! [`row`], the words; [`sheet`], how a measurement is judged; [`estimate`] and [`walk`], estimators that tell what each path
//! contributed; [`context`], what a row is given; `rows`, the lectures in their order; [`page`], the page.
#![forbid(unsafe_code)]
// `!(x > 0.0)` is how this house says "not positive, or NaN".
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod caustic;
mod context;
pub mod estimate;
pub mod page;
pub mod radiosity;
pub mod row;
mod rows;
pub mod scenes;
pub mod sheet;
pub mod surface;
mod teach;
pub mod walk;

pub use context::{Budget, Context};
pub use row::{Fault, Measure, Outcome, Picture, Row, Verdict};
pub use rows::{faults, gaps, rows};
pub use teach::{Lesson, Settings, Told, teach};
