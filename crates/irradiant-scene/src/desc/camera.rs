//! Cameras.

use super::{FileDesc, MotionDesc};
use crate::span::{Span, Spanned};
use std::sync::Arc;

/// The camera and its shutter.
#[derive(Clone, Debug)]
pub struct CameraDesc {
    /// What kind.
    pub kind: CameraKind,
    /// Camera from world (as `LookAt` gives it); camera space looks along +z with +y up, left-handed.
    pub camera_from_world: MotionDesc,
    /// Shutter opening time.
    pub shutter_open: Spanned<f32>,
    /// Shutter closing time.
    pub shutter_close: Spanned<f32>,
    /// Where it was said.
    pub span: Span,
}

impl Default for CameraDesc {
    fn default() -> Self {
        Self {
            kind: CameraKind::Perspective {
                fov: Spanned::unplaced(90.0),
                lens_radius: Spanned::unplaced(0.0),
                focal_distance: Spanned::unplaced(1e6),
                frame_aspect_ratio: None,
                screen_window: None,
            },
            camera_from_world: MotionDesc::default(),
            shutter_open: Spanned::unplaced(0.0),
            shutter_close: Spanned::unplaced(1.0),
            span: Span::NONE,
        }
    }
}

/// The kinds of camera.
#[derive(Clone, Debug)]
pub enum CameraKind {
    /// Thin-lens perspective.
    Perspective {
        /// Angle of view across the *shorter* image axis, degrees, in (0, 180).
        fov: Spanned<f32>,
        /// Lens radius, scene units; 0 is a pinhole.
        lens_radius: Spanned<f32>,
        /// Distance of sharpness, scene units.
        focal_distance: Spanned<f32>,
        /// Width over height of the frame; default from the resolution.
        frame_aspect_ratio: Option<Spanned<f32>>,
        /// [x0, x1, y0, y1] on the screen plane; default from the aspect ratio.
        screen_window: Option<Spanned<[f32; 4]>>,
    },
    /// Parallel rays.
    Orthographic {
        /// Lens radius, scene units.
        lens_radius: Spanned<f32>,
        /// Distance of sharpness, scene units.
        focal_distance: Spanned<f32>,
        /// Width over height of the frame.
        frame_aspect_ratio: Option<Spanned<f32>>,
        /// [x0, x1, y0, y1] in scene units.
        screen_window: Option<Spanned<[f32; 4]>>,
    },
    /// All directions.
    Spherical {
        /// True for latitude-longitude, false for equal-area octahedral.
        equirectangular: bool,
    },
    /// Through the glass of a real lens.
    Realistic {
        /// The lens file's name (for messages).
        lens_file: Option<FileDesc>,
        /// Elements from front to rear: (curvature radius mm, thickness mm, eta, aperture diameter mm) each.
        lens: Arc<[[f32; 4]]>,
        /// Diameter of the aperture stop, mm.
        aperture_diameter: Spanned<f32>,
        /// Distance of sharpness, scene units (metres).
        focus_distance: Spanned<f32>,
        /// Aperture shape.
        aperture: ApertureShape,
    },
}

/// Shape of the aperture stop of a realistic camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ApertureShape {
    /// A full disk.
    #[default]
    Circular,
    /// pbrt's built-in "gaussian".
    Gaussian,
    /// pbrt's built-in "square".
    Square,
    /// pbrt's built-in "pentagon".
    Pentagon,
    /// pbrt's built-in "star".
    Star,
    /// A grey image.
    Image(FileDesc),
}
