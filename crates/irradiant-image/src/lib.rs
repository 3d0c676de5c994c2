//! Pixels in memory and on disk: formats, MIP levels, error metrics.
#![forbid(unsafe_code)]
