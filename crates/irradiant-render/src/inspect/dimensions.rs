//! Which random numbers a path uses (B16): T^k is a 2k-dimensional integral, so each bounce must have its own, and no number
//! may decide two things.

use crate::integrator::RenderStats;
use crate::path::PathIntegrator;
use crate::record::NoRecord;
use irradiant_core::sampler::{DrawKind, DrawLog, SampleStream};
use irradiant_core::scene::Scene;
use irradiant_math::Point2;
use irradiant_math::hash::hash2;
use std::collections::BTreeMap;

/// What the paths of an audit drew.
#[derive(Clone, Debug, Default)]
pub struct DimensionAudit {
    /// Paths followed.
    pub paths: u64,
    /// Blocks of four numbers that a path asked for more than once: 0 if no number is used twice.
    pub reused: u64,
    /// Blocks that belong to no vertex that the path reached.
    pub beyond: u64,
    /// For each bounce the most blocks that any path drew there (light, scatter, mix), and by how many paths any was.
    pub by_bounce: Vec<BounceDraws>,
}

/// The draws of one bounce.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BounceDraws {
    /// Paths that drew here.
    pub paths: u64,
    /// Most light blocks of a path.
    pub light: u32,
    /// Most scatter blocks of a path.
    pub scatter: u32,
    /// Most mix blocks of a path.
    pub mix: u32,
}

/// Follows paths of random pixels with numbers that are written down.
pub fn dimensions(scene: &Scene, integrator: &PathIntegrator, paths: u64, seed: u64) -> DimensionAudit {
    let bounds = scene.bounds();
    let mut audit = DimensionAudit { paths, ..Default::default() };
    for i in 0..paths {
        let log = DrawLog::default();
        let stream = SampleStream::logged(&scene.sampler, hash2(seed, i), &log);
        let draws = stream.camera();
        let film = Point2::new(
            bounds.x0 as f32 + draws.film.x * bounds.width() as f32,
            bounds.y0 as f32 + draws.film.y * bounds.height() as f32,
        );
        let lens = if scene.camera.has_lens() { stream.lens() } else { Point2::new(0.5, 0.5) };
        let mut lambda = scene.sample_wavelengths(draws.wavelength);
        let Some(ray) = scene.camera.generate_ray(film, lens, draws.time) else { continue };
        let mut stats = RenderStats::default();
        integrator.radiance(scene, &ray, &stream, &mut lambda, &mut [], &mut stats, &mut NoRecord);
        audit.count(&log.blocks(), stats.longest_path);
    }
    audit
}

impl DimensionAudit {
    /// Counts one path's blocks; `events` scattering events were on it.
    fn count(&mut self, blocks: &[u32], events: u32) {
        let mut times: BTreeMap<u32, u32> = BTreeMap::new();
        blocks.iter().for_each(|&b| *times.entry(b).or_default() += 1);
        self.reused += times.values().filter(|&&n| n > 1).count() as u64;
        let mut here: BTreeMap<u32, BounceDraws> = BTreeMap::new();
        for &block in times.keys() {
            let kind = DrawKind::of(block);
            let (DrawKind::Light(depth) | DrawKind::Scatter(depth) | DrawKind::Mix(depth)) = kind else { continue };
            self.beyond += u64::from(depth > events);
            let draws = here.entry(depth).or_default();
            match kind {
                DrawKind::Camera | DrawKind::Lens => {}
                DrawKind::Light(_) => draws.light += 1,
                DrawKind::Scatter(_) => draws.scatter += 1,
                DrawKind::Mix(_) => draws.mix += 1,
            }
        }
        for (depth, draws) in here {
            let depth = depth as usize;
            if self.by_bounce.len() <= depth && depth < 1 << 16 {
                self.by_bounce.resize(depth + 1, BounceDraws::default());
            }
            if let Some(total) = self.by_bounce.get_mut(depth) {
                total.paths += 1;
                total.light = total.light.max(draws.light);
                total.scatter = total.scatter.max(draws.scatter);
                total.mix = total.mix.max(draws.mix);
            }
        }
    }

    /// No number decides two things, and each bounce draws its own: at most one block for the light and one for scattering.
    pub fn is_sound(&self) -> bool {
        self.reused == 0 && self.beyond == 0 && self.by_bounce.iter().all(|b| b.light <= 1 && b.scatter <= 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reuse_and_strays_are_seen() {
        let mut sound = DimensionAudit::default();
        // Camera; light and scatter of two bounces.
        sound.count(&[0, 2, 3, 5, 6], 1);
        assert!(sound.is_sound());
        assert_eq!(sound.by_bounce, [BounceDraws { paths: 1, light: 1, scatter: 1, mix: 0 }; 2]);
        let mut reused = DimensionAudit::default();
        reused.count(&[0, 2, 3, 3], 1);
        assert!(!reused.is_sound() && reused.reused == 1);
        let mut stray = DimensionAudit::default();
        stray.count(&[0, 2, 3, 8], 1);
        assert!(!stray.is_sound() && stray.beyond == 1);
    }
}
