//! Up to sixteen rays that travel together.
//!
//! A node's eight boxes are tested once for the whole packet, against the interval of its origins and that of its
//! reciprocal directions: rounding is monotonic, so what the intervals miss every ray misses. What the packet enters
//! is then tested ray by ray, sixteen rays and one box at a time. Where few rays remain they go on alone.
//!
//! A packet needs proper rays that move along every axis and go about the same way; others are sent in smaller packets,
//! or alone from the start.

use super::boxes::{BoxTest, FUSED_LIMIT, FUSED_LOST};
use super::scalar::counts;
use super::side_by_side::{Bests, Lines, stopped_by_users};
use super::walk::{self, Stack};
use super::{PADDING, WIDER};
use crate::lanes::{Lanes, Native};
use crate::node::{Block, Bvh, Child, Node, WIDTH};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Shear};

/// Rays in a packet.
pub(crate) const PACKET: usize = 16;
/// This many rays or fewer go on alone. With 4 primary rays were 5 to 9 % slower, with 1 as with 2.
const FEW: u32 = 2;
/// At a leaf, this many rays or fewer are tested one by one, each against all triangles of a block. With 2 or 5: no difference
/// beyond noise.
const FEW_AT_LEAF: u32 = 3;
/// Directions of a packet differ by this much of their size along an axis at most.
pub(super) const SPREAD: f32 = 0.15;
/// The same of rays that are asked for anything in their way, which alone end soon. Shadow rays to wide lamps in batches against alone, on two Granite Rapids cores (five scenes,
/// without crowds): with 0.15 0.86 to 0.95, with 0.05 as without any packets, 0.93 to 1.01. On two Zen cores (two scenes), when single rays still took the smallest box first,
/// 0.15 was at 1.04 and 1.07, 0.3 at 1.02 and 1.05, 0.6 at 0.93 and 1.14.
pub(super) const SPREAD_OF_SHADOWS: f32 = 0.05;

/// A child to visit, and where its box is.
#[derive(Clone, Copy)]
struct Entry {
    near: f32,
    child: Child,
    parent: u32,
    slot: u32,
}

impl Entry {
    /// The parent of where the walk begins, whose box is not asked.
    const NONE: u32 = u32::MAX;
}

/// One number of each ray.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Column(pub [f32; PACKET]);

impl Column {
    /// Least and greatest. NaN may be passed over.
    #[inline(always)]
    fn range(&self) -> (f32, f32) {
        (self.least(), self.greatest())
    }

    #[inline(always)]
    pub(super) fn least(&self) -> f32 {
        self.fold(|a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn greatest(&self) -> f32 {
        self.fold(|a, b| if a > b { a } else { b })
    }

    /// Halves with halves, which are vector operations.
    #[inline(always)]
    fn fold(&self, f: impl Fn(f32, f32) -> f32) -> f32 {
        let a: [f32; 8] = std::array::from_fn(|i| f(self.0[i], self.0[i + 8]));
        let b: [f32; 4] = std::array::from_fn(|i| f(a[i], a[i + 4]));
        f(f(b[0], b[2]), f(b[1], b[3]))
    }
}

/// An axis of the space of rays that a packet spans.
#[derive(Clone, Copy)]
struct Interval<E> {
    /// The index of the plane met first; if some rays go one way and some the other, [`BOTH`](Self::BOTH).
    first: usize,
    /// The origin farthest along and farthest back, seen the way the packet goes.
    ahead: E,
    behind: E,
    /// Reciprocal with the least and the greatest magnitude; if rays go both ways, the least magnitude forwards and that
    /// backwards, the latter negative.
    least: E,
    greatest: E,
}

impl<E> Interval<E> {
    const BOTH: usize = usize::MAX;
}

/// Rays side by side. Lanes without a ray repeat the last one.
struct Packet<'a, E, B: BoxTest> {
    rays: &'a [Ray],
    intervals: [Interval<B::Eight>; 3],
    /// Boxes are entered at `plane * inverse + entering` and left at `plane * padded + leaving`, as in [`super::boxes`],
    /// where the fused form is explained.
    lines: Lines<E>,
    entering: [E; 3],
    padded: [E; 3],
    leaving: [E; 3],
    /// Of the shears, if it is the same for all; then origins along those, and the shears.
    axes: Option<[usize; 3]>,
    origin: [E; 3],
    shear: [E; 3],
    /// The shears again, to be looked up.
    shears: [Column; 3],
}

impl<'a, E: Lanes<Array = [f32; PACKET]>, B: BoxTest> Packet<'a, E, B> {
    /// With their ends, minus infinity for lanes without a ray. `None` if these rays cannot travel together.
    #[inline(always)]
    fn new(rays: &'a [Ray], spread: f32) -> Option<(Self, Column)> {
        let mut filled = [rays[rays.len() - 1]; PACKET];
        let all: &[Ray; PACKET] = if let Ok(all) = rays.try_into() {
            all
        } else {
            filled.iter_mut().zip(rays).for_each(|(filled, ray)| *filled = *ray);
            &filled
        };
        let (mut origins, mut directions) = ([&[0.0; 4]; PACKET], [&[0.0; 4]; PACKET]);
        for i in 0..PACKET {
            (origins[i], directions[i]) = all[i].rows();
        }
        let ([ox, oy, oz, ends], [dx, dy, dz, _]) = (E::columns(&origins), E::columns(&directions));
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let (one, limit) = (E::splat(1.0), E::splat(FUSED_LIMIT));
        let inverse = [one / d[0], one / d[1], one / d[2]];
        let product = [o[0] * inverse[0], o[1] * inverse[1], o[2] * inverse[2]];
        // Proper, moving along every axis, and nothing overflows; NaN fails.
        let infinity = E::splat(f32::INFINITY);
        let mut sound = E::splat(0.0).lt(ends);
        for k in 0..3 {
            sound = sound & inverse[k].abs().lt(limit) & product[k].abs().lt(limit);
            sound = sound & o[k].abs().lt(infinity) & d[k].abs().lt(infinity);
        }
        if sound.mask() != E::ALL {
            return None;
        }
        let ends = E::select((1 << rays.len()) - 1, ends, E::splat(f32::NEG_INFINITY));

        let size = rays[0].d.iter().fold(0.0f32, |size, x| size.max(x.abs()));
        let splat = <B::Eight as Lanes>::splat;
        let zero = splat(0.0);
        let mut intervals = [Interval { first: 0, ahead: zero, behind: zero, least: zero, greatest: zero }; 3];
        for k in 0..3 {
            let ((o_min, o_max), (d_min, d_max)) = (Column(o[k].to_array()).range(), Column(d[k].to_array()).range());
            if d_max - d_min > spread * size {
                return None;
            }
            let (forward, backward) = (1.0 / d_max, 1.0 / d_min);
            let (first, behind, ahead, least, greatest) = if d_min > 0.0 {
                (2 * k, o_min, o_max, forward, backward)
            } else if d_max < 0.0 {
                (2 * k + 1, o_max, o_min, backward, forward)
            } else {
                (Interval::<E>::BOTH, o_min, o_max, forward, backward)
            };
            intervals[k] = Interval {
                first,
                ahead: splat(ahead),
                behind: splat(behind),
                least: splat(least),
                greatest: splat(greatest),
            };
        }

        let (padding, lost) = (E::splat(WIDER), E::splat(FUSED_LOST));
        let (zero, minus) = (E::splat(0.0), E::splat(-1.0));
        let (mut entering, mut padded, mut leaving) = ([zero; 3], [zero; 3], [zero; 3]);
        for k in 0..3 {
            padded[k] = inverse[k] * padding;
            let padded_product = o[k] * padded[k];
            entering[k] = product[k] * minus - product[k].abs() * lost;
            leaving[k] = padded_product.abs() * lost - padded_product;
        }
        let axes = same_axes(&d);
        let [x, y, z] = axes.unwrap_or([0, 1, 2]);
        let shear = [(d[x] * minus) / d[z], (d[y] * minus) / d[z], one / d[z]];
        let packet = Self {
            rays,
            intervals,
            lines: Lines { origin: o, inverse },
            entering,
            padded,
            leaving,
            axes,
            origin: [o[x], o[y], o[z]],
            shear,
            shears: shear.map(|lanes| Column(lanes.to_array())),
        };
        Some((packet, Column(ends.to_array())))
    }

    /// Bit `i` says that some ray may enter child `i` before `far`, and then not before `near[i]`.
    #[inline(always)]
    fn may_enter(&self, node: &Node, far: f32) -> (u32, [f32; WIDTH]) {
        let splat = <B::Eight as Lanes>::splat;
        let plane = |k: usize| <B::Eight as Lanes>::load(&node.planes[k]);
        let (mut near, mut far) = (splat(0.0), splat(far * PADDING));
        let padding = splat(WIDER);
        for (axis, i) in self.intervals.iter().enumerate() {
            if i.first == Interval::<E>::BOTH {
                // A box ahead is met by rays that go forwards, one behind by those that go backwards; how long they stay
                // is anyone's guess.
                let forwards = (plane(2 * axis) - i.ahead) * i.least;
                let backwards = (plane(2 * axis + 1) - i.behind) * i.greatest;
                near = forwards.max(backwards).max(near);
            } else {
                let enters = plane(i.first) - i.ahead;
                let leaves = (plane(i.first ^ 1) - i.behind) * padding;
                near = (enters * i.least).min(enters * i.greatest).max(near);
                far = (leaves * i.least).max(leaves * i.greatest).min(far);
            }
        }
        (near.le(far).mask(), near.to_array())
    }

    /// Bit `i` says that ray `i` enters child `slot` before `t[i]`.
    #[inline(always)]
    fn enter(&self, node: &Node, slot: usize, t: &Column) -> u32 {
        let plane = |k: usize| E::splat(node.planes[k][slot]);
        let (mut near, mut far) = (E::splat(0.0), E::load(&t.0) * E::splat(PADDING));
        for k in 0..3 {
            let enters = |plane: E| plane.multiply_add(self.lines.inverse[k], self.entering[k]);
            let leaves = |plane: E| plane.multiply_add(self.padded[k], self.leaving[k]);
            let first = self.intervals[k].first;
            if first == Interval::<E>::BOTH {
                let (lo, hi) = (plane(2 * k), plane(2 * k + 1));
                near = enters(lo).min(enters(hi)).max(near);
                far = leaves(lo).max(leaves(hi)).min(far);
            } else {
                near = enters(plane(first)).max(near);
                far = leaves(plane(first ^ 1)).min(far);
            }
        }
        near.le(far).mask()
    }

    /// Bit `i` says that ray `i` enters what waits before `t[i]`.
    #[inline(always)]
    fn active(&self, bvh: &Bvh, entry: &Entry, t: &Column) -> u32 {
        if entry.parent == Entry::NONE {
            return E::splat(0.0).lt(E::load(&t.0)).mask();
        }
        self.enter(&bvh.nodes[entry.parent as usize], entry.slot as usize, t)
    }

    /// The shear of a ray.
    #[inline(always)]
    fn shear(&self, ray: usize) -> Shear {
        let Some(axes) = self.axes else { return Shear::new(&self.rays[ray]) };
        let o = &self.rays[ray].o;
        let [x, y, z] = &self.shears;
        Shear { axes, origin: [o[axes[0]], o[axes[1]], o[axes[2]]], shear: [x.0[ray], y.0[ray], z.0[ray]] }
    }

    /// The hits of one triangle.
    #[inline(always)]
    fn meet(
        &self,
        [x, y, z]: [usize; 3],
        block: &Block,
        lane: usize,
        t: &Column,
        active: u32,
    ) -> Option<triangle::Candidates<E>> {
        let (a, b, c) = (block.corner(lane, 0), block.corner(lane, 1), block.corner(lane, 2));
        let [x_of, y_of, z_of] = [&block.vertices[x], &block.vertices[y], &block.vertices[z]];
        let along = [
            [E::splat(x_of[a]), E::splat(y_of[a]), E::splat(z_of[a])],
            [E::splat(x_of[b]), E::splat(y_of[b]), E::splat(z_of[b])],
            [E::splat(x_of[c]), E::splat(y_of[c]), E::splat(z_of[c])],
        ];
        let (mut found, strange) = triangle::intersect_lanes(along, self.origin, self.shear, E::load(&t.0), active)?;
        if strange != 0 {
            found = found.again_in_double(strange, |i| (block.triangle(lane), self.shear(i), t.0[i]));
        }
        Some(found)
    }
}

/// Whether the directions of the first ray, one in the middle and the last differ by at most a `spread` times the size of the
/// first, along each axis: quick to say no.
#[inline(always)]
pub(super) fn may_go_the_same_way(rays: &[Ray], spread: f32) -> bool {
    let [x, y, z] = rays[0].d.map(f32::abs);
    let size = if x > y { x } else { y };
    let most = Native::splat(if size > z { size } else { z } * spread);
    // The time rides along in the fourth lane, and is not looked at.
    let d = |i: usize| rays[i].lanes::<Native>().1;
    let (first, middle, last) = (d(0), d(rays.len() / 2), d(rays.len() - 1));
    ((first - last).abs().le(most) & (first - middle).abs().le(most)).mask() & 7 == 7
}

/// [`Shear::axes`] of all rays, if they are the same.
#[inline(always)]
fn same_axes<E: Lanes>(d: &[E; 3]) -> Option<[usize; 3]> {
    let [x, y, z] = [d[0].abs(), d[1].abs(), d[2].abs()];
    let (x_most, y_most) = ((y.lt(x) & z.lt(x)).mask(), z.lt(y).mask());
    match (x_most, y_most) {
        (all, _) if all == E::ALL => Some([1, 2, 0]),
        (0, all) if all == E::ALL => Some([2, 0, 1]),
        (0, 0) => Some([0, 1, 2]),
        _ => None,
    }
}

/// The stack of a packet: nearest on top.
struct Waiting {
    stack: Stack<Entry>,
    n: usize,
}

impl Waiting {
    /// Only where to begin.
    #[inline(always)]
    fn at(start: Child) -> Self {
        let mut stack = Stack::new();
        stack.set(0, Entry { near: 0.0, child: start, parent: Entry::NONE, slot: 0 });
        Self { stack, n: 1 }
    }

    /// All children of `node` in `mask`, farthest first.
    #[inline(always)]
    fn push(&mut self, bvh: &Bvh, node: u32, mask: u32, near: &[f32; WIDTH]) {
        // Sorted as numbers of 8 bytes: entries of 16, read just after they were written in pieces, would have to wait for the writes.
        let (mut keys, mut n) = ([0u64; WIDTH], 0);
        each(mask, |slot| {
            let key = u64::from(near[slot].to_bits()) << 32 | slot as u64;
            let mut j = n;
            while j > 0 && keys[j - 1] < key {
                keys[j] = keys[j - 1];
                j -= 1;
            }
            keys[j] = key;
            n += 1;
        });
        for &key in &keys[..n] {
            self.push_one(bvh, node, key as usize & (WIDTH - 1), f32::from_bits((key >> 32) as u32));
        }
    }

    /// All children of `node` in `mask`, in the order in which a ray that may meet anything tries them: the last slot first.
    #[inline(always)]
    fn push_in_order(&mut self, bvh: &Bvh, node: u32, mask: u32) {
        each(mask, |slot| self.push_one(bvh, node, slot, 0.0));
    }

    #[inline(always)]
    fn push_one(&mut self, bvh: &Bvh, node: u32, slot: usize, near: f32) {
        let child = bvh.nodes[node as usize].children[slot];
        walk::prefetch(bvh, child);
        self.stack.set(self.n, Entry { near, child, parent: node, slot: slot as u32 });
        self.n += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.n = self.n.checked_sub(1)?;
        Some(self.stack.get(self.n))
    }
}

/// Bits of a mask, lowest first.
#[inline(always)]
pub(super) fn each(mut mask: u32, mut f: impl FnMut(usize)) {
    while mask != 0 {
        f(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

/// Rays of a mask one after another, which they are, and how many.
#[inline(always)]
pub(super) fn gathered(mask: u32, ray: impl Fn(usize) -> Ray) -> ([Ray; PACKET], [usize; PACKET], usize) {
    let mut rays = [Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 }; PACKET];
    let mut which = [0; PACKET];
    let mut n = 0;
    each(mask, |i| {
        (rays[n], which[n]) = (ray(i), i);
        n += 1;
    });
    (rays, which, n)
}

/// As [`walk::closest`] for each of up to [`PACKET`] rays.
#[inline(always)]
pub(super) fn closest<E: Lanes<Array = [f32; PACKET]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    rays: &[Ray],
    leaves: &L,
    out: &mut [Option<Closest<L::UserHit>>],
) -> bool {
    if bvh.nodes.is_empty() || rays.len() <= FEW as usize {
        return false;
    }
    let Some((packet, t)) = Packet::<E, B>::new(rays, SPREAD) else { return false };
    let mut far = t.greatest();
    let mut best = Bests::new(t);
    let mut waiting = Waiting::at(start);
    while let Some(entry) = waiting.pop() {
        if entry.near > far * PADDING {
            continue;
        }
        let active = packet.active(bvh, &entry, &best.t);
        if active == 0 {
            continue;
        }
        if !entry.child.is_leaf() {
            if active.count_ones() > FEW {
                let (mask, near) = packet.may_enter(&bvh.nodes[entry.child.index()], far);
                waiting.push(bvh, entry.child.0, mask, &near);
                continue;
            }
            each(active, |i| {
                let mut one = best.get(i);
                walk::closest_below::<B, L>(bvh, entry.child, &rays[i], leaves, &mut one);
                best.set(i, one);
            });
        } else if entry.child.is_users() {
            best.offer_users(bvh, entry.child, leaves, active, |i| rays[i]);
        } else {
            for index in entry.child.index().. {
                let block = &bvh.blocks[index];
                if active.count_ones() > FEW_AT_LEAF
                    && let Some(axes) = packet.axes
                {
                    for lane in 0..block.count() {
                        if let Some(found) = packet.meet(axes, block, lane, &best.t, active)
                            && found.mask != 0
                        {
                            best.offer(leaves, &packet.lines, |i| rays[i], block, lane, &found);
                        }
                    }
                } else {
                    each(active, |i| {
                        let mut one = best.get(i);
                        let found = triangle::intersect_block::<B::Eight>(block, &packet.shear(i), one.t);
                        let Some(found) = found else { return };
                        let all = found.spread();
                        each(found.mask, |lane| {
                            let at = all.at(lane);
                            one.offer_triangle(leaves, &rays[i], block.id(lane), at, || block.triangle(lane));
                        });
                        best.set(i, one);
                    });
                }
                if block.is_last() {
                    break;
                }
            }
        }
        far = best.t.greatest();
    }
    for (i, out) in out.iter_mut().enumerate() {
        *out = best.finish(i);
    }
    true
}

/// As [`walk::any`] for each of up to [`PACKET`] rays.
#[inline(always)]
pub(super) fn any<E: Lanes<Array = [f32; PACKET]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    rays: &[Ray],
    leaves: &L,
    out: &mut [bool],
) -> bool {
    if bvh.nodes.is_empty() || rays.len() <= FEW as usize {
        return false;
    }
    // Rays that have met something end before they begin.
    let Some((packet, mut t)) = Packet::<E, B>::new(rays, SPREAD_OF_SHADOWS) else { return false };
    let mut far = t.greatest();
    let mut waiting = Waiting::at(start);
    out.fill(false);
    while let Some(entry) = waiting.pop() {
        let active = packet.active(bvh, &entry, &t);
        if active == 0 {
            continue;
        }
        let mut blocked = 0;
        if !entry.child.is_leaf() {
            if active.count_ones() > FEW {
                let (mask, _) = packet.may_enter(&bvh.nodes[entry.child.index()], far);
                waiting.push_in_order(bvh, entry.child.0, mask);
                continue;
            }
            each(active, |i| {
                blocked |= u32::from(walk::any_below::<B, L>(bvh, entry.child, &rays[i], leaves)) << i;
            });
        } else if entry.child.is_users() {
            blocked |= stopped_by_users(bvh, entry.child, leaves, active, |i| rays[i]);
        } else {
            for index in entry.child.index().. {
                let block = &bvh.blocks[index];
                let active = active & !blocked;
                if active.count_ones() > FEW_AT_LEAF
                    && let Some(axes) = packet.axes
                {
                    for lane in 0..block.count() {
                        if let Some(found) = packet.meet(axes, block, lane, &t, active & !blocked)
                            && found.mask != 0
                        {
                            let ends = E::load(&t.0);
                            blocked |= packet.lines.stopped(leaves, |i| rays[i], ends, block, lane, &found);
                        }
                    }
                } else {
                    each(active, |i| {
                        let found = triangle::intersect_block::<B::Eight>(block, &packet.shear(i), t.0[i]);
                        let Some(found) = found else { return };
                        let all = found.spread();
                        each(found.mask, |lane| {
                            let at = all.at(lane);
                            blocked |= u32::from(counts(leaves, &rays[i], block, lane, at)) << i;
                        });
                    });
                }
                if block.is_last() {
                    break;
                }
            }
        }
        if blocked != 0 {
            each(blocked, |i| {
                out[i] = true;
                t.0[i] = f32::NEG_INFINITY;
            });
            far = t.greatest();
            if far == f32::NEG_INFINITY {
                break;
            }
        }
    }
    true
}
