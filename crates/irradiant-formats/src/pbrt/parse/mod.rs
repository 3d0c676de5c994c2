//! The directives, in the order they stand: `values` reads what follows them, `world` does what they say.

mod values;
mod world;

use super::legacy;
use super::lex::{Kind, Lexer, Token, parse_f64};
use super::other_files::not_a_scene;
use super::params::Params;
use super::reader::Reader;
use super::state::*;
use super::{camera, film, lights, media, settings};
use irradiant_math::Transform;
use irradiant_scene::desc::{ColorSpaceName, ObjectDesc, SceneDesc};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{Diagnostic, Span, Spanned};
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
    "TransformBegin",
    "TransformEnd",
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
    /// A parameter of the list read last has been reported and left out.
    refused_parameter: bool,
    /// What belongs into the world and stands before it so far: the first, its directive, and how many there are.
    before_world: Option<(Span, &'static str, usize)>,
    pub desc: SceneDesc,
    pub textures: Vec<PendingTexture>,
    /// Where each (class, name) was defined.
    texture_places: BTreeMap<(bool, String), Span>,
    pub materials: Vec<PendingMaterial>,
    pub named_materials: BTreeMap<String, u32>,
    pub media: BTreeMap<String, Span>,
    pub camera_medium: Option<Rc<Spanned<String>>>,
    pub light_media: Vec<Rc<Spanned<String>>>,
    pub shapes: Vec<PendingShape>,
    pub objects: Vec<PendingObject>,
    /// Where each was defined.
    object_places: BTreeMap<String, Span>,
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
            refused_parameter: false,
            before_world: None,
            desc: SceneDesc::default(),
            textures: vec![],
            texture_places: BTreeMap::new(),
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
            object_places: BTreeMap::new(),
            instances: vec![],
            integrator: settings::IntegratorRequest::default(),
        }
    }

    /// Reads the main text and all that it includes.
    pub fn run(&mut self, name: &str, text: Arc<[u8]>) {
        let file = self.r.add_source(name, text.clone());
        if text.len() > u32::MAX as usize {
            self.r.error("E1002", "scene texts are limited to 4 GiB", Span { file, start: 0, end: 0 });
            return;
        }
        if let Some(looks_like) = not_a_scene(&text) {
            let span = Span { file, start: 0, end: 0 };
            let help = "scenes are text in the language of pbrt-v4, gzipped or not";
            return self.r.error_help("E1010", format!("this is no pbrt scene but {looks_like}"), span, help);
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
            match self.before_world {
                Some((span, ..)) => {
                    let help = "write WorldBegin above this line";
                    self.r.error_help("E0104", "the world has no WorldBegin; it seems to begin here", span, help);
                }
                None => {
                    let span = Span { file, start: end, end };
                    let help = "write WorldBegin between the camera and the shapes";
                    self.r.error_help("E0104", "the scene ends before WorldBegin", span, help);
                }
            }
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

    // Directives.

    fn only_in(&mut self, block: Block, span: Span, word: &'static str) {
        match (block, self.block) {
            (Block::Options, Block::World) => {
                let message = format!("{word} cannot stand after WorldBegin");
                self.r.error_help("E0101", message, span, "move it above WorldBegin");
            }
            // Said when it is known whether there is a WorldBegin at all.
            (Block::World, Block::Options) => self.before_world.get_or_insert((span, word, 0)).2 += 1,
            (Block::Options, Block::Options) | (Block::World, Block::World) => {}
        }
    }

    fn world_begins(&mut self, span: Span) {
        if self.block == Block::World {
            let second = Diagnostic::error("E0113", "a second WorldBegin", span).help("leave it out");
            self.r.push(second.also(self.world_begin, "the world began here"));
        } else if let Some((place, word, count)) = self.before_world {
            let more = if count > 1 { format!(", nor can {} more below it", count - 1) } else { String::new() };
            let early = Diagnostic::error("E0101", format!("{word} cannot stand before WorldBegin{more}"), place);
            self.r.push(early.help("move WorldBegin above it").also(span, "the world begins here"));
        }
        self.world_begin = span;
        self.block = Block::World;
        self.state.transforms = [Transform::IDENTITY; 2];
        self.state.active = [true; 2];
        self.coordinate_systems.insert("world".into(), self.state.transforms);
    }

    /// `Word "name" parameters`: the name, and the parameters with their subject.
    fn named(&mut self, span: Span, what: &str, attributes: &Attributes) -> Parsing<(Spanned<String>, Params)> {
        let name = self.string(&format!("the type of {what} in quotes"))?;
        let subject = format!("{what} \"{}\"", name.value);
        let own = self.parameters().inspect_err(|_| self.r.defined_wrongly(&name))?;
        let mut params = Params::new(own, attributes.clone(), self.state.color_space, subject, span.to(name.span));
        params.incomplete = self.refused_parameter;
        Ok((name, params))
    }

    fn directive(&mut self, token: Token) -> Parsing<()> {
        if token.kind != Kind::Word {
            return self.expected("E0006", token, "a directive");
        }
        let word = self.lexer().bytes(token).to_vec();
        self.statement(&word, token)
    }

    /// Reads what belongs to a directive, and does what it says.
    fn statement(&mut self, word: &[u8], token: Token) -> Parsing<()> {
        let span = self.span(token);
        let r = self.r;
        let none = Attributes::default();
        match word {
            b"Shape" => {
                self.only_in(Block::World, span, "Shape");
                let (name, params) = self.named(span, "shape", &self.state.shape_attributes.clone())?;
                self.shape(&name, &params);
            }
            b"AttributeBegin" => {
                self.only_in(Block::World, span, "AttributeBegin");
                self.push(Opened::Attribute, span)?;
            }
            b"AttributeEnd" => {
                self.only_in(Block::World, span, "AttributeEnd");
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
                self.only_in(Block::Options, span, "TransformTimes");
                let times: [f64; 2] = self.numbers()?;
                if times[1] < times[0] {
                    r.error("E0309", "the end time is before the start time", span);
                } else {
                    self.state.times = times;
                }
            }
            b"ReverseOrientation" => {
                self.only_in(Block::World, span, "ReverseOrientation");
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
                self.only_in(Block::World, span, "Material");
                let (kind, params) = self.named(span, "material", &self.state.material_attributes.clone())?;
                self.state.material = MaterialUse::Index(self.materials.len() as u32);
                self.materials.push(PendingMaterial { name: None, kind, params });
            }
            b"MakeNamedMaterial" => {
                self.only_in(Block::World, span, "MakeNamedMaterial");
                self.make_named_material(span)?;
            }
            b"NamedMaterial" => {
                self.only_in(Block::World, span, "NamedMaterial");
                let name = self.string("the name of a material in quotes")?;
                self.state.material = MaterialUse::Named(Rc::new(name));
            }
            b"Texture" => {
                self.only_in(Block::World, span, "Texture");
                self.texture(span)?;
            }
            b"LightSource" => {
                self.only_in(Block::World, span, "LightSource");
                let (name, params) = self.named(span, "light", &self.state.light_attributes.clone())?;
                self.light(&name, &params);
            }
            b"AreaLightSource" => {
                self.only_in(Block::World, span, "AreaLightSource");
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
                self.only_in(Block::Options, span, "Camera");
                let (name, params) = self.named(span, "camera", &none)?;
                let motion = self.state.motion();
                let inverse = self.state.transforms.map(|t| t.inverse());
                self.coordinate_systems.insert("camera".into(), inverse);
                self.camera_medium = self.state.media.outside.clone();
                self.desc.camera = camera::camera(r, &name, &params, motion);
            }
            b"Film" => {
                self.only_in(Block::Options, span, "Film");
                let (name, params) = self.named(span, "film", &none)?;
                self.desc.film = film::film(r, &name, &params);
            }
            b"PixelFilter" => {
                self.only_in(Block::Options, span, "PixelFilter");
                let (name, params) = self.named(span, "filter", &none)?;
                self.desc.filter = film::filter(r, &name, &params);
            }
            b"Sampler" => {
                self.only_in(Block::Options, span, "Sampler");
                let (name, params) = self.named(span, "sampler", &none)?;
                self.desc.sampler = settings::sampler(r, &name, &params);
            }
            b"Integrator" => {
                self.only_in(Block::Options, span, "Integrator");
                let (name, params) = self.named(span, "integrator", &none)?;
                (self.desc.integrator, self.integrator) = settings::integrator(r, &name, &params);
            }
            b"Accelerator" => {
                self.only_in(Block::Options, span, "Accelerator");
                let (name, params) = self.named(span, "accelerator", &none)?;
                settings::accelerator(r, &name, &params);
            }
            b"Option" => self.option()?,
            b"WorldBegin" => self.world_begins(span),
            b"Include" => {
                let name = self.string("a file name in quotes")?;
                self.include(&name, false);
            }
            b"Import" => {
                self.only_in(Block::World, span, "Import");
                let name = self.string("a file name in quotes")?;
                self.include(&name, true);
            }
            _ => return self.unknown_directive(word, token),
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
        let message = format!("unknown directive {text}");
        let Some(near) = meant_directive(&text) else {
            let help = "directives begin with a capital letter, like Shape or Material";
            self.r.error_help("E0006", message, span, help);
            return Err(Abandoned);
        };
        // Read on as if it said so: what it opens will be closed, what it names will be used, and it may hold other mistakes.
        self.r.error_help("E0006", message, span, format!("did you mean {near}?"));
        self.statement(near.as_bytes(), token)
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
}

/// The directive that a word stands for: the nearest, or the only one that begins so.
fn meant_directive(word: &str) -> Option<&'static str> {
    did_you_mean(word, DIRECTIVES.iter().copied()).or_else(|| {
        let mut longer = DIRECTIVES.iter().filter(|d| word.len() >= 4 && d.starts_with(word));
        longer.next().filter(|_| longer.next().is_none()).copied()
    })
}

/// pbrt writes the columns one after another.
fn rows(m: &[f64; 16]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[4 * j + i]))
}

/// Objects without their pending parts.
pub(crate) fn empty_object(object: &PendingObject) -> ObjectDesc {
    ObjectDesc { name: object.name.clone(), shapes: vec![], span: object.span }
}
