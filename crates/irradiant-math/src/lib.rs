//! Points, vectors, rays, transforms, warps, distributions and low-discrepancy sequences.
//!
//! # Layout
//! In the order a newcomer should read: [`vector`] (the distinct types), [`ray`], [`bounds`], [`frame`],
//! [`transform`], then the numerical modules. Nothing here knows of light or of files.
#![forbid(unsafe_code)]

pub mod bounds;
pub mod distribution;
pub mod elementary;
pub mod frame;
pub mod hash;
pub mod ray;
pub mod sequence;
pub mod solve;
pub mod transform;
pub mod vector;
pub mod warp;

pub use bounds::{Bounds2, Bounds3};
pub use frame::Frame;
pub use ray::Ray;
pub use transform::Transform;
pub use vector::{Normal3, Point2, Point3, Vec2, Vec3};
