//! `Texture`.

use super::legacy::unknown_name;
use super::params::{Params, Role, TextureNames, Type};
use super::reader::Reader;
use super::state::PendingTexture;
use irradiant_math::Vec3;
use irradiant_scene::desc::texture::{BasicTexture, EncodingDesc, ImageFilter, ImageWrap};
use irradiant_scene::desc::{
    FloatParam, FloatTextureKind, FloatTextureRef, ImageMapDesc, MappingDesc, SceneDesc, SpannedFloat, SpannedSpectrum,
    SpectrumDesc, SpectrumParam, SpectrumTextureKind, SpectrumTextureRef, TextureDesc,
};
use irradiant_scene::{Diagnostic, Spanned};

const FLOAT: &[&str] = &[
    "bilerp",
    "checkerboard",
    "constant",
    "directionmix",
    "dots",
    "fbm",
    "imagemap",
    "mix",
    "ptex",
    "scale",
    "windy",
    "wrinkled",
];
const SPECTRUM: &[&str] =
    &["bilerp", "checkerboard", "constant", "directionmix", "dots", "imagemap", "marble", "mix", "ptex", "scale"];

/// Describes all textures, those that others may use first: image maps, then the rest as they stand.
pub(crate) fn resolve(r: &Reader, pending: &[PendingTexture], desc: &mut SceneDesc) -> TextureNames {
    let mut names = TextureNames::default();
    for t in pending {
        let all = if t.is_float { &mut names.all_float } else { &mut names.all_spectrum };
        all.insert(t.name.value.clone(), t.name.span);
    }
    let is_image = |t: &PendingTexture| matches!(t.kind.value.as_str(), "imagemap" | "ptex");
    let (images, others): (Vec<_>, Vec<_>) = pending.iter().partition(|t| is_image(t));
    for t in images.into_iter().chain(others) {
        let (name, span) = (t.name.value.clone(), t.params.span);
        let world_from_texture = t.world_from_texture;
        if t.is_float {
            let kind = float_kind(r, t, &names);
            names.float.insert(name.clone(), FloatTextureRef(desc.float_textures.len() as u32));
            desc.float_textures.push(TextureDesc { name, kind, world_from_texture, span });
        } else {
            let kind = spectrum_kind(r, t, &names);
            names.spectrum.insert(name.clone(), SpectrumTextureRef(desc.spectrum_textures.len() as u32));
            desc.spectrum_textures.push(TextureDesc { name, kind, world_from_texture, span });
        }
    }
    names
}

/// How a value or texture of either class is read: what the generic part needs to know of the class.
trait Class {
    type Param;
    fn number(v: f32) -> Self::Param;
    /// A value, or a texture where the pbrt-v4 texture takes one.
    fn param(r: &Reader, p: &Params, t: &TextureNames, name: &'static str, default: f32) -> Self::Param;
    /// A value only.
    fn value(r: &Reader, p: &Params, name: &'static str, default: f32) -> Self::Param;
}

struct Float;
struct Spectrum;

impl Class for Float {
    type Param = SpannedFloat;
    fn number(v: f32) -> SpannedFloat {
        Spanned::unplaced(FloatParam::Value(v))
    }
    fn param(r: &Reader, p: &Params, t: &TextureNames, name: &'static str, default: f32) -> SpannedFloat {
        p.float_param_or(r, t, name, default)
    }
    fn value(r: &Reader, p: &Params, name: &'static str, default: f32) -> SpannedFloat {
        p.float_or(r, name, default).map(FloatParam::Value)
    }
}

impl Class for Spectrum {
    type Param = SpannedSpectrum;
    fn number(v: f32) -> SpannedSpectrum {
        Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Constant(v)))
    }
    // pbrt-v4 makes every spectrum texture as an albedo too, so its colours stay in [0, 1].
    fn param(r: &Reader, p: &Params, t: &TextureNames, name: &'static str, default: f32) -> SpannedSpectrum {
        p.spectrum_param_or(r, t, name, Role::Albedo, SpectrumDesc::Constant(default))
    }
    fn value(r: &Reader, p: &Params, name: &'static str, default: f32) -> SpannedSpectrum {
        let given = p.spectrum(r, name, Role::Albedo).map(|s| s.map(SpectrumParam::Value));
        given.unwrap_or_else(|| Self::number(default))
    }
}

/// The kinds that both classes have; `None` for others.
fn basic<C: Class>(r: &Reader, t: &PendingTexture, names: &TextureNames) -> Option<BasicTexture<C::Param>> {
    let p = &t.params;
    let param = |name, default| C::param(r, p, names, name, default);
    let value = |name, default| C::value(r, p, name, default);
    Some(match t.kind.value.as_str() {
        "constant" => BasicTexture::Constant(value("value", 1.0)),
        "scale" => BasicTexture::Scale { tex: param("tex", 1.0), scale: p.float_param_or(r, names, "scale", 1.0) },
        "mix" => BasicTexture::Mix {
            tex1: param("tex1", 0.0),
            tex2: param("tex2", 1.0),
            amount: p.float_param_or(r, names, "amount", 0.5),
        },
        "directionmix" => {
            let dir = p.triple_or(r, "dir", Type::Vector3, [0.0, 1.0, 0.0]);
            let [x, y, z] = dir.value;
            let world = t.world_from_texture.vector(Vec3::new(x, y, z));
            if world.length() == 0.0 {
                r.error("E0309", "the direction of a mix cannot be 0 0 0", dir.span);
            }
            let unit = world.normalize();
            BasicTexture::DirectionMix {
                tex1: param("tex1", 0.0),
                tex2: param("tex2", 1.0),
                dir: [unit.x, unit.y, unit.z],
            }
        }
        "bilerp" => BasicTexture::Bilerp {
            v00: value("v00", 0.0),
            v01: value("v01", 1.0),
            v10: value("v10", 0.0),
            v11: value("v11", 1.0),
            mapping: mapping(r, p),
        },
        "checkerboard" => {
            let dimension = p.integer_in(r, "dimension", 2, 2..=3).value as u32;
            BasicTexture::Checkerboard {
                tex1: param("tex1", 1.0),
                tex2: param("tex2", 0.0),
                dimension,
                mapping: if dimension == 2 { mapping(r, p) } else { MappingDesc::default() },
            }
        }
        "dots" => {
            BasicTexture::Dots { inside: param("inside", 1.0), outside: param("outside", 0.0), mapping: mapping(r, p) }
        }
        "imagemap" => match image_map(r, p) {
            Some(map) => BasicTexture::ImageMap(map),
            None => BasicTexture::Constant(C::number(0.5)),
        },
        "ptex" => {
            r.push(
                Diagnostic::warning("W0106", "ptex textures are not here yet; this one is 0.5 everywhere", t.kind.span)
                    .not_honoured("ptex: constant 0.5"),
            );
            encoding(r, p);
            let scale = p.float_or(r, "scale", 1.0).value;
            match p.file(r, "filename", "ptex file") {
                Some(file) => BasicTexture::Ptex { file, scale },
                None => {
                    p.missing(r, "\"string filename\"");
                    BasicTexture::Constant(C::number(0.5))
                }
            }
        }
        _ => return None,
    })
}

fn float_kind(r: &Reader, t: &PendingTexture, names: &TextureNames) -> FloatTextureKind {
    let p = &t.params;
    let noise = || (p.integer_in(r, "octaves", 8, 0..=64).value, p.float_or(r, "roughness", 0.5).value);
    let kind = match t.kind.value.as_str() {
        "fbm" => {
            let (octaves, omega) = noise();
            FloatTextureKind::Fbm { octaves, omega }
        }
        "wrinkled" => {
            let (octaves, omega) = noise();
            FloatTextureKind::Wrinkled { octaves, omega }
        }
        "windy" => FloatTextureKind::Windy,
        _ => match basic::<Float>(r, t, names) {
            Some(basic) => FloatTextureKind::Basic(basic),
            None => {
                wrong_kind(r, &t.kind, "float", FLOAT, "spectrum", SPECTRUM);
                return FloatTextureKind::Basic(BasicTexture::Constant(Float::number(1.0)));
            }
        },
    };
    p.finish(r);
    kind
}

fn spectrum_kind(r: &Reader, t: &PendingTexture, names: &TextureNames) -> SpectrumTextureKind {
    let p = &t.params;
    let kind = match t.kind.value.as_str() {
        "marble" => SpectrumTextureKind::Marble {
            octaves: p.integer_in(r, "octaves", 8, 0..=64).value,
            omega: p.float_or(r, "roughness", 0.5).value,
            scale: p.float_or(r, "scale", 1.0).value,
            variation: p.float_or(r, "variation", 0.2).value,
        },
        _ => match basic::<Spectrum>(r, t, names) {
            Some(basic) => SpectrumTextureKind::Basic(basic),
            None => {
                wrong_kind(r, &t.kind, "spectrum", SPECTRUM, "float", FLOAT);
                return SpectrumTextureKind::Basic(BasicTexture::Constant(Spectrum::number(1.0)));
            }
        },
    };
    p.finish(r);
    kind
}

fn wrong_kind(
    r: &Reader,
    kind: &Spanned<String>,
    class: &str,
    known: &[&'static str],
    other: &str,
    others: &[&'static str],
) {
    if others.contains(&kind.value.as_str()) {
        let message = format!("texture \"{}\" makes a {other}, not a {class}", kind.value);
        r.error_help("E0203", message, kind.span, format!("declare the texture as \"{other}\""));
    } else {
        unknown_name(r, "E0203", "texture", kind, known);
    }
}

fn mapping(r: &Reader, p: &Params) -> MappingDesc {
    let float = |name, default| p.float_or(r, name, default).value;
    let vector = |name, default| p.triple_or(r, name, Type::Vector3, default).value;
    match p.choice(r, "mapping", &[("uv", 0), ("spherical", 1), ("cylindrical", 2), ("planar", 3)], 0) {
        1 => MappingDesc::Spherical,
        2 => MappingDesc::Cylindrical,
        3 => MappingDesc::Planar {
            v1: vector("v1", [1.0, 0.0, 0.0]),
            v2: vector("v2", [0.0, 1.0, 0.0]),
            u_delta: float("udelta", 0.0),
            v_delta: float("vdelta", 0.0),
        },
        _ => MappingDesc::Uv {
            u_scale: float("uscale", 1.0),
            v_scale: float("vscale", 1.0),
            u_delta: float("udelta", 0.0),
            v_delta: float("vdelta", 0.0),
        },
    }
}

fn encoding(r: &Reader, p: &Params) -> EncodingDesc {
    let Some(word) = p.string(r, "encoding") else { return EncodingDesc::Default };
    match word.value.as_str() {
        "sRGB" => EncodingDesc::Srgb,
        "linear" => EncodingDesc::Linear,
        other => {
            let gamma = other.strip_prefix("gamma").map(str::trim);
            match gamma.and_then(|g| super::lex::parse_f32(g.as_bytes())).filter(|g| *g > 0.0) {
                Some(gamma) => EncodingDesc::Gamma(gamma),
                None => {
                    r.unknown("E0220", "value of \"encoding\":", &word, &["sRGB", "linear", "gamma 2.2"]);
                    EncodingDesc::Default
                }
            }
        }
    }
}

fn image_map(r: &Reader, p: &Params) -> Option<ImageMapDesc> {
    let filters = [
        ("point", ImageFilter::Point),
        ("bilinear", ImageFilter::Bilinear),
        ("trilinear", ImageFilter::Trilinear),
        ("ewa", ImageFilter::Ewa),
        ("EWA", ImageFilter::Ewa),
    ];
    let wraps = [
        ("repeat", ImageWrap::Repeat),
        ("black", ImageWrap::Black),
        ("clamp", ImageWrap::Clamp),
        ("octahedralsphere", ImageWrap::OctahedralSphere),
    ];
    let mapping = mapping(r, p);
    let max_anisotropy = p.float_or(r, "maxanisotropy", 8.0).value;
    let filter = p.choice(r, "filter", &filters, ImageFilter::Bilinear);
    let wrap = p.choice(r, "wrap", &wraps, ImageWrap::Repeat);
    let scale = p.float_or(r, "scale", 1.0).value;
    let invert = p.bool_or(r, "invert", false);
    let encoding = encoding(r, p);
    let Some(file) = p.file(r, "filename", "texture image") else {
        p.missing(r, "\"string filename\"");
        return None;
    };
    let color_space = p.color_space;
    Some(ImageMapDesc { file, filter, max_anisotropy, wrap, encoding, scale, invert, mapping, color_space })
}
