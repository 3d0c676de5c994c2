//! Light from a point into a cone with a soft border: scene word `spot`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `I` | cd with `scale` 1 | white | intensity on the axis; its photometric size is taken out |
//! | `scale` | | 1 | factor |
//! | `power` | lm | | total luminous power; replaces the size of `I` |
//! | `from`, `to` | scene units | origin, +z | position and target |
//! | `coneangle` | degrees | 30 | half-angle of the cone |
//! | `conedeltaangle` | degrees | 5 | width of the border inside the cone, a smoothstep in cos |

use super::orientation::Orientation;
use super::point::sample_from_point;
use super::{Emission, EmittedRay, LightBounds, LightSample};
use irradiant_math::elementary::{acos, cos, safe_sqrt, smoothstep};
use irradiant_math::{Bounds3, Frame, Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// A point that shines into a cone.
#[derive(Clone, Debug)]
pub struct SpotLight {
    /// Position, render space.
    pub p: Point3,
    /// Axis in light space, unit, towards the target.
    pub axis: Vec3,
    /// Light space for directions.
    pub orientation: Orientation,
    /// Intensity on the axis, scale included.
    pub intensity: Emission,
    /// Cosine at which the falloff starts.
    pub cos_start: f32,
    /// Cosine beyond which there is no light; at most `cos_start`.
    pub cos_end: f32,
}

impl SpotLight {
    /// The integral of the falloff over directions, sr: power for unit intensity.
    pub(super) fn solid_angle(cos_start: f32, cos_end: f32) -> f32 {
        2.0 * PI * ((1.0 - cos_start) + (cos_start - cos_end) / 2.0)
    }

    /// Smoothstep between the two cosines; a step where they are equal.
    #[inline]
    fn falloff(&self, cos_theta: f32) -> f32 {
        if self.cos_start == self.cos_end {
            return if cos_theta < self.cos_end { 0.0 } else { 1.0 };
        }
        smoothstep(cos_theta, self.cos_end, self.cos_start)
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: Point3, lambda: &Wavelengths) -> Option<LightSample> {
        sample_from_point(self.p, at, |w| {
            let falloff = self.falloff(self.axis.dot(self.orientation.to_light(w)));
            (falloff > 0.0).then(|| self.intensity.sample(lambda) * falloff)
        })
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.intensity.sample(lambda) * Self::solid_angle(self.cos_start, self.cos_end)
    }

    /// See [`super::Light::bounds`].
    pub fn bounds(&self) -> LightBounds {
        let between = (acos(self.cos_end) - acos(self.cos_start)).max(0.0);
        // A little wider, for the rounding of the angles in the importance.
        LightBounds {
            bounds: Bounds3 { min: self.p, max: self.p },
            axis: self.orientation.to_render(self.axis),
            cos_normals: self.cos_start,
            cos_emission: (cos(between) - 1e-3).max(-1.0),
            power: self.intensity.max_value() * 4.0 * PI,
            two_sided: false,
        }
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let (inner, border) = (1.0 - self.cos_start, (self.cos_start - self.cos_end) / 2.0);
        let p_inner = inner / (inner + border);
        let mut u = u_direction;
        // The bright middle is uniform in the cone; the border follows the falloff itself.
        let (local, pdf) = if u.x < p_inner {
            u.x /= p_inner;
            (warp::uniform_cone(u, self.cos_start), p_inner * warp::uniform_cone_pdf(self.cos_start))
        } else {
            u.x = ((u.x - p_inner) / (1.0 - p_inner)).min(1.0);
            let cos_theta = warp::smoothstep_density(u.x, self.cos_end, self.cos_start);
            let sin_theta = safe_sqrt(1.0 - cos_theta * cos_theta);
            let pdf = warp::smoothstep_density_pdf(cos_theta, self.cos_end, self.cos_start) / (2.0 * PI);
            (warp::spherical_direction(sin_theta, cos_theta, 2.0 * PI * u.y), (1.0 - p_inner) * pdf)
        };
        let w = Frame::from_z(self.axis).from_local(local);
        let falloff = self.falloff(local.z);
        (pdf > 0.0 && falloff > 0.0).then(|| EmittedRay {
            radiance: self.intensity.sample(lambda) * falloff,
            ray: Ray::new(self.p, self.orientation.to_render(w), time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0,
            pdf_direction: pdf / self.orientation.stretch(w),
            alpha: None,
        })
    }

    /// Density of [`SpotLight::emit`] for a direction.
    pub fn pdf_emit(&self, w: Vec3) -> f32 {
        let local = self.orientation.to_light(w);
        let cos_theta = self.axis.dot(local);
        let (inner, border) = (1.0 - self.cos_start, (self.cos_start - self.cos_end) / 2.0);
        let p_inner = inner / (inner + border);
        let pdf = if cos_theta >= self.cos_start {
            p_inner * warp::uniform_cone_pdf(self.cos_start)
        } else if cos_theta > self.cos_end {
            (1.0 - p_inner) * warp::smoothstep_density_pdf(cos_theta, self.cos_end, self.cos_start) / (2.0 * PI)
        } else {
            return 0.0;
        };
        pdf / self.orientation.stretch(local)
    }
}
