//! Low-discrepancy sequences: pure functions from an index (and a seed) to points.
//!
//! # In reading order
//! [`sobol`](mod@sobol) (Sobol's sequence; four dimensions at once; the samples of one pixel of a global sequence),
//! [`owen`] (Owen scrambling by hash, and the scrambled four-dimensional blocks that a renderer draws per vertex),
//! [`halton`] (radical inverses in prime bases), [`morton`] (interleaved bits).
//!
//! Knows nothing of pixels' filters or of what a dimension is used for.

pub mod halton;
pub mod morton;
pub mod owen;
mod owen_lanes;
pub mod sobol;
mod sobol_directions;

pub use halton::{
    DigitPermutations, PRIMES, owen_scrambled_radical_inverse, radical_inverse, scrambled_radical_inverse,
};
pub use morton::{morton_decode_2, morton_decode_3, morton_encode_2, morton_encode_3};
pub use owen::{
    laine_karras, nested_uniform_scramble_base2, owen_sobol_1d, owen_sobol_2d, owen_sobol_4d, owen_sobol_4d_bits,
    owen_sobol_4d_of_reversed,
};
pub use owen_lanes::owen_sobol_4d_lanes;
pub use sobol::{N_SOBOL_DIMENSIONS, SobolPixels, sobol, sobol_4d, sobol_64};
