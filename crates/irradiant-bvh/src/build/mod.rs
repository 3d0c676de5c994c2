//! From lists of primitives to a tree: gather boxes, split by binned SAH into a binary tree, collapse it to eight
//! children, fill the leaves.
//!
//! Every step is a pure function of the input: threads only share out disjoint ranges, so the tree is the same,
//! byte for byte, however many there are.

mod binary;
mod collapse;
mod gather;
mod pack;
mod wide;

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
    /// Cost of testing a block of up to five triangles; less in trees that are too large for the cache.
    pub block_cost: f32,
    /// Cost of testing a user primitive.
    pub user_cost: f32,
    /// Most blocks that a leaf may hold when splitting it further is still possible.
    pub max_leaf_blocks: u32,
}

impl Default for BuildSettings {
    fn default() -> Self {
        Self { node_cost: 1.0, block_cost: 0.6, user_cost: 2.0, max_leaf_blocks: 4 }
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
    /// Blocks of up to five triangles.
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
        let starts = starts(input);
        let (refs, report) = gather::gather(input, &starts);
        // Only adversarial input makes the first tree deeper than the traversal stack; halving at every split bounds it.
        Self::build_over(refs, input, &starts, settings, report, binary::Split::Sah)
            .filter(|bvh| bvh.stack_need() <= STACK)
            .or_else(|| {
                let (refs, _) = gather::gather(input, &starts);
                Self::build_over(refs, input, &starts, settings, report, binary::Split::Halve)
            })
            .unwrap_or_else(|| Self { nodes: vec![], blocks: vec![], users: vec![], bounds: None, report })
    }

    fn build_over(
        mut refs: Vec<gather::Ref>,
        input: &BuildInput,
        starts: &[u32],
        settings: &BuildSettings,
        report: BuildReport,
        split: binary::Split,
    ) -> Option<Self> {
        if refs.is_empty() {
            return None;
        }
        let tree = binary::build(&mut refs, split);
        Some(collapse::collapse(&tree, refs, input, starts, settings, report))
    }
}

/// The index of each mesh's first triangle among all.
fn starts(input: &BuildInput) -> Vec<u32> {
    let first = |sum: &mut u32, mesh: &Mesh| Some(std::mem::replace(sum, *sum + mesh.triangles.len() as u32));
    input.meshes.iter().scan(0, first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Block, Node};

    /// Points on a curve that fills the cube, at widely differing densities.
    fn scattered(n: usize) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut positions = Vec::new();
        for i in 0..n {
            let (c, size) = ([next(), next(), next()], 0.1 * next().powi(4) + 1e-4 * (i % 7) as f32);
            for _ in 0..3 {
                positions.push(c.map(|x| x * x + size * next()));
            }
        }
        let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        (positions, triangles)
    }

    fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]], user_boxes: &[[[f32; 3]; 2]]) -> Bvh {
        let meshes = [Mesh { positions, triangles, filtered: false }];
        Bvh::build(&BuildInput { meshes: &meshes, user_boxes }, &BuildSettings::default())
    }

    fn bytes(bvh: &Bvh) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
        let node = |n: &Node| {
            n.planes.iter().flatten().map(|x| x.to_bits()).chain(n.children.map(|c| c.0)).collect::<Vec<_>>()
        };
        let block = |b: &Block| {
            let vertices = b.vertices.iter().flatten().map(|x| x.to_bits());
            vertices.chain(b.corners).chain((0..8).map(|lane| b.id(lane))).collect::<Vec<_>>()
        };
        let blocks = bvh.blocks.iter().flat_map(block).collect();
        (bvh.nodes.iter().flat_map(node).collect(), blocks, bvh.users.clone())
    }

    #[test]
    fn any_number_of_threads_builds_the_same_tree() {
        let (positions, triangles) = scattered(200_000);
        let boxes: Vec<_> = positions.iter().step_by(30).map(|p| [*p, p.map(|x| x + 0.01)]).collect();
        let with = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
            pool.install(|| build(&positions, &triangles, &boxes))
        };
        let (one, two, five) = (with(1), with(2), with(5));
        assert_eq!(one.validate(), Ok(()));
        assert!(bytes(&one) == bytes(&two), "two threads build another tree");
        assert!(bytes(&one) == bytes(&five), "five threads build another tree");
    }

    #[test]
    fn unusable_primitives_are_counted_and_left_out() {
        let n = f32::NAN;
        let positions =
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [n, 0.0, 0.0], [f32::INFINITY; 3], [2.0, 0.0, 0.0]];
        let triangles = [[0, 1, 2], [0, 1, 3], [4, 1, 2], [0, 1, 5], [0, 0, 0], [0, 1, 6], [1, 2, 5]];
        let boxes = [[[0.0; 3], [1.0; 3]], [[1.0; 3], [0.0; 3]], [[0.0, n, 0.0], [1.0; 3]], [[0.0; 3], [0.0; 3]]];
        let bvh = build(&positions, &triangles, &boxes);
        let report = *bvh.report();
        assert_eq!(bvh.validate(), Ok(()));
        assert_eq!((report.triangles, report.users), (2, 2));
        assert_eq!((report.non_finite_triangles, report.zero_area_triangles, report.bad_index_triangles), (2, 2, 1));
        assert_eq!(report.bad_boxes, 2);
        assert_eq!(bvh.bounds(), Some([[0.0; 3], [2.0, 1.0, 1.0]]));
    }

    #[test]
    fn degenerate_arrangements_build_sound_trees() {
        let one = [[0.0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        // The last is split by all threads.
        for n in [1, 2, 4, 5, 9, 1000, 40_000] {
            // All the same; all boxes one point; and both mixed.
            let same = vec![[0u32, 1, 2]; n];
            let points = vec![[[0.5f32; 3]; 2]; n];
            for bvh in [build(&one, &same, &[]), build(&one, &[], &points), build(&one, &same, &points)] {
                assert_eq!(bvh.validate(), Ok(()), "{n}");
            }
        }
        let everything = [[[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]]; 20];
        assert_eq!(build(&one, &[[0, 1, 2]], &everything).validate(), Ok(()));
        for scale in [1e-44, 1e-38, 1e-30, 1e30, 1e38, 3e38] {
            let (positions, triangles) = scattered(500);
            let positions: Vec<_> = positions.iter().map(|p| p.map(|x| (x - 0.5) * scale)).collect();
            assert_eq!(build(&positions, &triangles, &[]).validate(), Ok(()), "{scale}");
        }
    }

    #[test]
    fn trees_too_deep_for_the_stack_are_built_again_in_halves() {
        // Boxes that shrink towards a corner: each split of the heuristic takes off a few.
        let boxes: Vec<_> = (0..6000)
            .map(|i| {
                let s = 0.97f32.powi(i);
                [[s; 3], [s * 1.02; 3]]
            })
            .collect();
        let bvh = build(&[], &[], &boxes);
        assert_eq!(bvh.validate(), Ok(()));
        let (refs, report) = gather::gather(&BuildInput { meshes: &[], user_boxes: &boxes }, &[]);
        let halved = Bvh::build_over(
            refs,
            &BuildInput { meshes: &[], user_boxes: &boxes },
            &[],
            &BuildSettings::default(),
            report,
            binary::Split::Halve,
        );
        let halved = halved.expect("not empty");
        assert_eq!(halved.validate(), Ok(()));
        assert!(halved.stack_need() <= 7 * 14, "{}", halved.stack_need());
    }

    #[test]
    fn far_fewer_triangles_are_in_later_slots() {
        let (positions, triangles) = scattered(20_000);
        let bvh = build(&positions, &triangles, &[]);
        // Triangles below a child; children of a node have higher indices than it.
        let in_leaf = |first: usize| {
            let last = (first..).find(|&b| bvh.blocks[b].is_last()).expect("leaves end");
            bvh.blocks[first..=last].iter().map(Block::count).sum::<usize>()
        };
        let mut below = vec![0; bvh.nodes.len()];
        for (i, node) in bvh.nodes.iter().enumerate().rev() {
            let children = (0..8).filter(|&c| !node.is_unused(c)).map(|c| node.children[c]);
            let counts: Vec<_> =
                children.map(|c| if c.is_leaf() { in_leaf(c.index()) } else { below[c.index()] }).collect();
            assert!(counts.is_sorted_by(|a, b| a.ilog2() / 2 >= b.ilog2() / 2), "node {i}: {counts:?}");
            below[i] = counts.iter().sum();
        }
        assert_eq!(below[0], bvh.report().triangles);
    }

    #[test]
    fn a_million_triangles_would_fit_the_memory_promised() {
        let (positions, triangles) = scattered(100_000);
        let bvh = build(&positions, &triangles, &[]);
        assert!(bvh.memory_bytes() <= 90 * 100_000, "{} bytes", bvh.memory_bytes());
    }
}
