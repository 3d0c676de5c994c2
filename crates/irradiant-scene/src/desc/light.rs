//! Lights.

use super::{ColorSpaceName, FileDesc, MotionDesc, SpectrumDesc};
use crate::span::{Span, Spanned};

/// A light that is not a shape.
#[derive(Clone, Debug)]
pub struct LightDesc {
    /// What kind.
    pub kind: LightKind,
    /// World from light space.
    pub world_from_light: MotionDesc,
    /// Factor on everything.
    pub scale: Spanned<f32>,
    /// The light group that its author put it in, for layers of the film.
    pub group: Option<String>,
    /// The colour space of RGB values and images without one of their own.
    pub color_space: ColorSpaceName,
    /// Where it was said.
    pub span: Span,
}

/// Kinds of light with pbrt-v4's parameters. `power` (watt-like photometric scaling) is `None` when not given.
#[derive(Clone, Debug)]
pub enum LightKind {
    /// All directions from a point.
    Point {
        /// Radiant intensity.
        intensity: Spanned<SpectrumDesc>,
        /// Position in light space.
        from: [f32; 3],
        /// Total power asked for.
        power: Option<Spanned<f32>>,
    },
    /// Parallel light.
    Distant {
        /// Radiance per direction (irradiance on a facing surface).
        radiance: Spanned<SpectrumDesc>,
        /// Where it comes from, light space.
        from: [f32; 3],
        /// Where it goes, light space.
        to: [f32; 3],
        /// Irradiance asked for, on a surface facing the light (`illuminance`).
        illuminance: Option<Spanned<f32>>,
    },
    /// A cone.
    Spot {
        /// Radiant intensity on the axis.
        intensity: Spanned<SpectrumDesc>,
        /// Position, light space.
        from: [f32; 3],
        /// Target, light space.
        to: [f32; 3],
        /// Half-angle of the cone, degrees.
        cone_angle: Spanned<f32>,
        /// Width of the falloff inside the cone, degrees.
        cone_delta_angle: Spanned<f32>,
        /// Total power asked for.
        power: Option<Spanned<f32>>,
    },
    /// A point with a directional image (equal-area octahedral).
    Goniometric {
        /// Radiant intensity factor.
        intensity: Spanned<SpectrumDesc>,
        /// The image.
        file: Option<Spanned<FileDesc>>,
        /// Total power asked for.
        power: Option<Spanned<f32>>,
    },
    /// A slide projector.
    Projection {
        /// Radiant intensity factor.
        intensity: Spanned<SpectrumDesc>,
        /// The slide.
        file: Spanned<FileDesc>,
        /// Field of view, degrees.
        fov: Spanned<f32>,
        /// Total power asked for.
        power: Option<Spanned<f32>>,
    },
    /// From all around.
    Infinite {
        /// Uniform radiance (None when an image is given).
        radiance: Option<Spanned<SpectrumDesc>>,
        /// Equal-area octahedral image of radiance.
        file: Option<Spanned<FileDesc>>,
        /// A portal: light arrives only through this quadrilateral (world space, as pbrt's `portal`).
        portal: Option<Spanned<PortalDesc>>,
        /// Illuminance asked for on a surface below the upper hemisphere.
        illuminance: Option<Spanned<f32>>,
    },
}

impl LightKind {
    /// Its name in scene files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Distant { .. } => "distant",
            Self::Spot { .. } => "spot",
            Self::Goniometric { .. } => "goniometric",
            Self::Projection { .. } => "projection",
            Self::Infinite { .. } => "infinite",
        }
    }
}

/// The four corners of a portal, in world space: the current transform is not applied, as in pbrt-v4.
pub type PortalDesc = [[f32; 3]; 4];

/// Emission of a shape's surface.
#[derive(Clone, Debug)]
pub struct AreaLightDesc {
    /// Radiance (None when an image is given).
    pub radiance: Option<Spanned<SpectrumDesc>>,
    /// Image of radiance over the shape's (u, v).
    pub file: Option<Spanned<FileDesc>>,
    /// Factor on everything.
    pub scale: Spanned<f32>,
    /// The light group that its author put it in, for layers of the film.
    pub group: Option<String>,
    /// Emits on both sides.
    pub two_sided: bool,
    /// Total power asked for.
    pub power: Option<Spanned<f32>>,
    /// The colour space of RGB values and images without one of their own.
    pub color_space: ColorSpaceName,
    /// Where it was said.
    pub span: Span,
}
