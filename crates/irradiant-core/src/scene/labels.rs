//! What things are called, for path expressions and reports: names that the author gave, else kinds.

use crate::interaction::ShapeId;
use irradiant_scene::SceneDesc;

/// Names of surfaces. Those of lights are in [`LightOrigins`](crate::light::LightOrigins).
#[derive(Clone, Debug, Default)]
pub struct Labels {
    objects: Vec<String>,
    /// By [`ShapeId`]: index into `objects`; shapes of the scene itself come first and belong to none.
    object_of_shape: Vec<u32>,
    first: usize,
}

impl Labels {
    /// Shape ids count the scene's own shapes first, then those of each object, as the compiled geometry does.
    pub(super) fn new(desc: &SceneDesc) -> Self {
        let of_object = |(i, object): (usize, &irradiant_scene::desc::ObjectDesc)| vec![i as u32; object.shapes.len()];
        Self {
            objects: desc.objects.iter().map(|o| o.name.clone()).collect(),
            object_of_shape: desc.objects.iter().enumerate().flat_map(of_object).collect(),
            first: desc.shapes.len(),
        }
    }

    /// Name of the object (`ObjectBegin`) that a shape is part of.
    pub fn object(&self, shape: ShapeId) -> Option<&str> {
        let within = (shape.0 as usize).checked_sub(self.first)?;
        self.object_of_shape.get(within).map(|&o| self.objects[o as usize].as_str())
    }

    /// Names of all objects.
    pub fn objects(&self) -> &[String] {
        &self.objects
    }
}
