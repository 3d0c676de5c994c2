//! From two children to eight: the cheapest wide tree that the binary one contains (Ylitie et al. 2017, section 3.1).
//!
//! `cost(n, i)` is the least cost of representing the subtree `n` by at most `i` children of some wide node. With
//! one child it is either a leaf or a wide node of its own, whose eight slots are shared between `n`'s two sides.

use rayon::prelude::*;

use super::binary;
use super::gather::{FAR, Ref};
use super::pack::{self, Packed};
use super::{BuildInput, BuildReport, BuildSettings};
use crate::node::{Bvh, Child, LAST_USER, Node, WIDTH};
use crate::pages::{move_to_large_pages, vec_on_large_pages};

/// The choice for `n` slots at index `n - 1`: how many go to the left child; 0 means a leaf (for one slot), or
/// "as with one slot fewer". With one slot, the number counts out of the eight of the new node.
type Choices = [u8; 8];

/// What each triangle adds to the cost of a leaf: it may be a candidate.
const CANDIDATE: f32 = 0.02;

/// Trees over more primitives than this do not stay in the cache. A node of them is waited for, while the blocks of a leaf come one after another: a block costs
/// [`FOLLOWING`] of what it does otherwise.
///
/// CPU time of rendering with blocks at 0.3 and 0.15 instead of 0.6: a street of 250,000 triangles 1.05 and 1.09, 1,000 lamps 1.02 and 1.07, a million triangles
/// 0.98 and 0.98. Rays alone in trees of a million: 1.03 and 1.08 times as many.
const CACHED: usize = 1 << 19;
const FOLLOWING: f32 = 0.25;

/// Leaves whose blocks are filled before they are put together: a few megabytes.
const WAVE: usize = 1 << 14;

struct Plan<'a> {
    tree: &'a [binary::Node],
    refs: &'a [Ref],
    settings: &'a BuildSettings,
    /// Brings extents to about 1 before areas are taken.
    scale: f64,
    /// Triangles that a block of a leaf holds, if there are enough.
    per_block: f32,
    block_cost: f32,
}

/// Costs of a subtree in 1 to 7 slots.
#[derive(Clone, Copy)]
struct Costs {
    of: [f64; 7],
    has_triangles: bool,
    has_users: bool,
}

pub(crate) fn collapse(
    tree: &[binary::Node],
    refs: Vec<Ref>,
    input: &BuildInput,
    starts: &[u32],
    settings: &BuildSettings,
    mut report: BuildReport,
) -> Bvh {
    let root = &tree[0];
    let extent = (0..3).map(|a| f64::from(root.hi[a]) - f64::from(root.lo[a])).fold(0.0, f64::max);
    let plan = Plan {
        tree,
        refs: &refs,
        settings,
        scale: if extent > 0.0 { 1.0 / extent } else { 0.0 },
        per_block: pack::triangles_per_block(&refs, input, starts),
        block_cost: settings.block_cost * if refs.len() > CACHED { FOLLOWING } else { 1.0 },
    };
    let mut choices = vec![[0u8; 8]; tree.len()];
    let costs = plan.decide(0, 0, &mut choices);
    let root_area = plan.half_area(0);

    // Topology: which wide node holds what, and where leaves go. Children of a node get neighbouring indices.
    let mut layout = Layout::default();
    layout.lay_out(&plan, &choices);
    drop(choices);

    // Room for somewhat more than is expected: memory that is never touched costs nothing.
    let mut blocks = vec_on_large_pages((1.25 * report.triangles as f32 / plan.per_block) as usize);
    let mut first_blocks: Vec<u32> = Vec::with_capacity(layout.leaves.len());
    // Not all at once: what the threads fill is copied while it is in the cache, and its memory used again. Having all threads clear what a wave is copied to first:
    // 1.02 of the time of two threads.
    for wave in layout.leaves.chunks(WAVE) {
        let packed: Vec<Packed> =
            wave.par_chunks(WAVE / 32).map(|runs| pack::pack(runs, &refs, input, starts)).collect();
        for part in packed {
            let first_block = blocks.len() as u32;
            blocks.extend_from_slice(&part.blocks);
            first_blocks.extend(part.first_blocks.iter().map(|b| b + first_block));
        }
    }
    let mut nodes: Vec<Node> = vec_on_large_pages(layout.nodes.len());
    layout
        .nodes
        .par_iter()
        .with_min_len(512)
        .map(|wide| wide_node(tree, wide, &first_blocks))
        .collect_into_vec(&mut nodes);
    move_to_large_pages(&blocks);
    move_to_large_pages(&nodes);
    let mut users = Vec::with_capacity(report.users);
    for leaf in &layout.users {
        let mut ids: Vec<u32> = refs[leaf.first..leaf.first + leaf.count].iter().map(Ref::id).collect();
        ids.sort_unstable();
        if let Some(last) = ids.last_mut() {
            *last |= LAST_USER;
        }
        users.extend(ids);
    }
    report.nodes = nodes.len();
    report.blocks = blocks.len();
    report.sah_cost = if root_area > 0.0 { costs.of[0] / root_area } else { 0.0 };
    let far = |a: f32| if a.abs() >= FAR { f32::INFINITY.copysign(a) } else { a };
    Bvh { nodes, blocks, users, bounds: Some([root.lo.map(far), root.hi.map(far)]), report }
}

impl Plan<'_> {
    fn half_area(&self, n: usize) -> f64 {
        let node = &self.tree[n];
        let [x, y, z] = [0, 1, 2].map(|a| (f64::from(node.hi[a]) - f64::from(node.lo[a])) * self.scale);
        x * y + y * z + z * x
    }

    /// Fills `choices` (those of the subtree of `n`) and returns its costs. `first` is the subtree's first reference.
    fn decide(&self, n: usize, first: usize, choices: &mut [Choices]) -> Costs {
        let node = &self.tree[n];
        let area = self.half_area(n);
        if node.right == 0 {
            let is_user = self.refs[first].is_user();
            let cost = self.leaf_cost(node.count, is_user);
            return Costs { of: [area * cost; 7], has_triangles: !is_user, has_users: is_user };
        }
        let right = node.right as usize;
        let (mine, below) = choices.split_first_mut().expect("a subtree has its root");
        let (left_choices, right_choices) = below.split_at_mut(right - 1);
        let left_count = self.tree[n + 1].count as usize;
        let mut go_left = || self.decide(n + 1, first, left_choices);
        let mut go_right = || self.decide(n + right, first + left_count, right_choices);
        let (l, r) = if node.count > 1 << 14 { rayon::join(go_left, go_right) } else { (go_left(), go_right()) };

        let share = |slots: usize| {
            let mut best = (f64::INFINITY, 0);
            for k in 1.max(slots.saturating_sub(7))..=(slots - 1).min(7) {
                let cost = l.of[k - 1] + r.of[slots - k - 1];
                if cost < best.0 {
                    best = (cost, k as u8);
                }
            }
            best
        };
        let (has_triangles, has_users) = (l.has_triangles | r.has_triangles, l.has_users | r.has_users);
        let mut of = [0.0; 7];
        let (cost, k) = share(WIDTH);
        (of[0], mine[0]) = (cost + area * f64::from(self.settings.node_cost), k);
        let mixed = has_triangles && has_users;
        let fits = has_users || node.count as f32 <= self.per_block * self.settings.max_leaf_blocks as f32;
        // The root is always a wide node, so that traversal has somewhere to start.
        if !mixed && fits && n != 0 {
            let leaf = area * self.leaf_cost(node.count, has_users);
            if leaf <= of[0] {
                (of[0], mine[0]) = (leaf, 0);
            }
        }
        for slots in 2..WIDTH {
            let (cost, k) = share(slots);
            (of[slots - 1], mine[slots - 1]) = if cost < of[slots - 2] { (cost, k) } else { (of[slots - 2], 0) };
        }
        Costs { of, has_triangles, has_users }
    }

    fn leaf_cost(&self, count: u32, is_user: bool) -> f64 {
        f64::from(if is_user {
            self.settings.user_cost * count as f32
        } else {
            self.block_cost * f32::max(1.0, count as f32 / self.per_block) + CANDIDATE * count as f32
        })
    }
}

/// A wide node: the binary nodes in its slots, and references to them; leaves of triangles by number.
struct WideNode {
    n: u8,
    slots: [(u32, Child); WIDTH],
}

/// A run of references that go to one leaf.
pub(super) struct Run {
    pub first: usize,
    pub count: usize,
}

#[derive(Default)]
struct Layout {
    nodes: Vec<WideNode>,
    leaves: Vec<Run>,
    users: Vec<Run>,
}

impl Layout {
    fn lay_out(&mut self, plan: &Plan, choices: &[Choices]) {
        self.nodes.push(WideNode { n: 0, slots: [(0, Child(0)); WIDTH] });
        // Wide node, its binary root, that one's first reference.
        let mut pending = vec![(0usize, 0usize, 0usize)];
        let mut n_users = 0;
        let mut slots: Vec<(usize, usize)> = Vec::with_capacity(WIDTH);
        let mut order: Vec<(u32, f64, usize, usize)> = Vec::with_capacity(WIDTH);
        while let Some((wide, n, first)) = pending.pop() {
            slots.clear();
            if plan.tree[n].right == 0 {
                // Only the root may be a leaf here.
                slots.push((n, first));
            } else {
                let k = usize::from(choices[n][0]);
                open(plan, choices, n, first, k, WIDTH - k, &mut slots);
            }
            // Any-hit traversal takes the last slot first. A few triangles in a box fill it and are soon tested; many are leaves of a tree, or hair (see
            // `traverse::walk`). Of about as many, the smaller box.
            let few = |n: usize| plan.tree[n].count.max(1).ilog2() / 2;
            order.clear();
            order.extend(slots.iter().map(|&(n, first)| (few(n), plan.half_area(n), n, first)));
            order.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| b.1.total_cmp(&a.1)));
            let mark = pending.len();
            for (i, &(_, _, child, first)) in order.iter().enumerate() {
                let count = plan.tree[child].count as usize;
                let is_leaf = plan.tree[child].right == 0 || choices[child][0] == 0;
                let reference = if !is_leaf {
                    self.nodes.push(WideNode { n: 0, slots: [(0, Child(0)); WIDTH] });
                    pending.push((self.nodes.len() - 1, child, first));
                    Child::node(self.nodes.len() - 1)
                } else if plan.refs[first].is_user() {
                    self.users.push(Run { first, count });
                    n_users += count;
                    Child::users(n_users - count)
                } else {
                    self.leaves.push(Run { first, count });
                    Child::triangles(self.leaves.len() - 1)
                };
                self.nodes[wide].slots[i] = (child as u32, reference);
            }
            self.nodes[wide].n = slots.len() as u8;
            pending[mark..].reverse();
        }
    }
}

/// Lists the binary nodes that fill a node's slots when `k` go to the left child of `n` and `m` to the right.
fn open(plan: &Plan, choices: &[Choices], n: usize, first: usize, k: usize, m: usize, out: &mut Vec<(usize, usize)>) {
    let left = n + 1;
    let right = n + plan.tree[n].right as usize;
    for (child, first, mut slots) in [(left, first, k), (right, first + plan.tree[left].count as usize, m)] {
        if plan.tree[child].right == 0 {
            slots = 1;
        }
        while slots > 1 && choices[child][slots - 1] == 0 {
            slots -= 1;
        }
        if slots == 1 {
            out.push((child, first));
        } else {
            let to_left = usize::from(choices[child][slots - 1]);
            open(plan, choices, child, first, to_left, slots - to_left, out);
        }
    }
}

fn wide_node(tree: &[binary::Node], wide: &WideNode, first_blocks: &[u32]) -> Node {
    let mut node = Node::EMPTY;
    for (i, &(child, reference)) in wide.slots[..usize::from(wide.n)].iter().enumerate() {
        let source = &tree[child as usize];
        for axis in 0..3 {
            let (lo, hi) = (source.lo[axis], source.hi[axis]);
            node.planes[2 * axis][i] = if lo <= -FAR { f32::NEG_INFINITY } else { lo };
            node.planes[2 * axis + 1][i] = if hi >= FAR { f32::INFINITY } else { hi };
        }
        let is_triangles = reference.is_leaf() && !reference.is_users();
        node.children[i] =
            if is_triangles { Child::triangles(first_blocks[reference.index()] as usize) } else { reference };
    }
    node
}
