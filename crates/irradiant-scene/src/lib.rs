//! The scene description as plain data, spans and diagnostics.
#![forbid(unsafe_code)]
