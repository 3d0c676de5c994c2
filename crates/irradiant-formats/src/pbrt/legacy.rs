//! What pbrt-v3 called things, and what they became: for helpful errors only.

use super::reader::Reader;
use irradiant_scene::{Span, Spanned};

/// (kind of thing, v3 name, what to write).
const NAMES: &[(&str, &str, &str)] = &[
    ("material", "matte", "use \"diffuse\" with \"rgb reflectance\" (was \"Kd\")"),
    ("material", "plastic", "use \"coateddiffuse\" with \"rgb reflectance\" (was \"Kd\")"),
    ("material", "substrate", "use \"coateddiffuse\" with \"rgb reflectance\" (was \"Kd\")"),
    ("material", "uber", "use \"coateddiffuse\", or \"mix\" of \"diffuse\" and \"interface\" for opacity"),
    ("material", "disney", "use \"coateddiffuse\" or \"conductor\""),
    ("material", "glass", "use \"dielectric\" with \"float eta\" (was \"index\")"),
    ("material", "metal", "use \"conductor\""),
    (
        "material",
        "mirror",
        "use \"conductor\" with \"spectrum eta\" \"metal-Ag-eta\" and \"spectrum k\" \"metal-Ag-k\"",
    ),
    ("material", "translucent", "use \"diffusetransmission\""),
    ("material", "kdsubsurface", "use \"subsurface\" with \"reflectance\""),
    ("material", "fourier", "use \"measured\""),
    ("sampler", "02sequence", "use \"paddedsobol\""),
    ("sampler", "lowdiscrepancy", "use \"paddedsobol\""),
    ("sampler", "maxmindist", "use \"zsobol\""),
    ("sampler", "random", "use \"independent\""),
    ("integrator", "directlighting", "use \"path\" with \"integer maxdepth\" 1"),
    ("integrator", "whitted", "use \"path\" with \"integer maxdepth\" 5"),
    ("film", "image", "use \"rgb\""),
    ("camera", "environment", "use \"spherical\" with \"string mapping\" \"equirectangular\""),
    ("light", "exinfinite", "use \"infinite\""),
    ("area light", "area", "use \"diffuse\""),
    ("shape", "heightfield", "convert it to \"trianglemesh\""),
    ("shape", "hyperboloid", "convert it to \"trianglemesh\""),
    ("shape", "paraboloid", "convert it to \"trianglemesh\""),
    ("shape", "cone", "convert it to \"trianglemesh\""),
    ("shape", "nurbs", "convert it to \"trianglemesh\""),
    ("texture", "uv", "use an \"imagemap\""),
    ("accelerator", "grid", "use \"bvh\""),
    ("medium", "heterogeneous", "use \"uniformgrid\""),
    ("filter", "lanczos", "use \"sinc\""),
];

/// Reports an unknown name, with what became of it if it is pbrt-v3's, else with the nearest known one.
pub(crate) fn unknown_name(
    r: &Reader,
    code: &'static str,
    kind: &'static str,
    name: &Spanned<String>,
    known: &[&'static str],
) {
    match NAMES.iter().find(|(k, n, _)| *k == kind && *n == name.value) {
        Some((_, _, help)) => {
            r.v3("E1102", format!("{kind} \"{}\" is pbrt-v3's", name.value), name.span, *help);
        }
        None => r.unknown(code, kind, name, known),
    }
}

/// What became of a pbrt-v3 parameter.
pub(crate) fn parameter(name: &str) -> Option<&'static str> {
    Some(match name {
        "Kd" => "pbrt-v4 calls it \"reflectance\"",
        "Kr" => "pbrt-v4 calls it \"reflectance\"; mirrors are conductors",
        "Kt" => "pbrt-v4's dielectrics have no colour factor; \"diffusetransmission\" has \"transmittance\"",
        "Ks" => "pbrt-v4's coats have no specular factor; leave it out",
        "index" => "pbrt-v4 calls it \"eta\"",
        "bumpmap" => "pbrt-v4 calls it \"displacement\"",
        "mapname" => "pbrt-v4 calls it \"filename\"",
        "nsamples" | "samples" => "pbrt-v4 draws one light sample at a time; leave it out",
        "lightsamplestrategy" => "pbrt-v4 calls it \"lightsampler\"",
        "shadowalpha" => "pbrt-v4 has \"alpha\" only",
        "discarddegenerateUVs" => "leave it out",
        "st" => "pbrt-v4 calls it \"point2 uv\"",
        "trilinear" => "pbrt-v4 says \"string filter\" \"trilinear\"",
        "rrthreshold" => "leave it out",
        "maxsampleluminance" => "pbrt-v4 calls it \"maxcomponentvalue\"",
        "gamma" => "pbrt-v4 says \"string encoding\" \"sRGB\", \"linear\" or \"gamma 2.2\"",
        _ => return None,
    })
}

/// A directive of pbrt-v3: what to write instead.
pub(crate) fn directive(word: &[u8]) -> Option<&'static str> {
    Some(match word {
        b"TransformBegin" => "use AttributeBegin",
        b"TransformEnd" => "use AttributeEnd",
        b"WorldEnd" => "leave it out: the world ends with the file",
        b"SurfaceIntegrator" | b"VolumeIntegrator" | b"Renderer" => "use Integrator",
        b"Volume" => "use MakeNamedMedium and MediumInterface",
        b"PixelSampler" => "use Sampler",
        _ => return None,
    })
}

/// A type of parameters of pbrt-v3 that pbrt-v4 refuses: what to write instead.
pub(crate) fn parameter_type(name: &str) -> Option<&'static str> {
    Some(match name {
        "color" => "pbrt-v4 calls it \"rgb\"",
        "xyz" => "convert to \"rgb\" or give a \"spectrum\"",
        _ => return None,
    })
}

/// Reports texture classes that are pbrt-v3's.
pub(crate) fn texture_class(r: &Reader, class: &Spanned<String>) {
    if class.value == "color" {
        r.v3("E1102", "texture class \"color\" is pbrt-v3's", class.span, "use \"spectrum\"");
    } else {
        r.unknown("E0212", "texture class", class, &["float", "spectrum"]);
    }
}

/// Reports a deprecated directive.
pub(crate) fn unknown_directive(r: &Reader, help: &str, span: Span) {
    r.v3("E1101", "this directive is pbrt-v3's", span, help);
}
