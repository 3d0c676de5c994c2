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
//!
//! What makes it fast, in CPU seconds of whole builds of a million triangles in one mesh and in 500, one thread, the same cores, by turns: 0.53 and 0.52 with one pass
//! after the other over four lanes; 0.48 and 0.50 on eight lanes, small subtrees in one loop and large ranges in chunks; 0.44 and 0.47 with two bins filled at once;
//! 0.37 and 0.39 with memory asked for ahead, here and in `pack`. Chunks of 2^14 instead of 2^15: the same.

use rayon::prelude::*;

use super::gather::Ref;
use super::wide::{Wide, widest};
use crate::lanes::{Four, Lanes, Native, TwoFours};
use crate::pages::vec_on_large_pages;
use crate::prefetch::prefetch_read;

/// Ranges of this many triangles or fewer are not split, unless large: connected ones fit one block.
const LEAF: usize = 5;
/// A box is large if it has this share of the area of the box of everything. The walls of a room are few triangles that every ray would meet all together.
const LARGE: f64 = 1.0 / 16.0;
/// Bins along an axis at most.
const MAX_BINS: usize = 64;
/// Subtrees deeper than this are split in halves: it bounds the recursion for boxes whose sizes span hundreds of octaves.
const MAX_SAH_DEPTH: usize = 64;
/// Subtrees of this many primitives or fewer are built by one thread, in its cache. Larger ranges are split by all threads, so many primitives at a time.
const CHUNK: usize = 1 << 15;

/// From this many primitives on it pays to fill bins two at a time.
const MANY: usize = 512;

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
    let everything = extent_of(refs);
    let rules = Rules { split, large: LARGE * everything.half_area() };
    let pieces = subtree(refs, &everything, &rules, 0);
    let mut nodes = vec_on_large_pages(pieces.count);
    pieces.list.iter().for_each(|piece| nodes.extend_from_slice(piece));
    nodes
}

/// The same for all subtrees.
struct Rules {
    split: Split,
    /// Half the area of the boxes that are large.
    large: f64,
}

/// The box of some primitives, and that of twice their centres, each as a lower corner and a mirrored upper one, as [`Ref`] has them: both grow
/// by what is less.
#[derive(Clone, Copy)]
struct Extent {
    boxes: [f32; 8],
    centres: [f32; 8],
}

impl Extent {
    const EMPTY: Self = Self { boxes: [f32::INFINITY; 8], centres: [f32::INFINITY; 8] };

    #[inline(always)]
    fn of<E: TwoFours>(refs: &[Ref]) -> Self {
        let empty = E::splat(f32::INFINITY);
        let (mut boxes, mut centres) = ([empty; 2], [empty; 2]);
        // Two at once, so that one does not wait for the other.
        let (pairs, last) = refs.as_chunks::<2>();
        for [a, b] in pairs {
            let (a, b) = (a.corners::<E>(), b.corners::<E>());
            boxes = [boxes[0].min(a), boxes[1].min(b)];
            centres = [centres[0].min(centre(a)), centres[1].min(centre(b))];
        }
        for r in last {
            let r = r.corners::<E>();
            boxes[0] = boxes[0].min(r);
            centres[0] = centres[0].min(centre(r));
        }
        Self { boxes: boxes[0].min(boxes[1]).to_array(), centres: centres[0].min(centres[1]).to_array() }
    }

    fn and(&self, other: &Self) -> Self {
        let less = |a: &[f32; 8], b: &[f32; 8]| std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] });
        Self { boxes: less(&self.boxes, &other.boxes), centres: less(&self.centres, &other.centres) }
    }

    #[inline(always)]
    fn sizes([lx, ly, lz, _, hx, hy, hz, _]: &[f32; 8]) -> [f32; 3] {
        [-hx - lx, -hy - ly, -hz - lz]
    }

    #[inline(always)]
    fn half_area(&self) -> f64 {
        let [x, y, z] = Self::sizes(&self.boxes).map(f64::from);
        x * y + y * z + z * x
    }

    #[inline(always)]
    fn node(&self, count: usize) -> Node {
        let [lx, ly, lz, _, hx, hy, hz, _] = self.boxes;
        Node { lo: [lx, ly, lz], right: 0, hi: [-hx, -hy, -hz], count: count as u32 }
    }
}

/// Twice the centre of a box, and its mirror image.
#[inline(always)]
fn centre<E: TwoFours>(corners: E) -> E {
    corners - corners.swapped()
}

struct ExtentOf<'a>(&'a [Ref]);

impl Wide for ExtentOf<'_> {
    type Output = Extent;
    #[inline(always)]
    fn run<E: TwoFours>(self) -> Extent {
        Extent::of::<E>(self.0)
    }
}

/// The extent of a range, by all threads. Chunks do not depend on how many those are, and are put together in order.
fn extent_of(refs: &[Ref]) -> Extent {
    let chunks: Vec<Extent> = refs.par_chunks(CHUNK).map(|chunk| widest(ExtentOf(chunk))).collect();
    chunks.iter().fold(Extent::EMPTY, |all, chunk| all.and(chunk))
}

/// Runs of nodes that make up a subtree, in depth-first order.
struct Pieces {
    list: Vec<Vec<Node>>,
    count: usize,
}

fn subtree(refs: &mut [Ref], extent: &Extent, rules: &Rules, depth: usize) -> Pieces {
    if refs.len() <= CHUNK {
        let nodes = widest(Subtree { refs, extent, rules, depth });
        return Pieces { count: nodes.len(), list: vec![nodes] };
    }
    let mut node = extent.node(refs.len());
    let split = match rules.split {
        Split::Sah if depth < MAX_SAH_DEPTH => split_by_all(refs, extent),
        Split::Sah | Split::Halve => None,
    };
    let (middle, [left_extent, right_extent]) = split.unwrap_or_else(|| {
        let middle = halve(refs, extent, 0);
        (middle, [extent_of(&refs[..middle]), extent_of(&refs[middle..])])
    });
    let (left, right) = refs.split_at_mut(middle);
    let (left, right) = rayon::join(
        || subtree(left, &left_extent, rules, depth + 1),
        || subtree(right, &right_extent, rules, depth + 1),
    );
    node.right = 1 + left.count as u32;
    let list = std::iter::once(vec![node]).chain(left.list).chain(right.list).collect();
    Pieces { list, count: 1 + left.count + right.count }
}

/// A range of references that is to become a subtree.
struct Pending {
    first: usize,
    end: usize,
    depth: usize,
    /// The node whose right child it is.
    parent: Option<usize>,
}

/// What is small enough for one thread, from top to bottom.
struct Subtree<'a> {
    refs: &'a mut [Ref],
    extent: &'a Extent,
    rules: &'a Rules,
    depth: usize,
}

impl Wide for Subtree<'_> {
    type Output = Vec<Node>;
    #[inline(always)]
    fn run<E: TwoFours>(self) -> Vec<Node> {
        let Self { refs: all, extent: everything, rules, depth } = self;
        let mut nodes: Vec<Node> = Vec::with_capacity(all.len() * 2 / 3 + 16);
        let (mut bins, mut others, mut costs) = (Bins::new(), Bins::new(), [[0.0; 8]; MAX_BINS]);
        let mut pending = vec![Pending { first: 0, end: all.len(), depth, parent: None }];
        while let Some(Pending { first, end, depth, parent }) = pending.pop() {
            let at = nodes.len();
            if let Some(parent) = parent {
                nodes[parent].right = (at - parent) as u32;
            }
            let refs = &mut all[first..end];
            let extent = if at == 0 { *everything } else { Extent::of::<E>(refs) };
            nodes.push(extent.node(refs.len()));
            let users = if refs.len() <= LEAF { refs.iter().filter(|r| r.is_user()).count() } else { 0 };
            if refs.len() == 1 || (refs.len() <= LEAF && users == 0 && extent.half_area() < rules.large) {
                continue;
            }
            let plane = match rules.split {
                Split::Sah if depth < MAX_SAH_DEPTH => {
                    let binning = Binning::new(refs.len(), &extent);
                    if refs.len() < MANY {
                        bins.fill::<E>(refs, &binning);
                    } else {
                        bins.fill_by_two::<E>(&mut others, refs, &binning);
                    }
                    let plane = bins.cheapest::<E>(&binning, &extent, &mut costs);
                    bins.clear(binning.n);
                    plane
                }
                Split::Sah | Split::Halve => None,
            };
            let middle = match plane {
                Some(plane) => plane.partition(refs),
                None => halve(refs, &extent, users),
            };
            let (middle, depth) = (first + middle, depth + 1);
            pending.push(Pending { first: middle, end, depth, parent: Some(at) });
            pending.push(Pending { first, end: middle, depth, parent: None });
        }
        nodes
    }
}

/// Half of the list by centre along the widest axis, or triangles before users where few of both remain.
fn halve(refs: &mut [Ref], extent: &Extent, users: usize) -> usize {
    if 0 < users && users < refs.len() {
        refs.sort_unstable_by_key(|r| (r.is_user(), r.id()));
        return refs.len() - users;
    }
    let extent = Extent::sizes(&extent.centres);
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
    /// How many bins there are.
    n: usize,
    origin: [f32; 4],
    scale: [f32; 4],
}

impl Binning {
    #[inline(always)]
    fn new(count: usize, extent: &Extent) -> Self {
        let n = (8 + count / 2).min(MAX_BINS);
        let sizes = Extent::sizes(&extent.centres);
        let mut scale = [0.0; 4];
        for axis in 0..3 {
            if sizes[axis] > 0.0 {
                scale[axis] = (n as f32 * 0.99999 / sizes[axis]).min(1e38);
            }
        }
        let [x, y, z, noise, ..] = extent.centres;
        Self { n, origin: [x, y, z, noise], scale }
    }
}

/// Between two bins along an axis.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    origin: f32,
    scale: f32,
    /// The first bin on its right.
    first_right: f32,
}

impl Plane {
    /// Numbers that are not below the last bin, or are none, are in it, as in [`Bins::fill`].
    #[inline(always)]
    fn has_on_its_left(&self, r: &Ref) -> bool {
        (r.centre(self.axis) - self.origin) * self.scale < self.first_right
    }

    /// What is on the left before what is on the right, and how many are on the left. Branchless: swap always, advance if it belongs to the left.
    #[inline(always)]
    fn partition(&self, refs: &mut [Ref]) -> usize {
        let mut middle = 0;
        for i in 0..refs.len() {
            ask_ahead(refs, i);
            let is_left = self.has_on_its_left(&refs[i]);
            refs.swap(i, middle);
            middle += usize::from(is_left);
        }
        middle
    }
}

/// Primitives by bins along each axis, kept from node to node: to clear all bins for each would take more stores than to fill the few
/// that small nodes use.
#[repr(C, align(64))]
struct Bins {
    /// Boxes of the primitives in each bin along each axis, as in [`Extent`].
    boxes: [[[f32; 8]; MAX_BINS]; 3],
    /// How many those are, with the axes in the lanes.
    counts: [[u32; 4]; MAX_BINS],
}

impl Bins {
    #[inline(always)]
    fn new() -> Box<Self> {
        Box::new(Self { boxes: [[[f32::INFINITY; 8]; MAX_BINS]; 3], counts: [[0; 4]; MAX_BINS] })
    }

    #[inline(always)]
    fn clear(&mut self, n: usize) {
        for axis in &mut self.boxes {
            axis[..n].fill([f32::INFINITY; 8]);
        }
        self.counts[..n].fill([0; 4]);
    }

    #[inline(always)]
    fn fill<E: TwoFours>(&mut self, refs: &[Ref], binning: &Binning) {
        for r in refs {
            self.put(r.corners::<E>(), binning);
        }
    }

    /// As [`Bins::fill`]. Neighbours fall into the same bins, and each would wait for the one before it: two go at once, one of them into `others`,
    /// which are empty again afterwards.
    #[inline(always)]
    fn fill_by_two<E: TwoFours>(&mut self, others: &mut Self, refs: &[Ref], binning: &Binning) {
        let (first, second) = refs.split_at(refs.len() / 2);
        for (i, (a, b)) in first.iter().zip(second).enumerate() {
            ask_ahead(first, i);
            ask_ahead(second, i);
            self.put(a.corners::<E>(), binning);
            others.put(b.corners::<E>(), binning);
        }
        self.fill::<E>(&second[first.len()..], binning);
        self.add::<E>(others, binning.n);
        others.clear(binning.n);
    }

    #[inline(always)]
    fn put<E: TwoFours>(&mut self, corners: E, binning: &Binning) {
        let (origin, scale) = (Native::load(&binning.origin), Native::load(&binning.scale));
        let last = Native::splat((binning.n - 1) as f32);
        // `min` makes the last bin of a NaN, the product of an infinite distance and a scale of 0; the fourth lane is noise.
        let bins = ((centre(corners).low() - origin) * scale).min(last).round_down();
        // Masking changes nothing but lets the compiler drop its checks.
        let bins = bins.map(|bin| bin as usize & (MAX_BINS - 1));
        for axis in 0..3 {
            let of_bin = &mut self.boxes[axis][bins[axis]];
            *of_bin = E::load(of_bin).min(corners).to_array();
            self.counts[bins[axis]][axis] += 1;
        }
    }

    /// Adds what others have in the first `n` bins.
    #[inline(always)]
    fn add<E: TwoFours>(&mut self, others: &Self, n: usize) {
        for axis in 0..3 {
            for (mine, other) in self.boxes[axis].iter_mut().zip(&others.boxes[axis]).take(n) {
                *mine = E::load(mine).min(E::load(other)).to_array();
            }
        }
        for (mine, other) in self.counts.iter_mut().zip(&others.counts).take(n) {
            for axis in 0..3 {
                mine[axis] += other[axis];
            }
        }
    }

    /// The plane with the least sum of costs on both sides; `None` if no plane separates anything. `costs` is room to work in.
    #[inline(always)]
    fn cheapest<E: TwoFours>(
        &self,
        binning: &Binning,
        extent: &Extent,
        costs: &mut [[f32; 8]; MAX_BINS],
    ) -> Option<Plane> {
        let [x, y, z] = Extent::sizes(&extent.boxes);
        let largest = x.max(y).max(z);
        // Sums of lower and mirrored upper corners are extents with a minus.
        let scale = E::splat(if largest > 0.0 { -(1.0 / largest).min(1e37) } else { 0.0 });
        let (zero, infinity) = (E::splat(0.0), E::splat(f32::INFINITY));
        let n = binning.n;
        // Two sweeps at once, from below in the lower lanes and from above in the upper ones: of `costs[i]` the lower lanes are the costs of all
        // below bin `i`, the upper ones those of all in the last `i` bins, with the axes in the lanes.
        let (mut below, mut above, mut counts) = ([infinity; 3], [infinity; 3], zero);
        for i in 1..n {
            let mut sizes = [zero; 3];
            for axis in 0..3 {
                below[axis] = E::load(&self.boxes[axis][i - 1]).min(below[axis]);
                above[axis] = E::load(&self.boxes[axis][n - i]).min(above[axis]);
                let [lower, upper] = E::halves(below[axis], above[axis]);
                sizes[axis] = ((lower + upper) * scale).max(zero);
            }
            let (more_below, more_above) = (self.counts[i - 1], self.counts[n - i]);
            counts = counts + E::of_halves(Native::from_integers(more_below), Native::from_integers(more_above));
            let [x, y, z] = E::transpose(sizes);
            // Area times the number of blocks that as many triangles fill, rounded up: exact for some millions of triangles, and one more or less
            // does not matter where there are more. Infinite, or no number, if nothing is there.
            let blocks = ((counts + E::splat(LEAF as f32 - 1.0)) * E::splat(1.0 / LEAF as f32)).truncate();
            costs[i] = (((x * y + y * z + z * x) * blocks) | (counts.le(zero) & infinity)).to_array();
        }
        let half = |costs: &[f32; 8], which: usize| Native::load(&costs.as_chunks::<4>().0[which]);
        let (mut best, mut first_right) = (Native::splat(f32::INFINITY), Native::splat(0.0));
        for i in 1..n {
            let costs = half(&costs[i], 0) + half(&costs[n - i], 1);
            first_right = (costs.lt(best) & Native::splat(i as f32)).max(first_right);
            best = costs.min(best);
        }
        // Of equal costs the lowest bin, and of equal bins the first axis.
        let (best, first_right) = (best.to_array(), first_right.to_array());
        let key = |axis: usize| (best[axis], first_right[axis]);
        let axis = (1..3).fold(0, |least, axis| if key(axis) < key(least) { axis } else { least });
        let plane =
            Plane { axis, origin: binning.origin[axis], scale: binning.scale[axis], first_right: first_right[axis] };
        (best[axis] < f32::INFINITY).then_some(plane)
    }
}

/// Asks for what comes 2 KB after reference `i`: what processors fetch ahead by themselves is not enough where memory is far away.
#[inline(always)]
fn ask_ahead(refs: &[Ref], i: usize) {
    if let Some(later) = refs.get(i + 64) {
        prefetch_read(later);
    }
}

/// The bins of a chunk.
struct Fill<'a>(&'a [Ref], &'a Binning);

impl Wide for Fill<'_> {
    type Output = Box<Bins>;
    #[inline(always)]
    fn run<E: TwoFours>(self) -> Box<Bins> {
        let Self(refs, binning) = self;
        let (mut bins, mut others) = (Bins::new(), Bins::new());
        bins.fill_by_two::<E>(&mut others, refs, binning);
        bins
    }
}

/// The plane to split a range at, given the bins of its chunks.
struct Cheapest<'a>(&'a [Box<Bins>], &'a Binning, &'a Extent);

impl Wide for Cheapest<'_> {
    type Output = Option<Plane>;
    #[inline(always)]
    fn run<E: TwoFours>(self) -> Option<Plane> {
        let Self(chunks, binning, extent) = self;
        let mut bins = Bins::new();
        for chunk in chunks {
            bins.add::<E>(chunk, binning.n);
        }
        bins.cheapest::<E>(binning, extent, &mut [[0.0; 8]; MAX_BINS])
    }
}

/// Partitions a chunk and measures both sides while they are in the cache.
struct Partition<'a>(&'a mut [Ref], Plane);

impl Wide for Partition<'_> {
    type Output = (usize, [Extent; 2]);
    #[inline(always)]
    fn run<E: TwoFours>(self) -> (usize, [Extent; 2]) {
        let middle = self.1.partition(self.0);
        let (left, right) = self.0.split_at(middle);
        (middle, [Extent::of::<E>(left), Extent::of::<E>(right)])
    }
}

/// Partitions `refs` at the cheapest plane, by all threads: where the right side begins, and the extents of both sides.
fn split_by_all(refs: &mut [Ref], extent: &Extent) -> Option<(usize, [Extent; 2])> {
    let binning = Binning::new(refs.len(), extent);
    let chunks: Vec<Box<Bins>> = refs.par_chunks(CHUNK).map(|chunk| widest(Fill(chunk, &binning))).collect();
    let plane = widest(Cheapest(&chunks, &binning, extent))?;
    let parts: Vec<_> = refs.par_chunks_mut(CHUNK).map(|chunk| widest(Partition(chunk, plane))).collect();
    let extents = parts.iter().fold([Extent::EMPTY; 2], |[a, b], (_, [left, right])| [a.and(left), b.and(right)]);
    let middle: usize = parts.iter().map(|(count, _)| count).sum();

    exchange_strays(refs, middle, parts.iter().map(|(count, _)| *count));
    Some((middle, extents))
}

/// Puts what is on the left before `middle` and what is on the right after it, given chunks that each begin with so many that are on the left.
fn exchange_strays(refs: &mut [Ref], middle: usize, counts: impl Iterator<Item = usize>) {
    let (mut stray_right, mut stray_left) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (chunk, count) in refs.chunks_mut(CHUNK).zip(counts) {
        let n = chunk.len();
        // Of the chunk's own left side what lies beyond the middle, of its right side what lies before it.
        let end = middle.saturating_sub(first).min(n);
        let (before, beyond) = chunk.split_at_mut(end);
        if count < end {
            stray_right.push(&mut before[count..]);
        } else if count > end {
            stray_left.push(&mut beyond[..count - end]);
        }
        first += n;
    }
    // There are as many of the one kind as of the other: runs of equal length change places.
    let mut pairs = Vec::new();
    let (mut rights, mut lefts) = (stray_right.into_iter(), stray_left.into_iter());
    let (mut a, mut b): (&mut [Ref], &mut [Ref]) = (&mut [], &mut []);
    loop {
        if a.is_empty() {
            let Some(next) = rights.next() else { break };
            a = next;
        }
        if b.is_empty() {
            let Some(next) = lefts.next() else { break };
            b = next;
        }
        let n = a.len().min(b.len());
        let ((now, later), (other, others)) = (a.split_at_mut(n), b.split_at_mut(n));
        pairs.push((now, other));
        (a, b) = (later, others);
    }
    pairs.into_par_iter().for_each(|(a, b)| a.swap_with_slice(b));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::BuildInput;
    use crate::build::gather::gather;
    use crate::lanes::Twice;

    fn boxes(n: usize) -> Vec<Ref> {
        let number = |i: usize, salt: usize| ((i * 7919 + salt) * 104_729 % 65_537) as f32 / 65_537.0;
        let user_boxes: Vec<_> = (0..n)
            .map(|i| {
                let lo = [number(i, 1), number(i, 2), number(i, 3)].map(|x| x * x);
                [lo, lo.map(|x| x + 0.01 * number(i, 4))]
            })
            .collect();
        gather(&BuildInput { meshes: &[], user_boxes: &user_boxes }, &[]).0
    }

    #[test]
    fn ranges_split_by_all_are_in_order_and_whole() {
        for n in [CHUNK - 1, CHUNK + 1, 3 * CHUNK + 5] {
            let mut refs = boxes(n);
            let extent = extent_of(&refs);
            let (middle, [left, right]) = split_by_all(&mut refs, &extent).expect("a plane");
            assert!(0 < middle && middle < n);
            // What was measured of chunks is what the sides are, and lies on both sides of a plane.
            for (side, extent) in [(&refs[..middle], left), (&refs[middle..], right)] {
                let (found, bounds) = (extent_of(side), [0, 1, 2, 4, 5, 6]);
                assert_eq!(bounds.map(|i| found.boxes[i]), bounds.map(|i| extent.boxes[i]));
                assert_eq!(bounds.map(|i| found.centres[i]), bounds.map(|i| extent.centres[i]));
            }
            assert!((0..3).any(|axis| -left.centres[axis + 4] <= right.centres[axis]));
            let mut ids: Vec<u32> = refs.iter().map(Ref::id).collect();
            ids.sort_unstable();
            assert!(ids.into_iter().eq(0..n as u32));
        }
    }

    #[test]
    fn all_lanes_build_the_same_subtree() {
        let (all, rules) = (boxes(5000), Rules { split: Split::Sah, large: 0.1 });
        let extent = extent_of(&all);
        let (mut refs, mut others) = (all.clone(), all);
        let widest = widest(Subtree { refs: &mut refs, extent: &extent, rules: &rules, depth: 0 });
        let baseline = Subtree { refs: &mut others, extent: &extent, rules: &rules, depth: 0 }.run::<Twice<Native>>();
        let bits = |nodes: &[Node]| -> Vec<_> {
            nodes.iter().map(|n| (n.lo.map(f32::to_bits), n.hi.map(f32::to_bits), n.right, n.count)).collect()
        };
        assert!(bits(&widest) == bits(&baseline));
        assert!(refs.iter().map(Ref::id).eq(others.iter().map(Ref::id)));
    }
}
