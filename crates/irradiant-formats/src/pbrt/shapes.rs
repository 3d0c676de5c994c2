//! `Shape`: parameters checked, meshes read and subdivided, curves turned into Bezier segments.

use super::legacy::unknown_name;
use super::params::{Params, Type};
use super::reader::Reader;
use crate::mesh::{curve, loop_subdivision, ply};
use irradiant_scene::desc::{CurveStyle, FloatParam, MeshData, ShapeKind};
use irradiant_scene::{Diagnostic, Severity, Span, Spanned};
use std::sync::Arc;

const SHAPES: &[&str] =
    &["bilinearmesh", "curve", "cylinder", "disk", "loopsubdiv", "plymesh", "sphere", "trianglemesh"];

/// What a shape says of itself; a texture for alpha is resolved later.
pub(crate) struct Shape {
    pub kind: ShapeKind,
    pub alpha: Option<Spanned<FloatParam>>,
    pub alpha_texture: Option<Spanned<String>>,
}

pub(crate) fn shape(r: &Reader, name: &Spanned<String>, p: &Params) -> Option<Shape> {
    let alpha_texture = p.texture_name(r, "alpha");
    // As in pbrt-v4 a number of 1 or more is full opacity.
    let alpha = p.float(r, "alpha").filter(|a| a.value < 1.0).map(|a| a.map(FloatParam::Value));
    let number = |name, default| p.float_or(r, name, default);
    let kind = match name.value.as_str() {
        "sphere" => {
            let radius = number("radius", 1.0);
            Some(ShapeKind::Sphere {
                radius,
                z_min: number("zmin", -radius.value).value,
                z_max: number("zmax", radius.value).value,
                phi_max: number("phimax", 360.0),
            })
        }
        "disk" => Some(ShapeKind::Disk {
            height: number("height", 0.0).value,
            radius: number("radius", 1.0),
            inner_radius: number("innerradius", 0.0).value,
            phi_max: number("phimax", 360.0),
        }),
        "cylinder" => Some(ShapeKind::Cylinder {
            radius: number("radius", 1.0),
            z_min: number("zmin", -1.0).value,
            z_max: number("zmax", 1.0).value,
            phi_max: number("phimax", 360.0),
        }),
        "trianglemesh" => triangles(r, p).map(|m| ShapeKind::Mesh(Arc::new(m))),
        "bilinearmesh" => patches(r, p).map(|m| ShapeKind::Mesh(Arc::new(m))),
        "loopsubdiv" => subdivided(r, p).map(|m| ShapeKind::Mesh(Arc::new(m))),
        "plymesh" => ply_mesh(r, p).map(ShapeKind::Mesh),
        "curve" => curve_data(r, p),
        _ => {
            unknown_name(r, "E0201", "shape", name, SHAPES);
            return None;
        }
    };
    p.finish(r);
    Some(Shape { kind: kind?, alpha: if alpha_texture.is_some() { None } else { alpha }, alpha_texture })
}

/// Vertex indices in groups of `N`, each below the number of vertices.
fn indices<const N: usize>(r: &Reader, list: Spanned<&[i32]>, n_vertices: usize) -> Option<Vec<[u32; N]>> {
    if !list.value.len().is_multiple_of(N) {
        let message = format!("{} indices, which is not a multiple of {N}", list.value.len());
        r.error("E1005", message, list.span);
        return None;
    }
    let limit = n_vertices.min(i32::MAX as usize) as i32;
    if let Some((at, bad)) = list.value.iter().enumerate().find(|(_, i)| !(0..limit).contains(i)) {
        r.push(
            Diagnostic::error("E1004", format!("vertex index {bad} (at position {at}) does not exist"), list.span)
                .help(format!("there are {n_vertices} vertices, 0 to {}", n_vertices.saturating_sub(1))),
        );
        return None;
    }
    Some(list.value.as_chunks::<N>().0.iter().map(|face| face.map(|i| i as u32)).collect())
}

/// A list that must have one item per vertex, or per face; empty when not given.
fn matching<T>(r: &Reader, name: &str, list: Option<Spanned<Vec<T>>>, n: usize, of: &str) -> Option<Vec<T>> {
    match list {
        None => Some(vec![]),
        Some(list) if list.value.len() == n => Some(list.value),
        Some(list) => {
            let message = format!("{} of \"{name}\" for {n} {of}", list.value.len());
            r.error("E1005", message, list.span);
            None
        }
    }
}

/// What triangle and bilinear meshes have in common, and how many vertices there are.
fn vertices(r: &Reader, p: &Params) -> Option<MeshData> {
    // All are asked for before any error ends this, so that none is taken for unknown.
    let positions = p.triples(r, "P", Type::Point3);
    let uvs = p.pairs(r, "uv");
    let normals = p.triples(r, "N", Type::Normal);
    let Some(positions) = positions else {
        if !p.has("P") {
            p.missing(r, "\"point3 P\", the vertices");
        }
        return None;
    };
    let n = positions.value.len();
    Some(MeshData {
        uvs: matching(r, "uv", uvs, n, "vertices")?,
        normals: matching(r, "N", normals, n, "vertices")?,
        positions: positions.value,
        ..MeshData::default()
    })
}

fn face_indices(r: &Reader, p: &Params) -> Option<Spanned<Vec<i32>>> {
    p.integers(r, "faceIndices").map(|l| l.map(<[i32]>::to_vec))
}

fn triangles(r: &Reader, p: &Params) -> Option<MeshData> {
    let tangents = p.triples(r, "S", Type::Vector3);
    let list = p.integers(r, "indices");
    let faces = face_indices(r, p);
    let mut mesh = vertices(r, p)?;
    let n = mesh.positions.len();
    mesh.tangents = matching(r, "S", tangents, n, "vertices")?;
    mesh.triangles = match list {
        Some(list) => indices(r, list, n)?,
        None if n == 3 && !p.has("indices") => vec![[0, 1, 2]],
        None => {
            if !p.has("indices") {
                p.missing(r, "\"integer indices\"");
            }
            return None;
        }
    };
    mesh.face_indices = matching(r, "faceIndices", faces, mesh.triangles.len(), "triangles")?;
    Some(mesh)
}

fn patches(r: &Reader, p: &Params) -> Option<MeshData> {
    // An image after which pbrt-v4 draws light samples: noise, not brightness.
    p.string(r, "emissionfilename");
    let list = p.integers(r, "indices");
    let faces = face_indices(r, p);
    let mut mesh = vertices(r, p)?;
    let n = mesh.positions.len();
    mesh.quads = match list {
        Some(list) => indices(r, list, n)?,
        None if n == 4 && !p.has("indices") => vec![[0, 1, 2, 3]],
        None => {
            if !p.has("indices") {
                p.missing(r, "\"integer indices\"");
            }
            return None;
        }
    };
    mesh.face_indices = matching(r, "faceIndices", faces, mesh.quads.len(), "patches")?;
    Some(mesh)
}

fn subdivided(r: &Reader, p: &Params) -> Option<MeshData> {
    let levels = p.integer_in(r, "levels", 3, 0..=i32::MAX);
    p.string(r, "scheme");
    let positions = p.triples(r, "P", Type::Point3);
    let list = p.integers(r, "indices");
    let (Some(positions), Some(list)) = (positions, list) else {
        for name in ["P", "indices"] {
            if !p.has(name) {
                p.missing(r, &format!("\"{name}\""));
            }
        }
        return None;
    };
    let faces = indices::<3>(r, list, positions.value.len())?;
    let max = r.limits.max_subdivided_faces;
    let total = 4usize.checked_pow(levels.value as u32).and_then(|n| n.checked_mul(faces.len()));
    if total.is_none_or(|n| n > max) {
        let span = if levels.span == Span::NONE { p.span } else { levels.span };
        let message = format!("{} levels of subdivision make more than {max} triangles", levels.value);
        r.error_help("E1009", message, span, "each level makes four of one; 2 to 4 are usual");
        return None;
    }
    loop_subdivision::subdivide(&positions.value, &faces, levels.value as u32)
        .map_err(|e| r.error_help("E1006", e.to_string(), list.span, "no more than two faces may meet at an edge"))
        .ok()
}

fn ply_mesh(r: &Reader, p: &Params) -> Option<Arc<MeshData>> {
    if let Some(texture) = p.texture_name(r, "displacement") {
        r.push(
            Diagnostic::warning("W0107", "displacement is not here yet; the mesh stays as it is", texture.span)
                .not_honoured("displacement: none"),
        );
    }
    for name in ["edgelength", "displacement.edgelength"] {
        p.float(r, name);
    }
    p.bool_or(r, "displacement.uniform", false);
    let Some(name) = p.string(r, "filename").filter(|f| !f.is_empty()) else {
        p.missing(r, "\"string filename\"");
        return None;
    };
    let path = r.resolve(&name);
    if let Some(known) = r.meshes.borrow().get(&path) {
        return known.clone();
    }
    let mesh = r.bytes("mesh", &name, &path, name.span).and_then(|bytes| match ply::read(&bytes) {
        Ok((mesh, remarks)) => {
            for (code, text) in remarks {
                r.push(Diagnostic::new(Severity::Note, code, format!("\"{}\": {text}", name.value), name.span));
            }
            Some(Arc::new(mesh))
        }
        Err(error) => {
            let help = format!("read from {}", path.display());
            r.error_help("E1003", format!("mesh \"{}\": {error}", name.value), name.span, help);
            None
        }
    });
    r.meshes.borrow_mut().insert(path, mesh.clone());
    mesh
}

fn curve_data(r: &Reader, p: &Params) -> Option<ShapeKind> {
    let width = p.float_or(r, "width", 1.0).value;
    let width0 = p.float_or(r, "width0", width).value;
    let width1 = p.float_or(r, "width1", width).value;
    let degree = p.integer_in(r, "degree", 3, 2..=3).value as usize;
    let is_bezier = p.choice(r, "basis", &[("bezier", true), ("bspline", false)], true);
    let styles = [("flat", CurveStyle::Flat), ("cylinder", CurveStyle::Cylinder), ("ribbon", CurveStyle::Ribbon)];
    let style = p.choice(r, "type", &styles, CurveStyle::Flat);
    let normals = p.triples(r, "N", Type::Normal);
    let split_depth = p.integer_in(r, "splitdepth", 3, 0..=10).value as u32;
    let Some(points) = p.triples(r, "P", Type::Point3) else {
        if !p.has("P") {
            p.missing(r, "\"point3 P\", the control points");
        }
        return None;
    };
    let basis = if is_bezier { curve::Basis::Bezier } else { curve::Basis::BSpline };
    let segments = match curve::segments(&points.value, basis, degree) {
        Ok(segments) => segments,
        Err(message) => {
            r.error("E1008", message, points.span);
            return None;
        }
    };
    let normals = match (style, normals) {
        (CurveStyle::Ribbon, Some(n)) if n.value.len() == segments.len() + 1 => n.value,
        (CurveStyle::Ribbon, Some(n)) => {
            let message = format!("{} normals for {} segments", n.value.len(), segments.len());
            r.error_help("E1005", message, n.span, "a ribbon has one normal more than segments");
            return None;
        }
        (CurveStyle::Ribbon, None) => {
            p.missing(r, "\"normal N\" since it is a ribbon");
            return None;
        }
        (_, Some(n)) => {
            r.warning("W0116", "only curves of type \"ribbon\" use normals", n.span);
            vec![]
        }
        (_, None) => vec![],
    };
    let curve = irradiant_scene::desc::CurveData { segments, width0, width1, style, normals, split_depth };
    Some(ShapeKind::Curve(Arc::new(curve)))
}
