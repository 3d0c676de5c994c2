//! Nesting, objects, attributes, includes, and the things in the world that directives make.

use super::super::lex::{Kind, Lexer};
use super::super::other_files::not_a_scene;
use super::super::params::{Param, Params};
use super::super::state::*;
use super::super::{legacy, lights, settings, shapes};
use super::{Block, Frame, Opened, Parser, Parsing, Pushed};
use irradiant_scene::desc::{LightDesc, ShapeDesc};
use irradiant_scene::{Diagnostic, FileId, Span, Spanned};
use std::rc::Rc;
use std::sync::Arc;

impl Parser<'_, '_> {
    // Nesting.

    pub(super) fn push(&mut self, opened: Opened, span: Span) -> Parsing<()> {
        if self.pushed.len() >= self.r.limits.max_nesting {
            self.r.error("E0109", format!("more than {} levels of nesting", self.r.limits.max_nesting), span);
            self.frames.truncate(1);
            // Nothing sensible can follow: drop the rest.
            let lexer = self.lexer();
            while lexer.next().kind != Kind::End {}
            self.pushed.clear();
            return Ok(());
        }
        self.pushed.push(Pushed { opened, span, state: self.state.clone() });
        Ok(())
    }

    pub(super) fn pop(&mut self, opened: Opened, span: Span) {
        let word = if opened == Opened::Attribute { "AttributeEnd" } else { "ObjectEnd" };
        let floor = self.frames.iter().rev().find_map(|f| f.import.as_ref()).map_or(0, |i| i.2);
        if self.pushed.len() <= floor {
            self.r.error("E0102", format!("{word} without a beginning"), span);
            return;
        }
        let Some(open) = self.pushed.pop() else { return };
        if open.opened != opened {
            self.r.push(
                Diagnostic::error("E0102", format!("{word} does not close what was opened last"), span)
                    .also(open.span, "opened here"),
            );
            if open.opened == Opened::Object {
                self.active_object = None;
            }
        }
        self.state = open.state;
    }

    pub(super) fn object_begin(&mut self, span: Span) -> Parsing<()> {
        self.only_in(Block::World, span, "ObjectBegin");
        // The end will come, whether there is a name or not.
        let name = self.string("the name of an object in quotes");
        self.push(Opened::Object, span)?;
        let name = name?;
        if self.active_object.is_some() {
            self.r.error("E0105", "ObjectBegin inside of an object", span);
            return Ok(());
        }
        if let Some(first) = self.object_places.insert(name.value.clone(), name.span) {
            self.redefined("object", &name, first);
        }
        self.active_object = Some(self.objects.len());
        self.objects.push(PendingObject { name: name.value, shapes: vec![], span: name.span });
        Ok(())
    }

    pub(super) fn object_end(&mut self, span: Span) {
        self.pop(Opened::Object, span);
        self.active_object = None;
    }

    pub(super) fn object_instance(&mut self, span: Span) -> Parsing<()> {
        self.only_in(Block::World, span, "ObjectInstance");
        let name = self.string("the name of an object in quotes")?;
        if self.active_object.is_some() {
            self.r.error("E0105", "ObjectInstance inside of an object", span);
        } else {
            self.instances.push(PendingInstance { name, world_from_object: self.state.motion() });
        }
        Ok(())
    }

    pub(super) fn redefined(&self, what: &str, name: &Spanned<String>, first: Span) {
        self.r.push(
            Diagnostic::error("E0106", format!("{what} \"{}\" is defined twice", name.value), name.span)
                .also(first, "first defined here"),
        );
    }

    pub(super) fn attribute(&mut self) -> Parsing<()> {
        let target = self.string("\"shape\", \"light\", \"material\", \"medium\" or \"texture\"")?;
        let params = self.parameters()?;
        let space = self.state.color_space;
        let list = match target.value.as_str() {
            "shape" => &mut self.state.shape_attributes,
            "light" => &mut self.state.light_attributes,
            "material" => &mut self.state.material_attributes,
            "medium" => &mut self.state.medium_attributes,
            "texture" => &mut self.state.texture_attributes,
            _ => {
                let known = ["shape", "light", "material", "medium", "texture"];
                self.r.unknown("E0112", "attribute target", &target, &known);
                return Ok(());
            }
        };
        Rc::make_mut(list).extend(params.into_iter().map(|p| Rc::new(Param { attribute: Some(space), ..p })));
        Ok(())
    }

    // Things in the world.

    pub(super) fn make_named_material(&mut self, span: Span) -> Parsing<()> {
        let (name, params) = self.named(span, "named material", &self.state.material_attributes.clone())?;
        let index = self.materials.len() as u32;
        if let Some(first) = self.named_materials.get(&name.value) {
            let place = self.materials[*first as usize].name.as_ref().map_or(Span::NONE, |n| n.span);
            self.redefined("named material", &name, place);
            return Ok(());
        }
        let Some(kind) = params.string(self.r, "type") else {
            params.missing(self.r, "\"string type\", for example \"diffuse\"");
            // The name stays known, so that its uses are not errors too.
            self.named_materials.insert(name.value, 0);
            return Ok(());
        };
        self.named_materials.insert(name.value.clone(), index);
        self.materials.push(PendingMaterial { name: Some(name), kind, params });
        Ok(())
    }

    pub(super) fn texture(&mut self, span: Span) -> Parsing<()> {
        let name = self.string("the name of a texture in quotes")?;
        let class = self.string("\"float\" or \"spectrum\"")?;
        let read = self.named(span, "texture", &self.state.texture_attributes.clone());
        let (kind, params) = read.inspect_err(|_| self.r.defined_wrongly(&name))?;
        let is_float = match class.value.as_str() {
            "float" => true,
            "spectrum" => false,
            _ => {
                legacy::texture_class(self.r, &class);
                self.r.defined_wrongly(&name);
                return Ok(());
            }
        };
        if let Some(first) = self.texture_places.get(&(is_float, name.value.clone())) {
            self.redefined("texture", &name, *first);
            return Ok(());
        }
        self.texture_places.insert((is_float, name.value.clone()), name.span);
        if self.state.is_animated() {
            self.r.warning("W0108", "a texture cannot move; it stays where it is at the start", params.span);
        }
        let world_from_texture = self.state.transforms[0];
        self.textures.push(PendingTexture { name, is_float, kind, params, world_from_texture });
        Ok(())
    }

    pub(super) fn light(&mut self, name: &Spanned<String>, params: &Params) {
        if self.state.is_animated() {
            self.r.warning("W0108", "a light cannot move; it stays where it is at the start", params.span);
        }
        self.light_media.extend(self.state.media.outside.clone());
        let light: Option<LightDesc> = lights::light(self.r, name, params, self.state.transforms[0]);
        self.desc.lights.extend(light);
    }

    pub(super) fn medium_interface(&mut self) -> Parsing<()> {
        let inside = self.string("the name of the medium inside in quotes")?;
        // With one name, pbrt-v4 takes it for both sides.
        let outside = match self.lexer().peek().kind {
            Kind::Text => self.string("the name of the medium outside in quotes")?,
            _ => inside.clone(),
        };
        let medium = |name: Spanned<String>| (!name.value.is_empty()).then(|| Rc::new(name));
        self.state.media = MediumUse { inside: medium(inside), outside: medium(outside) };
        Ok(())
    }

    pub(super) fn shape(&mut self, name: &Spanned<String>, params: &Params) {
        let Some(shape) = shapes::shape(self.r, name, params) else { return };
        let mut area_light = self.state.area_light.clone();
        if area_light.is_some() && self.active_object.is_some() {
            let message = "shapes of objects cannot emit; this one stays dark";
            self.r.push(
                Diagnostic::warning("W0109", message, params.span)
                    .help("place it in the world, as a shape of its own")
                    .not_honoured("area light in an object: dark"),
            );
            area_light = None;
        } else if area_light.is_some() && self.state.is_animated() {
            self.r.error("E0114", "a shape that moves cannot emit", params.span);
            area_light = None;
        }
        let name_of = |m: &Option<Rc<Spanned<String>>>| m.as_ref().map(|m| m.value.clone());
        let media = self.state.media.clone();
        let pending = PendingShape {
            desc: ShapeDesc {
                kind: shape.kind,
                world_from_shape: self.state.motion(),
                reverse_orientation: self.state.reverse_orientation,
                material: irradiant_scene::desc::MaterialRef(0),
                area_light,
                alpha: shape.alpha,
                is_medium_boundary: name_of(&media.inside) != name_of(&media.outside),
                span: params.span,
            },
            material: self.state.material.clone(),
            alpha_texture: shape.alpha_texture,
            media,
        };
        match self.active_object {
            Some(i) => self.objects[i].shapes.push(pending),
            None => self.shapes.push(pending),
        }
    }

    pub(super) fn option(&mut self) -> Parsing<()> {
        // A type may stand before the name, as in a parameter.
        let token = self.lexer().next();
        if token.kind != Kind::Text {
            return self.expected("E0003", token, "the name of an option in quotes");
        }
        let name = self.dequote(token)?;
        let mut token = self.lexer().next();
        let bracket = token.kind == Kind::Open;
        if bracket {
            token = self.lexer().next();
        }
        if !matches!(token.kind, Kind::Word | Kind::Text) || self.begins_statement(token) {
            return self.expected("E0007", token, "the value of the option");
        }
        let value = match token.kind {
            Kind::Text => self.dequote(token)?,
            _ => {
                let text = String::from_utf8_lossy(self.lexer().bytes(token)).into_owned();
                Spanned::new(text, self.span(token))
            }
        };
        if bracket {
            let close = self.lexer().next();
            if close.kind != Kind::Close {
                return self.expected("E0007", close, "] after the value of the option");
            }
        }
        settings::option(self.r, &mut self.desc.options, &name, &value);
        Ok(())
    }

    pub(super) fn include(&mut self, name: &Spanned<String>, import: bool) {
        let path = self.r.resolve(name);
        if self.frames.iter().any(|f| f.path.as_ref() == Some(&path)) || self.frames.len() > self.r.limits.max_includes
        {
            let message = format!("\"{}\" includes itself, or includes are nested too deeply", name.value);
            self.r.error("E0109", message, name.span);
            return;
        }
        let known = self.r.texts.borrow().get(&path).cloned();
        let source: Option<(FileId, Arc<[u8]>)> = known.unwrap_or_else(|| {
            let text = self.r.bytes("included file", &name.value, &path, name.span).filter(|t| {
                let fits = t.len() <= u32::MAX as usize;
                if !fits {
                    self.r.error("E1002", "scene texts are limited to 4 GiB", name.span);
                } else if let Some(looks_like) = not_a_scene(t) {
                    let message = format!("\"{}\" is no pbrt scene but {looks_like}", name.value);
                    self.r.error_help("E1010", message, name.span, "only pbrt text can be included, gzipped or not");
                    return false;
                }
                fits
            });
            let source = text.map(|text| (self.r.add_source(&path.display().to_string(), text.clone()), text));
            self.r.texts.borrow_mut().insert(path.clone(), source.clone());
            source
        });
        let Some((file, text)) = source else { return };
        // A small file that includes another twice, that includes another twice, ... would never end.
        let cost = text.len() as u64 + 1;
        if cost > self.bytes_left {
            self.r.error("E0109", "the scene with all that it includes is too large", name.span);
            self.frames.clear();
            self.frames.push(Frame { lexer: Lexer::new(Arc::from([]), file), path: None, import: None });
            return;
        }
        self.bytes_left -= cost;
        let saved = (self.state.clone(), self.coordinate_systems.clone(), self.pushed.len());
        self.frames.push(Frame { lexer: Lexer::new(text, file), path: Some(path), import: import.then_some(saved) });
    }
}
