//! The tree in memory: eight-wide nodes, blocks of triangles that share vertices, lists of user primitives.

use crate::build::BuildReport;

/// Children of a node.
pub(crate) const WIDTH: usize = 8;
/// Triangles in a block at most.
pub(crate) const BLOCK: usize = 5;
/// Vertices of a block at most, and lanes of a test.
pub(crate) const VERTICES: usize = 8;
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

/// Up to five triangles between up to eight vertices, two cache lines. Unused lanes repeat the last triangle.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block {
    /// Coordinates `[axis][vertex]`; those of unused vertices repeat the first.
    pub vertices: [[f32; VERTICES]; 3],
    /// The three bits at `4 i` of entry `c` say which vertex is corner `c` of the triangle in lane `i`. The bits between
    /// say the rest: the first of entry 0 whether the block is the last of its leaf, the first three of entry 1 how many
    /// triangles there are.
    pub corners: [u32; 3],
    /// Primitive indices, with [`Block::FILTERED`].
    ids: [u32; BLOCK],
}

impl Block {
    /// Set in an id when the triangle's hits go through the filter.
    pub const FILTERED: u32 = 1 << 31;
    /// The bits of an id that are the primitive index.
    pub const INDEX: u32 = (1 << 30) - 1;

    /// A block of these triangles (1 to 5 of them), given by their vertices and ids.
    pub fn new(
        mut vertices: [[f32; VERTICES]; 3],
        n_vertices: usize,
        triangles: &[[u32; 3]],
        ids: &[u32],
        is_last: bool,
    ) -> Self {
        for axis in &mut vertices {
            let first = axis[0];
            axis[n_vertices..].fill(first);
        }
        let mut block = Self { vertices, corners: [0; 3], ids: [0; BLOCK] };
        let last = triangles.len() - 1;
        for lane in 0..VERTICES {
            for c in 0..3 {
                block.corners[c] |= triangles[lane.min(last)][c] << (4 * lane);
            }
        }
        block.corners[0] |= u32::from(is_last) << 3;
        for bit in 0..3 {
            block.corners[1] |= (triangles.len() as u32 >> bit & 1) << (4 * bit + 3);
        }
        for (i, id) in block.ids.iter_mut().enumerate() {
            *id = ids[i.min(last)];
        }
        block
    }

    /// Number of triangles.
    #[inline(always)]
    pub fn count(&self) -> usize {
        let word = self.corners[1] >> 3;
        (word & 1 | word >> 3 & 2 | word >> 6 & 4) as usize
    }

    /// Whether it is the last block of a leaf.
    #[inline(always)]
    pub fn is_last(&self) -> bool {
        self.corners[0] & 8 != 0
    }

    /// The id of the triangle in a lane.
    #[inline(always)]
    pub fn id(&self, lane: usize) -> u32 {
        self.ids[lane.min(BLOCK - 1)]
    }

    /// The vertex that is a corner of the triangle in a lane.
    #[inline(always)]
    pub fn corner(&self, lane: usize, corner: usize) -> usize {
        (self.corners[corner] >> (4 * lane)) as usize & (VERTICES - 1)
    }

    /// The corners of the triangle in a lane.
    #[inline(always)]
    pub fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        // Written out: `map` of arrays is a call, or copies them.
        let [x, y, z] = &self.vertices;
        let (a, b, c) = (self.corner(lane, 0), self.corner(lane, 1), self.corner(lane, 2));
        [[x[a], y[a], z[a]], [x[b], y[b], z[b]], [x[c], y[c], z[c]]]
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
const _: () = assert!(size_of::<Block>() == 128);
