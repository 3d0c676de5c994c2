//! The front door of Irradiant: load a scene, render it, get an image.
//!
//! ```no_run
//! use irradiant::{RenderSettings, load, render};
//!
//! fn main() -> Result<(), irradiant::Error> {
//!     let scene = load("scenes/cornell-box.pbrt")?;
//!     let settings = RenderSettings { samples_per_pixel: Some(16), ..RenderSettings::default() };
//!     let picture = render(&scene, &settings)?;
//!     picture.save("cornell-box.exr")?;
//!     picture.save("cornell-box.png")?;
//!     Ok(())
//! }
//! ```
//!
//! # Layout
//! [`load`](fn@load) and [`SceneFile`]; [`RenderSettings`] and [`Aov`]; [`render`](fn@render), [`Job`] and [`Rendering`];
//! [`Error`].
//! The crates below are re-exported under their last names ([`core`], [`image`], ...).
#![forbid(unsafe_code)]

mod aov;
mod contact_sheet;
pub mod drawing;
mod error;
mod header;
mod layers;
mod load;
mod render;
mod settings;

pub use aov::Aov;
pub use error::{Error, Report};
pub use header::Header;
pub use layers::LayerLight;
pub use load::{SceneFile, cornell_box, load, load_text};
pub use render::{Job, Rendering, render};
pub use settings::{ColorMode, MaxDepth, RenderSettings};

pub use irradiant_render::registry::IntegratorChoice;

pub use irradiant_core as core;
pub use irradiant_formats as formats;
pub use irradiant_image as image;
pub use irradiant_math as math;
pub use irradiant_render as renderer;
pub use irradiant_scene as scene;
pub use irradiant_spectrum as spectrum;

/// The version of Irradiant.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
