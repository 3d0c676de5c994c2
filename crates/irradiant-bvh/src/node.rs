//! The tree in memory: eight-wide nodes, blocks of four triangles, lists of user primitives.

use crate::build::BuildReport;

/// Children of a node.
pub(crate) const WIDTH: usize = 8;
/// Triangles in a block.
pub(crate) const BLOCK: usize = 4;
/// Entries of the traversal stack; the builder guarantees that no tree needs more.
pub(crate) const STACK: usize = 256;
/// Most primitives a tree can hold.
pub(crate) const MAX_PRIMITIVES: usize = 1 << 30;

/// An inner node: eight boxes, structure of arrays, 224 bytes.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Node {
    /// Planes `[2 axis + side][child]`, side 0 the lower one. An unused child's box is inside out (+inf, -inf).
    pub planes: [[f32; WIDTH]; 6],
    /// What is in each box.
    pub children: [Child; WIDTH],
}

impl Node {
    pub const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [Child(0); WIDTH],
    };

    /// Whether child `i` is unused.
    pub fn is_unused(&self, i: usize) -> bool {
        self.planes[0][i] > self.planes[1][i]
    }
}

/// A reference to a node (top bit clear), the first block of triangles (10), or the first of a list of users (11).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Child(pub u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const USER: u32 = 1 << 30;

    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }
    pub fn triangles(first_block: usize) -> Self {
        Self(first_block as u32 | Self::LEAF)
    }
    pub fn users(first: usize) -> Self {
        Self(first as u32 | Self::LEAF | Self::USER)
    }
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }
    #[inline(always)]
    pub fn is_users(self) -> bool {
        self.0 & Self::USER != 0
    }
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & (Self::USER - 1)) as usize
    }
}

/// Four triangles, structure of arrays, 160 bytes. Unused lanes repeat the last triangle.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Block {
    /// Coordinates `[vertex][axis][lane]`.
    pub vertices: [[[f32; BLOCK]; 3]; 3],
    /// Primitive index, with [`Block::FILTERED`] and, in lane 0, [`Block::LAST`].
    pub ids: [u32; BLOCK],
}

impl Block {
    /// Set when the triangle's hits go through the filter.
    pub const FILTERED: u32 = 1 << 31;
    /// Set in lane 0 of the last block of a leaf.
    pub const LAST: u32 = 1 << 30;
    /// The bits of an id that are the primitive index.
    pub const INDEX: u32 = Self::LAST - 1;

    /// The corners of the triangle in a lane.
    #[inline]
    pub fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.vertices.map(|p| p.map(|c| c[lane]))
    }

    /// Whether a lane (not the first) is unused, as all after it are.
    #[inline(always)]
    pub fn repeats(&self, lane: usize) -> bool {
        (self.ids[lane] ^ self.ids[lane - 1]) & Self::INDEX == 0
    }

    #[inline(always)]
    pub fn is_last(&self) -> bool {
        self.ids[0] & Self::LAST != 0
    }
}

/// Set on the last entry of a list of users.
pub(crate) const LAST_USER: u32 = 1 << 31;

/// A tree over triangles and user primitives. Immutable; share it freely between threads.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// The root is `nodes[0]`; empty if there is no primitive.
    pub(crate) nodes: Vec<Node>,
    pub(crate) blocks: Vec<Block>,
    pub(crate) users: Vec<u32>,
    pub(crate) bounds: Option<[[f32; 3]; 2]>,
    pub(crate) report: BuildReport,
}

impl Bvh {
    /// Lower and upper corner of everything in the tree; `None` if it is empty.
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        self.bounds
    }

    /// What the build met: numbers of primitives kept and dropped, and the quality of the tree.
    pub fn report(&self) -> &BuildReport {
        &self.report
    }

    /// Bytes held by nodes and leaves.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..]) + size_of_val(&self.users[..])
    }
}

const _: () = assert!(size_of::<Node>() == 224);
const _: () = assert!(size_of::<Block>() == 160);
