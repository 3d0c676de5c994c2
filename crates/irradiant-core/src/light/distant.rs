//! Parallel light from infinitely far: scene word `distant`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `L` | lx with `scale` 1 | white | irradiance on a facing surface; its photometric size is taken out |
//! | `scale` | | 1 | factor |
//! | `illuminance` | lx | | replaces the size of `L` |
//! | `from`, `to` | | origin, +z | light travels from `from` towards `to` |

use super::{Emission, EmittedRay, LightSample, LightTarget, SceneSphere};
use irradiant_math::{Normal3, Point2, Vec3};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Light of a single direction.
#[derive(Clone, Debug)]
pub struct DistantLight {
    /// Towards the light, unit, render space.
    pub wi: Vec3,
    /// Irradiance on a facing surface, scale included.
    pub irradiance: Emission,
    /// The scene.
    pub scene: SceneSphere,
}

impl DistantLight {
    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, lambda: &Wavelengths) -> Option<LightSample> {
        Some(LightSample {
            radiance: self.irradiance.sample(lambda),
            wi: self.wi,
            pdf: 1.0,
            target: LightTarget::Infinite,
            is_delta: true,
            alpha: None,
        })
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.irradiance.sample(lambda) * self.scene.disk_area()
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_position: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        Some(EmittedRay {
            radiance: self.irradiance.sample(lambda),
            ray: self.scene.ray_into(-self.wi, u_position, time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0 / self.scene.disk_area(),
            pdf_direction: 1.0,
            alpha: None,
        })
    }
}
