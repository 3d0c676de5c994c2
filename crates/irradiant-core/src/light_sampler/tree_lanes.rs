//! Walks through the tree of lights for many points, a level at a time.
//!
//! The children of a vector's worth of nodes are put side by side, four lanes for each point, so that one loop computes all
//! importances ([`Cones::importance`]) and one chooses ([`choose`]), with the bits of a walk alone. Nodes are copied in rows of four: no
//! lane is fetched by itself. Where all points are at one node, as at the root, its children come one after the other instead, each for
//! all points, and absent ones not at all.

use super::tree::{Cones, LEAF, Node, Place, TreeSampler, WIDTH, choose, sum};
use super::{LightSampler, Part, PickedLight};
use crate::geometry::{Kernel, Level};
use crate::interaction::{LightId, ReferencePoint};
use irradiant_math::lanes::{Floats, LANES, Triples, WHOLE};

/// Points that are looked at together.
const POINTS: usize = WHOLE;

/// A number of each point.
type Points = [f32; POINTS];
/// A number of each child of as many nodes.
type Children = [f32; WIDTH * POINTS];

/// Walks under way.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct TreeLanes {
    /// Whose walk it is.
    lane: [u32; LANES],
    node: [u32; LANES],
    /// The child of the node; [`NOWHERE`] where no light reaches the point.
    child: [u32; LANES],
    u: Floats,
    pmf: Floats,
    step: Step,
}

const NOWHERE: u32 = u32::MAX;

/// Points that lights shine on, side by side, as [`ReferencePoint`](crate::interaction::ReferencePoint) has them (normals are zero where there are none).
#[derive(Clone, Copy, Debug)]
pub struct PointLanes<'a> {
    /// Where.
    pub p: &'a Triples,
    /// Bounds of their errors.
    pub p_error: &'a Triples,
    /// Geometric normals.
    pub n: &'a Triples,
    /// Shading normals.
    pub ns: &'a Triples,
}

impl PointLanes<'_> {
    /// A lane.
    #[inline(always)]
    pub fn reference(&self, i: usize) -> ReferencePoint {
        ReferencePoint {
            p: self.p.point(i),
            p_error: self.p_error.vector(i),
            n: self.n.normal(i),
            ns: self.ns.normal(i),
        }
    }
}

impl TreeLanes {
    /// None yet.
    pub const NONE: Self = Self {
        lane: [0; LANES],
        node: [0; LANES],
        child: [0; LANES],
        u: [0.0; LANES],
        pmf: [0.0; LANES],
        step: Step::NEW,
    };
}

impl LightSampler {
    /// What [`LightSampler::sample`] says for each of some lanes: into `id` and `pmf`, whose probability is 0 where no light is picked.
    pub fn sample_lanes(
        &self,
        level: Level,
        lanes: &[u32],
        at: PointLanes,
        u: &Floats,
        walks: &mut TreeLanes,
        id: &mut [u32; LANES],
        pmf: &mut Floats,
    ) {
        if let Self::Tree(tree) = self {
            return tree.sample_lanes(level, lanes, at, u, walks, id, pmf);
        }
        for &i in lanes {
            let i = i as usize;
            let picked = self.sample(&at.reference(i), u[i]);
            (id[i], pmf[i]) = picked.map_or((0, 0.0), |PickedLight { id, pmf }| (id.0, pmf));
        }
    }

    /// What [`LightSampler::pmf`] says of the lights `id` of some lanes.
    pub fn pmf_lanes(
        &self,
        level: Level,
        lanes: &[u32],
        at: PointLanes,
        id: &[u32; LANES],
        walks: &mut TreeLanes,
        pmf: &mut Floats,
    ) {
        if let Self::Tree(tree) = self {
            return tree.pmf_lanes(level, lanes, at, id, walks, pmf);
        }
        for &i in lanes {
            let i = i as usize;
            pmf[i] = self.pmf(&at.reference(i), LightId(id[i]));
        }
    }
}

impl TreeSampler {
    fn sample_lanes(
        &self,
        level: Level,
        lanes: &[u32],
        at: PointLanes,
        u: &Floats,
        walks: &mut TreeLanes,
        id: &mut [u32; LANES],
        pmf: &mut Floats,
    ) {
        let mut n = 0;
        for &lane in lanes {
            let i = lane as usize;
            (id[i], pmf[i]) = (0, 0.0);
            match self.infinite.choose(u[i]) {
                Some(Part::Infinite(picked)) => (id[i], pmf[i]) = (picked.id.0, picked.pmf),
                Some(Part::Bounded(u, share)) if !self.nodes.is_empty() => {
                    (walks.lane[n], walks.node[n], walks.u[n], walks.pmf[n]) = (lane, 0, u, share);
                    n += 1;
                }
                Some(Part::Bounded(..)) | None => {}
            }
        }
        while n > 0 {
            level.run(Descend { nodes: &self.nodes, walks, n, at });
            let mut stay = 0;
            for k in 0..n {
                let (i, child) = (walks.lane[k] as usize, walks.child[k]);
                // Chosen without branches, which would be guessed wrong often.
                let is_somewhere = child != NOWHERE;
                let child = self.nodes[walks.node[k] as usize].children[if is_somewhere { child as usize } else { 0 }];
                let is_leaf = child & LEAF != 0;
                let arrives = is_somewhere & is_leaf & (walks.pmf[k] > 0.0);
                id[i] = if arrives { child & !LEAF } else { id[i] };
                pmf[i] = if arrives { walks.pmf[k] } else { pmf[i] };
                (walks.lane[stay], walks.node[stay]) = (walks.lane[k], child);
                (walks.u[stay], walks.pmf[stay]) = (walks.u[k], walks.pmf[k]);
                stay += usize::from(is_somewhere & !is_leaf);
            }
            n = stay;
        }
    }

    fn pmf_lanes(
        &self,
        level: Level,
        lanes: &[u32],
        at: PointLanes,
        id: &[u32; LANES],
        walks: &mut TreeLanes,
        pmf: &mut Floats,
    ) {
        let mut n = 0;
        for &lane in lanes {
            let i = lane as usize;
            let place = self.places[id[i] as usize];
            if self.at_infinity[id[i] as usize] {
                pmf[i] = self.infinite.each;
            } else if place == Place::NONE {
                pmf[i] = 0.0;
            } else {
                (walks.lane[n], walks.node[n], walks.child[n]) = (lane, place.node, place.lane);
                walks.pmf[n] = self.infinite.bounded_share();
                n += 1;
            }
        }
        while n > 0 {
            level.run(Ascend { nodes: &self.nodes, walks, n, at });
            let mut stay = 0;
            for k in 0..n {
                let place = self.nodes[walks.node[k] as usize].parent;
                if walks.child[k] == NOWHERE || place == Place::NONE {
                    pmf[walks.lane[k] as usize] = walks.pmf[k];
                    continue;
                }
                (walks.lane[stay], walks.node[stay], walks.child[stay]) = (walks.lane[k], place.node, place.lane);
                walks.pmf[stay] = walks.pmf[k];
                stay += 1;
            }
            n = stay;
        }
    }
}

/// A step down of each of `n` walks.
struct Descend<'a> {
    nodes: &'a [Node],
    walks: &'a mut TreeLanes,
    n: usize,
    at: PointLanes<'a>,
}

impl Kernel for Descend<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { nodes, walks, n, at } = self;
        for first in (0..n).step_by(POINTS) {
            if walks.importances(nodes, first, n, at) {
                walks.descend(first, Step::by_child);
            } else {
                walks.descend(first, Step::by_point);
            }
        }
    }
}

/// A step up of each of `n` walks.
struct Ascend<'a> {
    nodes: &'a [Node],
    walks: &'a mut TreeLanes,
    n: usize,
    at: PointLanes<'a>,
}

impl Kernel for Ascend<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { nodes, walks, n, at } = self;
        for first in (0..n).step_by(POINTS) {
            if walks.importances(nodes, first, n, at) {
                walks.ascend(first, Step::by_child);
            } else {
                walks.ascend(first, Step::by_point);
            }
        }
    }
}

/// What is side by side in one step.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Step {
    cones: Cones<Children>,
    p: [Children; 3],
    n: [Children; 3],
    importances: Children,
    /// The same, child by child, where all points are at one node.
    by_child: [Points; WIDTH],
}

impl Step {
    const NEW: Self = {
        let zero = [0.0; WIDTH * POINTS];
        let by_child = [[0.0; POINTS]; WIDTH];
        Self { cones: Cones::splat(zero), p: [zero; 3], n: [zero; 3], importances: zero, by_child }
    };

    /// The importances of the children of one node, from the points of these lanes.
    #[inline(always)]
    fn children_of(&mut self, node: &Node, lane: impl Fn(usize) -> usize, at: PointLanes) {
        let (mut p, mut n) = ([[0.0; POINTS]; 3], [[0.0; POINTS]; 3]);
        for k in 0..POINTS {
            let lane = lane(k);
            let (point, normal) = (at.p.point(lane).to_array(), at.ns.normal(lane).to_array());
            for axis in 0..3 {
                (p[axis][k], n[axis][k]) = (point[axis], normal[axis]);
            }
        }
        for (child, importances) in self.by_child.iter_mut().enumerate() {
            let cones = node.cones.of(|row| row[child]);
            if cones.is_absent() {
                *importances = [0.0; POINTS];
                continue;
            }
            for k in 0..POINTS {
                let n = [n[0][k], n[1][k], n[2][k]];
                let has_normal = (n[0] != 0.0) | (n[1] != 0.0) | (n[2] != 0.0);
                importances[k] = cones.importance([p[0][k], p[1][k], p[2][k]], n, has_normal);
            }
        }
    }

    #[inline(always)]
    fn by_child(&self, k: usize) -> [f32; WIDTH] {
        let [a, b, c, d] = &self.by_child;
        [a[k], b[k], c[k], d[k]]
    }

    #[inline(always)]
    fn by_point(&self, k: usize) -> [f32; WIDTH] {
        let all = &self.importances;
        [all[4 * k], all[4 * k + 1], all[4 * k + 2], all[4 * k + 3]]
    }
}

impl TreeLanes {
    /// Those of the walks from `first` on. Whether they are child by child.
    #[inline(always)]
    fn importances(&mut self, nodes: &[Node], first: usize, n: usize, at: PointLanes) -> bool {
        let step = &mut self.step;
        // What is beyond the last walk is that one's again.
        let walk = |k: usize| (first + k).min(n - 1);
        let at_first = self.node[first];
        if (0..POINTS).fold(true, |is_one, k| is_one & (self.node[walk(k)] == at_first)) {
            step.children_of(&nodes[at_first as usize], |k| self.lane[walk(k)] as usize, at);
            return true;
        }
        for k in 0..POINTS {
            let node = &nodes[self.node[walk(k)] as usize];
            let place = WIDTH * k..WIDTH * k + WIDTH;
            step.cones.put(&node.cones, |all, row| all[place.clone()].copy_from_slice(row));
        }
        for k in 0..POINTS {
            let (lane, place) = (self.lane[walk(k)] as usize, WIDTH * k..WIDTH * k + WIDTH);
            let (p, ns) = (at.p.point(lane).to_array(), at.ns.normal(lane).to_array());
            for axis in 0..3 {
                step.p[axis][place.clone()].fill(p[axis]);
                step.n[axis][place.clone()].fill(ns[axis]);
            }
        }
        for i in 0..WIDTH * POINTS {
            let cones = step.cones.of(|row| row[i]);
            let n = [step.n[0][i], step.n[1][i], step.n[2][i]];
            let has_normal = (n[0] != 0.0) | (n[1] != 0.0) | (n[2] != 0.0);
            step.importances[i] = cones.importance([step.p[0][i], step.p[1][i], step.p[2][i]], n, has_normal);
        }
        false
    }

    /// Chooses by the importances of the children, which `four` finds.
    #[inline(always)]
    fn descend(&mut self, first: usize, four: impl Fn(&Step, usize) -> [f32; WIDTH]) {
        for k in 0..POINTS {
            let i = first + k;
            let step = choose(&four(&self.step, k), self.u[i]);
            self.child[i] = if step.is_good { step.lane } else { NOWHERE };
            self.pmf[i] *= step.share;
            self.u[i] = step.u;
        }
    }

    /// The chance that a walk down would have come here.
    #[inline(always)]
    fn ascend(&mut self, first: usize, four: impl Fn(&Step, usize) -> [f32; WIDTH]) {
        for k in 0..POINTS {
            let (i, four) = (first + k, four(&self.step, k));
            let child = self.child[i];
            let pick = |a: f32, lane: u32, b: f32| if child == lane { a } else { b };
            let importance = pick(four[0], 0, pick(four[1], 1, pick(four[2], 2, four[3])));
            let is_good = importance > 0.0;
            let pmf = self.pmf[i] * (importance / sum(&four));
            self.pmf[i] = if is_good { pmf } else { 0.0 };
            self.child[i] = if is_good { child } else { NOWHERE };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{random_reference, samplers};
    use super::*;
    use irradiant_testkit::Rng;

    // All samplers, levels and numbers of points: the lanes are the lights and probabilities of one point at a time.
    #[test]
    fn lanes_pick_what_points_alone_do() {
        for (scene, (lights, infinite)) in [(2, 0), (5, 1), (37, 2), (300, 0), (0, 3)].into_iter().enumerate() {
            let (all, samplers) = samplers(lights, infinite, scene as u64);
            let mut rng = Rng::new(scene as u64);
            let mut at = [Triples::ZERO, Triples::ZERO, Triples::ZERO, Triples::ZERO];
            let (mut u, mut walks) = ([0.0; LANES], TreeLanes::NONE);
            for i in 0..LANES {
                let reference = random_reference(&mut rng);
                at[0].set(i, reference.p.to_array());
                at[2].set(i, reference.n.to_array());
                at[3].set(i, reference.ns.to_array());
                u[i] = rng.next_f32();
            }
            let points = PointLanes { p: &at[0], p_error: &at[1], n: &at[2], ns: &at[3] };
            for sampler in &samplers {
                for (level, step) in Level::available().into_iter().flat_map(|l| [(l, 1), (l, 3), (l, 200)]) {
                    let lanes: Vec<u32> = (0..LANES as u32).step_by(step).collect();
                    let (mut id, mut pmf) = ([u32::MAX; LANES], [f32::NAN; LANES]);
                    sampler.sample_lanes(level, &lanes, points, &u, &mut walks, &mut id, &mut pmf);
                    for &i in &lanes {
                        let i = i as usize;
                        let alone = sampler.sample(&points.reference(i), u[i]);
                        let lane = (pmf[i] > 0.0).then_some(PickedLight { id: LightId(id[i]), pmf: pmf[i] });
                        assert_eq!(lane, alone, "{level:?} {lights} {i}");
                    }
                    let asked = std::array::from_fn(|i| (i * 7 % all.len()) as u32);
                    sampler.pmf_lanes(level, &lanes, points, &asked, &mut walks, &mut pmf);
                    for &i in &lanes {
                        let i = i as usize;
                        assert_eq!(pmf[i], sampler.pmf(&points.reference(i), LightId(asked[i])), "{level:?} {lights}");
                    }
                }
            }
        }
    }
}
