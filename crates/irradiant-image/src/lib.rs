//! Pixels in memory and on disk: formats, MIP levels, error metrics.
//!
//! Knows nothing of scenes, spectra or files beyond bytes in and bytes out; the only functions
//! that touch a disk are [`read_file`] and [`atomic_write`].
//!
//! ```
//! use irradiant_image::{FileFormat, Image, ReadOptions, compare, read, write};
//!
//! let ramp = Image::from_fn(64, 32, ["R", "G", "B"], |x, y| [x as f32 / 64.0, y as f32 / 32.0, 0.5]);
//! let file = write(&ramp, FileFormat::Exr)?;
//! let back = read(&file, "ramp.exr", &ReadOptions::default())?;
//! assert_eq!(compare(&back, &ramp).unwrap().mse, 0.0);
//! # Ok::<(), irradiant_image::ImageError>(())
//! ```
//!
//! # Layout
//!
//! - [`image`](mod@image): [`Image`], a rectangle of pixels with named channels, kept in 8 bits, half or float.
//! - [`encoding`]: sRGB, gamma and linear transfer functions and their 8-bit tables.
//! - [`metadata`]: what a file said beside its pixels: windows, chromaticities, attributes.
//! - [`error`]: [`ImageError`], what can be wrong with a file.
//! - [`format`](mod@format): [`read`], [`write`](fn@write) and one module for each file format.
//! - [`atomic`]: [`atomic_write`], all of a file or none of it.
//! - [`resize`]: box and Lanczos resampling.
//! - [`wrap`]: what lies outside a picture; nearest and bilinear lookups.
//! - [`mip`]: [`MipMap`], filtered texture lookups as pbrt-v4 makes them.
//! - [`metrics`]: MSE, relMSE, MAPE, PSNR, worst tile.
//! - [`flip`]: the FLIP difference, for displays and for high dynamic range.
//! - [`tone`]: exposure, filmic curves, sRGB bytes, false colour.
//! - [`lettering`]: plain letters on pictures.
#![forbid(unsafe_code)]

pub mod atomic;
pub mod encoding;
pub mod error;
pub mod flip;
pub mod format;
pub mod image;
pub mod lettering;
pub mod metadata;
pub mod metrics;
pub mod mip;
pub mod resize;
pub mod tone;
pub mod wrap;

pub use atomic::atomic_write;
pub use encoding::Encoding;
pub use error::ImageError;
pub use flip::{Flip, FlipOptions, flip_hdr, flip_ldr};
pub use format::exr_write::{Compression, write_exr};
pub use format::hdr::write_hdr;
pub use format::jpeg::write_jpeg;
pub use format::pfm::write_pfm;
pub use format::png::{PngDepth, write_png};
pub use format::qoi::write_qoi;
pub use format::{FileFormat, ReadOptions, read, read_file, write};
pub use image::{Image, PixelFormat, Pixels};
pub use metadata::{Attribute, Chromaticities, Metadata};
pub use metrics::{CompareError, Comparison, WorstTile, compare};
pub use mip::{MipFilter, MipMap, MipOptions, WrapMode};
pub use resize::ResizeFilter;
pub use tone::{ToneCurve, ToneOptions, false_colour, to_srgb8, tone_map};
