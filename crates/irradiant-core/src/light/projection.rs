//! A slide projector: scene word `projection`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `filename` | | required | the slide, any size; R, G, B |
//! | `fov` | degrees | 90 | full angle across the shorter side |
//! | `scale` | | 1 | factor |
//! | `power` | lm | | total luminous power; replaces the size of the image |
//!
//! The projector looks along the light's +z with the slide's top at +y; pixels are looked up without interpolation.
//! Intensity is the pixel's colour times the illuminant of the image's colour space, at every angle to the axis.

use super::emission::{MeanRadiance, RadianceImage};
use super::orientation::Orientation;
use super::point::sample_from_point;
use super::{EmittedRay, LightBounds, LightSample};
use irradiant_math::distribution::PiecewiseConstant2D;
use irradiant_math::elementary::tan;
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Ray, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Directions nearer than this to the plane of the projector get no light (pbrt-v4's near plane).
const HITHER: f32 = 1e-3;

/// A point that projects an image.
#[derive(Clone, Debug)]
pub struct ProjectionLight {
    /// Position, render space.
    pub p: Point3,
    orientation: Orientation,
    image: RadianceImage,
    scale: f32,
    screen: Screen,
    /// Mean, each pixel weighted by its solid angle: what power is proportional to.
    mean: MeanRadiance,
    mean_max: f32,
    distribution: PiecewiseConstant2D,
}

/// The slide at distance 1: half of its width and height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Screen {
    half: [f32; 2],
}

impl Screen {
    /// Of an image `width` by `height` pixels with `fov` degrees across the shorter side.
    pub fn new(width: usize, height: usize, fov: f32) -> Self {
        let t = tan(fov.to_radians() / 2.0);
        let aspect = width as f32 / height as f32;
        Self { half: if aspect > 1.0 { [aspect * t, t] } else { [t, t / aspect] } }
    }

    /// Area at distance 1.
    pub fn area(&self) -> f32 {
        4.0 * self.half[0] * self.half[1]
    }

    /// Light-space direction (y down), not unit: z is 1.
    fn direction(&self, uv: Point2) -> Vec3 {
        Vec3::new((2.0 * uv.x - 1.0) * self.half[0], (2.0 * uv.y - 1.0) * self.half[1], 1.0)
    }

    /// Where a unit light-space direction meets the slide.
    #[inline]
    fn uv(&self, w: Vec3) -> Option<Point2> {
        if w.z < HITHER {
            return None;
        }
        let (x, y) = (w.x / (w.z * self.half[0]), w.y / (w.z * self.half[1]));
        (x.abs() <= 1.0 && y.abs() <= 1.0).then(|| Point2::new(0.5 * x + 0.5, 0.5 * y + 0.5))
    }

    /// cos^3 of the angle to the axis: solid angle for a unit of area at distance 1.
    pub fn solid_angle_by_area(&self, uv: Point2) -> f32 {
        let length_squared = self.direction(uv).length_squared();
        1.0 / (length_squared * length_squared.sqrt())
    }
}

impl ProjectionLight {
    /// A projector at `p`; `orientation` is of a light space with y down; `None` for an image without pixels.
    pub fn new(p: Point3, orientation: Orientation, image: RadianceImage, scale: f32, fov: f32) -> Option<Self> {
        let screen = Screen::new(image.width(), image.height(), fov);
        let weights = image.sampling_weights(|uv| screen.solid_angle_by_area(uv));
        let mean = image.mean_radiance(|uv| screen.solid_angle_by_area(uv));
        let sum: f64 = image.pixels().map(|c| f64::from(c[0].max(c[1]).max(c[2]))).sum();
        let mean_max = (sum / image.pixels().len() as f64) as f32;
        let distribution = PiecewiseConstant2D::new(weights, image.width(), image.height())?;
        Some(Self { p, orientation, image, scale, screen, mean, mean_max, distribution })
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: Point3, lambda: &Wavelengths) -> Option<LightSample> {
        sample_from_point(self.p, at, |w| {
            let rgb = self.image.nearest(self.screen.uv(self.orientation.to_light(w))?);
            (rgb != [0.0; 3]).then(|| self.image.radiance(rgb, lambda) * self.scale)
        })
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.mean.sample(&self.image, lambda) * (self.scale * self.screen.area())
    }

    /// See [`super::Light::bounds`].
    pub fn bounds(&self) -> LightBounds {
        let corner = self.screen.direction(Point2::new(1.0, 1.0)).normalize();
        // In a light space that does not keep angles the cone is not known as simply: everywhere.
        let keeps_angles = self.orientation.stretch(corner) == 1.0 && self.orientation.stretch(Vec3::X) == 1.0;
        LightBounds {
            bounds: Bounds3 { min: self.p, max: self.p },
            axis: self.orientation.to_render(Vec3::Z),
            cos_normals: 1.0,
            cos_emission: if keeps_angles { (corner.z - 1e-3).max(0.0) } else { -1.0 },
            power: self.scale * self.mean_max,
            two_sided: false,
        }
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let s = self.distribution.sample(u_direction);
        let w = self.screen.direction(s.p).normalize();
        (s.pdf > 0.0 && w.z >= HITHER).then(|| EmittedRay {
            radiance: self.image.radiance(self.image.nearest(s.p), lambda) * self.scale,
            ray: Ray::new(self.p, self.orientation.to_render(w), time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0,
            pdf_direction: s.pdf
                / (self.screen.area() * self.screen.solid_angle_by_area(s.p) * self.orientation.stretch(w)),
            alpha: None,
        })
    }

    /// Density of [`ProjectionLight::emit`] for a direction.
    pub fn pdf_emit(&self, w: Vec3) -> f32 {
        let w = self.orientation.to_light(w);
        self.screen.uv(w).map_or(0.0, |uv| {
            self.distribution.pdf(uv)
                / (self.screen.area() * self.screen.solid_angle_by_area(uv) * self.orientation.stretch(w))
        })
    }
}
