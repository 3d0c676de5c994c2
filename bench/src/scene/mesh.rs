//! Triangles, and ways to make them.

use crate::vector::{V, add, scale};
use std::io::Write;
use std::path::Path;

/// Indexed triangles; the normal is on the side from which vertices go counter-clockwise.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Points.
    pub positions: Vec<V>,
    /// Three points each.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// One flat four-sided face for each list of corners.
    pub fn quads(quads: &[[V; 4]]) -> Self {
        let mut mesh = Self::default();
        quads.iter().for_each(|q| mesh.add_quad(*q));
        mesh
    }

    /// One more flat face.
    pub fn add_quad(&mut self, corners: [V; 4]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }

    /// A box between two corners, normals outward, without bottom if `open`.
    pub fn add_box(&mut self, lo: V, hi: V, open: bool) {
        let p = |x: usize, y: usize, z: usize| [[lo, hi][x][0], [lo, hi][y][1], [lo, hi][z][2]];
        self.add_quad([p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)]);
        self.add_quad([p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)]);
        self.add_quad([p(1, 0, 0), p(0, 0, 0), p(0, 1, 0), p(1, 1, 0)]);
        self.add_quad([p(1, 0, 1), p(1, 0, 0), p(1, 1, 0), p(1, 1, 1)]);
        self.add_quad([p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)]);
        if !open {
            self.add_quad([p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)]);
        }
    }

    /// All of another mesh, each point `p` at `origin + size p`.
    pub fn add_mesh(&mut self, other: &Mesh, origin: V, size: f32) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&p| add(origin, scale(p, size))));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| first + i)));
    }

    /// Binary PLY.
    pub fn write_ply(&self, path: &Path) -> std::io::Result<()> {
        let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", self.positions.len())?;
        out.write_all(b"property float x\nproperty float y\nproperty float z\n")?;
        write!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header\n", self.triangles.len())?;
        for p in &self.positions {
            p.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        }
        for t in &self.triangles {
            out.write_all(&[3])?;
            t.iter().try_for_each(|i| out.write_all(&i.to_le_bytes()))?;
        }
        out.flush()
    }
}
