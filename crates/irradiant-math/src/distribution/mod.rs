//! Tabulated distributions: built once in `f64`, sampled often in `f32`.
//!
//! # In reading order
//! [`PiecewiseConstant1D`] and [`PiecewiseConstant2D`] (histograms over intervals and rectangles), [`AliasTable`] (indices by
//! weight in constant time), [`SummedAreaTable`] and [`WindowedPiecewiseConstant2D`] (a histogram restricted to a window
//! that is known only when sampling: portals).
//!
//! A table whose values are all zero is uniform for the first two (as in pbrt-v4) and draws nothing in the window; each
//! says so. Negative values count by their magnitude; non-finite ones as zero.

mod alias;
mod piecewise;
mod windowed;

pub use alias::{AliasSample, AliasTable};
pub use piecewise::{PiecewiseConstant1D, PiecewiseConstant2D, Sample1D, Sample2D};
pub use windowed::{SummedAreaTable, WindowSample, WindowedPiecewiseConstant2D};
