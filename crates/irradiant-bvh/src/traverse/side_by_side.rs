//! The hits of up to sixteen rays, side by side.

use super::packet::{Column, PACKET, each, gathered};
use super::scalar::counts;
use super::{Best, PADDING};
use crate::lanes::Lanes;
use crate::node::{Block, Bvh, Child, LAST_USER};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::Candidates;

/// Origins and reciprocal directions of proper rays that move along every axis.
#[derive(Clone, Copy)]
pub(super) struct Lines<E> {
    pub origin: [E; 3],
    pub inverse: [E; 3],
}

impl<E: Lanes<Array = [f32; PACKET]>> Lines<E> {
    /// What becomes of candidates when the triangle's own box is asked: the distances, and a mask of those that count. To the bit the
    /// `within_own_box` of one ray; here the plane met first is the one that is met nearer, since rounding is monotonic.
    #[inline(always)]
    fn within_own_box(&self, [a, b, c]: &[[f32; 3]; 3], t: E) -> (E, u32) {
        let (mut near, mut far) = (E::splat(0.0), E::splat(f32::INFINITY));
        for k in 0..3 {
            let low = if a[k] < b[k] { a[k] } else { b[k] };
            let low = if low < c[k] { low } else { c[k] };
            let high = if a[k] > b[k] { a[k] } else { b[k] };
            let high = if high > c[k] { high } else { c[k] };
            let (to_low, to_high) = (E::splat(low) - self.origin[k], E::splat(high) - self.origin[k]);
            let (inverse, padded) = (self.inverse[k], self.inverse[k] * E::splat(PADDING));
            near = (to_low * inverse).min(to_high * inverse).max(near);
            far = (to_low * padded).max(to_high * padded).min(far);
        }
        (near.max(t), near.le(far).mask())
    }

    /// Which rays candidates stop before `ends`.
    #[inline(always)]
    pub fn stopped<L: Leaves>(
        &self,
        leaves: &L,
        ray: impl Fn(usize) -> Ray,
        ends: E,
        block: &Block,
        lane: usize,
        found: &Candidates<E>,
    ) -> u32 {
        if L::HAS_FILTER && block.id(lane) & Block::FILTERED != 0 {
            let mut stopped = 0;
            let all = found.spread();
            each(found.mask, |i| {
                stopped |= u32::from(counts(leaves, &ray(i), block, lane, all.at(i))) << i;
            });
            return stopped;
        }
        let (t, inside) = self.within_own_box(&block.triangle(lane), found.t);
        found.mask & inside & t.lt(ends).mask()
    }
}

/// The closest hits so far; see [`Best`].
pub(super) struct Bests<U> {
    pub t: Column,
    u: Column,
    v: Column,
    rank: [u32; PACKET],
    user: [Option<U>; PACKET],
    found: u32,
}

impl<U: Copy> Bests<U> {
    /// None before these ends.
    #[inline(always)]
    pub fn new(t: Column) -> Self {
        let zero = Column([0.0; PACKET]);
        Self { t, u: zero, v: zero, rank: [0; PACKET], user: [None; PACKET], found: 0 }
    }

    /// That of one ray.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Best<U> {
        let found = self.found >> i & 1 != 0;
        Best { t: self.t.0[i], rank: self.rank[i], u: self.u.0[i], v: self.v.0[i], user: self.user[i], found }
    }

    /// What one ray has met, alone.
    #[inline(always)]
    pub fn set(&mut self, i: usize, best: Best<U>) {
        (self.t.0[i], self.rank[i], self.u.0[i], self.v.0[i]) = (best.t, best.rank, best.u, best.v);
        self.user[i] = best.user;
        self.found |= u32::from(best.found) << i;
    }

    /// Offers the candidates of a triangle.
    #[inline(always)]
    pub fn offer<E: Lanes<Array = [f32; PACKET]>, L: Leaves<UserHit = U>>(
        &mut self,
        leaves: &L,
        lines: &Lines<E>,
        ray: impl Fn(usize) -> Ray,
        block: &Block,
        lane: usize,
        found: &Candidates<E>,
    ) {
        let id = block.id(lane);
        let index = id & Block::INDEX;
        let (t, inside) = lines.within_own_box(&block.triangle(lane), found.t);
        let best = E::load(&self.t.0);
        let candidates = found.mask & inside;
        let mut nearer = candidates & t.lt(best).mask();
        let equal = candidates & t.le(best).mask() & !nearer;
        each(equal, |i| nearer |= u32::from(index < self.rank[i]) << i);
        if L::HAS_FILTER && id & Block::FILTERED != 0 {
            let (t, all) = (t.to_array(), found.spread());
            each(nearer, |i| {
                if !leaves.accept(index, &ray(i), t[i], all.at(i).u, all.at(i).v) {
                    nearer &= !(1 << i);
                }
            });
        }
        if nearer == 0 {
            return;
        }
        self.t = Column(E::select(nearer, t, best).to_array());
        self.u = Column(E::select(nearer, found.u, E::load(&self.u.0)).to_array());
        self.v = Column(E::select(nearer, found.v, E::load(&self.v.0)).to_array());
        each(nearer, |i| self.rank[i] = index);
        self.found |= nearer;
    }

    /// Asks about the user primitives of a leaf, for the rays of `active`.
    #[inline(always)]
    pub fn offer_users<L: Leaves<UserHit = U>>(
        &mut self,
        bvh: &Bvh,
        leaf: Child,
        leaves: &L,
        active: u32,
        ray: impl Fn(usize) -> Ray,
    ) {
        for index in leaf.index().. {
            let user = bvh.users[index];
            let end = |i: usize| Best::<U>::end_for_user(self.t.0[i], self.found >> i & 1 != 0);
            let (rays, which, n) = gathered(active, |i| Ray { t_max: end(i), ..ray(i) });
            let mut hits = [None; PACKET];
            leaves.intersect_many(user & !LAST_USER, &rays[..n], &mut hits[..n]);
            for (&i, hit) in which[..n].iter().zip(hits) {
                if hit.is_some() {
                    let mut one = self.get(i);
                    one.offer_user_hit(leaves, user & !LAST_USER, hit);
                    self.set(i, one);
                }
            }
            if user & LAST_USER != 0 {
                break;
            }
        }
    }

    /// The answer to ray `i`.
    #[inline(always)]
    pub fn finish(&self, i: usize) -> Option<Closest<U>> {
        self.get(i).finish()
    }
}

/// Which rays of `active` the user primitives of a leaf stop.
#[inline(always)]
pub(super) fn stopped_by_users<L: Leaves>(
    bvh: &Bvh,
    leaf: Child,
    leaves: &L,
    active: u32,
    ray: impl Fn(usize) -> Ray,
) -> u32 {
    let mut stopped = 0;
    for index in leaf.index().. {
        let user = bvh.users[index];
        if active & !stopped == 0 {
            break;
        }
        let (rays, which, n) = gathered(active & !stopped, &ray);
        let mut met = [false; PACKET];
        leaves.occluded_many(user & !LAST_USER, &rays[..n], &mut met[..n]);
        for (&i, met) in which[..n].iter().zip(met) {
            stopped |= u32::from(met) << i;
        }
        if user & LAST_USER != 0 {
            break;
        }
    }
    stopped
}
