//! Many path expressions as one automaton that runs along a path from the eye.
//!
//! Each letter of each expression is a position (Glushkov 1961); what may follow it is worked out once, and kept backwards,
//! since a path tracer meets a path's events in the order opposite to that of reading. A state is the set of positions
//! that the next event may match; a step tests all expressions at once, a word of 64 positions at a time.

use super::{EventClass, ExpressionError, Label, Letter, Node, PathExpression};
use crate::record::Technique;
use irradiant_core::interaction::{LightId, ShapeId};
use irradiant_core::scene::Scene;
use irradiant_scene::diagnostic::did_you_mean;
use std::collections::HashMap;

/// A set of positions.
pub(crate) type Bits = Vec<u64>;

fn set(bits: &mut [u64], i: u32) {
    bits[i as usize / 64] |= 1 << (i % 64);
}

/// Calls with each member.
#[inline]
fn for_each(bits: impl Iterator<Item = u64>, mut visit: impl FnMut(u32)) {
    for (word, mut rest) in bits.enumerate() {
        while rest != 0 {
            visit(word as u32 * 64 + rest.trailing_zeros());
            rest &= rest - 1;
        }
    }
}

/// The positions of expressions, in reading order of each.
#[derive(Default)]
struct Positions {
    letters: Vec<Letter>,
    /// For each position, those that may come right before it in reading order.
    before: Vec<Vec<u32>>,
}

/// What a part of an expression begins and ends with.
struct Part {
    can_be_empty: bool,
    first: Vec<u32>,
    last: Vec<u32>,
}

impl Part {
    fn empty() -> Self {
        Self { can_be_empty: true, first: Vec::new(), last: Vec::new() }
    }
}

impl Positions {
    fn link(&mut self, from: &[u32], to: &[u32]) {
        for &t in to {
            self.before[t as usize].extend(from);
        }
    }

    fn then(&mut self, a: Part, b: Part) -> Part {
        self.link(&a.last, &b.first);
        let mut first = a.first;
        if a.can_be_empty {
            first.extend(&b.first);
        }
        let mut last = b.last;
        if b.can_be_empty {
            last.extend(&a.last);
        }
        Part { can_be_empty: a.can_be_empty && b.can_be_empty, first, last }
    }

    fn add(&mut self, node: &Node) -> Part {
        match node {
            Node::Letter(letter) => {
                let position = self.letters.len() as u32;
                self.letters.push(letter.clone());
                self.before.push(Vec::new());
                Part { can_be_empty: false, first: vec![position], last: vec![position] }
            }
            Node::Sequence(nodes) => nodes.iter().fold(Part::empty(), |sum, n| {
                let next = self.add(n);
                self.then(sum, next)
            }),
            Node::Either(nodes) => {
                let mut sum = Part { can_be_empty: false, first: Vec::new(), last: Vec::new() };
                for n in nodes {
                    let part = self.add(n);
                    sum.can_be_empty |= part.can_be_empty;
                    sum.first.extend(part.first);
                    sum.last.extend(part.last);
                }
                sum
            }
            Node::Repeat { node, least, most } => {
                // Copies one after another; those beyond the least may be missing, and without a most the last may recur.
                let copies = most.unwrap_or((*least).max(1));
                let mut sum = Part::empty();
                for i in 0..copies {
                    let mut next = self.add(node);
                    if i + 1 == copies && most.is_none() {
                        let (last, first) = (next.last.clone(), next.first.clone());
                        self.link(&last, &first);
                    }
                    next.can_be_empty |= i >= *least;
                    sum = self.then(sum, next);
                }
                sum
            }
        }
    }
}

/// That some path can match: a light, events, the eye.
pub(super) fn check_reachable(expression: &PathExpression) -> Result<(), ExpressionError> {
    let mut positions = Positions::default();
    let whole = positions.add(&expression.root);
    let is_event = |p: u32| matches!(positions.letters[p as usize], Letter::Event { .. });
    let is_eye = |p: u32| positions.letters[p as usize] == Letter::Eye;
    let mut seen = vec![false; positions.letters.len()];
    let mut open: Vec<u32> = whole.last.iter().copied().filter(|&p| is_eye(p)).collect();
    let ends_at_eye = !open.is_empty();
    while let Some(p) = open.pop() {
        for &q in &positions.before[p as usize] {
            if matches!(positions.letters[q as usize], Letter::Light { .. }) && whole.first.contains(&q) {
                return Ok(());
            }
            if is_event(q) && !std::mem::replace(&mut seen[q as usize], true) {
                open.push(q);
            }
        }
    }
    let begins_at_light = whole.first.iter().any(|&p| matches!(positions.letters[p as usize], Letter::Light { .. }));
    let text = expression.text();
    let has = |wanted: fn(&Letter) -> bool| positions.letters.iter().any(wanted);
    let length = text.chars().count().max(1);
    let message = "no path matches this: paths begin at a light (L or B), are scattered, and end at the eye (E)";
    let help = match (begins_at_light, ends_at_eye) {
        _ if has(|l| *l == Letter::Eye) && !ends_at_eye && has(|l| matches!(l, Letter::Light { .. })) => {
            "paths are read from the light to the eye: L first, E last".into()
        }
        (true, false) => format!("end it with E: {text}E"),
        (false, true) => format!("begin it with L: L{text}"),
        (false, false) => format!("begin it with L and end it with E: L{text}E"),
        (true, true) => "lights and the eye stand at the ends only, and once".into(),
    };
    Err(expression.error(0, length, message.into(), help))
}

/// Several expressions, compiled for a scene.
pub struct PathAutomaton {
    words: usize,
    /// What may come right before the eye.
    start: Bits,
    /// For each position, a range of `before`.
    spans: Vec<[u32; 2]>,
    before: Vec<u32>,
    /// Positions that begin their expression and are lights.
    accepting: Bits,
    expression_of: Vec<u32>,
    techniques: Vec<Option<Technique>>,
    /// Positions that an event matches: by signature of the surface, class, and side.
    events: Vec<u64>,
    /// Positions that a light matches, by its signature.
    lights: Vec<u64>,
    signature_of_shape: Vec<u32>,
    signature_of_light: Vec<u32>,
}

/// Gives each distinct value a number.
struct Numbering<T> {
    known: HashMap<T, u32>,
    list: Vec<T>,
}

impl<T: Clone + Eq + std::hash::Hash> Numbering<T> {
    fn new() -> Self {
        Self { known: HashMap::new(), list: Vec::new() }
    }

    fn number(&mut self, value: T) -> u32 {
        if let Some(&n) = self.known.get(&value) {
            return n;
        }
        let n = self.list.len() as u32;
        self.known.insert(value.clone(), n);
        self.list.push(value);
        n
    }
}

/// What the things of a scene are called.
pub(crate) struct Names {
    /// Of each light: numbers, groups, kinds; and whether it is an environment.
    pub lights: Vec<(Vec<String>, bool)>,
    /// Of each shape.
    pub shapes: Vec<Vec<String>>,
}

impl Names {
    /// Lights answer to `#` and their number among the author's lights, their group ("ungrouped" without) and kind;
    /// shapes to their material's name (or kind) and the name of their object.
    pub fn of(scene: &Scene) -> Self {
        let origins = scene.lights.origins();
        let lights = (0..scene.lights.len() as u32).map(LightId).map(|id| {
            let index = origins.of(id);
            let origin = &origins.as_slice()[index];
            let group = origin.group.as_deref().unwrap_or(UNGROUPED);
            let names = vec![format!("#{index}"), group.to_string(), origin.kind.to_string()];
            (names, scene.lights.get(id).is_environment())
        });
        let shapes = (0..scene.geometry.n_shapes() as u32).map(ShapeId).map(|id| {
            let material = scene.material_name(scene.geometry.material(id)).to_string();
            scene.labels.object(id).map(String::from).into_iter().chain([material]).collect()
        });
        Self { lights: lights.collect(), shapes: shapes.collect() }
    }

    fn check(&self, expression: &PathExpression) -> Result<(), ExpressionError> {
        let mut wrong = None;
        expression.for_each_label(|label, of_light| {
            let mut names: Vec<&str> = if of_light {
                self.lights.iter().flat_map(|l| l.0.iter().map(String::as_str)).collect()
            } else {
                self.shapes.iter().flatten().map(String::as_str).collect()
            };
            if wrong.is_some() || names.iter().any(|n| label.matches(n)) {
                return;
            }
            names.sort_unstable();
            names.dedup();
            let (what, has) =
                if of_light { ("light", "lights are called") } else { ("surface", "surfaces are called") };
            let help = match did_you_mean(&label.pattern, names.iter().copied()) {
                Some(near) => format!("did you mean '{near}'?"),
                None if names.is_empty() => format!("the scene has no {what}"),
                None => {
                    let more = if names.len() > 12 { ", ..." } else { "" };
                    names.truncate(12);
                    format!("the scene's {has} {}{more}", names.join(", "))
                }
            };
            let message = format!("no {what} of this scene is called '{}'", label.pattern);
            wrong = Some(expression.error(label.at, label.pattern.chars().count() + 2, message, help));
        });
        wrong.map_or(Ok(()), Err)
    }
}

/// The group of lights that are in none.
pub const UNGROUPED: &str = "ungrouped";

impl PathAutomaton {
    /// Compiles expressions; a label that nothing in the scene has is an error.
    pub fn new(expressions: &[PathExpression], scene: &Scene) -> Result<Self, ExpressionError> {
        Self::with_names(expressions, &Names::of(scene))
    }

    pub(crate) fn with_names(expressions: &[PathExpression], names: &Names) -> Result<Self, ExpressionError> {
        let mut positions = Positions::default();
        let (mut first, mut last, mut expression_of) = (Vec::new(), Vec::new(), Vec::new());
        for (i, expression) in expressions.iter().enumerate() {
            names.check(expression)?;
            let whole = positions.add(&expression.root);
            first.extend(whole.first);
            last.extend(whole.last);
            expression_of.resize(positions.letters.len(), i as u32);
        }
        let Positions { letters, mut before } = positions;
        for list in &mut before {
            // Repetitions within repetitions link more than once.
            list.sort_unstable();
            list.dedup();
        }
        let words = letters.len().div_ceil(64).max(1);

        let mut start = vec![0; words];
        for &p in last.iter().filter(|&&p| letters[p as usize] == Letter::Eye) {
            before[p as usize].iter().for_each(|&q| set(&mut start, q));
        }
        let mut accepting = vec![0; words];
        for &p in first.iter().filter(|&&p| matches!(letters[p as usize], Letter::Light { .. })) {
            set(&mut accepting, p);
        }

        // Surfaces that no label tells apart share their masks.
        let (mut light_labels, mut surface_labels) = (Vec::<Label>::new(), Vec::<Label>::new());
        for expression in expressions {
            expression.for_each_label(|label, of_light| {
                let list = if of_light { &mut light_labels } else { &mut surface_labels };
                if !list.iter().any(|l| l.pattern == label.pattern) {
                    list.push(label.clone());
                }
            });
        }
        let matched = |labels: &[Label], names: &[String]| -> Vec<bool> {
            labels.iter().map(|l| names.iter().any(|n| l.matches(n))).collect()
        };
        let has = |labels: &[Label], matched: &[bool], label: &Label| {
            labels.iter().zip(matched).any(|(l, &m)| m && l.pattern == label.pattern)
        };
        let mut surfaces = Numbering::new();
        let signature_of_shape =
            names.shapes.iter().map(|names| surfaces.number(matched(&surface_labels, names))).collect();
        let mut events = vec![0; surfaces.list.len() * 8 * words];
        for (signature, matches) in surfaces.list.iter().enumerate() {
            for class in EventClass::ALL {
                for transmitted in [false, true] {
                    let at = Self::event_row(signature as u32, class, transmitted) * words;
                    for (p, letter) in letters.iter().enumerate() {
                        let Letter::Event { sets, negated } = letter else { continue };
                        let inside = sets
                            .iter()
                            .any(|s| s.contains(class, transmitted, &|l: &Label| has(&surface_labels, matches, l)));
                        if inside != *negated {
                            set(&mut events[at..at + words], p as u32);
                        }
                    }
                }
            }
        }
        let mut kinds = Numbering::new();
        let signature_of_light = names
            .lights
            .iter()
            .map(|(names, environment)| kinds.number((matched(&light_labels, names), *environment)))
            .collect();
        let mut lights = vec![0; kinds.list.len() * words];
        for (signature, (matches, environment)) in kinds.list.iter().enumerate() {
            for (p, letter) in letters.iter().enumerate() {
                let Letter::Light { environment_only, label } = letter else { continue };
                let fits = label.as_ref().is_none_or(|l| has(&light_labels, matches, l));
                if fits && (*environment || !environment_only) {
                    set(&mut lights[signature * words..(signature + 1) * words], p as u32);
                }
            }
        }

        let (mut spans, mut flat) = (Vec::with_capacity(before.len()), Vec::new());
        for list in &before {
            let from = flat.len() as u32;
            flat.extend(list);
            spans.push([from, flat.len() as u32]);
        }
        Ok(Self {
            words,
            start,
            spans,
            before: flat,
            accepting,
            expression_of,
            techniques: expressions.iter().map(|e| e.technique).collect(),
            events,
            lights,
            signature_of_shape,
            signature_of_light,
        })
    }

    #[inline]
    fn event_row(signature: u32, class: EventClass, transmitted: bool) -> usize {
        signature as usize * 8 + class as usize * 2 + usize::from(transmitted)
    }

    /// Number of expressions.
    pub fn len(&self) -> usize {
        self.techniques.len()
    }

    /// True without expressions.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The state at the eye: what the event seen first may match.
    pub(crate) fn start(&self) -> &[u64] {
        &self.start
    }

    /// One event further from the eye: `to` becomes what the event after it may match.
    #[inline]
    pub(crate) fn step(&self, from: &[u64], shape: ShapeId, class: EventClass, transmitted: bool, to: &mut [u64]) {
        let signature = self.signature_of_shape[shape.0 as usize];
        let row = Self::event_row(signature, class, transmitted) * self.words;
        let mask = &self.events[row..row + self.words];
        to.fill(0);
        for_each(from.iter().zip(mask).map(|(a, b)| a & b), |p| {
            let [begin, end] = self.spans[p as usize];
            for &q in &self.before[begin as usize..end as usize] {
                set(to, q);
            }
        });
    }

    /// Calls with each expression, in order, that matches a path which ends in this state at this light.
    #[inline]
    pub(crate) fn for_each_match(
        &self,
        state: &[u64],
        light: LightId,
        technique: Technique,
        mut visit: impl FnMut(u32),
    ) {
        let at = self.signature_of_light[light.0 as usize] as usize * self.words;
        let mask = &self.lights[at..at + self.words];
        let mut last = None;
        let both = state.iter().zip(mask).zip(&self.accepting).map(|((a, b), c)| a & b & c);
        for_each(both, |p| {
            let expression = self.expression_of[p as usize];
            // Two positions of one expression may both match; they stand side by side.
            if last != Some(expression) && self.techniques[expression as usize].is_none_or(|t| t == technique) {
                visit(expression);
            }
            last = Some(expression);
        });
    }
}
