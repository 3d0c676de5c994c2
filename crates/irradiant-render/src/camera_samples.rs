//! The loop that camera-based integrators share: each sample of each pixel of a work unit, from the camera's random
//! numbers to the film.

use crate::integrator::{RenderStats, WorkUnit};
use irradiant_core::camera::CameraRay;
use irradiant_core::film::FilmTile;
use irradiant_core::sampler::SampleStream;
use irradiant_core::scene::Scene;
use irradiant_math::Point2;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// A sample on its way: random numbers, wavelengths, the camera's ray.
#[derive(Clone, Copy)]
pub struct CameraSample<'a> {
    /// Pixel.
    pub pixel: [i32; 2],
    /// Sample index.
    pub index: u32,
    /// Its random numbers.
    pub stream: SampleStream<'a>,
    /// Its wavelengths, before any vertex has ended the secondary ones.
    pub lambda: Wavelengths,
    /// Weight of the pixel filter (mean 1).
    pub filter_weight: f32,
    /// The ray; none where the camera sees nothing (vignetting).
    pub camera_ray: Option<CameraRay>,
}

/// Draws the camera's part of a sample.
#[inline]
pub fn camera_sample(scene: &Scene, pixel: [i32; 2], index: u32) -> CameraSample<'_> {
    let stream = scene.sampler.stream(pixel, index);
    let draws = stream.camera();
    let lambda = scene.sample_wavelengths(draws.wavelength);
    let filtered = scene.filter.sample(scene.film_draw(draws.film));
    let film = Point2::new(pixel[0] as f32 + 0.5 + filtered.offset[0], pixel[1] as f32 + 0.5 + filtered.offset[1]);
    let lens = if scene.camera.has_lens() { stream.lens() } else { Point2::new(0.5, 0.5) };
    let camera_ray = scene.camera.generate_ray(film, lens, draws.time);
    CameraSample { pixel, index, stream, lambda, filter_weight: filtered.weight, camera_ray }
}

/// Takes all samples of a unit. `radiance` estimates what a camera ray sees (W m^-2 sr^-1 nm^-1 at the sample's
/// wavelengths, which it may reduce to one), and may fill the film's layers.
pub fn for_each_sample(
    scene: &Scene,
    unit: &WorkUnit,
    tile: &mut FilmTile,
    stats: &mut RenderStats,
    mut radiance: impl FnMut(&CameraSample, &CameraRay, &mut Wavelengths, &mut [f32], &mut RenderStats) -> SampledSpectrum,
) {
    let mut layers = vec![0f32; scene.layers.channels()];
    for y in unit.bounds.y0..unit.bounds.y1 {
        for x in unit.bounds.x0..unit.bounds.x1 {
            for index in unit.samples.clone() {
                let sample = camera_sample(scene, [x, y], index);
                stats.paths += 1;
                layers.fill(0.0);
                let mut rgb = [0.0; 3];
                if let Some(camera_ray) = &sample.camera_ray {
                    stats.camera_rays += 1;
                    let mut lambda = sample.lambda;
                    let l = radiance(&sample, camera_ray, &mut lambda, &mut layers, stats) * camera_ray.weight;
                    rgb = scene.film_rgb(l, &lambda).map(|c| c * sample.filter_weight);
                    scene.layers.add_buckets(l, &lambda, &mut layers);
                    layers.iter_mut().for_each(|value| *value *= sample.filter_weight);
                }
                if !tile.add(x, y, rgb, &layers) {
                    stats.refuse(x, y, index);
                }
            }
        }
    }
}
