//! Two displaced spheres of half a million triangles each, one diffuse, one of rough gold, under a sunny sky.

use super::{Camera, Material, Mesh, Scene, Sky, shape};
use crate::vector::{V, add, dot, random, scale, unit};
use std::f32::consts::{PI, TAU};

/// A sphere of `2 n (n - 1)` triangles, displaced by six octaves of four waves each.
pub fn displaced_sphere(n: usize, centre: V, radius: f32, seed: usize) -> Mesh {
    let waves: Vec<(V, f32, f32)> = (0..24)
        .map(|w| {
            let octave = (w / 4) as i32;
            let r = |d| random(seed * 1000 + w, d);
            let z = 2.0 * r(0) - 1.0;
            let (s, phi) = ((1.0 - z * z).sqrt(), TAU * r(1));
            let direction = scale([s * phi.cos(), z, s * phi.sin()], 3.0 * 2f32.powi(octave));
            (direction, TAU * r(2), 0.055 * 0.58f32.powi(octave))
        })
        .collect();
    let mut mesh = Mesh::default();
    for i in 0..=n {
        let theta = PI * i as f32 / n as f32;
        for j in 0..n {
            let phi = TAU * j as f32 / n as f32;
            let d = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            let height: f32 = waves.iter().map(|&(k, phase, size)| size * (dot(k, d) + phase).sin()).sum();
            mesh.positions.push(add(centre, scale(d, radius * (1.0 + height))));
        }
    }
    let at = |i: usize, j: usize| (i * n + j % n) as u32;
    for i in 0..n {
        for j in 0..n {
            if i > 0 {
                mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            }
            if i + 1 < n {
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    mesh
}

pub(super) fn scene() -> Scene {
    let g = 30.0;
    let ground = Mesh::quads(&[[[-g, 0.0, g], [g, 0.0, g], [g, 0.0, -g], [-g, 0.0, -g]]]);
    let gold = Material::Conductor { f0: [0.9, 0.75, 0.4], alpha: 0.2 };
    Scene {
        name: "mesh",
        resolution: [256, 256],
        max_bounces: 16,
        camera: Camera { origin: [0.0, 2.6, 6.5], target: [0.0, 1.0, 0.0], fov_x: 40.0 },
        shapes: vec![
            shape("clay", displaced_sphere(501, [-1.15, 1.05, 0.0], 1.0, 1), Material::Diffuse([0.6, 0.5, 0.4])),
            shape("gold", displaced_sphere(501, [1.15, 1.05, 0.2], 1.0, 2), gold),
            shape("ground", ground, Material::Diffuse([0.4; 3])),
        ],
        sky: Some(Sky {
            horizon: [0.55, 0.6, 0.65],
            zenith: [0.12, 0.25, 0.6],
            ground: [0.12, 0.1, 0.08],
            sun: [200.0, 180.0, 150.0],
            sun_direction: unit([0.55, 0.6, 0.58]),
            sun_width: 0.04,
        }),
    }
}
