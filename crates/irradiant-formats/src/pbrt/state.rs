//! What directives change, and what they leave to be resolved when all files are read.

use super::params::{Param, Params};
use irradiant_math::Transform;
use irradiant_scene::desc::{AreaLightDesc, ColorSpaceName, MotionDesc, ShapeDesc};
use irradiant_scene::{Span, Spanned};
use std::rc::Rc;
use std::sync::Arc;

/// The transforms at the start and at the end of the shutter.
pub(crate) type TransformPair = [Transform; 2];

/// The material that shapes get: one of the list, or a name that may be defined later.
#[derive(Clone, Debug)]
pub(crate) enum MaterialUse {
    Index(u32),
    Named(Rc<Spanned<String>>),
}

/// The media on the two sides of shapes; `None` is vacuum.
#[derive(Clone, Debug, Default)]
pub(crate) struct MediumUse {
    pub inside: Option<Rc<Spanned<String>>>,
    pub outside: Option<Rc<Spanned<String>>>,
}

/// Parameters given by `Attribute` statements, oldest first.
pub(crate) type Attributes = Rc<Vec<Rc<Param>>>;

/// What `AttributeBegin` saves.
#[derive(Clone)]
pub(crate) struct GraphicsState {
    pub transforms: TransformPair,
    /// Which of the two the transform statements change.
    pub active: [bool; 2],
    pub reverse_orientation: bool,
    pub material: MaterialUse,
    pub area_light: Option<Arc<AreaLightDesc>>,
    pub media: MediumUse,
    pub color_space: ColorSpaceName,
    pub times: [f64; 2],
    pub shape_attributes: Attributes,
    pub light_attributes: Attributes,
    pub material_attributes: Attributes,
    pub medium_attributes: Attributes,
    pub texture_attributes: Attributes,
}

impl Default for GraphicsState {
    fn default() -> Self {
        Self {
            transforms: [Transform::IDENTITY; 2],
            active: [true; 2],
            reverse_orientation: false,
            material: MaterialUse::Index(0),
            area_light: None,
            media: MediumUse::default(),
            color_space: ColorSpaceName::default(),
            times: [0.0, 1.0],
            shape_attributes: Rc::default(),
            light_attributes: Rc::default(),
            material_attributes: Rc::default(),
            medium_attributes: Rc::default(),
            texture_attributes: Rc::default(),
        }
    }
}

impl GraphicsState {
    pub fn is_animated(&self) -> bool {
        self.transforms[0].m != self.transforms[1].m
    }

    pub fn motion(&self) -> MotionDesc {
        let [start, end] = self.transforms;
        MotionDesc { start, end, start_time: self.times[0], end_time: self.times[1] }
    }
}

/// A texture whose parameters are looked at when all names are known.
pub(crate) struct PendingTexture {
    pub name: Spanned<String>,
    pub is_float: bool,
    pub kind: Spanned<String>,
    pub params: Params,
    pub world_from_texture: Transform,
}

/// A material alike.
pub(crate) struct PendingMaterial {
    pub name: Option<Spanned<String>>,
    pub kind: Spanned<String>,
    pub params: Params,
}

/// A shape that lacks its material and alpha texture.
pub(crate) struct PendingShape {
    pub desc: ShapeDesc,
    pub material: MaterialUse,
    pub alpha_texture: Option<Spanned<String>>,
    pub media: MediumUse,
}

/// An object alike.
pub(crate) struct PendingObject {
    pub name: String,
    pub shapes: Vec<PendingShape>,
    pub span: Span,
}

/// An instance of an object that may be defined later.
pub(crate) struct PendingInstance {
    pub name: Spanned<String>,
    pub world_from_object: MotionDesc,
}
