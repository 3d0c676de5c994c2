//! What walks the scene: integrators, scheduling and sessions.
#![forbid(unsafe_code)]
