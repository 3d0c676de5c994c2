//! Which light to sample: strategies that pick one light for a point, with its probability.
//!
//! Any strategy is right as long as it can pick every light that reaches the point; they differ in noise. `uniform`
//! picks all alike, `power` by emitted power, `bvh` by a tree of bounds that knows distance and direction
//! ([`tree`]), `exhaustive` by the same estimate for each light in turn. As in pbrt-v4, the last two pick each light at
//! infinity as often as all others together. A scene with one light costs nothing in any.

pub mod exhaustive;
pub mod tree;
mod tree_lanes;

#[cfg(test)]
mod tests;

use crate::interaction::{LightId, ReferencePoint};
use crate::light::{Light, Lights};
use exhaustive::ExhaustiveSampler;
use irradiant_math::distribution::AliasTable;
use irradiant_scene::desc::LightSamplerKind;
use irradiant_spectrum::Wavelengths;
use tree::TreeSampler;
pub use tree_lanes::{PointLanes, TreeLanes};

/// A light that was picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickedLight {
    /// Which.
    pub id: LightId,
    /// With what probability; > 0.
    pub pmf: f32,
}

/// How lights are picked.
#[derive(Clone, Debug)]
pub enum LightSampler {
    /// All alike; also whenever there is but one.
    Uniform(UniformSampler),
    /// By power.
    Power(PowerSampler),
    /// By a tree of bounds.
    Tree(TreeSampler),
    /// By bounds, one by one.
    Exhaustive(ExhaustiveSampler),
}

impl LightSampler {
    /// For all of `lights`.
    pub fn new(kind: LightSamplerKind, lights: &Lights) -> Self {
        let lights = lights.as_slice();
        let uniform = Self::Uniform(UniformSampler::new(lights.len()));
        if lights.len() < 2 {
            return uniform;
        }
        match kind {
            LightSamplerKind::Uniform => uniform,
            LightSamplerKind::Power => PowerSampler::new(lights).map_or(uniform, Self::Power),
            LightSamplerKind::Bvh => Self::Tree(TreeSampler::new(lights)),
            LightSamplerKind::Exhaustive => Self::Exhaustive(ExhaustiveSampler::new(lights)),
        }
    }

    /// Picks a light to illuminate `at`, by `u` in [0, 1); `None` when none reaches it.
    #[inline]
    pub fn sample(&self, at: &ReferencePoint, u: f32) -> Option<PickedLight> {
        match self {
            Self::Uniform(s) => s.sample(u),
            Self::Power(s) => s.sample(u),
            Self::Tree(s) => s.sample(at, u),
            Self::Exhaustive(s) => s.sample(at, u),
        }
    }

    /// The probability with which [`LightSampler::sample`] picks `id` at `at`.
    #[inline]
    pub fn pmf(&self, at: &ReferencePoint, id: LightId) -> f32 {
        match self {
            Self::Uniform(s) => s.pmf(),
            Self::Power(s) => s.pmf(id),
            Self::Tree(s) => s.pmf(at, id),
            Self::Exhaustive(s) => s.pmf(at, id),
        }
    }
}

/// All lights alike.
#[derive(Clone, Copy, Debug)]
pub struct UniformSampler {
    n: u32,
    pmf: f32,
}

impl UniformSampler {
    /// Of `n` lights.
    pub fn new(n: usize) -> Self {
        Self { n: n as u32, pmf: if n == 0 { 0.0 } else { 1.0 / n as f32 } }
    }

    /// See [`LightSampler::sample`].
    #[inline]
    pub fn sample(&self, u: f32) -> Option<PickedLight> {
        let n = self.n.checked_sub(1)?;
        Some(PickedLight { id: LightId(((u * self.n as f32) as u32).min(n)), pmf: self.pmf })
    }

    /// See [`LightSampler::pmf`].
    #[inline]
    pub fn pmf(&self) -> f32 {
        self.pmf
    }
}

/// Lights by power: for emission, and for scenes in which all points see all lights alike.
#[derive(Clone, Debug)]
pub struct PowerSampler {
    table: AliasTable,
}

impl PowerSampler {
    /// By power at four fixed wavelengths, as pbrt-v4; all alike when none has any. `None` without lights.
    pub fn new(lights: &[Light]) -> Option<Self> {
        let lambda = Wavelengths::sample_visible(0.5);
        let powers: Vec<f32> = lights.iter().map(|l| l.power(&lambda).safe_div(lambda.pdf()).average()).collect();
        let table = AliasTable::new(&powers).or_else(|| AliasTable::new(&vec![1.0; lights.len()]))?;
        Some(Self { table })
    }

    /// Picks a light by `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> Option<PickedLight> {
        let s = self.table.sample(u);
        (s.pmf > 0.0).then_some(PickedLight { id: LightId(s.index as u32), pmf: s.pmf })
    }

    /// The probability of a light.
    #[inline]
    pub fn pmf(&self, id: LightId) -> f32 {
        self.table.pmf(id.0 as usize)
    }
}

/// The share of lights at infinity, which bounds cannot weigh: each is as likely as all others together.
#[derive(Clone, Debug)]
struct Infinite {
    ids: Vec<LightId>,
    /// Probability of picking one of them, and of each.
    share: f32,
    each: f32,
}

/// Which part a random number chose.
enum Part {
    /// A light at infinity.
    Infinite(PickedLight),
    /// The others, with a fresh random number and their probability.
    Bounded(f32, f32),
}

impl Infinite {
    /// Of `lights`, which also holds others if `has_bounded`.
    fn new(lights: &[Light], has_bounded: bool) -> Self {
        let ids: Vec<LightId> =
            (0..lights.len()).filter(|&i| lights[i].bounds().is_none()).map(|i| LightId(i as u32)).collect();
        let parts = ids.len() + usize::from(has_bounded);
        let each = if parts == 0 { 0.0 } else { 1.0 / parts as f32 };
        Self { share: if has_bounded { ids.len() as f32 * each } else { 1.0 }, each, ids }
    }

    #[inline]
    fn choose(&self, u: f32) -> Option<Part> {
        if self.ids.is_empty() {
            return Some(Part::Bounded(u, 1.0));
        }
        if u < self.share {
            let i = ((u / self.share * self.ids.len() as f32) as usize).min(self.ids.len() - 1);
            return Some(Part::Infinite(PickedLight { id: self.ids[i], pmf: self.each }));
        }
        let rest = 1.0 - self.share;
        (rest > 0.0).then(|| Part::Bounded(((u - self.share) / rest).min(1.0 - f32::EPSILON / 2.0), rest))
    }

    /// The probability of the others together.
    #[inline]
    fn bounded_share(&self) -> f32 {
        if self.ids.is_empty() { 1.0 } else { 1.0 - self.share }
    }
}
