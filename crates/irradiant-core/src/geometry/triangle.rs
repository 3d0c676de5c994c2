//! Meshes, and what a hit of a triangle looks like.
//!
//! Vertices are transformed in `f64` and rounded once. The geometric normal is oriented, as in pbrt-v4, by the shading
//! normals if there are any, else by the winding, `ReverseOrientation` and the handedness of the transform; texture
//! coordinates default to (0,0), (1,0), (1,1).

use super::placement::{add, cross, double, scale, single, sub};
use crate::interaction::Interaction;
use irradiant_math::vector::difference_of_products;
use irradiant_math::{Frame, Normal3, Point2, Point3, Transform, Vec3, gamma};
use irradiant_scene::desc::MeshData;

/// Vertices and faces in render space (or the object's, inside objects).
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub positions: Vec<[f32; 3]>,
    /// One per vertex, not unit, or empty.
    pub normals: Vec<[f32; 3]>,
    /// One per vertex or empty.
    pub tangents: Vec<[f32; 3]>,
    /// One per vertex or empty.
    pub uvs: Vec<[f32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    pub quads: Vec<[u32; 4]>,
    /// The author's face numbers of triangles, then quads; empty where each is its own index.
    pub faces: Vec<u32>,
    /// Winding does not say what is outside, but its opposite.
    pub flip: bool,
}

/// What was left out of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dropped {
    /// Faces with a vertex that is NaN or infinite.
    pub not_finite: usize,
    /// Triangles whose area is exactly zero (no ray can meet them), and faces whose indices are out of range.
    pub degenerate: usize,
}

impl Mesh {
    /// `data` transformed; faces that no ray can meet are left out and counted.
    pub fn new(data: &MeshData, t: &Transform, reverse_orientation: bool) -> (Self, Dropped) {
        let vertices = data.positions.len();
        let per_vertex = |n: usize| n == vertices;
        let direction = |m: [[f64; 3]; 3], v: &[f32; 3]| {
            let v = double(*v);
            [0, 1, 2].map(|i| (m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2]) as f32)
        };
        let linear = [0, 1, 2].map(|i| [t.m[i][0], t.m[i][1], t.m[i][2]]);
        let sign = if reverse_orientation { -1.0 } else { 1.0 };
        let inverse_transpose = [0, 1, 2].map(|i| [t.inv[0][i], t.inv[1][i], t.inv[2][i]].map(|x| x * sign));
        let positions: Vec<[f32; 3]> = data.positions.iter().map(|p| single(t.point64(double(*p)))).collect();
        let normals = if per_vertex(data.normals.len()) { &data.normals[..] } else { &[] };
        let tangents = if per_vertex(data.tangents.len()) { &data.tangents[..] } else { &[] };
        let uvs = if per_vertex(data.uvs.len()) { data.uvs.clone() } else { Vec::new() };

        let mut dropped = Dropped::default();
        let mut faces = Vec::new();
        let has_faces = data.face_indices.len() == data.triangles.len() + data.quads.len();
        let finite = |i: u32| positions[i as usize].iter().all(|c| c.is_finite());
        let in_range = |face: &[u32]| face.iter().all(|&i| (i as usize) < vertices);
        let mut keep = |face: &[u32], number: usize, has_area: &dyn Fn() -> bool| {
            let kept = if !in_range(face) {
                dropped.degenerate += 1;
                false
            } else if !face.iter().all(|&i| finite(i)) {
                dropped.not_finite += 1;
                false
            } else if !has_area() {
                dropped.degenerate += 1;
                false
            } else {
                true
            };
            if kept {
                faces.push(if has_faces { data.face_indices[number] as u32 } else { number as u32 });
            }
            kept
        };
        let corner = |i: u32| double(positions[i as usize]);
        let has_area = |a: u32, b: u32, c: u32| {
            let p = corner(a);
            cross(sub(corner(b), p), sub(corner(c), p)).iter().any(|x| *x != 0.0)
        };
        let mut triangles = Vec::with_capacity(data.triangles.len());
        for (i, f) in data.triangles.iter().enumerate() {
            if keep(f, i, &|| has_area(f[0], f[1], f[2])) {
                triangles.push(*f);
            }
        }
        let mut quads = Vec::with_capacity(data.quads.len());
        for (i, f) in data.quads.iter().enumerate() {
            // Three corners that span an area are enough for a surface.
            let spans = || {
                has_area(f[0], f[1], f[2])
                    || has_area(f[0], f[1], f[3])
                    || has_area(f[0], f[2], f[3])
                    || has_area(f[1], f[2], f[3])
            };
            if keep(f, data.triangles.len() + i, &spans) {
                quads.push(*f);
            }
        }
        if !has_faces && faces.iter().enumerate().all(|(i, &f)| i as u32 == f) {
            faces = Vec::new();
        }
        let mesh = Self {
            normals: normals.iter().map(|n| direction(inverse_transpose, n)).collect(),
            tangents: tangents.iter().map(|s| direction(linear, s)).collect(),
            positions,
            uvs,
            triangles,
            quads,
            faces,
            flip: reverse_orientation != t.swaps_handedness(),
        };
        (mesh, dropped)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.quads[..])
            + size_of_val(&self.faces[..])
    }

    #[inline]
    pub fn position(&self, vertex: u32) -> Point3 {
        self.positions[vertex as usize].into()
    }

    #[inline]
    pub fn normal(&self, vertex: u32) -> Normal3 {
        self.normals[vertex as usize].into()
    }

    /// The author's number of face `index`: triangles first, then quads.
    #[inline]
    pub fn face(&self, index: usize) -> u32 {
        self.faces.get(index).copied().unwrap_or(index as u32)
    }

    /// Texture coordinates of a triangle's corners.
    #[inline]
    pub fn triangle_uvs(&self, triangle: u32) -> [[f32; 2]; 3] {
        if self.uvs.is_empty() {
            return [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        }
        self.triangles[triangle as usize].map(|i| self.uvs[i as usize])
    }

    /// Texture coordinates at barycentric weights `u`, `v` of corners 1 and 2.
    #[inline]
    pub fn triangle_uv(&self, triangle: u32, u: f32, v: f32) -> Point2 {
        interpolate2(&self.triangle_uvs(triangle), [1.0 - u - v, u, v])
    }

    /// The point at barycentric weights `u`, `v`: on the triangle's plane up to the rounding of its coordinates.
    #[inline(always)]
    pub fn triangle_point(&self, triangle: u32, u: f32, v: f32) -> (Point3, Vec3) {
        let [i, j, k] = self.triangles[triangle as usize];
        triangle_point([self.position(i), self.position(j), self.position(k)], u, v)
    }

    /// Fills in all that is known of a hit at weights `u`, `v` of corners 1 and 2 of a triangle.
    pub fn triangle_interaction(&self, triangle: u32, u: f32, v: f32, at: &mut Interaction) {
        let indices = self.triangles[triangle as usize];
        let (p0, p1, p2) = (self.position(indices[0]), self.position(indices[1]), self.position(indices[2]));
        (at.p, at.p_error) = triangle_point([p0, p1, p2], u, v);
        at.face = self.face(triangle as usize);
        let (dp02, dp12) = (p0 - p2, p1 - p2);
        let (mut n, length) = normal_and_length(dp02, dp12);
        // Derivatives of the default coordinates, which span the triangle itself; below a length of 1e-18 squares vanish.
        let (mut dpdu, mut dpdv) = (p1 - p0, p2 - p1);
        let mut is_flat = !(length > 1e-18);
        let (mut d02, mut d12, mut has_uv, mut inverse) = ([-1.0, -1.0], [0.0, -1.0], true, 1.0);
        if self.uvs.is_empty() {
            at.uv = Point2::new(u + v, v);
        } else {
            let uvs = [self.uvs[indices[0] as usize], self.uvs[indices[1] as usize], self.uvs[indices[2] as usize]];
            at.uv = interpolate2(&uvs, [1.0 - u - v, u, v]);
            d02 = [uvs[0][0] - uvs[2][0], uvs[0][1] - uvs[2][1]];
            d12 = [uvs[1][0] - uvs[2][0], uvs[1][1] - uvs[2][1]];
            let determinant = difference_of_products(d02[0], d12[1], d02[1], d12[0]);
            (has_uv, inverse) = (determinant.abs() >= 1e-9, 1.0 / determinant);
            if has_uv {
                dpdu = combine(d12[1], dp02, -d02[1], dp12) * inverse;
                dpdv = combine(d02[0], dp12, -d12[0], dp02) * inverse;
            }
            is_flat = !has_uv || dpdu.cross(dpdv).length_squared() == 0.0;
        }
        if is_flat {
            // pbrt spans the tangent plane around -n here; any frame will do.
            let frame = Frame::from_z(-n.as_vec());
            (dpdu, dpdv) = (frame.x, frame.y);
        }
        if self.flip {
            n = -n;
        }
        at.n = n;
        at.ns = n;
        (at.dpdu, at.dpdv) = (dpdu, dpdv);
        (at.dpdus, at.dpdvs) = (dpdu, dpdv);
        (at.dndus, at.dndvs) = (Normal3::ZERO, Normal3::ZERO);
        if self.normals.is_empty() && self.tangents.is_empty() {
            return;
        }

        let mut ns = n;
        let (mut dndu, mut dndv) = (Normal3::ZERO, Normal3::ZERO);
        if !self.normals.is_empty() {
            let [n0, n1, n2] = indices.map(|i| self.normal(i));
            let sum = n0 * (1.0 - u - v) + n1 * u + n2 * v;
            let length = sum.length();
            // The comparison is false for NaN too.
            if length > 0.0 && length.is_finite() {
                ns = sum / length;
            }
            let (dn1, dn2) = (n0 - n2, n1 - n2);
            if has_uv {
                dndu = combine(d12[1], dn1.as_vec(), -d02[1], dn2.as_vec()).as_normal() * inverse;
                dndv = combine(d02[0], dn2.as_vec(), -d12[0], dn1.as_vec()).as_normal() * inverse;
            } else {
                let dn = (n2 - n0).as_vec().cross((n1 - n0).as_vec());
                let length = dn.length();
                if length > 0.0 && length.is_finite() {
                    let frame = Frame::from_z(dn / length);
                    (dndu, dndv) = (frame.x.as_normal(), frame.y.as_normal());
                }
            }
        }
        let mut ss = dpdu;
        if !self.tangents.is_empty() {
            let [s0, s1, s2] = indices.map(|i| Vec3::from(self.tangents[i as usize]));
            let sum = s0 * (1.0 - u - v) + s1 * u + s2 * v;
            let length_squared = sum.length_squared();
            if length_squared > 0.0 && length_squared.is_finite() {
                ss = sum;
            }
        }
        let mut ts = ns.as_vec().cross(ss);
        if ts.length_squared() > 0.0 {
            ss = ts.cross(ns.as_vec());
        } else {
            let frame = Frame::from_z(ns.as_vec());
            (ss, ts) = (frame.x, frame.y);
        }
        shade(at, ns, ss, ts, dndu, dndv);
    }
}

/// Sets the shading geometry; the geometric normal follows its side.
pub(crate) fn shade(at: &mut Interaction, ns: Normal3, dpdus: Vec3, dpdvs: Vec3, dndus: Normal3, dndvs: Normal3) {
    at.ns = ns;
    at.n = at.n.face_forward(ns.as_vec());
    (at.dpdus, at.dpdvs, at.dndus, at.dndvs) = (dpdus, dpdvs, dndus, dndvs);
    // As pbrt: keep squares of badly scaled derivatives within range.
    while at.dpdus.length_squared() > 1e16 && at.dpdus.is_finite()
        || at.dpdvs.length_squared() > 1e16 && at.dpdvs.is_finite()
    {
        at.dpdus /= 1e8;
        at.dpdvs /= 1e8;
    }
}

/// The normal that the winding says, and the length of the edges' cross product.
#[inline(always)]
pub(super) fn normal_and_length(dp02: Vec3, dp12: Vec3) -> (Normal3, f64) {
    // In f64, so that no triangle with an area loses its normal.
    let (e02, e12) = (double(dp02.to_array()), double(dp12.to_array()));
    let normal = cross(e02, e12);
    let length = super::placement::length(normal);
    let normal = if length > 0.0 && length.is_finite() { scale(normal, 1.0 / length) } else { [0.0, 0.0, 1.0] };
    (single(normal).into(), length)
}

/// A point of a triangle and the bound of its error.
///
/// Evaluated in `f64`, so the point is on the plane up to one rounding; the bound is pbrt's gamma(7) all the same, since
/// the vertices themselves were rounded and flat things made of several triangles are flat to that precision only.
#[inline(always)]
pub(crate) fn triangle_point(p: [Point3; 3], u: f32, v: f32) -> (Point3, Vec3) {
    let [p0, p1, p2] = p;
    let (q0, q1, q2) = (double(p0.to_array()), double(p1.to_array()), double(p2.to_array()));
    let q = add(q0, add(scale(sub(q1, q0), u as f64), scale(sub(q2, q0), v as f64)));
    let size = p0.as_vec().abs() * (1.0 - u - v).abs() + p1.as_vec().abs() * u.abs() + p2.as_vec().abs() * v.abs();
    (single(q).into(), size * gamma(7))
}

#[inline]
pub(crate) fn interpolate2(c: &[[f32; 2]; 3], b: [f32; 3]) -> Point2 {
    Point2::new(b[0] * c[0][0] + b[1] * c[1][0] + b[2] * c[2][0], b[0] * c[0][1] + b[1] * c[1][1] + b[2] * c[2][1])
}

/// a v + b w without cancellation.
#[inline]
fn combine(a: f32, v: Vec3, b: f32, w: Vec3) -> Vec3 {
    Vec3::new(
        difference_of_products(a, v.x, -b, w.x),
        difference_of_products(a, v.y, -b, w.y),
        difference_of_products(a, v.z, -b, w.z),
    )
}
