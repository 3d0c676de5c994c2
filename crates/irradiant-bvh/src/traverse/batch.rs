//! Many rays in one call.

#[cfg(target_arch = "x86_64")]
use super::boxes;
use super::boxes::Halves;
use super::packet::{self, PACKET};
#[cfg(target_arch = "x86_64")]
use crate::lanes::Sse;
use crate::lanes::{Pair, Portable, Twice};
use crate::level::Level;
use crate::node::Bvh;
use crate::ray::{Closest, Leaves, Ray};

impl Bvh {
    /// For each ray what [`intersect`](Self::intersect) gives, to the bit; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where each sixteen, and each eight, of `rays` travel together.
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
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        let level = level.min(Level::detect());
        let packet = |rays: &[Ray], out: &mut [Option<Closest<L::UserHit>>]| match level {
            Level::Scalar => false,
            Level::Neon => packet::closest::<Pair<Twice<Portable>>, Halves<Portable>, L>(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Sse => packet::closest::<Pair<Twice<Sse>>, Halves<Sse>, L>(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => boxes::x86::closest_packet_avx2(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => boxes::x86::closest_packet_avx512(self, rays, leaves, out),
            #[cfg(not(target_arch = "x86_64"))]
            Level::Sse | Level::Avx2 | Level::Avx512 => {
                packet::closest::<Pair<Twice<Portable>>, Halves<Portable>, L>(self, rays, leaves, out)
            }
        };
        let single = |ray: &Ray| self.intersect(level, ray, leaves);
        in_packets(rays, out, packet, single);
    }

    /// For each ray what [`occluded`](Self::occluded) says; `out[i]` is the answer for `rays[i]`.
    ///
    /// Any number of rays in any order; fastest where each sixteen, and each eight, of `rays` travel together.
    ///
    /// # Panics
    /// If `rays` and `out` differ in length.
    pub fn occluded_batch<L: Leaves>(&self, level: Level, rays: &[Ray], leaves: &L, out: &mut [bool]) {
        assert_eq!(rays.len(), out.len(), "one answer for each ray");
        let level = level.min(Level::detect());
        let packet = |rays: &[Ray], out: &mut [bool]| match level {
            Level::Scalar => false,
            Level::Neon => packet::any::<Pair<Twice<Portable>>, Halves<Portable>, L>(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Sse => packet::any::<Pair<Twice<Sse>>, Halves<Sse>, L>(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => boxes::x86::any_packet_avx2(self, rays, leaves, out),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => boxes::x86::any_packet_avx512(self, rays, leaves, out),
            #[cfg(not(target_arch = "x86_64"))]
            Level::Sse | Level::Avx2 | Level::Avx512 => {
                packet::any::<Pair<Twice<Portable>>, Halves<Portable>, L>(self, rays, leaves, out)
            }
        };
        let single = |ray: &Ray| self.occluded(level, ray, leaves);
        in_packets(rays, out, packet, single);
    }
}

/// Tries packets, then halves of such, then single rays; `packet` says whether it has answered.
#[inline(always)]
fn in_packets<T>(
    rays: &[Ray],
    out: &mut [T],
    mut packet: impl FnMut(&[Ray], &mut [T]) -> bool,
    single: impl Fn(&Ray) -> T,
) {
    for (rays, out) in rays.chunks(PACKET).zip(out.chunks_mut(PACKET)) {
        if packet(rays, out) {
            continue;
        }
        for (rays, out) in rays.chunks(PACKET / 2).zip(out.chunks_mut(PACKET / 2)) {
            if !packet(rays, out) {
                for (ray, out) in rays.iter().zip(out) {
                    *out = single(ray);
                }
            }
        }
    }
}
