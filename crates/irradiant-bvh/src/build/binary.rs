//! A binary tree by the surface area heuristic over bins (Wald 2007).
//!
//! Leaves hold at most [`LEAF`] triangles or one user primitive; the collapse decides what becomes a leaf of the final
//! tree.
//!
//! What was tried and is not here, on two Granite Rapids cores shared with others (nodes and blocks a ray exactly, rates within 5 to 10 %):
//! - Reinsertion of large nodes before the collapse (Bittner, Hapala, Havran 2013; Meister and Bittner 2018; 3 rounds, a twentieth of the nodes each): nodes a ray in a room of
//!   a million triangles 0.87 to 0.92, in a mesh of a million 0.94 to 0.96, in a street of 250,000 1.00. Yet single rays at 0.94 of the rate without it, geometric mean of
//!   the benchmark's twelve kinds (three runs with, two without), the street's picture by `path` 1.08 of the time, the mesh's 1.03; builds 1.04 to 1.2.
//! - Spatial splits (Stich, Friedrich, Dietrich 2009; 16 bins, triangles clipped, a fifth more references at most, of which a twelfth to a twentieth was used),
//!   with reinsertion: in the street 10.6 nodes and 7.0 blocks a primary ray instead of 11.2 and 9.4; room 11.6 and 5.2 instead of 11.6 and 6.5; mesh the same. The
//!   street's picture no faster. Builds 2.7, 3.4 and 1.5 times as long. A part's box does not hold the triangle's own, so the argument in `traverse` would need
//!   margins, and would hold only of rays that begin near the tree.
//! - Large triangles split beforehand at medians of the whole (Karras and Aila 2013), a tenth, a fifth, two fifths more references: 6.9, 6.8, 6.3 blocks in the street,
//!   as many nodes; the expected cost rises by a third, and rates do not.

use super::gather::Ref;
use crate::lanes::{Four, Lanes, Native};

/// Ranges of this many triangles or fewer are not split, unless large: connected ones fit one block.
const LEAF: usize = 5;
/// A box is large if it has this share of the area of the box of everything. The walls of a room are few triangles that every ray would meet all together.
const LARGE: f64 = 1.0 / 16.0;
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
    let everything = refs.iter().fold(Bounds::empty(), |mut all, r| {
        all.grow(r.lo(), r.hi());
        all
    });
    let rules = Rules { split, large: LARGE * everything.half_area() };
    subtree(refs, &rules, 0, &mut nodes, &mut Scratch::new());
    nodes
}

/// The same for all subtrees.
struct Rules {
    split: Split,
    /// Half the area of the boxes that are large.
    large: f64,
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
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }
    fn half_area(&self) -> f64 {
        let [x, y, z, _] = (self.hi - self.lo).to_array().map(f64::from);
        x * y + y * z + z * x
    }
}

fn subtree(refs: &mut [Ref], rules: &Rules, depth: usize, nodes: &mut Vec<Node>, scratch: &mut Scratch) {
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
    if refs.len() == 1 || (refs.len() <= LEAF && users == 0 && boxes.half_area() < rules.large) {
        return;
    }
    let middle = match rules.split {
        Split::Sah if depth < MAX_SAH_DEPTH => best_split(refs, &boxes, &centres, scratch),
        Split::Sah | Split::Halve => None,
    };
    let middle = middle.unwrap_or_else(|| halve(refs, &centres, users));
    let (left, right) = refs.split_at_mut(middle);
    if left.len() + right.len() > PARALLEL {
        let mut second = Vec::new();
        rayon::join(
            || subtree(left, rules, depth + 1, nodes, scratch),
            || subtree(right, rules, depth + 1, &mut second, &mut Scratch::new()),
        );
        nodes[at].right = (nodes.len() - at) as u32;
        nodes.append(&mut second);
    } else {
        subtree(left, rules, depth + 1, nodes, scratch);
        nodes[at].right = (nodes.len() - at) as u32;
        subtree(right, rules, depth + 1, nodes, scratch);
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

/// Maps centres to bins.
struct Binning {
    origin: Native,
    scale: Native,
    last: Native,
}

impl Binning {
    /// Bins along the three axes, as numbers in [0, last] that are still to be rounded down; the fourth lane is noise.
    #[inline(always)]
    fn bins(&self, lo: Native, hi: Native) -> Native {
        // `min` makes the last bin of a NaN, the product of an infinite distance and a scale of 0.
        ((lo + hi - self.origin) * self.scale).min(self.last)
    }
}

/// What a thread needs to find a split, kept from node to node: to clear all bins for each would take more stores than to fill
/// the few that small nodes use.
struct Scratch {
    /// Boxes of the primitives in each bin along each axis. All are empty between splits.
    bounds: [[Bounds; MAX_BINS]; 3],
    /// How many those are, with the axes in the lanes; 0 between splits.
    counts: [[u32; 4]; MAX_BINS],
    /// Costs of everything at or above a bin, with the axes in the lanes.
    above: [Native; MAX_BINS],
}

impl Scratch {
    fn new() -> Box<Self> {
        Box::new(Self {
            bounds: [[Bounds::empty(); MAX_BINS]; 3],
            counts: [[0; 4]; MAX_BINS],
            above: [Native::splat(0.0); MAX_BINS],
        })
    }
}

/// What lies on one side of a plane, for a plane along each axis.
struct Side {
    bounds: [Bounds; 3],
    counts: Native,
    /// Brings extents to about 1 before areas are taken.
    scale: Native,
}

impl Side {
    #[inline(always)]
    fn empty(scale: Native) -> Self {
        Self { bounds: [Bounds::empty(); 3], counts: Native::splat(0.0), scale }
    }

    /// Adds the bins number `i`.
    #[inline(always)]
    fn grow(&mut self, bounds: &[[Bounds; MAX_BINS]; 3], counts: &[[u32; 4]; MAX_BINS], i: usize) {
        for axis in 0..3 {
            self.bounds[axis].grow(bounds[axis][i].lo, bounds[axis][i].hi);
        }
        self.counts = self.counts + Native::from_integers(counts[i]);
    }

    /// Area times the number of blocks that as many triangles fill; infinite, or no number, if nothing is there.
    #[inline(always)]
    fn costs(&self) -> Native {
        let zero = Native::splat(0.0);
        let [x, y, z] =
            Native::transpose(self.bounds.map(|b| b.hi - b.lo)).map(|extent| (extent * self.scale).max(zero));
        // Rounded up; exact for some millions of triangles, and one more or less does not matter where there are more.
        let blocks = (self.counts + Native::splat(LEAF as f32 - 1.0)) * Native::splat(1.0 / LEAF as f32);
        let blocks = Native::from_integers(blocks.round_down());
        let none = self.counts.le(zero) & Native::splat(f32::INFINITY);
        ((x * y + y * z + z * x) * blocks) | none
    }
}

/// Partitions `refs` at the cheapest plane between bins; `None` if no plane separates anything.
fn best_split(refs: &mut [Ref], boxes: &Bounds, centres: &Bounds, scratch: &mut Scratch) -> Option<usize> {
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
    let Scratch { bounds, counts, above } = scratch;
    for r in refs.iter() {
        let (lo, hi) = (r.lo(), r.hi());
        // Masking changes nothing but lets the compiler drop its checks.
        let bins = binning.bins(lo, hi).round_down().map(|bin| bin & (MAX_BINS as u32 - 1));
        for axis in 0..3 {
            let bin = bins[axis] as usize;
            bounds[axis][bin].grow(lo, hi);
            counts[bin][axis] += 1;
        }
    }

    // Costs of everything at or above a bin, then a sweep from below.
    let mut right = Side::empty(area_scale);
    for i in (1..n_bins).rev() {
        right.grow(bounds, counts, i);
        above[i] = right.costs();
    }
    let mut left = Side::empty(area_scale);
    let (mut best, mut first_right) = (Native::splat(f32::INFINITY), Native::splat(0.0));
    for i in 1..n_bins {
        left.grow(bounds, counts, i - 1);
        let costs = left.costs() + above[i];
        first_right = (costs.lt(best) & Native::splat(i as f32)).max(first_right);
        best = costs.min(best);
    }
    for axis in bounds {
        axis[..n_bins].fill(Bounds::empty());
    }
    counts[..n_bins].fill([0; 4]);
    // Of equal costs the lowest bin, and of equal bins the first axis.
    let (best, first_right) = (best.to_array(), first_right.to_array());
    let key = |axis: usize| (best[axis], first_right[axis]);
    let axis = (1..3).fold(0, |least, axis| if key(axis) < key(least) { axis } else { least });
    if best[axis] == f32::INFINITY {
        return None;
    }
    let first_right = first_right[axis];
    // Branchless partition: swap always, advance if it belongs to the left. Numbers that are not below the last bin, or
    // are none, are in it, as above.
    let (origin, scale) = (centres.lo.to_array()[axis], scale[axis]);
    let mut middle = 0;
    for i in 0..refs.len() {
        let is_left = (refs[i].centre(axis) - origin) * scale < first_right;
        refs.swap(i, middle);
        middle += usize::from(is_left);
    }
    Some(middle)
}
