//! Up to sixteen rays that go anywhere within one octant: bounces, and what is left of other batches.
//!
//! Such rays enter other boxes soon, but near the root of a tree, and everywhere in a small one, most of them enter most boxes: a node's
//! boxes and a leaf's triangles are tested one after the other, each for all rays at once, without a branch for any ray alone. Where
//! few rays remain they go on alone.

use super::boxes::{BoxTest, FUSED_LIMIT, FUSED_LOST};
use super::packet::{Column, PACKET, each};
use super::side_by_side::{Bests, Lines, stopped_by_users};
use super::walk::{self, Stack};
use super::{PADDING, WIDER};
use crate::lanes::{Lanes, Native};
use crate::node::{Block, Bvh, Child, Node, WIDTH};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Candidates, Shear};

/// This many rays or fewer go on alone. With 3: the interior of the benchmark 1.02 of the time; with 8: no difference. At a leaf rays never do: with 4, the Cornell
/// box 1.1.
const FEW: u32 = 5;

/// Octants, with a bit for each axis (set: backwards).
pub(super) const OCTANTS: usize = 8;
/// Kinds of rays: three for each octant, by the fastest axis, and [`NONE`].
pub(super) const KINDS: usize = 3 * OCTANTS + 1;
/// The kind of rays that cannot be one of a crowd.
const NONE: usize = 3 * OCTANTS;

/// The last kind of an octant; they are in order.
pub(super) fn last_kind_of(octant: usize) -> usize {
    3 * octant + 2
}

/// The kind of a ray. [`NONE`] if it is not proper, does not move along every axis, or something may overflow in the fused form of
/// [`super::boxes`].
#[inline(always)]
pub(super) fn kind(ray: &Ray) -> usize {
    let (o, d) = ray.lanes::<Native>();
    let inverse = Native::splat(1.0) / d;
    let (size, limit) = (inverse.abs(), Native::splat(FUSED_LIMIT));
    // A reciprocal that is finite and not zero is that of a proper direction, and a finite product with it that of a finite origin; NaN fails.
    let sound = Native::splat(0.0).lt(size) & size.lt(limit) & (o * inverse).abs().lt(limit);
    let [x, y, z] = ray.d.map(f32::abs);
    let fastest = usize::from((x < y) | (x < z)) + usize::from((y < z) & (x < z));
    let kind = (inverse.mask() as usize & 7) * 3 + fastest;
    if (sound.mask() & 7 == 7) & (ray.t_max > 0.0) { kind } else { NONE }
}

/// Rays of an octant side by side. Lanes without a ray repeat the last one.
struct Crowd<E> {
    lines: Lines<E>,
    /// As in [`super::boxes`], where the fused form is explained.
    entering: [E; 3],
    padded: [E; 3],
    leaving: [E; 3],
    /// Indices of the planes met first.
    first: [usize; 3],
    /// Of the shears: the axes, for [`Lanes::look_up`]; origins along those, and the shears.
    rows: [E; 3],
    sheared_origin: [E; 3],
    shear: [E; 3],
}

impl<E: Lanes<Array = [f32; PACKET]>> Crowd<E> {
    /// With their ends, minus infinity for lanes without a ray.
    #[inline(always)]
    fn new(rays: &[Ray], which: &[u16], octant: usize) -> (Self, Column) {
        let (mut origins, mut directions) = ([&[0.0; 4]; PACKET], [&[0.0; 4]; PACKET]);
        let last = which[which.len() - 1];
        for i in 0..PACKET {
            (origins[i], directions[i]) = rays[*which.get(i).unwrap_or(&last) as usize].rows();
        }
        let ([ox, oy, oz, ends], [dx, dy, dz, _]) = (E::columns(&origins), E::columns(&directions));
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let ends = E::select((1 << which.len()) - 1, ends, E::splat(f32::NEG_INFINITY));
        let (one, zero, minus) = (E::splat(1.0), E::splat(0.0), E::splat(-1.0));
        let (padding, lost) = (E::splat(WIDER), E::splat(FUSED_LOST));
        let inverse = [one / d[0], one / d[1], one / d[2]];
        let (mut entering, mut padded, mut leaving) = ([zero; 3], [zero; 3], [zero; 3]);
        for k in 0..3 {
            padded[k] = inverse[k] * padding;
            let (product, padded_product) = (o[k] * inverse[k], o[k] * padded[k]);
            entering[k] = product * minus - product.abs() * lost;
            leaving[k] = padded_product.abs() * lost - padded_product;
        }
        let [x, y, z] = [d[0].abs(), d[1].abs(), d[2].abs()];
        let is_x = (y.lt(x) & z.lt(x)).mask();
        let is_y = z.lt(y).mask() & !is_x;
        let fastest = [is_x, is_y];
        let ([sx, sy, sz], sheared_origin) = (along(fastest, d), along(fastest, o));
        let crowd = Self {
            lines: Lines { origin: o, inverse },
            entering,
            padded,
            leaving,
            first: [0, 1, 2].map(|k| 2 * k + (octant >> k & 1)),
            rows: along(fastest, [0, 1, 2].map(|axis| E::splat(f32::from_bits(axis << 3)))),
            sheared_origin,
            shear: [(sx * minus) / sz, (sy * minus) / sz, one / sz],
        };
        (crowd, Column(ends.to_array()))
    }

    /// Where the rays enter a child, and which of them do before `far`.
    #[inline(always)]
    fn enter(&self, node: &Node, slot: usize, far: E) -> (E, u32) {
        let (mut near, mut far) = (E::splat(0.0), far);
        for k in 0..3 {
            let plane = |p: usize| E::splat(node.planes[p][slot]);
            near = plane(self.first[k]).multiply_add(self.lines.inverse[k], self.entering[k]).max(near);
            far = plane(self.first[k] ^ 1).multiply_add(self.padded[k], self.leaving[k]).min(far);
        }
        (near, near.le(far).mask())
    }

    /// The triangle of a lane against all rays: candidates with `t <= t_far`.
    #[inline(always)]
    fn meet(
        &self,
        rays: &[Ray],
        which: &[u16],
        block: &Block,
        lane: usize,
        t_far: E,
        active: u32,
    ) -> Option<Candidates<E>> {
        let (a, b, c) = (block.corner(lane, 0), block.corner(lane, 1), block.corner(lane, 2));
        let [x, y, z] = self.rows;
        let of = &block.vertices;
        let vertices = [
            [E::look_up(of, x, a), E::look_up(of, y, a), E::look_up(of, z, a)],
            [E::look_up(of, x, b), E::look_up(of, y, b), E::look_up(of, z, b)],
            [E::look_up(of, x, c), E::look_up(of, y, c), E::look_up(of, z, c)],
        ];
        let (mut found, strange) = triangle::intersect_lanes(vertices, self.sheared_origin, self.shear, t_far, active)?;
        if strange != 0 {
            let ends = t_far.to_array();
            let shear = |i: usize| Shear::new(&rays[which[i] as usize]);
            found = found.again_in_double(strange, |i| (block.triangle(lane), shear(i), ends[i]));
        }
        Some(found)
    }
}

/// Along the axes of each lane's shear.
#[inline(always)]
fn along<E: Lanes>([is_x, is_y]: [u32; 2], [x, y, z]: [E; 3]) -> [E; 3] {
    [
        E::select(is_x, y, E::select(is_y, z, x)),
        E::select(is_x, z, E::select(is_y, x, y)),
        E::select(is_x, x, E::select(is_y, y, z)),
    ]
}

/// A child to visit, and where each ray enters it: infinity for those that do not.
#[derive(Clone, Copy)]
struct Entry {
    near: Column,
    child: Child,
}

/// As [`walk::closest`] for each of up to [`PACKET`] rays of one octant.
#[inline(always)]
pub(super) fn closest<E: Lanes<Array = [f32; PACKET]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    rays: &[Ray],
    which: &[u16],
    octant: usize,
    leaves: &L,
    out: &mut [Option<Closest<L::UserHit>>],
) {
    let (crowd, t) = Crowd::<E>::new(rays, which, octant);
    let ray = |i: usize| rays[which[i] as usize];
    let mut best = Bests::new(t);
    let mut stack = Stack::new();
    stack.set(0, Entry { near: Column([0.0; PACKET]), child: start });
    let mut n = 1;
    let (padding, infinity) = (E::splat(PADDING), E::splat(f32::INFINITY));
    while n > 0 {
        n -= 1;
        let Entry { near, child } = stack.get(n);
        // Finite, or those that did not enter would pass while they have met nothing.
        let far = (E::load(&best.t.0) * padding).min(E::splat(f32::MAX));
        let active = E::load(&near.0).le(far).mask();
        if active == 0 {
            continue;
        }
        if child.is_leaf() && !child.is_users() {
            for index in child.index().. {
                let block = &bvh.blocks[index];
                for lane in 0..block.count() {
                    if let Some(found) = crowd.meet(rays, which, block, lane, E::load(&best.t.0), active)
                        && found.mask != 0
                    {
                        best.offer(leaves, &crowd.lines, ray, block, lane, &found);
                    }
                }
                if block.is_last() {
                    break;
                }
            }
        } else if active.count_ones() <= FEW && !child.is_leaf() {
            each(active, |i| {
                let mut one = best.get(i);
                walk::closest_below::<B, L>(bvh, child, &ray(i), leaves, &mut one);
                best.set(i, one);
            });
        } else if child.is_leaf() {
            best.offer_users(bvh, child, leaves, active, ray);
        } else {
            let node = &bvh.nodes[child.index()];
            let far = E::select(active, far, E::splat(f32::NEG_INFINITY));
            let (mut keys, mut nears) = ([0u64; WIDTH], [Column([0.0; PACKET]); WIDTH]);
            let mut m = 0;
            for slot in 0..WIDTH {
                let (near, mask) = crowd.enter(node, slot, far);
                if mask == 0 {
                    continue;
                }
                let near = Column(E::select(mask, near, infinity).to_array());
                let key = u64::from(near.least().to_bits()) << 32 | slot as u64;
                nears[slot] = near;
                // Farthest first.
                let mut j = m;
                while j > 0 && keys[j - 1] < key {
                    keys[j] = keys[j - 1];
                    j -= 1;
                }
                keys[j] = key;
                m += 1;
            }
            for key in &keys[..m] {
                let slot = *key as usize & 7;
                let child = node.children[slot];
                walk::prefetch(bvh, child);
                stack.set(n, Entry { near: nears[slot], child });
                n += 1;
            }
        }
    }
    for (i, &ray) in which.iter().enumerate() {
        out[ray as usize] = best.finish(i);
    }
}

/// As [`walk::any`] for each of up to [`PACKET`] rays of one octant.
#[inline(always)]
pub(super) fn any<E: Lanes<Array = [f32; PACKET]>, B: BoxTest, L: Leaves>(
    bvh: &Bvh,
    start: Child,
    rays: &[Ray],
    which: &[u16],
    octant: usize,
    leaves: &L,
    out: &mut [bool],
) {
    let (crowd, ends) = Crowd::<E>::new(rays, which, octant);
    let ray = |i: usize| rays[which[i] as usize];
    let all = (1u32 << which.len()) - 1;
    let mut blocked = 0u32;
    let mut stack: Stack<(Child, u32)> = Stack::new();
    stack.set(0, (start, all));
    let mut n = 1;
    let (ends, padding) = (E::load(&ends.0), E::splat(PADDING));
    while n > 0 && blocked != all {
        n -= 1;
        let (child, entered) = stack.get(n);
        let active = entered & !blocked;
        if active == 0 {
            continue;
        }
        if child.is_leaf() && !child.is_users() {
            for index in child.index().. {
                let block = &bvh.blocks[index];
                for lane in 0..block.count() {
                    let Some(found) = crowd.meet(rays, which, block, lane, ends, active & !blocked) else { continue };
                    if found.mask == 0 {
                        continue;
                    }
                    blocked |= crowd.lines.stopped(leaves, ray, ends, block, lane, &found);
                }
                if block.is_last() {
                    break;
                }
            }
        } else if active.count_ones() <= FEW && !child.is_leaf() {
            each(active, |i| {
                blocked |= u32::from(walk::any_below::<B, L>(bvh, child, &ray(i), leaves)) << i;
            });
        } else if child.is_leaf() {
            blocked |= stopped_by_users(bvh, child, leaves, active, ray);
        } else {
            let node = &bvh.nodes[child.index()];
            let far = E::select(active, ends * padding, E::splat(f32::NEG_INFINITY));
            for slot in 0..WIDTH {
                let (_, mask) = crowd.enter(node, slot, far);
                if mask != 0 {
                    let child = node.children[slot];
                    walk::prefetch(bvh, child);
                    stack.set(n, (child, mask));
                    n += 1;
                }
            }
        }
    }
    for (i, &ray) in which.iter().enumerate() {
        out[ray as usize] = blocked >> i & 1 != 0;
    }
}
