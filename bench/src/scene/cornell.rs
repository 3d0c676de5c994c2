//! The Cornell box: diffuse interreflection under one lamp. Geometry after Cornell's published measurements, in metres.

use super::{Camera, Material, Mesh, Scene, lamp, shape};
use crate::vector::V;

const CEILING: f32 = 5.488;
const LAMP: [f32; 4] = [2.13, 3.43, 2.27, 3.32];

fn block(base: [[f32; 2]; 4], height: f32, mesh: &mut Mesh) {
    let at = |i: usize, y: f32| -> V { [base[i % 4][0], y, base[i % 4][1]] };
    mesh.add_quad([at(0, height), at(1, height), at(2, height), at(3, height)]);
    for i in 0..4 {
        mesh.add_quad([at(i, 0.0), at(i, height), at(i + 1, height), at(i + 1, 0.0)]);
    }
}

pub(super) fn scene() -> Scene {
    let h = CEILING;
    let overhead = |[x0, x1, z0, z1]: [f32; 4]| [[x1, h, z0], [x1, h, z1], [x0, h, z1], [x0, h, z0]];
    let [x0, x1, z0, z1] = LAMP;
    let white = Material::Diffuse([0.725, 0.71, 0.68]);
    let room = Mesh::quads(&[
        [[5.528, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 5.592], [5.496, 0.0, 5.592]],
        [[5.496, 0.0, 5.592], [0.0, 0.0, 5.592], [0.0, h, 5.592], [5.56, h, 5.592]],
        // The ceiling around the lamp.
        overhead([0.0, 5.56, 0.0, z0]),
        overhead([0.0, 5.56, z1, 5.592]),
        overhead([0.0, x0, z0, z1]),
        overhead([x1, 5.56, z0, z1]),
    ]);
    let red = Mesh::quads(&[[[5.528, 0.0, 0.0], [5.496, 0.0, 5.592], [5.56, h, 5.592], [5.56, h, 0.0]]]);
    let green = Mesh::quads(&[[[0.0, 0.0, 5.592], [0.0, 0.0, 0.0], [0.0, h, 0.0], [0.0, h, 5.592]]]);
    let mut blocks = Mesh::default();
    block([[1.30, 0.65], [0.82, 2.25], [2.40, 2.72], [2.90, 1.14]], 1.65, &mut blocks);
    // 3.14 was measured and is no pi.
    #[allow(clippy::approx_constant)]
    block([[4.23, 2.47], [2.65, 2.96], [3.14, 4.56], [4.72, 4.06]], 3.30, &mut blocks);
    Scene {
        name: "cornell",
        resolution: [256, 256],
        max_bounces: 16,
        camera: Camera { origin: [2.78, 2.73, -8.0], target: [2.78, 2.73, 0.0], fov_x: 39.3077 },
        shapes: vec![
            shape("room", room, white),
            shape("red", red, Material::Diffuse([0.63, 0.065, 0.05])),
            shape("green", green, Material::Diffuse([0.14, 0.45, 0.091])),
            shape("blocks", blocks, white),
            lamp("lamp", Mesh::quads(&[overhead(LAMP)]), [17.0, 12.0, 4.0]),
        ],
        sky: None,
    }
}
