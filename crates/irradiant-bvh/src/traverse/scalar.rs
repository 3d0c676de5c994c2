//! The specification: one child and one triangle at a time, in plain Rust.

use super::{Best, PADDING, is_proper};
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
/// misses that box, and it is not nearer than the box.
#[inline(always)]
pub(super) fn within_own_box(t: f32, vertices: &[[f32; 3]; 3], ray: &Ray) -> Option<f32> {
    let [a, b, c] = vertices;
    let mut planes = [0.0; 6];
    for axis in 0..3 {
        let (a, b, c) = (a[axis], b[axis], c[axis]);
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        planes[2 * axis] = if c < low { c } else { low };
        planes[2 * axis + 1] = if c > high { c } else { high };
    }
    let near = enter_box(&planes, ray, f32::INFINITY)?;
    Some(if near > t { near } else { t })
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

pub(super) fn closest<L: Leaves>(bvh: &Bvh, ray: &Ray, leaves: &L) -> Option<Closest<L::UserHit>> {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return None;
    }
    let shear = Shear::new(ray);
    let mut best = Best::new(ray.t_max);
    let mut stack = [(0.0, Child(0)); crate::node::STACK];
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

pub(super) fn any<L: Leaves>(bvh: &Bvh, ray: &Ray, leaves: &L) -> bool {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return false;
    }
    let shear = Shear::new(ray);
    let mut stack = [Child(0); crate::node::STACK];
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
