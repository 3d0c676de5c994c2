//! Where light comes from: one enum of plain lights, split by role.
//!
//! - next-event estimation: [`Light::sample`], with [`Light::pdf_hit`] and [`Light::pdf_escaped`] for MIS;
//! - rays that met a light: [`Light::emitted`] for surfaces, [`Light::escaped`] for environments;
//! - light tracing: [`Light::emit`] and [`Light::pdf_emit`];
//! - choosing among lights: [`Light::power`] and [`Light::bounds`].
//!
//! Everything is in render space. Spectra are per nanometre, scaled as pbrt-v4 scales them: the photometric size of the
//! author's spectrum is divided out (of an RGB one, that of its illuminant only), so a white light of 1 makes 1 on the
//! film; `scale`, `power` and `illuminance` then apply. What each light can be told stands at the top of its file.
//!
//! Files, in reading order: [`point`], [`spot`], [`goniometric`], [`projection`], [`distant`], [`area`],
//! [`environment`], [`portal`]; [`emission`] (spectra and images of radiance), [`orientation`], [`bounds`];
//! [`compile`] (from the description); [`origin`] (whose they are).
//!
//! Sources: Pharr, Jakob and Humphreys 2023, "Physically Based Rendering", chapter 12.

pub mod area;
pub mod bounds;
pub mod compile;
pub mod distant;
pub mod emission;
pub mod environment;
pub mod goniometric;
pub mod orientation;
pub mod origin;
pub mod point;
pub mod portal;
pub mod projection;
mod sky_lanes;
pub mod spot;
mod target_lanes;

mod environment_density;

#[cfg(test)]
mod tests;

pub use area::{AreaAlpha, AreaLight, AreaRadiance};
pub use bounds::LightBounds;
pub use compile::{LightContext, Lights};
pub use distant::DistantLight;
pub use emission::{Emission, RadianceImage};
pub use environment::{ImageInfiniteLight, Sky, SkyPoint, UniformInfiniteLight};
pub use environment_density::{PixelLine, PixelRun};
pub use goniometric::GoniometricLight;
pub use orientation::Orientation;
pub use origin::{LightOrigin, LightOrigins};
pub use point::PointLight;
pub use portal::PortalInfiniteLight;
pub use projection::ProjectionLight;
pub use sky_lanes::{SkyLanes, places_of_sky};
pub use spot::SpotLight;
pub use target_lanes::TargetLanes;

use crate::interaction::{Interaction, ReferencePoint};
use irradiant_math::{Bounds3, Frame, Normal3, Point2, Point3, Ray, Vec3, warp};
use irradiant_scene::desc::FloatTextureRef;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;

/// A light. Big ones are boxed, so that a scene of many small emitters stays small.
#[derive(Debug)]
pub enum Light {
    /// From a point, all directions alike.
    Point(PointLight),
    /// From a single direction.
    Distant(DistantLight),
    /// From a point, a cone.
    Spot(SpotLight),
    /// From a point, by an image of directions.
    Goniometric(Box<GoniometricLight>),
    /// From a point, a slide.
    Projection(Box<ProjectionLight>),
    /// From a surface.
    Area(AreaLight),
    /// From everywhere.
    UniformInfinite(UniformInfiniteLight),
    /// From everywhere, by an image of directions.
    ImageInfinite(Box<ImageInfiniteLight>),
    /// From everywhere, through a portal.
    PortalInfinite(Box<PortalInfiniteLight>),
}

/// How completely light sampling must cover what a light shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleMode {
    /// All directions that shine can be drawn: right without MIS.
    Complete,
    /// Directions that BSDF sampling serves well may be left out: less noise, right only with MIS.
    Compensated,
}

/// Where a shadow ray must go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightTarget {
    /// To a point in space.
    Point(Point3),
    /// To a point on a surface.
    Surface {
        /// The point, render space.
        p: Point3,
        /// Bound of its error.
        p_error: Vec3,
        /// Geometric normal.
        n: Normal3,
        /// Surface parameters, where the light depends on them.
        uv: Point2,
    },
    /// Out of the scene, along `wi`.
    Infinite,
}

/// A texture that decides how much of a sample is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlphaAt {
    /// The texture.
    pub texture: FloatTextureRef,
    /// Where on the surface.
    pub uv: Point2,
}

/// Light drawn towards a point, before visibility.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Incident radiance; of delta lights irradiance on a facing surface.
    pub radiance: SampledSpectrum,
    /// Towards the light, unit.
    pub wi: Vec3,
    /// Density of `wi` per solid angle; 1 for point and distant lights.
    pub pdf: f32,
    /// Where the shadow ray ends.
    pub target: LightTarget,
    /// No BSDF sample can find this light: no MIS.
    pub is_delta: bool,
    /// Opacity that is still to be multiplied on: lights do not know textures.
    pub alpha: Option<AlphaAt>,
}

/// A point of a surface that emits, as a ray found it.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// The point, render space.
    pub p: Point3,
    /// Geometric normal, unit, on the outer side.
    pub n: Normal3,
    /// Surface parameters.
    pub uv: Point2,
}

impl From<&Interaction> for LightHit {
    #[inline]
    fn from(at: &Interaction) -> Self {
        Self { p: at.p, n: at.n, uv: at.uv }
    }
}

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay {
    /// Emitted radiance; of point lights intensity; of distant ones irradiance.
    pub radiance: SampledSpectrum,
    /// The ray.
    pub ray: Ray,
    /// Of the surface that it leaves, for the cosine; zero where there is none.
    pub normal: Normal3,
    /// Parameters there, where the light depends on them.
    pub uv: Point2,
    /// Density of the origin per area; 1 for points.
    pub pdf_position: f32,
    /// Density of the direction per solid angle; 1 for distant lights.
    pub pdf_direction: f32,
    /// Opacity that is still to be multiplied on.
    pub alpha: Option<AlphaAt>,
}

/// A sphere around the whole scene, for lights at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSphere {
    /// Centre, render space.
    pub center: Point3,
    /// Radius; never 0.
    pub radius: f32,
}

impl SceneSphere {
    /// Around a box; an empty or point-like one counts as of radius 1.
    pub fn new(bounds: &Bounds3) -> Self {
        let (center, radius) = bounds.bounding_sphere();
        Self { center, radius: if radius > 0.0 && radius.is_finite() { radius } else { 1.0 } }
    }

    /// Area of its great disk.
    #[inline]
    pub fn disk_area(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// A ray of direction `w` that starts outside, uniform over the scene's disk.
    fn ray_into(&self, w: Vec3, u: Point2, time: f32) -> Ray {
        let d = warp::uniform_disk_concentric(u);
        let frame = Frame::from_z(w);
        Ray::new(self.center + (frame.x * d.x + frame.y * d.y - w) * self.radius, w, time)
    }
}

impl Light {
    /// True when no BSDF sample can find it.
    #[inline]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Point(_) | Self::Distant(_) | Self::Spot(_) | Self::Goniometric(_) | Self::Projection(_) => true,
            Self::Area(l) => l.is_delta(),
            Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::PortalInfinite(_) => false,
        }
    }

    /// True for environments, which rays that leave the scene meet. (Distant lights are not: no ray meets them.)
    #[inline]
    pub fn is_environment(&self) -> bool {
        match self {
            Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::PortalInfinite(_) => true,
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::Area(_) => false,
        }
    }

    /// Draws light towards `at`, by `u` in [0, 1)^2; `None` when there is nothing to draw.
    ///
    /// With `Compensated` only what MIS leaves to light sampling is drawn.
    #[inline]
    pub fn sample(
        &self,
        at: &ReferencePoint,
        u: Point2,
        lambda: &Wavelengths,
        mode: SampleMode,
    ) -> Option<LightSample> {
        match self {
            Self::Area(l) => l.sample(at, u, lambda),
            Self::Point(l) => l.sample(at.p, lambda),
            Self::Distant(l) => l.sample(lambda),
            Self::Spot(l) => l.sample(at.p, lambda),
            Self::Goniometric(l) => l.sample(at.p, lambda),
            Self::Projection(l) => l.sample(at.p, lambda),
            Self::UniformInfinite(l) => l.sample(u, lambda, mode),
            Self::ImageInfinite(l) => l.sample(u, lambda, mode),
            Self::PortalInfinite(l) => l.sample(at.p, u, lambda),
        }
    }

    /// Density per solid angle with which [`Light::sample`] would have drawn the point `hit` of this light, seen from
    /// `at` in direction `wi`; 0 for lights that are not surfaces.
    #[inline]
    pub fn pdf_hit(&self, at: &ReferencePoint, wi: Vec3, hit: &LightHit) -> f32 {
        match self {
            Self::Area(l) => l.pdf_hit(at, wi, hit),
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::UniformInfinite(_)
            | Self::ImageInfinite(_)
            | Self::PortalInfinite(_) => 0.0,
        }
    }

    /// Density per solid angle with which [`Light::sample`] would have drawn the direction `wi`, unit, in which a ray
    /// from `at` left the scene; 0 for lights that are not environments.
    #[inline]
    pub fn pdf_escaped(&self, at: &ReferencePoint, wi: Vec3, mode: SampleMode) -> f32 {
        match self {
            Self::UniformInfinite(l) => l.pdf(mode),
            Self::ImageInfinite(l) => l.pdf(wi, mode),
            Self::PortalInfinite(l) => l.pdf(at.p, wi),
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::Area(_) => 0.0,
        }
    }

    /// Radiance that leaves a point of this surface in direction `w`; `n` is the geometric normal. Black for other lights.
    #[inline]
    pub fn emitted(&self, n: Normal3, uv: Point2, w: Vec3, lambda: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::Area(l) => l.emitted(n, uv, w, lambda),
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::UniformInfinite(_)
            | Self::ImageInfinite(_)
            | Self::PortalInfinite(_) => SampledSpectrum::ZERO,
        }
    }

    /// Radiance that comes along a ray which left the scene. Black for lights that are not environments.
    #[inline]
    pub fn escaped(&self, ray: &Ray, lambda: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::UniformInfinite(l) => l.radiance.sample(lambda),
            Self::ImageInfinite(l) => l.escaped(ray.d, lambda),
            Self::PortalInfinite(l) => l.escaped(ray.o, ray.d, lambda),
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::Area(_) => SampledSpectrum::ZERO,
        }
    }

    /// [`Light::escaped`], and [`Light::pdf_escaped`] as seen from `at` (0 without), at once. `place` is where the light's
    /// image is seen, if [`Lights::place_of_escape`] has found it already.
    #[inline]
    pub fn escaped_and_pdf(
        &self,
        ray: &Ray,
        place: Option<Point2>,
        at: Option<&ReferencePoint>,
        lambda: &Wavelengths,
        mode: SampleMode,
    ) -> (SampledSpectrum, f32) {
        if let Self::ImageInfinite(l) = self {
            let (radiance, pdf) = l.escaped_and_pdf(ray.d, place, lambda, mode);
            return (radiance, if at.is_some() { pdf } else { 0.0 });
        }
        (self.escaped(ray, lambda), at.map_or(0.0, |at| self.pdf_escaped(at, ray.d, mode)))
    }

    /// Emitted power per nanometre; of lights at infinity what crosses the scene's disk.
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::Point(l) => l.power(lambda),
            Self::Distant(l) => l.power(lambda),
            Self::Spot(l) => l.power(lambda),
            Self::Goniometric(l) => l.power(lambda),
            Self::Projection(l) => l.power(lambda),
            Self::Area(l) => l.power(lambda),
            Self::UniformInfinite(l) => l.power(lambda),
            Self::ImageInfinite(l) => l.power(lambda),
            Self::PortalInfinite(l) => l.power(lambda),
        }
    }

    /// Where it is and where it shines to; `None` for lights at infinity.
    pub fn bounds(&self) -> Option<LightBounds> {
        match self {
            Self::Point(l) => Some(l.bounds()),
            Self::Spot(l) => Some(l.bounds()),
            Self::Goniometric(l) => Some(l.bounds()),
            Self::Projection(l) => Some(l.bounds()),
            Self::Area(l) => Some(l.bounds()),
            Self::Distant(_) | Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::PortalInfinite(_) => None,
        }
    }

    /// Draws a ray that leaves the light, for light tracing; `None` when there is nothing to draw.
    ///
    /// Its share of power is radiance cos / (pdf_position pdf_direction), cos to `normal` where there is one.
    pub fn emit(&self, u_position: Point2, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        match self {
            Self::Point(l) => l.emit(u_direction, lambda, time),
            Self::Distant(l) => l.emit(u_position, lambda, time),
            Self::Spot(l) => l.emit(u_direction, lambda, time),
            Self::Goniometric(l) => l.emit(u_direction, lambda, time),
            Self::Projection(l) => l.emit(u_direction, lambda, time),
            Self::Area(l) => l.emit(u_position, u_direction, lambda, time),
            Self::UniformInfinite(l) => l.emit(u_position, u_direction, lambda, time),
            Self::ImageInfinite(l) => l.emit(u_position, u_direction, lambda, time),
            Self::PortalInfinite(l) => l.emit(u_position, u_direction, lambda, time),
        }
    }

    /// Normal of the surface that rays of a light at infinity are drawn on; zero where they are drawn on disks that face
    /// them, and for other lights.
    pub fn emission_normal(&self) -> Normal3 {
        match self {
            Self::PortalInfinite(l) => l.normal(),
            Self::Point(_)
            | Self::Distant(_)
            | Self::Spot(_)
            | Self::Goniometric(_)
            | Self::Projection(_)
            | Self::Area(_)
            | Self::UniformInfinite(_)
            | Self::ImageInfinite(_) => Normal3::ZERO,
        }
    }

    /// Densities (per area, per solid angle) with which [`Light::emit`] draws a ray of direction `w` from the point `hit`
    /// (which only area lights look at); what is a delta counts 0.
    pub fn pdf_emit(&self, hit: &LightHit, w: Vec3) -> (f32, f32) {
        match self {
            Self::Point(_) => (0.0, warp::uniform_sphere_pdf()),
            Self::Distant(l) => (1.0 / l.scene.disk_area(), 0.0),
            Self::Spot(l) => (0.0, l.pdf_emit(w)),
            Self::Goniometric(l) => (0.0, l.pdf_emit(w)),
            Self::Projection(l) => (0.0, l.pdf_emit(w)),
            Self::Area(l) => l.pdf_emit(hit, w),
            Self::UniformInfinite(l) => (1.0 / l.scene.disk_area(), warp::uniform_sphere_pdf()),
            Self::ImageInfinite(l) => (1.0 / l.scene().disk_area(), l.pdf(-w, SampleMode::Complete)),
            Self::PortalInfinite(l) => l.pdf_emit(w),
        }
    }
}
