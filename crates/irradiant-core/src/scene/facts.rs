//! What a scene holds, in numbers.

/// Counts and sizes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Kind of camera.
    pub camera: String,
    /// Shapes as the author wrote them.
    pub shapes: usize,
    /// Triangles, instanced ones counted once.
    pub triangles: usize,
    /// Primitives that are not triangles, instanced ones counted once.
    pub other_primitives: usize,
    /// Instances.
    pub instances: usize,
    /// Materials.
    pub materials: usize,
    /// Names of materials, or their kinds.
    pub material_names: Vec<String>,
    /// Textures.
    pub textures: usize,
    /// Image files in memory.
    pub images: usize,
    /// Their size.
    pub image_bytes: usize,
    /// Lights of all kinds; each emitting triangle is one.
    pub lights: usize,
    /// Of them: parts of shapes.
    pub area_lights: usize,
    /// Of them: environments.
    pub infinite_lights: usize,
    /// Vertices, trees and the like.
    pub geometry_bytes: usize,
}
