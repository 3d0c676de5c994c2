//! The automaton against a small backtracking matcher, which is the specification; and what is said of mistakes.

use super::automaton::Names;
use super::*;
use irradiant_core::interaction::{LightId, ShapeId};
use irradiant_testkit::Rng;

/// An expression as the tests write it, apart from the parser's own idea of one.
#[derive(Clone, Debug)]
enum Spec {
    Eye,
    Light(&'static str, Option<&'static str>),
    /// Classes, side (R, T or both), label.
    Event(&'static str, Option<char>, Option<&'static str>),
    Not(&'static str),
    Then(Vec<Spec>),
    Or(Vec<Spec>),
    Times(Box<Spec>, usize, Option<usize>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Token {
    Light(u32),
    Event(char, bool, u32),
    Eye,
}

const SHAPES: [&[&str]; 3] = [&["floor"], &["chair", "wood"], &["glass"]];
const LIGHTS: [(&[&str], bool); 3] = [
    (&["#0", "window", "diffuse"], false),
    (&["#1", "ungrouped", "infinite"], true),
    (&["#2", "window", "spot"], false),
];

fn names() -> Names {
    let owned = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
    Names {
        lights: LIGHTS.iter().map(|(names, environment)| (owned(names), *environment)).collect(),
        shapes: SHAPES.iter().map(|names| owned(names)).collect(),
    }
}

impl Spec {
    fn text(&self) -> String {
        let quoted = |label: &Option<&str>| label.map_or(String::new(), |l| format!("'{l}'"));
        match self {
            Self::Eye => "E".into(),
            Self::Light(letter, label) => format!("{letter}{}", quoted(label)),
            Self::Event(classes, None, label) if classes.len() == 1 => format!("{classes}{}", quoted(label)),
            Self::Event(classes, None, label) => {
                let each = classes.chars().map(|c| format!("{c}{}", quoted(label)));
                format!("[{}]", each.collect::<String>())
            }
            Self::Event(classes, Some(side), label) => format!("<{side}{classes}{}>", quoted(label)),
            Self::Not(classes) => format!("[^{classes}]"),
            Self::Then(list) => list.iter().map(Self::text).collect::<Vec<_>>().join(" "),
            Self::Or(list) => format!("({})", list.iter().map(Self::text).collect::<Vec<_>>().join("|")),
            Self::Times(node, least, most) => {
                let count = match (least, most) {
                    (0, None) => "*".into(),
                    (1, None) => "+".into(),
                    (0, Some(1)) => "?".into(),
                    (n, None) => format!("{{{n},}}"),
                    (n, Some(m)) if n == m => format!("{{{n}}}"),
                    (n, Some(m)) => format!("{{{n},{m}}}"),
                };
                format!("({}){count}", node.text())
            }
        }
    }

    /// Whether this and then what follows matches all tokens.
    fn matches(&self, tokens: &[Token], rest: &dyn Fn(&[Token]) -> bool) -> bool {
        let one = |fits: &dyn Fn(Token) -> bool| tokens.first().is_some_and(|&t| fits(t) && rest(&tokens[1..]));
        match self {
            Self::Eye => one(&|t| t == Token::Eye),
            Self::Light(letter, label) => one(&|t| {
                let Token::Light(i) = t else { return false };
                let (names, environment) = LIGHTS[i as usize];
                (*letter == "L" || environment) && label.is_none_or(|l| names.contains(&l))
            }),
            Self::Event(classes, side, label) => one(&|t| {
                let Token::Event(class, transmitted, shape) = t else { return false };
                (*classes == "." || classes.contains(class))
                    && side.is_none_or(|s| (s == 'T') == transmitted)
                    && label.is_none_or(|l| SHAPES[shape as usize].contains(&l))
            }),
            Self::Not(classes) => one(&|t| matches!(t, Token::Event(class, ..) if !classes.contains(class))),
            Self::Then(list) => match list.split_first() {
                None => rest(tokens),
                Some((first, others)) => first.matches(tokens, &|t| Self::Then(others.to_vec()).matches(t, rest)),
            },
            Self::Or(list) => list.iter().any(|node| node.matches(tokens, rest)),
            Self::Times(node, least, most) => {
                if *least == 0 && rest(tokens) {
                    return true;
                }
                if *most == Some(0) {
                    return false;
                }
                let again = Self::Times(node.clone(), least.saturating_sub(1), most.map(|m| m - 1));
                node.matches(tokens, &|t| {
                    // What has eaten nothing may be repeated only as often as it must.
                    (t.len() < tokens.len() || *least > 0) && again.matches(t, rest)
                })
            }
        }
    }

    fn matches_all(&self, tokens: &[Token]) -> bool {
        self.matches(tokens, &|rest| rest.is_empty())
    }
}

fn pick<T: Copy>(rng: &mut Rng, list: &[T]) -> T {
    list[rng.next_u32() as usize % list.len()]
}

fn random_event(rng: &mut Rng) -> Spec {
    let label = pick(rng, &[None, None, None, Some("floor"), Some("wood"), Some("chair")]);
    match rng.next_u32() % 6 {
        0 => Spec::Not(pick(rng, &["S", "DG", "V"])),
        1 => Spec::Event(pick(rng, &["D", "S", ".", "DS"]), Some(pick(rng, &['R', 'T'])), label),
        2 => Spec::Event(pick(rng, &["DG", "GSV"]), None, label),
        _ => Spec::Event(pick(rng, &["D", "D", "S", "G", "V", "."]), None, label),
    }
}

fn random_middle(rng: &mut Rng, depth: u32) -> Spec {
    if depth == 0 {
        return random_event(rng);
    }
    match rng.next_u32() % 8 {
        0 | 1 => random_event(rng),
        2..4 => Spec::Then((0..1 + rng.next_u32() % 3).map(|_| random_middle(rng, depth - 1)).collect()),
        4 | 5 => Spec::Or((0..1 + rng.next_u32() % 3).map(|_| random_middle(rng, depth - 1)).collect()),
        _ => {
            let (least, most) =
                pick(rng, &[(0, None), (1, None), (0, Some(1)), (2, None), (2, Some(2)), (1, Some(3)), (0, Some(0))]);
            Spec::Times(Box::new(random_middle(rng, depth - 1)), least, most)
        }
    }
}

fn random_spec(rng: &mut Rng) -> Spec {
    let light = |rng: &mut Rng| {
        Spec::Light(pick(rng, &["L", "L", "B"]), pick(rng, &[None, None, Some("window"), Some("#1"), Some("spot")]))
    };
    let (a, b) = (light(rng), light(rng));
    let end = if rng.next_u32().is_multiple_of(4) { Spec::Or(vec![a, b]) } else { a };
    Spec::Then(vec![end, random_middle(rng, 4), Spec::Eye])
}

fn random_path(rng: &mut Rng) -> Vec<Token> {
    let mut path = vec![Token::Light(rng.next_u32() % 3)];
    for _ in 0..rng.next_u32() % 6 {
        path.push(Token::Event(
            pick(rng, &['D', 'D', 'S', 'S', 'G', 'V']),
            rng.next_u32().is_multiple_of(3),
            rng.next_u32() % 3,
        ));
    }
    path.push(Token::Eye);
    path
}

/// The expressions that the automaton says match, walking from the eye.
fn matched(automaton: &PathAutomaton, path: &[Token]) -> Vec<u32> {
    let mut state = automaton.start().to_vec();
    let mut next = state.clone();
    let mut found = Vec::new();
    for token in path.iter().rev() {
        match *token {
            Token::Eye => {}
            Token::Event(class, transmitted, shape) => {
                let class = EventClass::ALL["DGSV".find(class).unwrap()];
                automaton.step(&state, ShapeId(shape), class, transmitted, &mut next);
                std::mem::swap(&mut state, &mut next);
            }
            Token::Light(i) => automaton.for_each_match(&state, LightId(i), Technique::Hit, |e| found.push(e)),
        }
    }
    found
}

#[test]
fn the_automaton_matches_what_a_backtracking_matcher_does() {
    let mut rng = Rng::new(11);
    let (mut hits, mut misses, mut impossible) = (0, 0, 0);
    for _ in 0..60 {
        let specs: Vec<Spec> = (0..20).map(|_| random_spec(&mut rng)).collect();
        let paths: Vec<Vec<Token>> = (0..150).map(|_| random_path(&mut rng)).collect();
        let mut read = Vec::new();
        for spec in specs {
            match PathExpression::parse(&spec.text()) {
                Ok(expression) => read.push((spec, expression)),
                Err(why) => {
                    assert!(why.message.starts_with("no path matches"), "{why}");
                    assert!(!paths.iter().any(|p| spec.matches_all(p)), "{why}");
                    impossible += 1;
                }
            }
        }
        let expressions: Vec<_> = read.iter().map(|(_, e)| e.clone()).collect();
        let automaton = PathAutomaton::with_names(&expressions, &names()).unwrap();
        for path in &paths {
            let wanted: Vec<u32> = (0..read.len() as u32).filter(|&i| read[i as usize].0.matches_all(path)).collect();
            assert_eq!(matched(&automaton, path), wanted, "{path:?}");
            hits += wanted.len();
            misses += read.len() - wanted.len();
        }
    }
    assert!(hits > 5_000 && misses > 50_000 && impossible < 100, "{hits} {misses} {impossible}: no bite");
}

#[test]
fn the_lecturers_expressions_mean_what_they_say() {
    let path = |events: &str| -> Vec<Token> {
        let events = events.chars().map(|c| Token::Event(c, false, 0));
        [Token::Light(0)].into_iter().chain(events).chain([Token::Eye]).collect()
    };
    let cases = [
        ("LDE", &["D"][..], &["", "S", "DD", "G"][..]),
        ("LS+DE", &["SD", "SSD"], &["D", "S", "SDD", "DS"]),
        ("L(D|S)*E", &["", "D", "S", "DSSD"], &["G", "DG", "V"]),
        ("L.{2}E", &["DD", "SV"], &["D", "DDD"]),
        ("L . {2,} E", &["DD", "SVG"], &["D", ""]),
        ("L[^S]?S*E", &["", "D", "SS", "DSS", "G"], &["SD", "DD"]),
        ("(LD|LS.)E", &["D", "SD", "SG"], &["S", "DD"]),
        ("L(D*)*E", &["", "DD"], &["S"]),
    ];
    for (text, inside, outside) in cases {
        let expression = PathExpression::parse(text).unwrap_or_else(|e| panic!("{e}"));
        let automaton = PathAutomaton::with_names(&[expression], &names()).unwrap();
        for events in inside {
            assert_eq!(matched(&automaton, &path(events)), [0], "{text} {events}");
        }
        for events in outside {
            assert!(matched(&automaton, &path(events)).is_empty(), "{text} {events}");
        }
    }
}

#[test]
fn mistakes_are_shown_in_their_place_with_what_to_try() {
    let cases = [
        ("LXE", 1, 1, "events are D, G, S, V"),
        ("LdE", 1, 1, "did you mean \"D\"?"),
        ("L(D|SE", 1, 1, "add \")\""),
        ("LD)E", 2, 1, "remove it"),
        ("L*", 1, 1, "L.*E"),
        ("DE", 0, 2, "begin it with L: LDE"),
        ("D+", 0, 2, "begin it with L and end it with E"),
        ("EDL", 0, 3, "L first, E last"),
        ("LLE", 0, 3, "at the ends only"),
        ("", 0, 1, "LE"),
        ("L*E", 1, 1, "L.*E"),
        ("L+*E", 1, 1, "L.*E"),
        ("L**E", 1, 1, "L.*E"),
        ("LDE?", 3, 1, "L.*E"),
        ("L'#0'*E", 5, 1, "L.*E"),
        ("L.**E", 3, 1, "one repetition is enough"),
        ("LD{2} +E", 6, 1, "(x{2})*"),
        ("L(D|)E", 3, 1, "D?"),
        ("L(|D)E", 2, 1, "D?"),
        ("LDE|", 3, 1, "both sides"),
        ("L(D||S)E", 3, 1, "D?"),
        ("L()E", 1, 2, "leave the parentheses out"),
        ("*DE", 0, 1, "behind a letter"),
        ("LD{3,1}E", 2, 5, "{2,5}"),
        ("LD{x}E", 2, 3, "{2,5}"),
        ("LD{2E", 2, 1, "{2,5}"),
        ("L<DR>E", 2, 1, "<RD>"),
        ("LRDE", 1, 1, "<RD>"),
        ("L[DE", 3, 1, "only scattering events"),
        ("L[]E", 1, 2, "[DG]"),
        ("LD'floorE", 2, 1, "single quote"),
        ("LD''E", 2, 2, "leave it out"),
        ("LE'x'", 2, 1, "labels follow"),
        ("LDC", 2, 1, "the eye is E"),
        ("LDE@found", 3, 6, "@hit or @sampled"),
        ("L(.{999}){999}E", 0, 15, "smaller numbers"),
        ("L.{4294967295}E", 0, 15, "smaller numbers"),
    ];
    for (text, at, length, help) in cases {
        let error = PathExpression::parse(text).expect_err(text);
        assert_eq!((error.at, error.length), (at, length), "{error}");
        assert!(error.help.contains(help), "{error}");
        assert!(error.to_string().contains(&format!("\n  {}^", " ".repeat(at))), "{error}");
    }
    let deep = format!("L{}D{}E", "(".repeat(80), ")".repeat(80));
    assert!(PathExpression::parse(&deep).unwrap_err().message.contains("parentheses"));
}

#[test]
fn labels_that_nothing_has_are_errors_with_a_suggestion() {
    let compile = |text: &str| {
        let expression = PathExpression::parse(text).unwrap_or_else(|e| panic!("{e}"));
        PathAutomaton::with_names(&[expression], &names()).map(|a| a.len())
    };
    for good in ["LD'floor'E", "LD'ch*'E", "L'*dow'.*E", "L'#1'E", "L.'*'E", "L<TS'glass'>E", "L<TS>'glass'E"] {
        assert_eq!(compile(good), Ok(1), "{good}");
    }
    let error = compile("LD'flor'E").unwrap_err();
    assert_eq!((error.at, error.length, error.help.as_str()), (2, 6, "did you mean 'floor'?"));
    let error = compile("L'zzzzzzzzzz'DE").unwrap_err();
    assert!(error.help.contains("lights are called #0, #1, #2, diffuse"), "{error}");
    assert!(compile("LD'window'E").is_err(), "a light's name is no surface's");
}

#[test]
fn stars_in_labels_stand_for_anything() {
    let cases = [
        ("wall", "wall", true),
        ("wall", "walls", false),
        ("wall*", "wall left", true),
        ("*left", "wall left", true),
        ("w*l*t", "wall left", true),
        ("w*x*t", "wall left", false),
        ("a*a", "a", false),
        ("*", "", true),
    ];
    for (pattern, name, fits) in cases {
        assert_eq!(Label { pattern: pattern.into(), at: 0 }.matches(name), fits, "{pattern} {name}");
    }
}

#[test]
fn hits_and_samples_are_told_apart() {
    let list = ["L.*E", "L.*E @hit", "L.*E@sampled"].map(|t| PathExpression::parse(t).unwrap());
    let automaton = PathAutomaton::with_names(&list, &names()).unwrap();
    let found = |technique| {
        let mut found = Vec::new();
        automaton.for_each_match(automaton.start(), LightId(0), technique, |e| found.push(e));
        found
    };
    assert_eq!((found(Technique::Hit), found(Technique::LightSample)), (vec![0, 1], vec![0, 2]));
}
