//! Statistical tests over closures and numbers: chi-square, z-tests, confidence intervals, quadrature.
//!
//! Depends on no crate of ours and speaks only closures, `f64` and `[f32; 3]`, so that every crate, even `math`, can test
//! itself in its own files.
//!
//! # Layout
//! [`Rng`] (a seedable generator of its own), [`Chi2`] (does a sampler have the density it claims?), [`Mean`] and the
//! z-tests (do two estimates agree, and what bias would have been seen?), [`integrate_square`] and [`integrate_sphere`]
//! (adaptive quadrature), [`Tiles`] (do two images agree within their noise?), [`special`] (the p-values).
//!
//! # How to choose a threshold
//! Seeds are fixed, so a test passes or fails for good; the threshold is the chance that a *right* program was unlucky
//! when the test was written, or a change of random numbers makes it so. Use p > 1e-6 for one test, and [`sidak`] for
//! many: with m tests at an overall rate r, each is judged at 1 - (1 - r)^(1/m). Two-sided z: 4.9 sigma is 1e-6.
//! State the power too: [`Mean::detectable_bias`] and [`Chi2Report::detectable_ratio`] tell what would have been seen.
//!
//! # Mutations that the kit must catch
//! Its own tests feed samplers whose density is 10 % low, misses a cosine, is off by 2, lies in the wrong hemisphere, or
//! whose directions are not unit: run them when the kit changes.
#![forbid(unsafe_code)]
// `!(x > 0.0)` is how this house says "not positive, or NaN".
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod chi2;
mod mean;
mod quadrature;
mod rng;
pub mod special;
mod tiles;

pub use chi2::{Chi2, Chi2Report, chi2_counts, chi2_sphere};
pub use mean::{
    Mean, assert_mean_close, assert_means_agree, holm, sidak, z_for_two_sided_rate, z_score, z_score_exact,
};
pub use quadrature::{integrate_interval, integrate_sphere, integrate_square};
pub use rng::Rng;
pub use tiles::{TileReport, Tiles};
