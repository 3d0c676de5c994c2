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

const WIDTH: usize = 4;
const BUCKETS: usize = 12;
/// Marks children that are lights.
const LEAF: u32 = 1 << 31;

type Lanes = [f32; WIDTH];

/// Four children; absent ones have power 0.
#[derive(Clone, Debug)]
#[repr(align(16))]
struct Node {
    center: [Lanes; 3],
    radius_squared: Lanes,
    /// See [`LightBounds::least_distance_squared`].
    least: Lanes,
    axis: [Lanes; 3],
    cos_normals: Lanes,
    sin_normals: Lanes,
    cos_emission: Lanes,
    /// 1 where emission goes to both sides.
    two_sided: Lanes,
    power: Lanes,
    children: [u32; WIDTH],
    parent: Place,
}

/// A lane of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    node: u32,
    lane: u32,
}

impl Place {
    /// Of the root's parent, and of lights that are in no node.
    const NONE: Self = Self { node: u32::MAX, lane: 0 };
}

/// Picks by a tree of bounds.
#[derive(Clone, Debug)]
pub struct TreeSampler {
    nodes: Vec<Node>,
    /// Where each light is.
    places: Vec<Place>,
    /// Which lights are at infinity.
    at_infinity: Vec<bool>,
    infinite: Infinite,
}

impl Node {
    fn new(parent: Place) -> Self {
        let zero = [0.0; WIDTH];
        Self {
            center: [zero; 3],
            radius_squared: zero,
            least: [1.0; WIDTH],
            axis: [zero; 3],
            cos_normals: zero,
            sin_normals: zero,
            cos_emission: [2.0; WIDTH],
            two_sided: zero,
            power: zero,
            children: [0; WIDTH],
            parent,
        }
    }

    fn set(&mut self, lane: usize, b: &LightBounds, child: u32) {
        let (center, axis) = (b.bounds.center(), b.axis);
        let radius = center.distance(b.bounds.max);
        for (i, (c, a)) in center.to_array().into_iter().zip(axis.to_array()).enumerate() {
            self.center[i][lane] = c;
            self.axis[i][lane] = a;
        }
        self.radius_squared[lane] = radius * radius;
        self.least[lane] = b.least_distance_squared();
        self.cos_normals[lane] = b.cos_normals;
        self.sin_normals[lane] = (1.0 - b.cos_normals * b.cos_normals).max(0.0).sqrt();
        self.cos_emission[lane] = b.cos_emission;
        self.two_sided[lane] = if b.two_sided { 1.0 } else { 0.0 };
        self.power[lane] = b.power;
        self.children[lane] = child;
    }

    /// [`LightBounds::importance`] of each child.
    ///
    /// Lane by lane in each step, without branches: LLVM makes packed instructions of these, while one loop over the
    /// lanes stayed scalar (2.5 times slower).
    #[inline]
    fn importances(&self, p: Point3, n: Normal3) -> Lanes {
        let d = [
            Four::splat(p.x) - Four(self.center[0]),
            Four::splat(p.y) - Four(self.center[1]),
            Four::splat(p.z) - Four(self.center[2]),
        ];
        let one = Four::splat(1.0);
        let distance_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let inverse = one / distance_squared.max(Four::splat(f32::MIN_POSITIVE)).sqrt();
        let axis = self.axis.map(Four);
        let cos_w = (axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2]) * inverse;
        let cos_w = Four(self.two_sided).select_if_positive(cos_w.abs(), cos_w);
        let sin_w = (one - cos_w * cos_w).max(Four::ZERO).sqrt();

        let radius_squared = Four(self.radius_squared);
        let outside = distance_squared - radius_squared;
        let sin2_b = radius_squared * (inverse * inverse);
        let cos_b = outside.select_if_positive((one - sin2_b).max(Four::ZERO).sqrt(), Four::splat(-1.0));
        let sin_b = outside.select_if_positive(sin2_b.sqrt(), Four::ZERO);

        let (cos_o, sin_o) = (Four(self.cos_normals), Four(self.sin_normals));
        let within = cos_w - cos_o;
        let cos_x = within.select_if_positive(one, cos_w * cos_o + sin_w * sin_o);
        let sin_x = within.select_if_positive(Four::ZERO, sin_w * cos_o - cos_w * sin_o);
        let cos_p = (cos_x - cos_b).select_if_positive(one, cos_x * cos_b + sin_x * sin_b);

        let importance = Four(self.power) * cos_p / distance_squared.max(Four(self.least));
        let importance = (cos_p - Four(self.cos_emission)).select_if_positive(importance.max(Four::ZERO), Four::ZERO);
        if n == Normal3::ZERO {
            return importance.0;
        }
        let cos_i = ((d[0] * Four::splat(n.x) + d[1] * Four::splat(n.y) + d[2] * Four::splat(n.z)) * inverse).abs();
        let sin_i = (one - cos_i * cos_i).max(Four::ZERO).sqrt();
        let facing = (cos_i - cos_b).select_if_positive(one, cos_i * cos_b + sin_i * sin_b);
        (importance * facing.max(Four::ZERO)).0
    }
}

/// Four numbers at once.
#[derive(Clone, Copy, Debug)]
struct Four(Lanes);

impl Four {
    const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }

    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let (a, b) = (self.0, b.0);
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }

    /// `yes` in lanes where `self` > 0, else `no`.
    #[inline(always)]
    fn select_if_positive(self, yes: Self, no: Self) -> Self {
        let (s, y, n) = (self.0, yes.0, no.0);
        let one = |i: usize| if s[i] > 0.0 { y[i] } else { n[i] };
        Self([one(0), one(1), one(2), one(3)])
    }
}

macro_rules! four_operators {
    ($($operator:ident $function:ident $symbol:tt;)*) => {$(
        impl std::ops::$operator for Four {
            type Output = Self;
            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                self.zip(b, |a, b| a $symbol b)
            }
        }
    )*};
}

four_operators! { Add add +; Sub sub -; Mul mul *; Div div /; }

#[inline]
fn sum(v: &Lanes) -> f32 {
    (v[0] + v[1]) + (v[2] + v[3])
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
            let importances = node.importances(at.p, at.ns);
            let total = sum(&importances);
            if !(total > 0.0) {
                return None;
            }
            // Walk the lanes; the last one that is not empty takes what rounding leaves.
            let target = u * total;
            let (mut lane, mut below, mut reached) = (usize::MAX, 0.0, 0.0);
            for i in 0..WIDTH {
                if importances[i] > 0.0 {
                    (lane, below) = (i, reached);
                    reached += importances[i];
                    if target < reached {
                        break;
                    }
                }
            }
            let importance = importances[lane];
            pmf *= importance / total;
            u = ((target - below) / importance).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
            let child = node.children[lane];
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
