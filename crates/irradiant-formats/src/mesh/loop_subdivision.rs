//! Loop subdivision to the limit surface, with pbrt-v4's boundary rules and order of vertices.
//!
//! Sources: Loop 1987, Smooth Subdivision Surfaces Based on Triangles (masks, with Warren's weights); Hoppe et al. 1994,
//! Piecewise Smooth Surface Reconstruction (boundaries, tangents).

use irradiant_math::elementary;
use irradiant_scene::desc::MeshData;

/// Why a mesh cannot be subdivided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubdivisionError {
    /// A face names a vertex twice.
    Degenerate {
        /// Its index.
        face: usize,
    },
    /// Two faces run along an edge in the same direction, or more than two share it.
    NotManifold {
        /// Its ends.
        edge: [u32; 2],
    },
}

impl std::fmt::Display for SubdivisionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Degenerate { face } => write!(f, "triangle {face} has the same vertex twice"),
            Self::NotManifold { edge: [a, b] } => {
                write!(f, "the faces at the edge from vertex {a} to {b} are more than two, or wound against each other")
            }
        }
    }
}

impl std::error::Error for SubdivisionError {}

const NONE: u32 = u32::MAX;

const fn next(i: usize) -> usize {
    (i + 1) % 3
}

const fn previous(i: usize) -> usize {
    (i + 2) % 3
}

type P = [f64; 3];

fn add(a: &mut P, w: f64, b: &P) {
    for i in 0..3 {
        a[i] += w * b[i];
    }
}

fn cross(a: P, b: P) -> P {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// One level: faces know the faces across their edges, vertices know one of their faces.
struct Level {
    positions: Vec<P>,
    faces: Vec<[u32; 3]>,
    /// Across edge k, from corner k to the next.
    neighbours: Vec<[u32; 3]>,
    start: Vec<u32>,
    boundary: Vec<bool>,
}

impl Level {
    /// Which corner of a face a vertex of it is. The face has the vertex, once: `topology` has refused degenerate faces, and a face that
    /// names a vertex twice would make corner 3 of corners 1 and 2.
    fn corner(&self, face: u32, vertex: u32) -> usize {
        let [a, b, c] = self.faces[face as usize];
        debug_assert_eq!([a, b, c].iter().filter(|&&v| v == vertex).count(), 1, "face {face} has vertex {vertex} once");
        usize::from(b == vertex) + 2 * usize::from(c == vertex)
    }

    fn across_next(&self, face: u32, vertex: u32) -> u32 {
        self.neighbours[face as usize][self.corner(face, vertex)]
    }

    /// The vertices around one, in order; its length is the valence.
    fn ring(&self, vertex: u32, out: &mut Vec<u32>) {
        out.clear();
        let start = self.start[vertex as usize];
        let mut face = start;
        if !self.boundary[vertex as usize] {
            loop {
                let corner = self.corner(face, vertex);
                out.push(self.faces[face as usize][next(corner)]);
                face = self.neighbours[face as usize][corner];
                if face == start || face == NONE {
                    return;
                }
            }
        }
        loop {
            let beyond = self.across_next(face, vertex);
            if beyond == NONE {
                break;
            }
            face = beyond;
        }
        out.push(self.faces[face as usize][next(self.corner(face, vertex))]);
        while face != NONE {
            let before = previous(self.corner(face, vertex));
            out.push(self.faces[face as usize][before]);
            face = self.neighbours[face as usize][before];
        }
    }

    /// `(1 - n w) p + w` times the sum of the ring; on a boundary only its two ends count.
    fn smoothed(&self, vertex: u32, ring: &[u32], interior: impl Fn(usize) -> f64, boundary: f64) -> P {
        let p = &self.positions[vertex as usize];
        let mut out = [0.0; 3];
        if self.boundary[vertex as usize] {
            add(&mut out, 1.0 - 2.0 * boundary, p);
            for v in [ring[0], ring[ring.len() - 1]] {
                add(&mut out, boundary, &self.positions[v as usize]);
            }
        } else {
            let w = interior(ring.len());
            add(&mut out, 1.0 - ring.len() as f64 * w, p);
            for v in ring {
                add(&mut out, w, &self.positions[*v as usize]);
            }
        }
        out
    }

    fn refined(&self) -> Level {
        let (n_faces, n_vertices) = (self.faces.len(), self.positions.len());
        let mut ring = vec![];
        let mut positions = Vec::with_capacity(n_vertices + n_faces * 3 / 2 + n_faces / 2);
        let mut start = Vec::with_capacity(positions.capacity());
        let mut boundary = self.boundary.clone();
        for v in 0..n_vertices as u32 {
            self.ring(v, &mut ring);
            positions.push(self.smoothed(v, &ring, beta, 1.0 / 8.0));
            let face = self.start[v as usize];
            start.push(4 * face + self.corner(face, v) as u32);
        }
        // Odd vertices, in the order in which the faces meet their edges.
        let mut odd = vec![[NONE; 3]; n_faces];
        for f in 0..n_faces {
            for k in 0..3 {
                if odd[f][k] != NONE {
                    continue;
                }
                let index = positions.len() as u32;
                odd[f][k] = index;
                let [a, b] = [self.faces[f][k], self.faces[f][next(k)]];
                let other = self.neighbours[f][k];
                let mut p = [0.0; 3];
                if other == NONE {
                    add(&mut p, 0.5, &self.positions[a as usize]);
                    add(&mut p, 0.5, &self.positions[b as usize]);
                } else {
                    // The neighbour runs along this edge from b to a.
                    let j = self.corner(other, b);
                    odd[other as usize][j] = index;
                    add(&mut p, 3.0 / 8.0, &self.positions[a as usize]);
                    add(&mut p, 3.0 / 8.0, &self.positions[b as usize]);
                    add(&mut p, 1.0 / 8.0, &self.positions[self.faces[f][previous(k)] as usize]);
                    add(&mut p, 1.0 / 8.0, &self.positions[self.faces[other as usize][previous(j)] as usize]);
                }
                positions.push(p);
                start.push(4 * f as u32 + 3);
                boundary.push(other == NONE);
            }
        }
        let mut faces = Vec::with_capacity(4 * n_faces);
        let mut neighbours = Vec::with_capacity(4 * n_faces);
        for f in 0..n_faces {
            let child = |k: usize| (4 * f + k) as u32;
            let beyond = |edge: usize, corner: usize| {
                let other = self.neighbours[f][edge];
                if other == NONE { NONE } else { 4 * other + self.corner(other, self.faces[f][corner]) as u32 }
            };
            for k in 0..3 {
                let mut face = [0; 3];
                face[k] = self.faces[f][k];
                face[next(k)] = odd[f][k];
                face[previous(k)] = odd[f][previous(k)];
                faces.push(face);
                let mut around = [NONE; 3];
                around[k] = beyond(k, k);
                around[previous(k)] = beyond(previous(k), k);
                around[next(k)] = child(3);
                neighbours.push(around);
            }
            faces.push(odd[f]);
            neighbours.push([child(1), child(2), child(0)]);
        }
        Level { positions, faces, neighbours, start, boundary }
    }
}

fn beta(valence: usize) -> f64 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f64) }
}

/// Weight of the ring for the limit position.
fn limit_weight(valence: usize) -> f64 {
    1.0 / (valence as f64 + 3.0 / (8.0 * beta(valence)))
}

fn sin_cos(angle: f64) -> (f64, f64) {
    let (s, c) = elementary::sin_cos(angle as f32);
    (f64::from(s), f64::from(c))
}

fn topology(n_vertices: usize, faces: &[[u32; 3]]) -> Result<(Vec<[u32; 3]>, Vec<u32>), SubdivisionError> {
    // Directed edges, sorted: the neighbour across (a, b) is the face that runs from b to a.
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * faces.len());
    let mut start = vec![NONE; n_vertices];
    for (f, face) in faces.iter().enumerate() {
        if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
            return Err(SubdivisionError::Degenerate { face: f });
        }
        for k in 0..3 {
            edges.push((face[k], face[next(k)], f as u32));
            start[face[k] as usize] = f as u32;
        }
    }
    edges.sort_unstable();
    if let Some(w) = edges.windows(2).find(|w| (w[0].0, w[0].1) == (w[1].0, w[1].1)) {
        return Err(SubdivisionError::NotManifold { edge: [w[0].0, w[0].1] });
    }
    let across = |a: u32, b: u32| match edges.binary_search_by_key(&(b, a), |e| (e.0, e.1)) {
        Ok(i) => edges[i].2,
        Err(_) => NONE,
    };
    let neighbours = faces.iter().map(|f| std::array::from_fn(|k| across(f[k], f[next(k)]))).collect();
    Ok((neighbours, start))
}

/// The mesh after `levels` of subdivision, its vertices moved to the limit surface, with the limit's normals (not
/// unit: pbrt-v4 interpolates them as they come).
///
/// `faces` must index `positions`. Vertices that no face uses are dropped. Makes `4^levels` triangles of one.
pub fn subdivide(positions: &[[f32; 3]], faces: &[[u32; 3]], levels: u32) -> Result<MeshData, SubdivisionError> {
    let mut used = vec![false; positions.len()];
    faces.iter().flatten().for_each(|v| used[*v as usize] = true);
    let mut new_index = vec![NONE; positions.len()];
    let mut kept: Vec<P> = vec![];
    for (i, p) in positions.iter().enumerate().filter(|(i, _)| used[*i]) {
        new_index[i] = kept.len() as u32;
        kept.push(p.map(f64::from));
    }
    let faces: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|v| new_index[v as usize])).collect();
    let (neighbours, start) = topology(kept.len(), &faces)?;
    let mut level = Level { boundary: vec![false; kept.len()], positions: kept, faces, neighbours, start };
    for v in 0..level.positions.len() as u32 {
        let first = level.start[v as usize];
        let mut face = level.across_next(first, v);
        while face != NONE && face != first {
            face = level.across_next(face, v);
        }
        level.boundary[v as usize] = face == NONE;
    }
    for _ in 0..levels {
        level = level.refined();
    }
    let mut ring = vec![];
    let mut limit = Vec::with_capacity(level.positions.len());
    for v in 0..level.positions.len() as u32 {
        level.ring(v, &mut ring);
        limit.push(level.smoothed(v, &ring, limit_weight, 1.0 / 5.0));
    }
    level.positions = limit;
    let mut normals = Vec::with_capacity(level.positions.len());
    let mut directions = vec![];
    for v in 0..level.positions.len() as u32 {
        level.ring(v, &mut ring);
        normals.push(normal(&level, v, &ring, &mut directions).map(|c| c as f32));
    }
    Ok(MeshData {
        positions: level.positions.iter().map(|p| p.map(|c| c as f32)).collect(),
        normals,
        triangles: level.faces,
        ..MeshData::default()
    })
}

/// Cross product of the limit's tangents. `directions` keeps sines and cosines from one vertex to the next: most have as
/// many neighbours.
fn normal(level: &Level, vertex: u32, ring: &[u32], directions: &mut Vec<(f64, f64)>) -> P {
    let (mut s, mut t) = ([0.0; 3], [0.0; 3]);
    let n = ring.len();
    let at = |i: usize| &level.positions[ring[i] as usize];
    let p = &level.positions[vertex as usize];
    if !level.boundary[vertex as usize] {
        if directions.len() != n {
            directions.clear();
            directions.extend((0..n).map(|j| sin_cos(std::f64::consts::TAU * j as f64 / n as f64)));
        }
        for (j, &(sin, cos)) in directions.iter().enumerate() {
            add(&mut s, cos, at(j));
            add(&mut t, sin, at(j));
        }
        return cross(s, t);
    }
    add(&mut s, 1.0, at(n - 1));
    add(&mut s, -1.0, at(0));
    match n {
        2 => {
            add(&mut t, 1.0, at(0));
            add(&mut t, 1.0, at(1));
            add(&mut t, -2.0, p);
        }
        3 => {
            add(&mut t, 1.0, at(1));
            add(&mut t, -1.0, p);
        }
        4 => {
            for (i, w) in [-1.0, 2.0, 2.0, -1.0].into_iter().enumerate() {
                add(&mut t, w, at(i));
            }
            add(&mut t, -2.0, p);
        }
        _ => {
            let theta = std::f64::consts::PI / (n - 1) as f64;
            let (sin, cos) = sin_cos(theta);
            add(&mut t, -sin, at(0));
            add(&mut t, -sin, at(n - 1));
            for k in 1..n - 1 {
                let (sin_k, _) = sin_cos(k as f64 * theta);
                add(&mut t, -(2.0 * cos - 2.0) * sin_k, at(k));
            }
        }
    }
    cross(s, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let p = vec![
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ];
        let f = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        (p, f)
    }

    /// Points on the limit surface do not depend on the level at which they are pushed to it: vertex i of one level
    /// is vertex i of the next. A wrong mask or a wrong limit weight moves them (a weight 1 % off by about 1e-3).
    #[test]
    fn limit_positions_are_the_same_at_every_level() {
        let tetrahedron = (
            vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
            vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        );
        for (p, f) in [octahedron(), tetrahedron] {
            let coarse = subdivide(&p, &f, 1).unwrap();
            let fine = subdivide(&p, &f, 5).unwrap();
            assert_eq!(fine.triangles.len(), f.len() * 4usize.pow(5));
            for (a, b) in coarse.positions.iter().zip(&fine.positions) {
                for i in 0..3 {
                    assert!((a[i] - b[i]).abs() < 1e-6, "{a:?} {b:?}");
                }
            }
        }
    }

    /// By hand from Loop's masks with Warren's weights: 2/5 p + 1/5 of the ring's sum at valence 3, 1/2 p + 1/8 at 4.
    #[test]
    fn limit_positions_of_corners_are_those_of_the_masks() {
        let t = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let m = subdivide(&t, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], 2).unwrap();
        assert!(m.positions[0].iter().all(|c| (c - 0.2).abs() < 1e-6), "{:?}", m.positions[0]);
        let (p, f) = octahedron();
        let m = subdivide(&p, &f, 2).unwrap();
        assert!((m.positions[0][0] - 0.5).abs() < 1e-6, "{:?}", m.positions[0]);
    }

    #[test]
    fn normals_of_a_symmetric_body_point_along_its_axes_and_agree_with_the_faces() {
        let (p, f) = octahedron();
        let m = subdivide(&p, &f, 3).unwrap();
        for i in 0..6 {
            let (n, p) = (m.normals[i], m.positions[i]);
            let dot: f32 = (0..3).map(|k| n[k] * p[k]).sum();
            let lengths = (n.iter().map(|c| c * c).sum::<f32>() * p.iter().map(|c| c * c).sum::<f32>()).sqrt();
            assert!((dot.abs() / lengths - 1.0).abs() < 1e-5);
        }
        // Geometric and limit normals of fine faces differ little.
        let m = subdivide(&p, &f, 5).unwrap();
        for t in &m.triangles {
            let [a, b, c] = t.map(|v| m.positions[v as usize].map(f64::from));
            let e = |x: P, y: P| [y[0] - x[0], y[1] - x[1], y[2] - x[2]];
            let g = cross(e(a, b), e(a, c));
            let n = m.normals[t[0] as usize].map(f64::from);
            let dot: f64 = (0..3).map(|k| g[k] * n[k]).sum();
            let length = |v: P| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            assert!(dot.abs() > 0.97 * length(g) * length(n), "{t:?}");
        }
    }

    #[test]
    fn boundaries_follow_the_cubic_b_spline_of_their_edge_and_flat_meshes_stay_flat() {
        // A flat fan with boundary vertices of valence 2, 3 and 4 and one interior vertex.
        let p: Vec<[f32; 3]> =
            vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1.0, 0.0], [3.0, 1.0, 0.0]];
        let f = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 5, 2]];
        for levels in [0, 1, 3] {
            let m = subdivide(&p, &f, levels).unwrap();
            assert!(m.positions.iter().all(|q| q[2] == 0.0));
            assert!(m.normals.iter().all(|n| n[0].abs() < 1e-6 && n[1].abs() < 1e-6), "{:?}", m.normals);
            let sign = m.normals[0][2].signum();
            assert!(m.normals.iter().all(|n| n[2] * sign > 0.0), "{:?}", m.normals);
            // Boundary vertex 3 has the boundary neighbours 2 and 0: (p2 + 3 p3 + p0) / 5 for these weights.
            let expected = [(2.0 + 0.0 + 0.0) / 5.0, (2.0 + 6.0 + 0.0) / 5.0];
            if levels == 0 {
                assert!(
                    (m.positions[3][0] - expected[0]).abs() < 1e-6 && (m.positions[3][1] - expected[1]).abs() < 1e-6
                );
            }
        }
    }

    /// The weights of a tangent add up to 0, so moving the mesh turns no normal: a wrong weight turns those of
    /// boundary vertices with five neighbours and more by far more than 1e-3.
    #[test]
    fn normals_do_not_depend_on_where_the_mesh_stands() {
        let ring = [[1.0, 0.0, 0.3], [0.7, 0.7, -0.2], [0.0, 1.0, 0.5], [-0.7, 0.7, 0.1], [-1.0, 0.0, 0.4]];
        let p: Vec<[f32; 3]> = std::iter::once([0.0; 3]).chain(ring).collect();
        let f = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        let moved: Vec<[f32; 3]> = p.iter().map(|q| [q[0] + 8.0, q[1] - 16.0, q[2] + 32.0]).collect();
        for levels in 0..3 {
            let (a, b) = (subdivide(&p, &f, levels).unwrap(), subdivide(&moved, &f, levels).unwrap());
            for (m, n) in a.normals.iter().zip(&b.normals) {
                let length = |v: &[f32; 3]| v.iter().map(|c| c * c).sum::<f32>().sqrt();
                let dot: f32 = (0..3).map(|i| m[i] * n[i]).sum();
                assert!(dot > 0.99999 * length(m) * length(n), "{m:?} {n:?}");
            }
        }
    }

    #[test]
    fn bad_meshes_are_refused() {
        let p = vec![[0.0; 3]; 5];
        assert_eq!(subdivide(&p, &[[0, 1, 1]], 1), Err(SubdivisionError::Degenerate { face: 0 }));
        let three = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        assert_eq!(subdivide(&p, &three, 1), Err(SubdivisionError::NotManifold { edge: [0, 1] }));
        let against = [[0, 1, 2], [0, 1, 3]];
        assert!(subdivide(&p, &against, 1).is_err());
        assert_eq!(subdivide(&p, &[[0, 1, 4]], 0).unwrap().positions.len(), 3);
        assert!(subdivide(&[], &[], 3).unwrap().triangles.is_empty());
    }
}
