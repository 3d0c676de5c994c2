//! A hall of columns lit by many small lamps of very different power: which lamp to ask is the question.

use super::{Camera, Material, Mesh, Scene, lamp, shape};
use crate::vector::random;

/// The hall with `count` square lamps, their power spread over a factor of 100.
pub fn scene(count: usize) -> Scene {
    let (w, h, d) = (12.0, 6.0, 20.0);
    let room = Mesh::quads(&[
        [[-w, 0.0, d], [w, 0.0, d], [w, 0.0, -d], [-w, 0.0, -d]],
        [[-w, h, -d], [w, h, -d], [w, h, d], [-w, h, d]],
        [[-w, 0.0, -d], [w, 0.0, -d], [w, h, -d], [-w, h, -d]],
        [[w, 0.0, d], [-w, 0.0, d], [-w, h, d], [w, h, d]],
        [[-w, 0.0, d], [-w, 0.0, -d], [-w, h, -d], [-w, h, d]],
        [[w, 0.0, -d], [w, 0.0, d], [w, h, d], [w, h, -d]],
    ]);
    let (mut columns, mut plinths) = (Mesh::default(), Mesh::default());
    for i in 0..5 {
        for side in [-1.0f32, 1.0] {
            let (x, z) = (side * 5.0, -15.0 + 7.0 * i as f32);
            columns.add_box([x - 0.6, 0.0, z - 0.6], [x + 0.6, h, z + 0.6], true);
            plinths.add_box([x - 2.6, 0.0, z + 2.6], [x - 1.4, 1.0, z + 3.8], true);
        }
    }
    let mut shapes = vec![
        shape("room", room, Material::Diffuse([0.6, 0.58, 0.55])),
        shape("columns", columns, Material::Diffuse([0.5, 0.35, 0.25])),
        shape("plinths", plinths, Material::Conductor { f0: [0.9, 0.75, 0.4], alpha: 0.15 }),
    ];
    // The same light in all for any count.
    let size = 0.06;
    let mean = 9000.0 / count as f32;
    for i in 0..count {
        let r = |k| random(i, k);
        let at = [(2.0 * r(0) - 1.0) * (w - 0.5), 0.8 + (h - 1.2) * r(1), (2.0 * r(2) - 1.0) * (d - 0.5)];
        let power = mean * 100f32.powf(r(3)) / 21.5;
        let colour = [1.0, 0.55 + 0.4 * r(4), 0.3 + 0.6 * r(5)].map(|c| c * power);
        let [x, y, z] = at;
        let quad = [[x - size, y, z - size], [x + size, y, z - size], [x + size, y, z + size], [x - size, y, z + size]];
        shapes.push(lamp(&format!("lamp{i}"), Mesh::quads(&[quad]), colour));
    }
    Scene {
        name: "lamps",
        resolution: [384, 216],
        max_bounces: 8,
        camera: Camera { origin: [1.0, 2.4, 19.0], target: [-0.5, 2.0, 0.0], fov_x: 62.0 },
        shapes,
        sky: None,
    }
}
