//! Spectra: by RGB, by temperature, by samples, by name, from a file.

use super::super::reader::Reader;
use super::{Param, Params, Role, SPECTRUM, Type, Values, number_file};
use irradiant_scene::desc::{SpannedSpectrum, SpectrumDesc, SpectrumParam};
use irradiant_scene::{Diagnostic, Span, Spanned};

use std::sync::Arc;

impl Params {
    /// A spectrum, if given.
    pub fn spectrum(&self, r: &Reader, name: &'static str, role: Role) -> Option<Spanned<SpectrumDesc>> {
        self.find(name, &SPECTRUM).and_then(|p| self.spectrum_of(r, p, role))
    }

    /// A number or a spectrum, if given.
    pub fn float_or_spectrum(&self, r: &Reader, name: &'static str, role: Role) -> Option<SpannedSpectrum> {
        let p = self.find(name, &[Type::Float]).or_else(|| self.find(name, &SPECTRUM))?;
        let value = match p.kind {
            Type::Float => self.one_float_of(r, p).map(|v| v.map(SpectrumDesc::Constant)),
            _ => self.spectrum_of(r, p, role),
        };
        value.map(|s| s.map(SpectrumParam::Value))
    }

    pub(super) fn spectrum_of(&self, r: &Reader, p: &Param, role: Role) -> Option<Spanned<SpectrumDesc>> {
        let desc = match (p.kind, &p.values) {
            (Type::Rgb, Values::Floats(v)) => {
                if !self.count(r, p, 3) {
                    return None;
                }
                if let Some(bad) = v.iter().find(|c| **c < 0.0 || (role == Role::Albedo && **c > 1.0)) {
                    let (range, help) = match role {
                        Role::Albedo => {
                            ("[0, 1]", "a reflectance of 1 already returns all light; is this a light's colour?")
                        }
                        _ => ("[0, inf)", "colours cannot be negative"),
                    };
                    r.push(
                        Diagnostic::error(
                            "E0306",
                            format!("RGB component {bad} of \"{}\" is outside {range}", p.name),
                            p.value_span,
                        )
                        .help(help),
                    );
                    return None;
                }
                SpectrumDesc::Rgb([v[0], v[1], v[2]], p.attribute.unwrap_or(self.color_space))
            }
            (Type::Blackbody, Values::Floats(v)) => {
                if v.len() == 2 {
                    r.v3(
                        "E1103",
                        "\"blackbody\" with two values is pbrt-v3's",
                        p.value_span,
                        "give the temperature alone, and the factor as \"float scale\"",
                    );
                    return None;
                }
                if !self.count(r, p, 1) {
                    return None;
                }
                if v[0] <= 0.0 {
                    r.error("E0309", format!("a temperature of {} K", v[0]), p.value_span);
                    return None;
                }
                SpectrumDesc::Blackbody(v[0])
            }
            (_, Values::Floats(v)) => SpectrumDesc::Samples(samples(r, &p.name, v, p.value_span)?),
            (_, Values::Strings(v)) if self.count(r, p, 1) => named_or_file(r, &v[0])?,
            _ => return None,
        };
        Some(Spanned::new(desc, p.value_span))
    }
}

/// Pairs of wavelength and value with ascending wavelengths.
fn samples(r: &Reader, name: &str, v: &[f32], span: Span) -> Option<Arc<[(f32, f32)]>> {
    if v.is_empty() || !v.len().is_multiple_of(2) {
        r.push(
            Diagnostic::error("E0307", format!("spectrum \"{name}\" has {} values", v.len()), span)
                .label("expected pairs of wavelength (nm) and value")
                .help("for the same value at all wavelengths give it at 360 and 830 nm"),
        );
        return None;
    }
    let pairs: Arc<[(f32, f32)]> = v.as_chunks::<2>().0.iter().map(|p| (p[0], p[1])).collect();
    if let Some(w) = pairs.windows(2).find(|w| w[1].0 <= w[0].0) {
        let message = format!("the wavelengths of spectrum \"{name}\" do not ascend: {} after {}", w[1].0, w[0].0);
        r.error("E0307", message, span);
        return None;
    }
    Some(pairs)
}

fn named_or_file(r: &Reader, name: &Spanned<String>) -> Option<SpectrumDesc> {
    if irradiant_spectrum::names().any(|n| n == name.value) {
        return Some(SpectrumDesc::Named(name.value.clone()));
    }
    let path = r.resolve(name);
    if let Some(known) = r.spectra.borrow().get(&path) {
        return known.clone().map(SpectrumDesc::Samples);
    }
    let looks_like_a_name = !name.value.contains(['.', '/', '\\']);
    let read = if looks_like_a_name && r.assets_lack(&path) {
        unknown_spectrum(r, name);
        None
    } else {
        r.bytes("spectrum file", name, &path, name.span).and_then(|bytes| {
            let values = number_file(&bytes).map_err(|line| {
                r.error("E0308", format!("spectrum file \"{}\", line {line}: not a number", name.value), name.span);
            });
            samples(r, name, &values.ok()?, name.span)
        })
    };
    r.spectra.borrow_mut().insert(path, read.clone());
    read.map(SpectrumDesc::Samples)
}

/// How people call what the spectra's names abbreviate.
const SUBSTANCES: [(&str, &str); 9] = [
    ("aluminium", "Al"),
    ("aluminum", "Al"),
    ("brass", "CuZn"),
    ("copper", "Cu"),
    ("gold", "Au"),
    ("silver", "Ag"),
    ("magnesium oxide", "MgO"),
    ("magnesiumoxide", "MgO"),
    ("titanium", "TiO2"),
];

/// An unknown spectrum: the chemist's name if the word holds the everyday one ("metal-Gold-eta"), else the nearest.
fn unknown_spectrum(r: &Reader, name: &Spanned<String>) {
    let word = name.value.to_lowercase();
    let names = || irradiant_spectrum::names();
    let Some((_, symbol)) = SUBSTANCES.iter().find(|(everyday, _)| word.contains(everyday)) else {
        return r.unknown("E0308", "spectrum", name, &names().collect::<Vec<_>>());
    };
    let index = if word.ends_with('k') { "-k" } else { "-eta" };
    let meant = format!("metal-{symbol}{index}");
    match names().find(|n| *n == meant) {
        Some(meant) => {
            let help = format!("did you mean \"{meant}\"?");
            r.error_help("E0308", format!("unknown spectrum \"{}\"", name.value), name.span, help);
        }
        None => r.unknown("E0308", "spectrum", name, &names().collect::<Vec<_>>()),
    }
}
