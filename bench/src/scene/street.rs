//! A street under a clear sky, exactly 250,000 triangles: the headline of the lectures, generated.

use super::{Camera, Material, Mesh, Scene, Sky, shape};
use crate::vector::{V, add, frame, random, scale, unit};
use std::f32::consts::TAU;

/// Triangles of the scene.
pub const FACES: usize = 250_000;

const HALF: f32 = 5.0;
const KERB: f32 = 3.2;
const LENGTH: f32 = 90.0;

/// The parts of one material.
#[derive(Default)]
struct Parts {
    plaster: [Mesh; 4],
    stone: Mesh,
    frames: Mesh,
    glass: Mesh,
    roofs: Mesh,
    cobbles: Mesh,
    pavement: Mesh,
    iron: Mesh,
    bark: Mesh,
    leaves: Mesh,
    cars: [Mesh; 3],
    rubber: Mesh,
}

/// A prism with `n` sides along y.
fn post(mesh: &mut Mesh, foot: V, radius: f32, height: f32, n: usize) {
    let at = |i: usize, y: f32| {
        let phi = TAU * (i % n) as f32 / n as f32;
        add(foot, [radius * phi.cos(), y, radius * phi.sin()])
    };
    for i in 0..n {
        mesh.add_quad([at(i, 0.0), at(i, height), at(i + 1, height), at(i + 1, 0.0)]);
    }
}

/// A window in a front whose wall stands at `x`; `out` is the sign of x towards the street.
fn window(parts: &mut Parts, x: f32, out: f32, y: f32, z: f32, [w, h]: [f32; 2]) {
    let mut bar = |mesh: u8, depth: [f32; 2], ys: [f32; 2], zs: [f32; 2]| {
        let (a, b) = (x + out * depth[0], x + out * depth[1]);
        let target = match mesh {
            0 => &mut parts.frames,
            1 => &mut parts.stone,
            _ => &mut parts.glass,
        };
        target.add_box([a.min(b), ys[0], zs[0]], [a.max(b), ys[1], zs[1]], false);
    };
    bar(2, [0.0, 0.02], [y, y + h], [z, z + w]);
    for (z0, z1) in [(z, z + 0.07), (z + w - 0.07, z + w), (z + w / 2.0 - 0.03, z + w / 2.0 + 0.03)] {
        bar(0, [0.02, 0.07], [y, y + h], [z0, z1]);
    }
    for (y0, y1) in [(y, y + 0.07), (y + h - 0.07, y + h), (y + 0.62 * h, y + 0.62 * h + 0.05)] {
        bar(0, [0.02, 0.07], [y0, y1], [z, z + w]);
    }
    // Sill, lintel, jambs.
    bar(1, [0.0, 0.18], [y - 0.1, y], [z - 0.12, z + w + 0.12]);
    bar(1, [0.0, 0.14], [y + h, y + h + 0.16], [z - 0.1, z + w + 0.1]);
    bar(1, [0.0, 0.09], [y, y + h], [z - 0.12, z]);
    bar(1, [0.0, 0.09], [y, y + h], [z + w, z + w + 0.12]);
}

fn house(parts: &mut Parts, index: usize, out: f32, z0: f32, width: f32) {
    let r = |d| random(index, d);
    let (x, back) = (-out * HALF, -out * (HALF + 9.0));
    let floors = 3 + (2.6 * r(0)) as usize;
    let (ground, storey) = (3.8, 3.0 + 0.4 * r(1));
    let height = ground + storey * floors as f32 + 0.4;
    parts.plaster[index % 4].add_box([x.min(back), 0.0, z0], [x.max(back), height, z0 + width], true);
    // Cornices: one over the ground floor, one under the roof.
    for (y, size) in [(ground - 0.15, 0.18), (height - 0.3, 0.35)] {
        let lip = x + out * size;
        parts.stone.add_box([x.min(lip), y, z0], [x.max(lip), y + 0.25, z0 + width], false);
    }
    let columns = (width / 2.3) as usize;
    let pitch = width / columns as f32;
    for column in 0..columns {
        let z = z0 + pitch * (column as f32 + 0.5) - 0.55;
        for floor in 0..floors {
            window(parts, x, out, ground + storey * floor as f32 + 0.75, z, [1.1, 1.7]);
            // Some have a balcony.
            if random(index * 100 + floor * 10 + column, 3) < 0.2 {
                let y = ground + storey * floor as f32 + 0.55;
                let lip = x + out * 0.75;
                parts.stone.add_box([x.min(lip), y - 0.12, z - 0.3], [x.max(lip), y, z + 1.4], false);
                for bar in 0..14 {
                    let zb = z - 0.28 + 1.66 * bar as f32 / 13.0;
                    post(&mut parts.iron, [lip - out * 0.04, y, zb], 0.015, 0.95, 5);
                }
                parts.iron.add_box([lip - 0.06, y + 0.95, z - 0.3], [lip + 0.02, y + 1.0, z + 1.4], false);
            }
        }
        // Shop windows and a door at the bottom.
        if column == index % columns {
            let (a, b) = (x, x + out * 0.06);
            parts.iron.add_box([a.min(b), 0.12, z - 0.05], [a.max(b), 2.6, z + 1.1], false);
        } else {
            window(parts, x, out, 0.7, z - 0.25, [1.6, 2.2]);
        }
    }
    // The roof: rows of tiles that overlap, from the eaves to the ridge.
    let (rows, tiles) = (14, (width / 0.42) as usize);
    for row in 0..rows {
        let at = |k: f32| (x + out * 0.35 - out * 4.85 * k / rows as f32, height + 3.4 * k / rows as f32);
        let ((xa, ya), (xb, yb)) = (at(row as f32 - 0.1), at(row as f32 + 1.0));
        for tile in 0..tiles {
            let (za, zb) = (z0 + width * tile as f32 / tiles as f32, z0 + width * (tile as f32 + 0.94) / tiles as f32);
            let zm = 0.5 * (za + zb);
            parts.roofs.add_quad([[xa, ya + 0.02, za], [xa, ya + 0.09, zm], [xb, yb + 0.05, zm], [xb, yb, za]]);
            parts.roofs.add_quad([[xa, ya + 0.09, zm], [xa, ya + 0.02, zb], [xb, yb, zb], [xb, yb + 0.05, zm]]);
        }
    }
    let slope = [
        [x + out * 0.35, height, z0],
        [x + out * 0.35, height, z0 + width],
        [back / 2.0 + x / 2.0, height + 3.38, z0 + width],
        [back / 2.0 + x / 2.0, height + 3.38, z0],
    ];
    parts.roofs.add_quad(slope);
    // Chimneys.
    for k in 0..2 {
        let z = z0 + width * (0.25 + 0.5 * k as f32);
        let cx = x - out * 3.5;
        parts.stone.add_box([cx - 0.3, height + 1.5, z - 0.3], [cx + 0.3, height + 4.2, z + 0.3], false);
    }
}

fn car(parts: &mut Parts, index: usize, at: V, towards: f32) {
    let mut body = Mesh::default();
    // Profile along z, extruded in x: bonnet, windscreen, roof, boot.
    let profile =
        [[-2.0, 0.35], [-2.05, 0.75], [-1.2, 0.9], [-0.55, 1.4], [0.8, 1.42], [1.45, 0.95], [2.0, 0.88], [2.05, 0.4]];
    let n = 24;
    let ring = |k: usize, [z, y]: [f32; 2]| -> V {
        let s = 2.0 * k as f32 / n as f32 - 1.0;
        let narrow = if y > 1.0 { 0.74 } else { 0.85 };
        [narrow * s.signum() * s.abs().powf(0.7), y - 0.08 * s * s * s * s, towards * z]
    };
    for pair in profile.windows(2) {
        for k in 0..n {
            body.add_quad([ring(k, pair[0]), ring(k + 1, pair[0]), ring(k + 1, pair[1]), ring(k, pair[1])]);
        }
    }
    for k in [0, n] {
        for pair in profile[1..].windows(2).take(6) {
            let low = |[z, _]: [f32; 2]| [z, 0.35];
            body.add_quad([ring(k, low(pair[0])), ring(k, low(pair[1])), ring(k, pair[1]), ring(k, pair[0])]);
        }
    }
    parts.cars[index % 3].add_mesh(&body, at, 1.0);
    for (x, z) in [(-0.8, -1.25), (0.8, -1.25), (-0.8, 1.3), (0.8, 1.3)] {
        for i in 0..20 {
            let rim = |i: usize, dx: f32| {
                let phi = TAU * i as f32 / 20.0;
                add(at, [x + dx, 0.34 + 0.34 * phi.cos(), z * towards + 0.34 * phi.sin()])
            };
            parts.rubber.add_quad([rim(i, -0.1), rim(i, 0.1), rim(i + 1, 0.1), rim(i + 1, -0.1)]);
            parts.rubber.triangles.extend([-0.1, 0.1].map(|dx| {
                let first = parts.rubber.positions.len() as u32;
                parts.rubber.positions.extend([rim(i, dx), rim(i + 1, dx), add(at, [x + dx, 0.34, z * towards])]);
                [first, first + 1, first + 2]
            }));
        }
    }
}

/// Trunk and branches; gives the tips, around which leaves grow.
fn tree(parts: &mut Parts, index: usize, foot: V) -> Vec<V> {
    post(&mut parts.bark, foot, 0.13, 3.2, 12);
    (0..40)
        .map(|b| {
            let r = |d: u64| random(index * 64 + b, d + 16);
            let phi = TAU * r(0);
            let reach = 1.5 * r(1).sqrt();
            let tip = add(foot, [reach * phi.cos(), 3.0 + 2.6 * r(2), reach * phi.sin()]);
            let base = add(foot, [0.0, 2.6 + 0.5 * r(3), 0.0]);
            let (x, y) = frame(unit([tip[0] - base[0] + 1e-3, tip[1] - base[1], tip[2] - base[2]]));
            for k in 0..3 {
                let side = |k: usize, s: f32| {
                    let phi = TAU * k as f32 / 3.0;
                    add(scale(x, s * phi.cos()), scale(y, s * phi.sin()))
                };
                parts.bark.add_quad([
                    add(base, side(k, 0.03)),
                    add(base, side(k + 1, 0.03)),
                    add(tip, side(k + 1, 0.01)),
                    add(tip, side(k, 0.01)),
                ]);
            }
            tip
        })
        .collect()
}

/// The scene.
pub fn scene() -> Scene {
    let mut parts = Parts::default();
    for (side, out) in [(0, 1.0), (1, -1.0)] {
        let mut z = 8.0;
        for k in 0..12 {
            let index = side * 50 + k;
            let width = 6.5 + 3.0 * random(index, 9);
            z -= width;
            house(&mut parts, index, out, z, width - 0.02);
        }
    }
    // The road: rounded stones in rows.
    parts.pavement.add_quad([
        [-30.0, -0.05, 14.0],
        [30.0, -0.05, 14.0],
        [30.0, -0.05, -LENGTH - 60.0],
        [-30.0, -0.05, -LENGTH - 60.0],
    ]);
    for row in 0..190 {
        let columns = 19;
        for column in 0..columns {
            let r = |d: u64| random(row * 32 + column, d + 32);
            let (sx, sz) = (2.0 * KERB / columns as f32, 0.34);
            let x = -KERB + sx * (column as f32 + 0.5 * (row % 2) as f32);
            let z = 7.0 - sz * row as f32;
            let (top, inset) = (0.015 * r(0), 0.05);
            let (lo, hi) = ([x + 0.01, z + 0.01], [(x + sx - 0.01).min(KERB), z + sz - 0.01]);
            let corner = |i: usize, y: f32, s: f32| -> V {
                let c =
                    [[lo[0] + s, lo[1] + s], [lo[0] + s, hi[1] - s], [hi[0] - s, hi[1] - s], [hi[0] - s, lo[1] + s]];
                [c[i % 4][0], y, c[i % 4][1]]
            };
            parts.cobbles.add_quad([0, 1, 2, 3].map(|i| corner(i, top, inset)));
            for i in 0..4 {
                parts.cobbles.add_quad([
                    corner(i, -0.05, 0.0),
                    corner(i + 1, -0.05, 0.0),
                    corner(i + 1, top, inset),
                    corner(i, top, inset),
                ]);
            }
        }
    }
    // Pavements of slabs, kerbs, lanterns, trees, cars.
    let mut tips = Vec::new();
    for side in [-1.0f32, 1.0] {
        for row in 0..100 {
            let z = 8.0 - row as f32;
            let span = |a: f32, b: f32| ((side * a).min(side * b), (side * a).max(side * b));
            let (x0, x1) = span(KERB, KERB + 0.2);
            parts.stone.add_box([x0, -0.05, z - 0.98], [x1, 0.14, z], true);
            for slab in 0..2 {
                let (x0, x1) = span(KERB + 0.21 + 0.8 * slab as f32, KERB + 1.0 + 0.8 * slab as f32);
                parts.pavement.add_box([x0, -0.05, z - 0.99], [x1, 0.12, z], true);
            }
        }
        for k in 0..9 {
            let index = (side as i32 + 1) as usize * 50 + k;
            let foot = [side * (KERB + 0.55), 0.12, 1.5 - 8.5 * k as f32 - 1.6 * side];
            post(&mut parts.iron, foot, 0.06, 3.6, 12);
            parts.iron.add_mesh(&super::displaced_sphere(10, [0.0, 3.75, 0.0], 0.2, 7), foot, 1.0);
            if k % 2 == 0 {
                tips.extend(tree(&mut parts, index, add(foot, [0.0, 0.0, -4.2])));
            }
            if random(index, 60) < 0.75 {
                car(&mut parts, index, [side * (KERB - 1.05), 0.0, -2.0 - 8.5 * k as f32 - 2.2 * side], -side);
            }
        }
    }
    let named = |parts: Parts| {
        let diffuse = |r, g, b| Material::Diffuse([r, g, b]);
        let [p0, p1, p2, p3] = parts.plaster;
        let [c0, c1, c2] = parts.cars;
        vec![
            shape("ochre", p0, diffuse(0.62, 0.47, 0.28)),
            shape("rose", p1, diffuse(0.6, 0.38, 0.32)),
            shape("cream", p2, diffuse(0.68, 0.63, 0.52)),
            shape("grey", p3, diffuse(0.45, 0.47, 0.48)),
            shape("stone", parts.stone, diffuse(0.55, 0.52, 0.47)),
            shape("frames", parts.frames, diffuse(0.7, 0.7, 0.68)),
            shape("glass", parts.glass, Material::Conductor { f0: [0.25, 0.28, 0.3], alpha: 0.08 }),
            shape("roofs", parts.roofs, diffuse(0.42, 0.17, 0.1)),
            shape("cobbles", parts.cobbles, diffuse(0.25, 0.25, 0.26)),
            shape("pavement", parts.pavement, diffuse(0.4, 0.39, 0.37)),
            shape("iron", parts.iron, diffuse(0.05, 0.06, 0.06)),
            shape("bark", parts.bark, diffuse(0.16, 0.11, 0.07)),
            shape("leaves", parts.leaves, diffuse(0.16, 0.3, 0.06)),
            shape("red", c0, diffuse(0.55, 0.06, 0.04)),
            shape("blue", c1, diffuse(0.07, 0.13, 0.35)),
            shape("white", c2, diffuse(0.75, 0.75, 0.73)),
            shape("rubber", parts.rubber, diffuse(0.03, 0.03, 0.03)),
        ]
    };
    let mut scene = Scene {
        name: "street",
        resolution: [1536, 654],
        max_bounces: 2,
        camera: Camera { origin: [0.9, 1.75, 6.2], target: [-0.2, 3.3, -20.0], fov_x: 66.0 },
        shapes: named(parts),
        sky: Some(Sky {
            horizon: [0.75, 0.8, 0.85],
            zenith: [0.16, 0.32, 0.75],
            ground: [0.15, 0.14, 0.12],
            sun: [900.0, 800.0, 650.0],
            sun_direction: unit([0.62, 0.75, 0.18]),
            sun_width: 0.012,
        }),
    };
    // Leaves make up the number.
    let missing = FACES - scene.triangles();
    let leaves = scene.shapes.iter_mut().find(|s| s.name == "leaves").map(|s| &mut s.geometry);
    if let Some(super::Geometry::Mesh(leaves)) = leaves {
        for i in 0..missing {
            let r = |d: u64| random(i, d + 40);
            let tip = tips[i % tips.len()];
            let off = scale([r(0) + r(1) - 1.0, r(2) + r(3) - 1.0, r(4) + r(5) - 1.0], 0.6);
            let (x, y) = frame(unit([r(6) - 0.5, r(7) - 0.4, r(8) - 0.5001]));
            let middle = add(tip, off);
            let first = leaves.positions.len() as u32;
            leaves.positions.extend([
                add(middle, scale(x, 0.07)),
                add(middle, scale(y, 0.05)),
                add(middle, scale(x, -0.07)),
            ]);
            leaves.triangles.push([first, first + 1, first + 2]);
        }
    }
    scene
}
