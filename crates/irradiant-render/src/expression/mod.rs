//! Path expressions: regular expressions over the events of a light path, read from the light to the eye (Heckbert 1990,
//! "Adaptive radiosity textures for bidirectional ray tracing"), with labels of lights and surfaces.
//!
//! | written | matches |
//! |---|---|
//! | `L` | any light |
//! | `B` | a light that is an environment, at infinity all around |
//! | `D` `G` `S` `V` | an event: diffuse, glossy, specular (a delta), in a volume |
//! | `.` | any one event |
//! | `E` | the eye |
//! | `<RD>` `<TS>` `<R.>` | an event that reflects, that transmits |
//! | `[DG]` `[^S]` | one of these events, an event that is none of these |
//! | `L'name'` `D'name'` `.'wall*'` | with a label; `*` in it stands for anything |
//! | `x*` `x+` `x?` `x{2}` `x{2,}` `x{2,5}` | repeated |
//! | `(x\|y)` | either |
//! | `... @hit` `... @sampled` | only what met the light by chance, or by sampling it |
//!
//! Blanks do not matter. Files, in reading order: this one (what an expression is), `parse`, [`automaton`] (many
//! expressions at once, run along a path from the eye).

pub mod automaton;
mod parse;
#[cfg(test)]
mod tests;

use crate::record::Technique;

pub use automaton::PathAutomaton;

/// Kinds of scattering events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventClass {
    /// Spread broadly.
    Diffuse,
    /// About a direction.
    Glossy,
    /// In one direction.
    Specular,
    /// In a participating medium.
    Volume,
}

impl EventClass {
    /// All, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Diffuse, Self::Glossy, Self::Specular, Self::Volume];
}

/// A path expression that has been read. [`PathExpression::parse`] makes it.
#[derive(Clone, Debug, PartialEq)]
pub struct PathExpression {
    text: String,
    pub(crate) root: Node,
    /// Only what was found so.
    pub technique: Option<Technique>,
}

/// Syntax, in reading order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Node {
    Letter(Letter),
    Sequence(Vec<Node>),
    Either(Vec<Node>),
    Repeat { node: Box<Node>, least: u32, most: Option<u32> },
}

/// One step of a path.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Letter {
    Eye,
    Light {
        environment_only: bool,
        label: Option<Label>,
    },
    /// An event in one of the sets, or (negated) in none.
    Event {
        sets: Vec<EventSet>,
        negated: bool,
    },
}

/// Events by class, side and label.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EventSet {
    /// Bit for each [`EventClass`].
    pub classes: u8,
    /// Bit 0: reflection, bit 1: transmission.
    pub sides: u8,
    pub label: Option<Label>,
}

/// A name with `*` for anything, and where it stands, in characters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Label {
    pub pattern: String,
    pub at: usize,
}

impl Label {
    pub fn matches(&self, name: &str) -> bool {
        let mut parts = self.pattern.split('*');
        let first = parts.next().unwrap_or("");
        let Some(mut rest) = name.strip_prefix(first) else { return false };
        let mut parts: Vec<&str> = parts.collect();
        let Some(last) = parts.pop() else { return rest.is_empty() };
        for part in parts {
            let Some(found) = rest.find(part) else { return false };
            rest = &rest[found + part.len()..];
        }
        rest.ends_with(last)
    }
}

impl Node {
    fn for_each_letter(&self, visit: &mut impl FnMut(&Letter)) {
        match self {
            Self::Letter(letter) => visit(letter),
            Self::Sequence(nodes) | Self::Either(nodes) => nodes.iter().for_each(|n| n.for_each_letter(visit)),
            Self::Repeat { node, .. } => node.for_each_letter(visit),
        }
    }
}

impl EventSet {
    pub fn contains(&self, class: EventClass, transmitted: bool, has_label: &impl Fn(&Label) -> bool) -> bool {
        self.classes >> class as u8 & 1 == 1
            && self.sides >> u8::from(transmitted) & 1 == 1
            && self.label.as_ref().is_none_or(has_label)
    }
}

impl PathExpression {
    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Calls with each label: of a light (true) or of a surface.
    pub(crate) fn for_each_label(&self, mut visit: impl FnMut(&Label, bool)) {
        self.root.for_each_letter(&mut |letter| match letter {
            Letter::Eye => {}
            Letter::Light { label, .. } => label.iter().for_each(|l| visit(l, true)),
            Letter::Event { sets, .. } => sets.iter().filter_map(|s| s.label.as_ref()).for_each(|l| visit(l, false)),
        });
    }

    /// This expression with a complaint about it.
    pub(crate) fn error(&self, at: usize, length: usize, message: String, help: String) -> ExpressionError {
        ExpressionError { text: self.text.clone(), at, length, message, help }
    }
}

/// What is wrong with a path expression, where, and what to try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpressionError {
    /// The whole expression.
    pub text: String,
    /// First character of what is wrong.
    pub at: usize,
    /// Number of its characters.
    pub length: usize,
    /// What was found.
    pub message: String,
    /// What to try.
    pub help: String,
}

impl std::fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.message)?;
        writeln!(f, "  {}", self.text)?;
        write!(f, "  {}{}", " ".repeat(self.at), "^".repeat(self.length.max(1)))?;
        if self.help.is_empty() { Ok(()) } else { write!(f, "\nhelp: {}", self.help) }
    }
}

impl std::error::Error for ExpressionError {}
