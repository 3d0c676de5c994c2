//! `LightSource` and `AreaLightSource`.

use super::legacy::unknown_name;
use super::params::{Params, Role, Type};
use super::reader::Reader;
use irradiant_math::Transform;
use irradiant_scene::desc::{AreaLightDesc, LightDesc, LightKind, MotionDesc, SpectrumDesc};
use irradiant_scene::{Diagnostic, Spanned};
use std::sync::Arc;

const LIGHTS: &[&str] = &["distant", "goniometric", "infinite", "point", "projection", "spot"];

/// pbrt-v4's default emission: the white of the colour space.
fn white(p: &Params) -> Spanned<SpectrumDesc> {
    Spanned::unplaced(SpectrumDesc::Rgb([1.0; 3], p.color_space))
}

/// A photometric target; pbrt-v4 takes values of 0 and below for "not given".
fn target(r: &Reader, p: &Params, name: &'static str) -> Option<Spanned<f32>> {
    p.float(r, name).filter(|v| v.value > 0.0)
}

pub(crate) fn light(r: &Reader, name: &Spanned<String>, p: &Params, world_from_light: Transform) -> Option<LightDesc> {
    let scale = p.float_or(r, "scale", 1.0);
    let emission = |name| p.spectrum(r, name, Role::Illuminant).unwrap_or_else(|| white(p));
    let from = || p.triple_or(r, "from", Type::Point3, [0.0; 3]).value;
    let to = || p.triple_or(r, "to", Type::Point3, [0.0, 0.0, 1.0]).value;
    let aimed = |from: [f32; 3], to: [f32; 3]| {
        if from == to {
            let message = format!("\"from\" and \"to\" of light \"{}\" are the same point", name.value);
            r.error_help("E0305", message, p.span, "it needs a direction");
        }
    };
    let kind = match name.value.as_str() {
        "point" => LightKind::Point { intensity: emission("I"), from: from(), power: target(r, p, "power") },
        "distant" => {
            let (from, to) = (from(), to());
            aimed(from, to);
            LightKind::Distant { radiance: emission("L"), from, to, illuminance: target(r, p, "illuminance") }
        }
        "spot" => {
            let (from, to) = (from(), to());
            aimed(from, to);
            LightKind::Spot {
                intensity: emission("I"),
                from,
                to,
                cone_angle: p.float_or(r, "coneangle", 30.0),
                cone_delta_angle: p.float_or(r, "conedeltaangle", 5.0),
                power: target(r, p, "power"),
            }
        }
        "goniometric" => LightKind::Goniometric {
            intensity: emission("I"),
            file: p.file(r, "filename", "image"),
            power: target(r, p, "power"),
        },
        "projection" => {
            let (fov, power) = (p.float_or(r, "fov", 90.0), target(r, p, "power"));
            match p.file(r, "filename", "image") {
                Some(file) => LightKind::Projection { intensity: white(p), file, fov, power },
                None => {
                    p.missing(r, "\"string filename\", the slide");
                    return None;
                }
            }
        }
        "infinite" => infinite(r, p),
        _ => {
            unknown_name(r, "E0204", "light", name, LIGHTS);
            return None;
        }
    };
    let group = group(r, p);
    p.finish(r);
    let world_from_light = MotionDesc::still(world_from_light);
    Some(LightDesc { kind, world_from_light, scale, group, color_space: p.color_space, span: p.span })
}

/// The light group: a parameter of our own.
fn group(r: &Reader, p: &Params) -> Option<String> {
    p.string(r, "group").map(|group| group.value)
}

fn infinite(r: &Reader, p: &Params) -> LightKind {
    let radiance = p.spectrum(r, "L", Role::Illuminant);
    let file = p.file(r, "filename", "image");
    let portal = p.triples(r, "portal", Type::Point3).and_then(|points| match points.value[..] {
        [a, b, c, d] => Some(Spanned::new([a, b, c, d], points.span)),
        _ => {
            let message = format!("a portal has four corners; {} points are given", points.value.len());
            r.error("E0303", message, points.span);
            None
        }
    });
    if let (Some(radiance), Some(file)) = (&radiance, &file) {
        r.push(
            Diagnostic::error("E0305", "both \"L\" and \"filename\" are given", file.span)
                .also(radiance.span, "the colour")
                .help("an image has its own colours; keep one of them and use \"scale\""),
        );
    }
    let radiance = match file {
        Some(_) => None,
        None => Some(radiance.unwrap_or_else(|| white(p))),
    };
    LightKind::Infinite { radiance, file, portal, illuminance: target(r, p, "illuminance") }
}

/// The emission that the shapes to come get.
pub(crate) fn area_light(r: &Reader, name: &Spanned<String>, p: &Params) -> Option<Arc<AreaLightDesc>> {
    if name.value != "diffuse" {
        unknown_name(r, "E0205", "area light", name, &["diffuse"]);
        return None;
    }
    let radiance = p.spectrum(r, "L", Role::Illuminant);
    let file = p.file(r, "filename", "image");
    if let (Some(radiance), Some(file)) = (&radiance, &file) {
        r.push(
            Diagnostic::error("E0305", "both \"L\" and \"filename\" are given", file.span)
                .also(radiance.span, "the colour")
                .help("an image has its own colours; keep one of them and use \"scale\""),
        );
    }
    let radiance = match file {
        Some(_) => None,
        None => Some(radiance.unwrap_or_else(|| white(p))),
    };
    let desc = AreaLightDesc {
        radiance,
        file,
        scale: p.float_or(r, "scale", 1.0),
        group: group(r, p),
        two_sided: p.bool_or(r, "twosided", false),
        power: target(r, p, "power"),
        color_space: p.color_space,
        span: p.span,
    };
    p.finish(r);
    Some(Arc::new(desc))
}
