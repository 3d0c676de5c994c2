//! A witness for caustics: paths that begin at lights.

use crate::estimate::Estimate;
use irradiant::core::bxdf::TransportMode;
use irradiant::core::film::FilmTile;
use irradiant::core::scene::Scene;
use irradiant::math::{Normal3, Vec3};
use irradiant::renderer::RenderStats;
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::renderer::light_walk::{Arrival, shading_correction, start, walk};

/// Mirrors and glass on the way of a path at most; what is left after as many is far below any noise.
const MOST: u32 = 16;

/// Light that mirrors and glass gather on what the eye sees straight, L S+ D E, by one path from a light for each sample.
pub fn caustic(scene: &Scene, spp: u32) -> Estimate {
    let bounds = scene.bounds();
    let mut film = scene.new_film();
    let mut tile = FilmTile::new(bounds, film.channels_per_pixel());
    let mut stats = RenderStats::default();
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            for index in 0..spp {
                // Counts the path, whichever pixel shows it.
                tile.add(x, y, [0.0; 3], &[]);
                let sample = camera_sample(scene, [x, y], index);
                let mut lambda = sample.lambda;
                let Some(start) = start(scene, &sample.stream, &lambda, scene.camera.time(0.5)) else { continue };
                let mut gathered = true;
                walk(scene, &start, &sample.stream, &mut lambda, Some(MOST), &mut stats, |arrival, lambda, _| {
                    let Arrival { at, bsdf, power, depth } = arrival;
                    let specular = !bsdf.flags().is_non_specular();
                    if gathered && !specular && *depth > 0 {
                        let lens = sample.stream.light_path_lens(*depth);
                        if let Some(seen) = scene.connect_camera(at.p, lens, at.time)
                            && scene.is_visible(at, seen.origin, Vec3::ZERO, Normal3::ZERO)
                        {
                            let cos = bsdf.abs_cos(seen.w) * shading_correction(at, bsdf.frame.z, at.wo, seen.w);
                            let f = bsdf.f(at.wo, seen.w, TransportMode::Importance);
                            let brought = *power * f * (cos * seen.film_area);
                            scene.splat(seen.film, brought, lambda, |x, y, rgb| tile.splat(x, y, rgb));
                        }
                    }
                    gathered &= specular;
                });
            }
        }
    }
    film.merge_tile(&tile);
    let mut estimate = Estimate { width: bounds.width(), spp, stats, ..Estimate::default() };
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let light = film.splat_estimate(x, y);
            estimate.mean.push(light.mean);
            estimate.variance.push(light.variance);
        }
    }
    estimate
}
