//! What exists at a point: interactions, BSDFs, lights, textures, cameras, the compiled scene, the film.
#![forbid(unsafe_code)]
