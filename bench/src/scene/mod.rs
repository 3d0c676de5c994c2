//! Neutral scenes: what every renderer can be told, and no more.
//!
//! Right-handed world, y up, geometric normals. Each scene is a function of nothing, so that everybody who runs the
//! benchmark renders the same. [`pbrt`] writes them for Irradiant, [`neutral`] for the drivers of the peers.

mod blobs;
mod cornell;
mod interior;
mod lamps;
pub mod mesh;
pub mod neutral;
pub mod pbrt;
mod sky;
pub mod street;
mod veach;

pub use mesh::Mesh;
pub use sky::Sky;

use crate::vector::V;

/// Linear RGB: reflectance in [0, 1], or radiance.
pub type Rgb = [f32; 3];

/// How a surface scatters; black behind nothing: all surfaces are two-sided.
#[derive(Clone, Copy, Debug)]
pub enum Material {
    /// Lambert.
    Diffuse(Rgb),
    /// GGX with Smith shadowing over a conductor with eta = 1 and k = 2 sqrt(f0 / (1 - f0)), reflectance `f0` at normal incidence.
    Conductor {
        /// Reflectance at normal incidence, below 1.
        f0: Rgb,
        /// GGX width.
        alpha: f32,
    },
}

/// A shape's geometry.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(Mesh),
    /// A sphere.
    Sphere {
        /// Centre.
        centre: V,
        /// Radius.
        radius: f32,
    },
}

/// Something to see. Lamps emit on the side of their normals (counter-clockwise seen from there).
#[derive(Clone, Debug)]
pub struct Shape {
    /// Unique in its scene.
    pub name: String,
    /// Where it is.
    pub geometry: Geometry,
    /// How it scatters.
    pub material: Material,
    /// Radiance, if it is a lamp.
    pub emission: Option<Rgb>,
}

/// A pinhole.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Where it stands.
    pub origin: V,
    /// What is in the middle of the picture.
    pub target: V,
    /// Horizontal field of view, degrees.
    pub fov_x: f32,
}

/// A scene with the settings that must be equal for everyone.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Names its folder.
    pub name: &'static str,
    /// Pixels.
    pub resolution: [u32; 2],
    /// Scattering events at most; emission seen directly counts 0.
    pub max_bounces: u32,
    /// The camera.
    pub camera: Camera,
    /// Everything but the sky.
    pub shapes: Vec<Shape>,
    /// Light from afar.
    pub sky: Option<Sky>,
}

impl Scene {
    /// Pixels of the picture.
    pub fn pixels(&self) -> usize {
        self.resolution[0] as usize * self.resolution[1] as usize
    }

    /// Triangles of all meshes.
    pub fn triangles(&self) -> usize {
        let count = |s: &Shape| match &s.geometry {
            Geometry::Mesh(mesh) => mesh.triangles.len(),
            Geometry::Sphere { .. } => 0,
        };
        self.shapes.iter().map(count).sum()
    }
}

/// Names of the scenes of the comparison of pictures.
pub const PICTURES: [&str; 5] = ["cornell", "veach", "mesh", "lamps", "interior"];

/// The scene of a name.
pub fn by_name(name: &str) -> Option<Scene> {
    Some(match name {
        "cornell" => cornell::scene(),
        "veach" => veach::scene(),
        "mesh" => blobs::scene(),
        "lamps" => lamps::scene(1000),
        "interior" => interior::scene(),
        "street" => street::scene(),
        _ => return None,
    })
}

pub use blobs::displaced_sphere;
pub use lamps::scene as hall_with_lamps;

fn shape(name: &str, mesh: Mesh, material: Material) -> Shape {
    Shape { name: name.into(), geometry: Geometry::Mesh(mesh), material, emission: None }
}

fn lamp(name: &str, mesh: Mesh, radiance: Rgb) -> Shape {
    let material = Material::Diffuse([0.0; 3]);
    Shape { name: name.into(), geometry: Geometry::Mesh(mesh), material, emission: Some(radiance) }
}
