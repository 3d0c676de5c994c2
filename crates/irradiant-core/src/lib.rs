//! What exists at a point: interactions, BSDFs, lights, textures, cameras, the compiled scene, the film.
//!
//! # Layout
//! In reading order: [`interaction`] (where a path met something), [`geometry`] (what rays meet),
//! [`bxdf`] and [`bsdf`] (how light scatters there), [`material`] and [`texture`] (what decides that), [`light`] and
//! [`light_sampler`], [`camera`], [`sampler`] (random numbers), [`film`] (sums and counts), and [`scene`], which holds
//! them all; [`codes`] explains what compiling one may complain about. Nothing here reads files, clocks or the environment.
#![forbid(unsafe_code)]
// `!(x > 0.0)` is how this house says "not positive, or NaN".
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod bsdf;
pub mod bxdf;
pub mod camera;
pub mod codes;
pub mod film;
pub mod geometry;
pub mod interaction;
pub mod light;
pub mod light_sampler;
pub mod material;
pub mod sampler;
pub mod scene;
pub mod texture;
