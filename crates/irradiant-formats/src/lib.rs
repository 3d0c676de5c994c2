//! Scene and mesh files in and out: pbrt-v4 text, PLY.
#![forbid(unsafe_code)]
