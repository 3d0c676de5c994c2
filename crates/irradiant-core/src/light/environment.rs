//! Light from all around: scene word `infinite`, uniform or by an image.
//!
//! | parameter | unit | default | meaning |
//! |---|---|---|---|
//! | `L` | cd/m^2 with `scale` 1 | white | radiance from everywhere; its photometric size is taken out, but RGB keeps its own |
//! | `filename` | | | square image of radiance under the equal-area octahedral map, +z at its centre |
//! | `scale` | | 1 | factor |
//! | `illuminance` | lx | | replaces the size: of a uniform one on any surface; of an image see `compile.rs` |
//! | `portal` | world | | see [`super::portal`] |
//!
//! Pixels are constant patches (no interpolation), so the sampling density follows them exactly. When the caller also
//! samples BSDFs and weighs both (MIS), the density is *compensated*: pixels below the mean are left to the BSDF
//! (Karlik et al. 2019, "MIS compensation", as in pbrt-v4), and a uniform environment is left to it altogether.

use super::emission::{MeanRadiance, RadianceImage};
use super::environment_density::{PixelDensity, PixelLine, PixelRun, PixelSample};
use super::orientation::Orientation;
use super::{Emission, EmittedRay, LightSample, LightTarget, SampleMode, SceneSphere};
use irradiant_math::{Normal3, Point2, Vec3, warp};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::f32::consts::PI;
use std::sync::OnceLock;

/// The same radiance from everywhere.
#[derive(Clone, Debug)]
pub struct UniformInfiniteLight {
    /// Scale included.
    pub radiance: Emission,
    /// The scene.
    pub scene: SceneSphere,
}

impl UniformInfiniteLight {
    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, u: Point2, lambda: &Wavelengths, mode: SampleMode) -> Option<LightSample> {
        if mode == SampleMode::Compensated {
            return None;
        }
        Some(LightSample {
            radiance: self.radiance.sample(lambda),
            wi: warp::uniform_sphere(u),
            pdf: warp::uniform_sphere_pdf(),
            target: LightTarget::Infinite,
            is_delta: false,
            alpha: None,
        })
    }

    /// See [`super::Light::pdf_escaped`].
    #[inline]
    pub fn pdf(&self, mode: SampleMode) -> f32 {
        match mode {
            SampleMode::Complete => warp::uniform_sphere_pdf(),
            SampleMode::Compensated => 0.0,
        }
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.radiance.sample(lambda) * (4.0 * PI * self.scene.disk_area())
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_position: Point2, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        Some(EmittedRay {
            radiance: self.radiance.sample(lambda),
            ray: self.scene.ray_into(warp::uniform_sphere(u_direction), u_position, time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0 / self.scene.disk_area(),
            pdf_direction: warp::uniform_sphere_pdf(),
            alpha: None,
        })
    }
}

/// A direction to a sky and what shines there, whatever the wavelengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPoint {
    /// Unit, render space.
    pub wi: Vec3,
    /// Density with which light samples that are weighed against hits find it, 1/sr.
    pub pdf: f32,
    /// The colour of the image; 1 where there is none.
    pub rgb: [f32; 3],
}

/// An environment that is the same from everywhere in the scene.
#[derive(Clone, Copy, Debug)]
pub enum Sky<'a> {
    /// The same in all directions.
    Uniform(&'a UniformInfiniteLight),
    /// An image.
    Image(&'a ImageInfiniteLight),
}

impl Sky<'_> {
    /// The point that light samples draw which are weighed against hits; `None` where they draw none.
    #[inline]
    pub fn draw(&self, u: Point2) -> Option<SkyPoint> {
        match self {
            Self::Uniform(_) => None,
            Self::Image(light) => {
                let s = light.density(SampleMode::Compensated).sample(&light.image, u)?;
                let (wi, pdf) = light.direction(s.uv, s.pdf);
                Some(SkyPoint { wi, pdf, rgb: s.rgb })
            }
        }
    }

    /// What is in this direction, whose `place` in the image may be known ([`ImageInfiniteLight::place`]).
    #[inline]
    pub fn look(&self, wi: Vec3, place: Option<Point2>) -> SkyPoint {
        match self {
            Self::Uniform(light) => SkyPoint { wi, pdf: light.pdf(SampleMode::Compensated), rgb: [1.0; 3] },
            Self::Image(light) => {
                let rgb = light.image.nearest(place.unwrap_or_else(|| light.place(wi)));
                SkyPoint { wi, pdf: light.pdf_of(rgb, wi, SampleMode::Compensated), rgb }
            }
        }
    }

    /// Radiance at a point.
    #[inline]
    pub fn radiance(&self, point: &SkyPoint, lambda: &Wavelengths) -> SampledSpectrum {
        match self {
            Self::Uniform(light) => light.radiance.sample(lambda),
            Self::Image(light) => light.radiance(point.rgb, lambda),
        }
    }
}

/// Radiance by direction from an image.
#[derive(Debug)]
pub struct ImageInfiniteLight {
    image: RadianceImage,
    orientation: Orientation,
    scale: f32,
    scene: SceneSphere,
    mean: MeanRadiance,
    /// Each is made when first asked for; a render needs but one of them.
    complete: OnceLock<PixelDensity>,
    compensated: OnceLock<PixelDensity>,
}

impl ImageInfiniteLight {
    /// From a square image; `None` when it is not square.
    pub fn new(image: RadianceImage, orientation: Orientation, scale: f32, scene: SceneSphere) -> Option<Self> {
        let mean = image.mean_radiance(|_| 1.0);
        (image.width() == image.height()).then(|| Self {
            image,
            orientation,
            scale,
            scene,
            mean,
            complete: OnceLock::new(),
            compensated: OnceLock::new(),
        })
    }

    pub(super) fn scene(&self) -> &SceneSphere {
        &self.scene
    }

    #[inline(always)]
    fn density(&self, mode: SampleMode) -> &PixelDensity {
        let cell = match mode {
            SampleMode::Complete => &self.complete,
            SampleMode::Compensated => &self.compensated,
        };
        cell.get_or_init(|| {
            PixelDensity::new(&self.image, mode == SampleMode::Compensated).expect("a square image has a pixel")
        })
    }

    /// Radiance where the image has this colour.
    #[inline]
    pub(super) fn radiance(&self, rgb: [f32; 3], lambda: &Wavelengths) -> SampledSpectrum {
        self.image.radiance(rgb, lambda) * self.scale
    }

    /// See [`super::Light::sample`].
    #[inline]
    pub fn sample(&self, u: Point2, lambda: &Wavelengths, mode: SampleMode) -> Option<LightSample> {
        Some(self.light_from(self.density(mode).sample(&self.image, u)?, lambda))
    }

    /// The first of three steps to what [`ImageInfiniteLight::sample`] gives for `u`. Each asks for the memory that the next one
    /// reads: take each for many samples before the next, and no one waits.
    #[inline(always)]
    pub fn seek(&self, u: Point2, mode: SampleMode) -> PixelLine {
        let line = self.density(mode).seek(u);
        self.density(mode).prefetch_line(&line);
        line
    }

    /// The second step.
    #[inline(always)]
    pub fn approach(&self, line: PixelLine, mode: SampleMode) -> PixelRun {
        let run = self.density(mode).approach(line);
        self.density(mode).prefetch_run(&self.image, &run);
        run
    }

    /// The last.
    #[inline]
    pub fn arrive(&self, run: PixelRun, lambda: &Wavelengths, mode: SampleMode) -> Option<LightSample> {
        Some(self.light_from(self.density(mode).arrive(&self.image, run)?, lambda))
    }

    /// The last, but for what [`ImageInfiniteLight::direction`] and [`ImageInfiniteLight::radiance`] say of it.
    #[inline(always)]
    pub(super) fn arrive_at(&self, run: PixelRun, mode: SampleMode) -> Option<PixelSample> {
        self.density(mode).arrive(&self.image, run)
    }

    /// The direction to a point of the image, and the density with which it is drawn where that of the point is `pdf`.
    #[inline(always)]
    pub(super) fn direction(&self, uv: Point2, pdf: f32) -> (Vec3, f32) {
        let w = warp::equal_area_square_to_sphere(uv);
        (self.orientation.to_render(w), pdf / (4.0 * PI * self.orientation.stretch(w)))
    }

    #[inline]
    fn light_from(&self, s: PixelSample, lambda: &Wavelengths) -> LightSample {
        let (wi, pdf) = self.direction(s.uv, s.pdf);
        LightSample {
            radiance: self.radiance(s.rgb, lambda),
            wi,
            pdf,
            target: LightTarget::Infinite,
            is_delta: false,
            alpha: None,
        }
    }

    /// The point of the image that a ray in this direction sees, whose memory is asked for: looking up a sky is waiting.
    #[inline]
    pub fn place(&self, direction: Vec3) -> Point2 {
        let uv = self.place_of(direction);
        self.prefetch(uv);
        uv
    }

    /// As [`ImageInfiniteLight::place`], without asking for its memory.
    #[inline(always)]
    pub(super) fn place_of(&self, direction: Vec3) -> Point2 {
        warp::equal_area_sphere_to_square(self.orientation.to_light(direction))
    }

    /// Asks for the memory of a point of the image.
    #[inline]
    pub fn prefetch(&self, uv: Point2) {
        self.image.prefetch(uv);
    }

    #[inline]
    fn pdf_of(&self, rgb: [f32; 3], wi: Vec3, mode: SampleMode) -> f32 {
        let stretch = self.orientation.stretch(self.orientation.to_light(wi));
        self.density(mode).pdf(rgb) / (4.0 * PI * stretch)
    }

    /// See [`super::Light::pdf_escaped`].
    #[inline]
    pub fn pdf(&self, wi: Vec3, mode: SampleMode) -> f32 {
        self.pdf_of(self.image.nearest(self.place(wi)), wi, mode)
    }

    /// See [`super::Light::escaped`].
    #[inline]
    pub fn escaped(&self, direction: Vec3, lambda: &Wavelengths) -> SampledSpectrum {
        self.radiance(self.image.nearest(self.place(direction)), lambda)
    }

    /// See [`super::Light::escaped_and_pdf`].
    #[inline]
    pub fn escaped_and_pdf(
        &self,
        direction: Vec3,
        place: Option<Point2>,
        lambda: &Wavelengths,
        mode: SampleMode,
    ) -> (SampledSpectrum, f32) {
        let rgb = self.image.nearest(place.unwrap_or_else(|| self.place(direction)));
        (self.radiance(rgb, lambda), self.pdf_of(rgb, direction, mode))
    }

    /// See [`super::Light::power`].
    pub fn power(&self, lambda: &Wavelengths) -> SampledSpectrum {
        self.mean.sample(&self.image, lambda) * (self.scale * 4.0 * PI * self.scene.disk_area())
    }

    /// See [`super::Light::emit`].
    pub fn emit(&self, u_position: Point2, u_direction: Point2, lambda: &Wavelengths, time: f32) -> Option<EmittedRay> {
        let s = self.sample(u_direction, lambda, SampleMode::Complete)?;
        Some(EmittedRay {
            radiance: s.radiance,
            ray: self.scene.ray_into(-s.wi, u_position, time),
            normal: Normal3::ZERO,
            uv: Point2::ZERO,
            pdf_position: 1.0 / self.scene.disk_area(),
            pdf_direction: s.pdf,
            alpha: None,
        })
    }
}
