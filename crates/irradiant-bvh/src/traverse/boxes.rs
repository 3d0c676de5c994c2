//! Eight boxes at once.

use super::PADDING;
use crate::lanes::{Eight, Four, Twice};
use crate::node::{Node, WIDTH};
use crate::ray::Ray;

/// Entry distances, aligned for whole-register stores.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Near(pub [f32; WIDTH]);

/// What `plane * inverse - origin * inverse` may lose against `(plane - origin) * inverse`, as a share of its second product:
/// two roundings of it, twice over; or three and more, where lanes have no fused operation.
pub(super) const FUSED_LOST: f32 = 1.0 / (1 << 22) as f32;
/// Where reciprocals and products with the origin are below, nothing overflows in the fused form.
pub(super) const FUSED_LIMIT: f32 = 1e30;

/// A ray prepared for testing boxes.
pub(crate) trait BoxTest: Copy {
    /// Lanes for triangles.
    type Eight: Eight;
    fn new(ray: &Ray) -> Self;
    /// Bit `i` says that the ray enters child `i` before `far`; then `near[i]` says where.
    fn enter(&self, node: &Node, far: f32) -> (u32, Near);
}

/// Reciprocals of the direction, and for each axis the index of the plane that the ray meets first.
#[inline(always)]
fn reciprocal(ray: &Ray) -> ([f32; 3], [usize; 3]) {
    let inverse = ray.d.map(|d| 1.0 / d);
    let side = |a: usize| 2 * a + (inverse[a].to_bits() >> 31) as usize;
    (inverse, [side(0), side(1), side(2)])
}

/// Two halves of four.
#[derive(Clone, Copy)]
pub(crate) struct Halves<F> {
    origin: [F; 3],
    inverse: [F; 3],
    padded: [F; 3],
    first: [usize; 3],
}

impl<F: Four> BoxTest for Halves<F> {
    type Eight = Twice<F>;

    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (inverse, first) = reciprocal(ray);
        Self {
            origin: ray.o.map(F::splat),
            inverse: inverse.map(F::splat),
            padded: inverse.map(|i| F::splat(i * PADDING)),
            first,
        }
    }

    #[inline(always)]
    fn enter(&self, node: &Node, far: f32) -> (u32, Near) {
        let half = |h: usize| {
            let plane = |p: usize| {
                let (halves, _) = node.planes[p].as_chunks::<4>();
                F::load(&halves[h])
            };
            let (mut near, mut far) = (F::splat(0.0), F::splat(far * PADDING));
            for axis in 0..3 {
                let p = self.first[axis];
                near = ((plane(p) - self.origin[axis]) * self.inverse[axis]).max(near);
                far = ((plane(p ^ 1) - self.origin[axis]) * self.padded[axis]).min(far);
            }
            (near.le(far).mask(), near.to_array())
        };
        let ((low, [a, b, c, d]), (high, [e, f, g, h])) = (half(0), half(1));
        (low | high << 4, Near([a, b, c, d, e, f, g, h]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use core::arch::x86_64::*;

    use super::*;
    use crate::lanes::{Avx, Avx512, Lanes, Pair, Sse};
    use crate::level::Level;
    use crate::node::{Bvh, Child};
    use crate::ray::{Closest, Leaves};
    use crate::traverse::{WIDER, crowd, packet, walk};

    /// One 256-bit register. Made only by the entry points below, on machines with AVX2.
    #[derive(Clone, Copy)]
    pub(crate) struct Whole {
        origin: [__m256; 3],
        inverse: [__m256; 3],
        padded: [__m256; 3],
        first: [usize; 3],
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn prepare(ray: &Ray) -> Whole {
        let (inverse, first) = reciprocal(ray);
        let splat = |a: f32| _mm256_set1_ps(a);
        Whole {
            origin: ray.o.map(splat),
            inverse: inverse.map(splat),
            padded: inverse.map(|i| splat(i * PADDING)),
            first,
        }
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn enter(w: &Whole, node: &Node, far: f32) -> (u32, Near) {
        #[allow(unsafe_code)]
        // SAFETY: each plane is eight floats, read unaligned. Guard: `all_levels_agree_with_brute_force`.
        let plane = |p: usize| unsafe { _mm256_loadu_ps(node.planes[p].as_ptr()) };
        let distance =
            |p: usize, a: usize, scale: &[__m256; 3]| _mm256_mul_ps(_mm256_sub_ps(plane(p), w.origin[a]), scale[a]);
        let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(far * PADDING));
        for axis in 0..3 {
            let p = w.first[axis];
            // The second operand is what comes back if the first is NaN.
            near = _mm256_max_ps(distance(p, axis, &w.inverse), near);
            far = _mm256_min_ps(distance(p ^ 1, axis, &w.padded), far);
        }
        let inside = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
        let mut out = Near([0.0; WIDTH]);
        #[allow(unsafe_code)]
        // SAFETY: `Near` is eight floats, aligned to 32. Guard: as above.
        unsafe {
            _mm256_store_ps(out.0.as_mut_ptr(), near);
        }
        (_mm256_movemask_ps(inside) as u32, out)
    }

    impl BoxTest for Whole {
        type Eight = Avx;

        #[inline(always)]
        #[allow(unsafe_code)]
        fn new(ray: &Ray) -> Self {
            // SAFETY: only the entry points below instantiate the walk with `Whole`, and they check for AVX2.
            // Guard: `levels_beyond_the_machine_fall_back`.
            unsafe { prepare(ray) }
        }

        #[inline(always)]
        #[allow(unsafe_code)]
        fn enter(&self, node: &Node, far: f32) -> (u32, Near) {
            // SAFETY: as in `new`.
            unsafe { enter(self, node, far) }
        }
    }

    /// One register and fused arithmetic: `plane * inverse - origin * inverse` in one operation each way. What the
    /// product with the origin loses, which may be large against a short distance, is taken off where a box is entered
    /// and added where it is left, so that no box is missed; only which boxes are looked at depends on it.
    #[derive(Clone, Copy)]
    pub(crate) struct Fused {
        inverse: [__m256; 3],
        entering: [__m256; 3],
        padded: [__m256; 3],
        leaving: [__m256; 3],
        first: [usize; 3],
    }

    impl Fused {
        /// Whether the ray is proper and nothing overflows: every other ray takes [`Whole`].
        #[inline(always)]
        pub(crate) fn suits(ray: &Ray) -> bool {
            let (o, d) = ray.lanes::<Sse>();
            let (inverse, limit) = (Sse::splat(1.0) / d, Sse::splat(FUSED_LIMIT));
            let size = inverse.abs();
            // Of the three axes; NaN fails. A reciprocal that is finite and not zero is that of a proper direction, and a
            // finite product with it that of a finite origin.
            let sound = Sse::splat(0.0).lt(size) & size.lt(limit) & (o * inverse).abs().lt(limit);
            sound.mask() & 7 == 7 && ray.t_max > 0.0
        }
    }

    /// All three axes together as far as it goes; one by one it took 30 to 50 instructions more a ray.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn prepare_fused(ray: &Ray) -> Fused {
        let (o, d) = ray.lanes::<Sse>();
        let inverse = Sse::splat(1.0) / d;
        let padded = inverse * Sse::splat(WIDER);
        let (product, padded_product, lost) = (o * inverse, o * padded, Sse::splat(FUSED_LOST));
        let entering = product.abs() * Sse::splat(-FUSED_LOST) - product;
        let leaving = padded_product.abs() * lost - padded_product;
        let splat = |v: Sse| {
            let [x, y, z, _] = v.to_array();
            [_mm256_set1_ps(x), _mm256_set1_ps(y), _mm256_set1_ps(z)]
        };
        let signs = inverse.mask() as usize;
        let side = |k: usize| 2 * k + (signs >> k & 1);
        Fused {
            inverse: splat(inverse),
            entering: splat(entering),
            padded: splat(padded),
            leaving: splat(leaving),
            first: [side(0), side(1), side(2)],
        }
    }

    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn enter_fused(w: &Fused, node: &Node, far: f32) -> (u32, Near) {
        #[allow(unsafe_code)]
        // SAFETY: each plane is eight floats, read unaligned. Guard: `all_levels_agree_with_brute_force`.
        let plane = |p: usize| unsafe { _mm256_loadu_ps(node.planes[p].as_ptr()) };
        let enters = |k: usize| _mm256_fmadd_ps(plane(w.first[k]), w.inverse[k], w.entering[k]);
        let leaves = |k: usize| _mm256_fmadd_ps(plane(w.first[k] ^ 1), w.padded[k], w.leaving[k]);
        let near = _mm256_max_ps(_mm256_max_ps(enters(0), enters(1)), _mm256_max_ps(enters(2), _mm256_setzero_ps()));
        let far =
            _mm256_min_ps(_mm256_min_ps(leaves(0), leaves(1)), _mm256_min_ps(leaves(2), _mm256_set1_ps(far * PADDING)));
        let inside = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
        let mut out = Near([0.0; WIDTH]);
        #[allow(unsafe_code)]
        // SAFETY: `Near` is eight floats, aligned to 32. Guard: as above.
        unsafe {
            _mm256_store_ps(out.0.as_mut_ptr(), near);
        }
        (_mm256_movemask_ps(inside) as u32, out)
    }

    impl BoxTest for Fused {
        type Eight = Avx;

        #[inline(always)]
        #[allow(unsafe_code)]
        fn new(ray: &Ray) -> Self {
            // SAFETY: only the entry points below instantiate the walk with `Fused`, and they check for AVX2 and FMA.
            // Guard: `levels_beyond_the_machine_fall_back`.
            unsafe { prepare_fused(ray) }
        }

        #[inline(always)]
        #[allow(unsafe_code)]
        fn enter(&self, node: &Node, far: f32) -> (u32, Near) {
            // SAFETY: as in `new`.
            unsafe { enter_fused(self, node, far) }
        }
    }

    /// A function compiled for a set of features, behind a check that the machine has them.
    macro_rules! entry_point {
        ($level:expr, $features:literal, fn $name:ident<L>($($argument:ident: $type:ty),* $(,)?) -> $out:ty $body:block) => {
            #[inline]
            #[allow(unsafe_code)]
            pub(crate) fn $name<L: Leaves>($($argument: $type),*) -> $out {
                #[target_feature(enable = $features)]
                fn compiled<L: Leaves>($($argument: $type),*) -> $out $body
                assert!($level <= Level::detect());
                // SAFETY: the machine has the features. Guard: `levels_beyond_the_machine_fall_back`.
                unsafe { compiled($($argument),*) }
            }
        };
    }

    /// The walks compiled for one set of features, behind a check that the machine has them. Rays go in as eight numbers, in
    /// registers: reading four at once from memory, just after they were written one by one, has to wait for the writes.
    macro_rules! entry_points {
        ($closest:ident, $any:ident, $closest_packet:ident, $any_packet:ident, $closest_crowd:ident, $any_crowd:ident, $wide:ty, $level:expr, $features:literal) => {
            #[inline]
            #[allow(unsafe_code)]
            pub(crate) fn $closest<L: Leaves>(
                bvh: &Bvh,
                start: Child,
                ray: &Ray,
                leaves: &L,
            ) -> Option<Closest<L::UserHit>> {
                #[target_feature(enable = $features)]
                fn compiled<L: Leaves>(
                    bvh: &Bvh,
                    start: Child,
                    ox: f32,
                    oy: f32,
                    oz: f32,
                    t_max: f32,
                    dx: f32,
                    dy: f32,
                    dz: f32,
                    time: f32,
                    leaves: &L,
                ) -> Option<Closest<L::UserHit>> {
                    let ray = &Ray { o: [ox, oy, oz], t_max, d: [dx, dy, dz], time };
                    if Fused::suits(ray) {
                        walk::closest_of_proper::<Fused, L>(bvh, start, ray, leaves)
                    } else {
                        walk::closest::<Whole, L>(bvh, start, ray, leaves)
                    }
                }
                assert!($level <= Level::detect());
                let &Ray { o: [ox, oy, oz], t_max, d: [dx, dy, dz], time } = ray;
                // SAFETY: the machine has the features. Guard: `levels_beyond_the_machine_fall_back`.
                unsafe { compiled(bvh, start, ox, oy, oz, t_max, dx, dy, dz, time, leaves) }
            }

            #[inline]
            #[allow(unsafe_code)]
            pub(crate) fn $any<L: Leaves>(bvh: &Bvh, start: Child, ray: &Ray, leaves: &L) -> bool {
                #[target_feature(enable = $features)]
                fn compiled<L: Leaves>(
                    bvh: &Bvh,
                    start: Child,
                    ox: f32,
                    oy: f32,
                    oz: f32,
                    t_max: f32,
                    dx: f32,
                    dy: f32,
                    dz: f32,
                    time: f32,
                    leaves: &L,
                ) -> bool {
                    let ray = &Ray { o: [ox, oy, oz], t_max, d: [dx, dy, dz], time };
                    if Fused::suits(ray) {
                        walk::any_of_proper::<Fused, L>(bvh, start, ray, leaves)
                    } else {
                        walk::any::<Whole, L>(bvh, start, ray, leaves)
                    }
                }
                assert!($level <= Level::detect());
                let &Ray { o: [ox, oy, oz], t_max, d: [dx, dy, dz], time } = ray;
                // SAFETY: as above.
                unsafe { compiled(bvh, start, ox, oy, oz, t_max, dx, dy, dz, time, leaves) }
            }

            entry_point!(
                $level,
                $features,
                fn $closest_packet<L>(
                    bvh: &Bvh,
                    start: Child,
                    rays: &[Ray],
                    leaves: &L,
                    out: &mut [Option<Closest<L::UserHit>>],
                ) -> bool {
                    packet::closest::<$wide, Fused, L>(bvh, start, rays, leaves, out)
                }
            );
            entry_point!(
                $level,
                $features,
                fn $any_packet<L>(bvh: &Bvh, start: Child, rays: &[Ray], leaves: &L, out: &mut [bool]) -> bool {
                    packet::any::<$wide, Fused, L>(bvh, start, rays, leaves, out)
                }
            );
            entry_point!(
                $level,
                $features,
                fn $closest_crowd<L>(
                    bvh: &Bvh,
                    start: Child,
                    rays: &[Ray],
                    which: &[u16],
                    octant: usize,
                    leaves: &L,
                    out: &mut [Option<Closest<L::UserHit>>],
                ) -> () {
                    crowd::closest::<$wide, Fused, L>(bvh, start, rays, which, octant, leaves, out)
                }
            );
            entry_point!(
                $level,
                $features,
                fn $any_crowd<L>(
                    bvh: &Bvh,
                    start: Child,
                    rays: &[Ray],
                    which: &[u16],
                    octant: usize,
                    leaves: &L,
                    out: &mut [bool],
                ) -> () {
                    crowd::any::<$wide, Fused, L>(bvh, start, rays, which, octant, leaves, out)
                }
            );
        };
    }

    entry_points!(
        closest_avx2,
        any_avx2,
        closest_packet_avx2,
        any_packet_avx2,
        closest_crowd_avx2,
        any_crowd_avx2,
        Pair<Avx>,
        Level::Avx2,
        "avx2,fma,bmi1,bmi2,lzcnt,popcnt"
    );
    entry_points!(
        closest_avx512,
        any_avx512,
        closest_packet_avx512,
        any_packet_avx512,
        closest_crowd_avx512,
        any_crowd_avx512,
        Avx512,
        Level::Avx512,
        "avx512f,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
    );
}
