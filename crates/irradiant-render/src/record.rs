//! What a path tells of itself: the story that path-expression layers, per-bounce images, the inspector and "why is
//! this pixel noisy" are all filters over.
//!
//! An integrator is generic over a [`PathRecorder`]; with [`NoRecord`] the telling costs nothing.

use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::Lobe;
use irradiant_core::interaction::{Interaction, LightId};
use irradiant_math::Vec3;
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// How a contribution was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// A ray met the light.
    Hit,
    /// The light was sampled.
    LightSample,
}

/// One contribution to a sample.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    /// Scattering events between eye and light.
    pub bounces: u32,
    /// How it was found.
    pub technique: Technique,
    /// The light.
    pub light: LightId,
    /// From the last vertex (or the eye) towards the light, unit.
    pub wi: Vec3,
    /// Radiance carried to the eye, all weights included.
    pub radiance: SampledSpectrum,
    /// Multiple-importance weight that is included.
    pub mis_weight: f32,
    /// Density of the light sample (chance of the light included; of all samples together where the choice of a light is split), per
    /// steradian; 0 where light sampling cannot find it.
    pub light_pdf: f32,
    /// Density of the BSDF sample, per steradian; 0 where scattering cannot find it.
    pub bsdf_pdf: f32,
}

/// One scattering event.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// 0 at the first surface.
    pub depth: u32,
    /// Towards the next vertex, unit.
    pub wi: Vec3,
    /// The lobe that was sampled.
    pub lobe: Lobe,
    /// Its density, per steradian (1 for delta lobes: a probability).
    pub pdf: f32,
    /// Throughput after the event, roulette not included.
    pub throughput: SampledSpectrum,
    /// Probability of survival in the roulette that follows.
    pub survival: f32,
}

/// Listens to a path.
pub trait PathRecorder {
    /// False lets integrators skip work that only recording needs.
    const ENABLED: bool = true;
    /// The path begins.
    fn begin(&mut self, _lambda: &Wavelengths) {}
    /// The path meets a surface that scatters like this; `depth` scattering events came before.
    fn vertex(&mut self, _depth: u32, _at: &Interaction, _bsdf: &Bsdf) {}
    /// The path leaves the scene.
    fn escape(&mut self, _depth: u32, _direction: Vec3) {}
    /// A light sample is tested by a ray, at the vertex after so many scattering events.
    fn light_tested(&mut self, _depth: u32, _light: LightId) {}
    /// Light is found.
    fn contribution(&mut self, _c: &Contribution) {}
    /// The path goes on.
    fn scattering(&mut self, _s: &Scattering) {}
    /// The path ends.
    fn end(&mut self, _why: PathEnd) {}
}

/// Why a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEnd {
    /// It left the scene.
    Escaped,
    /// The depth limit.
    MaxDepth,
    /// The surface absorbed it: nothing to sample.
    Absorbed,
    /// Russian roulette.
    Roulette,
}

/// Records nothing, at no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoRecord;

impl PathRecorder for NoRecord {
    const ENABLED: bool = false;
}
