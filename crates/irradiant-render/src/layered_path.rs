//! One render, taken apart: path tracing that adds what each path carries to the picture and to every layer whose
//! [expression](crate::expression) matches the path.
//!
//! A path's contributions are kept until the sample's wavelengths are final, then each is turned into the film's RGB and
//! rounded, once, and added as an integer to the picture and to its layers ([`SampleParts`]). So layers that split the paths
//! among them add up to the picture exactly, whatever threads did what. The picture differs from that of a plain render of
//! the same samples by rounding alone: there a sample is rounded as a whole.

use crate::camera_samples::camera_sample;
use crate::expression::{EventClass, ExpressionError, PathAutomaton, PathExpression};
use crate::integrator::{Integrator, Limit, RenderStats, WorkUnit};
use crate::path::PathIntegrator;
use crate::record::{Contribution, PathRecorder, Scattering, Technique};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::Spread;
use irradiant_core::film::{FilmTile, Layer, SampleParts};
use irradiant_core::interaction::{Interaction, ShapeId};
use irradiant_core::scene::Scene;
use irradiant_math::Vec3;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};
use std::sync::Arc;

/// A layer of the film: a name for its channels, and the paths that it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct PathLayer {
    /// Channels are `NAME.R`, `NAME.G`, `NAME.B`.
    pub name: String,
    /// Which paths.
    pub expression: PathExpression,
}

/// Layers, compiled for a scene.
pub struct PathLayers {
    layers: Vec<PathLayer>,
    automaton: PathAutomaton,
}

impl PathLayers {
    /// Compiles; the error is that of the first expression that has a label which nothing in the scene has.
    pub fn new(layers: Vec<PathLayer>, scene: &Scene) -> Result<Self, ExpressionError> {
        let expressions: Vec<PathExpression> = layers.iter().map(|l| l.expression.clone()).collect();
        Ok(Self { automaton: PathAutomaton::new(&expressions, scene)?, layers })
    }

    /// The layers, in the order of their channels.
    pub fn as_slice(&self) -> &[PathLayer] {
        &self.layers
    }

    /// As a film declares them.
    pub fn film_layers(&self) -> impl Iterator<Item = Layer> + '_ {
        self.layers.iter().map(|l| Layer::Paths { name: l.name.clone(), expression: l.expression.text().to_string() })
    }
}

/// The path integrator with layers. The scene must have declared them
/// ([`declare_paths`](irradiant_core::scene::LayerPlan::declare_paths)).
pub struct LayeredPath {
    /// How paths are made.
    pub path: PathIntegrator,
    /// What is kept of them.
    pub layers: Arc<PathLayers>,
}

impl Integrator for LayeredPath {
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats) {
        let mut recorder = Sorter::new(&self.layers.automaton);
        let mut parts = SampleParts::default();
        let mut layers = vec![0f32; scene.layers.channels()];
        let first_channel = layers.len() as u32;
        for y in unit.bounds.y0..unit.bounds.y1 {
            for x in unit.bounds.x0..unit.bounds.x1 {
                for index in unit.samples.clone() {
                    let sample = camera_sample(scene, [x, y], index);
                    stats.paths += 1;
                    layers.fill(0.0);
                    parts.clear();
                    if let Some(camera_ray) = &sample.camera_ray {
                        stats.camera_rays += 1;
                        let mut lambda = sample.lambda;
                        let stream = &sample.stream;
                        let whole = self.path.radiance(
                            scene,
                            camera_ray,
                            stream,
                            &mut lambda,
                            &mut layers,
                            stats,
                            &mut recorder,
                        ) * camera_ray.weight;
                        scene.layers.add_buckets(whole, &lambda, &mut layers);
                        layers.iter_mut().for_each(|value| *value *= sample.filter_weight);
                        let factor = sample.filter_weight * scene.limit_factor(whole, &lambda);
                        recorder.for_each_part(|radiance, layers| {
                            let rgb = scene.film_rgb_of_part(radiance * camera_ray.weight, &lambda);
                            let channels = layers.iter().map(|layer| first_channel + 3 * layer);
                            parts.push(rgb.map(|c| c * factor), channels);
                        });
                    }
                    if !tile.add_parts(x, y, &parts, &layers) {
                        stats.refuse(x, y, index);
                    }
                }
            }
        }
    }

    fn limits(&self) -> Vec<Limit> {
        self.path.limits()
    }
}

/// Listens to a path and sorts its contributions into layers. Reused from path to path, so that nothing is allocated for
/// each.
struct Sorter<'a> {
    automaton: &'a PathAutomaton,
    /// What the event after the last may match.
    state: Vec<u64>,
    next: Vec<u64>,
    /// The last surface: where light samples are scattered.
    surface: Option<Surface>,
    found: Vec<SampledSpectrum>,
    /// One past the last of each contribution's `layers`.
    ends: Vec<u32>,
    layers: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Surface {
    shape: ShapeId,
    bsdf: Bsdf,
    wo: Vec3,
}

impl Surface {
    /// Class of a scattering event that is no delta.
    fn class(&self, wi: Vec3) -> EventClass {
        match self.bsdf.spread(self.wo, wi) {
            Spread::Glossy => EventClass::Glossy,
            Spread::Diffuse => EventClass::Diffuse,
        }
    }
}

impl<'a> Sorter<'a> {
    fn new(automaton: &'a PathAutomaton) -> Self {
        let state = automaton.start().to_vec();
        let (found, ends, layers) = (Vec::new(), Vec::new(), Vec::new());
        Self { automaton, next: state.clone(), state, surface: None, found, ends, layers }
    }

    /// Calls with each contribution and its layers, in the order in which they were found.
    fn for_each_part(&self, mut visit: impl FnMut(SampledSpectrum, &[u32])) {
        let mut start = 0;
        for (&radiance, &end) in self.found.iter().zip(&self.ends) {
            visit(radiance, &self.layers[start as usize..end as usize]);
            start = end;
        }
    }
}

impl PathRecorder for Sorter<'_> {
    fn begin(&mut self, _lambda: &Wavelengths) {
        self.state.copy_from_slice(self.automaton.start());
        self.surface = None;
        self.found.clear();
        self.ends.clear();
        self.layers.clear();
    }

    fn vertex(&mut self, _depth: u32, at: &Interaction, bsdf: &Bsdf) {
        self.surface = Some(Surface { shape: at.shape, bsdf: *bsdf, wo: at.wo });
    }

    fn contribution(&mut self, c: &Contribution) {
        let mut state = &self.state;
        if let (Technique::LightSample, Some(surface)) = (c.technique, &self.surface) {
            let transmitted = surface.bsdf.is_transmitted(surface.wo, c.wi);
            self.automaton.step(&self.state, surface.shape, surface.class(c.wi), transmitted, &mut self.next);
            state = &self.next;
        }
        let layers = &mut self.layers;
        self.automaton.for_each_match(state, c.light, c.technique, |layer| layers.push(layer));
        self.found.push(c.radiance);
        self.ends.push(layers.len() as u32);
    }

    fn scattering(&mut self, s: &Scattering) {
        let Some(surface) = &self.surface else { return };
        let class = if s.lobe.is_specular() { EventClass::Specular } else { surface.class(s.wi) };
        let transmitted = surface.bsdf.is_transmitted(surface.wo, s.wi);
        self.automaton.step(&self.state, surface.shape, class, transmitted, &mut self.next);
        std::mem::swap(&mut self.state, &mut self.next);
    }
}
