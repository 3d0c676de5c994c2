//! Four glossy plates under lamps of four sizes, after Veach 1997, figure 9.2: where sampling lamps and sampling materials must share the work.

use super::{Camera, Geometry, Material, Mesh, Scene, Shape, shape};

pub(super) fn scene() -> Scene {
    // Edges (y, z) of each plate, then its roughness.
    let plates = [
        ([-2.70651, 0.25609], [-2.08375, -0.526323], 0.005),
        ([-3.28825, 1.36972], [-2.83856, 0.476536], 0.02),
        ([-3.73096, 2.70046], [-3.43378, 1.74564], 0.05),
        ([-3.99615, 4.0667], [-3.82069, 3.08221], 0.1),
    ];
    let floor = Mesh::quads(&[
        [[-10.0, -4.14615, -10.0], [-10.0, -4.14615, 20.0], [10.0, -4.14615, 20.0], [10.0, -4.14615, -10.0]],
        [[-10.0, -10.0, -2.0], [10.0, -10.0, -2.0], [10.0, 10.0, -2.0], [-10.0, 10.0, -2.0]],
    ]);
    let mut shapes = vec![shape("floor", floor, Material::Diffuse([0.4; 3]))];
    for (i, ([y0, z0], [y1, z1], alpha)) in plates.into_iter().enumerate() {
        let quad = [[4.0, y0, z0], [4.0, y1, z1], [-4.0, y1, z1], [-4.0, y0, z0]];
        let material = Material::Conductor { f0: [0.35, 0.45, 0.65], alpha };
        shapes.push(shape(&format!("plate{i}"), Mesh::quads(&[quad]), material));
    }
    let lamps = [
        ([10.0, 10.0, 4.0], 0.5, 800.0),
        ([-3.75, 0.0, 0.0], 0.03333, 901.803),
        ([-1.25, 0.0, 0.0], 0.1, 100.0),
        ([1.25, 0.0, 0.0], 0.3, 11.1111),
        ([3.75, 0.0, 0.0], 0.9, 1.23457),
    ];
    for (i, (centre, radius, radiance)) in lamps.into_iter().enumerate() {
        shapes.push(Shape {
            name: format!("lamp{i}"),
            geometry: Geometry::Sphere { centre, radius },
            material: Material::Diffuse([0.0; 3]),
            emission: Some([radiance; 3]),
        });
    }
    Scene {
        name: "veach",
        resolution: [384, 256],
        max_bounces: 16,
        camera: Camera { origin: [0.0, 6.0, 27.5], target: [0.0, -1.5, 2.5], fov_x: 25.0 },
        shapes,
        sky: None,
    }
}
