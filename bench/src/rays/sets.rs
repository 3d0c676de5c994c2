//! Three scenes and four kinds of ray, the same for everyone.

use super::ours::Tree;
use crate::scene::{Mesh, displaced_sphere};
use crate::vector::{V, add, cross, dot, frame, random, scale, sub, unit};
use irradiant_bvh::Ray;
use std::f32::consts::TAU;

/// A mesh at a place.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Index of the mesh.
    pub mesh: usize,
    /// Where its origin is.
    pub origin: V,
    /// How much larger.
    pub size: f32,
}

/// Meshes, each with one spare vertex at the end of its points (Embree may read beyond the last); instances of them, or themselves.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// All meshes.
    pub meshes: Vec<Mesh>,
    /// Instances; none: every mesh once, where it is.
    pub placements: Vec<Placement>,
}

impl Geometry {
    fn new(mut meshes: Vec<Mesh>, placements: Vec<Placement>) -> Self {
        meshes.iter_mut().for_each(|m| m.positions.push([0.0; 3]));
        Self { meshes, placements }
    }

    /// Triangles, instances counted.
    pub fn triangles(&self) -> usize {
        if self.placements.is_empty() {
            return self.meshes.iter().map(|m| m.triangles.len()).sum();
        }
        self.placements.iter().map(|p| self.meshes[p.mesh].triangles.len()).sum()
    }
}

/// What is seen, from where, and where the lamp is.
pub struct Subject {
    /// As in the tables.
    pub name: &'static str,
    /// What is seen.
    pub geometry: Geometry,
    eye: V,
    target: V,
    /// Tangent of half the angle of view.
    half: f32,
    /// A corner and two edges.
    lamp: [V; 3],
}

/// "objects", "instances", or "displaced-N" for [`displaced`] of N.
pub fn by_name(name: &str) -> Option<Subject> {
    match name {
        "objects" => Some(objects()),
        "instances" => Some(instances()),
        _ => Some(displaced(name.strip_prefix("displaced-")?.parse().ok()?)),
    }
}

fn room(size: f32, height: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box([-size, 0.0, -size], [size, height, size], false);
    mesh
}

/// A million triangles in 500 lumps in a closed room.
pub fn objects() -> Subject {
    let kinds: Vec<Mesh> = (0..8).map(|k| displaced_sphere(32, [0.0; 3], 1.0, 50 + k)).collect();
    let mut meshes = vec![room(10.0, 10.0)];
    for i in 0..500 {
        let r = |d| random(i, d);
        let mut mesh = Mesh::default();
        let at = [-8.5 + 17.0 * r(0), 0.7 + 8.0 * r(1), -8.5 + 17.0 * r(2)];
        mesh.add_mesh(&kinds[i % kinds.len()], at, 0.25 + 0.6 * r(3));
        meshes.push(mesh);
    }
    Subject {
        name: "1 M in 501 objects",
        geometry: Geometry::new(meshes, vec![]),
        eye: [-9.0, 6.0, -9.0],
        target: [0.0, 4.0, 0.0],
        half: 0.7,
        lamp: [[-2.0, 9.9, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]],
    }
}

/// One displaced sphere of `2 n (n - 1)` triangles on a floor, without a sky to hit.
pub fn displaced(n: usize) -> Subject {
    let ground = Mesh::quads(&[[[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]]]);
    Subject {
        name: "1 M displaced mesh",
        geometry: Geometry::new(vec![displaced_sphere(n, [0.0, 1.4, 0.0], 1.4, 1), ground], vec![]),
        eye: [0.0, 2.4, 4.6],
        target: [0.0, 1.3, 0.0],
        half: 0.36,
        lamp: [[-1.0, 5.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]],
    }
}

/// Ten thousand instances of ten lumps of 1,012 triangles, in a room.
pub fn instances() -> Subject {
    let mut meshes: Vec<Mesh> = (0..10).map(|k| displaced_sphere(23, [0.0; 3], 1.0, 70 + k)).collect();
    let mut placements: Vec<Placement> = (0..10_000)
        .map(|i| {
            let r = |d: u64| random(i, d + 8);
            let origin = [-9.0 + 18.0 * r(0), 0.4 + 9.0 * r(1), -9.0 + 18.0 * r(2)];
            Placement { mesh: i % 10, origin, size: 0.08 + 0.25 * r(3) }
        })
        .collect();
    meshes.push(room(10.0, 10.0));
    placements.push(Placement { mesh: 10, origin: [0.0; 3], size: 1.0 });
    Subject { name: "10 M instanced", geometry: Geometry::new(meshes, placements), ..objects() }
}

/// Rays of one kind.
pub struct Set {
    /// As in the tables.
    pub kind: &'static str,
    /// Whether it is asked for anything (or for the closest).
    pub occlusion: bool,
    /// Whether neighbours travel together.
    pub coherent: bool,
    /// The rays.
    pub rays: Vec<Ray>,
}

/// Just off what `rays` meet, and the normal there, facing back.
fn landings(tree: &Tree, rays: &[Ray]) -> Vec<(V, V)> {
    let one = |ray: &Ray| {
        let (t, [a, b, c]) = tree.hit(ray)?;
        let normal = unit(cross(sub(b, a), sub(c, a)));
        let normal = if dot(normal, ray.d) > 0.0 { scale(normal, -1.0) } else { normal };
        Some((add(add(ray.o, scale(ray.d, t)), scale(normal, 1e-4)), normal))
    };
    rays.iter().filter_map(one).collect()
}

fn bounce(landings: &[(V, V)], salt: u64) -> Vec<Ray> {
    let one = |(i, &(o, n)): (usize, &(V, V))| {
        let (u, phi) = (random(i, salt), random(i, salt + 1) * TAU);
        let (x, y) = frame(n);
        let r = u.sqrt();
        let d = add(add(scale(x, r * phi.cos()), scale(y, r * phi.sin())), scale(n, (1.0 - u).sqrt()));
        Ray { o, t_max: f32::INFINITY, d: unit(d), time: 0.0 }
    };
    landings.iter().enumerate().map(one).collect()
}

/// Primary rays in tiles of 4 x 4 pixels, one bounce from each hit, one more, and shadow rays from the first hits to the lamp.
pub fn rays(subject: &Subject, tree: &Tree, width: usize) -> [Set; 4] {
    let forward = unit(sub(subject.target, subject.eye));
    let right = unit(cross(forward, [0.0, 1.0, 0.0]));
    let up = cross(right, forward);
    let mut primary = Vec::new();
    for tile in 0..(width / 4) * (width / 4) {
        for k in 0..16 {
            let pixel = [(tile % (width / 4)) * 4 + k % 4, (tile / (width / 4)) * 4 + k / 4];
            let [x, y] = pixel.map(|p| (2.0 * (p as f32 + 0.5) / width as f32 - 1.0) * subject.half);
            let d = unit(add(forward, sub(scale(right, x), scale(up, y))));
            primary.push(Ray { o: subject.eye, t_max: f32::INFINITY, d, time: 0.0 });
        }
    }
    let first = landings(tree, &primary);
    let one = bounce(&first, 10);
    let two = bounce(&landings(tree, &one), 12);
    let [corner, u, v] = subject.lamp;
    let shadow = first.iter().enumerate().filter_map(|(i, &(o, n))| {
        let d = sub(add(corner, add(scale(u, random(i, 20)), scale(v, random(i, 21)))), o);
        (dot(d, n) > 0.0).then_some(Ray { o, t_max: 0.999, d, time: 0.0 })
    });
    let shadow = shadow.collect();
    let set = |kind, occlusion, coherent, rays| Set { kind, occlusion, coherent, rays };
    [
        set("primary", false, true, primary),
        set("bounce 1", false, false, one),
        set("bounce 2", false, false, two),
        set("occlusion", true, false, shadow),
    ]
}
