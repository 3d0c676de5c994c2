//! `MakeNamedMedium`: checked, and rendered as vacuum for now.

use super::legacy::unknown_name;
use super::params::{Params, Type};
use super::reader::Reader;
use irradiant_scene::Spanned;

const KINDS: &[&str] = &["cloud", "homogeneous", "nanovdb", "rgbgrid", "uniformgrid"];

/// What the media of pbrt-v4 take between them; which takes which is not checked while none is rendered.
const SPECTRA: &[&str] = &["sigma_a", "sigma_s", "Le"];
const FLOATS: &[&str] = &[
    "scale",
    "g",
    "Lescale",
    "LeScale",
    "density",
    "temperature",
    "temperatureoffset",
    "temperaturescale",
    "temperaturecutoff",
    "wispiness",
    "frequency",
];

pub(crate) fn check(r: &Reader, p: &Params) {
    let Some(kind) = p.string(r, "type") else {
        p.missing(r, "\"string type\", for example \"homogeneous\"");
        return;
    };
    if !KINDS.contains(&kind.value.as_str()) {
        unknown_name(r, "E0214", "medium", &Spanned::new(kind.value.clone(), kind.span), KINDS);
        return;
    }
    for name in ["preset", "filename"] {
        p.find(name, &[Type::String]);
    }
    for name in SPECTRA {
        p.find(name, &[Type::Rgb, Type::Spectrum, Type::Blackbody]);
    }
    for name in FLOATS {
        p.find(name, &[Type::Float]);
    }
    // The grids of "rgbgrid" are lists of colours under the names of spectra, found above.
    for name in ["nx", "ny", "nz"] {
        p.find(name, &[Type::Integer]);
    }
    for name in ["p0", "p1"] {
        p.find(name, &[Type::Point3]);
    }
    p.finish(r);
}
