//! Shapes.

use super::{AreaLightDesc, FloatParam, MaterialRef, MotionDesc};
use crate::span::{Span, Spanned};
use std::sync::Arc;

/// A shape with its place, material and emission.
#[derive(Clone, Debug)]
pub struct ShapeDesc {
    /// What kind.
    pub kind: ShapeKind,
    /// World (or the object's own space, inside objects) from shape space.
    pub world_from_shape: MotionDesc,
    /// Normals flipped (`ReverseOrientation`).
    pub reverse_orientation: bool,
    /// What it is made of.
    pub material: MaterialRef,
    /// Whether and how it emits.
    pub area_light: Option<Arc<AreaLightDesc>>,
    /// Opacity: the surface is there with this probability.
    pub alpha: Option<Spanned<FloatParam>>,
    /// Different media inside and outside: it is a boundary (media are vacuum for now).
    pub is_medium_boundary: bool,
    /// Where it was said.
    pub span: Span,
}

/// Vertices and faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions, shape space.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals, empty or one per vertex.
    pub normals: Vec<[f32; 3]>,
    /// Tangents, empty or one per vertex.
    pub tangents: Vec<[f32; 3]>,
    /// Texture coordinates, empty or one per vertex.
    pub uvs: Vec<[f32; 2]>,
    /// Three vertex indices per triangle, checked against `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Four vertex indices per bilinear patch (pbrt's order: (0,0), (1,0), (0,1), (1,1)), checked.
    pub quads: Vec<[u32; 4]>,
    /// For each triangle, then each quad: index of the face in the file; may be empty.
    pub face_indices: Vec<i32>,
}

/// Kinds of shape, in their own space.
#[derive(Clone, Debug)]
pub enum ShapeKind {
    /// At the origin; z-clipped, partial in phi.
    Sphere {
        /// Radius.
        radius: Spanned<f32>,
        /// Least z.
        z_min: f32,
        /// Greatest z.
        z_max: f32,
        /// Sweep, degrees.
        phi_max: Spanned<f32>,
    },
    /// At height z, with a hole, partial in phi.
    Disk {
        /// z.
        height: f32,
        /// Radius.
        radius: Spanned<f32>,
        /// Radius of the hole.
        inner_radius: f32,
        /// Sweep, degrees.
        phi_max: Spanned<f32>,
    },
    /// Around z, partial in phi.
    Cylinder {
        /// Radius.
        radius: Spanned<f32>,
        /// Least z.
        z_min: f32,
        /// Greatest z.
        z_max: f32,
        /// Sweep, degrees.
        phi_max: Spanned<f32>,
    },
    /// Triangles and bilinear patches; given in the scene, read from a PLY file, or subdivided by the reader.
    Mesh(Arc<MeshData>),
    /// A curve of one or more cubic Bezier segments (the reader has converted b-splines and degree 2).
    Curve(Arc<CurveData>),
}

/// A chain of cubic Bezier segments with varying width.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveData {
    /// Four control points for each segment.
    pub segments: Vec<[[f32; 3]; 4]>,
    /// Width at the start of the whole curve.
    pub width0: f32,
    /// Width at its end.
    pub width1: f32,
    /// What it looks like close up.
    pub style: CurveStyle,
    /// For ribbons: normals at the segments' ends, one more than segments.
    pub normals: Vec<[f32; 3]>,
    /// Each segment is split in 2^this pieces for the acceleration structure.
    pub split_depth: u32,
}

/// What a curve looks like close up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurveStyle {
    /// A strip that faces every ray.
    #[default]
    Flat,
    /// Shaded as a tube.
    Cylinder,
    /// A strip with given normals.
    Ribbon,
}
