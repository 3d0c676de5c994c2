//! What must be true of every tree.

use crate::node::{BLOCK, Block, Bvh, Child, LAST_USER, Node, VERTICES, WIDTH};

impl Bvh {
    /// Checks that every box holds what is below it, that every primitive is there exactly once, and that the
    /// traversal stack is deep enough. For tests and for trees one suspects: takes time in proportion to the size.
    ///
    /// # Errors
    /// A sentence about the first thing found wrong.
    pub fn validate(&self) -> Result<(), String> {
        let mut seen = Seen { triangles: Vec::new(), users: Vec::new(), nodes: 0 };
        if !self.nodes.is_empty() {
            self.validate_node(0, &mut seen)?;
        }
        let report = self.report();
        for (what, mut list, expected) in
            [("triangle", seen.triangles, report.triangles), ("user primitive", seen.users, report.users)]
        {
            list.sort_unstable();
            if let Some(pair) = list.windows(2).find(|w| w[0] == w[1]) {
                return Err(format!("{what} {} is in the tree twice", pair[0]));
            }
            if list.len() != expected {
                return Err(format!("{} of {expected} {what}s are in the tree", list.len()));
            }
        }
        if seen.nodes != self.nodes.len() {
            return Err(format!("{} of {} nodes can be reached", seen.nodes, self.nodes.len()));
        }
        if self.stack_need() > crate::node::STACK {
            return Err(format!("traversal needs {} stack entries", self.stack_need()));
        }
        Ok(())
    }

    fn validate_node(&self, index: usize, seen: &mut Seen) -> Result<[[f32; 3]; 2], String> {
        let node = self.nodes.get(index).ok_or_else(|| format!("there is no node {index}"))?;
        seen.nodes += 1;
        let mut all = EMPTY;
        for i in (0..WIDTH).filter(|&i| !node.is_unused(i)) {
            let child = node.children[i];
            let content = if !child.is_leaf() {
                if child.index() <= index {
                    return Err(format!("node {index} points back to node {}", child.index()));
                }
                self.validate_node(child.index(), seen)?
            } else if child.is_users() {
                self.list_users(child, seen)?;
                EMPTY
            } else {
                self.list_triangles(child, seen)?
            };
            let slot = box_of(node, i);
            if (0..3).any(|a| content[0][a] < slot[0][a] || content[1][a] > slot[1][a]) {
                return Err(format!("child {i} of node {index} sticks out of its box: {content:?} in {slot:?}"));
            }
            all = union(all, slot);
        }
        Ok(all)
    }

    fn list_triangles(&self, child: Child, seen: &mut Seen) -> Result<[[f32; 3]; 2], String> {
        let mut all = EMPTY;
        for index in child.index().. {
            let block = self.blocks.get(index).ok_or_else(|| format!("there is no block {index}"))?;
            if block.count() == 0 || block.count() > BLOCK {
                return Err(format!("block {index} has {} triangles", block.count()));
            }
            for lane in 0..VERTICES {
                for p in block.triangle(lane) {
                    all = union(all, [p, p]);
                }
            }
            for lane in 0..block.count() {
                seen.triangles.push(block.id(lane) & Block::INDEX);
            }
            if block.is_last() {
                break;
            }
        }
        Ok(all)
    }

    fn list_users(&self, child: Child, seen: &mut Seen) -> Result<(), String> {
        for index in child.index().. {
            let entry = self.users.get(index).ok_or_else(|| format!("there is no user entry {index}"))?;
            seen.users.push(entry & !LAST_USER);
            if entry & LAST_USER != 0 {
                break;
            }
        }
        Ok(())
    }

    /// The most stack entries that any ray could need.
    pub(crate) fn stack_need(&self) -> usize {
        // Children have higher indices than their parents, so one pass from the end suffices.
        let mut need = vec![0usize; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let children = (0..WIDTH).filter(|&i| !node.is_unused(i));
            let deepest = children
                .clone()
                .map(|i| node.children[i])
                .filter(|c| !c.is_leaf())
                .map(|c| need[c.index()])
                .max()
                .unwrap_or(0);
            // All children are pushed before one is taken off again.
            need[index] = (children.count() - 1 + deepest).max(WIDTH);
        }
        need.first().map_or(0, |n| n + 1)
    }
}

struct Seen {
    triangles: Vec<u32>,
    users: Vec<u32>,
    nodes: usize,
}

const EMPTY: [[f32; 3]; 2] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];

fn box_of(node: &Node, i: usize) -> [[f32; 3]; 2] {
    let side = |s: usize| [0, 1, 2].map(|a| node.planes[2 * a + s][i]);
    [side(0), side(1)]
}

fn union(a: [[f32; 3]; 2], b: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
    let by = |s: usize, f: fn(f32, f32) -> f32| [0, 1, 2].map(|k| f(a[s][k], b[s][k]));
    [by(0, f32::min), by(1, f32::max)]
}
