//! Points, vectors, rays, transforms, warps, distributions and low-discrepancy sequences.
#![forbid(unsafe_code)]
