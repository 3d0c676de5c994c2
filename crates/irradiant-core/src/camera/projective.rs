//! Cameras with a flat screen: thin-lens perspective, and parallel rays.

use super::{ModelRay, Offsets};
use irradiant_math::warp::uniform_disk_concentric;
use irradiant_math::{Point2, Point3, Transform, Vec3};

/// The part of the screen plane that the image shows, in units of the half of its shorter side unless the author says
/// otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ScreenWindow {
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl ScreenWindow {
    /// From -1 to 1 along the shorter side of a frame of that aspect ratio (width over height).
    pub fn of_aspect(aspect: f64) -> Self {
        let [x, y] = if aspect > 1.0 { [aspect, 1.0] } else { [1.0, 1.0 / aspect] };
        Self { x: [-x, x], y: [-y, y] }
    }

    /// The screen position of the film's origin and the steps of a pixel in x and y.
    fn steps(&self, resolution: [u32; 2]) -> ([f64; 2], f64, f64) {
        let dx = (self.x[1] - self.x[0]) / resolution[0] as f64;
        let dy = -(self.y[1] - self.y[0]) / resolution[1] as f64;
        ([self.x[0], self.y[1]], dx, dy)
    }
}

/// A thin lens at the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct ThinLens {
    pub radius: f64,
    pub focal_distance: f64,
}

fn vector(space_from_camera: &Transform, v: [f64; 3]) -> Vec3 {
    let m = &space_from_camera.m;
    let row = |i: usize| (m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2]) as f32;
    Vec3::new(row(0), row(1), row(2))
}

fn point(space_from_camera: &Transform, p: [f64; 3]) -> Point3 {
    let p = space_from_camera.point64(p);
    Point3::new(p[0] as f32, p[1] as f32, p[2] as f32)
}

/// Half-axes of the lens, when there is one to speak of.
type LensAxes = Option<[Vec3; 2]>;

fn lens_axes(lens: ThinLens, space_from_camera: &Transform) -> LensAxes {
    (lens.radius > 0.0)
        .then(|| [[lens.radius, 0.0, 0.0], [0.0, lens.radius, 0.0]].map(|v| vector(space_from_camera, v)))
}

/// A model whose rays go through a flat screen.
pub(super) trait FlatScreen {
    /// The ray through a place on the film and one on the lens. To be `#[inline(always)]`, for loops over many.
    fn ray(&self, film: Point2, lens: Point2) -> ModelRay;
}

/// What both cameras have in common, for finding the place of a point on the film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Screen {
    pub origin: Point3,
    /// From the origin to where film position (0, 0) is focused, or starts if rays are parallel.
    pub corner: Vec3,
    /// Steps of a pixel.
    pub dx: Vec3,
    pub dy: Vec3,
    /// Half-axes of the lens.
    pub lens: Option<[Vec3; 2]>,
    /// The direction of all rays, if they are parallel.
    pub parallel: Option<Vec3>,
}

#[inline(always)]
fn on_lens(axes: &[Vec3; 2], u: Point2) -> Vec3 {
    let p = uniform_disk_concentric(u);
    axes[0] * p.x + axes[1] * p.y
}

/// Rays from a pinhole, or from a thin lens such that those of one film position meet on the plane of focus.
///
/// The film is mapped straight to the plane of focus (z = 1 for a pinhole): one affine map, whose steps are also the
/// exact offsets of neighbouring rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Perspective {
    origin: Point3,
    /// From the origin to where film position (0, 0) is focused.
    corner: Vec3,
    dx: Vec3,
    dy: Vec3,
    lens: LensAxes,
}

impl Perspective {
    /// `tan_half_fov` belongs to a screen coordinate of 1.
    pub fn new(
        tan_half_fov: f64,
        screen: &ScreenWindow,
        lens: ThinLens,
        resolution: [u32; 2],
        space_from_camera: &Transform,
    ) -> Self {
        let (corner, dx, dy) = screen.steps(resolution);
        let z = if lens.radius > 0.0 { lens.focal_distance } else { 1.0 };
        let scale = tan_half_fov * z;
        Self {
            origin: point(space_from_camera, [0.0; 3]),
            corner: vector(space_from_camera, [corner[0] * scale, corner[1] * scale, z]),
            dx: vector(space_from_camera, [dx * scale, 0.0, 0.0]),
            dy: vector(space_from_camera, [0.0, dy * scale, 0.0]),
            lens: lens_axes(lens, space_from_camera),
        }
    }

    /// True when rays depend on a place on the lens.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    pub fn screen(&self) -> Screen {
        let Self { origin, corner, dx, dy, lens } = *self;
        Screen { origin, corner, dx, dy, lens, parallel: None }
    }
}

impl FlatScreen for Perspective {
    #[inline(always)]
    fn ray(&self, film: Point2, lens: Point2) -> ModelRay {
        let focus = self.corner + self.dx * film.x + self.dy * film.y;
        let offset = self.lens.as_ref().map_or(Vec3::ZERO, |axes| on_lens(axes, lens));
        ModelRay {
            o: self.origin + offset,
            d: focus - offset,
            weight: 1.0,
            offsets: Some(Offsets { direction_x: self.dx, direction_y: self.dy, ..Offsets::ZERO }),
        }
    }
}

/// Parallel rays.
///
/// With a lens it does as pbrt-v4 does: rays start on a lens around the *origin* and aim at the point of the plane of focus
/// straight ahead of the film position, so the picture is no longer a parallel projection. The compiler warns of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orthographic {
    /// The camera's position; where film position (0, 0) starts, relative to it.
    origin: Point3,
    corner: Vec3,
    dx: Vec3,
    dy: Vec3,
    /// To the plane of focus, or of length 1.
    forward: Vec3,
    lens: LensAxes,
}

impl Orthographic {
    pub fn new(screen: &ScreenWindow, lens: ThinLens, resolution: [u32; 2], space_from_camera: &Transform) -> Self {
        let (corner, dx, dy) = screen.steps(resolution);
        let z = if lens.radius > 0.0 { lens.focal_distance } else { 1.0 };
        Self {
            origin: point(space_from_camera, [0.0; 3]),
            corner: vector(space_from_camera, [corner[0], corner[1], 0.0]),
            dx: vector(space_from_camera, [dx, 0.0, 0.0]),
            dy: vector(space_from_camera, [0.0, dy, 0.0]),
            forward: vector(space_from_camera, [0.0, 0.0, z]),
            lens: lens_axes(lens, space_from_camera),
        }
    }

    /// True when rays depend on a place on the lens.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// With a lens its rays are those of a perspective camera whose plane of focus is straight ahead of the film.
    pub fn screen(&self) -> Screen {
        let Self { origin, corner, dx, dy, forward, lens } = *self;
        let (corner, parallel) = if lens.is_some() { (corner + forward, None) } else { (corner, Some(forward)) };
        Screen { origin, corner, dx, dy, lens, parallel }
    }
}

impl FlatScreen for Orthographic {
    #[inline(always)]
    fn ray(&self, film: Point2, lens: Point2) -> ModelRay {
        let start = self.corner + self.dx * film.x + self.dy * film.y;
        let Some(axes) = &self.lens else {
            let offsets = Offsets { origin_x: self.dx, origin_y: self.dy, ..Offsets::ZERO };
            return ModelRay { o: self.origin + start, d: self.forward, weight: 1.0, offsets: Some(offsets) };
        };
        let offset = on_lens(axes, lens);
        ModelRay {
            o: self.origin + offset,
            d: start + self.forward - offset,
            weight: 1.0,
            offsets: Some(Offsets { direction_x: self.dx, direction_y: self.dy, ..Offsets::ZERO }),
        }
    }
}
