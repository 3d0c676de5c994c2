//! Many rays in one call.

#[cfg(target_arch = "x86_64")]
use super::boxes;
use super::boxes::Halves;
use super::crowd;
use super::packet::{self, PACKET};
#[cfg(target_arch = "x86_64")]
use crate::lanes::Sse;
use crate::lanes::{NeonOrPortable, Pair, Twice};
use crate::level::Level;
use crate::node::Bvh;
use crate::part::Part;
use crate::ray::{Closest, Leaves, Ray};

/// Calls a kernel for several rays, compiled for a level.
macro_rules! at_level {
    ($level:expr, $kernel:path, $avx2:path, $avx512:path, ($($argument:expr),*)) => {
        match $level {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => $avx512($($argument),*),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => $avx2($($argument),*),
            #[cfg(target_arch = "x86_64")]
            Level::Sse => { use $kernel as kernel; kernel::<Pair<Twice<Sse>>, Halves<Sse>, L>($($argument),*) }
            _ => { use $kernel as kernel; kernel::<Pair<Twice<NeonOrPortable>>, Halves<NeonOrPortable>, L>($($argument),*) }
        }
    };
}

impl Bvh {
    /// For each ray what [`intersect`](Self::intersect) gives, to the bit; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where each sixteen, and each eight, of `rays` travel together, or the tree
    /// [sorts](Self::sorts_rays) them and there are many.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn intersect_batch<L: Leaves>(
        &self,
        level: Level,
        rays: &[Ray],
        leaves: &L,
        out: &mut [Option<Closest<L::UserHit>>],
    ) {
        self.intersect_part_batch(Part::ALL, level, rays, leaves, out);
    }

    /// The same of a part of the tree.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn intersect_part_batch<L: Leaves>(
        &self,
        part: Part,
        level: Level,
        rays: &[Ray],
        leaves: &L,
        out: &mut [Option<Closest<L::UserHit>>],
    ) {
        let Part(start) = part;
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        let level = level.min(Level::detect());
        let packet = |rays: &[Ray], out: &mut [Option<Closest<L::UserHit>>]| {
            level != Level::Scalar
                && at_level!(
                    level,
                    super::packet::closest,
                    boxes::x86::closest_packet_avx2,
                    boxes::x86::closest_packet_avx512,
                    (self, start, rays, leaves, out)
                )
        };
        let crowd = |rays: &[Ray], which: &[u16], octant: usize, out: &mut [Option<Closest<L::UserHit>>]| {
            at_level!(
                level,
                super::crowd::closest,
                boxes::x86::closest_crowd_avx2,
                boxes::x86::closest_crowd_avx512,
                (self, start, rays, which, octant, leaves, out)
            );
        };
        let single = |ray: &Ray| self.intersect_part(part, level, ray, leaves);
        in_company(self.sorts_rays(level), packet::SPREAD, rays, out, packet, crowd, single);
    }

    /// For each ray what [`occluded`](Self::occluded) says; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where each sixteen, and each eight, of `rays` travel together, or the tree
    /// [sorts](Self::sorts_rays) them and there are many.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn occluded_batch<L: Leaves>(&self, level: Level, rays: &[Ray], leaves: &L, out: &mut [bool]) {
        self.occluded_part_batch(Part::ALL, level, rays, leaves, out);
    }

    /// The same of a part of the tree.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn occluded_part_batch<L: Leaves>(&self, part: Part, level: Level, rays: &[Ray], leaves: &L, out: &mut [bool]) {
        let Part(start) = part;
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        let level = level.min(Level::detect());
        let packet = |rays: &[Ray], out: &mut [bool]| {
            level != Level::Scalar
                && at_level!(
                    level,
                    super::packet::any,
                    boxes::x86::any_packet_avx2,
                    boxes::x86::any_packet_avx512,
                    (self, start, rays, leaves, out)
                )
        };
        let crowd = |rays: &[Ray], which: &[u16], octant: usize, out: &mut [bool]| {
            at_level!(
                level,
                super::crowd::any,
                boxes::x86::any_crowd_avx2,
                boxes::x86::any_crowd_avx512,
                (self, start, rays, which, octant, leaves, out)
            );
        };
        let single = |ray: &Ray| self.occluded_part(part, level, ray, leaves);
        in_company(self.sorts_rays(level), packet::SPREAD_OF_SHADOWS, rays, out, packet, crowd, single);
    }

    /// Rays of a batch that are sorted together.
    pub const SORTED: usize = 256;

    /// Whether rays that go anywhere are faster in one call than one by one (measured on x86 only): in a small tree, and in one of moderate size where a ray is
    /// expected to meet few nodes. They are then sorted by where they go, [`Bvh::SORTED`] at a time.
    pub fn sorts_rays(&self, level: Level) -> bool {
        let n = self.nodes.len();
        let suits = n <= SMALL || (n <= MODERATE && self.report.sah_cost <= SHALLOW);
        level != Level::Scalar && n > 0 && suits
    }
}

/// Nodes of a tree at most in which rays go in crowds, whatever its cost.
///
/// Rendering with crowds against without (paths, AVX-512, two Zen 4 cores, CPU time by turns): 1 node 0.86 to 0.90, 2 nodes 0.93, a floor and two spheres 0.92. With
/// AVX2 0.92, 0.93; with SSE 0.70, 0.95.
const SMALL: usize = 8;
/// Expected cost of a ray at most in larger trees.
///
/// In the same way, by expected cost: 1.6 0.98, 0.97 and 1.00 (a million triangles), 2.9 0.98, 3.2 0.99, 3.3 0.94, 3.5 0.99, 4.1 1.06, 6.0 0.97, 7.4 1.03.
const SHALLOW: f64 = 4.0;
/// Nodes of such trees at most: crowds see more of a large tree than single rays do, each for itself.
///
/// Rates in batches relative to single rays on two Granite Rapids cores shared with others, one displaced sphere on a floor (expected cost 1.7 to 2.2), by nodes, with crowds:
/// first bounces 3 1.66, 26 1.35, 60 1.25, 174 1.09, 334 1.04, 983 0.95, 3,379 0.88, 20,000 0.85; second bounces 1.15, 0.98, 0.94, 0.83, 0.91, 0.92, 0.84, 0.82; shadow rays
/// 1.33, 1.23, 1.35, 1.24, 1.16, 0.99, 0.98, 0.96. Without: bounces 0.95 to 0.98. Pictures with 256 instead of no bound: a million triangles (20,000 nodes) 0.97 of the time,
/// an interior (990) 1.05.
const MODERATE: usize = 1024;
/// Crowds of fewer rays are not worth it.
const LEAST: usize = 4;

/// Tries packets, of rays whose directions do not differ by more than a `spread`. Others go in crowds of one octant, where those suit the tree; else halves of
/// packets are tried, and the rest goes alone.
#[inline(always)]
fn in_company<T>(
    crowds: bool,
    spread: f32,
    rays: &[Ray],
    out: &mut [T],
    mut travel: impl FnMut(&[Ray], &mut [T]) -> bool,
    mut crowd: impl FnMut(&[Ray], &[u16], usize, &mut [T]),
    single: impl Fn(&Ray) -> T,
) {
    for (rays, out) in rays.chunks(Bvh::SORTED).zip(out.chunks_mut(Bvh::SORTED)) {
        let (mut left, mut n) = ([0; Bvh::SORTED], 0);
        for (first, (rays, out)) in (0..).step_by(PACKET).zip(rays.chunks(PACKET).zip(out.chunks_mut(PACKET))) {
            if packet::may_go_the_same_way(rays, spread) && travel(rays, out) {
                continue;
            }
            if crowds {
                for i in first..first + rays.len() {
                    left[n] = i as u16;
                    n += 1;
                }
                continue;
            }
            for (rays, out) in rays.chunks(PACKET / 2).zip(out.chunks_mut(PACKET / 2)) {
                if !(packet::may_go_the_same_way(rays, spread) && travel(rays, out)) {
                    for (ray, out) in rays.iter().zip(out) {
                        *out = single(ray);
                    }
                }
            }
        }
        if n < LEAST {
            left[..n].iter().for_each(|&i| out[i as usize] = single(&rays[i as usize]));
        } else {
            in_crowds(rays, &left[..n], out, &mut crowd, &single);
        }
    }
}

/// The rays of `which`, sorted by where they go.
#[inline(always)]
fn in_crowds<T>(
    rays: &[Ray],
    which: &[u16],
    out: &mut [T],
    crowd: &mut impl FnMut(&[Ray], &[u16], usize, &mut [T]),
    single: &impl Fn(&Ray) -> T,
) {
    let (mut kinds, mut places) = ([0; Bvh::SORTED], [0; crowd::KINDS + 1]);
    for (kind, &i) in kinds.iter_mut().zip(which) {
        *kind = crowd::kind(&rays[i as usize]);
        places[*kind + 1] += 1;
    }
    for kind in 0..crowd::KINDS {
        places[kind + 1] += places[kind];
    }
    let mut sorted = [0; Bvh::SORTED];
    for (&kind, &i) in kinds.iter().zip(which) {
        sorted[places[kind]] = i;
        places[kind] += 1;
    }
    let mut begin = 0;
    for octant in 0..crowd::OCTANTS {
        let end = places[crowd::last_kind_of(octant)];
        for which in sorted[begin..end].chunks(PACKET) {
            if which.len() >= LEAST {
                crowd(rays, which, octant, out);
            } else {
                which.iter().for_each(|&i| out[i as usize] = single(&rays[i as usize]));
            }
        }
        begin = end;
    }
    sorted[begin..which.len()].iter().for_each(|&i| out[i as usize] = single(&rays[i as usize]));
}
