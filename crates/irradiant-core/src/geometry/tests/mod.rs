//! What all tests of geometry share: scenes in a few words.

mod batch;
mod braids;
mod emitters;
mod hits;
mod robust;
mod scene;

use super::*;
use irradiant_math::{Normal3, Point2, Point3, Transform, Vec3};
use irradiant_scene::desc::shape::{CurveData, CurveStyle};
use irradiant_scene::desc::{
    AreaLightDesc, ColorSpaceName, FloatParam, InstanceDesc, MaterialRef, MeshData, MotionDesc, ObjectDesc, ObjectRef,
    SceneDesc, ShapeDesc, ShapeKind,
};
use irradiant_scene::{Diagnostics, Span, Spanned};
use irradiant_testkit::Rng;
use std::sync::Arc;

pub(super) fn shape(kind: ShapeKind, t: Transform) -> ShapeDesc {
    ShapeDesc {
        kind,
        world_from_shape: MotionDesc::still(t),
        reverse_orientation: false,
        material: MaterialRef(0),
        area_light: None,
        alpha: None,
        is_medium_boundary: false,
        span: Span::NONE,
    }
}

pub(super) fn emissive(mut s: ShapeDesc) -> ShapeDesc {
    s.area_light = Some(Arc::new(AreaLightDesc {
        radiance: None,
        file: None,
        scale: Spanned::unplaced(1.0),
        group: None,
        two_sided: true,
        power: None,
        color_space: ColorSpaceName::Srgb,
        span: Span::NONE,
    }));
    s
}

pub(super) fn sphere(radius: f32, z_min: f32, z_max: f32, phi_max: f32) -> ShapeKind {
    ShapeKind::Sphere { radius: Spanned::unplaced(radius), z_min, z_max, phi_max: Spanned::unplaced(phi_max) }
}

pub(super) fn ball(radius: f32) -> ShapeKind {
    sphere(radius, -radius, radius, 360.0)
}

pub(super) fn disk(height: f32, radius: f32, inner_radius: f32, phi_max: f32) -> ShapeKind {
    let phi_max = Spanned::unplaced(phi_max);
    ShapeKind::Disk { height, radius: Spanned::unplaced(radius), inner_radius, phi_max }
}

pub(super) fn cylinder(radius: f32, z_min: f32, z_max: f32, phi_max: f32) -> ShapeKind {
    ShapeKind::Cylinder { radius: Spanned::unplaced(radius), z_min, z_max, phi_max: Spanned::unplaced(phi_max) }
}

pub(super) fn triangles(positions: &[[f32; 3]], faces: &[[u32; 3]]) -> ShapeKind {
    ShapeKind::Mesh(Arc::new(MeshData {
        positions: positions.to_vec(),
        triangles: faces.to_vec(),
        ..Default::default()
    }))
}

pub(super) fn patch(corners: [[f32; 3]; 4]) -> ShapeKind {
    ShapeKind::Mesh(Arc::new(MeshData { positions: corners.to_vec(), quads: vec![[0, 1, 2, 3]], ..Default::default() }))
}

pub(super) fn curve(control: [[f32; 3]; 4], width: [f32; 2], style: CurveStyle) -> ShapeKind {
    ShapeKind::Curve(Arc::new(CurveData {
        segments: vec![control],
        width0: width[0],
        width1: width[1],
        style,
        normals: if style == CurveStyle::Ribbon { vec![[0.0, 0.0, 1.0], [0.0, 0.3, 1.0]] } else { vec![] },
        split_depth: 2,
    }))
}

/// Twelve triangles of a cube of half side 1, outside counter-clockwise.
pub(super) fn cube() -> ShapeKind {
    let positions: Vec<[f32; 3]> =
        (0..8).map(|i| [0, 1, 2].map(|b| if i >> b & 1 == 0 { -1.0 } else { 1.0 })).collect();
    let quads = [[0u32, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces: Vec<[u32; 3]> = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    triangles(&positions, &faces)
}

/// A sphere of triangles with vertices on the unit sphere (hence convex), latitude by longitude.
pub(super) fn faceted_ball(rows: u32) -> ShapeKind {
    let columns = 2 * rows;
    let mut positions = vec![];
    for i in 0..=rows {
        for j in 0..columns {
            let theta = std::f64::consts::PI * i as f64 / rows as f64;
            let phi = std::f64::consts::TAU * j as f64 / columns as f64;
            positions.push([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|c| c as f32));
        }
    }
    let at = |i: u32, j: u32| i * columns + j % columns;
    let mut faces = vec![];
    for i in 0..rows {
        for j in 0..columns {
            if i > 0 {
                faces.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            }
            if i + 1 < rows {
                faces.push([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
            }
        }
    }
    triangles(&positions, &faces)
}

pub(super) fn compile(shapes: Vec<ShapeDesc>) -> Geometry {
    compile_desc(&SceneDesc { shapes, ..Default::default() })
}

pub(super) fn compile_desc(desc: &SceneDesc) -> Geometry {
    let mut diagnostics = Diagnostics::default();
    let g = compile_geometry(desc, &Transform::IDENTITY, |m| MaterialId(m.0), &mut diagnostics);
    assert!(!diagnostics.has_errors(), "{diagnostics:?}");
    g
}

pub(super) fn trs(x: f64, y: f64, z: f64, degrees: f64, axis: [f64; 3], s: [f64; 3]) -> Transform {
    Transform::translate(x, y, z)
        .compose(&Transform::rotate(degrees, axis).unwrap())
        .compose(&Transform::scale(s[0], s[1], s[2]).unwrap())
}

/// A shape of each kind, somewhere within about two units of the origin, some cut, some deformed.
pub(super) fn zoo() -> Vec<(&'static str, ShapeDesc)> {
    let even = trs(0.2, -0.3, 0.4, 40.0, [1.0, 2.0, -1.0], [0.7, 0.7, 0.7]);
    let uneven = trs(-0.3, 0.2, 0.1, 75.0, [-1.0, 0.5, 1.0], [1.2, 0.5, 0.8]);
    let twisted = [[-1.0, -0.8, 0.3], [0.9, -1.0, -0.4], [-0.7, 1.0, -0.2], [1.0, 0.8, 0.5]];
    let flat = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    vec![
        ("sphere", shape(ball(1.0), even)),
        ("cut sphere", shape(sphere(1.0, -0.4, 0.7, 250.0), even)),
        ("ellipsoid", shape(ball(1.0), uneven)),
        ("disk", shape(disk(0.3, 1.0, 0.0, 360.0), even)),
        ("cut disk", shape(disk(0.0, 1.3, 0.4, 200.0), uneven)),
        ("cylinder", shape(cylinder(0.8, -0.9, 0.6, 360.0), even)),
        ("cut cylinder", shape(cylinder(0.8, -0.9, 0.6, 230.0), uneven)),
        ("triangle", shape(triangles(&[[-1.0, -1.0, 0.1], [1.2, -0.8, 0.0], [0.1, 1.3, 0.4]], &[[0, 1, 2]]), even)),
        ("cube", shape(cube(), uneven)),
        ("twisted patch", shape(patch(twisted), even)),
        ("rectangle", shape(patch(flat), even)),
    ]
}

pub(super) fn curves() -> Vec<(&'static str, ShapeDesc)> {
    let control = [[-1.0, 0.0, 0.0], [-0.5, 1.0, 0.5], [0.5, -1.0, 0.2], [1.0, 0.2, -0.3]];
    let t = trs(0.1, 0.1, 0.0, 30.0, [0.0, 1.0, 1.0], [0.9, 0.9, 0.9]);
    [("flat", CurveStyle::Flat), ("tube", CurveStyle::Cylinder), ("ribbon", CurveStyle::Ribbon)]
        .map(|(name, style)| (name, shape(curve(control, [0.3, 0.1], style), t)))
        .to_vec()
}

pub(super) fn point(rng: &mut Rng, size: f32) -> Point3 {
    let mut c = || (2.0 * rng.next_f32() - 1.0) * size;
    Point3::new(c(), c(), c())
}

/// A ray from anywhere about towards anywhere within the box of half side `size`.
pub(super) fn ray_through(rng: &mut Rng, size: f32) -> Ray {
    let o = point(rng, 3.0 * size);
    let target = point(rng, size);
    let d = target - o;
    // Directions of any length mean the same.
    let d = d * (0.1 + 3.0 * rng.next_f32());
    Ray::new(o, d, rng.next_f32())
}
