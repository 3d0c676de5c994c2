//! Bounding volume hierarchies: build and traverse, scalar specification and SIMD kernels.
#![deny(unsafe_code)]
