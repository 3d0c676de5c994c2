//! A tree of light bounds: walks down towards the lights that matter at a point, by estimates of four children at once.
//!
//! After Conty Estevez and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting", and pbrt-v4's
//! `BVHLightSampler`. The build is pbrt-v4's (12 buckets by each axis); nodes are then widened to four children, whose
//! estimates are computed in four lanes without branches. Cost: some 25 ns a node, one for up to 4 lights, some 3 for 64
//! and 10 for 1000 (where the binary tree's uneven splits leave lanes empty).

use super::{Infinite, Part, PickedLight};
use crate::interaction::{LightId, ReferencePoint};
use crate::light::{Light, LightBounds};
use irradiant_math::{Bounds3, Normal3, Point3};
use std::ops::{Add, Div, Mul, Sub};

/// Children of a node.
pub(super) const WIDTH: usize = 4;
const BUCKETS: usize = 12;
/// Marks children that are lights.
pub(super) const LEAF: u32 = 1 << 31;

/// A number of each child.
pub(super) type Lanes = [f32; WIDTH];

/// Where lights are, which way they shine and how much: of one group of lights, or of several side by side.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(super) struct Cones<T> {
    center: [T; 3],
    radius_squared: T,
    /// See [`LightBounds::least_distance_squared`].
    least: T,
    axis: [T; 3],
    cos_normals: T,
    sin_normals: T,
    cos_emission: T,
    /// 1 where emission goes to both sides.
    two_sided: T,
    power: T,
}

impl<T: Copy> Cones<T> {
    /// All the same.
    pub const fn splat(x: T) -> Self {
        Self {
            center: [x; 3],
            radius_squared: x,
            least: x,
            axis: [x; 3],
            cos_normals: x,
            sin_normals: x,
            cos_emission: x,
            two_sided: x,
            power: x,
        }
    }

    /// Something of each number.
    #[inline(always)]
    pub fn of<U>(&self, f: impl Fn(&T) -> U) -> Cones<U> {
        Cones {
            center: [f(&self.center[0]), f(&self.center[1]), f(&self.center[2])],
            radius_squared: f(&self.radius_squared),
            least: f(&self.least),
            axis: [f(&self.axis[0]), f(&self.axis[1]), f(&self.axis[2])],
            cos_normals: f(&self.cos_normals),
            sin_normals: f(&self.sin_normals),
            cos_emission: f(&self.cos_emission),
            two_sided: f(&self.two_sided),
            power: f(&self.power),
        }
    }

    /// Puts each number of others into its place here.
    #[inline(always)]
    pub fn put<U>(&mut self, from: &Cones<U>, f: impl Fn(&mut T, &U)) {
        for i in 0..3 {
            f(&mut self.center[i], &from.center[i]);
            f(&mut self.axis[i], &from.axis[i]);
        }
        f(&mut self.radius_squared, &from.radius_squared);
        f(&mut self.least, &from.least);
        f(&mut self.cos_normals, &from.cos_normals);
        f(&mut self.sin_normals, &from.sin_normals);
        f(&mut self.cos_emission, &from.cos_emission);
        f(&mut self.two_sided, &from.two_sided);
        f(&mut self.power, &from.power);
    }
}

impl<T: Number> Cones<T> {
    /// [`LightBounds::importance`] at a point of this normal, zero for none.
    #[inline(always)]
    pub fn importance(&self, p: [T; 3], n: [T; 3], has_normal: bool) -> T {
        let d = [p[0] - self.center[0], p[1] - self.center[1], p[2] - self.center[2]];
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let distance_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let inverse = one / distance_squared.greater(T::splat(f32::MIN_POSITIVE)).root();
        let axis = self.axis;
        let cos_w = (axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2]) * inverse;
        let cos_w = self.two_sided.select_if_positive(cos_w.magnitude(), cos_w);
        let sin_w = (one - cos_w * cos_w).greater(zero).root();

        let outside = distance_squared - self.radius_squared;
        let sin2_b = self.radius_squared * (inverse * inverse);
        let cos_b = outside.select_if_positive((one - sin2_b).greater(zero).root(), T::splat(-1.0));
        let sin_b = outside.select_if_positive(sin2_b.root(), zero);

        let (cos_o, sin_o) = (self.cos_normals, self.sin_normals);
        let within = cos_w - cos_o;
        let cos_x = within.select_if_positive(one, cos_w * cos_o + sin_w * sin_o);
        let sin_x = within.select_if_positive(zero, sin_w * cos_o - cos_w * sin_o);
        let cos_p = (cos_x - cos_b).select_if_positive(one, cos_x * cos_b + sin_x * sin_b);

        let importance = self.power * cos_p / distance_squared.greater(self.least);
        let importance = (cos_p - self.cos_emission).select_if_positive(importance.greater(zero), zero);
        let cos_i = ((d[0] * n[0] + d[1] * n[1] + d[2] * n[2]) * inverse).magnitude();
        let sin_i = (one - cos_i * cos_i).greater(zero).root();
        let facing = (cos_i - cos_b).select_if_positive(one, cos_i * cos_b + sin_i * sin_b);
        let faced = importance * facing.greater(zero);
        if has_normal { faced } else { importance }
    }
}

impl Cones<f32> {
    /// Whether there is no such child: its importance is 0.
    #[inline(always)]
    pub fn is_absent(&self) -> bool {
        !(self.power > 0.0)
    }
}

/// Four children; absent ones have power 0.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub(super) struct Node {
    pub cones: Cones<Lanes>,
    pub children: [u32; WIDTH],
    pub parent: Place,
}

/// A lane of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub node: u32,
    pub lane: u32,
}

impl Place {
    /// Of the root's parent, and of lights that are in no node.
    pub const NONE: Self = Self { node: u32::MAX, lane: 0 };
}

/// Picks by a tree of bounds.
#[derive(Clone, Debug)]
pub struct TreeSampler {
    pub(super) nodes: Vec<Node>,
    /// Where each light is.
    pub(super) places: Vec<Place>,
    /// Which lights are at infinity.
    pub(super) at_infinity: Vec<bool>,
    pub(super) infinite: Infinite,
}

impl Node {
    fn new(parent: Place) -> Self {
        let mut cones = Cones::splat([0.0; WIDTH]);
        cones.least = [1.0; WIDTH];
        cones.cos_emission = [2.0; WIDTH];
        Self { cones, children: [0; WIDTH], parent }
    }

    fn set(&mut self, lane: usize, b: &LightBounds, child: u32) {
        let (center, axis) = (b.bounds.center(), b.axis);
        let radius = center.distance(b.bounds.max);
        let one = Cones {
            center: center.to_array(),
            radius_squared: radius * radius,
            least: b.least_distance_squared(),
            axis: axis.to_array(),
            cos_normals: b.cos_normals,
            sin_normals: (1.0 - b.cos_normals * b.cos_normals).max(0.0).sqrt(),
            cos_emission: b.cos_emission,
            two_sided: if b.two_sided { 1.0 } else { 0.0 },
            power: b.power,
        };
        self.cones.put(&one, |all, one| all[lane] = *one);
        self.children[lane] = child;
    }

    /// [`LightBounds::importance`] of each child.
    ///
    /// Lane by lane in each step, without branches: LLVM makes packed instructions of these, while one loop over the
    /// lanes stayed scalar (2.5 times slower).
    #[inline]
    fn importances(&self, p: Point3, n: Normal3) -> Lanes {
        let splat = |v: [f32; 3]| [Four::splat(v[0]), Four::splat(v[1]), Four::splat(v[2])];
        let cones = self.cones.of(|row| Four(*row));
        cones.importance(splat(p.to_array()), splat(n.to_array()), n != Normal3::ZERO).0
    }
}

/// What importances are computed with: one number, or several at once.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// This number.
    fn splat(x: f32) -> Self;
    /// Square root.
    fn root(self) -> Self;
    /// Without its sign.
    fn magnitude(self) -> Self;
    /// The greater one; `b` if one is NaN.
    fn greater(self, b: Self) -> Self;
    /// `yes` where `self` > 0, else `no`.
    fn select_if_positive(self, yes: Self, no: Self) -> Self;
}

impl Number for f32 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn greater(self, b: Self) -> Self {
        if self > b { self } else { b }
    }

    #[inline(always)]
    fn select_if_positive(self, yes: Self, no: Self) -> Self {
        if self > 0.0 { yes } else { no }
    }
}

/// Four numbers at once.
#[derive(Clone, Copy, Debug)]
struct Four(Lanes);

impl Four {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let (a, b) = (self.0, b.0);
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }
}

impl Number for Four {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }

    #[inline(always)]
    fn root(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    fn greater(self, b: Self) -> Self {
        self.zip(b, f32::greater)
    }

    #[inline(always)]
    fn select_if_positive(self, yes: Self, no: Self) -> Self {
        let (s, y, n) = (self.0, yes.0, no.0);
        let one = |i: usize| s[i].select_if_positive(y[i], n[i]);
        Self([one(0), one(1), one(2), one(3)])
    }
}

macro_rules! four_operators {
    ($($operator:ident $function:ident $symbol:tt;)*) => {$(
        impl $operator for Four {
            type Output = Self;
            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                self.zip(b, |a, b| a $symbol b)
            }
        }
    )*};
}

four_operators! { Add add +; Sub sub -; Mul mul *; Div div /; }

#[inline(always)]
pub(super) fn sum(v: &Lanes) -> f32 {
    (v[0] + v[1]) + (v[2] + v[3])
}

/// A step down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// To which child; to none where no light reaches the point.
    pub lane: u32,
    pub is_good: bool,
    /// With what probability.
    pub share: f32,
    /// What is left of the random number, in [0, 1).
    pub u: f32,
}

/// Picks a child by `u` in [0, 1), in proportion to importance. Without branches.
#[inline(always)]
pub(super) fn choose(importances: &Lanes, u: f32) -> Step {
    let total = sum(importances);
    // Walk the lanes; the last one that is not empty takes what rounding leaves.
    let target = u * total;
    let (mut lane, mut below, mut reached, mut importance) = (0, 0.0, 0.0, 0.0);
    let mut is_reached = false;
    for (i, &next) in importances.iter().enumerate() {
        let is_positive = next > 0.0;
        let takes = is_positive & !is_reached;
        lane = if takes { i as u32 } else { lane };
        below = if takes { reached } else { below };
        importance = if takes { next } else { importance };
        reached += if is_positive { next } else { 0.0 };
        is_reached |= takes & (target < reached);
    }
    let u = ((target - below) / importance).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
    Step { lane, is_good: total > 0.0, share: importance / total, u }
}

impl TreeSampler {
    /// Of `lights`; those without power are in no node and are never picked.
    pub fn new(lights: &[Light]) -> Self {
        let mut items: Vec<Item> = lights
            .iter()
            .enumerate()
            .filter_map(|(i, l)| Some(Item { bounds: l.bounds()?, id: i as u32 }))
            .filter(|item| item.bounds.power > 0.0)
            .collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(items.len() / 2),
            places: vec![Place::NONE; lights.len()],
            at_infinity: lights.iter().map(|l| l.bounds().is_none()).collect(),
            infinite: Infinite::new(lights, !items.is_empty()),
        };
        if !items.is_empty() {
            let root = build(&mut items);
            match &root.kind {
                Kind::Leaf(_) => tree.flatten(vec![root], Place::NONE),
                Kind::Pair(_) => tree.flatten(widen(root), Place::NONE),
            };
        }
        tree
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Appends a node of these children (depth first), returns its index.
    fn flatten(&mut self, children: Vec<Binary>, parent: Place) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::new(parent));
        for (lane, child) in children.into_iter().enumerate() {
            let place = Place { node: index, lane: lane as u32 };
            let bounds = child.bounds;
            let reference = match child.kind {
                Kind::Leaf(id) => {
                    self.places[id as usize] = place;
                    id | LEAF
                }
                Kind::Pair(_) => self.flatten(widen(child), place),
            };
            self.nodes[index as usize].set(lane, &bounds, reference);
        }
        index
    }

    /// See [`super::LightSampler::sample`].
    #[inline]
    pub fn sample(&self, at: &ReferencePoint, u: f32) -> Option<PickedLight> {
        let (mut u, mut pmf) = match self.infinite.choose(u)? {
            Part::Infinite(picked) => return Some(picked),
            Part::Bounded(u, share) => (u, share),
        };
        let mut node = self.nodes.first()?;
        loop {
            let step = choose(&node.importances(at.p, at.ns), u);
            if !step.is_good {
                return None;
            }
            pmf *= step.share;
            u = step.u;
            let child = node.children[step.lane as usize];
            if child & LEAF != 0 {
                return (pmf > 0.0).then_some(PickedLight { id: LightId(child & !LEAF), pmf });
            }
            node = &self.nodes[child as usize];
        }
    }

    /// See [`super::LightSampler::pmf`].
    #[inline]
    pub fn pmf(&self, at: &ReferencePoint, id: LightId) -> f32 {
        if self.at_infinity[id.0 as usize] {
            return self.infinite.each;
        }
        let mut place = self.places[id.0 as usize];
        if place == Place::NONE {
            return 0.0;
        }
        let mut pmf = self.infinite.bounded_share();
        while place != Place::NONE {
            let node = &self.nodes[place.node as usize];
            let importances = node.importances(at.p, at.ns);
            let importance = importances[place.lane as usize];
            if !(importance > 0.0) {
                return 0.0;
            }
            pmf *= importance / sum(&importances);
            place = node.parent;
        }
        pmf
    }
}

/// A light while the tree is built.
#[derive(Clone, Copy, Debug)]
struct Item {
    bounds: LightBounds,
    id: u32,
}

/// A node of the binary tree that is built first.
#[derive(Debug)]
struct Binary {
    bounds: LightBounds,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Leaf(u32),
    Pair(Box<[Binary; 2]>),
}

/// The children of a wide node: the biggest pairs are opened until there are four.
fn widen(root: Binary) -> Vec<Binary> {
    let mut children = vec![root];
    while children.len() < WIDTH {
        let size = |b: &Binary| match b.kind {
            Kind::Leaf(_) => -1.0,
            Kind::Pair(_) => b.bounds.power * (1e-30 + b.bounds.bounds.diagonal().length_squared()),
        };
        let biggest = (0..children.len()).max_by(|&a, &b| size(&children[a]).total_cmp(&size(&children[b])));
        let Some(i) = biggest.filter(|&i| matches!(children[i].kind, Kind::Pair(_))) else { break };
        if let Kind::Pair(pair) = children.swap_remove(i).kind {
            children.extend(*pair);
        }
    }
    children
}

fn build(items: &mut [Item]) -> Binary {
    if let [item] = items {
        return Binary { bounds: item.bounds, kind: Kind::Leaf(item.id) };
    }
    let middle = split(items);
    let (left, right) = items.split_at_mut(middle);
    let pair = [build(left), build(right)];
    Binary { bounds: pair[0].bounds.union(&pair[1].bounds), kind: Kind::Pair(Box::new(pair)) }
}

/// Orders the items into two groups, returns the size of the first; both have at least one.
fn split(items: &mut [Item]) -> usize {
    let mut bounds = Bounds3::EMPTY;
    let mut centroids = Bounds3::EMPTY;
    for item in items.iter() {
        bounds = bounds.union(item.bounds.bounds);
        centroids = centroids.including(item.bounds.bounds.center());
    }
    let extent = centroids.diagonal().to_array();
    let low = centroids.min.to_array();
    let bucket = |item: &Item, dimension: usize| {
        let c = item.bounds.bounds.center().to_array()[dimension];
        (((c - low[dimension]) / extent[dimension] * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    let widest = centroids.diagonal().max_dimension();
    for dimension in 0..3 {
        // In big nodes the widest axis is good enough: trying all takes three times as long.
        if !(extent[dimension] > 0.0) || (items.len() > 1024 && dimension != widest) {
            continue;
        }
        let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for item in items.iter() {
            let b = &mut buckets[bucket(item, dimension)];
            *b = join(b.as_ref(), Some(&item.bounds));
        }
        // Costs of the groups above each boundary, then of those below.
        let mut above = [0.0; BUCKETS];
        let mut group = None;
        for i in (1..BUCKETS).rev() {
            group = join(group.as_ref(), buckets[i].as_ref());
            above[i] = group.as_ref().map_or(f32::INFINITY, |g| g.cost(&bounds, dimension));
        }
        let mut group = None;
        for i in 1..BUCKETS {
            group = join(group.as_ref(), buckets[i - 1].as_ref());
            let below = group.as_ref().map_or(f32::INFINITY, |g| g.cost(&bounds, dimension));
            let cost = below + above[i];
            if cost.is_finite() && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, dimension, i));
            }
        }
    }
    if let Some((_, dimension, boundary)) = best {
        let (mut first, second): (Vec<Item>, Vec<Item>) =
            items.iter().partition(|item| bucket(item, dimension) < boundary);
        let middle = first.len();
        if middle > 0 && middle < items.len() {
            first.extend(second);
            items.copy_from_slice(&first);
            return middle;
        }
    }
    items.len() / 2
}

fn join(a: Option<&LightBounds>, b: Option<&LightBounds>) -> Option<LightBounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b).copied(),
    }
}
