//! Integrators by name: what there is, where each comes from, and what can be set.
//!
//! Each integrator's file has an `ENTRY`; [`INTEGRATORS`] lists them. Nothing is registered at run time. A user's words
//! become an [`IntegratorChoice`] ([`choice`]), which is checked word by word, prints itself into the picture's header, and makes the
//! integrator. The program's `--integrator` and `--estimator`, its list of integrators and the guide's tables all read this list.
//!
//! To add one: write `pub const ENTRY: IntegratorEntry` beside the integrator and name it in [`INTEGRATORS`]. Every key that
//! `make` reads must be among its options (a test makes each entry once).

pub mod choice;

pub use choice::{ChoiceError, IntegratorChoice, Options, PickLights, Value};

use crate::integrator::Integrator;

/// What there is, in the order of lists: production first, then the lectures in the order of their slides.
pub const INTEGRATORS: &[IntegratorEntry] = &[
    crate::path::ENTRY,
    crate::shared_path::ENTRY,
    crate::bidirectional::ENTRY,
    crate::light_trace::ENTRY,
    crate::photon::ENTRY,
    crate::simple_path::ENTRY,
    crate::random_walk::ENTRY,
    crate::ambient_occlusion::ENTRY,
    crate::lectures::direct::ENTRY,
    crate::lectures::tries::TRY_1,
    crate::lectures::tries::TRY_2,
    crate::lectures::partitioned::ENTRY,
    crate::lectures::distribution::ENTRY,
    crate::lectures::per_length::ENTRY,
    crate::lectures::iterative::ENTRY,
    crate::self_intersection::ENTRY,
];

/// An integrator that can be asked for by name.
#[derive(Clone, Copy, Debug)]
pub struct IntegratorEntry {
    /// One word, lower case; scene files use the same where they know it.
    pub name: &'static str,
    /// What it estimates and how, one sentence.
    pub promise: &'static str,
    /// Where it comes from: a slide with its row of the ledger, a paper, or pbrt-v4.
    pub source: &'static str,
    /// What can be set.
    pub options: &'static [OptionEntry],
    /// The integrator, with at most so many scattering events (`None`: no limit). Cannot fail: every set of values that the options allow
    /// has a meaning.
    pub make: fn(&Options, Option<u32>) -> Box<dyn Integrator>,
}

/// Something that can be set.
#[derive(Clone, Copy, Debug)]
pub struct OptionEntry {
    /// One word, lower case.
    pub name: &'static str,
    /// What it can be.
    pub range: OptionRange,
    /// What it is unless set.
    pub default: Value,
    /// What it does, with its slide.
    pub doc: &'static str,
}

/// What an option can be.
#[derive(Clone, Copy, Debug)]
pub enum OptionRange {
    /// `true` or `false`.
    Flag,
    /// A whole number, both ends included.
    Count(u32, u32),
    /// A number, both ends included; `inf` is one if it is the upper end.
    Number(f32, f32),
    /// One of these.
    Word(&'static [Word]),
}

/// A word that an option can be.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// As it is written.
    pub name: &'static str,
    /// What it means.
    pub doc: &'static str,
}

impl std::fmt::Display for OptionRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flag => write!(f, "true or false"),
            Self::Count(least, most) => write!(f, "a whole number from {least} to {most}"),
            Self::Number(least, most) => write!(f, "a number from {least} to {most}"),
            Self::Word(words) => {
                let names: Vec<&str> = words.iter().map(|w| w.name).collect();
                write!(f, "{}", names.join(", "))
            }
        }
    }
}

/// An enum whose variants are words of an option: the documentation of the variants is that of the words.
macro_rules! words {
    ($(#[doc = $about:literal])* $vis:vis enum $name:ident { $($(#[doc = $doc:literal])+ $variant:ident = $word:literal,)+ }) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name { $($(#[doc = $doc])+ $variant,)+ }

        impl $name {
            /// The words for all.
            pub const WORDS: &'static [$crate::registry::Word] =
                &[$($crate::registry::Word { name: $word, doc: concat!($($doc),+) },)+];

            /// What an option says; the first for a word that is none (options are checked when they are set).
            pub fn of(word: &str) -> Self {
                const ALL: &[$name] = &[$($name::$variant,)+];
                Self::WORDS.iter().position(|w| w.name == word).map_or(ALL[0], |i| ALL[i])
            }

            /// As an option's value.
            pub const fn value(self) -> $crate::registry::Value {
                $crate::registry::Value::Word(match self { $(Self::$variant => $word,)+ })
            }
        }
    };
}
pub(crate) use words;

/// The option of integrators that pick lights.
pub const LIGHT_SAMPLER: OptionEntry = OptionEntry {
    name: "lightsampler",
    range: OptionRange::Word(PickLights::WORDS),
    default: PickLights::Scene.value(),
    doc: "how one light is picked, p_i (A59)",
};

/// The entry of a name, if there is one.
pub fn entry(name: &str) -> Option<&'static IntegratorEntry> {
    INTEGRATORS.iter().find(|e| e.name == name)
}

/// All names, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    INTEGRATORS.iter().map(|e| e.name)
}

impl IntegratorEntry {
    /// Its description for a terminal: name, promise, source, options with ranges, defaults and what each word means.
    pub fn describe(&self) -> String {
        let mut text = format!("{}\n    {}\n    source: {}\n", self.name, self.promise, self.source);
        for option in self.options {
            text += &format!("    {}={}  {}\n", option.name, option.default, option.doc);
            match option.range {
                OptionRange::Word(words) => {
                    for word in words {
                        text += &format!("        {:<12} {}\n", word.name, word.doc.trim());
                    }
                }
                range => text += &format!("        {range}\n"),
            }
        }
        text
    }
}

impl IntegratorEntry {
    /// Its section of the guide, in Markdown; ends with an empty line.
    pub fn markdown(&self) -> String {
        let mut text = format!("## {}\n\n{}.\nSource: {}.\n\n", self.name, capitalised(self.promise), self.source);
        if self.options.is_empty() {
            return text;
        }
        text += "| option | default | meaning |\n|---|---|---|\n";
        for option in self.options {
            text += &format!("| `{}` | `{}` | {}. ", option.name, option.default, option.doc);
            match option.range {
                OptionRange::Word(words) => {
                    let list: Vec<String> = words.iter().map(|w| format!("`{}`: {}", w.name, clause(w.doc))).collect();
                    text += &list.join("; ");
                }
                range => text += &capitalised(&range.to_string()),
            }
            text += " |\n";
        }
        text + "\n"
    }
}

/// A sentence as a part of one.
fn clause(sentence: &str) -> String {
    let text = sentence.trim().trim_end_matches('.');
    let mut letters = text.chars();
    match (letters.next(), letters.next()) {
        (Some(first), Some(second)) if second.is_lowercase() => {
            first.to_lowercase().collect::<String>() + &text[first.len_utf8()..]
        }
        _ => text.into(),
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_and_options_are_single_words_and_unique() {
        let word =
            |s: &str| !s.is_empty() && s.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
        let unique: BTreeSet<_> = names().collect();
        assert_eq!(unique.len(), INTEGRATORS.len());
        for e in INTEGRATORS {
            assert!(word(e.name) && !e.promise.is_empty() && !e.source.is_empty(), "{}", e.name);
            let keys: BTreeSet<_> = e.options.iter().map(|o| o.name).collect();
            assert_eq!(keys.len(), e.options.len(), "{}", e.name);
            assert!(e.options.iter().all(|o| word(o.name) && !o.doc.is_empty()), "{}", e.name);
        }
    }

    #[test]
    fn every_entry_is_made_with_every_value_of_every_option() {
        // Also that each default is in its range, and that `make` asks for no key that is not there.
        for e in INTEGRATORS {
            let plain = IntegratorChoice::named(e.name).unwrap();
            let _ = plain.integrator(Some(3)).limits();
            for option in e.options {
                let mut values = vec![option.default.to_string()];
                match option.range {
                    OptionRange::Flag => values.extend(["true".into(), "false".into()]),
                    OptionRange::Count(a, b) => values.extend([a.to_string(), b.to_string()]),
                    OptionRange::Number(a, b) => values.extend([a.to_string(), b.to_string()]),
                    OptionRange::Word(words) => values.extend(words.iter().map(|w| w.name.to_string())),
                }
                for value in values {
                    let choice = plain.clone().with(option.name, &value).unwrap_or_else(|why| panic!("{why}"));
                    assert_eq!(choice.options().get(option.name).to_string(), value);
                    let _ = choice.integrator(None).limits();
                }
            }
            assert!(e.options.iter().all(|o| e.describe().contains(o.doc)));
        }
    }
}
