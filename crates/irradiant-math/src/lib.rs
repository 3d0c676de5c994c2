//! Points, vectors, rays, transforms, warps, distributions and low-discrepancy sequences.
//!
//! # Layout
//! In the order a newcomer should read: [`vector`] (the distinct types), [`ray`], [`bounds`], [`frame`], [`transform`] (in
//! `f64`, for building), [`affine`] (in `f32`, for rays), [`motion`] (keyframes); [`elementary`] (functions with pinned bits),
//! [`hash`], [`interval`] (rounding errors and ray origins), [`solve`]; [`warp`] (unit square to anything),
//! [`distribution`] (tables), [`sequence`] (Sobol, Halton, Owen), [`noise`](mod@noise); [`lanes`] (the
//! numbers of many paths side by side). Nothing here knows of light or of files.
#![forbid(unsafe_code)]
// `!(x > 0.0)` is how this house says "not positive, or NaN".
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod affine;
pub mod bounds;
pub mod distribution;
pub mod elementary;
pub mod frame;
pub mod hash;
pub mod interval;
pub mod lanes;
pub mod motion;
pub mod noise;
pub mod ray;
pub mod sequence;
pub mod solve;
pub mod transform;
pub mod vector;
pub mod warp;

pub use affine::Affine;
pub use bounds::{Bounds2, Bounds3};
pub use frame::Frame;
pub use interval::{Interval, gamma, offset_ray_origin};
pub use motion::AnimatedTransform;
pub use ray::Ray;
pub use transform::Transform;
pub use vector::{Normal3, Point2, Point3, Vec2, Vec3};
