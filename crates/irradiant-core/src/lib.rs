//! What exists at a point: interactions, BSDFs, lights, textures, cameras, the compiled scene, the film.
//!
//! # Layout
//! In reading order: [`interaction`] (where a path met something), [`geometry`] (what rays meet),
//! [`texture`] (values over surfaces), [`material`] (what a surface is made of),
//! [`bxdf`] and [`bsdf`] (how light scatters there), [`sampler`] (random numbers), [`film`] (sums and counts).
//! Nothing here reads files, clocks or the environment.
#![forbid(unsafe_code)]

pub mod bsdf;
pub mod bxdf;
pub mod film;
pub mod geometry;
pub mod interaction;
pub mod material;
pub mod sampler;
pub mod texture;
