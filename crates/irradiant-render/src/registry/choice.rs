//! An integrator that was asked for, with its options: from a user's words, or from what the scene says.

use super::{IntegratorEntry, OptionEntry, OptionRange, entry, names, words};
use crate::integrator::Integrator;
use irradiant_scene::desc::{IntegratorDesc, IntegratorKind, LightSamplerKind};
use irradiant_scene::diagnostic::did_you_mean;

/// The value of an option.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Count(u32),
    /// A number.
    Number(f32),
    /// One of the option's words.
    Word(&'static str),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flag(b) => write!(f, "{b}"),
            Self::Count(n) => write!(f, "{n}"),
            Self::Number(x) => write!(f, "{x}"),
            Self::Word(w) => write!(f, "{w}"),
        }
    }
}

words! {
    /// How one light is picked.
    pub enum PickLights {
        /// As the scene says (its `lightsampler`, else by the tree).
        Scene = "scene",
        /// All alike, p_i = 1/N.
        Uniform = "uniform",
        /// By emitted power.
        Power = "power",
        /// By a tree of bounds that knows distance and direction.
        Bvh = "bvh",
        /// By the tree's estimate for each light in turn.
        Exhaustive = "exhaustive",
    }
}

/// Values of all options of an entry, in the entry's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    names: &'static str,
    values: Vec<(&'static str, Value)>,
}

impl Options {
    /// The value of an option. Panics on a key that the entry does not list: a bug in its `make`, which a test of the registry meets.
    pub fn get(&self, key: &str) -> Value {
        match self.values.iter().find(|(k, _)| *k == key) {
            Some((_, value)) => *value,
            None => unreachable!("integrator {} lists no option {key}", self.names),
        }
    }

    /// Yes or no.
    pub fn flag(&self, key: &str) -> bool {
        matches!(self.get(key), Value::Flag(true))
    }

    /// A whole number.
    pub fn count(&self, key: &str) -> u32 {
        if let Value::Count(n) = self.get(key) { n } else { 0 }
    }

    /// A number.
    pub fn number(&self, key: &str) -> f32 {
        if let Value::Number(x) = self.get(key) { x } else { 0.0 }
    }

    /// A word.
    pub fn word(&self, key: &str) -> &'static str {
        if let Value::Word(w) = self.get(key) { w } else { "" }
    }

    /// All, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, Value)> + '_ {
        self.values.iter().copied()
    }
}

/// An integrator of [`super::INTEGRATORS`] with a value for each of its options. Prints as the picture's header has it:
/// `simplepath samplelights=true samplebsdf=true lightsampler=scene`.
///
/// ```
/// use irradiant_render::registry::IntegratorChoice;
///
/// let choice = IntegratorChoice::named("simplepath")?.with("samplebsdf", "false")?;
/// assert!(choice.to_string().contains("samplebsdf=false"));
/// let why = choice.with("samplebdsf", "true").unwrap_err().to_string();
/// assert!(why.contains("did you mean \"samplebsdf\"?"));
/// # Ok::<(), irradiant_render::registry::ChoiceError>(())
/// ```
#[derive(Clone, Debug)]
pub struct IntegratorChoice {
    entry: &'static IntegratorEntry,
    options: Options,
}

impl PartialEq for IntegratorChoice {
    fn eq(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl IntegratorChoice {
    fn of(entry: &'static IntegratorEntry) -> Self {
        let values = entry.options.iter().map(|o| (o.name, o.default)).collect();
        Self { entry, options: Options { names: entry.name, values } }
    }

    /// The integrator of that name with all options at their defaults. (`ao` is short for `ambientocclusion`.)
    pub fn named(name: &str) -> Result<Self, ChoiceError> {
        let name = if name == "ao" { "ambientocclusion" } else { name };
        entry(name).map(Self::of).ok_or_else(|| ChoiceError::UnknownIntegrator { name: name.into() })
    }

    /// With an option set from a user's words.
    pub fn with(mut self, key: &str, value: &str) -> Result<Self, ChoiceError> {
        let entry = self.entry;
        let Some(option) = entry.options.iter().find(|o| o.name == key) else {
            return Err(ChoiceError::UnknownOption { entry, key: key.into() });
        };
        let value = read(option, value).ok_or_else(|| ChoiceError::BadValue { entry, option, value: value.into() })?;
        self.set(option.name, value);
        Ok(self)
    }

    /// With an option set from `key=value`.
    pub fn with_words(self, words: &str) -> Result<Self, ChoiceError> {
        let Some((key, value)) = words.split_once('=') else {
            return Err(ChoiceError::NotAPair { entry: self.entry, words: words.into() });
        };
        self.with(key.trim(), value.trim())
    }

    fn set(&mut self, key: &'static str, value: Value) {
        if let Some((_, v)) = self.options.values.iter_mut().find(|(k, _)| *k == key) {
            *v = value;
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.entry.name
    }

    /// What it is.
    pub fn entry(&self) -> &'static IntegratorEntry {
        self.entry
    }

    /// What is set.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The integrator, with at most so many scattering events (`None`: no limit).
    pub fn integrator(&self, max_depth: Option<u32>) -> Box<dyn Integrator> {
        (self.entry.make)(&self.options, max_depth)
    }

    /// How lights are to be picked, if the choice says so; the scene is compiled for it.
    pub fn light_sampler(&self) -> Option<LightSamplerKind> {
        self.entry.options.iter().find(|o| o.name == super::LIGHT_SAMPLER.name)?;
        match PickLights::of(self.options.word(super::LIGHT_SAMPLER.name)) {
            PickLights::Scene => None,
            PickLights::Uniform => Some(LightSamplerKind::Uniform),
            PickLights::Power => Some(LightSamplerKind::Power),
            PickLights::Bvh => Some(LightSamplerKind::Bvh),
            PickLights::Exhaustive => Some(LightSamplerKind::Exhaustive),
        }
    }
}

impl std::fmt::Display for IntegratorChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.entry.name)?;
        self.options.iter().try_for_each(|(key, value)| write!(f, " {key}={value}"))
    }
}

impl From<IntegratorKind> for IntegratorChoice {
    /// What a scene file can name.
    fn from(kind: IntegratorKind) -> Self {
        match kind {
            IntegratorKind::Path => Self::of(&crate::path::ENTRY),
            IntegratorKind::SimplePath { sample_lights, sample_bsdf } => {
                let mut choice = Self::of(&crate::simple_path::ENTRY);
                choice.set("samplelights", Value::Flag(sample_lights));
                choice.set("samplebsdf", Value::Flag(sample_bsdf));
                choice
            }
            IntegratorKind::Bidirectional => Self::of(&crate::bidirectional::ENTRY),
            IntegratorKind::LightTrace => Self::of(&crate::light_trace::ENTRY),
            IntegratorKind::Photon { paths_per_pass, radius } => {
                let mut choice = Self::of(&crate::photon::ENTRY);
                choice.set("paths", Value::Count(paths_per_pass));
                choice.set("radius", Value::Number(radius));
                choice
            }
            IntegratorKind::RandomWalk => Self::of(&crate::random_walk::ENTRY),
            IntegratorKind::AmbientOcclusion { cos_sample, max_distance } => {
                let mut choice = Self::of(&crate::ambient_occlusion::ENTRY);
                choice.set("cossample", Value::Flag(cos_sample));
                choice.set("maxdistance", Value::Number(max_distance));
                choice
            }
        }
    }
}

impl From<&IntegratorDesc> for IntegratorChoice {
    /// What a scene says.
    fn from(desc: &IntegratorDesc) -> Self {
        let mut choice = Self::from(desc.kind);
        // No other integrator has an option of that name.
        choice.set("regularize", Value::Flag(desc.regularize));
        choice
    }
}

/// A value in an option's range, from a user's word.
fn read(option: &OptionEntry, text: &str) -> Option<Value> {
    match option.range {
        OptionRange::Flag => text.parse().ok().map(Value::Flag),
        OptionRange::Count(least, most) => text.parse().ok().filter(|n| (least..=most).contains(n)).map(Value::Count),
        OptionRange::Number(least, most) => text.parse().ok().filter(|x| least <= *x && *x <= most).map(Value::Number),
        OptionRange::Word(words) => words.iter().find(|w| w.name == text).map(|w| Value::Word(w.name)),
    }
}

/// Why a user's words name no integrator. Says what there is, and what was perhaps meant.
#[derive(Clone, Debug)]
pub enum ChoiceError {
    /// No integrator has that name.
    UnknownIntegrator {
        /// As asked for.
        name: String,
    },
    /// The integrator has no such option.
    UnknownOption {
        /// The integrator.
        entry: &'static IntegratorEntry,
        /// As asked for.
        key: String,
    },
    /// The option cannot be that.
    BadValue {
        /// The integrator.
        entry: &'static IntegratorEntry,
        /// The option.
        option: &'static OptionEntry,
        /// As asked for.
        value: String,
    },
    /// Not of the form `key=value`.
    NotAPair {
        /// The integrator.
        entry: &'static IntegratorEntry,
        /// As asked for.
        words: String,
    },
}

impl std::fmt::Display for ChoiceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let list = |names: &[&str]| names.join(", ");
        match self {
            Self::UnknownIntegrator { name } => {
                let known: Vec<&str> = names().collect();
                write!(f, "there is no integrator \"{name}\"")?;
                suggest(f, name, &known)?;
                write!(f, "; known are {}", list(&known))
            }
            Self::UnknownOption { entry, key } => {
                let known: Vec<&str> = entry.options.iter().map(|o| o.name).collect();
                write!(f, "integrator {} has no option \"{key}\"", entry.name)?;
                suggest(f, key, &known)?;
                if known.is_empty() { write!(f, "; it has none") } else { write!(f, "; it has {}", list(&known)) }
            }
            Self::BadValue { entry, option, value } => {
                write!(f, "integrator {}: {} cannot be \"{value}\"", entry.name, option.name)?;
                if let OptionRange::Word(words) = option.range {
                    suggest(f, value, &words.iter().map(|w| w.name).collect::<Vec<_>>())?;
                }
                write!(f, "; it is {}", option.range)
            }
            Self::NotAPair { entry, words } => {
                let known: Vec<&str> = entry.options.iter().map(|o| o.name).collect();
                write!(f, "\"{words}\" is not KEY=VALUE; the keys of {} are: {}", entry.name, list(&known))
            }
        }
    }
}

fn suggest(f: &mut std::fmt::Formatter<'_>, word: &str, known: &[&str]) -> std::fmt::Result {
    match did_you_mean(word, known.iter().copied()) {
        Some(near) => write!(f, "; did you mean \"{near}\"?"),
        None => Ok(()),
    }
}

impl std::error::Error for ChoiceError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_words_are_told_what_there_is() {
        let why = |r: Result<IntegratorChoice, ChoiceError>| r.unwrap_err().to_string();
        let simple = || IntegratorChoice::named("simplepath").unwrap();
        let message = why(IntegratorChoice::named("pth"));
        assert!(message.contains("did you mean \"path\"?") && message.contains("randomwalk"), "{message}");
        let message = why(simple().with("samplelight", "true"));
        assert!(message.contains("did you mean \"samplelights\"?"), "{message}");
        assert!(why(simple().with("samplelights", "yes")).contains("true or false"));
        assert!(why(simple().with("lightsampler", "unifrom")).contains("did you mean \"uniform\"?"));
        assert!(why(simple().with_words("samplelights")).contains("KEY=VALUE"));
        let ao = || IntegratorChoice::named("ao").unwrap();
        for bad in ["-1", "nan", "", "far"] {
            assert!(why(ao().with("maxdistance", bad)).contains("a number from 0 to inf"), "{bad}");
        }
        assert_eq!(ao().with("maxdistance", "inf").unwrap(), ao());
    }

    #[test]
    fn what_the_scene_says_and_what_the_user_says_are_the_same_words() {
        let desc = IntegratorDesc { regularize: true, ..IntegratorDesc::default() };
        let said = IntegratorChoice::named("path").unwrap().with_words("regularize=true").unwrap();
        assert_eq!(IntegratorChoice::from(&desc), said);
        let kind = IntegratorKind::SimplePath { sample_lights: false, sample_bsdf: true };
        let said = IntegratorChoice::named("simplepath").unwrap().with("samplelights", "false").unwrap();
        assert_eq!(IntegratorChoice::from(kind), said);
        assert_ne!(IntegratorChoice::from(kind), IntegratorChoice::from(IntegratorKind::RandomWalk));
        assert_eq!(said.light_sampler(), None);
        assert_eq!(said.with_words("lightsampler = power").unwrap().light_sampler(), Some(LightSamplerKind::Power));
    }
}
