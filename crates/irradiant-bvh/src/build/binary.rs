//! A binary tree by the surface area heuristic over bins (Wald 2007).
//!
//! Leaves hold at most [`LEAF`] triangles or one user primitive; the collapse decides what becomes a leaf of the final
//! tree.

use super::gather::Ref;
use crate::lanes::{Lanes, Native};

/// Ranges of this many triangles or fewer are not split: connected ones fit one block.
const LEAF: usize = 5;
/// Bins along an axis at most.
const MAX_BINS: usize = 64;
/// Subtrees deeper than this are split in halves: it bounds the recursion for boxes whose sizes span hundreds of octaves.
const MAX_SAH_DEPTH: usize = 64;
/// Below this many primitives a subtree is built by one thread.
const PARALLEL: usize = 1 << 14;

/// How to choose where to split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Split {
    /// Where the surface area heuristic is least.
    Sah,
    /// In the middle of the list along the longest axis: bounds the depth by the logarithm of the count.
    Halve,
}

/// A node of the binary tree, in depth-first order: the left child is the next one.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Node {
    pub lo: [f32; 3],
    /// Distance to the right child; 0 for a leaf.
    pub right: u32,
    pub hi: [f32; 3],
    /// Number of primitives below; they are contiguous, the left child's first.
    pub count: u32,
}

/// Splits `refs` (reordering them) into a tree. `refs` must not be empty.
pub(crate) fn build(refs: &mut [Ref], split: Split) -> Vec<Node> {
    let mut nodes = Vec::new();
    subtree(refs, split, 0, &mut nodes);
    nodes
}

/// Lower and upper corners, four lanes each.
#[derive(Clone, Copy)]
struct Bounds {
    lo: Native,
    hi: Native,
}

impl Bounds {
    #[inline(always)]
    fn empty() -> Self {
        Self { lo: Native::splat(f32::INFINITY), hi: Native::splat(f32::NEG_INFINITY) }
    }
    #[inline(always)]
    fn grow(&mut self, lo: Native, hi: Native) {
        self.lo = lo.min(self.lo);
        self.hi = hi.max(self.hi);
    }
    /// Half the surface area after scaling; 0 if empty.
    #[inline(always)]
    fn half_area(&self, scale: Native) -> f32 {
        let [x, y, z, _] = ((self.hi - self.lo) * scale).max(Native::splat(0.0)).to_array();
        x * y + y * z + z * x
    }
}

fn subtree(refs: &mut [Ref], split: Split, depth: usize, nodes: &mut Vec<Node>) {
    let mut boxes = Bounds::empty();
    let mut centres = Bounds::empty();
    for r in refs.iter() {
        let (lo, hi) = (r.lo(), r.hi());
        boxes.grow(lo, hi);
        let centre = lo + hi;
        centres.grow(centre, centre);
    }
    let at = nodes.len();
    let ([lx, ly, lz, _], [hx, hy, hz, _]) = (boxes.lo.to_array(), boxes.hi.to_array());
    nodes.push(Node { lo: [lx, ly, lz], right: 0, hi: [hx, hy, hz], count: refs.len() as u32 });
    let users = if refs.len() <= LEAF { refs.iter().filter(|r| r.is_user()).count() } else { 0 };
    if refs.len() == 1 || (refs.len() <= LEAF && users == 0) {
        return;
    }
    let middle = match split {
        Split::Sah if depth < MAX_SAH_DEPTH => best_split(refs, &boxes, &centres),
        Split::Sah | Split::Halve => None,
    };
    let middle = middle.unwrap_or_else(|| halve(refs, &centres, users));
    let (left, right) = refs.split_at_mut(middle);
    if left.len() + right.len() > PARALLEL {
        let mut second = Vec::new();
        rayon::join(|| subtree(left, split, depth + 1, nodes), || subtree(right, split, depth + 1, &mut second));
        nodes[at].right = (nodes.len() - at) as u32;
        nodes.append(&mut second);
    } else {
        subtree(left, split, depth + 1, nodes);
        nodes[at].right = (nodes.len() - at) as u32;
        subtree(right, split, depth + 1, nodes);
    }
}

/// Half of the list by centre along the widest axis, or triangles before users where few of both remain.
fn halve(refs: &mut [Ref], centres: &Bounds, users: usize) -> usize {
    if 0 < users && users < refs.len() {
        refs.sort_unstable_by_key(|r| (r.is_user(), r.id()));
        return refs.len() - users;
    }
    let extent = (centres.hi - centres.lo).to_array();
    let axis = (1..3).fold(0, |best, a| if extent[a] > extent[best] { a } else { best });
    let middle = refs.len() / 2;
    let key = |r: &Ref| (r.is_user(), r.id());
    refs.select_nth_unstable_by(middle, |a, b| {
        a.centre(axis).total_cmp(&b.centre(axis)).then_with(|| key(a).cmp(&key(b)))
    });
    middle
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

/// Blocks that `n` triangles fill, as a cost.
#[inline(always)]
fn blocks(n: u32) -> f32 {
    n.div_ceil(LEAF as u32) as f32
}

/// Maps centres to bins.
struct Binning {
    origin: Native,
    scale: Native,
    last: Native,
}

impl Binning {
    #[inline(always)]
    fn bins(&self, r: &Ref) -> [usize; 3] {
        let [x, y, z, _] = ((r.lo() + r.hi() - self.origin) * self.scale).min(self.last).to_array();
        // `as` saturates and sends NaN to 0.
        [x as u32 as usize, y as u32 as usize, z as u32 as usize]
    }
}

/// Partitions `refs` at the cheapest plane between bins; `None` if no plane separates anything.
///
/// Not inlined, so that its bins do not sit in every frame of the recursion.
#[inline(never)]
fn best_split(refs: &mut [Ref], boxes: &Bounds, centres: &Bounds) -> Option<usize> {
    let n_bins = (8 + refs.len() / 2).min(MAX_BINS);
    let extent = (centres.hi - centres.lo).to_array();
    let size = (boxes.hi - boxes.lo).to_array();
    let largest = size[0].max(size[1]).max(size[2]);
    let area_scale = Native::splat(if largest > 0.0 { (1.0 / largest).min(1e37) } else { 0.0 });
    let mut scale = [0.0; 4];
    for axis in 0..3 {
        if extent[axis] > 0.0 {
            scale[axis] = (n_bins as f32 * 0.99999 / extent[axis]).min(1e38);
        }
    }
    let binning = Binning { origin: centres.lo, scale: Native::load(&scale), last: Native::splat((n_bins - 1) as f32) };
    let mut bins = [[Bin { bounds: Bounds::empty(), count: 0 }; 3]; MAX_BINS];
    for r in refs.iter() {
        let (lo, hi) = (r.lo(), r.hi());
        for (axis, bin) in binning.bins(r).into_iter().enumerate() {
            let bin = &mut bins[bin & (MAX_BINS - 1)][axis];
            bin.bounds.grow(lo, hi);
            bin.count += 1;
        }
    }

    // Costs of everything at or above a bin, then a sweep from below.
    let mut above = [[0.0f32; 3]; MAX_BINS];
    let mut right = [Bin { bounds: Bounds::empty(), count: 0 }; 3];
    for i in (1..n_bins).rev() {
        for axis in 0..3 {
            right[axis].bounds.grow(bins[i][axis].bounds.lo, bins[i][axis].bounds.hi);
            right[axis].count += bins[i][axis].count;
            above[i][axis] = right[axis].bounds.half_area(area_scale) * blocks(right[axis].count);
        }
    }
    let total = refs.len() as u32;
    let mut left = [Bin { bounds: Bounds::empty(), count: 0 }; 3];
    let mut best = (f32::INFINITY, 0, 0);
    for i in 1..n_bins {
        for axis in 0..3 {
            left[axis].bounds.grow(bins[i - 1][axis].bounds.lo, bins[i - 1][axis].bounds.hi);
            left[axis].count += bins[i - 1][axis].count;
            let cost = left[axis].bounds.half_area(area_scale) * blocks(left[axis].count) + above[i][axis];
            if 0 < left[axis].count && left[axis].count < total && cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    let (cost, axis, first_right) = best;
    if cost == f32::INFINITY {
        return None;
    }
    // Branchless partition: swap always, advance if it belongs to the left.
    let mut middle = 0;
    for i in 0..refs.len() {
        let is_left = binning.bins(&refs[i])[axis] < first_right;
        refs.swap(i, middle);
        middle += usize::from(is_left);
    }
    Some(middle)
}
