//! The front door of Irradiant: load a scene, render it, get an image.
#![forbid(unsafe_code)]
