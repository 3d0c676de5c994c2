//! Parameter lists: `"float radius" [ 1 ]`, looked up by name and type, each use remembered.
//!
//! As in pbrt-v4 a parameter is found by its name *and* its type, later ones hide earlier ones, those of an `Attribute`
//! statement come last and may stay unused, and any other that nobody asked for is an error.

mod spectra;

use super::reader::Reader;
use irradiant_scene::desc::{
    ColorSpaceName, FileDesc, FloatParam, FloatTextureRef, SpannedFloat, SpannedSpectrum, SpectrumDesc, SpectrumParam,
    SpectrumTextureRef,
};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{Diagnostic, Span, Spanned};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The types of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Bool,
    Float,
    Integer,
    Point2,
    Vector2,
    Point3,
    Vector3,
    Normal,
    Rgb,
    Spectrum,
    Blackbody,
    String,
    Texture,
}

impl Type {
    /// pbrt-v4's names.
    pub const NAMES: [(&'static str, Type); 13] = [
        ("bool", Type::Bool),
        ("float", Type::Float),
        ("integer", Type::Integer),
        ("point2", Type::Point2),
        ("vector2", Type::Vector2),
        ("point3", Type::Point3),
        ("vector3", Type::Vector3),
        ("normal", Type::Normal),
        ("rgb", Type::Rgb),
        ("spectrum", Type::Spectrum),
        ("blackbody", Type::Blackbody),
        ("string", Type::String),
        ("texture", Type::Texture),
    ];

    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, t)| *t == self).map_or("", |(n, _)| n)
    }

    /// Values that make one item.
    const fn arity(self) -> usize {
        match self {
            Type::Point2 | Type::Vector2 => 2,
            Type::Point3 | Type::Vector3 | Type::Normal | Type::Rgb => 3,
            _ => 1,
        }
    }
}

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Values {
    Floats(Vec<f32>),
    Integers(Vec<i32>),
    Strings(Vec<Spanned<String>>),
    Bools(Vec<bool>),
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Values::Floats(v) => v.len(),
            Values::Integers(v) => v.len(),
            Values::Strings(v) => v.len(),
            Values::Bools(v) => v.len(),
        }
    }
}

/// One parameter.
#[derive(Clone, Debug)]
pub(crate) struct Param {
    pub kind: Type,
    pub name: String,
    /// Of the declaration, `"float radius"`.
    pub span: Span,
    /// Of the value or values.
    pub value_span: Span,
    pub values: Values,
    /// Set by an `Attribute` statement: the colour space there. Such a parameter may stay unused.
    pub attribute: Option<ColorSpaceName>,
    pub used: Cell<bool>,
}

/// What an RGB triple or a spectrum stands for; RGB is checked accordingly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Albedo,
    Unbounded,
    Illuminant,
}

/// The textures that may be used so far, and those that exist at all.
#[derive(Default)]
pub(crate) struct TextureNames {
    pub float: BTreeMap<String, FloatTextureRef>,
    pub spectrum: BTreeMap<String, SpectrumTextureRef>,
    /// Where each was defined.
    pub all_float: BTreeMap<String, Span>,
    pub all_spectrum: BTreeMap<String, Span>,
}

/// The parameters of one thing.
pub(crate) struct Params {
    own: Vec<Param>,
    attributes: Rc<Vec<Rc<Param>>>,
    pub color_space: ColorSpaceName,
    /// For messages: `shape "sphere"`.
    subject: String,
    /// Of the directive and the name after it.
    pub span: Span,
    asked: RefCell<Vec<(&'static str, Vec<Type>)>>,
    /// A parameter has been reported and left out: what seems to be missing may have been it.
    pub incomplete: bool,
}

const SPECTRUM: [Type; 3] = [Type::Rgb, Type::Spectrum, Type::Blackbody];
const SPECTRUM_OR_TEXTURE: [Type; 4] = [Type::Texture, Type::Rgb, Type::Spectrum, Type::Blackbody];

impl Params {
    pub fn new(
        own: Vec<Param>,
        attributes: Rc<Vec<Rc<Param>>>,
        color_space: ColorSpaceName,
        subject: impl Into<String>,
        span: Span,
    ) -> Self {
        Self {
            own,
            attributes,
            color_space,
            subject: subject.into(),
            span,
            asked: RefCell::default(),
            incomplete: false,
        }
    }

    /// The parameter that counts: the last own one, then the last of the attributes.
    pub fn find(&self, name: &'static str, types: &[Type]) -> Option<&Param> {
        {
            let mut asked = self.asked.borrow_mut();
            match asked.iter_mut().find(|(n, _)| *n == name) {
                Some((_, known)) => types.iter().for_each(|t| {
                    if !known.contains(t) {
                        known.push(*t);
                    }
                }),
                None => asked.push((name, types.to_vec())),
            }
        }
        let attributes = self.attributes.iter().rev().map(|p| &**p);
        let found = self.own.iter().rev().chain(attributes).find(|p| p.name == name && types.contains(&p.kind))?;
        found.used.set(true);
        Some(found)
    }

    /// True when there is such a parameter, of whatever type.
    pub fn has(&self, name: &str) -> bool {
        self.own.iter().any(|p| p.name == name)
    }

    fn count(&self, r: &Reader, p: &Param, expected: usize) -> bool {
        let n = p.values.len();
        if n == expected {
            return true;
        }
        let what = if n == 0 { "no value".into() } else { format!("{n} values") };
        let plural = if expected == 1 { "" } else { "s" };
        r.push(
            Diagnostic::error(
                "E0303",
                format!("parameter \"{}\" of {} has {what}", p.name, self.subject),
                p.value_span,
            )
            .label(format!("expected {expected} value{plural}")),
        );
        false
    }

    fn one_float_of(&self, r: &Reader, p: &Param) -> Option<Spanned<f32>> {
        match &p.values {
            Values::Floats(v) if self.count(r, p, 1) => Some(Spanned::new(v[0], p.value_span)),
            _ => None,
        }
    }

    /// A number, if given.
    pub fn float(&self, r: &Reader, name: &'static str) -> Option<Spanned<f32>> {
        self.find(name, &[Type::Float]).and_then(|p| self.one_float_of(r, p))
    }

    /// A number or its default.
    pub fn float_or(&self, r: &Reader, name: &'static str, default: f32) -> Spanned<f32> {
        self.float(r, name).unwrap_or(Spanned::unplaced(default))
    }

    /// An integer, if given.
    pub fn integer(&self, r: &Reader, name: &'static str) -> Option<Spanned<i32>> {
        let p = self.find(name, &[Type::Integer])?;
        match &p.values {
            Values::Integers(v) if self.count(r, p, 1) => Some(Spanned::new(v[0], p.value_span)),
            _ => None,
        }
    }

    /// An integer or its default.
    pub fn integer_or(&self, r: &Reader, name: &'static str, default: i32) -> Spanned<i32> {
        self.integer(r, name).unwrap_or(Spanned::unplaced(default))
    }

    /// An integer in a range, or its default.
    pub fn integer_in(
        &self,
        r: &Reader,
        name: &'static str,
        default: i32,
        range: std::ops::RangeInclusive<i32>,
    ) -> Spanned<i32> {
        let v = self.integer_or(r, name, default);
        if range.contains(&v.value) {
            return v;
        }
        let expected = match (*range.start(), *range.end()) {
            (a, i32::MAX) => format!("expected {a} or more"),
            (a, b) => format!("expected {a} to {b}"),
        };
        r.push(
            Diagnostic::error("E0309", format!("\"{name}\" of {} is {}", self.subject, v.value), v.span)
                .label(expected),
        );
        Spanned::new(default, v.span)
    }

    /// A truth value or its default.
    pub fn bool_or(&self, r: &Reader, name: &'static str, default: bool) -> bool {
        self.find(name, &[Type::Bool])
            .and_then(|p| match &p.values {
                Values::Bools(v) if self.count(r, p, 1) => Some(v[0]),
                _ => None,
            })
            .unwrap_or(default)
    }

    /// A string, if given.
    pub fn string(&self, r: &Reader, name: &'static str) -> Option<Spanned<String>> {
        let p = self.find(name, &[Type::String])?;
        match &p.values {
            Values::Strings(v) if self.count(r, p, 1) => Some(v[0].clone()),
            _ => None,
        }
    }

    /// Several strings, if given.
    pub fn strings(&self, name: &'static str) -> Option<Spanned<&[Spanned<String>]>> {
        let p = self.find(name, &[Type::String])?;
        match &p.values {
            Values::Strings(v) => Some(Spanned::new(v, p.value_span)),
            _ => None,
        }
    }

    /// One of some words; an unknown one is an error and gives the default.
    pub fn choice<T: Copy>(&self, r: &Reader, name: &'static str, choices: &[(&'static str, T)], default: T) -> T {
        let Some(word) = self.string(r, name) else { return default };
        match choices.iter().find(|(n, _)| *n == word.value) {
            Some((_, value)) => *value,
            None => {
                let names: Vec<&str> = choices.iter().map(|(n, _)| *n).collect();
                r.unknown("E0220", &format!("value of \"{name}\":"), &word, &names);
                default
            }
        }
    }

    /// A file that exists, if given and not empty.
    pub fn file(&self, r: &Reader, name: &'static str, what: &str) -> Option<Spanned<FileDesc>> {
        self.string(r, name).filter(|f| !f.is_empty()).map(|f| r.file(what, f))
    }

    fn list(&self, r: &Reader, name: &'static str, kind: Type) -> Option<Spanned<&[f32]>> {
        let p = self.find(name, &[kind])?;
        let Values::Floats(v) = &p.values else { return None };
        let arity = kind.arity();
        if v.is_empty() {
            r.error("E0303", format!("parameter \"{name}\" of {} has no value", self.subject), p.value_span);
            return None;
        }
        if v.len() % arity != 0 {
            r.push(
                Diagnostic::error(
                    "E0303",
                    format!("parameter \"{name}\" of {} has {} values", self.subject, v.len()),
                    p.value_span,
                )
                .label(format!("a {} takes {arity} each", kind.name())),
            );
            return None;
        }
        Some(Spanned::new(v, p.value_span))
    }

    /// Exactly `N` numbers, if given.
    pub fn floats_n<const N: usize>(&self, r: &Reader, name: &'static str) -> Option<Spanned<[f32; N]>> {
        let p = self.find(name, &[Type::Float])?;
        match &p.values {
            Values::Floats(v) if self.count(r, p, N) => Some(Spanned::new(std::array::from_fn(|i| v[i]), p.value_span)),
            _ => None,
        }
    }

    /// Integers, if given.
    pub fn integers(&self, r: &Reader, name: &'static str) -> Option<Spanned<&[i32]>> {
        let p = self.find(name, &[Type::Integer])?;
        let Values::Integers(v) = &p.values else { return None };
        if v.is_empty() {
            r.error("E0303", format!("parameter \"{name}\" of {} has no value", self.subject), p.value_span);
            return None;
        }
        Some(Spanned::new(v, p.value_span))
    }

    /// A list of points, vectors or normals.
    pub fn triples(&self, r: &Reader, name: &'static str, kind: Type) -> Option<Spanned<Vec<[f32; 3]>>> {
        self.list(r, name, kind).map(|l| l.map(|v| v.as_chunks::<3>().0.to_vec()))
    }

    /// A list of 2D points.
    pub fn pairs(&self, r: &Reader, name: &'static str) -> Option<Spanned<Vec<[f32; 2]>>> {
        self.list(r, name, Type::Point2).map(|l| l.map(|v| v.as_chunks::<2>().0.to_vec()))
    }

    /// One point or vector, or its default.
    pub fn triple_or(&self, r: &Reader, name: &'static str, kind: Type, default: [f32; 3]) -> Spanned<[f32; 3]> {
        self.find(name, &[kind])
            .and_then(|p| match &p.values {
                Values::Floats(v) if self.count(r, p, 3) => Some(Spanned::new([v[0], v[1], v[2]], p.value_span)),
                _ => None,
            })
            .unwrap_or(Spanned::unplaced(default))
    }

    /// A spectrum or a texture, if given.
    pub fn spectrum_param(
        &self,
        r: &Reader,
        t: &TextureNames,
        name: &'static str,
        role: Role,
    ) -> Option<SpannedSpectrum> {
        let p = self.find(name, &SPECTRUM_OR_TEXTURE)?;
        if p.kind != Type::Texture {
            return self.spectrum_of(r, p, role).map(|s| s.map(SpectrumParam::Value));
        }
        let Values::Strings(v) = &p.values else { return None };
        if !self.count(r, p, 1) {
            return None;
        }
        let found = t.spectrum.get(&v[0].value).copied();
        if found.is_none() {
            unknown_texture(r, &v[0], "spectrum", &t.all_spectrum, "float", &t.all_float);
        }
        found.map(|id| Spanned::new(SpectrumParam::Texture(id), v[0].span))
    }

    /// A spectrum or a texture, or a constant.
    pub fn spectrum_param_or(
        &self,
        r: &Reader,
        t: &TextureNames,
        name: &'static str,
        role: Role,
        default: SpectrumDesc,
    ) -> SpannedSpectrum {
        self.spectrum_param(r, t, name, role).unwrap_or(Spanned::unplaced(SpectrumParam::Value(default)))
    }

    /// A number or a texture, if given.
    pub fn float_param(&self, r: &Reader, t: &TextureNames, name: &'static str) -> Option<SpannedFloat> {
        let p = self.find(name, &[Type::Float, Type::Texture])?;
        if p.kind == Type::Float {
            return self.one_float_of(r, p).map(|v| v.map(FloatParam::Value));
        }
        let Values::Strings(v) = &p.values else { return None };
        if !self.count(r, p, 1) {
            return None;
        }
        float_texture(r, t, &v[0]).map(|id| Spanned::new(FloatParam::Texture(id), v[0].span))
    }

    /// A number or a texture, or a constant.
    pub fn float_param_or(&self, r: &Reader, t: &TextureNames, name: &'static str, default: f32) -> SpannedFloat {
        self.float_param(r, t, name).unwrap_or(Spanned::unplaced(FloatParam::Value(default)))
    }

    /// The name of a texture, if given; to be resolved later.
    pub fn texture_name(&self, r: &Reader, name: &'static str) -> Option<Spanned<String>> {
        let p = self.find(name, &[Type::Texture])?;
        match &p.values {
            Values::Strings(v) if self.count(r, p, 1) => Some(v[0].clone()),
            _ => None,
        }
    }

    /// Reports what nobody asked for, and what was given twice.
    pub fn finish(&self, r: &Reader) {
        let asked = self.asked.borrow();
        for (i, p) in self.own.iter().enumerate() {
            if let Some(again) = self.own[i + 1..].iter().find(|q| q.name == p.name && q.kind == p.kind) {
                r.push(
                    Diagnostic::warning(
                        "W0112",
                        format!("\"{}\" is given twice; the last one counts", p.name),
                        again.span,
                    )
                    .also(p.span, "first given here"),
                );
                continue;
            }
            if p.used.get() {
                continue;
            }
            let Some((_, types)) = asked.iter().find(|(n, _)| *n == p.name) else {
                self.unknown_parameter(r, p, &asked);
                continue;
            };
            if types.contains(&p.kind) {
                r.push(
                    Diagnostic::error("E0305", format!("\"{}\" is given in two types", p.name), p.span)
                        .help("keep one of them"),
                );
                continue;
            }
            let names: Vec<&str> = types.iter().map(|t| t.name()).collect();
            r.push(
                Diagnostic::error(
                    "E0302",
                    format!("\"{}\" of {} cannot be a {}", p.name, self.subject, p.kind.name()),
                    p.span,
                )
                .label(format!("expected {}", names.join(" or ")))
                .help(format!("write \"{} {}\"", names[0], p.name)),
            );
        }
    }

    fn unknown_parameter(&self, r: &Reader, p: &Param, asked: &[(&'static str, Vec<Type>)]) {
        let message = format!("{} has no parameter \"{}\"", self.subject, p.name);
        if let Some(help) = super::legacy::parameter(&p.name) {
            return r.v3("E0301", message, p.span, help);
        }
        let names: Vec<&str> = asked.iter().map(|(n, _)| *n).collect();
        let help = match did_you_mean(&p.name, names.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None if names.is_empty() => "it takes no parameters".into(),
            None => format!("it takes: {}", names.join(", ")),
        };
        r.error_help("E0301", message, p.span, help);
    }

    /// An error about this thing as a whole, unless it has been said why that is missing.
    pub fn missing(&self, r: &Reader, what: &str) {
        if !self.incomplete {
            r.error("E0304", format!("{} needs {what}", self.subject), self.span);
        }
    }
}

/// The float texture of a name; an error if there is none yet.
pub(crate) fn float_texture(r: &Reader, t: &TextureNames, name: &Spanned<String>) -> Option<FloatTextureRef> {
    let found = t.float.get(&name.value).copied();
    if found.is_none() {
        unknown_texture(r, name, "float", &t.all_float, "spectrum", &t.all_spectrum);
    }
    found
}

fn unknown_texture(
    r: &Reader,
    name: &Spanned<String>,
    kind: &str,
    all: &BTreeMap<String, Span>,
    other_kind: &str,
    other: &BTreeMap<String, Span>,
) {
    if r.is_defined_wrongly(name) {
        return;
    }
    if let Some(place) = all.get(&name.value) {
        r.push(
            Diagnostic::error("E0404", format!("texture \"{}\" is used before it is defined", name.value), name.span)
                .also(*place, "defined here")
                .help("textures can use image maps and the textures above them; move this one down"),
        );
    } else if let Some(place) = other.get(&name.value) {
        r.push(
            Diagnostic::error(
                "E0403",
                format!("\"{}\" is a {other_kind} texture; a {kind} texture is needed here", name.value),
                name.span,
            )
            .also(*place, "defined here"),
        );
    } else {
        let names: Vec<&str> = all.keys().map(String::as_str).collect();
        r.unknown("E0402", &format!("{kind} texture"), name, &names);
    }
}

/// The numbers of a text file, with `#` comments; `Err` with the line of what is not one.
pub(crate) fn number_file(bytes: &[u8]) -> Result<Vec<f32>, usize> {
    let mut out = vec![];
    for (i, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let line = line.split(|b| *b == b'#').next().unwrap_or_default();
        for word in line.split(|b| b.is_ascii_whitespace() || *b == b',').filter(|w| !w.is_empty()) {
            out.push(super::lex::parse_f32(word).ok_or(i + 1)?);
        }
    }
    Ok(out)
}
