//! What exists at a point: interactions, BSDFs, lights, textures, cameras, the compiled scene, the film.
//!
//! # Layout
//! In reading order: [`interaction`] (where a path met something), [`geometry`] (what rays meet),
//! [`bxdf`] and [`bsdf`] (how light scatters there), [`camera`] (where paths begin).
//! Nothing here reads files, clocks or the environment.
#![forbid(unsafe_code)]

pub mod bsdf;
pub mod bxdf;
pub mod camera;
pub mod geometry;
pub mod interaction;
