//! Parts of trees, and which parts of instances to put in a tree over them: partial re-braiding (Benthin, Woop, Wald, Áfra 2017,
//! "Improved two-level BVHs using partial re-braiding").
//!
//! An instance that holds many others in its box, a room or a landscape, is met by every ray that meets those, first of all, and
//! seldom to the end. Its parts, each in a box of its own, are met where they are.

use crate::node::{Bvh, Child, WIDTH};

/// Where in a tree a ray begins: at the top, or at what is below one child of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part(pub(crate) Child);

impl Part {
    /// The whole tree.
    pub const ALL: Self = Self(Child(0));
}

/// A user primitive of a tree over instances: one of them, or a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braid {
    /// Index of what was given.
    pub instance: u32,
    /// Where its tree is entered.
    pub part: Part,
    /// Lower and upper corner outside.
    pub bounds: [[f32; 3]; 2],
}

type Box3 = [[f32; 3]; 2];

/// An instance, or a part of one, is opened if its box has this share of the area of the box of everything, and the boxes of so many others
/// meet it.
const LARGE: f32 = 1.0 / 64.0;
const COMPANY: usize = 16;
/// Large instances that are looked at, and parts of each, at most: of so many parts each is compared with all boxes once.
const LOOKED_AT: usize = 256;
const PARTS: usize = 64;

/// In the order of `boxes`, which are those of user primitives: each of them, or the parts of it. Only those are opened of which `tree_of` gives
/// the tree (which must hold triangles only, and there is no use in one that moves); `outside` gives the box of an instance around one inside.
///
/// What a ray meets first stays the same if [`Leaves::precedes`](crate::Leaves::precedes) puts parts of one instance in the order of their triangles.
pub fn braid<'a>(
    boxes: &[Box3],
    tree_of: impl Fn(usize) -> Option<&'a Bvh>,
    outside: impl Fn(usize, &Box3) -> Box3,
) -> Vec<Braid> {
    let least = LARGE * half_area(&boxes.iter().fold(EMPTY, union));
    // A box meets that of its own instance too.
    let is_crowded =
        |b: &Box3| half_area(b) >= least && boxes.iter().filter(|other| overlap(b, other)).nth(COMPANY).is_some();
    let mut braids = Vec::with_capacity(boxes.len());
    let mut looked_at = 0;
    for (i, bounds) in boxes.iter().enumerate() {
        let first = braids.len();
        let braid = |(part, bounds)| Braid { instance: i as u32, part, bounds };
        braids.push(braid((Part::ALL, *bounds)));
        if looked_at == LOOKED_AT || half_area(bounds) < least {
            continue;
        }
        let Some(tree) = tree_of(i) else { continue };
        looked_at += 1;
        let mut next = first;
        while next < braids.len() && braids.len() - first + WIDTH <= PARTS {
            let part = braids[next].part;
            if tree.parts_below(part).next().is_none() || !is_crowded(&braids[next].bounds) {
                next += 1;
                continue;
            }
            let below: Vec<_> = tree.parts_below(part).map(|(part, inside)| (part, outside(i, &inside))).collect();
            // A part that is nowhere would be left out.
            if !below.iter().all(|(_, b)| (0..3).all(|k| b[0][k] <= b[1][k])) {
                next += 1;
                continue;
            }
            braids.swap_remove(next);
            braids.extend(below.into_iter().map(braid));
        }
    }
    braids
}

impl Bvh {
    /// What a part that is a node consists of, and the boxes.
    pub(crate) fn parts_below(&self, Part(child): Part) -> impl Iterator<Item = (Part, Box3)> {
        let node = if child.is_leaf() { None } else { self.nodes.get(child.index()) };
        node.into_iter().flat_map(|node| {
            (0..WIDTH).filter(|&i| !node.is_unused(i)).map(|i| {
                let corner = |side: usize| [0, 1, 2].map(|axis| node.planes[2 * axis + side][i]);
                (Part(node.children[i]), [corner(0), corner(1)])
            })
        })
    }
}

const EMPTY: Box3 = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];

fn union([a, b]: Box3, [c, d]: &Box3) -> Box3 {
    [[0, 1, 2].map(|k| a[k].min(c[k])), [0, 1, 2].map(|k| b[k].max(d[k]))]
}

fn half_area([lo, hi]: &Box3) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|k| hi[k] - lo[k]);
    x * y + y * z + z * x
}

fn overlap([a, b]: &Box3, [c, d]: &Box3) -> bool {
    (0..3).all(|k| a[k] <= d[k] && c[k] <= b[k])
}
