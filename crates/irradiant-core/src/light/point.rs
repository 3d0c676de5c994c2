//! Light from a point in all directions alike: scene word `point`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `I` | cd with `scale` 1 | white | radiant intensity; its photometric size is taken out, as in pbrt-v4 |
//! | `scale` | | 1 | factor |
//! | `power` | lm | | total luminous power; replaces the size of `I` |
//! | `from` | scene units | origin | position |
//!
//! E = I cos / d^2 on a surface at distance d.

use super::{Emission, EmittedRay, LightBounds, LightSample, LightTarget};
use irradiant_math::{Bounds3, Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// A point that shines alike in all directions.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// Position, render space.
    pub p: Point3,
    /// Intensity, scale included.
    pub intensity: Emission,
}

/// What arrives at `at` from a point of intensity `intensity` at `p`; `None` at the point itself.
#[inline]
pub(super) fn sample_from_point(
    p: Point3,
    at: Point3,
    intensity: impl FnOnce(Vec3) -> Option<SampledSpectrum>,
) -> Option<LightSample> {
    let offset = p - at;
    let distance_squared = offset.length_squared();
    if distance_squared == 0.0 {
        return None;
    }
    let wi = offset * (1.0 / distance_squared.sqrt());
    let radiance = intensity(-wi)? * (1.0 / distance_squared);
    Some(LightSample { radiance, wi, pdf: 1.0, target: LightTarget::Point(p), is_delta: true, alpha: None })
}

/// The bounds of a point that may shine in any direction.
pub(super) fn isotropic_bounds(p: Point3, power: f32) -> LightBounds {
    LightBounds {
        bounds: Bounds3 { min: p, max: p },
        axis: Vec3::Z,
        cos_normals: -1.0,
        cos_emission: 0.0,
        power,
        two_sided: false,
    }
}

impl PointLight {
    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: Point3, lambda: &Wavelengths) -> Option<LightSample> {
        sample_from_point(self.p, at, |_| Some(self.intensity.sample(lambda)))
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.intensity.sample(lambda) * (4.0 * PI)
    }

    /// See [`super::Light::bounds`].
    pub fn bounds(&self) -> LightBounds {
        isotropic_bounds(self.p, 4.0 * PI * self.intensity.max_value())
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let w = warp::uniform_sphere(u_direction);
        Some(EmittedRay {
            radiance: self.intensity.sample(lambda),
            ray: Ray::new(self.p, w, time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0,
            pdf_direction: warp::uniform_sphere_pdf(),
            alpha: None,
        })
    }
}
