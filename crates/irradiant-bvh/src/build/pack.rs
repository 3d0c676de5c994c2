//! From the triangles of a leaf to blocks that share vertices.
//!
//! Vertices are the same if their coordinates are, bit by bit: meshes without shared indices gain as much. A connected
//! patch of five triangles has at most seven vertices; triangles without neighbours go in pairs.

use super::collapse::Run;
use super::gather::{self, Meshes, Ref};
use super::{BuildInput, Mesh};
use crate::node::{BLOCK, Block, VERTICES};
use crate::prefetch::prefetch_read;

/// Blocks of some leaves, counted from the first of them.
pub(super) struct Packed {
    pub blocks: Vec<Block>,
    /// The first block of each leaf.
    pub first_blocks: Vec<u32>,
}

/// A block being filled.
#[derive(Default)]
struct Filling {
    vertices: [[f32; VERTICES]; 3],
    n_vertices: usize,
    triangles: [[u32; 3]; BLOCK],
    ids: [u32; BLOCK],
    count: usize,
}

impl Filling {
    fn find(&self, p: &[f32; 3]) -> Option<usize> {
        let [x, y, z] = &self.vertices;
        let [px, py, pz] = p.map(f32::to_bits);
        (0..self.n_vertices).find(|&v| x[v].to_bits() == px && y[v].to_bits() == py && z[v].to_bits() == pz)
    }

    /// Adds a triangle; says no, and changes nothing, if there is no room.
    fn add(&mut self, corners: &[[f32; 3]; 3], id: u32) -> bool {
        let found = [self.find(&corners[0]), self.find(&corners[1]), self.find(&corners[2])];
        // Corners of one triangle differ, or it would have no area.
        let new = found.iter().filter(|f| f.is_none()).count();
        if self.count == BLOCK || self.n_vertices + new > VERTICES {
            return false;
        }
        for (c, (found, p)) in found.iter().zip(corners).enumerate() {
            let vertex = found.unwrap_or_else(|| {
                for (axis, &x) in self.vertices.iter_mut().zip(p) {
                    axis[self.n_vertices] = x;
                }
                self.n_vertices += 1;
                self.n_vertices - 1
            });
            self.triangles[self.count][c] = vertex as u32;
        }
        self.ids[self.count] = id;
        self.count += 1;
        true
    }

    fn finish(self, is_last: bool) -> Block {
        let (triangles, ids) = (&self.triangles[..self.count], &self.ids[..self.count]);
        Block::new(self.vertices, self.n_vertices, triangles, ids, is_last)
    }
}

/// The corners of a triangle; gathered ones have sound indices.
fn corners(mesh: &Mesh, i: usize) -> [[f32; 3]; 3] {
    gather::vertices(mesh, i).unwrap_or_default()
}

/// Triangles of a leaf lie anywhere in their mesh: they are asked for this many leaves before they are needed, and the references to them as long before
/// that.
const AHEAD: usize = 4;

/// Fills blocks with the triangles of leaves, each leaf's in order.
pub(super) fn pack(leaves: &[Run], refs: &[Ref], input: &BuildInput, starts: &[u32]) -> Packed {
    let n: usize = leaves.iter().map(|l| l.count).sum();
    let mut out =
        Packed { blocks: Vec::with_capacity(leaves.len() + n / 8), first_blocks: Vec::with_capacity(leaves.len()) };
    let (mut meshes, mut meshes_ahead) = (Meshes::new(input, starts), Meshes::new(input, starts));
    for (i, leaf) in leaves.iter().enumerate() {
        if let Some(later) = leaves.get(i + 2 * AHEAD) {
            refs[later.first..later.first + later.count].iter().step_by(2).for_each(prefetch_read);
        }
        if let Some(next) = leaves.get(i + AHEAD) {
            for reference in &refs[next.first..next.first + next.count] {
                let (mesh, i) = meshes_ahead.find(reference.id());
                prefetch_read(&mesh.triangles[i]);
            }
        }
        out.first_blocks.push(out.blocks.len() as u32);
        let mut filling = Filling::default();
        for reference in &refs[leaf.first..leaf.first + leaf.count] {
            let (mesh, i) = meshes.find(reference.id());
            let corners = corners(mesh, i);
            let id = reference.id() | if mesh.filtered { Block::FILTERED } else { 0 };
            if !filling.add(&corners, id) {
                out.blocks.push(std::mem::take(&mut filling).finish(false));
                filling.add(&corners, id);
            }
        }
        out.blocks.push(filling.finish(true));
    }
    out
}

/// How many triangles a block holds here, from a few runs of neighbours in the tree; between 2 and 5.
pub(super) fn triangles_per_block(refs: &[Ref], input: &BuildInput, starts: &[u32]) -> f32 {
    const RUNS: usize = 256;
    let (mut blocks, mut triangles) = (0usize, 0usize);
    let mut meshes = Meshes::new(input, starts);
    for run in 0..RUNS {
        let first = refs.len() * run / RUNS;
        let mut filling = Filling::default();
        for reference in refs[first..].iter().take(BLOCK).filter(|r| !r.is_user()) {
            let (mesh, i) = meshes.find(reference.id());
            if !filling.add(&corners(mesh, i), 0) {
                break;
            }
        }
        if filling.count > 0 {
            blocks += 1;
            triangles += filling.count;
        }
    }
    if blocks == 0 { BLOCK as f32 } else { triangles as f32 / blocks as f32 }
}
