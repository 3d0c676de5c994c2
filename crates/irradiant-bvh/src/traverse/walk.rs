//! The walk through the tree, generic over the box test; inlined whole into one entry point per level.
//!
//! What was tried, in Mray/s of one thread on a 2-core Xeon (Sapphire Rapids) shared with other work, where runs differ
//! by 5 %; closest hits of primary / first bounce / second bounce rays, then shadow rays, in the room of
//! `examples/rays.rs`:
//! - Insertion sort of all entered children on the stack: 4.7 / 3.4 / 2.6. The network for up to four: 4.9 / 3.7 / 2.9.
//! - No prefetch: 4.9 / 3.75 / 3.1. Two lines of each child that has to wait: 5.0 / 3.9 / 3.2 (4.1 and 3.4 in the best
//!   run). Three lines of every child, the first included: 4.5 / 3.55 / 2.8.
//! - Any hit, which child first: smallest box 7.3 (8.2 nodes and 4.0 blocks a ray); largest box 8.5 and 4.5; most
//!   opacity per expected cost, estimated from areas, 8.4 and 4.5. For rays that start into their own surface
//!   smallest first was 5.4 and largest first 3.1.
//! - Scaling the exit by the padding once per ray instead of once per node: 2 % faster.
//! - Binary leaves of one to three triangles before the collapse: no better, and the build 1.2 to 1.7 times longer.
//!   Bins 64 instead of 32: 3 % fewer nodes visited. A leaf cost of 0.4 to 1.5 nodes per block: no difference beyond noise.
//! - Huge pages under the tree (`GLIBC_TUNABLES=glibc.malloc.hugetlb=1`): 5 to 8 % faster, for whoever starts the program.
//! - AVX-512 over AVX2 gains nothing with 256-bit vectors.
//! - Several rays in turn, a node or leaf each, while the memory for the next turn is on its way, against one after
//!   another in the same run: two at once 1.1 and 0.9 (bounces 1 and 2), four 0.64 and 0.88, six 0.65 and 0.9. The walk waits for
//!   branches more than for memory.
//!
//! On two Zen 3 cores shared with seven others' work (ratios within one run, 10 % noise; a room of many objects, then one
//! displaced mesh, a million triangles each; rates relative to the version before):
//! - Blocks of five triangles that share eight vertices, in two cache lines, instead of four that share none; large pages;
//!   fused box tests: together bounces 0.98 to 1.05 and 1.03 to 1.18, primary rays 0.88 and 0.93 (they go in packets);
//!   memory 0.72 and 0.84.
//! - The same with blocks of eight and their ids in an array of their own: 0.85 to 0.94 of that (a miss at every
//!   candidate). With binary leaves of six triangles instead of five it was 0.95 to 1.1 of that again, and memory 0.68.
//! - Embree 4.4 there: 1.19 and 1.40 times ours for bounces (fast), 1.05 and 1.3 (robust).
//!
//! On two Xeon cores (Sapphire Rapids) shared with others, relative to the version before, in one process by turns:
//! - No branch on how many children are entered: distances and slots packed with AVX-512 (`vpcompressd`), four sorted in
//!   registers, pushed and popped again: bounces 0.92 to 0.96, primary rays 0.73 to 0.83. Neighbours
//!   take the same branches, which a processor foresees (a guess: no counters here).
//! - The ray known to be proper from what the fused form asks anyway, and handed over in registers: together 1.00 to 1.03 for
//!   bounces, 1.01 to 1.04 for shadow rays, 0.97 to 0.98 for those through instances. Of instances a ray meets three or four,
//!   each about 360 instructions besides nodes and blocks (AVX2).
//! - User primitives (instances) at a cost of 3 or 5 instead of 2, blocks at 0.4 or 1.0 instead of 0.6: within 2 %.
//!
//! On two Zen 5 cores shared with others, single rays relative to the version before, in one process by turns (a room of many objects, one
//! displaced mesh, ten thousand instances; a million triangles each but the last; runs differ by 1 to 2 %):
//! - Blocks at a cost of 0.3 instead of 0.6 of a node (with 0.02 for each triangle): 1.03, memory 0.94. At 0.2 1.06, at 0.15 1.08, memory 0.90; at 0.1 or 0.06 in leaves of up to
//!   six or eight blocks 1.05 and 1.07. Trees that stay in the cache lose by it: see `build/collapse.rs`.
//! - One block a leaf at most: 0.96.
//! - The shear only at the first leaf: 0.97, primary rays in the mesh 0.93.
//! - One child and two alike, without a branch on which it is: 0.95, primary rays in the room 0.90.
//! - Nodes of 256 bytes on lines of their own, found by a shift instead of a product: 1.00, memory 1.03. Offsets of planes in
//!   bytes: 1.00.
//! - Questions to parts of trees inlined where instances ask, so that rays go in in registers: through instances 1.01 to 1.06 (1.03 to 1.10 in a program without batches). The scale of
//!   the shear from the reciprocal of the box test: 1.00 to 1.01.
//! - Planes met first and last in one register of 512 bits, the latter negated, half as many operations and a longer way through
//!   them: 0.93 to 0.96. Rays handed over as four pairs of numbers instead of eight numbers: through instances 0.94 to 0.99, else 1.00.
//!   As two vectors, which go through memory: 0.94 to 0.96, else 1.01. Lists of users prefetched: 0.98, shadow rays 1.02.
//! - Parts of the room as instances of their own ([`crate::braid`]): primary rays through instances 1.28, bounces 1.12.
//!
//! On two Granite Rapids cores shared with others, by turns in one run:
//! - Any hit, the child with the fewest triangles first, in classes of a factor of four, and in these the smallest box first; before, the smallest box in any case: the
//!   street (walls, roofs, foliage) by `path` 0.83 of the CPU time, by `sharedpath` 0.87; 1,000 lamps, an interior and a million triangles under a sky 0.98 to 1.02.
//!   Rays alone: in the street, to a sky all around, 1.8 times as many. By the exact number (with reinsertion, see `build/binary.rs`), the mesh's shadow rays were at 0.8 to 0.9 of the rate, the street at the same
//!   time. Box times number, or its root or logarithm: the same within 3 %. Walls in the faces of the box of everything last: room 0.96, but the street gains 1.2 instead of 1.8.
//! - Large pages under all of the tree: 1.00, second bounces in the mesh up to 1.05.
//!
//! There too, single rays relative to nodes of eight full boxes, in one process by turns, beside much other work (runs differ by 5 %, in the mesh, where the second tree gets fewer
//! large pages, by 10 to 20 %). Hits are the same to the bit:
//! - Quantised nodes (Ylitie et al. 2017): planes of 8 bits, an origin and a power of two for each axis, boxes grown by what is lost. In 128 bytes, with scales as floats: room
//!   0.85 / 0.97 / 1.03 / 0.96 (primary, two bounces, shadow rays), mesh 0.86 / 0.87 / 0.82 / 0.82, instances 0.86 / 0.90 / 0.87 / 0.90, a mesh of 10,000 triangles 0.85 to 0.87. In 96 bytes, with
//!   scales as exponents and numbers spread from registers, 0.84 in the geometric mean. Nodes are an eighth of a tree's memory, blocks are the rest, and to widen six rows of bytes takes longer than to
//!   wait for the nodes.
//! - Sixteen children a node, tested in one register of 512 bits: 0.58 times as many nodes, memory 1.03, expected cost 0.75 to 0.9. Room 1.02 to 1.07 / 0.91 to 1.08 / 0.87 to 1.07 / 1.03 to 1.18, instances 0.94 to 0.98 /
//!   1.01 to 1.03 / 0.94 to 1.05 / 1.06 to 1.09, mesh 0.75 to 1.06 without a pattern, a mesh of 10,000 triangles 0.91 / 1.03 / 1.00 / 0.95, of 100 (two nodes instead of three) 0.70 / 0.80 / 0.88 / 0.65. Primary rays in packets gain: room 1.09, instances 1.10,
//!   10,000 triangles 1.07. With five or more children put in order by counting those nearer than each, without a branch: 0.99 of that, bounces in small trees 1.02. Not adopted for this mixture, and because
//!   the other levels would test boxes in two or four pieces; that was not measured.
//!
//! For comparison Embree 4.4 on the Xeon: robust 3.8 / 3.15 / 2.6 / 5.2, fast (not watertight) 5.4 / 4.4 / 3.4 / 7.3.

use std::mem::MaybeUninit;

use super::boxes::BoxTest;
use super::scalar::counts;
use super::{Best, PADDING, is_proper};
use crate::node::{Block, Bvh, Child, LAST_USER, Node, STACK};
use crate::prefetch;
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Shear};

/// A stack of children still to visit. The builder guarantees that [`STACK`] entries are enough.
pub(super) struct Stack<T> {
    entries: [MaybeUninit<T>; STACK],
}

/// [`STACK`] is a power of two: masking an index costs less than checking it, and never changes one that is in range.
const MASK: usize = STACK - 1;
const _: () = assert!(STACK.is_power_of_two());

impl<T: Copy> Stack<T> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; STACK] }
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, entry: T) {
        debug_assert!(i < STACK);
        self.entries[i & MASK] = MaybeUninit::new(entry);
    }

    /// The entry at `i`, which was [`set`](Self::set).
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn get(&self, i: usize) -> T {
        // SAFETY: walks, packets and crowds ask only below their count of entries, all of which they have set; no tree
        // needs more than `STACK` (`Bvh::build`), so masking never aliases two of them, and every bit pattern of `T`
        // (numbers, `Child`, and structs of these) is a value. Guards: `all_levels_agree_with_brute_force`,
        // `trees_too_deep_for_the_stack_are_built_again_in_halves`.
        unsafe { self.entries[i & MASK].assume_init() }
    }
}

/// Orders by entry distance (not negative, so its bits sort like it), then by reference.
#[inline(always)]
fn key(near: f32, child: Child) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child.0)
}

#[inline(always)]
pub(super) fn closest<B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    ray: &Ray,
    leaves: &L,
) -> Option<Closest<L::UserHit>> {
    if is_proper(ray) { closest_of_proper::<B, L>(bvh, start, ray, leaves) } else { None }
}

/// The same, when the ray is known to be proper.
#[inline(always)]
pub(super) fn closest_of_proper<B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    ray: &Ray,
    leaves: &L,
) -> Option<Closest<L::UserHit>> {
    if bvh.nodes.is_empty() {
        return None;
    }
    let mut best = Best::new(ray.t_max);
    closest_below::<B, L>(bvh, start, ray, leaves, &mut best);
    best.finish()
}

/// Offers `best` what the ray meets below `child`.
#[inline(always)]
pub(super) fn closest_below<B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    mut child: Child,
    ray: &Ray,
    leaves: &L,
    best: &mut Best<L::UserHit>,
) {
    let boxes = B::new(ray);
    let shear = Shear::new(ray);
    let mut stack = Stack::new();
    let mut n = 0;
    loop {
        // Down to a leaf.
        while !child.is_leaf() {
            let node = &bvh.nodes[child.index()];
            let (mut mask, near) = boxes.enter(node, best.t);
            if mask == 0 {
                match next(&stack, &mut n, best.t) {
                    Some(c) => child = c,
                    None => return,
                }
                continue;
            }
            let mut take = || {
                let i = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                (key(near.0[i], node.children[i]), mask == 0)
            };
            let (a, done) = take();
            if done {
                child = Child(a as u32);
                continue;
            }

            let (b, done) = take();
            prefetch(bvh, Child(b as u32));
            let (a, b) = (a.min(b), a.max(b));
            if done {
                child = Child(a as u32);
                stack.set(n, b);
                n += 1;
                continue;
            }
            let (c, done) = take();
            prefetch(bvh, Child(c as u32));
            let (a, c) = (a.min(c), a.max(c));
            let (b, c) = (b.min(c), b.max(c));
            if done {
                child = Child(a as u32);
                stack.set(n, c);
                stack.set(n + 1, b);
                n += 2;
                continue;
            }
            let (d, mut done) = take();
            prefetch(bvh, Child(d as u32));
            let (b, d) = (b.min(d), b.max(d));
            let (a, b) = (a.min(b), a.max(b));
            let (c, d) = (c.min(d), c.max(d));
            stack.set(n, d);
            stack.set(n + 1, c);
            stack.set(n + 2, b);
            let base = n;
            n += 3;
            // Five or more: insert the rest.
            let mut nearest = a;
            while !done {
                let (mut e, last) = take();
                done = last;
                (nearest, e) = (nearest.min(e), nearest.max(e));
                let mut j = n;
                while j > base && stack.get(j - 1) < e {
                    stack.set(j, stack.get(j - 1));
                    j -= 1;
                }
                stack.set(j, e);
                n += 1;
            }
            child = Child(nearest as u32);
        }
        // Through the leaf.
        let mut index = child.index();
        if child.is_users() {
            loop {
                let entry = bvh.users[index];
                best.offer_user(leaves, ray, entry & !LAST_USER);
                if entry & LAST_USER != 0 {
                    break;
                }
                index += 1;
            }
        } else {
            loop {
                let block: &Block = &bvh.blocks[index];
                if let Some(found) = triangle::intersect_block::<B::Eight>(block, &shear, best.t) {
                    let (mut mask, all) = (found.mask, found.spread());
                    while mask != 0 {
                        let i = mask.trailing_zeros() as usize & 7;
                        mask &= mask - 1;
                        let hit = all.at(i);
                        best.offer_triangle(leaves, ray, block.id(i), hit, || block.triangle(i));
                    }
                }
                if block.is_last() {
                    break;
                }
                index += 1;
            }
        }
        match next(&stack, &mut n, best.t) {
            Some(c) => child = c,
            None => return,
        }
    }
}

/// The nearest child still worth a visit.
#[inline(always)]
fn next(stack: &Stack<u64>, n: &mut usize, far: f32) -> Option<Child> {
    let far = far * PADDING;
    while *n > 0 {
        *n -= 1;
        let entry = stack.get(*n);
        if f32::from_bits((entry >> 32) as u32) <= far {
            return Some(Child(entry as u32));
        }
    }
    None
}

/// Asks for the first two cache lines of what `child` refers to.
#[inline(always)]
pub(super) fn prefetch(bvh: &Bvh, child: Child) {
    let (start, size) = if child.is_leaf() {
        (bvh.blocks.as_ptr().cast::<u8>(), size_of::<Block>())
    } else {
        (bvh.nodes.as_ptr().cast::<u8>(), size_of::<Node>())
    };
    prefetch::lines::<2>(start.wrapping_add(child.index() * size));
}

#[inline(always)]
pub(super) fn any<B: BoxTest, L: Leaves>(bvh: &Bvh, start: Child, ray: &Ray, leaves: &L) -> bool {
    is_proper(ray) && any_of_proper::<B, L>(bvh, start, ray, leaves)
}

/// The same, when the ray is known to be proper.
#[inline(always)]
pub(super) fn any_of_proper<B: BoxTest, L: Leaves>(bvh: &Bvh, start: Child, ray: &Ray, leaves: &L) -> bool {
    !bvh.nodes.is_empty() && any_below::<B, L>(bvh, start, ray, leaves)
}

/// Whether the ray meets anything below `child`.
#[inline(always)]
pub(super) fn any_below<B: BoxTest, L: Leaves>(bvh: &Bvh, mut child: Child, ray: &Ray, leaves: &L) -> bool {
    let boxes = B::new(ray);
    let shear = Shear::new(ray);
    let mut stack = Stack::new();
    let mut n = 0;
    loop {
        let mut index = child.index();
        if !child.is_leaf() {
            let node = &bvh.nodes[index];
            let (mut mask, _) = boxes.enter(node, ray.t_max);
            if mask != 0 {
                // All but the last slot wait; the builder puts the child to be tried first there.
                child = node.children[mask.ilog2() as usize & 7];
                mask ^= 1 << mask.ilog2();
                while mask != 0 {
                    let waiting = node.children[mask.trailing_zeros() as usize & 7];
                    prefetch(bvh, waiting);
                    stack.set(n, waiting);
                    mask &= mask - 1;
                    n += 1;
                }
                continue;
            }
        } else if child.is_users() {
            loop {
                let entry = bvh.users[index];
                if leaves.occluded(entry & !LAST_USER, ray) {
                    return true;
                }
                if entry & LAST_USER != 0 {
                    break;
                }
                index += 1;
            }
        } else {
            loop {
                let block: &Block = &bvh.blocks[index];
                if let Some(found) = triangle::intersect_block::<B::Eight>(block, &shear, ray.t_max) {
                    let (mut mask, all) = (found.mask, found.spread());
                    while mask != 0 {
                        let i = mask.trailing_zeros() as usize & 7;
                        mask &= mask - 1;
                        let hit = all.at(i);
                        if counts(leaves, ray, block, i, hit) {
                            return true;
                        }
                    }
                }
                if block.is_last() {
                    break;
                }
                index += 1;
            }
        }
        if n == 0 {
            return false;
        }
        n -= 1;
        child = stack.get(n);
    }
}
