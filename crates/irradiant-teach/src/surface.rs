//! A material at a point, asked directly: f, density and samples in its own frame.

use crate::context::{Context, Setup};
use crate::scenes;
use irradiant::Error;
use irradiant::core::bsdf::Bsdf;
use irradiant::core::bxdf::{BsdfSample, Sides, TransportMode};
use irradiant::core::scene::Scene;
use irradiant::math::{Point2, Vec3};
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::spectrum::{SampledSpectrum, Wavelengths};
use std::sync::Arc;

/// A material at the first thing that a camera sees. Directions are in its frame, z up.
pub struct Surface {
    bsdf: Bsdf,
    /// The wavelengths it was asked for.
    pub lambda: Wavelengths,
    /// Where it lies.
    pub scene: Arc<Scene>,
}

impl Surface {
    /// Of a material in the scene language, in RGB.
    pub fn new(context: &Context, material: &str) -> Result<Self, Error> {
        Self::of(context, material, Wavelengths::rgb())
    }

    /// At given wavelengths.
    pub fn of(context: &Context, material: &str, mut lambda: Wavelengths) -> Result<Self, Error> {
        let text = scenes::film(1)
            + "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 1\nWorldBegin\nLightSource \"infinite\"\n"
            + material
            + &scenes::quad([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]);
        let spectral = lambda.basis == irradiant::spectrum::Basis::Spectral;
        let scene = context.scene("surface", &text, Setup { spectral, ..Setup::default() })?;
        let sample = camera_sample(&scene, [0, 0], 0);
        let nothing = || Error::Internal("no surface before the camera".into());
        let ray = sample.camera_ray.ok_or_else(nothing)?.ray;
        let hit = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()).ok_or_else(nothing)?;
        let at = scene.geometry.interaction(&ray, &hit);
        let context = scene.texture_context(&at, None);
        let bsdf = scene
            .materials
            .bsdf(at.material, &scene.textures, &at, &context, &mut lambda, sample.stream.mix(0))
            .ok_or_else(nothing)?;
        Ok(Self { bsdf, lambda, scene })
    }

    /// The model itself.
    pub fn bsdf(&self) -> &Bsdf {
        &self.bsdf
    }

    fn world(&self, w: Vec3) -> Vec3 {
        self.bsdf.frame.from_local(w)
    }

    /// 1/sr.
    pub fn f(&self, wo: Vec3, wi: Vec3) -> SampledSpectrum {
        self.bsdf.f(self.world(wo), self.world(wi), TransportMode::Radiance)
    }

    /// Per steradian.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.bsdf.pdf(self.world(wo), self.world(wi), TransportMode::Radiance, Sides::All)
    }

    /// A direction; `wi` in the surface's frame.
    pub fn sample(&self, wo: Vec3, lobe: f32, u: Point2) -> Option<BsdfSample> {
        let mut s = self.bsdf.sample(self.world(wo), lobe, u, TransportMode::Radiance, Sides::All)?;
        s.wi = self.bsdf.frame.to_local(s.wi);
        Some(s)
    }
}
