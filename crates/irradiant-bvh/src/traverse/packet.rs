//! Up to thirty-two rays that travel together, in groups of eight.
//!
//! A node's eight boxes are tested once for the whole packet, against the interval of its origins and that of its
//! reciprocal directions: rounding is monotonic, so what the intervals miss every ray misses. What the packet enters
//! is then tested ray by ray, eight rays and one box at a time. Where few rays remain they go on alone.
//!
//! A packet needs proper rays that move along every axis and go about the same way; others are sent in smaller packets,
//! or alone from the start.

use super::boxes::BoxTest;
use super::scalar::counts;
use super::walk::{self, Stack};
use super::{Best, PADDING, is_proper};
use crate::lanes::{Lanes, Native};
use crate::node::{Block, Bvh, Child, LAST_USER, Node, WIDTH};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Candidate, Shear};

/// Rays in a group.
pub(crate) const GROUP: usize = 8;
/// Groups in a packet.
const GROUPS: usize = 2;
/// Rays in a packet.
pub(crate) const PACKET: usize = GROUP * GROUPS;
/// This many rays or fewer go on alone.
const FEW: u32 = 2;
/// At a leaf, this many rays of a group or fewer are tested one by one, each against all triangles of a block.
const FEW_AT_LEAF: u32 = 3;
/// Directions of a packet differ by this much of their size along an axis at most. With 0.5 rays to wide lamps were 6 to
/// 11 % slower than alone; with 0.15 they are within 2 %, and primary rays as before.
const SPREAD: f32 = 0.15;

/// A child to visit, and where its box is.
#[derive(Clone, Copy)]
struct Entry {
    near: f32,
    child: Child,
    parent: u32,
    slot: u32,
}

/// Rays side by side.
#[derive(Clone, Copy)]
struct Group<E> {
    origin: [E; 3],
    inverse: [E; 3],
    /// As in [`Shear`].
    shear: [E; 3],
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

struct Packet<'a, E> {
    rays: &'a [Ray],
    groups: [Group<E>; GROUPS],
    intervals: [Interval<E>; 3],
    /// Of the shears, if it is the same for all.
    axes: Option<[usize; 3]>,
}

impl<'a, E: Lanes<Array = [f32; GROUP]>> Packet<'a, E> {
    /// `None` if these rays cannot travel together.
    #[inline(always)]
    fn new(rays: &'a [Ray]) -> Option<Self> {
        if !go_the_same_way(rays) {
            return None;
        }
        let mut columns = [[[0.0; GROUP]; GROUPS]; 6];
        let axes = Shear::axes(&rays[0]);
        let mut same_axes = true;
        for i in 0..rays.len().next_multiple_of(GROUP).min(PACKET) {
            let ray = &rays[i.min(rays.len() - 1)];
            if !is_proper(ray) {
                return None;
            }
            same_axes &= Shear::axes(ray) == axes;
            for k in 0..3 {
                columns[k][i / GROUP][i % GROUP] = ray.o[k];
                columns[3 + k][i / GROUP][i % GROUP] = ray.d[k];
            }
        }
        let zero = E::splat(0.0);
        let group = Group { origin: [zero; 3], inverse: [zero; 3], shear: [zero; 3] };
        let interval = Interval { first: 0, ahead: zero, behind: zero, least: zero, greatest: zero };
        let axes = same_axes.then_some(axes);
        let mut packet = Self { rays, groups: [group; GROUPS], intervals: [interval; 3], axes };
        let n = packet.n_groups();
        for k in 0..3 {
            let (o_min, o_max) = range(&columns[k][..n]);
            let (d_min, d_max) = range(&columns[3 + k][..n]);
            let (mut least_forward, mut least_backward) = (1.0 / d_max, 1.0 / d_min);
            for g in 0..n {
                let d = E::load(&columns[3 + k][g]);
                let inverse = E::splat(1.0) / d;
                if inverse.abs().le(E::splat(f32::MAX)).mask() != E::ALL {
                    return None;
                }
                packet.groups[g].inverse[k] = inverse;
                packet.groups[g].origin[k] = E::load(&columns[k][g]);
            }
            let (first, behind, ahead) = if d_min > 0.0 {
                (2 * k, o_min, o_max)
            } else if d_max < 0.0 {
                (2 * k + 1, o_max, o_min)
            } else {
                (Interval::<E>::BOTH, o_min, o_max)
            };
            if first == 2 * k + 1 {
                (least_forward, least_backward) = (least_backward, least_forward);
            }
            packet.intervals[k] = Interval {
                first,
                ahead: E::splat(ahead),
                behind: E::splat(behind),
                least: E::splat(least_forward),
                greatest: E::splat(least_backward),
            };
        }
        if let Some([x, y, z]) = axes {
            let minus = E::splat(-1.0);
            for g in 0..n {
                let d = |axis: usize| E::load(&columns[3 + axis][g]);
                packet.groups[g].shear = [(d(x) * minus) / d(z), (d(y) * minus) / d(z), E::splat(1.0) / d(z)];
            }
        }
        Some(packet)
    }

    #[inline(always)]
    fn n_groups(&self) -> usize {
        self.rays.len().div_ceil(GROUP).min(GROUPS)
    }

    /// Bit `i` says that some ray may enter child `i` before `far`, and then not before `near[i]`.
    #[inline(always)]
    fn may_enter(&self, node: &Node, far: f32) -> (u32, [f32; WIDTH]) {
        let (mut near, mut far) = (E::splat(0.0), E::splat(far * PADDING));
        let padding = E::splat(PADDING);
        for (axis, i) in self.intervals.iter().enumerate() {
            if i.first == Interval::<E>::BOTH {
                // A box ahead is met by rays that go forwards, one behind by those that go backwards; how long they stay
                // is anyone's guess.
                let forwards = (E::load(&node.planes[2 * axis]) - i.ahead) * i.least;
                let backwards = (E::load(&node.planes[2 * axis + 1]) - i.behind) * i.greatest;
                near = forwards.max(backwards).max(near);
            } else {
                let enters = E::load(&node.planes[i.first]) - i.ahead;
                let leaves = (E::load(&node.planes[i.first ^ 1]) - i.behind) * padding;
                near = (enters * i.least).min(enters * i.greatest).max(near);
                far = (leaves * i.least).max(leaves * i.greatest).min(far);
            }
        }
        (near.le(far).mask(), near.to_array())
    }

    /// Bit `i` says that ray `i` enters child `slot` before `t[i]`.
    #[inline(always)]
    fn enter(&self, node: &Node, slot: usize, t: &[[f32; GROUP]; GROUPS]) -> u32 {
        let planes = |k: usize| (E::splat(node.planes[2 * k][slot]), E::splat(node.planes[2 * k + 1][slot]));
        let (x, y, z) = (planes(0), planes(1), planes(2));
        let padding = E::splat(PADDING);
        let mut mask = 0;
        for g in 0..self.n_groups() {
            let Group { origin, inverse, .. } = &self.groups[g];
            let slab = |(lo, hi): (E, E), k: usize| {
                let (a, b) = ((lo - origin[k]) * inverse[k], (hi - origin[k]) * inverse[k]);
                (a.min(b), a.max(b))
            };
            let (x, y, z) = (slab(x, 0), slab(y, 1), slab(z, 2));
            let near = x.0.max(y.0).max(z.0.max(E::splat(0.0)));
            let far = x.1.min(y.1).min(z.1.min(E::load(&t[g]))) * padding;
            mask |= near.le(far).mask() << (GROUP * g);
        }
        mask
    }

    /// The hits of one triangle by a group.
    #[inline(always)]
    fn meet(
        &self,
        [x, y, z]: [usize; 3],
        g: usize,
        block: &Block,
        lane: usize,
        t: &[f32; GROUP],
    ) -> Option<triangle::Candidates<E>> {
        let (a, b, c) = (block.corner(lane, 0), block.corner(lane, 1), block.corner(lane, 2));
        let [x_of, y_of, z_of] = [&block.vertices[x], &block.vertices[y], &block.vertices[z]];
        let along = [
            [E::splat(x_of[a]), E::splat(y_of[a]), E::splat(z_of[a])],
            [E::splat(x_of[b]), E::splat(y_of[b]), E::splat(z_of[b])],
            [E::splat(x_of[c]), E::splat(y_of[c]), E::splat(z_of[c])],
        ];
        let Group { origin, shear, .. } = &self.groups[g];
        let (mut found, strange) =
            triangle::intersect_lanes(along, [origin[x], origin[y], origin[z]], *shear, E::load(t))?;
        if strange != 0 {
            again_in_double(&self.rays[GROUP * g..], &block.triangle(lane), t, strange, &mut found);
        }
        Some(found)
    }

    /// Calls `hit` with ray, primitive and place for all that the rays of `active` meet in a leaf before `t`, which `hit`
    /// may shorten.
    #[inline(always)]
    fn leaf<B: BoxTest>(
        &self,
        bvh: &Bvh,
        leaf: Child,
        active: u32,
        t: &mut [[f32; GROUP]; GROUPS],
        mut hit: impl FnMut(usize, u32, Candidate) -> f32,
    ) {
        for index in leaf.index().. {
            let block = &bvh.blocks[index];
            for g in 0..self.n_groups() {
                let mine = active >> (GROUP * g) & E::ALL;
                if mine.count_ones() > FEW_AT_LEAF
                    && let Some(axes) = self.axes
                {
                    for lane in 0..block.count() {
                        let Some(found) = self.meet(axes, g, block, lane, &t[g]) else { continue };
                        each(found.mask & mine, |i| {
                            let candidate = Candidate { t: found.t[i], u: found.u[i], v: found.v[i] };
                            t[g][i] = hit(GROUP * g + i, block.id(lane), candidate);
                        });
                    }
                } else {
                    each(mine, |i| {
                        let ray = GROUP * g + i;
                        let shear = Shear::new(&self.rays[ray]);
                        let Some(found) = triangle::intersect_block::<B::Eight>(block, &shear, t[g][i]) else { return };
                        each(found.mask, |lane| {
                            let candidate = Candidate { t: found.t[lane], u: found.u[lane], v: found.v[lane] };
                            t[g][i] = hit(ray, block.id(lane), candidate);
                        });
                    });
                }
            }
            if block.is_last() {
                break;
            }
        }
    }
}

#[cold]
#[inline(never)]
fn again_in_double<E: Lanes<Array = [f32; GROUP]>>(
    rays: &[Ray],
    vertices: &[[f32; 3]; 3],
    t: &[f32; GROUP],
    strange: u32,
    found: &mut triangle::Candidates<E>,
) {
    for (i, ray) in rays.iter().take(GROUP).enumerate().filter(|(i, _)| strange >> i & 1 != 0) {
        if let Some(hit) = triangle::intersect(vertices, &Shear::new(ray)).filter(|hit| hit.t <= t[i]) {
            found.mask |= 1 << i;
            (found.t[i], found.u[i], found.v[i]) = (hit.t, hit.u, hit.v);
        }
    }
}

/// Whether directions differ by at most [`SPREAD`] times the size of the first, along each axis.
#[inline(always)]
fn go_the_same_way(rays: &[Ray]) -> bool {
    // The time rides along in the fourth lane, and is not looked at.
    let lanes = |ray: &Ray| Native::load(&[ray.d[0], ray.d[1], ray.d[2], ray.time]);
    let [x, y, z] = rays[0].d.map(f32::abs);
    let size = if x > y { x } else { y };
    let most = Native::splat(if size > z { size } else { z } * SPREAD);
    let first = lanes(&rays[0]);
    let (mut lo, mut hi) = (first, first);
    rays.chunks(4).all(|few| {
        for ray in few {
            let d = lanes(ray);
            (lo, hi) = (d.min(lo), d.max(hi));
        }
        (hi - lo).le(most).mask() & 7 == 7
    })
}

/// The stack of a packet: nearest on top.
struct Waiting {
    stack: Stack<Entry>,
    n: usize,
}

impl Waiting {
    /// All children of `node` in `mask`, farthest first.
    #[inline(always)]
    fn push(&mut self, bvh: &Bvh, node: u32, mask: u32, near: &[f32; WIDTH]) {
        let children = &bvh.nodes[node as usize].children;
        let base = self.n;
        each(mask, |slot| {
            let entry = Entry { near: near[slot], child: children[slot], parent: node, slot: slot as u32 };
            walk::prefetch(bvh, entry.child);
            let mut j = self.n;
            while j > base && self.stack.get(j - 1).near < entry.near {
                self.stack.set(j, self.stack.get(j - 1));
                j -= 1;
            }
            self.stack.set(j, entry);
            self.n += 1;
        });
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.n = self.n.checked_sub(1)?;
        Some(self.stack.get(self.n))
    }
}

/// Bits of a mask, lowest first.
#[inline(always)]
fn each(mut mask: u32, mut f: impl FnMut(usize)) {
    while mask != 0 {
        f(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

/// Rays of a mask one after another, which they are, and how many.
#[inline(always)]
fn gathered(mask: u32, ray: impl Fn(usize) -> Ray) -> ([Ray; PACKET], [usize; PACKET], usize) {
    let mut rays = [Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 }; PACKET];
    let mut which = [0; PACKET];
    let mut n = 0;
    each(mask, |i| {
        (rays[n], which[n]) = (ray(i), i);
        n += 1;
    });
    (rays, which, n)
}

/// Least and greatest.
#[inline(always)]
fn range(x: &[[f32; GROUP]]) -> (f32, f32) {
    let (mut lo, mut hi) = (x[0][0], x[0][0]);
    for &x in x.as_flattened() {
        lo = if x < lo { x } else { lo };
        hi = if x > hi { x } else { hi };
    }
    (lo, hi)
}

/// Ends of rays; that of no ray is before all beginnings.
#[inline(always)]
fn ends(rays: &[Ray]) -> [[f32; GROUP]; GROUPS] {
    let mut t = [[f32::NEG_INFINITY; GROUP]; GROUPS];
    for (t, ray) in t.as_flattened_mut().iter_mut().zip(rays) {
        *t = ray.t_max;
    }
    t
}

/// As [`walk::closest`] for each of up to [`PACKET`] rays.
#[inline(always)]
pub(super) fn closest<E: Lanes<Array = [f32; GROUP]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    rays: &[Ray],
    leaves: &L,
    out: &mut [Option<Closest<L::UserHit>>],
) -> bool {
    if bvh.nodes.is_empty() || rays.len() <= FEW as usize {
        return false;
    }
    let Some(packet) = Packet::<E>::new(rays) else { return false };
    let mut t = ends(rays);
    let mut best: [Best<L::UserHit>; PACKET] = std::array::from_fn(|i| Best::new(t[i / GROUP][i % GROUP]));
    let mut far = range(&t).1;
    let mut waiting = Waiting { stack: Stack::new(), n: 0 };
    let (mask, near) = packet.may_enter(&bvh.nodes[0], far);
    waiting.push(bvh, 0, mask, &near);
    while let Some(entry) = waiting.pop() {
        if entry.near > far * PADDING {
            continue;
        }
        let active = packet.enter(&bvh.nodes[entry.parent as usize], entry.slot as usize, &t);
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
                walk::closest_below::<B, L>(bvh, entry.child, &rays[i], leaves, &mut best[i]);
                t[i / GROUP][i % GROUP] = best[i].t;
            });
        } else if entry.child.is_users() {
            for index in entry.child.index().. {
                let user = bvh.users[index];
                let (rays, which, n) = gathered(active, |i| best[i].ray_for_user(&rays[i]));
                let mut hits = [None; PACKET];
                leaves.intersect_many(user & !LAST_USER, &rays[..n], &mut hits[..n]);
                for (&i, hit) in which[..n].iter().zip(hits) {
                    best[i].offer_user_hit(user & !LAST_USER, hit);
                    t[i / GROUP][i % GROUP] = best[i].t;
                }
                if user & LAST_USER != 0 {
                    break;
                }
            }
        } else {
            packet.leaf::<B>(bvh, entry.child, active, &mut t, |i, id, at| {
                best[i].offer_triangle(leaves, &rays[i], id, at.t, at.u, at.v);
                best[i].t
            });
        }
        far = range(&t).1;
    }
    for (out, best) in out.iter_mut().zip(best) {
        *out = best.finish();
    }
    true
}

/// As [`walk::any`] for each of up to [`PACKET`] rays.
#[inline(always)]
pub(super) fn any<E: Lanes<Array = [f32; GROUP]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    rays: &[Ray],
    leaves: &L,
    out: &mut [bool],
) -> bool {
    if bvh.nodes.is_empty() || rays.len() <= FEW as usize {
        return false;
    }
    let Some(packet) = Packet::<E>::new(rays) else { return false };
    // Rays that have met something end before they begin.
    let mut t = ends(rays);
    let mut far = range(&t).1;
    let mut waiting = Waiting { stack: Stack::new(), n: 0 };
    out.fill(false);
    let (mask, near) = packet.may_enter(&bvh.nodes[0], far);
    waiting.push(bvh, 0, mask, &near);
    while let Some(entry) = waiting.pop() {
        let active = packet.enter(&bvh.nodes[entry.parent as usize], entry.slot as usize, &t);
        if active == 0 {
            continue;
        }
        let mut blocked = 0;
        if !entry.child.is_leaf() {
            if active.count_ones() > FEW {
                let (mask, near) = packet.may_enter(&bvh.nodes[entry.child.index()], far);
                waiting.push(bvh, entry.child.0, mask, &near);
                continue;
            }
            each(active, |i| {
                blocked |= u32::from(walk::any_below::<B, L>(bvh, entry.child, &rays[i], leaves)) << i;
            });
        } else if entry.child.is_users() {
            for index in entry.child.index().. {
                let user = bvh.users[index];
                let (rays, which, n) = gathered(active & !blocked, |i| rays[i]);
                let mut met = [false; PACKET];
                leaves.occluded_many(user & !LAST_USER, &rays[..n], &mut met[..n]);
                for (&i, met) in which[..n].iter().zip(met) {
                    blocked |= u32::from(met) << i;
                }
                if user & LAST_USER != 0 {
                    break;
                }
            }
        } else {
            packet.leaf::<B>(bvh, entry.child, active, &mut t, |i, id, at| {
                let is_hit = at.t < rays[i].t_max && counts(leaves, &rays[i], id, at);
                blocked |= u32::from(is_hit) << i;
                if is_hit || blocked >> i & 1 != 0 { f32::NEG_INFINITY } else { rays[i].t_max }
            });
        }
        if blocked != 0 {
            each(blocked, |i| {
                out[i] = true;
                t[i / GROUP][i % GROUP] = f32::NEG_INFINITY;
            });
            far = range(&t).1;
            if far == f32::NEG_INFINITY {
                break;
            }
        }
    }
    true
}
