//! Lecture B's naive approach (B12): "recursive ray tracing as for mirror reflection, but shoot many rays in each step". b rays from each
//! surface, b^k after k bounces: "exponentially more longer paths than shorter paths, but longer paths contribute less". The statistics
//! count the rays at each depth.
//!
//! The slide has no code. Light counts where a ray meets it, as in [`super::tries`], which is this with b = 1; so point lights are not
//! seen. From ideal mirrors and glass one ray leaves, since all b would be the same or cost twice.
//!
//! Without a depth limit the recursion stops after `stop` events, which the label says.

use super::directions::{DIRECTIONS, Directions, GLASS};
use super::walk::{self, Walk};
use super::{depth_limit, unsampled_lights};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::registry::{IntegratorEntry, OptionEntry, OptionRange, Value};
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use irradiant_math::Ray;
use irradiant_spectrum::SampledSpectrum;

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "distribution",
    promise: "b rays from each surface, b^k after k bounces; light counts where it is met",
    source: "lecture B, B12 \"Naive approach\"",
    options: &[
        OptionEntry {
            name: "rays",
            range: OptionRange::Count(1, 64),
            default: Value::Count(4),
            doc: "b, the rays that leave each surface (B12)",
        },
        DIRECTIONS,
        GLASS,
        OptionEntry {
            name: "stop",
            range: OptionRange::Count(1, 16),
            default: Value::Count(4),
            doc: "scattering events after which the recursion stops, unless --max-depth is less; b^stop rays, 65536 at most",
        },
    ],
    make: |options, max_depth| {
        let stop = options.count("stop");
        Box::new(DistributionIntegrator {
            max_depth: max_depth.map_or(stop, |limit| limit.min(stop)),
            limited: max_depth.is_some_and(|limit| limit <= stop),
            rays: options.count("rays"),
            directions: Directions::of(options),
        })
    },
};

/// Most rays that may leave the last surfaces of one sample. A time limit or an interrupt waits for the tile under way: 256 samples, so 34
/// million rays with those before the last.
const MOST_RAYS: u64 = 65_536;

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistributionIntegrator {
    /// Scattering events at most.
    pub max_depth: u32,
    /// That was asked for, and is not the safety stop.
    pub limited: bool,
    /// Rays from each surface.
    pub rays: u32,
    /// Where they go.
    pub directions: Directions,
}

impl Integrator for DistributionIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        walk::render(scene, unit, tile, stats, |walk| {
            let eye = walk.camera_ray.ray;
            self.radiance_in(walk, &eye, 0)
        });
    }

    fn check(&self, _scene: &Scene) -> Result<(), String> {
        let too_many = |rays: u32, events: u32| u64::from(rays).checked_pow(events).is_none_or(|n| n > MOST_RAYS);
        let (rays, events) = (self.rays, self.max_depth);
        if !too_many(rays, events) {
            return Ok(());
        }
        let fewer_rays = (1..=rays).take_while(|&fewer| !too_many(fewer, events)).last().unwrap_or(1);
        let fewer_events = MOST_RAYS.ilog(u64::from(rays).max(2));
        Err(format!(
            "distribution: {rays} rays from each surface are {rays}^{events} after {events} events, for each sample of each pixel; it takes on \
             {MOST_RAYS}: try --estimator stop={fewer_events}, or --estimator rays={fewer_rays}"
        ))
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = depth_limit(self.limited.then_some(self.max_depth));
        let stop = (!self.limited).then(|| Limit::Truncation(format!("safety stop after {} events", self.max_depth)));
        depth.chain(stop).chain([unsampled_lights()]).collect()
    }
}

impl DistributionIntegrator {
    /// What comes along a ray after `depth` events.
    fn radiance_in(&self, walk: &mut Walk, ray: &Ray, depth: u32) -> SampledSpectrum {
        let mut radiance = SampledSpectrum::ZERO;
        let Some(p) = walk.look(ray, depth, |met| radiance += met.emitted) else { return radiance };
        if depth >= self.max_depth {
            walk.stats.stopped_paths += u64::from(!self.limited);
            return radiance;
        }
        let rays = if p.bsdf.flags().is_non_specular() { self.rays } else { 1 };
        for _ in 0..rays {
            let draws = walk.another_scatter();
            if let Some(step) = self.directions.sample(&p, &draws) {
                walk.scattered(depth + 1);
                let incoming = self.radiance_in(walk, &p.at.spawn_ray(step.wi), depth + 1);
                radiance += incoming * step.weight * (1.0 / rays as f32);
            }
        }
        radiance
    }
}
