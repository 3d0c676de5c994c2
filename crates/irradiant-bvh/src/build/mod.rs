//! From lists of primitives to a tree: gather boxes, split by binned SAH into a binary tree, collapse it to eight
//! children, fill the leaves.
//!
//! Every step is a pure function of the input: threads only share out disjoint ranges, so the tree is the same,
//! byte for byte, however many there are.

mod binary;
mod collapse;
mod gather;

use crate::node::{Bvh, MAX_PRIMITIVES, STACK};

/// Triangles that share vertices and a filter flag.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mesh<'a> {
    /// Vertices.
    pub positions: &'a [[f32; 3]],
    /// Three indices into `positions` for each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Whether hits of these triangles are put to [`Leaves::accept`](crate::Leaves::accept).
    pub filtered: bool,
}

/// Everything a tree is built over.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildInput<'a> {
    /// Triangles; their primitive index runs through all meshes in order.
    pub meshes: &'a [Mesh<'a>],
    /// Lower and upper corner of each user primitive; may be flat, and infinite.
    pub user_boxes: &'a [[[f32; 3]; 2]],
}

/// How to build. The defaults are what measured best; costs are relative to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildSettings {
    /// Cost of testing a node's eight boxes and sorting what was hit.
    pub node_cost: f32,
    /// Cost of testing a block of up to four triangles.
    pub block_cost: f32,
    /// Cost of testing a user primitive.
    pub user_cost: f32,
    /// Most blocks that a leaf may hold when splitting it further is still possible.
    pub max_leaf_blocks: u32,
}

impl Default for BuildSettings {
    fn default() -> Self {
        Self { node_cost: 1.0, block_cost: 0.8, user_cost: 2.0, max_leaf_blocks: 4 }
    }
}

/// What a build met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BuildReport {
    /// Triangles in the tree.
    pub triangles: usize,
    /// User primitives in the tree.
    pub users: usize,
    /// Triangles dropped because a vertex is NaN or infinite.
    pub non_finite_triangles: usize,
    /// Triangles dropped because their area is exactly zero: no ray could meet them.
    pub zero_area_triangles: usize,
    /// Triangles dropped because an index is outside its mesh's vertices.
    pub bad_index_triangles: usize,
    /// User primitives dropped because their box is NaN or inside out.
    pub bad_boxes: usize,
    /// Eight-wide nodes.
    pub nodes: usize,
    /// Blocks of four triangles.
    pub blocks: usize,
    /// Expected cost of a random ray through the bounds, in the units of [`BuildSettings`].
    pub sah_cost: f64,
}

impl Bvh {
    /// A tree over `input`.
    ///
    /// Runs on the current rayon pool; the result does not depend on its size. Never fails on bad geometry: what no
    /// ray can meet is dropped and counted in the [`report`](Self::report).
    ///
    /// # Panics
    /// With 2³⁰ primitives or more (their blocks alone would take 40 GB).
    pub fn build(input: &BuildInput, settings: &BuildSettings) -> Self {
        let count = input.meshes.iter().map(|m| m.triangles.len()).sum::<usize>().max(input.user_boxes.len());
        assert!(count < MAX_PRIMITIVES, "{count} primitives are too many for one tree");
        let (refs, report) = gather::gather(input);
        // Only adversarial input makes the first tree deeper than the traversal stack; halving at every split bounds it.
        Self::build_over(refs, input, settings, report, binary::Split::Sah)
            .filter(|bvh| bvh.stack_need() <= STACK)
            .or_else(|| Self::build_over(gather::gather(input).0, input, settings, report, binary::Split::Halve))
            .unwrap_or_else(|| Self { nodes: vec![], blocks: vec![], users: vec![], bounds: None, report })
    }

    fn build_over(
        mut refs: Vec<gather::Ref>,
        input: &BuildInput,
        settings: &BuildSettings,
        report: BuildReport,
        split: binary::Split,
    ) -> Option<Self> {
        if refs.is_empty() {
            return None;
        }
        let tree = binary::build(&mut refs, split);
        Some(collapse::collapse(&tree, refs, input, settings, report))
    }
}
