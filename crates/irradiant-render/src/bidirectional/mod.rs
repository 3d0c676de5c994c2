//! Bidirectional path tracing: one walk from the camera and one from a light for each sample, joined in all ways
//! (Veach and Guibas 1994; Lafortune and Willems 1993), each way weighed against all others that make the same path
//! (Veach 1997, chapter 10).
//!
//! Strategy (s, t) takes s vertices from the light's walk and t from the camera's: s = 0 is a lamp met by chance, s = 1 a
//! light sample, t = 1 a surface on the light's walk that the lens sees, which may fall on any pixel. Neither the lens
//! nor a lamp seen directly is left to the light's walk (t = 0; s = t = 1).
//!
//! An independent witness for `path`: it shares materials, lights and geometry with it, and neither walk's densities nor its
//! weights. Textures are filtered by the estimate of [`Scene::texture_context`] everywhere, so that both walks see the
//! same surface.
//!
//! In reading order: this file (a sample, and what is shown of it), [`walks`], [`join`], [`weights`].

mod join;
mod walks;
mod weights;

pub use weights::Heuristic;

use crate::camera_samples::for_each_sample;
use crate::integrator::{Integrator, Limit, RenderStats, SceneHas, WorkUnit};
use crate::light_trace::Splats;
use crate::registry::{IntegratorEntry, OptionEntry, OptionRange, Value};
use irradiant_core::film::FilmTile;
use irradiant_core::scene::Scene;
use walks::Walks;
use weights::PathDensities;

/// A way to make a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strategy {
    /// Vertices from the light's walk, the light included.
    pub light: u32,
    /// Vertices from the camera's walk, the lens included; at least 1.
    pub camera: u32,
}

/// A part of the picture, for looking at what strategies do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Of this strategy alone.
    pub strategy: Strategy,
    /// With its weight: such parts add up to the picture. Without: an estimate of all light of its number of events that
    /// the strategy can find.
    pub weighted: bool,
}

/// What can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BidirectionalIntegrator {
    /// Scattering events at most; `None`: no limit.
    pub max_depth: Option<u32>,
    /// How strategies share paths.
    pub heuristic: Heuristic,
    /// Only a part; `None`: all.
    pub shown: Option<Shown>,
}

/// By name.
pub const ENTRY: IntegratorEntry = IntegratorEntry {
    name: "bdpt",
    promise: "bidirectional path tracing: a walk from the camera and one from a light, joined in all ways, each weighed against all \
              others that make the same path",
    source: "lecture B, slides on rendering algorithms (B10), as an independent witness; Veach 1997, chapter 10; pbrt-v4's \
             \"bdpt\"",
    options: &[
        OptionEntry {
            name: "heuristic",
            range: OptionRange::Word(Heuristic::WORDS),
            default: Heuristic::Power.value(),
            doc: "how strategies share a path (B32)",
        },
        OptionEntry {
            name: "t",
            range: OptionRange::Count(0, 1000),
            default: Value::Count(0),
            doc: "show only the strategy with so many vertices from the camera's walk, the lens included; 0 shows all \
                  strategies together",
        },
        OptionEntry {
            name: "s",
            range: OptionRange::Count(0, 1000),
            default: Value::Count(0),
            doc: "with t: so many vertices from the light's walk, the light included",
        },
        OptionEntry {
            name: "weighted",
            range: OptionRange::Flag,
            default: Value::Flag(true),
            doc: "with t: the strategy's weighted part of the picture; false shows all that it finds, unweighted",
        },
    ],
    make: |options, max_depth| {
        // Without t there is nothing to show alone: `check` tells whoever asks for it.
        let shown = Shown {
            strategy: Strategy { light: options.count("s"), camera: options.count("t") },
            weighted: options.flag("weighted"),
        };
        let all = Shown { strategy: Strategy { light: 0, camera: 0 }, weighted: true };
        let shown = (shown != all).then_some(shown);
        Box::new(BidirectionalIntegrator { max_depth, heuristic: Heuristic::of(options.word("heuristic")), shown })
    },
};

impl Integrator for BidirectionalIntegrator {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let mut walks = Walks::default();
        let mut densities = PathDensities::default();
        let mut splats = Splats::default();
        for_each_sample(scene, unit, tile, stats, |sample, camera_ray, lambda, layers, stats| {
            // Wavelengths that end on one walk have ended for the sample: the first stands for all.
            self.walk_from_camera(scene, sample, camera_ray, lambda, layers, &mut walks, stats);
            self.walk_from_light(scene, sample, camera_ray.ray.time, lambda, &mut walks, stats);
            splats.begin_path();
            self.join(scene, sample, &walks, lambda, &mut densities, &mut splats, stats)
        });
        splats.into_tile(tile);
    }

    fn splats(&self) -> bool {
        true
    }

    fn check(&self, _scene: &Scene) -> Result<(), String> {
        let Some(Shown { strategy: Strategy { light: s, camera: t }, weighted }) = self.shown else { return Ok(()) };
        let vertices = s.saturating_add(t);
        let asked = format!("bdpt: s={s} and t={t} (vertices from the light's and from the camera's walk)");
        if t == 0 {
            return Err(match (s, weighted) {
                (0, _) => {
                    "bdpt: weighted=false shows one strategy alone; say which, e.g. s=1 and t=2, or leave it out".into()
                }
                (1, _) => "bdpt: s=1 needs t, the vertices from the camera's walk; try t=2".into(),
                _ => format!("bdpt: s={s} needs t, the vertices from the camera's walk; try t=1 or t=2"),
            });
        }
        if vertices < 2 || (s, t) == (1, 1) {
            return Err(format!("{asked} is no strategy: lamps that the eye sees are found by s=0 and t=2 only"));
        }
        if let Some(limit) = self.max_depth.filter(|&limit| vertices - 2 > limit) {
            return Err(format!(
                "{asked} make paths of {} scattering events, and maxdepth is {limit}: nothing would be shown; try \
                 --max-depth {} or none, or smaller numbers",
                vertices - 2,
                vertices - 2
            ));
        }
        Ok(())
    }

    fn limits(&self) -> Vec<Limit> {
        let depth = self.max_depth.map(Limit::MaxDepth);
        let part = self.shown.map(|_| Limit::OtherQuantity("one strategy of the bidirectional estimator"));
        // A join takes two surfaces in a row that are not deltas there, or one that the lens sees.
        let within = |events| self.max_depth.is_none_or(|limit| limit >= events);
        let twice = within(3).then_some(Limit::Unfound(
            "what mirrors and glass show of the light that delta lights send by way of mirrors and glass",
            &[SceneHas::DeltaLights, SceneHas::DeltaLobes],
        ));
        let directly = within(2).then_some(Limit::Unfound(
            "what the camera sees directly of the light that delta lights send by way of mirrors and glass",
            &[SceneHas::DeltaLights, SceneHas::DeltaLobes, SceneHas::UnreachedCamera],
        ));
        depth.into_iter().chain(twice).chain(directly).chain(part).collect()
    }
}

impl BidirectionalIntegrator {
    /// What a strategy's contribution is multiplied with; `None` if it is not shown. `weight` is asked only if it matters.
    fn share(&self, s: usize, t: usize, weight: impl FnOnce() -> f32) -> Option<f32> {
        match self.shown {
            None => Some(weight()),
            Some(Shown { strategy, weighted }) if (strategy.light as usize, strategy.camera as usize) == (s, t) => {
                Some(if weighted { weight() } else { 1.0 })
            }
            Some(_) => None,
        }
    }

    /// Whether a strategy is to be tried at all.
    fn wants(&self, s: usize, t: usize) -> bool {
        let within = self.max_depth.is_none_or(|limit| s + t <= limit as usize + 2);
        within && self.share(s, t, || 1.0).is_some()
    }
}
