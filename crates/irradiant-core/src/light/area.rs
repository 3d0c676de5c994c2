//! Light from surfaces: scene word `AreaLightSource "diffuse"`.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `L` | cd/m^2 with `scale` 1 | white | radiance; its photometric size is taken out, but RGB keeps its own |
//! | `filename` | | | image of radiance over the shape's (u, v), v up; in place of `L` |
//! | `scale` | | 1 | factor |
//! | `power` | lm | | luminous power **of each triangle, patch or quadric** (as in pbrt-v4); replaces the size |
//! | `twosided` | | false | emits on the side of -n too |
//!
//! Opacity of the shape is opacity of the light. A constant alpha of 0 makes a surface that no ray meets and that yet
//! shines fully, as in pbrt-v4; it is then found by light sampling only and counts as a delta light.
//! Departure: where alpha lies between 0 and 1, pbrt-v4 tests it twice on hits (alpha^2 of the light) and once on
//! samples; here it counts once everywhere.

use super::emission::{MeanRadiance, RadianceImage};
use super::{AlphaAt, Emission, EmittedRay, LightBounds, LightHit, LightSample, LightTarget};
use crate::geometry::EmitterShape;
use crate::interaction::ReferencePoint;
use irradiant_math::interval::offset_ray_origin;
use irradiant_math::{Frame, Normal3, Point2, Ray, Vec3, warp};
use irradiant_scene::desc::FloatTextureRef;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;
use std::sync::Arc;

/// The radiance of an area light.
#[derive(Clone, Debug)]
pub enum AreaRadiance {
    /// The same everywhere.
    Uniform(Emission),
    /// An image over (u, v).
    Image(Arc<AreaImage>),
}

/// An image over a surface.
#[derive(Clone, Debug)]
pub struct AreaImage {
    /// The image.
    pub image: RadianceImage,
    /// Factor on it.
    pub scale: f32,
    /// Its mean.
    mean: MeanRadiance,
}

impl AreaRadiance {
    /// `scale` times an image.
    pub fn image(image: RadianceImage, scale: f32) -> Self {
        let mean = image.mean_radiance(|_| 1.0);
        Self::Image(Arc::new(AreaImage { image, scale, mean }))
    }
}

/// Opacity of an emitting surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaAlpha {
    /// The same everywhere, in (0, 1].
    Constant(f32),
    /// By a texture.
    Texture(FloatTextureRef),
    /// No ray meets the surface, but it shines.
    Unseen,
}

/// One emitting triangle, rectangle of two triangles, patch or quadric.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Where.
    pub shape: EmitterShape,
    /// How much, without `scale`.
    pub radiance: AreaRadiance,
    /// Factor on the radiance.
    pub scale: f32,
    /// Emits on the side of -n too.
    pub two_sided: bool,
    /// Opacity.
    pub alpha: AreaAlpha,
}

impl AreaLight {
    /// True when only light sampling finds it.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.alpha == AreaAlpha::Unseen
    }

    /// See [`super::Light::emitted`].
    #[inline]
    pub fn emitted(&self, n: Normal3, uv: Point2, w: Vec3, lambda: &Wavelengths) -> SampledSpectrum {
        if !self.two_sided && n.dot(w) < 0.0 {
            return SampledSpectrum::ZERO;
        }
        match &self.radiance {
            AreaRadiance::Uniform(emission) => emission.sample(lambda) * self.scale,
            AreaRadiance::Image(a) => {
                let rgb = a.image.bilinear(Point2::new(uv.x, 1.0 - uv.y));
                a.image.radiance(rgb, lambda) * (a.scale * self.scale)
            }
        }
    }

    /// Whether what it emits depends on surface parameters.
    #[inline]
    fn wants_uv(&self) -> bool {
        matches!(self.radiance, AreaRadiance::Image(_)) || matches!(self.alpha, AreaAlpha::Texture(_))
    }

    /// Factor on what a sample at `uv` brings, and the texture that is still to be asked.
    #[inline]
    fn opacity(&self, uv: Point2) -> (f32, Option<AlphaAt>) {
        match self.alpha {
            AreaAlpha::Constant(a) => (a, None),
            AreaAlpha::Texture(texture) => (1.0, Some(AlphaAt { texture, uv })),
            AreaAlpha::Unseen => (1.0, None),
        }
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, at: &ReferencePoint, u: Point2, lambda: &Wavelengths) -> Option<LightSample> {
        let s = self.shape.sample(at, u, self.wants_uv())?;
        let offset = s.p - at.p;
        let distance_squared = offset.length_squared();
        if !(s.pdf > 0.0 && distance_squared > 0.0) {
            return None;
        }
        let wi = offset * (1.0 / distance_squared.sqrt());
        if !self.two_sided && s.n.dot(wi) > 0.0 {
            return None;
        }
        let (factor, alpha) = self.opacity(s.uv);
        let radiance = self.emitted(s.n, s.uv, -wi, lambda) * factor;
        if radiance.is_black() {
            return None;
        }
        Some(LightSample {
            radiance,
            wi,
            pdf: s.pdf,
            target: LightTarget::Surface { p: s.p, p_error: s.p_error, n: s.n, uv: s.uv },
            is_delta: self.is_delta(),
            alpha,
        })
    }

    /// See [`super::Light::pdf_hit`].
    #[inline]
    pub fn pdf_hit(&self, at: &ReferencePoint, wi: Vec3, hit: &LightHit) -> f32 {
        self.shape.pdf(at, wi, hit.p, hit.n, hit.uv)
    }

    fn sides(&self) -> f32 {
        if self.two_sided { 2.0 } else { 1.0 }
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        let radiance = match &self.radiance {
            AreaRadiance::Uniform(emission) => emission.sample(lambda),
            AreaRadiance::Image(a) => a.mean.sample(&a.image, lambda) * a.scale,
        };
        radiance * (PI * self.sides() * self.shape.area() * self.scale)
    }

    /// See [`super::Light::bounds`].
    pub fn bounds(&self) -> LightBounds {
        let size = match &self.radiance {
            // Curves are never drawn from, so they should not be picked.
            _ if matches!(self.shape, EmitterShape::Curve(_)) => 0.0,
            AreaRadiance::Uniform(emission) => emission.max_value(),
            AreaRadiance::Image(a) => a.mean.rgb.iter().sum::<f32>() / 3.0 * a.scale,
        };
        let cone = self.shape.normal_cone();
        LightBounds {
            bounds: self.shape.bounds(),
            axis: cone.axis,
            cos_normals: cone.cos_angle,
            cos_emission: 0.0,
            power: size * self.scale * self.shape.area() * PI,
            two_sided: self.two_sided,
        }
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_position: Point2, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let s = self.shape.sample_area(u_position, self.wants_uv())?;
        let mut u = u_direction;
        // Choose a side, then a cosine-weighted direction on it.
        let flip = self.two_sided && u.x >= 0.5;
        if self.two_sided {
            u.x = if flip { 2.0 * u.x - 1.0 } else { 2.0 * u.x };
        }
        let mut local = warp::cosine_hemisphere(u);
        let pdf_direction = warp::cosine_hemisphere_pdf(local.z) / self.sides();
        if !(pdf_direction > 0.0 && s.pdf > 0.0) {
            return None;
        }
        if flip {
            local.z = -local.z;
        }
        let w = Frame::from_z(s.n.as_vec()).from_local(local);
        let (factor, alpha) = self.opacity(s.uv);
        Some(EmittedRay {
            radiance: self.emitted(s.n, s.uv, w, lambda) * factor,
            ray: Ray::new(offset_ray_origin(s.p, s.p_error, s.n, w), w, time),
            normal: s.n,
            uv: s.uv,
            pdf_position: s.pdf,
            pdf_direction,
            alpha,
        })
    }

    /// See [`super::Light::pdf_emit`].
    pub fn pdf_emit(&self, hit: &LightHit, w: Vec3) -> (f32, f32) {
        let cos = hit.n.dot(w);
        let direction = if self.two_sided {
            warp::cosine_hemisphere_pdf(cos.abs()) / 2.0
        } else {
            warp::cosine_hemisphere_pdf(cos.max(0.0))
        };
        (self.shape.pdf_area(hit.p, hit.n, hit.uv), direction)
    }
}
