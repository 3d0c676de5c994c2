//! Bounding volume hierarchies: what a ray meets first, and whether it meets anything.
//!
//! One structure, [`Bvh`], holds two kinds of primitive in one tree: **triangles**, copied into blocks that share vertices
//! and tested here with a watertight test, and **user primitives**, known only by their boxes and tested by the caller
//! through [`Leaves`]. Curves, quadrics and instances are user primitives; an instance's callback transforms the ray
//! and asks another `Bvh`.
//!
//! The same hit (primitive and every bit of `t`, `u`, `v`) comes back at every SIMD [`Level`] and from a tree built by
//! any number of threads: triangle tests use the same unfused IEEE operations in the same order
//! everywhere, and ties are broken by primitive index.
//!
//! # Layout
//! - [`ray`](Ray): what goes in and comes out, and the trait the caller implements.
//! - `level`: which instructions may be used.
//! - `build`: primitives, binned SAH, the collapse to eight children, the packing of triangles.
//! - `node`: the tree in memory; `validate`: its invariants.
//! - `triangle`: the watertight test, scalar and eight at a time.
//! - `traverse`: the walk, once for closest hits and once for any hit, for one ray, for packets of sixteen that travel together, and for crowds of
//!   sixteen that go anywhere.
//! - `part`: walks that begin below the top, and which parts of instances to put in a tree over them.
//! - `lanes`: four, eight or sixteen floats; `prefetch`: asking for memory early; `pages`: large arrays.
//!
//! What it does not know: materials, transforms, normals, motion. Sources: Ylitie, Karras, Laine 2017 (wide collapse);
//! Wald 2007 (binned SAH); Woop, Benthin, Wald 2013 (watertight triangles); Ize 2013 (conservative boxes);
//! Pharr, Jakob, Humphreys 2023, section 6.8.4 (error bounds of a triangle's `t`).
#![deny(unsafe_code)]

mod build;
mod lanes;
mod level;
mod node;
mod pages;
mod part;
mod prefetch;
mod ray;
mod traverse;
mod triangle;
mod validate;

pub use build::{BuildInput, BuildReport, BuildSettings, Mesh};
pub use level::{Kernel, Level};
pub use node::Bvh;
pub use pages::{move_to_large_pages, vec_on_large_pages};
pub use part::{Braid, Part, braid};
pub use prefetch::{prefetch_read, prefetch_whole};
pub use ray::{Closest, Hit, Leaves, Ray, TrianglesOnly};
