//! The pbrt-v4 scene language: Irradiant's native format.
//!
//! # Layout
//! `lex` cuts bytes into tokens; `parse` walks the directives, keeps the graphics state (`state`) and follows includes;
//! `params` looks parameters up by name and type. What needs no names of others is described on the spot (`settings`,
//! `film`, `camera`, `lights`, `shapes`, `media`); `textures` and `materials` wait until all files are read, and this
//! file ties shapes to them. `legacy` knows what pbrt-v3 called things, `stand_ins` what replaces the materials that
//! are not rendered yet, `other_files` recognises what is no scene at all. [`codes`] explains every complaint.
//!
//! Semantics and defaults are those of pbrt-v4 (its file format page, and `parser.cpp`, `scene.cpp` and the `Create`
//! functions of its objects). Departures, all towards saying more: unknown or contradictory parameters are located
//! errors with a suggestion; all errors of a scene come in one run; values that pbrt drops with a message and goes on
//! (mismatched `uv` or `N`, out-of-range indices) are errors. Accepted beyond pbrt: the parameter types `point`,
//! `vector` and `normal3`, quoted truth values, and the three materials in `materials`.

mod camera;
pub mod codes;
mod film;
mod legacy;
pub(crate) mod lex;
mod lights;
mod materials;
mod media;
mod other_files;
mod params;
mod parse;
mod reader;
mod settings;
mod shapes;
mod stand_ins;
mod state;
mod textures;

use crate::{Format, Limits, Parsed};
use irradiant_scene::desc::{
    FloatParam, InstanceDesc, MaterialDesc, MaterialKind, MaterialRef, ObjectRef, SceneDesc, ShapeDesc,
};
use irradiant_scene::{Assets, Diagnostic, Spanned};
use parse::Parser;
use reader::Reader;
use state::{MaterialUse, PendingShape};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The format.
pub struct Pbrt;

impl Format for Pbrt {
    fn name(&self) -> &'static str {
        "pbrt-v4"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["pbrt", "pbrt.gz"]
    }

    fn read(&self, main: &str, text: Arc<[u8]>, assets: &dyn Assets) -> Parsed {
        read_pbrt(main, text, assets)
    }
}

/// Understands as much of a pbrt-v4 scene as it can, and says everything that is wrong with the rest.
///
/// `main` is the name of the text in messages. Never fails and never panics: look at `diagnostics` before you use
/// `desc`. The text may be gzipped.
pub fn read_pbrt(main: &str, text: Arc<[u8]>, assets: &dyn Assets) -> Parsed {
    read_pbrt_with(main, text, assets, Limits::default())
}

/// As [`read_pbrt`], with limits of one's own.
pub fn read_pbrt_with(main: &str, text: Arc<[u8]>, assets: &dyn Assets, limits: Limits) -> Parsed {
    let reader = Reader::new(assets, limits);
    let mut parser = Parser::new(&reader);
    match crate::files::gunzip(text, reader.limits.max_file_bytes) {
        Ok(text) => parser.run(main, text),
        Err(error) => {
            let file = reader.add_source(main, Arc::from([]));
            let span = irradiant_scene::Span { file, start: 0, end: 0 };
            reader.error("E1002", format!("the scene {error}"), span);
        }
    }
    let desc = finish(parser);
    let (sources, diagnostics, assets_read) = reader.into_parts();
    Parsed { desc, sources, diagnostics, assets_read }
}

/// Ties names to what they mean, now that all of them are known.
fn finish(parser: Parser<'_, '_>) -> SceneDesc {
    let Parser { r, mut desc, textures, materials, named_materials, objects, shapes, instances, media, .. } = parser;
    let names = textures::resolve(r, &textures, &mut desc);
    desc.materials = materials::resolve(r, &materials, &named_materials, &names);

    let mut told_media = BTreeSet::new();
    let mut medium_in_use = None;
    let mut use_medium = |name: &Spanned<String>| {
        if media.contains_key(&name.value) {
            medium_in_use.get_or_insert(name.span);
        } else if told_media.insert(name.span) && !r.is_defined_wrongly(name) {
            let known: Vec<&str> = media.keys().map(String::as_str).collect();
            r.unknown("E0406", "medium", name, &known);
        }
    };
    parser.camera_medium.iter().chain(&parser.light_media).for_each(|m| use_medium(m));
    let mut told_materials = BTreeSet::new();
    let mut place = |pending: PendingShape| -> ShapeDesc {
        let mut shape = pending.desc;
        [pending.media.inside, pending.media.outside].iter().flatten().for_each(|m| use_medium(m));
        shape.material = match &pending.material {
            MaterialUse::Index(index) => MaterialRef(*index),
            MaterialUse::Named(name) => match named_materials.get(&name.value) {
                Some(index) => MaterialRef(*index),
                None => {
                    if told_materials.insert(name.span) && !r.is_defined_wrongly(name) {
                        let known: Vec<&str> = named_materials.keys().map(String::as_str).collect();
                        r.unknown("E0401", "named material", name, &known);
                    }
                    MaterialRef(0)
                }
            },
        };
        if let Some(name) = &pending.alpha_texture
            && let Some(id) = params::float_texture(r, &names, name)
        {
            shape.alpha = Some(Spanned::new(FloatParam::Texture(id), name.span));
        }
        if shape.area_light.is_some() && is_interface(&desc.materials, shape.material) {
            let message = "a shape of material \"interface\" cannot emit; it stays dark";
            r.push(Diagnostic::warning("W0110", message, shape.span));
            shape.area_light = None;
        }
        shape
    };
    desc.shapes = shapes.into_iter().map(&mut place).collect();
    let mut indices = BTreeMap::new();
    for object in objects {
        indices.entry(object.name.clone()).or_insert(ObjectRef(desc.objects.len() as u32));
        let mut described = parse::empty_object(&object);
        described.shapes = object.shapes.into_iter().map(&mut place).collect();
        desc.objects.push(described);
    }
    for instance in instances {
        match indices.get(&instance.name.value) {
            Some(object) => desc.instances.push(InstanceDesc {
                object: *object,
                world_from_object: instance.world_from_object,
                span: instance.name.span,
            }),
            None if r.is_defined_wrongly(&instance.name) => {}
            None => {
                let known: Vec<&str> = indices.keys().map(String::as_str).collect();
                r.unknown("E0405", "object", &instance.name, &known);
            }
        }
    }
    if let Some(span) = medium_in_use {
        let diagnostic = Diagnostic::warning("W0101", "media are not here yet; they are rendered as vacuum", span);
        // pbrt-v4's surface integrators leave media out too: then the picture is what the author asked for.
        r.push(if parser.integrator.volumetric { diagnostic.not_honoured("medium: vacuum") } else { diagnostic });
    }
    desc
}

fn is_interface(materials: &[MaterialDesc], index: MaterialRef) -> bool {
    materials.get(index.0 as usize).is_some_and(|m| matches!(m.kind, MaterialKind::Interface))
}
