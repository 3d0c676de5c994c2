//! Film, sensor and pixel filter.

use super::ColorSpaceName;
use crate::span::{Span, Spanned};

/// The film.
#[derive(Clone, Debug)]
pub struct FilmDesc {
    /// Which of pbrt's films: what is stored beside colour.
    pub kind: FilmKind,
    /// Pixels, width then height.
    pub resolution: Spanned<[u32; 2]>,
    /// Output name as the scene gives it.
    pub filename: Option<Spanned<String>>,
    /// Pixel bounds [x0, x1, y0, y1], end-exclusive.
    pub pixel_bounds: Option<Spanned<[i32; 4]>>,
    /// The part to render, in fractions [x0, x1, y0, y1] of the image.
    pub crop_window: Option<Spanned<[f32; 4]>>,
    /// Diagonal of the film, millimetres (realistic cameras).
    pub diagonal: Spanned<f32>,
    /// Name of the sensor: "cie1931" or a camera's.
    pub sensor: Spanned<String>,
    /// ISO speed.
    pub iso: Spanned<f32>,
    /// White balance temperature, kelvin; 0: none.
    pub white_balance: Spanned<f32>,
    /// Exposure time, seconds; default: the camera's shutter interval.
    pub exposure_time: Option<Spanned<f32>>,
    /// Largest component of a sample (biased); infinite by default.
    pub max_component_value: Spanned<f32>,
    /// Half-float output asked for (pbrt's default; Irradiant writes 32-bit floats always).
    pub save_fp16: bool,
    /// Colour space of the output.
    pub color_space: ColorSpaceName,
    /// Where it was said.
    pub span: Span,
}

impl Default for FilmDesc {
    fn default() -> Self {
        Self {
            kind: FilmKind::Rgb,
            resolution: Spanned::unplaced([1280, 720]),
            filename: None,
            pixel_bounds: None,
            crop_window: None,
            diagonal: Spanned::unplaced(35.0),
            sensor: Spanned::unplaced("cie1931".into()),
            iso: Spanned::unplaced(100.0),
            white_balance: Spanned::unplaced(0.0),
            exposure_time: None,
            max_component_value: Spanned::unplaced(f32::INFINITY),
            save_fp16: true,
            color_space: ColorSpaceName::Srgb,
            span: Span::NONE,
        }
    }
}

/// pbrt's three films.
#[derive(Clone, Debug, PartialEq)]
pub enum FilmKind {
    /// Colour.
    Rgb,
    /// Colour and geometry channels.
    Gbuffer {
        /// Geometry in camera space (else world space).
        camera_space: bool,
    },
    /// Colour and radiance in wavelength buckets.
    Spectral {
        /// Number of buckets.
        n_buckets: Spanned<u32>,
        /// Least wavelength, nm.
        lambda_min: Spanned<f32>,
        /// Greatest wavelength, nm.
        lambda_max: Spanned<f32>,
    },
}

/// The pixel filter; radii in pixels.
#[derive(Clone, Debug)]
pub struct FilterDesc {
    /// Its shape.
    pub kind: FilterKind,
    /// Half-width in x, pixels.
    pub x_radius: Spanned<f32>,
    /// Half-width in y, pixels.
    pub y_radius: Spanned<f32>,
    /// Where it was said.
    pub span: Span,
}

impl Default for FilterDesc {
    fn default() -> Self {
        Self {
            kind: FilterKind::Gaussian { sigma: Spanned::unplaced(0.5) },
            x_radius: Spanned::unplaced(1.5),
            y_radius: Spanned::unplaced(1.5),
            span: Span::NONE,
        }
    }
}

/// Shapes of filter, with pbrt-v4's default radii: box 0.5, gaussian 1.5, mitchell 2, sinc 4, triangle 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// Constant.
    Box,
    /// Gaussian, shifted to reach 0 at the radius.
    Gaussian {
        /// Standard deviation, pixels.
        sigma: Spanned<f32>,
    },
    /// Mitchell-Netravali.
    Mitchell {
        /// B (default 1/3).
        b: Spanned<f32>,
        /// C (default 1/3).
        c: Spanned<f32>,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        /// Cycles (default 3).
        tau: Spanned<f32>,
    },
    /// Tent.
    Triangle,
}
