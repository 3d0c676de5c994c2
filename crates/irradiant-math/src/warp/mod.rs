//! Warps: maps from uniform numbers in [0, 1) to distributions, each with its density and its inverse beside it.
//!
//! # What it is for
//! Every sampling routine of the renderer ends in one of these. `name(u)` draws, `name_pdf(..)` is the density per unit
//! of the stated measure, `name_inverse(x)` gives back the `u` (so that samples can be warped twice, or densities
//! multiplied). It knows nothing of light or shapes; visible microfacet normals live beside their model.
//!
//! # In reading order
//! [`mod@line`] (one dimension), [`plane`] (disks, triangles, bilinear), [`direction`] (spheres, cones, the equal-area square
//! map), [`spherical_polygon`] (triangles and rectangles seen from a point, by solid angle).
//!
//! # Sources
//! Shirley and Chiu 1997 (concentric disk); Heitz 2019 (low-distortion triangle); Clarberg 2008 (equal-area octahedral
//! map); Arvo 1995 and Peters 2021 (spherical triangle); Urena, Fajardo and King 2013 (spherical rectangle). Orientation
//! and parametrisation agree with pbrt-v4's, so that its images and tables mean the same here.

pub mod direction;
pub mod line;
pub mod plane;
pub mod spherical_polygon;

pub use direction::*;
pub use line::*;
pub use plane::*;
pub use spherical_polygon::*;
