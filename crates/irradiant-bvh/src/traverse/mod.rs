//! From a ray to what it meets, at any [`Level`].
//!
//! Every level and every packet finds the same hits, whatever way it takes through the tree and whichever boxes it looks at
//! besides, because a hit depends on the ray and the triangle alone. The triangle test's `t` has an error that grows with
//! the triangle's size, so `t` may lie before the box, or the ray miss the box that the test says it meets. Therefore
//! a candidate counts only if the ray enters the triangle's own box, and its distance is `max(t, near)` where `near`
//! is the place of that entry; both by the arithmetic of [`scalar`], without fused operations (`within_own_box`).
//!
//! Then no kernel can cull what counts, `near <= leave` and `near <= t < limit`. A box higher up contains this one, and:
//! - The specification, `Halves` and `Whole` do the same operations, of which each is monotonic: `near` of the higher box
//!   is not greater, `leave` not less (a NaN bounds nothing, and stands where a plane of the own box goes through the
//!   origin: the other is then at minus infinity where entered, plus infinity where left, or NaN), and
//!   `near <= t < limit <= limit * PADDING`. `limit` only shrinks, to the `t` of the hit.
//! - With `x = (plane - o) / d` and `e = 2^-24`, what those compute is `x` within `2 e |x|` where entered and `x PADDING`
//!   within `3 e |x|` where left, and has its sign. The fused form (of [`boxes`] and of rays in a [`packet`] or a [`crowd`]) takes off more than it may have
//!   lost of the product with the origin (`FUSED_LOST`), so what is left is rounding relative to `x`: at most `x (1 + 2 e)`
//!   where entered, at least `x WIDER (1 - 3 e)` where left, lanes without a fused operation included. So `near` is at most
//!   `5 e` too far, less than `PADDING` (`16 e`) allows against the limit; and against `leave`, which has `WIDER` (`32 e`) where
//!   the own box has `PADDING`: `16 e` for the `11 e` that both sides' roundings are.
//! - The interval of a packet does the operations of the specification where entered, on ends of the interval:
//!   monotonic. Where left it multiplies by the padding in another order: `WIDER` again, `16 e` for `6 e`.
//! - What waits on a stack is dropped if its `near` is beyond `limit * PADDING`: as above.
//!
//! All that holds where distances and products are normal numbers, not below `2^-120`. It holds of user primitives as far
//! as what their callbacks say lies within their boxes by the same arithmetic.

mod batch;
mod boxes;
mod crowd;
mod packet;
mod scalar;
mod side_by_side;
mod walk;

#[cfg(test)]
mod batch_tests;
#[cfg(test)]
mod large_tests;
#[cfg(test)]
mod part_tests;
#[cfg(test)]
mod tests;

use crate::lanes::{Lanes, Native};
use crate::level::Level;
use crate::node::{Bvh, Child};
use crate::part::Part;
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::Candidate;

/// `1 + 8 ulp`. Ize's bound for the slab test alone is `1 + 2 gamma(3)`, about 1.0000004.
pub(crate) const PADDING: f32 = 1.000_000_95;
/// `1 + 16 ulp`: the padding of box tests that do other arithmetic than the specification's.
pub(crate) const WIDER: f32 = 1.000_001_9;

impl Bvh {
    /// The closest hit of `ray`, or `None`.
    ///
    /// Of several at exactly the same `t`, triangles come before user primitives, lower indices before higher, and among user primitives those
    /// that [`Leaves::precedes`] puts first.
    #[inline(always)]
    pub fn intersect<L: Leaves>(&self, level: Level, ray: &Ray, leaves: &L) -> Option<Closest<L::UserHit>> {
        self.intersect_part(Part::ALL, level, ray, leaves)
    }

    /// The same of a part of the tree.
    #[inline(always)]
    pub fn intersect_part<L: Leaves>(
        &self,
        Part(start): Part,
        level: Level,
        ray: &Ray,
        leaves: &L,
    ) -> Option<Closest<L::UserHit>> {
        match level.min(Level::detect()) {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => boxes::x86::closest_avx512(self, start, ray, leaves),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => boxes::x86::closest_avx2(self, start, ray, leaves),
            level => self.closest_at_lower(start, level, ray, leaves),
        }
    }

    /// Out of the way of those that are to be inlined where instances ask.
    #[inline(never)]
    fn closest_at_lower<L: Leaves>(
        &self,
        start: Child,
        level: Level,
        ray: &Ray,
        leaves: &L,
    ) -> Option<Closest<L::UserHit>> {
        match level {
            Level::Scalar => scalar::closest(self, start, ray, leaves),
            #[cfg(target_arch = "x86_64")]
            Level::Sse => walk::closest::<boxes::Halves<crate::lanes::Sse>, L>(self, start, ray, leaves),
            _ => walk::closest::<boxes::Halves<crate::lanes::NeonOrPortable>, L>(self, start, ray, leaves),
        }
    }

    /// Whether `ray` meets anything.
    #[inline(always)]
    pub fn occluded<L: Leaves>(&self, level: Level, ray: &Ray, leaves: &L) -> bool {
        self.occluded_part(Part::ALL, level, ray, leaves)
    }

    /// Whether `ray` meets anything in a part of the tree.
    #[inline(always)]
    pub fn occluded_part<L: Leaves>(&self, Part(start): Part, level: Level, ray: &Ray, leaves: &L) -> bool {
        match level.min(Level::detect()) {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => boxes::x86::any_avx512(self, start, ray, leaves),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => boxes::x86::any_avx2(self, start, ray, leaves),
            level => self.any_at_lower(start, level, ray, leaves),
        }
    }

    /// As [`Self::closest_at_lower`].
    #[inline(never)]
    fn any_at_lower<L: Leaves>(&self, start: Child, level: Level, ray: &Ray, leaves: &L) -> bool {
        match level {
            Level::Scalar => scalar::any(self, start, ray, leaves),
            #[cfg(target_arch = "x86_64")]
            Level::Sse => walk::any::<boxes::Halves<crate::lanes::Sse>, L>(self, start, ray, leaves),
            _ => walk::any::<boxes::Halves<crate::lanes::NeonOrPortable>, L>(self, start, ray, leaves),
        }
    }
}

/// Whether `ray` can meet anything at all: finite origin and direction, some direction, and a positive length.
#[inline(always)]
fn is_proper(ray: &Ray) -> bool {
    let (o, d) = ray.lanes::<Native>();
    let infinity = Native::splat(f32::INFINITY);
    let (o, d) = (o.abs(), d.abs());
    // Of the three axes; NaN fails.
    let finite = (o.lt(infinity) & d.lt(infinity)).mask() & 7 == 7;
    finite && ray.t_max > 0.0 && Native::splat(0.0).lt(d).mask() & 7 != 0
}

/// The closest hit so far, with the order that breaks ties.
struct Best<U> {
    t: f32,
    /// Triangle index, or [`Best::USERS`] plus user index; 0 before there is any hit, so that nothing ties with `t_max`.
    rank: u32,
    u: f32,
    v: f32,
    user: Option<U>,
    found: bool,
}

impl<U: Copy> Best<U> {
    const USERS: u32 = 1 << 30;

    #[inline(always)]
    fn new(t_max: f32) -> Self {
        Self { t: t_max, rank: 0, u: 0.0, v: 0.0, user: None, found: false }
    }

    #[inline(always)]
    fn is_beaten_by(&self, t: f32, rank: u32) -> bool {
        t < self.t || (t == self.t && rank < self.rank)
    }

    #[inline(always)]
    fn offer_triangle<L: Leaves>(
        &mut self,
        leaves: &L,
        ray: &Ray,
        id: u32,
        Candidate { t, u, v }: Candidate,
        vertices: impl FnOnce() -> [[f32; 3]; 3],
    ) {
        use crate::node::Block;
        let index = id & Block::INDEX;
        if self.is_beaten_by(t, index)
            && let Some(t) = scalar::within_own_box(t, &vertices(), ray)
            && self.is_beaten_by(t, index)
            && (!L::HAS_FILTER || id & Block::FILTERED == 0 || leaves.accept(index, ray, t, u, v))
        {
            (self.t, self.rank, self.u, self.v, self.found) = (t, index, u, v, true);
        }
    }

    /// Asks about user primitive `index`.
    #[inline(always)]
    fn offer_user<L: Leaves<UserHit = U>>(&mut self, leaves: &L, ray: &Ray, index: u32) {
        self.offer_user_hit(leaves, index, leaves.intersect(index, &self.ray_for_user(ray)));
    }

    /// The ray to ask about user primitives.
    #[inline(always)]
    fn ray_for_user(&self, ray: &Ray) -> Ray {
        Ray { t_max: Self::end_for_user(self.t, self.found), ..*ray }
    }

    /// Where it ends: hits as far away as one that was found count.
    #[inline(always)]
    fn end_for_user(t: f32, found: bool) -> f32 {
        if found { t.next_up() } else { t }
    }

    /// What user primitive `index` said.
    #[inline(always)]
    fn offer_user_hit<L: Leaves<UserHit = U>>(&mut self, leaves: &L, index: u32, hit: Option<(f32, U)>) {
        if let Some((t, hit)) = hit
            && (t < self.t || (t == self.t && self.yields_to(leaves, index, &hit)))
        {
            (self.t, self.rank, self.user, self.found) = (t, Self::USERS + index, Some(hit), true);
        }
    }

    /// Whether a hit of user primitive `index`, equally far away, counts instead.
    #[cold]
    fn yields_to<L: Leaves<UserHit = U>>(&self, leaves: &L, index: u32, hit: &U) -> bool {
        match &self.user {
            Some(mine) if self.rank >= Self::USERS => leaves.precedes((index, hit), (self.rank - Self::USERS, mine)),
            // A triangle precedes, and so does the end of the ray, of rank 0.
            _ => false,
        }
    }

    #[inline(always)]
    fn finish(self) -> Option<Closest<U>> {
        use crate::ray::Hit;
        if !self.found {
            return None;
        }
        Some(match self.user {
            Some(hit) if self.rank >= Self::USERS => Closest::User { t: self.t, user: self.rank - Self::USERS, hit },
            _ => Closest::Triangle(Hit { t: self.t, u: self.u, v: self.v, primitive: self.rank }),
        })
    }
}
