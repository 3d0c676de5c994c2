//! Ray against triangle, watertight.
//!
//! Woop, Benthin, Wald 2013 (JCGT 2(1)): translate and shear so that the ray is the z axis, then look at the signs of
//! three 2D edge functions. An edge shared by two triangles gives both the same number up to sign, so no ray slips
//! between. Where a single-precision edge function is zero, tiny or overflows, the triangle is done again in `f64`,
//! whose products of two `f32` are exact. Rounding is monotonic, so the single-precision sign, when not zero, is right:
//! the two ways never disagree about a side.
//!
//! A hit must be farther than the error bound of its own `t` (Pharr et al. 2023, section 6.8.4), so a ray leaving a
//! surface does not meet it again because of rounding alone. We take differences of plain products where they fuse.

use crate::lanes::{Eight, Lanes, Native};
use crate::node::Block;
use crate::ray::Ray;

/// `f32` rounding unit.
const UNIT: f64 = 1.0 / (1u64 << 24) as f64;

/// Error factor of `n` roundings (Higham 2002, lemma 3.1).
const fn gamma(n: i32) -> f32 {
    ((n as f64 * UNIT) / (1.0 - n as f64 * UNIT)) as f32
}

const GAMMA_2: f32 = gamma(2);
const GAMMA_3: f32 = gamma(3);
const GAMMA_5: f32 = gamma(5);

/// Edge functions outside this range are evaluated again in `f64`: below, products lose bits; above, they overflow.
const SMALLEST_EDGE: f32 = 1.0 / (1u128 << 100) as f32;
const LARGEST_EDGE: f32 = (1u128 << 100) as f32;

/// The shear that turns a ray into the z axis; the same for every triangle it meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    /// The axes called x, y, z below; z is the one along which the ray moves fastest.
    pub axes: [usize; 3],
    /// The ray's origin along those.
    pub origin: [f32; 3],
    /// Shears of x and y, scale of z.
    pub shear: [f32; 3],
}

impl Shear {
    /// The axes of a ray's shear.
    #[inline(always)]
    pub fn axes(ray: &Ray) -> [usize; 3] {
        let [x, y, z] = ray.d.map(f32::abs);
        if x > y && x > z {
            [1, 2, 0]
        } else if y > z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        }
    }

    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        // Written out for each order of axes, so that no index is looked up and no function is called.
        let (o, d) = (&ray.o, &ray.d);
        // The division that box tests do too.
        let [x, y, z, _] = (Native::splat(1.0) / ray.lanes::<Native>().1).to_array();
        match Self::axes(ray) {
            axes @ [1, 2, 0] => Self::along(axes, [o[1], o[2], o[0]], [d[1], d[2], d[0]], x),
            axes @ [2, 0, 1] => Self::along(axes, [o[2], o[0], o[1]], [d[2], d[0], d[1]], y),
            axes => Self::along(axes, *o, *d, z),
        }
    }

    /// From an origin and a direction along these axes, and the reciprocal of the last.
    #[inline(always)]
    fn along(axes: [usize; 3], origin: [f32; 3], [dx, dy, dz]: [f32; 3], scale: f32) -> Self {
        Self { axes, origin, shear: [-dx / dz, -dy / dz, scale] }
    }
}

/// A candidate hit: `t`, and the weights of vertices 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

/// The specification: the hit of `vertices` with `t` beyond its error bound, whatever its upper end.
///
/// The lanes of `intersect_sheared` do the same operations in the same order.
#[inline]
pub(crate) fn intersect(vertices: &[[f32; 3]; 3], shear: &Shear) -> Option<Candidate> {
    let [kx, ky, kz] = shear.axes;
    let [ox, oy, oz] = shear.origin;
    let [sx, sy, sz] = shear.shear;
    let sheared = vertices.map(|p| {
        let z = p[kz] - oz;
        [(p[kx] - ox) + sx * z, (p[ky] - oy) + sy * z, z]
    });
    let [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]] = sheared;
    let e0 = x1 * y2 - y1 * x2;
    let e1 = x2 * y0 - y2 * x0;
    let e2 = x0 * y1 - y0 * x1;
    let any = |f: fn(&f32) -> bool| [e0, e1, e2].iter().any(f);
    if any(|&e| e < 0.0) && any(|&e| e > 0.0) {
        return None;
    }
    if !any(|&e| e.abs() < SMALLEST_EDGE) && [e0, e1, e2].iter().all(|&e| e.abs() <= LARGEST_EDGE) {
        let (z0, z1, z2) = (z0 * sz, z1 * sz, z2 * sz);
        let inverse = 1.0 / ((e0 + e1) + e2);
        let t = ((e0 * z0 + e1 * z1) + e2 * z2) * inverse;
        let max_x = x0.abs().max(x1.abs()).max(x2.abs());
        let max_y = y0.abs().max(y1.abs()).max(y2.abs());
        let max_z = z0.abs().max(z1.abs()).max(z2.abs());
        let max_e = e0.abs().max(e1.abs()).max(e2.abs());
        let delta_x = GAMMA_5 * (max_x + max_z);
        let delta_y = GAMMA_5 * (max_y + max_z);
        let delta_z = GAMMA_3 * max_z;
        let delta_e = 2.0 * ((GAMMA_2 * max_x * max_y + delta_y * max_x) + delta_x * max_y);
        let delta_t = 3.0 * ((GAMMA_3 * max_e * max_z + delta_e * max_z) + delta_z * max_e) * inverse.abs();
        return (t > delta_t).then_some(Candidate { t, u: e1 * inverse, v: e2 * inverse });
    }
    intersect_in_double(&sheared, sz)
}

/// The same in `f64` from the sheared vertices on; zero edge functions count as inside.
#[cold]
#[inline(never)]
fn intersect_in_double(sheared: &[[f32; 3]; 3], sz: f32) -> Option<Candidate> {
    let [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]] = sheared.map(|p| p.map(f64::from));
    let e = [x1 * y2 - y1 * x2, x2 * y0 - y2 * x0, x0 * y1 - y0 * x1];
    if e.iter().any(|&e| e < 0.0) && e.iter().any(|&e| e > 0.0) {
        return None;
    }
    let det = (e[0] + e[1]) + e[2];
    if det == 0.0 {
        return None;
    }
    let [z0, z1, z2] = [z0, z1, z2].map(|z| z * f64::from(sz));
    let inverse = 1.0 / det;
    let t = ((e[0] * z0 + e[1] * z1) + e[2] * z2) * inverse;
    let max = |a: f64, b: f64, c: f64| a.abs().max(b.abs()).max(c.abs());
    let (max_x, max_y, max_z, max_e) = (max(x0, x1, x2), max(y0, y1, y2), max(z0, z1, z2), max(e[0], e[1], e[2]));
    // The sheared vertices still carry single-precision errors; the rest is exact by comparison, but the bound is kept
    // as it is so that a triangle does not become closer to the origin by being met on an edge.
    let g = |n| f64::from(gamma(n));
    let (delta_x, delta_y, delta_z) = (g(5) * (max_x + max_z), g(5) * (max_y + max_z), g(3) * max_z);
    let delta_e = 2.0 * (g(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
    let delta_t = 3.0 * (g(3) * max_e * max_z + delta_e * max_z + delta_z * max_e) * inverse.abs();
    (t > delta_t).then_some(Candidate { t: t as f32, u: (e[1] * inverse) as f32, v: (e[2] * inverse) as f32 })
}

/// Candidates among lanes: bit `i` of `mask` says whether lane `i` is one.
///
/// Lanes and not arrays: a copy of an array that was just written lane by lane waits until all of it is in the cache.
#[derive(Clone, Copy)]
pub(crate) struct Candidates<F> {
    pub mask: u32,
    pub t: F,
    pub u: F,
    pub v: F,
}

impl<F: Lanes> Candidates<F> {
    /// To be looked at one by one.
    #[inline(always)]
    pub fn spread(&self) -> Spread<F::Array> {
        Spread { t: self.t.to_array(), u: self.u.to_array(), v: self.v.to_array() }
    }

    /// With `hit` in a lane.
    fn with(&self, lane: usize, hit: Candidate) -> Self {
        let mut all = self.spread();
        (all.t[lane], all.u[lane], all.v[lane]) = (hit.t, hit.u, hit.v);
        Self { mask: self.mask | 1 << lane, t: F::load(&all.t), u: F::load(&all.u), v: F::load(&all.v) }
    }

    /// With what [`intersect`] finds with `t <= t_far` in some `lanes`, given the vertices, shear and `t_far` there.
    #[cold]
    #[inline(never)]
    pub fn again_in_double(mut self, mut lanes: u32, of: impl Fn(usize) -> ([[f32; 3]; 3], Shear, f32)) -> Self {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let (vertices, shear, t_far) = of(lane);
            if let Some(hit) = intersect(&vertices, &shear).filter(|hit| hit.t <= t_far) {
                self = self.with(lane, hit);
            }
        }
        self
    }
}

/// [`Candidates`] in arrays.
pub(crate) struct Spread<A> {
    t: A,
    u: A,
    v: A,
}

impl<A: std::ops::Index<usize, Output = f32>> Spread<A> {
    /// That of a lane.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Candidate {
        Candidate { t: self.t[lane], u: self.u[lane], v: self.v[lane] }
    }
}

/// The triangles of a block at once: the candidates with `t <= t_far`, bit for bit those of [`intersect`]; `None` if
/// there are none, or else perhaps. Each vertex is sheared once.
#[inline(always)]
pub(crate) fn intersect_block<E: Eight>(block: &Block, shear: &Shear, t_far: f32) -> Option<Candidates<E>> {
    let [kx, ky, kz] = shear.axes;
    let [ox, oy, oz] = [E::splat(shear.origin[0]), E::splat(shear.origin[1]), E::splat(shear.origin[2])];
    let [sx, sy, sz] = [E::splat(shear.shear[0]), E::splat(shear.shear[1]), E::splat(shear.shear[2])];
    let z = E::load(&block.vertices[kz]) - oz;
    let x = (E::load(&block.vertices[kx]) - ox) + sx * z;
    let y = (E::load(&block.vertices[ky]) - oy) + sy * z;
    let (mut found, strange) = intersect_sheared(E::choose([x, y, z], block.corners), sz, E::splat(t_far), E::ALL)?;
    if strange != 0 {
        found = found.again_in_double(strange, |lane| (block.triangle(lane), *shear, t_far));
    }
    Some(found)
}

/// One triangle or one ray in each lane; `vertices` and `origin` along the axes of the [`Shear`]. Candidates with
/// `t <= t_far` among `lanes`, bit for bit those of [`intersect`], and a mask of lanes that must be asked with that one.
#[inline(always)]
pub(crate) fn intersect_lanes<F: Lanes>(
    vertices: [[F; 3]; 3],
    [ox, oy, oz]: [F; 3],
    [sx, sy, sz]: [F; 3],
    t_far: F,
    lanes: u32,
) -> Option<(Candidates<F>, u32)> {
    let [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]] = vertices;
    let (z0, z1, z2) = (z0 - oz, z1 - oz, z2 - oz);
    let (x0, x1, x2) = ((x0 - ox) + sx * z0, (x1 - ox) + sx * z1, (x2 - ox) + sx * z2);
    let (y0, y1, y2) = ((y0 - oy) + sy * z0, (y1 - oy) + sy * z1, (y2 - oy) + sy * z2);
    intersect_sheared([[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]], sz, t_far, lanes)
}

/// The same from the sheared vertices on.
#[inline(always)]
fn intersect_sheared<F: Lanes>(
    [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]]: [[F; 3]; 3],
    sz: F,
    t_far: F,
    lanes: u32,
) -> Option<(Candidates<F>, u32)> {
    let e0 = x1 * y2 - y1 * x2;
    let e1 = x2 * y0 - y2 * x0;
    let e2 = x0 * y1 - y0 * x1;
    // A NaN edge is passed over here (the signs of the others are right) or leaves the lane a candidate.
    let zero = F::splat(0.0);
    let lowest = e0.min(e1).min(e2);
    let highest = e0.max(e1).max(e2);
    let mut inside = !(lowest.lt(zero) & zero.lt(highest)).mask() & lanes;
    if inside == 0 {
        return None;
    }
    let (a0, a1, a2) = (e0.abs(), e1.abs(), e2.abs());
    let far = F::splat(LARGEST_EDGE);
    let near = F::splat(SMALLEST_EDGE);
    let sound = ((a0.le(far) & a1.le(far)) & (a2.le(far) & near.le(a0))) & (near.le(a1) & near.le(a2));
    let strange = inside & !sound.mask();
    inside &= sound.mask();

    let (z0, z1, z2) = (z0 * sz, z1 * sz, z2 * sz);
    let inverse = F::splat(1.0) / ((e0 + e1) + e2);
    let t = ((e0 * z0 + e1 * z1) + e2 * z2) * inverse;
    inside &= (t.le(t_far) & zero.lt(t)).mask();
    if inside | strange == 0 {
        return None;
    }
    let max_x = x0.abs().max(x1.abs()).max(x2.abs());
    let max_y = y0.abs().max(y1.abs()).max(y2.abs());
    let max_z = z0.abs().max(z1.abs()).max(z2.abs());
    let max_e = a0.max(a1).max(a2);
    let [g2, g3, g5] = [F::splat(GAMMA_2), F::splat(GAMMA_3), F::splat(GAMMA_5)];
    let delta_x = g5 * (max_x + max_z);
    let delta_y = g5 * (max_y + max_z);
    let delta_z = g3 * max_z;
    let delta_e = F::splat(2.0) * ((g2 * max_x * max_y + delta_y * max_x) + delta_x * max_y);
    let delta_t = F::splat(3.0) * ((g3 * max_e * max_z + delta_e * max_z) + delta_z * max_e) * inverse.abs();
    inside &= delta_t.lt(t).mask();
    Some((Candidates { mask: inside, t, u: e1 * inverse, v: e2 * inverse }, strange))
}
