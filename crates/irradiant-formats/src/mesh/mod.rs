//! Meshes and curves: files of them, and what is made of control points.
//!
//! [`ply`] reads meshes; [`loop_subdivision`] refines them; [`curve`] turns splines into Bezier segments.

pub mod curve;
pub mod loop_subdivision;
pub mod ply;
