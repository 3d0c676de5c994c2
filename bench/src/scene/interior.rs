//! A room with a bright window, a lit closet behind a doorway, and much glossy metal: long paths, indirect light, blurred reflections.

use super::{Camera, Material, Mesh, Scene, Shape, displaced_sphere, lamp, shape};
use crate::scene::Geometry;

pub(super) fn scene() -> Scene {
    let (w, h, d) = (3.0, 2.8, 4.0);
    let mut walls = Mesh::quads(&[
        [[-w, h, -d], [w, h, -d], [w, h, d], [-w, h, d]],
        [[-w, 0.0, -d], [w, 0.0, -d], [w, h, -d], [-w, h, -d]],
        [[w, 0.0, d], [-w, 0.0, d], [-w, h, d], [w, h, d]],
        [[-w, 0.0, d], [-w, 0.0, -d], [-w, h, -d], [-w, h, d]],
        // The right wall has a doorway from z = -1.6 to -0.4, 2.1 high.
        [[w, 0.0, -d], [w, 0.0, -1.6], [w, h, -1.6], [w, h, -d]],
        [[w, 0.0, -0.4], [w, 0.0, d], [w, h, d], [w, h, -0.4]],
        [[w, 2.1, -1.6], [w, 2.1, -0.4], [w, h, -0.4], [w, h, -1.6]],
    ]);
    // The closet behind it.
    let (c0, c1) = (-2.2, 0.2);
    walls.add_quad([[w, h, c0], [w + 1.5, h, c0], [w + 1.5, h, c1], [w, h, c1]]);
    walls.add_quad([[w, 0.0, c0], [w + 1.5, 0.0, c0], [w + 1.5, h, c0], [w, h, c0]]);
    walls.add_quad([[w + 1.5, 0.0, c1], [w, 0.0, c1], [w, h, c1], [w + 1.5, h, c1]]);
    walls.add_quad([[w + 1.5, 0.0, c0], [w + 1.5, 0.0, c1], [w + 1.5, h, c1], [w + 1.5, h, c0]]);
    let window = [[-w + 0.01, 0.9, -2.6], [-w + 0.01, 2.3, -2.6], [-w + 0.01, 2.3, -0.6], [-w + 0.01, 0.9, -0.6]];
    let bulb = [[w + 0.5, h - 0.1, -1.3], [w + 1.0, h - 0.1, -1.3], [w + 1.0, h - 0.1, -0.7], [w + 0.5, h - 0.1, -0.7]];
    let floor = Mesh::quads(&[
        [[-w, 0.0, d], [w, 0.0, d], [w, 0.0, -d], [-w, 0.0, -d]],
        [[w, 0.0, c1], [w + 1.5, 0.0, c1], [w + 1.5, 0.0, c0], [w, 0.0, c0]],
    ]);
    let mut table = Mesh::default();
    table.add_box([-0.9, 0.7, -2.2], [1.1, 0.76, -1.0], false);
    for (x, z) in [(-0.85, -2.15), (1.0, -2.15), (-0.85, -1.1), (1.0, -1.1)] {
        table.add_box([x, 0.0, z], [x + 0.05, 0.7, z + 0.05], true);
    }
    let mut panel = Mesh::default();
    panel.add_box([-1.6, 0.5, -d + 0.01], [1.6, 2.2, -d + 0.06], false);
    let metal = |f0, alpha| Material::Conductor { f0, alpha };
    let ball = |name: &str, centre, radius, material| Shape {
        name: name.into(),
        geometry: Geometry::Sphere { centre, radius },
        material,
        emission: None,
    };
    Scene {
        name: "interior",
        resolution: [320, 240],
        max_bounces: 16,
        camera: Camera { origin: [-0.4, 1.5, 3.7], target: [0.15, 1.0, -1.5], fov_x: 58.0 },
        shapes: vec![
            shape("walls", walls, Material::Diffuse([0.75, 0.72, 0.68])),
            shape("floor", floor, metal([0.45, 0.35, 0.28], 0.2)),
            shape("table", table, metal([0.8, 0.8, 0.82], 0.1)),
            shape("panel", panel, metal([0.75, 0.78, 0.8], 0.05)),
            shape("nugget", displaced_sphere(120, [0.1, 1.13, -1.6], 0.32, 5), metal([0.9, 0.75, 0.4], 0.12)),
            ball("copper", [-1.7, 0.6, -1.2], 0.6, metal([0.9, 0.6, 0.5], 0.15)),
            ball("clay", [1.8, 0.45, 0.6], 0.45, Material::Diffuse([0.5, 0.2, 0.15])),
            lamp("window", Mesh::quads(&[window]), [5.0, 5.4, 6.0]),
            lamp("bulb", Mesh::quads(&[bulb]), [40.0, 44.0, 50.0]),
        ],
        sky: None,
    }
}
