//! From text to a path expression, with complaints that show the place.

use super::{EventClass, EventSet, ExpressionError, Label, Letter, Node, PathExpression};
use crate::record::Technique;

/// Letters that an expression may have after its repetitions are written out: a bound on memory and time.
pub(super) const MOST_LETTERS: u64 = 1024;
/// Parentheses within parentheses at most.
const DEEPEST: usize = 50;

const ALL_CLASSES: u8 = 0b1111;
const BOTH_SIDES: u8 = 0b11;
/// What a repetition begins with.
const REPETITIONS: &str = "*+?{";
const LETTERS: &str = "lights are L (any) and B (an environment), events are D, G, S, V and . (any), the eye is E";

impl PathExpression {
    /// Reads an expression; says where it is wrong. Labels are not checked: they are a scene's.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let mut parser = Parser { text, characters: text.chars().collect(), at: 0, depth: 0 };
        let technique = parser.technique()?;
        let root = parser.either()?;
        if parser.peek().is_some() {
            // Everything but a closing parenthesis is part of an expression.
            return Err(parser.error(parser.at, 1, "a \")\" that closes nothing", "remove it, or open it with \"(\""));
        }
        let expression = Self { text: text.to_string(), root, technique };
        if expression.root.size() > MOST_LETTERS {
            let message = format!("more than {MOST_LETTERS} letters when repetitions are written out");
            return Err(expression.error(
                0,
                text.chars().count(),
                message,
                "use smaller numbers in {m,n}, or * and +".into(),
            ));
        }
        super::automaton::check_reachable(&expression)?;
        Ok(expression)
    }
}

impl Node {
    /// Nothing was written.
    fn is_nothing(&self) -> bool {
        matches!(self, Self::Sequence(nodes) if nodes.is_empty())
    }

    /// Number of letters when repetitions are written out; saturates.
    fn size(&self) -> u64 {
        match self {
            Self::Letter(_) => 1,
            Self::Sequence(nodes) | Self::Either(nodes) => nodes.iter().fold(0, |n, x| n.saturating_add(x.size())),
            Self::Repeat { node, least, most } => {
                let copies = u64::from(most.unwrap_or((*least).max(1)));
                // What repeats nothing still costs its copies.
                node.size().max(1).saturating_mul(copies)
            }
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    characters: Vec<char>,
    at: usize,
    depth: usize,
}

type Parsed<T> = Result<T, ExpressionError>;

impl Parser<'_> {
    fn error(&self, at: usize, length: usize, message: impl Into<String>, help: impl Into<String>) -> ExpressionError {
        ExpressionError { text: self.text.into(), at, length, message: message.into(), help: help.into() }
    }

    /// The next character that is not blank.
    fn peek(&mut self) -> Option<char> {
        while self.characters.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.characters.get(self.at).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += usize::from(found);
        found
    }

    /// `@hit` or `@sampled` at the end, which is cut off.
    fn technique(&mut self) -> Parsed<Option<Technique>> {
        let Some(at) = self.characters.iter().rposition(|&c| c == '@') else { return Ok(None) };
        let word: String = self.characters[at + 1..].iter().collect();
        let technique = match word.trim() {
            "hit" => Technique::Hit,
            "sampled" => Technique::LightSample,
            other => {
                let length = self.characters.len() - at;
                let message = format!("\"{other}\" is not a way of finding light");
                return Err(self.error(at, length, message, "write @hit or @sampled, at the end"));
            }
        };
        self.characters.truncate(at);
        Ok(Some(technique))
    }

    fn either(&mut self) -> Parsed<Node> {
        let mut nodes = vec![self.sequence()?];
        while self.take('|') {
            let bar = self.at - 1;
            nodes.push(self.sequence()?);
            if nodes[nodes.len() - 2..].iter().any(Node::is_nothing) {
                let help = "write both sides, (D|S); for \"D or nothing\" write D?";
                return Err(self.error(bar, 1, "nothing stands on one side of this \"|\"", help));
            }
        }
        Ok(if nodes.len() == 1 { nodes.remove(0) } else { Node::Either(nodes) })
    }

    fn sequence(&mut self) -> Parsed<Node> {
        let mut nodes = Vec::new();
        while let Some(c) = self.peek() {
            if matches!(c, '|' | ')') {
                break;
            }
            let atom = self.atom(c)?;
            nodes.push(self.repeated(atom)?);
        }
        Ok(if nodes.len() == 1 { nodes.remove(0) } else { Node::Sequence(nodes) })
    }

    fn atom(&mut self, c: char) -> Parsed<Node> {
        let start = self.at;
        match c {
            '(' => {
                self.depth += 1;
                if self.depth > DEEPEST {
                    return Err(self.error(start, 1, "too many parentheses within each other", ""));
                }
                self.at += 1;
                let node = self.either()?;
                if !self.take(')') {
                    return Err(self.error(start, 1, "this \"(\" is not closed", "add \")\""));
                }
                if node.is_nothing() {
                    let help = "write events there, or leave the parentheses out";
                    return Err(self.error(start, self.at - start, "nothing is in these parentheses", help));
                }
                self.depth -= 1;
                Ok(node)
            }
            '[' => self.brackets(),
            'E' => {
                self.at += 1;
                if self.characters.get(self.at) == Some(&'\'') {
                    return Err(self.error(self.at, 1, "the eye has no label", "labels follow lights and events"));
                }
                Ok(Node::Letter(Letter::Eye))
            }
            'L' | 'B' => {
                self.at += 1;
                Ok(Node::Letter(Letter::Light { environment_only: c == 'B', label: self.label()? }))
            }
            c if REPETITIONS.contains(c) => Err(self.error(
                start,
                1,
                format!("nothing to repeat before \"{c}\""),
                "put it behind a letter or a \")\"",
            )),
            _ => Ok(Node::Letter(Letter::Event { sets: vec![self.event()?], negated: false })),
        }
    }

    /// `D`, `.`, `<RD>`, each with an optional label.
    fn event(&mut self) -> Parsed<EventSet> {
        let start = self.at;
        let Some(c) = self.peek() else {
            return Err(self.error(start, 1, "an event is missing here", LETTERS));
        };
        let mut set = EventSet { classes: 0, sides: BOTH_SIDES, label: None };
        if c != '<' {
            set.classes = self.class()?;
            set.label = self.label()?;
            return Ok(set);
        }
        self.at += 1;
        set.sides = match self.peek() {
            Some('R') => 0b01,
            Some('T') => 0b10,
            _ => {
                let help = "write <RD> for diffuse reflection, <TS> for specular transmission, <R.> for any reflection";
                return Err(self.error(self.at.min(self.characters.len()), 1, "R or T belongs here", help));
            }
        };
        self.at += 1;
        if self.peek() == Some('>') {
            set.classes = ALL_CLASSES;
        }
        while !matches!(self.peek(), None | Some('>' | '\'')) {
            set.classes |= self.class()?;
        }
        set.label = self.label()?;
        if !self.take('>') {
            return Err(self.error(start, 1, "this \"<\" is not closed", "add \">\""));
        }
        if set.label.is_none() {
            set.label = self.label()?;
        }
        Ok(set)
    }

    fn class(&mut self) -> Parsed<u8> {
        let class = match self.peek() {
            Some('D') => 1 << EventClass::Diffuse as u8,
            Some('G') => 1 << EventClass::Glossy as u8,
            Some('S') => 1 << EventClass::Specular as u8,
            Some('V') => 1 << EventClass::Volume as u8,
            Some('.') => ALL_CLASSES,
            found => return Err(self.stranger(found)),
        };
        self.at += 1;
        Ok(class)
    }

    /// A character that is no event where one should be.
    fn stranger(&self, found: Option<char>) -> ExpressionError {
        let Some(c) = found else {
            return self.error(self.characters.len(), 1, "an event is missing at the end", LETTERS);
        };
        let help = match c {
            'L' | 'B' | 'E' => "only scattering events stand here; for lights write (L'a'|L'b')".into(),
            'R' | 'T' => format!("sides are written with the event: <{c}D>, <{c}S>, <{c}.>"),
            'C' | 'c' => "the eye is E; paths are read from the light to the eye".into(),
            _ if "lbdgsve".contains(c) => format!("did you mean \"{}\"?", c.to_ascii_uppercase()),
            '\'' | '"' => "a label follows the letter that it belongs to, in single quotes: D'floor'".into(),
            '^' => "\"anything but\" is written [^S]".into(),
            ']' | '>' | '}' => format!("this \"{c}\" closes nothing"),
            _ => LETTERS.into(),
        };
        self.error(self.at, 1, format!("\"{c}\" cannot stand here in a path expression"), help)
    }

    fn brackets(&mut self) -> Parsed<Node> {
        let start = self.at;
        self.at += 1;
        let negated = self.take('^');
        let mut sets = Vec::new();
        loop {
            match self.peek() {
                None => return Err(self.error(start, 1, "this \"[\" is not closed", "add \"]\"")),
                Some(']') => break,
                Some(_) => sets.push(self.event()?),
            }
        }
        self.at += 1;
        if sets.is_empty() {
            let help = "name events: [DG] is one of both, [^S] is any but specular; . is any";
            return Err(self.error(start, self.at - start, "nothing is in these brackets", help));
        }
        Ok(Node::Letter(Letter::Event { sets, negated }))
    }

    fn label(&mut self) -> Parsed<Option<Label>> {
        if self.peek() != Some('\'') {
            return Ok(None);
        }
        let at = self.at;
        let length = self.characters[at + 1..].iter().position(|&c| c == '\'');
        let Some(length) = length else {
            return Err(self.error(at, 1, "this label does not end", "close it with a single quote"));
        };
        if length == 0 {
            let help = "labels are names of materials, objects, lights' groups; leave it out for any";
            return Err(self.error(at, 2, "an empty label", help));
        }
        self.at = at + length + 2;
        Ok(Some(Label { pattern: self.characters[at + 1..=at + length].iter().collect(), at }))
    }

    fn repeated(&mut self, node: Node) -> Parsed<Node> {
        let Some((least, most)) = self.repetition(&node)? else { return Ok(node) };
        let first = self.at - 1;
        let node = Node::Repeat { node: Box::new(node), least, most };
        // Whoever writes L.** means something else than L.*, and x{2}* may be read in two ways.
        if let Some(c) = self.peek().filter(|c| REPETITIONS.contains(*c)) {
            let before = self.characters[first];
            let message = format!("\"{c}\" repeats what \"{before}\" repeats already");
            let help =
                "one repetition is enough: x* is any number, x+ at least one; repeat groups with parentheses, (x{2})*";
            return Err(self.error(self.at, 1, message, help));
        }
        Ok(node)
    }

    /// A repetition of what stands before, if there is one here: least and most.
    fn repetition(&mut self, of: &Node) -> Parsed<Option<(u32, Option<u32>)>> {
        let Some(c) = self.peek().filter(|c| REPETITIONS.contains(*c)) else { return Ok(None) };
        // "L*E" is how a file name would be written.
        if let Node::Letter(Letter::Light { .. } | Letter::Eye) = of {
            let message = format!("\"{c}\" repeats the letter before it, and a path has one light and one eye");
            return Err(self.error(self.at, 1, message, "for any events in between write L.*E, for at least one L.+E"));
        }
        if c == '{' {
            return self.counts().map(Some);
        }
        self.at += 1;
        Ok(Some(match c {
            '*' => (0, None),
            '+' => (1, None),
            _ => (0, Some(1)),
        }))
    }

    /// `{2}`, `{2,}`, `{2,5}`.
    fn counts(&mut self) -> Parsed<(u32, Option<u32>)> {
        let start = self.at;
        let length = self.characters[start..].iter().position(|&c| c == '}');
        let Some(length) = length else {
            return Err(self.error(start, 1, "this \"{\" is not closed", "write {2}, {2,} or {2,5}"));
        };
        self.at = start + length + 1;
        let inside: String = self.characters[start + 1..start + length].iter().collect();
        let wrong = |message: &str| self.error(start, length + 1, message, "write {2}, {2,} or {2,5}");
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong("not a number of repetitions"));
        let (least, most) = match inside.split_once(',') {
            None => {
                let n = number(&inside)?;
                (n, Some(n))
            }
            Some((least, most)) if most.trim().is_empty() => (number(least)?, None),
            Some((least, most)) => (number(least)?, Some(number(most)?)),
        };
        if most.is_some_and(|most| most < least) {
            return Err(wrong("fewer repetitions at most than at least"));
        }
        Ok((least, most))
    }
}
