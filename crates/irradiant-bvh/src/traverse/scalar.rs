//! The specification: one child and one triangle at a time, in plain Rust.

use super::{Best, PADDING, is_proper};
use crate::lanes::{Lanes, Native};
use crate::node::{Block, Bvh, Child, LAST_USER, Node, WIDTH};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Shear};

/// Distance at which the ray enters a box, if it does before `far`; `planes` are `[2 axis + side]`.
#[inline(always)]
fn enter_box(planes: &[f32; 6], ray: &Ray, far: f32) -> Option<f32> {
    let (mut near, mut far) = (0.0, far * PADDING);
    for axis in 0..3 {
        let inverse = 1.0 / ray.d[axis];
        let side = usize::from(inverse.is_sign_negative());
        let enters = (planes[2 * axis + side] - ray.o[axis]) * inverse;
        let leaves = (planes[2 * axis + 1 - side] - ray.o[axis]) * (inverse * PADDING);
        // A ray inside a plane (0 times infinity, NaN) is bounded by neither side of that slab.
        near = if enters > near { enters } else { near };
        far = if leaves < far { leaves } else { far };
    }
    (near <= far).then_some(near)
}

/// The same for child `i`.
fn enter(node: &Node, i: usize, ray: &Ray, far: f32) -> Option<f32> {
    enter_box(&node.planes.map(|plane| plane[i]), ray, far)
}

/// What becomes of a candidate with `t` when the triangle's own box is asked, see [`super`]: it does not count if the ray
/// misses that box, and it is not nearer than the box. The operations of [`enter_box`], three axes at a time.
#[inline(always)]
pub(super) fn within_own_box(t: f32, vertices: &[[f32; 3]; 3], ray: &Ray) -> Option<f32> {
    let [a, b, c] = vertices.map(|[x, y, z]| Native::load(&[x, y, z, 0.0]));
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let (o, d) = ray.lanes::<Native>();
    let (inverse, zero) = (Native::splat(1.0) / d, Native::splat(0.0));
    // Of a proper ray no reciprocal is zero or NaN.
    let (forwards, backwards) = (zero.lt(inverse), inverse.lt(zero));
    let first = (low & forwards) | (high & backwards);
    let last = (high & forwards) | (low & backwards);
    let enters = ((first - o) * inverse).to_array();
    let leaves = ((last - o) * (inverse * Native::splat(PADDING))).to_array();
    let (mut near, mut far) = (0.0, f32::INFINITY);
    for axis in 0..3 {
        near = if enters[axis] > near { enters[axis] } else { near };
        far = if leaves[axis] < far { leaves[axis] } else { far };
    }
    (near <= far).then_some(if near > t { near } else { t })
}

#[cfg(test)]
#[test]
fn own_boxes_are_entered_as_others_are() {
    use super::tests::Random;
    let mut random = Random(51);
    let mut entered = 0;
    for _ in 0..200_000 {
        let number = |random: &mut Random| match random.below(8) {
            0 => 0.0,
            1 => -0.0,
            2 => 0.5,
            3 => random.signed() * 1e38,
            4 => random.signed() * 1e-38,
            _ => random.signed(),
        };
        let mut point = || [(); 3].map(|()| number(&mut random));
        let (o, d, vertices) = (point(), point(), [point(), point(), point()]);
        let ray = Ray { o, t_max: f32::INFINITY, d, time: 0.0 };
        if !is_proper(&ray) {
            continue;
        }
        let of = |k: usize, f: fn(f32, f32) -> f32| f(f(vertices[0][k], vertices[1][k]), vertices[2][k]);
        let planes = std::array::from_fn(|p| of(p / 2, if p % 2 == 0 { f32::min } else { f32::max }));
        let expected = enter_box(&planes, &ray, f32::INFINITY).map(|near| near.max(1e-3).to_bits());
        assert_eq!(within_own_box(1e-3, &vertices, &ray).map(f32::to_bits), expected, "{ray:?} {vertices:?}");
        entered += usize::from(expected.is_some());
    }
    assert!(entered > 10_000, "{entered}");
}

/// The children that the ray enters before `far`, farthest first.
fn entered(node: &Node, ray: &Ray, far: f32) -> impl Iterator<Item = (f32, Child)> {
    let mut list = [(f32::INFINITY, Child(u32::MAX)); WIDTH];
    let mut n = 0;
    for i in 0..WIDTH {
        if let Some(near) = enter(node, i, ray, far) {
            list[n] = (near, node.children[i]);
            n += 1;
        }
    }
    list[..n].sort_unstable_by_key(|&(near, child)| std::cmp::Reverse((near.to_bits(), child.0)));
    list.into_iter().take(n)
}

pub(super) fn closest<L: Leaves>(bvh: &Bvh, start: Child, ray: &Ray, leaves: &L) -> Option<Closest<L::UserHit>> {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return None;
    }
    let shear = Shear::new(ray);
    let mut best = Best::new(ray.t_max);
    let mut stack = [(0.0, start); crate::node::STACK];
    let mut n = 1;
    while n > 0 {
        n -= 1;
        let (near, child) = stack[n];
        if near > best.t * PADDING {
            continue;
        }
        let mut index = child.index();
        if !child.is_leaf() {
            for entry in entered(&bvh.nodes[index], ray, best.t) {
                stack[n] = entry;
                n += 1;
            }
        } else if child.is_users() {
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
                let block = &bvh.blocks[index];
                for i in 0..block.count() {
                    if let Some(hit) = triangle::intersect(&block.triangle(i), &shear) {
                        best.offer_triangle(leaves, ray, block.id(i), hit, || block.triangle(i));
                    }
                }
                if block.is_last() {
                    break;
                }
                index += 1;
            }
        }
    }
    best.finish()
}

pub(super) fn any<L: Leaves>(bvh: &Bvh, start: Child, ray: &Ray, leaves: &L) -> bool {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return false;
    }
    let shear = Shear::new(ray);
    let mut stack = [start; crate::node::STACK];
    let mut n = 1;
    while n > 0 {
        n -= 1;
        let child = stack[n];
        let mut index = child.index();
        if !child.is_leaf() {
            for (_, entry) in entered(&bvh.nodes[index], ray, ray.t_max) {
                stack[n] = entry;
                n += 1;
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
                let block = &bvh.blocks[index];
                for i in 0..block.count() {
                    if let Some(hit) = triangle::intersect(&block.triangle(i), &shear)
                        && counts(leaves, ray, block, i, hit)
                    {
                        return true;
                    }
                }
                if block.is_last() {
                    break;
                }
                index += 1;
            }
        }
    }
    false
}

/// Whether a candidate is a hit before the ray's end that the filter lets through.
#[inline(always)]
pub(super) fn counts<L: Leaves>(leaves: &L, ray: &Ray, block: &Block, lane: usize, hit: triangle::Candidate) -> bool {
    if hit.t < ray.t_max
        && let Some(t) = within_own_box(hit.t, &block.triangle(lane), ray)
        && t < ray.t_max
    {
        let id = block.id(lane);
        !L::HAS_FILTER || id & Block::FILTERED == 0 || leaves.accept(id & Block::INDEX, ray, t, hit.u, hit.v)
    } else {
        false
    }
}
