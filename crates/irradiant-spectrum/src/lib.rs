//! Wavelengths, spectra, colour spaces, RGB uplifting, sensors and measured data of Irradiant.
//!
//! Layout, in reading order:
//! - [`sampled`]: four lanes and their arithmetic;
//! - [`wavelengths`]: what the lanes stand for, and how wavelengths are drawn;
//! - [`stored`]: spectra at rest, evaluated in either basis; made of [`table`], [`rgb`] and [`emission`];
//! - [`photometry`]: integrals against the CIE observer;
//! - [`colorspace`]: RGB spaces; [`uplift`]: from RGB to smooth spectra;
//! - [`sensor`]: from radiance to film RGB;
//! - `data`: named measured spectra, by [`named`].
//!
//! Figures, semantics and names follow pbrt-v4, whose images ours must agree with. Wavelengths are in nm.
//!
//! **How radiance reaches 1.** As in pbrt-v4, lights divide their scale by [`spectrum_to_photometric`] (106.86 for a
//! normalised illuminant) and [`Sensor::to_rgb`] integrates without dividing, so an RGB light of 1 seen directly is 1.
//! In the RGB basis the sensor multiplies by [`CIE_Y_INTEGRAL`] to the same end.
//!
//! Knows nothing of geometry or files.

#![forbid(unsafe_code)]
// max then min sends NaN to the lower bound, which clamp does not.
#![allow(clippy::manual_clamp)]

pub mod colorspace;
pub mod emission;
pub mod photometry;
pub mod rgb;
pub mod sampled;
pub mod sensor;
pub mod stored;
pub mod table;
pub mod uplift;
pub mod wavelengths;

mod data;
mod elementary;
mod matrix;

pub use colorspace::ColorSpace;
pub use data::{named, names};
pub use emission::{Blackbody, blackbody, daylight};
pub use photometry::{CIE_Y_INTEGRAL, inner_product, spectrum_to_photometric, spectrum_to_xyz};
pub use rgb::{RgbAlbedo, RgbIlluminant, RgbUnbounded};
pub use sampled::SampledSpectrum;
pub use sensor::{Sensor, SensorError};
pub use stored::{Curve, Role, Spectrum, SpectrumError};
pub use table::Table;
pub use uplift::SigmoidPolynomial;
pub use wavelengths::{Basis, Wavelengths};

/// Wavelengths that one path carries.
pub const N_WAVELENGTHS: usize = 4;
/// Shortest wavelength rendered, nm.
pub const LAMBDA_MIN: f32 = 360.0;
/// Longest wavelength rendered, nm.
pub const LAMBDA_MAX: f32 = 830.0;
