//! The compiled scene: immutable, shared by threads, walked by integrators.
//!
//! [`Scene::compile`] makes it from a description, once; range checks happen there, so that rendering has no error
//! paths. Afterwards everything is an array reached by an id.

mod compile;
mod facts;
mod labels;
mod layers;
mod light_paths;

pub use compile::{CompileOptions, Compiled};
pub use facts::Facts;
pub use labels::Labels;
pub use layers::LayerPlan;
pub use light_paths::EmissionSampler;

use crate::camera::{Camera, CameraRay, FootprintEstimator};
use crate::film::filter::Filter;
use crate::film::{Film, PixelBounds};
use crate::geometry::{AlphaTextures, Geometry};
use crate::interaction::{Interaction, MaterialId, TextureContext};
use crate::light::{AlphaAt, LightSample, LightTarget, Lights};
use crate::light_sampler::LightSampler;
use crate::material::Materials;
use crate::sampler::Sampler;
use crate::texture::Textures;
use irradiant_math::{Normal3, Point2, Point3, Transform, Vec3};
use irradiant_scene::desc::FloatTextureRef;
use irradiant_spectrum::{Basis, ColorSpace, SampledSpectrum, Sensor, Spectrum, Wavelengths};
use std::sync::OnceLock;

/// Everything that a sample is a function of, but its pixel and index and the integrator.
pub struct Scene {
    /// What rays meet.
    pub geometry: Geometry,
    /// How it scatters.
    pub materials: Materials,
    /// What varies over it.
    pub textures: Textures,
    /// What shines.
    pub lights: Lights,
    /// Which light to ask.
    pub light_sampler: LightSampler,
    /// Where rays come from.
    pub camera: Camera,
    /// How samples weigh in a pixel.
    pub filter: Filter,
    /// Random numbers.
    pub sampler: Sampler,
    /// What the film keeps beside radiance.
    pub layers: LayerPlan,
    /// What surfaces are called.
    pub labels: Labels,
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    basis: Basis,
    sensor: Sensor,
    color_space: &'static ColorSpace,
    rgb_from_sensor: [[f32; 3]; 3],
    max_component: f32,
    white: Spectrum,
    resolution: [u32; 2],
    bounds: PixelBounds,
    footprint: Option<FootprintEstimator>,
    render_from_world: Transform,
    camera_from_world: Transform,
    pixel_jitter: bool,
    wavelength_jitter: bool,
    truncations: Vec<String>,
    biases: Vec<String>,
    facts: Facts,
    emission: OnceLock<EmissionSampler>,
}

/// Decides alpha tests with the scene's textures.
pub struct SceneAlpha<'a>(&'a Textures);

impl AlphaTextures for SceneAlpha<'_> {
    fn alpha(&self, texture: FloatTextureRef, at: &TextureContext) -> f32 {
        self.0.float(self.0.float_value(texture), at)
    }
}

impl Scene {
    /// An empty film for this scene.
    pub fn new_film(&self) -> Film {
        Film::new(self.resolution, self.bounds, self.layers.layers().to_vec())
    }

    /// The pixels that are rendered.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// Width and height of the whole picture, pixels.
    pub fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// The alpha test for rays.
    #[inline]
    pub fn alpha(&self) -> SceneAlpha<'_> {
        SceneAlpha(&self.textures)
    }

    /// In what light is counted, the same for all paths.
    #[inline]
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// Wavelengths of a path.
    #[inline]
    pub fn sample_wavelengths(&self, u: f32) -> Wavelengths {
        match self.basis {
            Basis::Spectral if self.wavelength_jitter => self.layers.sample_wavelengths(u),
            Basis::Spectral => self.layers.sample_wavelengths(0.5),
            Basis::Rgb => Wavelengths::rgb(),
        }
    }

    /// The pixel filter's random numbers, or the pixel's centre where jitter is switched off.
    #[inline(always)]
    pub fn film_draw(&self, u: Point2) -> Point2 {
        if self.pixel_jitter { u } else { Point2::new(0.5, 0.5) }
    }

    /// What the sensor makes of radiance: linear RGB of the film's colour space.
    #[inline(always)]
    pub fn film_rgb(&self, radiance: SampledSpectrum, lambda: &Wavelengths) -> [f32; 3] {
        self.film_rgb_of_response(self.sensor_response(radiance, lambda))
    }

    /// The first half of [`Scene::film_rgb`], linear in `radiance`: a sample's light may come in parts of different wavelengths.
    #[inline(always)]
    pub fn sensor_response(&self, radiance: SampledSpectrum, lambda: &Wavelengths) -> [f32; 3] {
        self.sensor.to_rgb(radiance, lambda)
    }

    /// The second half of [`Scene::film_rgb`], of a whole sample.
    #[inline(always)]
    pub fn film_rgb_of_response(&self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        if !self.max_component.is_finite() {
            return self.rgb_from_sensor([r, g, b]);
        }
        // Asked for by the scene; labelled as biased in the header.
        let most = r.max(g).max(b);
        let factor = if most > self.max_component { self.max_component / most } else { 1.0 };
        self.rgb_from_sensor([r * factor, g * factor, b * factor])
    }

    /// As [`Scene::film_rgb`], without the limit that the scene may set to a sample.
    #[inline]
    fn sensor_rgb(&self, radiance: SampledSpectrum, lambda: &Wavelengths) -> [f32; 3] {
        self.rgb_from_sensor(self.sensor.to_rgb(radiance, lambda))
    }

    #[inline(always)]
    fn rgb_from_sensor(&self, sensor: [f32; 3]) -> [f32; 3] {
        let row = |m: &[f32; 3]| m[0] * sensor[0] + m[1] * sensor[1] + m[2] * sensor[2];
        let [r, g, b] = &self.rgb_from_sensor;
        [row(r), row(g), row(b)]
    }

    /// The factor that the scene's limit of the sensor's response (`maxcomponentvalue`; biased) puts on a sample of this
    /// radiance: 1 unless there is one.
    #[inline]
    pub fn limit_factor(&self, radiance: SampledSpectrum, lambda: &Wavelengths) -> f32 {
        if !self.max_component.is_finite() {
            return 1.0;
        }
        let sensor = self.sensor.to_rgb(radiance, lambda);
        let most = sensor[0].max(sensor[1]).max(sensor[2]);
        if most > self.max_component { self.max_component / most } else { 1.0 }
    }

    /// What the sensor makes of a part of a sample's radiance, without limit: linear in `radiance`. With
    /// [`Scene::limit_factor`] of the whole sample, parts add up to [`Scene::film_rgb`] of the whole.
    #[inline]
    pub fn film_rgb_of_part(&self, radiance: SampledSpectrum, lambda: &Wavelengths) -> [f32; 3] {
        self.sensor_rgb(radiance, lambda)
    }

    /// The spectrum that the film shows as (1, 1, 1).
    #[inline]
    pub fn white(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.white.sample(lambda)
    }

    /// The film's colour space.
    pub fn color_space(&self) -> &'static ColorSpace {
        self.color_space
    }

    /// How a hit looks to textures. At the first hit the camera ray's differentials say how far apart neighbouring
    /// pixels' hits are; elsewhere it is estimated from the distance to the camera. Without a footprint where nobody will
    /// ask for it: at materials without textures, but for what the camera sees if there are layers.
    #[inline]
    pub fn texture_context(&self, at: &Interaction, camera_ray: Option<&CameraRay>) -> TextureContext {
        let shown = camera_ray.is_some() && self.layers.channels() > 0;
        match &self.footprint {
            Some(estimator) if shown || self.materials.is_textured(at.material) => {
                estimator.texture_context(at, camera_ray)
            }
            _ => TextureContext::point(at),
        }
    }

    /// True when something stands between a surface point and the end of a light sample. What lies behind a mix that holds an
    /// interface is left to rays that meet it, but for lights that no ray meets.
    #[inline]
    pub fn is_occluded(&self, at: &Interaction, sample: &LightSample) -> bool {
        if sample.is_delta && self.materials.may_pass() {
            return !self.is_lit(at, sample);
        }
        match sample.target {
            LightTarget::Infinite => self.geometry.occluded(&at.spawn_ray(sample.wi), f32::INFINITY, &self.alpha()),
            LightTarget::Point(p) => {
                let segment = at.spawn_ray_to(p, Vec3::ZERO, Normal3::ZERO);
                self.geometry.occluded_between(&segment, &self.alpha())
            }
            LightTarget::Surface { p, p_error, n, .. } => {
                self.geometry.occluded_between(&at.spawn_ray_to(p, p_error, n), &self.alpha())
            }
        }
    }

    /// How much of a light sample is there, in [0, 1]: the light's opacity where that is a texture, which lights do not
    /// know; else 1. (A constant opacity is in the sample's radiance already.)
    #[inline]
    pub fn opacity(&self, sample: &LightSample) -> f32 {
        match sample.alpha {
            None => 1.0,
            Some(alpha) => self.textured_opacity(alpha, sample.target),
        }
    }

    #[cold]
    fn textured_opacity(&self, alpha: AlphaAt, target: LightTarget) -> f32 {
        let (p, n) = match target {
            LightTarget::Surface { p, n, .. } => (p, n),
            LightTarget::Point(p) => (p, Normal3::ZERO),
            LightTarget::Infinite => (Point3::ZERO, Normal3::ZERO),
        };
        let at = TextureContext::without_footprint(p, n, alpha.uv, 0);
        self.clamped_opacity(alpha.texture, &at)
    }

    /// As rays see it: what is not more than 0 is not there.
    fn clamped_opacity(&self, texture: FloatTextureRef, at: &TextureContext) -> f32 {
        let value = self.alpha().alpha(texture, at);
        if value > 0.0 { value.min(1.0) } else { 0.0 }
    }

    /// World from render space.
    pub fn world_from_render(&self) -> Transform {
        self.render_from_world.inverse()
    }

    /// World to camera at shutter opening as OpenEXR wants it: row by row, for row vectors.
    pub fn world_to_camera(&self) -> [f32; 16] {
        std::array::from_fn(|i| self.camera_from_world.m[i % 4][i / 4] as f32)
    }

    /// What the scene itself leaves out, by its models' own limits; for the header.
    pub fn truncations(&self) -> &[String] {
        &self.truncations
    }

    /// What biases the picture because the scene asks for it; for the header.
    pub fn biases(&self) -> &[String] {
        &self.biases
    }

    /// Counts, for `check`.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Name of a material, or its kind.
    pub fn material_name(&self, id: MaterialId) -> &str {
        self.facts.material_names.get(id.0 as usize).map_or("?", String::as_str)
    }
}
