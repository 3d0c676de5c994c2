//! Light from a point whose intensity by direction is an image: scene word `goniometric`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `I` | cd with `scale` 1 | white | spectrum of the intensity; its photometric size is taken out |
//! | `filename` | | | square equal-area octahedral image; the mean of R, G, B (or Y) multiplies `I` |
//! | `scale` | | 1 | factor |
//! | `power` | lm | | total luminous power; replaces the sizes of `I` and of the image |
//!
//! The image's +z is the light's +y, as in pbrt-v4; pixels are looked up without interpolation.

use super::orientation::Orientation;
use super::point::{isotropic_bounds, sample_from_point};
use super::{Emission, EmittedRay, LightBounds, LightSample};
use irradiant_math::distribution::PiecewiseConstant2D;
use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// A point with a directional image.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    /// Position, render space.
    pub p: Point3,
    orientation: Orientation,
    intensity: Emission,
    /// Square, row by row from the top.
    values: Box<[f32]>,
    size: usize,
    mean: f32,
    distribution: PiecewiseConstant2D,
}

impl GoniometricLight {
    /// From `size * size` finite, non-negative factors on `intensity`; `None` when they are not as many.
    ///
    /// `orientation` is that of the image's own axes (+z its centre).
    pub fn new(
        p: Point3,
        orientation: Orientation,
        intensity: Emission,
        values: Box<[f32]>,
        size: usize,
    ) -> Option<Self> {
        let distribution = PiecewiseConstant2D::new(values.to_vec(), size, size)?;
        let mean = (values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64) as f32;
        Some(Self { p, orientation, intensity, values, size, mean, distribution })
    }

    #[inline]
    fn factor(&self, uv: Point2) -> f32 {
        let pixel = |t: f32| ((t * self.size as f32) as usize).min(self.size - 1);
        self.values[pixel(uv.y) * self.size + pixel(uv.x)]
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: Point3, lambda: &Wavelengths) -> Option<LightSample> {
        sample_from_point(self.p, at, |w| {
            let factor = self.factor(warp::equal_area_sphere_to_square(self.orientation.to_light(w)));
            (factor > 0.0).then(|| self.intensity.sample(lambda) * factor)
        })
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.intensity.sample(lambda) * (4.0 * PI * self.mean)
    }

    /// See [`super::Light::bounds`]: as of an isotropic light of the same power.
    pub fn bounds(&self) -> LightBounds {
        isotropic_bounds(self.p, 4.0 * PI * self.intensity.max_value() * self.mean)
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let s = self.distribution.sample(u_direction);
        let w = warp::equal_area_square_to_sphere(s.p);
        (s.pdf > 0.0).then(|| EmittedRay {
            radiance: self.intensity.sample(lambda) * self.factor(s.p),
            ray: Ray::new(self.p, self.orientation.to_render(w), time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0,
            pdf_direction: s.pdf / (4.0 * PI * self.orientation.stretch(w)),
            alpha: None,
        })
    }

    /// Density of [`GoniometricLight::emit`] for a direction.
    pub fn pdf_emit(&self, w: Vec3) -> f32 {
        let w = self.orientation.to_light(w);
        self.distribution.pdf(warp::equal_area_sphere_to_square(w)) / (4.0 * PI * self.orientation.stretch(w))
    }
}
