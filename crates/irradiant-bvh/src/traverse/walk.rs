//! The walk through the tree, generic over the box test; inlined whole into one entry point per level.

use std::mem::MaybeUninit;

use super::boxes::BoxTest;
use super::scalar::counts;
use super::{Best, PADDING, is_proper};
use crate::node::{Block, Bvh, Child, LAST_USER, STACK};
use crate::ray::{Closest, Leaves, Ray};
use crate::triangle::{self, Candidate, Shear};

/// A stack of children still to visit. The builder guarantees that [`STACK`] entries are enough.
struct Stack<T> {
    entries: [MaybeUninit<T>; STACK],
    n: usize,
}

impl<T: Copy> Stack<T> {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; STACK], n: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: T) {
        self.entries[self.n] = MaybeUninit::new(entry);
        self.n += 1;
    }

    #[inline(always)]
    #[allow(unsafe_code)]
    fn pop(&mut self) -> Option<T> {
        self.n = self.n.checked_sub(1)?;
        // SAFETY: entries below `n` were written by `push`, the only way to raise `n`; `sort_top` exchanges written
        // ones. Guard: `all_levels_agree_with_brute_force` under any sanitizer, and every other test of traversal.
        Some(unsafe { self.entries[self.n].assume_init() })
    }
}

impl Stack<u64> {
    /// Sorts the entries from `base` up, greatest first.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn sort_top(&mut self, base: usize) {
        // SAFETY: as in `pop`; `base <= i < n`.
        let key = |e: &MaybeUninit<u64>| unsafe { e.assume_init() };
        for i in base + 1..self.n {
            let entry = self.entries[i];
            let mut j = i;
            while j > base && key(&self.entries[j - 1]) < key(&entry) {
                self.entries[j] = self.entries[j - 1];
                j -= 1;
            }
            self.entries[j] = entry;
        }
    }
}

/// Orders by entry distance (not negative, so its bits sort like it), then by reference.
#[inline(always)]
fn key(near: f32, child: Child) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child.0)
}

#[inline(always)]
pub(super) fn closest<B: BoxTest, L: Leaves>(bvh: &Bvh, ray: &Ray, leaves: &L) -> Option<Closest<L::UserHit>> {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return None;
    }
    let boxes = B::new(ray);
    let shear = Shear::new(ray);
    let mut best = Best::new(ray.t_max);
    let mut stack = Stack::new();
    let mut child = Child(0);
    loop {
        // Down to a leaf.
        while !child.is_leaf() {
            let node = &bvh.nodes[child.index()];
            let (mut mask, near) = boxes.enter(node, best.t);
            if mask == 0 {
                match next(&mut stack, best.t) {
                    Some(c) => child = c,
                    None => return best.finish(),
                }
                continue;
            }
            let first = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            child = node.children[first];
            if mask == 0 {
                continue;
            }
            let a = key(near.0[first], child);
            let second = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let b = key(near.0[second], node.children[second]);
            if mask == 0 {
                child = Child(a.min(b) as u32);
                stack.push(a.max(b));
                continue;
            }
            let base = stack.n;
            stack.push(a.max(b));
            stack.push(a.min(b));
            while mask != 0 {
                let i = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                stack.push(key(near.0[i], node.children[i]));
            }
            stack.sort_top(base);
            if let Some(top) = stack.pop() {
                child = Child(top as u32);
            }
        }
        // Through the leaf.
        let mut index = child.index();
        if child.is_users() {
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
                let block: &Block = &bvh.blocks[index];
                let mut hits = triangle::intersect_block::<B::Four>(block, &shear, best.t);
                while hits.mask != 0 {
                    let i = hits.mask.trailing_zeros() as usize & 3;
                    hits.mask &= hits.mask - 1;
                    best.offer_triangle(leaves, ray, block.ids[i], hits.t[i], hits.u[i], hits.v[i]);
                }
                if block.is_last() {
                    break;
                }
                index += 1;
            }
        }
        match next(&mut stack, best.t) {
            Some(c) => child = c,
            None => return best.finish(),
        }
    }
}

/// The nearest child still worth a visit.
#[inline(always)]
fn next(stack: &mut Stack<u64>, far: f32) -> Option<Child> {
    let far = far * PADDING;
    loop {
        let entry = stack.pop()?;
        if f32::from_bits((entry >> 32) as u32) <= far {
            return Some(Child(entry as u32));
        }
    }
}

#[inline(always)]
pub(super) fn any<B: BoxTest, L: Leaves>(bvh: &Bvh, ray: &Ray, leaves: &L) -> bool {
    if bvh.nodes.is_empty() || !is_proper(ray) {
        return false;
    }
    let boxes = B::new(ray);
    let shear = Shear::new(ray);
    let mut stack = Stack::new();
    stack.push(Child(0));
    while let Some(child) = stack.pop() {
        let mut index = child.index();
        if !child.is_leaf() {
            let node = &bvh.nodes[index];
            let (mut mask, _) = boxes.enter(node, ray.t_max);
            while mask != 0 {
                let i = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                stack.push(node.children[i]);
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
                let block: &Block = &bvh.blocks[index];
                let mut hits = triangle::intersect_block::<B::Four>(block, &shear, ray.t_max);
                while hits.mask != 0 {
                    let i = hits.mask.trailing_zeros() as usize & 3;
                    hits.mask &= hits.mask - 1;
                    let hit = Candidate { t: hits.t[i], u: hits.u[i], v: hits.v[i] };
                    if hit.t < ray.t_max && counts(leaves, ray, block.ids[i], hit) {
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
