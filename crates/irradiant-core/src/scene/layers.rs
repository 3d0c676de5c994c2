//! Which layers a film keeps, and how samples fill them.

use super::Scene;
use crate::bsdf::Bsdf;
use crate::camera::CameraRay;
use crate::film::Layer;
use crate::interaction::{Interaction, TextureContext};
use irradiant_math::{Affine, Transform};
use irradiant_scene::desc::{FilmDesc, FilmKind};
use irradiant_spectrum::{Basis, ColorSpace, LAMBDA_MAX, LAMBDA_MIN, SampledSpectrum, Sensor, Wavelengths};

/// The layers of one film.
#[derive(Clone, Debug)]
pub struct LayerPlan {
    layers: Vec<Layer>,
    channels: usize,
    has_geometry: bool,
    /// Geometry layers' space from render space.
    space_from_render: Affine,
    /// Reflectance is shown by it, whatever the film's sensor.
    observer: Sensor,
    rgb_from_observer: [[f32; 3]; 3],
    first_bucket: usize,
    n_buckets: usize,
    lambda_range: [f32; 2],
    /// Write variances too.
    pub variance: bool,
}

impl LayerPlan {
    /// For a film whose RGB is that of `space`, in a render in `basis`. `camera_from_render` and `world_from_render` are
    /// at shutter opening.
    pub fn new(
        film: &FilmDesc,
        space: &'static ColorSpace,
        basis: Basis,
        camera_from_render: &Transform,
        world_from_render: &Transform,
    ) -> Self {
        let mut layers = Vec::new();
        let mut lambda_range = [LAMBDA_MIN, LAMBDA_MAX];
        let mut from_render = world_from_render;
        match &film.kind {
            FilmKind::Rgb => {}
            FilmKind::Gbuffer { camera_space } => {
                layers = vec![
                    Layer::Albedo,
                    Layer::Position,
                    Layer::DepthSlope,
                    Layer::Normal,
                    Layer::ShadingNormal,
                    Layer::Uv,
                    Layer::Hits,
                ];
                if *camera_space {
                    from_render = camera_from_render;
                }
            }
            FilmKind::Spectral { n_buckets, lambda_min, lambda_max } => {
                lambda_range = [lambda_min.value, lambda_max.value];
                let width = (lambda_max.value - lambda_min.value) / n_buckets.value as f32;
                layers.extend((0..n_buckets.value).map(|i| Layer::Bucket {
                    lambda_min: lambda_min.value + i as f32 * width,
                    lambda_max: lambda_min.value + (i + 1) as f32 * width,
                }));
            }
        }
        let n_buckets = layers.iter().filter(|l| matches!(l, Layer::Bucket { .. })).count();
        let channels = layers.iter().map(Layer::n_channels).sum();
        debug_assert_eq!(channels as u64, Self::channels_of(film));
        let observer = Sensor::cie1931();
        Self {
            rgb_from_observer: observer.output_rgb_from_sensor_rgb(space, basis),
            observer,
            has_geometry: layers.len() > n_buckets,
            first_bucket: channels - n_buckets,
            layers,
            channels,
            space_from_render: Affine::from_transform(from_render).unwrap_or_default(),
            n_buckets,
            lambda_range,
            variance: matches!(film.kind, FilmKind::Gbuffer { .. }),
        }
    }

    /// Number of channels that the layers of a film will have, without making them: what it says may be absurd.
    pub fn channels_of(film: &FilmDesc) -> u64 {
        match &film.kind {
            FilmKind::Rgb => 0,
            FilmKind::Gbuffer { .. } => 17,
            FilmKind::Spectral { n_buckets, .. } => n_buckets.value as u64,
        }
    }

    /// The layers, in the order of their channels.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Declares layers of radiance by kinds of paths, after all others, for an integrator that fills them itself.
    pub fn declare_paths(&mut self, layers: impl IntoIterator<Item = Layer>) {
        self.layers.extend(layers);
    }

    /// Number of channels that samples fill one by one: those of all layers but the declared layers of paths, which come
    /// after them.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Wavelengths of a path: where the eye sees, or, for a spectral film, evenly over its range.
    #[inline]
    pub fn sample_wavelengths(&self, u: f32) -> Wavelengths {
        if self.n_buckets == 0 {
            Wavelengths::sample_visible(u)
        } else {
            Wavelengths::sample_uniform(u, self.lambda_range[0], self.lambda_range[1])
        }
    }

    /// Fills the geometry layers from the first surface.
    pub fn fill(
        &self,
        values: &mut [f32],
        scene: &Scene,
        camera_ray: &CameraRay,
        at: &Interaction,
        footprint: &TextureContext,
        bsdf: &Bsdf,
        lambda: &Wavelengths,
    ) {
        if !self.has_geometry {
            return;
        }
        // Reflectance in the film's colours under its white, as the standard observer sees it: not the film's sensor,
        // exposure or limit (as pbrt-v4's `GBufferFilm::AddSample`).
        let seen = self.observer.to_rgb(bsdf.rho_hd(at.wo, 16) * scene.white(lambda), lambda);
        let m = &self.rgb_from_observer;
        let albedo: [f32; 3] = std::array::from_fn(|i| m[i][0] * seen[0] + m[i][1] * seen[1] + m[i][2] * seen[2]);
        let space = &self.space_from_render;
        let p = space.point(at.p);
        let slope = camera_ray.depth_slope(at, space);
        let n = space.normal(at.n).normalize();
        let ns = space.normal(at.ns).normalize();
        let all = [
            albedo[0],
            albedo[1],
            albedo[2],
            p.x,
            p.y,
            p.z,
            slope[0],
            slope[1],
            n.x,
            n.y,
            n.z,
            ns.x,
            ns.y,
            ns.z,
            footprint.uv.x,
            footprint.uv.y,
            1.0,
        ];
        values[..all.len()].copy_from_slice(&all);
    }

    /// Adds a sample's radiance to the buckets that its wavelengths fall in. The mean of a bucket estimates the mean
    /// radiance over its interval, W m^-2 sr^-1 nm^-1.
    #[inline]
    pub fn add_buckets(&self, radiance: SampledSpectrum, lambda: &Wavelengths, values: &mut [f32]) {
        if self.n_buckets == 0 || lambda.basis == Basis::Rgb {
            return;
        }
        let [lo, hi] = self.lambda_range;
        let width = (hi - lo) / self.n_buckets as f32;
        let n = lambda.lambda.len() as f32;
        for i in 0..lambda.lambda.len() {
            let pdf = lambda.pdf[i];
            let bucket = ((lambda.lambda[i] - lo) / width) as usize;
            if pdf > 0.0 && bucket < self.n_buckets {
                values[self.first_bucket + bucket] += radiance[i] / (pdf * n * width);
            }
        }
    }
}
