//! The directives, in the order they stand; includes and imports; nesting.

use super::legacy;
use super::lex::{Kind, Lexer, ListEnd, Token, parse_f32, parse_f64, parse_i32};
use super::params::{Param, Params, Type, Values};
use super::reader::Reader;
use super::state::*;
use super::{camera, film, lights, media, settings, shapes};
use irradiant_math::Transform;
use irradiant_scene::desc::{ColorSpaceName, LightDesc, ObjectDesc, SceneDesc, ShapeDesc};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{Diagnostic, FileId, Span, Spanned};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

/// The complaint has been made; go on at the next directive.
pub(crate) struct Abandoned;
type Parsing<T> = Result<T, Abandoned>;

const DIRECTIVES: &[&str] = &[
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformTimes",
    "Translate",
    "WorldBegin",
];

/// Where a directive may stand.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Block {
    Options,
    World,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Opened {
    Attribute,
    Object,
}

struct Pushed {
    opened: Opened,
    span: Span,
    state: GraphicsState,
}

/// A text that is being read.
struct Frame {
    lexer: Lexer,
    path: Option<PathBuf>,
    /// Of an `Import`: what to restore at its end, and how deep the nesting was.
    import: Option<(GraphicsState, BTreeMap<String, TransformPair>, usize)>,
}

/// All that directives have said so far.
pub(crate) struct Parser<'r, 'a> {
    pub r: &'r Reader<'a>,
    frames: Vec<Frame>,
    state: GraphicsState,
    pushed: Vec<Pushed>,
    block: Block,
    world_begin: Span,
    coordinate_systems: BTreeMap<String, TransformPair>,
    active_object: Option<usize>,
    bytes_left: u64,
    told_transform_begin: bool,
    pub desc: SceneDesc,
    pub textures: Vec<PendingTexture>,
    pub materials: Vec<PendingMaterial>,
    pub named_materials: BTreeMap<String, u32>,
    pub media: BTreeMap<String, Span>,
    pub camera_medium: Option<Rc<Spanned<String>>>,
    pub light_media: Vec<Rc<Spanned<String>>>,
    pub shapes: Vec<PendingShape>,
    pub objects: Vec<PendingObject>,
    pub instances: Vec<PendingInstance>,
    pub integrator: settings::IntegratorRequest,
}

impl<'r, 'a> Parser<'r, 'a> {
    pub fn new(r: &'r Reader<'a>) -> Self {
        let nothing = || Params::new(vec![], Rc::default(), ColorSpaceName::Srgb, "the default material", Span::NONE);
        Self {
            r,
            frames: vec![],
            state: GraphicsState::default(),
            pushed: vec![],
            block: Block::Options,
            world_begin: Span::NONE,
            coordinate_systems: BTreeMap::new(),
            active_object: None,
            bytes_left: r.limits.max_total_bytes,
            told_transform_begin: false,
            desc: SceneDesc::default(),
            textures: vec![],
            materials: vec![PendingMaterial {
                name: None,
                kind: Spanned::unplaced("diffuse".into()),
                params: nothing(),
            }],
            named_materials: BTreeMap::new(),
            media: BTreeMap::new(),
            camera_medium: None,
            light_media: vec![],
            shapes: vec![],
            objects: vec![],
            instances: vec![],
            integrator: settings::IntegratorRequest::default(),
        }
    }

    /// Reads the main text and all that it includes.
    pub fn run(&mut self, name: &str, text: Arc<[u8]>) {
        let file = self.r.add_source(name, text.clone());
        if text.len() > u32::MAX as usize {
            self.r.error("E0502", "scene texts are limited to 4 GiB", Span { file, start: 0, end: 0 });
            return;
        }
        self.bytes_left = self.bytes_left.saturating_sub(text.len() as u64);
        let end = text.len() as u32;
        // A scene that includes itself does so by the name of its file, beside which it stands.
        let own_name = std::path::Path::new(name).file_name().map(|n| n.to_string_lossy());
        let path = own_name.map(|n| self.r.resolve(&n));
        self.frames.push(Frame { lexer: Lexer::new(text, file), path, import: None });
        while let Some(frame) = self.frames.last_mut() {
            if self.r.gave_up() {
                break;
            }
            let token = frame.lexer.next();
            if token.kind == Kind::End {
                self.end_of_file();
            } else if self.directive(token).is_err() {
                self.skip_to_directive();
            }
        }
        if self.r.gave_up() {
            return;
        }
        if self.block == Block::Options {
            let span = Span { file, start: end, end };
            let help = "write WorldBegin between the camera and the shapes";
            self.r.error_help("E0104", "the scene ends before WorldBegin", span, help);
        }
        while let Some(open) = self.pushed.pop() {
            self.missing_end(&open);
        }
    }

    fn missing_end(&self, open: &Pushed) {
        let (begin, end) = match open.opened {
            Opened::Attribute => ("AttributeBegin", "AttributeEnd"),
            Opened::Object => ("ObjectBegin", "ObjectEnd"),
        };
        self.r.error("E0103", format!("{begin} without {end}"), open.span);
    }

    fn end_of_file(&mut self) {
        let Some(frame) = self.frames.pop() else { return };
        let Some((state, systems, depth)) = frame.import else { return };
        while self.pushed.len() > depth {
            if let Some(open) = self.pushed.pop() {
                self.missing_end(&open);
            }
        }
        self.state = state;
        self.coordinate_systems = systems;
    }

    // Tokens.

    fn lexer(&mut self) -> &mut Lexer {
        // `run` calls directives only while there is a frame.
        let last = self.frames.len() - 1;
        &mut self.frames[last].lexer
    }

    fn span(&mut self, token: Token) -> Span {
        self.lexer().span(token)
    }

    fn skip_to_directive(&mut self) {
        loop {
            let lexer = self.lexer();
            let token = lexer.peek();
            let at_directive = token.kind == Kind::Word
                && DIRECTIVES.iter().any(|d| d.as_bytes() == lexer.bytes(token))
                || token.kind == Kind::Word && legacy::directive(lexer.bytes(token)).is_some();
            if token.kind == Kind::End || at_directive {
                return;
            }
            lexer.next();
        }
    }

    /// Complains about a token that is not what had to come.
    fn expected<T>(&mut self, code: &'static str, token: Token, what: &str) -> Parsing<T> {
        let span = self.span(token);
        let shown = String::from_utf8_lossy(self.lexer().bytes(token)).chars().take(40).collect::<String>();
        match token.kind {
            Kind::End => self.r.error("E0005", format!("the file ends where {what} is expected"), span),
            Kind::Unterminated => {
                self.r.error_help("E0001", "this string has no end", span, "close it with \" on the same line");
            }
            _ => self.r.push(
                Diagnostic::error(code, format!("expected {what}, found {shown}"), span).label(format!("not {what}")),
            ),
        }
        Err(Abandoned)
    }

    fn string(&mut self, what: &str) -> Parsing<Spanned<String>> {
        let token = self.lexer().next();
        if token.kind != Kind::Text {
            return self.expected("E0003", token, what);
        }
        self.dequote(token)
    }

    fn dequote(&mut self, token: Token) -> Parsing<Spanned<String>> {
        let span = self.span(token);
        match self.lexer().string(token) {
            Ok(text) => Ok(Spanned::new(text, span)),
            Err(place) => {
                let help = r#"known: \b \f \n \r \t \\ \' \""#;
                self.r.error_help("E0002", "unknown escape in a string", place, help);
                Err(Abandoned)
            }
        }
    }

    fn number(&mut self) -> Parsing<f64> {
        let token = self.lexer().next();
        let value = match token.kind {
            Kind::Word => parse_f64(self.lexer().bytes(token)),
            _ => None,
        };
        match value {
            Some(v) => Ok(v),
            None => self.expected("E0004", token, "a number"),
        }
    }

    fn numbers<const N: usize>(&mut self) -> Parsing<[f64; N]> {
        let mut out = [0.0; N];
        for v in &mut out {
            *v = self.number()?;
        }
        Ok(out)
    }

    /// Sixteen numbers in brackets, column-major as pbrt writes them.
    fn matrix(&mut self) -> Parsing<[f64; 16]> {
        let open = self.lexer().next();
        if open.kind != Kind::Open {
            return self.expected("E0013", open, "[ and 16 numbers");
        }
        let m = self.numbers()?;
        let close = self.lexer().next();
        if close.kind != Kind::Close {
            return self.expected("E0013", close, "] after 16 numbers");
        }
        Ok(m)
    }

    // Parameter lists.

    fn parameters(&mut self) -> Parsing<Vec<Param>> {
        let mut list = vec![];
        loop {
            let token = self.lexer().peek();
            match token.kind {
                Kind::Text => {
                    self.lexer().next();
                    if let Some(p) = self.parameter(token)? {
                        list.push(p);
                    }
                }
                Kind::Unterminated => {
                    self.lexer().next();
                    return self.expected("E0001", token, "a parameter");
                }
                _ => return Ok(list),
            }
        }
    }

    fn parameter(&mut self, token: Token) -> Parsing<Option<Param>> {
        let declaration = self.dequote(token)?;
        let mut words = declaration.value.split_ascii_whitespace();
        let (Some(type_name), Some(name), None) = (words.next(), words.next(), words.next()) else {
            let message = format!("\"{}\" is not a parameter declaration", declaration.value);
            let help = "a type and a name in one string, as in \"float radius\"";
            self.r.error_help("E0008", message, declaration.span, help);
            return Err(Abandoned);
        };
        let kind = self.parameter_type(type_name, declaration.span);
        let first = self.lexer().peek();
        let values = self.values(kind.unwrap_or(Type::String), kind.is_some(), &declaration.value)?;
        let (Some(kind), Some((values, end))) = (kind, values) else { return Ok(None) };
        let value_span = Span { end: end as u32, ..self.span(first) };
        Ok(Some(Param {
            kind,
            name: name.into(),
            span: declaration.span,
            value_span,
            values,
            attribute: None,
            used: Cell::new(false),
        }))
    }

    fn parameter_type(&mut self, name: &str, span: Span) -> Option<Type> {
        if let Some((_, t)) = Type::NAMES.iter().find(|(n, _)| *n == name) {
            return Some(*t);
        }
        let alias = match name {
            "point" => Some(Type::Point3),
            "vector" => Some(Type::Vector3),
            "normal3" => Some(Type::Normal),
            _ => None,
        };
        if let Some(t) = alias {
            let message = format!("parameter type \"{name}\" is read as \"{}\"", t.name());
            self.r.push(Diagnostic::new(irradiant_scene::Severity::Note, "N0114", message, span));
            return Some(t);
        }
        if let Some(help) = legacy::parameter_type(name) {
            self.r.v3("E0603", format!("parameter type \"{name}\" is pbrt-v3's"), span, help);
            return None;
        }
        let names: Vec<&str> = Type::NAMES.iter().map(|(n, _)| *n).collect();
        self.r.unknown("E0009", "parameter type", &Spanned::new(name.into(), span), &names);
        None
    }

    /// The values after a declaration, and where they end; `None` when they are of the wrong kind (reported, skipped).
    fn values(&mut self, kind: Type, known: bool, declaration: &str) -> Parsing<Option<(Values, usize)>> {
        let first = self.lexer().next();
        match first.kind {
            Kind::Open if !known => {
                self.skip_list()?;
                Ok(None)
            }
            Kind::Open => self.bracketed(kind, first),
            Kind::Word | Kind::Text if !known => Ok(None),
            Kind::Word | Kind::Text => {
                let mut values = Self::empty(kind, first, self.lexer());
                let good = self.value(kind, first, &mut values)?;
                Ok(good.then_some((values, first.end)))
            }
            _ => self.expected("E0007", first, &format!("a value for \"{declaration}\"")),
        }
    }

    fn empty(kind: Type, first: Token, _: &Lexer) -> Values {
        match kind {
            Type::Integer => Values::Integers(vec![]),
            Type::Bool => Values::Bools(vec![]),
            Type::String | Type::Texture => Values::Strings(vec![]),
            Type::Spectrum if first.kind == Kind::Text => Values::Strings(vec![]),
            _ => Values::Floats(vec![]),
        }
    }

    fn bracketed(&mut self, kind: Type, open: Token) -> Parsing<Option<(Values, usize)>> {
        let first = self.lexer().peek();
        let mut values = Self::empty(kind, first, self.lexer());
        let mut good = true;
        loop {
            let end = match &mut values {
                Values::Floats(v) => self.lexer().floats(v),
                Values::Integers(v) => self.lexer().integers(v),
                _ => {
                    let token = self.lexer().next();
                    match token.kind {
                        Kind::Close => ListEnd::Closed,
                        Kind::End => ListEnd::End,
                        _ => ListEnd::Bad(token),
                    }
                }
            };
            match end {
                ListEnd::Closed => {
                    let place = self.lexer().here();
                    return Ok(good.then_some((values, place)));
                }
                ListEnd::End => {
                    let span = self.span(open);
                    self.r.error_help("E0007", "this list has no end", span, "close it with ]");
                    return Err(Abandoned);
                }
                ListEnd::Bad(token) if token.kind == Kind::Open => {
                    return self.expected("E0007", token, "a value or ]");
                }
                ListEnd::Bad(token) => good &= self.value(kind, token, &mut values)?,
            }
            if !good {
                self.skip_list()?;
                return Ok(None);
            }
        }
    }

    /// Skips to the end of a list.
    fn skip_list(&mut self) -> Parsing<()> {
        loop {
            let token = self.lexer().peek();
            match token.kind {
                Kind::Close => {
                    self.lexer().next();
                    return Ok(());
                }
                Kind::End | Kind::Open | Kind::Unterminated => {
                    return self.expected("E0007", token, "]");
                }
                _ => drop(self.lexer().next()),
            }
        }
    }

    /// Adds one value; false when it is of the wrong kind, which is reported.
    fn value(&mut self, kind: Type, token: Token, values: &mut Values) -> Parsing<bool> {
        let quoted = token.kind == Kind::Text;
        let bytes = self.lexer().bytes(token).to_vec();
        let wanted = match values {
            Values::Floats(v) => match parse_f32(&bytes) {
                Some(x) if !quoted => {
                    v.push(x);
                    return Ok(true);
                }
                _ => "a number",
            },
            Values::Integers(v) => match parse_i32(&bytes) {
                Some(x) if !quoted => {
                    v.push(x);
                    return Ok(true);
                }
                _ => "a whole number (32 bits)",
            },
            Values::Bools(v) => match &bytes[..] {
                b"true" | b"false" => {
                    v.push(bytes == b"true");
                    return Ok(true);
                }
                b"\"true\"" | b"\"false\"" => {
                    let span = self.span(token);
                    let message = "truth values are written without quotes in pbrt-v4";
                    self.r.push(Diagnostic::new(irradiant_scene::Severity::Note, "N0115", message, span));
                    v.push(bytes == b"\"true\"");
                    return Ok(true);
                }
                _ => "true or false",
            },
            Values::Strings(v) => {
                if quoted {
                    v.push(self.dequote(token)?);
                    return Ok(true);
                }
                if kind == Type::Spectrum { "a string, like the one before" } else { "a string in quotes" }
            }
        };
        let code = match (token.kind, kind) {
            (Kind::Word, Type::Integer) if parse_f64(&bytes).is_some() => "E0012",
            (Kind::Word, _) if is_not_finite(&bytes) => "E0011",
            _ => "E0010",
        };
        // Reported; the rest of the list is skipped by the caller.
        let _ = self.expected::<()>(code, token, wanted);
        Ok(false)
    }

    // Directives.

    fn only_in(&mut self, block: Block, span: Span, word: &str) -> Parsing<()> {
        if self.block == block {
            return Ok(());
        }
        let (message, help) = match block {
            Block::Options => (format!("{word} cannot stand after WorldBegin"), "move it above WorldBegin"),
            Block::World => (format!("{word} cannot stand before WorldBegin"), "write WorldBegin above it"),
        };
        self.r.error_help("E0101", message, span, help);
        Ok(())
    }

    /// `Word "name" parameters`: the name, and the parameters with their subject.
    fn named(&mut self, span: Span, what: &str, attributes: &Attributes) -> Parsing<(Spanned<String>, Params)> {
        let name = self.string(&format!("the type of {what} in quotes"))?;
        let subject = format!("{what} \"{}\"", name.value);
        let own = self.parameters()?;
        let params = Params::new(own, attributes.clone(), self.state.color_space, subject, span.to(name.span));
        Ok((name, params))
    }

    fn directive(&mut self, token: Token) -> Parsing<()> {
        let span = self.span(token);
        if token.kind != Kind::Word {
            return self.expected("E0006", token, "a directive");
        }
        let word = self.lexer().bytes(token).to_vec();
        let r = self.r;
        let none = Attributes::default();
        match &word[..] {
            b"Shape" => {
                self.only_in(Block::World, span, "Shape")?;
                let (name, params) = self.named(span, "shape", &self.state.shape_attributes.clone())?;
                self.shape(&name, &params);
            }
            b"AttributeBegin" => {
                self.only_in(Block::World, span, "AttributeBegin")?;
                self.push(Opened::Attribute, span)?;
            }
            b"AttributeEnd" => {
                self.only_in(Block::World, span, "AttributeEnd")?;
                self.pop(Opened::Attribute, span);
            }
            b"TransformBegin" | b"TransformEnd" => {
                if !self.told_transform_begin {
                    self.told_transform_begin = true;
                    let help = "use AttributeBegin and AttributeEnd, which save the transform too";
                    let message = "TransformBegin and TransformEnd are read as AttributeBegin and AttributeEnd";
                    r.push(Diagnostic::warning("W0113", message, span).help(help));
                }
                if word == b"TransformBegin" {
                    self.push(Opened::Attribute, span)?;
                } else {
                    self.pop(Opened::Attribute, span);
                }
            }
            b"Attribute" => self.attribute()?,
            b"ObjectBegin" => self.object_begin(span)?,
            b"ObjectEnd" => self.object_end(span),
            b"ObjectInstance" => self.object_instance(span)?,
            b"Identity" => self.set_transform(span, |_| Some(Transform::IDENTITY)),
            b"Translate" => {
                let [x, y, z] = self.numbers()?;
                self.apply(span, Some(Transform::translate(x, y, z)), "");
            }
            b"Scale" => {
                let [x, y, z] = self.numbers()?;
                self.apply(span, Transform::scale(x, y, z), "a scale of 0 flattens space");
            }
            b"Rotate" => {
                let [degrees, x, y, z] = self.numbers()?;
                self.apply(span, Transform::rotate(degrees, [x, y, z]), "the axis of a rotation cannot be 0 0 0");
            }
            b"LookAt" => {
                let [ex, ey, ez, lx, ly, lz, ux, uy, uz] = self.numbers()?;
                let t = Transform::look_at([ex, ey, ez], [lx, ly, lz], [ux, uy, uz]);
                self.apply(span, t, "eye and target must differ, and \"up\" must not point along the view");
            }
            b"ConcatTransform" => {
                let m = self.matrix()?;
                self.apply(span, Transform::from_matrix(rows(&m)), "the matrix has no inverse");
            }
            b"Transform" => {
                let m = self.matrix()?;
                match Transform::from_matrix(rows(&m)) {
                    Some(t) => self.set_transform(span, |_| Some(t)),
                    None => self.singular(span, "the matrix has no inverse"),
                }
            }
            b"CoordinateSystem" => {
                let name = self.string("a name in quotes")?;
                self.coordinate_systems.insert(name.value, self.state.transforms);
            }
            b"CoordSysTransform" => {
                let name = self.string("a name in quotes")?;
                match self.coordinate_systems.get(&name.value) {
                    Some(t) => self.state.transforms = *t,
                    None => {
                        let known = self.coordinate_systems.keys().map(String::as_str);
                        let near = did_you_mean(&name, known).map(|n| format!("did you mean \"{n}\"?"));
                        let message = format!("no coordinate system \"{}\"; the transform stays as it is", name.value);
                        let mut d = Diagnostic::warning("W0111", message, name.span);
                        d.help = near;
                        r.push(d);
                    }
                }
            }
            b"ActiveTransform" => {
                let which = self.lexer().next();
                let bytes = self.lexer().bytes(which).to_vec();
                self.state.active = match &bytes[..] {
                    b"All" => [true, true],
                    b"StartTime" => [true, false],
                    b"EndTime" => [false, true],
                    _ => return self.expected("E0006", which, "All, StartTime or EndTime"),
                };
            }
            b"TransformTimes" => {
                self.only_in(Block::Options, span, "TransformTimes")?;
                let times: [f64; 2] = self.numbers()?;
                if times[1] < times[0] {
                    r.error("E0309", "the end time is before the start time", span);
                } else {
                    self.state.times = times;
                }
            }
            b"ReverseOrientation" => {
                self.only_in(Block::World, span, "ReverseOrientation")?;
                self.state.reverse_orientation ^= true;
            }
            b"ColorSpace" => {
                let name = self.string("the name of a colour space in quotes")?;
                match ColorSpaceName::ALL.iter().find(|s| s.name() == name.value) {
                    Some(space) => self.state.color_space = *space,
                    None => r.unknown("E0111", "colour space", &name, &ColorSpaceName::ALL.map(ColorSpaceName::name)),
                }
            }
            b"Material" => {
                self.only_in(Block::World, span, "Material")?;
                let (kind, params) = self.named(span, "material", &self.state.material_attributes.clone())?;
                self.state.material = MaterialUse::Index(self.materials.len() as u32);
                self.materials.push(PendingMaterial { name: None, kind, params });
            }
            b"MakeNamedMaterial" => {
                self.only_in(Block::World, span, "MakeNamedMaterial")?;
                self.make_named_material(span)?;
            }
            b"NamedMaterial" => {
                self.only_in(Block::World, span, "NamedMaterial")?;
                let name = self.string("the name of a material in quotes")?;
                self.state.material = MaterialUse::Named(Rc::new(name));
            }
            b"Texture" => {
                self.only_in(Block::World, span, "Texture")?;
                self.texture(span)?;
            }
            b"LightSource" => {
                self.only_in(Block::World, span, "LightSource")?;
                let (name, params) = self.named(span, "light", &self.state.light_attributes.clone())?;
                self.light(&name, &params);
            }
            b"AreaLightSource" => {
                self.only_in(Block::World, span, "AreaLightSource")?;
                let (name, params) = self.named(span, "area light", &self.state.light_attributes.clone())?;
                self.state.area_light = lights::area_light(r, &name, &params);
            }
            b"MakeNamedMedium" => {
                let attributes = self.state.medium_attributes.clone();
                let (name, params) = self.named(span, "medium", &attributes)?;
                if let Some(place) = self.media.insert(name.value.clone(), name.span) {
                    self.redefined("medium", &name, place);
                }
                media::check(r, &params);
            }
            b"MediumInterface" => self.medium_interface()?,
            b"Camera" => {
                self.only_in(Block::Options, span, "Camera")?;
                let (name, params) = self.named(span, "camera", &none)?;
                let motion = self.state.motion();
                let inverse = self.state.transforms.map(|t| t.inverse());
                self.coordinate_systems.insert("camera".into(), inverse);
                self.camera_medium = self.state.media.outside.clone();
                self.desc.camera = camera::camera(r, &name, &params, motion);
            }
            b"Film" => {
                self.only_in(Block::Options, span, "Film")?;
                let (name, params) = self.named(span, "film", &none)?;
                self.desc.film = film::film(r, &name, &params);
            }
            b"PixelFilter" => {
                self.only_in(Block::Options, span, "PixelFilter")?;
                let (name, params) = self.named(span, "filter", &none)?;
                self.desc.filter = film::filter(r, &name, &params);
            }
            b"Sampler" => {
                self.only_in(Block::Options, span, "Sampler")?;
                let (name, params) = self.named(span, "sampler", &none)?;
                self.desc.sampler = settings::sampler(r, &name, &params);
            }
            b"Integrator" => {
                self.only_in(Block::Options, span, "Integrator")?;
                let (name, params) = self.named(span, "integrator", &none)?;
                (self.desc.integrator, self.integrator) = settings::integrator(r, &name, &params);
            }
            b"Accelerator" => {
                self.only_in(Block::Options, span, "Accelerator")?;
                let (name, params) = self.named(span, "accelerator", &none)?;
                settings::accelerator(r, &name, &params);
            }
            b"Option" => self.option()?,
            b"WorldBegin" => {
                if self.block == Block::World {
                    r.push(
                        Diagnostic::error("E0113", "a second WorldBegin", span)
                            .also(self.world_begin, "the world began here")
                            .help("leave it out"),
                    );
                }
                self.world_begin = span;
                self.block = Block::World;
                self.state.transforms = [Transform::IDENTITY; 2];
                self.state.active = [true; 2];
                self.coordinate_systems.insert("world".into(), self.state.transforms);
            }
            b"Include" => {
                let name = self.string("a file name in quotes")?;
                self.include(&name, false);
            }
            b"Import" => {
                self.only_in(Block::World, span, "Import")?;
                let name = self.string("a file name in quotes")?;
                self.include(&name, true);
            }
            _ => return self.unknown_directive(&word, token),
        }
        Ok(())
    }

    fn unknown_directive(&mut self, word: &[u8], token: Token) -> Parsing<()> {
        let span = self.span(token);
        if let Some(help) = legacy::directive(word) {
            legacy::unknown_directive(self.r, help, span);
            return Err(Abandoned);
        }
        if parse_f64(word).is_some() {
            return self.expected("E0006", token, "a directive");
        }
        let text: String = String::from_utf8_lossy(word).chars().take(40).collect();
        let help = match did_you_mean(&text, DIRECTIVES.iter().copied()) {
            Some(near) => format!("did you mean {near}?"),
            None => "directives begin with a capital letter, like Shape or Material".into(),
        };
        self.r.error_help("E0006", format!("unknown directive {text}"), span, help);
        Err(Abandoned)
    }

    // Transforms.

    fn set_transform(&mut self, span: Span, f: impl Fn(&Transform) -> Option<Transform>) {
        for i in 0..2 {
            if self.state.active[i] {
                match f(&self.state.transforms[i]) {
                    Some(t) if t.m.iter().chain(&t.inv).flatten().all(|v| v.is_finite()) => {
                        self.state.transforms[i] = t;
                    }
                    _ => return self.singular(span, "numbers beyond what can be computed with"),
                }
            }
        }
    }

    fn apply(&mut self, span: Span, t: Option<Transform>, why: &str) {
        match t {
            Some(t) => self.set_transform(span, |current| Some(current.compose(&t))),
            None => self.singular(span, why),
        }
    }

    fn singular(&self, span: Span, why: &str) {
        self.r.error_help("E0107", "this transform cannot be undone", span, why);
    }

    // Nesting.

    fn push(&mut self, opened: Opened, span: Span) -> Parsing<()> {
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

    fn pop(&mut self, opened: Opened, span: Span) {
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

    fn object_begin(&mut self, span: Span) -> Parsing<()> {
        self.only_in(Block::World, span, "ObjectBegin")?;
        let name = self.string("the name of an object in quotes")?;
        self.push(Opened::Object, span)?;
        if self.active_object.is_some() {
            self.r.error("E0105", "ObjectBegin inside of an object", span);
            return Ok(());
        }
        if let Some(known) = self.objects.iter().find(|o| o.name == name.value) {
            self.redefined("object", &name, known.span);
        }
        self.active_object = Some(self.objects.len());
        self.objects.push(PendingObject { name: name.value, shapes: vec![], span: name.span });
        Ok(())
    }

    fn object_end(&mut self, span: Span) {
        self.pop(Opened::Object, span);
        self.active_object = None;
    }

    fn object_instance(&mut self, span: Span) -> Parsing<()> {
        self.only_in(Block::World, span, "ObjectInstance")?;
        let name = self.string("the name of an object in quotes")?;
        if self.active_object.is_some() {
            self.r.error("E0105", "ObjectInstance inside of an object", span);
        } else {
            self.instances.push(PendingInstance { name, world_from_object: self.state.motion() });
        }
        Ok(())
    }

    fn redefined(&self, what: &str, name: &Spanned<String>, first: Span) {
        self.r.push(
            Diagnostic::error("E0106", format!("{what} \"{}\" is defined twice", name.value), name.span)
                .also(first, "first defined here"),
        );
    }

    fn attribute(&mut self) -> Parsing<()> {
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

    fn make_named_material(&mut self, span: Span) -> Parsing<()> {
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

    fn texture(&mut self, span: Span) -> Parsing<()> {
        let name = self.string("the name of a texture in quotes")?;
        let class = self.string("\"float\" or \"spectrum\"")?;
        let (kind, params) = self.named(span, "texture", &self.state.texture_attributes.clone())?;
        let is_float = match class.value.as_str() {
            "float" => true,
            "spectrum" => false,
            _ => {
                legacy::texture_class(self.r, &class);
                return Ok(());
            }
        };
        if let Some(first) = self.textures.iter().find(|t| t.is_float == is_float && t.name.value == name.value) {
            self.redefined("texture", &name, first.name.span);
            return Ok(());
        }
        if self.state.is_animated() {
            self.r.warning("W0108", "a texture cannot move; it stays where it is at the start", params.span);
        }
        let world_from_texture = self.state.transforms[0];
        self.textures.push(PendingTexture { name, is_float, kind, params, world_from_texture });
        Ok(())
    }

    fn light(&mut self, name: &Spanned<String>, params: &Params) {
        if self.state.is_animated() {
            self.r.warning("W0108", "a light cannot move; it stays where it is at the start", params.span);
        }
        self.light_media.extend(self.state.media.outside.clone());
        let light: Option<LightDesc> = lights::light(self.r, name, params, self.state.transforms[0]);
        self.desc.lights.extend(light);
    }

    fn medium_interface(&mut self) -> Parsing<()> {
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

    fn shape(&mut self, name: &Spanned<String>, params: &Params) {
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

    fn option(&mut self) -> Parsing<()> {
        let name = self.string("the name of an option in quotes")?;
        let mut token = self.lexer().next();
        let bracket = token.kind == Kind::Open;
        if bracket {
            token = self.lexer().next();
        }
        if !matches!(token.kind, Kind::Word | Kind::Text) {
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
            self.skip_list()?;
        }
        settings::option(self.r, &mut self.desc.options, &name, &value);
        Ok(())
    }

    fn include(&mut self, name: &Spanned<String>, import: bool) {
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
                    self.r.error("E0502", "scene texts are limited to 4 GiB", name.span);
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

fn is_not_finite(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).ok().and_then(|t| t.parse::<f32>().ok()).is_some_and(|v| !v.is_finite())
}

/// pbrt writes the columns one after another.
fn rows(m: &[f64; 16]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[4 * j + i]))
}

/// Objects without their pending parts.
pub(crate) fn empty_object(object: &PendingObject) -> ObjectDesc {
    ObjectDesc { name: object.name.clone(), shapes: vec![], span: object.span }
}
