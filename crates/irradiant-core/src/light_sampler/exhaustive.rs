//! By the estimate of each light in turn: the tree's measure without the tree, at a cost of all lights per point.

use super::{Infinite, Part, PickedLight};
use crate::interaction::{LightId, ReferencePoint};
use crate::light::{Light, LightBounds};

/// Picks by bounds, one by one.
#[derive(Clone, Debug)]
pub struct ExhaustiveSampler {
    bounded: Vec<(LightId, LightBounds)>,
    /// For each light its place in `bounded`.
    places: Vec<Option<u32>>,
    infinite: Infinite,
}

impl ExhaustiveSampler {
    /// Of `lights`.
    pub fn new(lights: &[Light]) -> Self {
        let bounded: Vec<_> =
            lights.iter().enumerate().filter_map(|(i, l)| Some((LightId(i as u32), l.bounds()?))).collect();
        let mut places = vec![None; lights.len()];
        for (place, (id, _)) in bounded.iter().enumerate() {
            places[id.0 as usize] = Some(place as u32);
        }
        let infinite = Infinite::new(lights, !bounded.is_empty());
        Self { bounded, places, infinite }
    }

    fn total(&self, at: &ReferencePoint) -> f32 {
        self.bounded.iter().map(|(_, b)| b.importance(at.p, at.ns)).sum()
    }

    /// See [`super::LightSampler::sample`].
    pub fn sample(&self, at: &ReferencePoint, u: f32) -> Option<PickedLight> {
        let (u, share) = match self.infinite.choose(u)? {
            Part::Infinite(picked) => return Some(picked),
            Part::Bounded(u, share) => (u, share),
        };
        let total = self.total(at);
        let (mut sum, mut last) = (0.0, None);
        for (id, b) in &self.bounded {
            let importance = b.importance(at.p, at.ns);
            if importance > 0.0 {
                sum += importance;
                last = Some(PickedLight { id: *id, pmf: share * (importance / total) });
                if u * total < sum {
                    break;
                }
            }
        }
        last.filter(|picked| picked.pmf > 0.0)
    }

    /// See [`super::LightSampler::pmf`].
    pub fn pmf(&self, at: &ReferencePoint, id: LightId) -> f32 {
        let Some(place) = self.places[id.0 as usize] else { return self.infinite.each };
        let importance = self.bounded[place as usize].1.importance(at.p, at.ns);
        if importance > 0.0 { self.infinite.bounded_share() * (importance / self.total(at)) } else { 0.0 }
    }
}
