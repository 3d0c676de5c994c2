//! From the description to the texture graph: names to indices, constants folded, images read, ranges checked.
//!
//! Textures of numbers are compiled all at once; those of spectra when a material or light asks, since what they mean
//! depends on its role (a reflectance, an index of refraction, light).

use super::graph::{BasicNode, FloatNode, Octaves, SpectrumNode};
use super::image::{self, Grade, ImageKey};
use super::mapping::{Mapping, texture_from_render};
use super::{FloatNodeId, FloatValue, ImageId, SpectrumId, SpectrumNodeId, SpectrumValue, Textures, role_key};
use irradiant_math::{Affine, Transform, Vec3};
use irradiant_scene::desc::texture::{BasicTexture, FloatTextureKind, ImageMapDesc, SpectrumTextureKind, TextureDesc};
use irradiant_scene::desc::{
    ColorSpaceName, FloatParam, MappingDesc, SceneDesc, SpannedFloat, SpannedSpectrum, SpectrumDesc, SpectrumParam,
};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{Assets, Diagnostic, Diagnostics, Span};
use irradiant_spectrum::{ColorSpace, Role, Spectrum};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Most nodes that one lookup may visit: a chain of textures can double them at each link.
const MAX_VISITS: u32 = 1000;

/// The colour space of a name.
pub(crate) fn color_space(name: ColorSpaceName) -> &'static ColorSpace {
    match name {
        ColorSpaceName::Srgb => ColorSpace::srgb(),
        ColorSpaceName::DciP3 => ColorSpace::dci_p3(),
        ColorSpaceName::Rec2020 => ColorSpace::rec2020(),
        ColorSpaceName::Aces2065_1 => ColorSpace::aces2065_1(),
    }
}

/// A described texture on its way.
enum Built<V> {
    /// Nothing to do at a hit.
    Value(V),
    Basic(BasicNode<V>),
    Image {
        image: ImageId,
        mapping: Mapping,
        grade: Grade,
    },
    /// Reported.
    Failed,
}

struct Compiler<'a> {
    desc: &'a SceneDesc,
    textures: &'a mut Textures,
    diagnostics: &'a mut Diagnostics,
    /// Textures of numbers that are compiled or being compiled; shorter once all are.
    started: Vec<bool>,
    finished: Vec<Option<FloatValue>>,
    /// Textures of spectra being compiled.
    open: Vec<u32>,
}

impl Textures {
    /// All textures of a scene. `space` is the film's colour space, the RGB that renders in RGB work in.
    ///
    /// Images are decoded side by side; the result does not depend on it. What is wrong goes to `diagnostics`.
    pub fn compile(
        desc: &SceneDesc,
        render_from_world: &Transform,
        assets: &dyn Assets,
        space: &'static ColorSpace,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let mut textures = Self {
            float_nodes: Vec::new(),
            spectrum_nodes: Vec::new(),
            images: Vec::new(),
            spectra: Vec::new(),
            floats: Vec::new(),
            spectrum_textures: BTreeMap::new(),
            image_ids: BTreeMap::new(),
            visits: Default::default(),
            space,
            render_from_world: *render_from_world,
            unfiltered: desc.options.disable_texture_filtering,
            footprint_needed: false,
            described: desc.float_textures.len() + desc.spectrum_textures.len(),
        };
        textures.load_images(desc, assets, diagnostics);
        let count = desc.float_textures.len();
        let mut compiler = Compiler {
            desc,
            textures: &mut textures,
            diagnostics,
            started: vec![false; count],
            finished: vec![None; count],
            open: Vec::new(),
        };
        for index in 0..count {
            compiler.float_texture(index as u32, desc.float_textures[index].span);
        }
        let finished = compiler.finished;
        textures.floats = finished.into_iter().map(|v| v.unwrap_or(FloatValue::Constant(0.5))).collect();
        textures
    }

    fn load_images(&mut self, desc: &SceneDesc, assets: &dyn Assets, diagnostics: &mut Diagnostics) {
        let floats = desc.float_textures.iter().filter_map(|t| match &t.kind {
            FloatTextureKind::Basic(BasicTexture::ImageMap(image)) => Some(image),
            _ => None,
        });
        let spectra = desc.spectrum_textures.iter().filter_map(|t| match &t.kind {
            SpectrumTextureKind::Basic(BasicTexture::ImageMap(image)) => Some(image),
            _ => None,
        });
        let mut wanted: Vec<(ImageKey, &ImageMapDesc)> = Vec::new();
        for image in floats.chain(spectra) {
            let key = ImageKey::new(image);
            if self.image_ids.insert(key.clone(), None).is_none() {
                wanted.push((key, image));
            }
        }
        let loaded: Vec<_> = wanted.par_iter().map(|(_, image)| image::load(image, assets)).collect();
        for ((key, _), result) in wanted.into_iter().zip(loaded) {
            match result {
                Ok((texture, warning)) => {
                    warning.into_iter().for_each(|w| diagnostics.push(w));
                    self.images.push(texture);
                    self.image_ids.insert(key, Some(ImageId(self.images.len() as u32 - 1)));
                }
                Err(why) => diagnostics.push(*why),
            }
        }
    }

    /// What a parameter of the description is, in the role that it plays there: `what` names it in messages.
    ///
    /// A reflectance that is a constant outside [0, 1], and anything negative, is an error; tables are clamped later.
    pub fn spectrum_value(
        &mut self,
        desc: &SceneDesc,
        param: &SpannedSpectrum,
        role: Role,
        what: &str,
        diagnostics: &mut Diagnostics,
    ) -> SpectrumValue {
        let open = Vec::new();
        let mut compiler =
            Compiler { desc, textures: self, diagnostics, started: Vec::new(), finished: Vec::new(), open };
        match &param.value {
            SpectrumParam::Value(value) => compiler.constant(value, role, param.span, what),
            SpectrumParam::Texture(texture) => compiler.spectrum_texture(texture.0, role, param.span),
        }
    }

    /// Adds a constant spectrum.
    pub(crate) fn add_spectrum(&mut self, spectrum: Spectrum) -> SpectrumValue {
        self.spectra.push(spectrum);
        SpectrumValue::Constant(SpectrumId(self.spectra.len() as u32 - 1))
    }

    fn visits_of_float(&self, v: FloatValue) -> u32 {
        match v {
            FloatValue::Constant(_) => 0,
            FloatValue::Node(id) => self.visits.floats[id.0 as usize],
        }
    }

    fn visits_of_spectrum(&self, v: SpectrumValue) -> u32 {
        match v {
            SpectrumValue::Constant(_) => 0,
            SpectrumValue::Node(id) => self.visits.spectra[id.0 as usize],
        }
    }
}

/// What a described spectrum is, in a role and with RGB lanes of `space`. The message names what is wrong.
pub(crate) fn spectrum(
    value: &SpectrumDesc,
    role: Role,
    space: &'static ColorSpace,
    span: Span,
    what: &str,
) -> Result<Spectrum, Box<Diagnostic>> {
    let invalid = |message: String| Box::new(Diagnostic::error("E0605", message, span));
    let range = |v: f32| {
        if !v.is_finite() {
            return Err(invalid(format!("{what} is not a finite number")));
        }
        if v < 0.0 {
            return Err(invalid(format!("{what} is negative: {v}")));
        }
        if role == Role::Reflectance && v > 1.0 {
            let message = format!("{what} is {v}, but no surface reflects more than 1");
            let help =
                "is this meant to shine? Light is said with AreaLightSource; a texture's \"scale\" is not limited";
            return Err(Box::new(Diagnostic::error("E0701", message, span).help(help)));
        }
        Ok(())
    };
    Ok(match value {
        SpectrumDesc::Constant(v) => {
            range(*v)?;
            Spectrum::constant(*v, role, space)
        }
        SpectrumDesc::Rgb(rgb, own) => {
            rgb.iter().try_for_each(|v| range(*v))?;
            let own = color_space(*own);
            let s = Spectrum::rgb(*rgb, role, own);
            if own == space { s } else { s.in_space(space) }
        }
        SpectrumDesc::Blackbody(kelvin) => {
            if !(kelvin.is_finite() && *kelvin > 0.0) {
                return Err(invalid(format!("{what} is a black body of {kelvin} K; temperatures are above 0")));
            }
            Spectrum::blackbody(*kelvin, role, space)
        }
        SpectrumDesc::Named(name) => match irradiant_spectrum::named(name) {
            Some(s) => s.with_role(role, space),
            None => {
                let error = Diagnostic::error("E0606", format!("there is no spectrum called \"{name}\""), span);
                let guess = did_you_mean(name, irradiant_spectrum::names());
                return Err(Box::new(match guess {
                    Some(guess) => error.help(format!("did you mean \"{guess}\"?")),
                    None => error,
                }));
            }
        },
        SpectrumDesc::Samples(samples) => {
            let (lambda, values): (Vec<f32>, Vec<f32>) = samples.iter().copied().unzip();
            if let Some(v) = values.iter().find(|v| **v < 0.0) {
                return Err(invalid(format!("{what} has a negative value: {v}")));
            }
            match Spectrum::piecewise_linear(&lambda, &values, role, space) {
                Ok(s) => s,
                Err(why) => return Err(invalid(format!("{what}: {why}"))),
            }
        }
    })
}

impl Compiler<'_> {
    fn error(&mut self, code: &'static str, message: String, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn constant(&mut self, value: &SpectrumDesc, role: Role, span: Span, what: &str) -> SpectrumValue {
        let space = self.textures.space;
        let spectrum = match spectrum(value, role, space, span, what) {
            Ok(s) => s,
            Err(why) => {
                self.diagnostics.push(*why);
                Spectrum::constant(0.5, role, space)
            }
        };
        if role == Role::Reflectance && spectrum.max_value() > 1.001 && spectrum.as_constant().is_none() {
            let message = format!("{what} exceeds 1 at some wavelengths; it is cut there, as pbrt does");
            self.diagnostics.push(Diagnostic::warning("W0701", message, span));
        }
        self.textures.add_spectrum(spectrum)
    }

    /// A spectrum in a texture: not limited to 1 where it is one number, since a factor may follow.
    fn input_spectrum(&mut self, param: &SpannedSpectrum, role: Role) -> SpectrumValue {
        match &param.value {
            SpectrumParam::Value(SpectrumDesc::Constant(v)) if v.is_finite() && *v >= 0.0 => {
                let spectrum = Spectrum::constant(*v, role, self.textures.space);
                self.textures.add_spectrum(spectrum)
            }
            SpectrumParam::Value(value) => self.constant(value, role, param.span, "the texture's value"),
            SpectrumParam::Texture(texture) => self.spectrum_texture(texture.0, role, param.span),
        }
    }

    fn input_float(&mut self, param: &SpannedFloat) -> FloatValue {
        match param.value {
            FloatParam::Value(v) if v.is_finite() => FloatValue::Constant(v),
            FloatParam::Value(v) => {
                self.error("E0605", format!("the value {v} is not a finite number"), param.span);
                FloatValue::Constant(0.0)
            }
            FloatParam::Texture(texture) => self.float_texture(texture.0, param.span),
        }
    }

    fn affine(&mut self, world_from_texture: &Transform, span: Span) -> Option<Box<Affine>> {
        let affine = texture_from_render(&self.textures.render_from_world, world_from_texture);
        if affine.is_none() {
            let message = "the texture's transform is singular or not affine".into();
            self.error("E0609", message, span);
        }
        affine.map(Box::new)
    }

    fn mapping(&mut self, mapping: &MappingDesc, world_from_texture: &Transform, span: Span) -> Option<Mapping> {
        let numbers: &[f32] = match mapping {
            MappingDesc::Uv { u_scale, v_scale, u_delta, v_delta } => &[*u_scale, *v_scale, *u_delta, *v_delta],
            MappingDesc::Planar { v1, v2, u_delta, v_delta } => {
                &[v1[0], v1[1], v1[2], v2[0], v2[1], v2[2], *u_delta, *v_delta]
            }
            MappingDesc::Spherical | MappingDesc::Cylindrical => &[],
        };
        if numbers.iter().any(|v| !v.is_finite()) {
            self.error("E0605", "the texture's mapping has a number that is not finite".into(), span);
            return None;
        }
        let mapping = Mapping::compile(mapping, &self.textures.render_from_world, world_from_texture);
        if mapping.is_none() {
            self.error("E0609", "the texture's transform is singular or not affine".into(), span);
        }
        mapping
    }

    fn octaves(&mut self, world_from_texture: &Transform, octaves: i32, omega: f32, span: Span) -> Option<Octaves> {
        const MOST: i32 = 64;
        if !(0..=MOST).contains(&octaves) || !omega.is_finite() {
            let message =
                format!("{octaves} octaves of roughness {omega}: octaves are 0 to {MOST}, roughness is finite");
            self.error("E0610", message, span);
            return None;
        }
        self.textures.footprint_needed = true;
        let texture_from_render = self.affine(world_from_texture, span)?;
        Some(Octaves { texture_from_render, count: octaves as u32, omega })
    }

    /// A texture of any kind that numbers and spectra share. `constant` is for stand-ins.
    fn basic<P, V: Copy + PartialEq>(
        &mut self,
        desc: &BasicTexture<P>,
        world_from_texture: &Transform,
        span: Span,
        input: impl Fn(&mut Self, &P) -> V,
        constant: impl FnOnce(&mut Self, f32) -> V,
    ) -> Built<V> {
        let mapped = |c: &mut Self, mapping, node: &dyn Fn(Mapping) -> BasicNode<V>| match c.mapping(
            mapping,
            world_from_texture,
            span,
        ) {
            Some(mapping) => Built::Basic(node(mapping)),
            None => Built::Failed,
        };
        match desc {
            BasicTexture::Constant(value) => Built::Value(input(self, value)),
            BasicTexture::Scale { tex, scale } => {
                let (tex, scale) = (input(self, tex), self.input_float(scale));
                if scale == FloatValue::Constant(1.0) {
                    Built::Value(tex)
                } else {
                    Built::Basic(BasicNode::Scale { tex, scale })
                }
            }
            BasicTexture::Mix { tex1, tex2, amount } => {
                let (tex1, tex2, amount) = (input(self, tex1), input(self, tex2), self.input_float(amount));
                match amount.as_constant() {
                    Some(0.0) => Built::Value(tex1),
                    Some(1.0) => Built::Value(tex2),
                    _ => Built::Basic(BasicNode::Mix { tex1, tex2, amount }),
                }
            }
            BasicTexture::DirectionMix { tex1, tex2, dir } => {
                let (tex1, tex2) = (input(self, tex1), input(self, tex2));
                let direction = self.textures.render_from_world.vector(Vec3::from(*dir)).normalize();
                if !direction.is_finite() {
                    self.error("E0605", "the direction of a mix has no length".into(), span);
                    return Built::Failed;
                }
                Built::Basic(BasicNode::DirectionMix { tex1, tex2, direction })
            }
            BasicTexture::Bilerp { v00, v01, v10, v11, mapping } => {
                let corners = [v00, v10, v01, v11].map(|v| input(self, v));
                mapped(self, mapping, &|mapping| BasicNode::Bilerp { corners, mapping })
            }
            BasicTexture::Checkerboard { tex1, tex2, dimension, mapping } => {
                let (tex1, tex2) = (input(self, tex1), input(self, tex2));
                self.textures.footprint_needed = true;
                match dimension {
                    2 => mapped(self, mapping, &|mapping| BasicNode::Checkerboard { tex1, tex2, mapping }),
                    3 => match self.affine(world_from_texture, span) {
                        Some(texture_from_render) => {
                            Built::Basic(BasicNode::SolidCheckerboard { tex1, tex2, texture_from_render })
                        }
                        None => Built::Failed,
                    },
                    n => {
                        self.error("E0611", format!("a checkerboard has 2 or 3 dimensions, not {n}"), span);
                        Built::Failed
                    }
                }
            }
            BasicTexture::Dots { inside, outside, mapping } => {
                let (inside, outside) = (input(self, inside), input(self, outside));
                mapped(self, mapping, &|mapping| BasicNode::Dots { inside, outside, mapping })
            }
            BasicTexture::ImageMap(image) => {
                // Unread images were reported when they were read.
                let Some(Some(id)) = self.textures.image_ids.get(&ImageKey::new(image)).copied() else {
                    return Built::Failed;
                };
                if !image.scale.is_finite() {
                    self.error("E0605", format!("the scale of the image is {}", image.scale), span);
                    return Built::Failed;
                }
                self.textures.footprint_needed |= self.textures.images[id.0 as usize].mip.levels() > 1;
                let grade = Grade { scale: image.scale, invert: image.invert };
                match self.mapping(&image.mapping, world_from_texture, span) {
                    Some(mapping) => Built::Image { image: id, mapping, grade },
                    None => Built::Failed,
                }
            }
            // The reader has said so.
            BasicTexture::Ptex { .. } => Built::Value(constant(self, 0.5)),
        }
    }

    /// Whether a node may be added.
    fn affordable(&mut self, visits: u32, name: &str, span: Span) -> bool {
        if visits > MAX_VISITS {
            let message = format!("texture \"{name}\" looks up more than {MAX_VISITS} others at each hit");
            self.error("E0608", message, span);
        }
        visits <= MAX_VISITS
    }

    fn float_texture(&mut self, index: u32, span: Span) -> FloatValue {
        let fallback = FloatValue::Constant(0.5);
        if let Some(&value) = self.textures.floats.get(index as usize) {
            return value;
        }
        let i = index as usize;
        match self.finished.get(i) {
            Some(Some(value)) => return *value,
            Some(None) if !self.started[i] => {}
            known => {
                let how = if known.is_some() { "refers to itself" } else { "does not exist" };
                self.error("E0608", format!("a texture of numbers {how}"), span);
                return fallback;
            }
        }
        self.started[i] = true;
        let desc = self.desc;
        let value = self.new_float_texture(&desc.float_textures[i]).unwrap_or(fallback);
        self.finished[i] = Some(value);
        value
    }

    fn new_float_texture(&mut self, desc: &TextureDesc<FloatTextureKind>) -> Option<FloatValue> {
        let TextureDesc { name, kind, world_from_texture: space, span } = desc;
        let node = match kind {
            FloatTextureKind::Basic(basic) => {
                match self.basic(basic, space, *span, Self::input_float, |_, v| FloatValue::Constant(v)) {
                    Built::Value(value) => return Some(value),
                    Built::Basic(node) => {
                        let node = match self.folded_float(node) {
                            Ok(value) => return Some(value),
                            Err(node) => node,
                        };
                        if let BasicNode::Scale { tex, scale } = node
                            && let Some(image) = self.scaled_float_image(tex, scale)
                        {
                            image
                        } else {
                            FloatNode::Basic(node)
                        }
                    }
                    Built::Image { image, mapping, grade } => FloatNode::Image { image, mapping, grade },
                    Built::Failed => return None,
                }
            }
            FloatTextureKind::Fbm { octaves, omega } => FloatNode::Fbm(self.octaves(space, *octaves, *omega, *span)?),
            FloatTextureKind::Wrinkled { octaves, omega } => {
                FloatNode::Wrinkled(self.octaves(space, *octaves, *omega, *span)?)
            }
            FloatTextureKind::Windy => {
                self.textures.footprint_needed = true;
                FloatNode::Windy(self.affine(space, *span)?)
            }
        };
        let visits = match &node {
            FloatNode::Basic(basic) => {
                let float = |v| self.textures.visits_of_float(v);
                basic.visits(float, float)
            }
            _ => 1,
        };
        if !self.affordable(visits, name, *span) {
            return None;
        }
        self.textures.float_nodes.push(node);
        self.textures.visits.floats.push(visits);
        Some(FloatValue::Node(FloatNodeId(self.textures.float_nodes.len() as u32 - 1)))
    }

    /// The number that a combination of numbers is.
    fn folded_float(&self, node: BasicNode<FloatValue>) -> Result<FloatValue, BasicNode<FloatValue>> {
        let number = match &node {
            BasicNode::Scale { tex, scale } => tex.as_constant().zip(scale.as_constant()).map(|(a, b)| a * b),
            BasicNode::Mix { tex1, tex2, amount } => (|| {
                let (a, b, t) = (tex1.as_constant()?, tex2.as_constant()?, amount.as_constant()?);
                Some((1.0 - t) * a + t * b)
            })(),
            _ => None,
        };
        number.map(FloatValue::Constant).ok_or(node)
    }

    /// An image times a number is an image of another scale (which matters when it is inverted), as in pbrt-v4.
    fn scaled_float_image(&self, tex: FloatValue, scale: FloatValue) -> Option<FloatNode> {
        // Either may be the image; pbrt-v4 tries both.
        let pick = |image: FloatValue, factor: FloatValue| {
            let (FloatValue::Node(id), FloatValue::Constant(factor)) = (image, factor) else { return None };
            match &self.textures.float_nodes[id.0 as usize] {
                FloatNode::Image { image, mapping, grade } => {
                    let grade = Grade { scale: grade.scale * factor, ..*grade };
                    Some(FloatNode::Image { image: *image, mapping: mapping.clone(), grade })
                }
                _ => None,
            }
        };
        pick(tex, scale).or_else(|| pick(scale, tex))
    }

    fn spectrum_texture(&mut self, index: u32, role: Role, span: Span) -> SpectrumValue {
        let key = (index, role_key(role));
        if let Some(&value) = self.textures.spectrum_textures.get(&key) {
            return value;
        }
        let desc = self.desc;
        let texture = desc.spectrum_textures.get(index as usize);
        let value = match texture {
            Some(texture) if !self.open.contains(&index) && self.open.len() < MAX_VISITS as usize => {
                self.open.push(index);
                let value = self.new_spectrum_texture(texture, role);
                self.open.pop();
                value
            }
            _ => {
                let how = if texture.is_some() { "refers to itself" } else { "does not exist" };
                self.error("E0608", format!("a texture of spectra {how}"), span);
                None
            }
        };
        let value = value.unwrap_or_else(|| self.grey(0.5, role));
        self.textures.spectrum_textures.insert(key, value);
        value
    }

    fn grey(&mut self, v: f32, role: Role) -> SpectrumValue {
        let grey = Spectrum::constant(v, role, self.textures.space);
        self.textures.add_spectrum(grey)
    }

    fn new_spectrum_texture(&mut self, desc: &TextureDesc<SpectrumTextureKind>, role: Role) -> Option<SpectrumValue> {
        let TextureDesc { name, kind, world_from_texture: space, span } = desc;
        let node = match kind {
            SpectrumTextureKind::Basic(basic) => {
                let input = |c: &mut Self, p: &SpannedSpectrum| c.input_spectrum(p, role);
                match self.basic(basic, space, *span, input, |c, v| c.grey(v, role)) {
                    Built::Value(value) => return Some(value),
                    Built::Basic(BasicNode::Scale { tex, scale: FloatValue::Constant(factor) }) => {
                        match self.scaled_spectrum(tex, factor) {
                            Ok(value) => return Some(value),
                            Err(node) => node,
                        }
                    }
                    Built::Basic(node) => SpectrumNode::Basic(node),
                    Built::Image { image, mapping, grade } => SpectrumNode::Image { image, mapping, grade, role },
                    Built::Failed => return None,
                }
            }
            SpectrumTextureKind::Marble { octaves, omega, scale, variation } => {
                if !(scale.is_finite() && variation.is_finite()) {
                    self.error("E0605", format!("marble of scale {scale} and variation {variation}"), *span);
                    return None;
                }
                let octaves = self.octaves(space, *octaves, *omega, *span)?;
                SpectrumNode::Marble { octaves, scale: *scale, variation: *variation, role }
            }
        };
        let visits = match &node {
            SpectrumNode::Basic(basic) => {
                basic.visits(|v| self.textures.visits_of_spectrum(v), |v| self.textures.visits_of_float(v))
            }
            _ => 1,
        };
        if !self.affordable(visits, name, *span) {
            return None;
        }
        self.textures.spectrum_nodes.push(node);
        self.textures.visits.spectra.push(visits);
        Some(SpectrumValue::Node(SpectrumNodeId(self.textures.spectrum_nodes.len() as u32 - 1)))
    }

    /// A spectrum times a number: a constant stays one, and an image is scaled before it is clamped, as in pbrt-v4.
    fn scaled_spectrum(&mut self, tex: SpectrumValue, factor: f32) -> Result<SpectrumValue, SpectrumNode> {
        let node = match tex {
            SpectrumValue::Constant(id) => {
                let scaled = self.textures.spectra[id.0 as usize].scaled(factor);
                return Ok(self.textures.add_spectrum(scaled));
            }
            SpectrumValue::Node(id) => &self.textures.spectrum_nodes[id.0 as usize],
        };
        Err(match node {
            SpectrumNode::Image { image, mapping, grade, role } => {
                let grade = Grade { scale: grade.scale * factor, ..*grade };
                SpectrumNode::Image { image: *image, mapping: mapping.clone(), grade, role: *role }
            }
            _ => SpectrumNode::Basic(BasicNode::Scale { tex, scale: FloatValue::Constant(factor) }),
        })
    }
}
