//! Complaints that speak to the author: what was found, where, what was expected, what to try.

use crate::span::{Sources, Span};
use std::borrow::Cow;
use std::fmt::Write as _;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; the picture is what the author asked for.
    Note,
    /// The picture is not quite what the author asked for (an error under `--strict`).
    Warning,
    /// No picture.
    Error,
}

/// One complaint.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Stable code, `E0101` for errors, `W0201` for warnings.
    pub code: &'static str,
    /// What was found.
    pub message: String,
    /// Places, the main one first, each with what is to be said there (may be empty).
    pub labels: Vec<(Span, String)>,
    /// What to try.
    pub help: Option<String>,
    /// Set for scene content that is rendered as a stand-in or left out: a short name of the kind, listed once per
    /// kind in the image's header ("medium: vacuum").
    pub not_honoured: Option<String>,
    /// Set when a file is missing (exit code 66 instead of 65).
    pub missing_file: bool,
}

impl Diagnostic {
    /// An error at a place.
    pub fn error(code: &'static str, message: impl Into<String>, span: Span) -> Self {
        Self::new(Severity::Error, code, message, span)
    }

    /// A warning at a place.
    pub fn warning(code: &'static str, message: impl Into<String>, span: Span) -> Self {
        Self::new(Severity::Warning, code, message, span)
    }

    /// A complaint of any severity.
    pub fn new(severity: Severity, code: &'static str, message: impl Into<String>, span: Span) -> Self {
        Self {
            severity,
            code,
            message: message.into(),
            labels: vec![(span, String::new())],
            help: None,
            not_honoured: None,
            missing_file: false,
        }
    }

    /// With the text that stands under the caret.
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.labels[0].1 = text.into();
        self
    }

    /// With one more place.
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push((span, text.into()));
        self
    }

    /// With what to try.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// Marked as scene content that is not honoured.
    pub fn not_honoured(mut self, kind: impl Into<String>) -> Self {
        self.not_honoured = Some(kind.into());
        self
    }

    /// Marked as a missing file.
    pub fn missing(mut self) -> Self {
        self.missing_file = true;
        self
    }

    /// As text for a terminal: message, file:line:column, the line with a caret, help.
    pub fn render(&self, sources: &Sources) -> String {
        let word = match self.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        let mut out = format!("{word}[{}]: {}\n", self.code, printable(&self.message));
        for (span, text) in &self.labels {
            let Some((line, column)) = sources.locate(*span) else { continue };
            let name = printable(sources.get(span.file).map_or("", |s| &s.name));
            let (shown, caret_at) = excerpt(sources, *span);
            let width = (span.end.saturating_sub(span.start) as usize)
                .min(shown.chars().count().saturating_sub(caret_at))
                .max(1);
            let gutter = line.to_string().len();
            let _ = writeln!(out, "{:gutter$}--> {name}:{line}:{column}", "");
            let _ = writeln!(out, "{:gutter$} |", "");
            let _ = writeln!(out, "{line} | {shown}");
            let _ =
                writeln!(out, "{:gutter$} | {:caret_at$}{} {text}", "", "", "^".repeat(width), text = printable(text));
        }
        if let Some(help) = &self.help {
            let _ = writeln!(out, "  = help: {}", printable(help));
        }
        out
    }
}

/// What a terminal would obey instead of showing it: control characters, and those that turn the direction of writing.
fn is_command(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Words of a file as they may go to a terminal: what it would obey is spelt out (`\u{1b}`); lines and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    let spelt_out = |c: char| is_command(c) && !matches!(c, '\n' | '\t');
    if !text.contains(spelt_out) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if spelt_out(c) {
            out.extend(c.escape_unicode());
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// A window of at most 100 characters of a (possibly huge) line around a span, and the caret's place in it.
fn excerpt(sources: &Sources, span: Span) -> (String, usize) {
    // A character takes four bytes at most.
    let (line, at) = sources.around(span, 400).unwrap_or_default();
    let chars: Vec<char> = line.chars().map(|c| if is_command(c) { ' ' } else { c }).collect();
    let start = if chars.len() <= 100 { 0 } else { at.saturating_sub(40) };
    let end = chars.len().min(start + 100);
    (chars[start..end].iter().collect(), at - start)
}

/// What a reader or compiler has to say: collected, so that all errors come at once.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
}

impl Diagnostics {
    /// At most this many errors are kept: a broken file can have one per token.
    pub const MAX_ERRORS: usize = 100;

    /// Adds a complaint. Beyond [`Self::MAX_ERRORS`] errors, and for repeated `not_honoured` kinds, it is dropped.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        if diagnostic.severity == Severity::Error && self.error_count() >= Self::MAX_ERRORS {
            return;
        }
        if let Some(kind) = &diagnostic.not_honoured
            && self.list.iter().any(|d| d.not_honoured.as_ref() == Some(kind))
        {
            return;
        }
        self.list.push(diagnostic);
    }

    /// Adds all of another list.
    pub fn extend(&mut self, other: Diagnostics) {
        other.list.into_iter().for_each(|d| self.push(d));
    }

    /// Puts the complaints in the order in which one reads files: by file, line and column, those without a place
    /// after them, notes last.
    pub fn sort(&mut self) {
        self.list.sort_by_key(|d| (d.severity == Severity::Note, d.labels[0].0.file, d.labels[0].0.start));
    }

    /// Number of errors.
    pub fn error_count(&self) -> usize {
        self.list.iter().filter(|d| d.severity == Severity::Error).count()
    }

    /// True when there is an error.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// The complaints, in the order they came up until they are sorted.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.list.iter()
    }

    /// The kinds of scene content that are not honoured, in the order they came up.
    pub fn not_honoured(&self) -> impl Iterator<Item = &str> {
        self.list.iter().filter_map(|d| d.not_honoured.as_deref())
    }

    /// Forgets what was not honoured of a kind that begins so: something else was asked for in its place.
    pub fn forget_not_honoured(&mut self, kind: &str) {
        self.list.retain(|d| d.not_honoured.as_ref().is_none_or(|k| !k.starts_with(kind)));
    }

    /// Makes errors of what is not honoured (`--strict`).
    pub fn promote_not_honoured(&mut self) {
        for diagnostic in &mut self.list {
            if diagnostic.not_honoured.is_some() {
                diagnostic.severity = Severity::Error;
            }
        }
    }

    /// Number of complaints.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// True when there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

/// The candidate nearest to a misspelt word, if it is near enough to be what was meant.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (word.chars().count() / 3).max(1) + 1;
    candidates
        .into_iter()
        .map(|c| (edit_distance(&word.to_lowercase(), &c.to_lowercase()), c))
        .filter(|(d, _)| *d <= limit)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Damerau-Levenshtein distance (adjacent transpositions count one), in characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut rows = vec![vec![0usize; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let substitute = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let mut best = substitute.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    best = best.min(rows[i - 2][j - 2] + 1);
                }
                best
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FileId;

    #[test]
    fn a_diagnostic_shows_the_line_and_the_caret() {
        let mut sources = Sources::default();
        let file = sources.add("s.pbrt", b"Shape \"spere\"\n".as_slice());
        let text = Diagnostic::error("E0201", "unknown shape \"spere\"", Span { file, start: 6, end: 13 })
            .help("did you mean \"sphere\"?")
            .render(&sources);
        assert!(text.contains("--> s.pbrt:1:7"), "{text}");
        assert!(text.contains("^^^^^^^"), "{text}");
        assert!(text.contains("did you mean \"sphere\"?"));
    }

    #[test]
    fn a_file_cannot_command_the_terminal() {
        let mut sources = Sources::default();
        let bytes = "Shape \"\u{1b}[2J\u{7}\u{202e}\u{9b}x\"\n";
        let file = sources.add("s\u{1b}]0;.pbrt", bytes.as_bytes());
        let word = "unknown shape \"\u{1b}[2J\u{7}\u{202e}\u{9b}x\"";
        let text = Diagnostic::error("E0201", word, Span { file, start: 6, end: 13 })
            .label("not\ra shape")
            .help("\u{8}")
            .render(&sources);
        assert!(!text.contains(|c: char| c != '\n' && is_command(c)), "{text:?}");
        assert!(text.contains(r#"unknown shape "\u{1b}[2J\u{7}\u{202e}\u{9b}x""#), "{text}");
        assert!(matches!(printable("zw\u{f6}lf\tx\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn complaints_are_read_from_top_to_bottom() {
        let at = |file, start| Span { file: FileId(file), start, end: start };
        let mut d = Diagnostics::default();
        d.push(Diagnostic::new(Severity::Note, "N", "", at(0, 0)));
        d.push(Diagnostic::error("E4", "", Span::NONE));
        for (code, span) in [("E3", at(1, 0)), ("E2", at(0, 9)), ("E1", at(0, 3))] {
            d.push(Diagnostic::error(code, "", span));
        }
        d.push(Diagnostic::warning("W", "", at(0, 4)));
        d.sort();
        assert_eq!(d.iter().map(|d| d.code).collect::<Vec<_>>(), ["E1", "W", "E2", "E3", "E4", "N"]);
    }

    #[test]
    fn near_words_are_suggested_and_far_ones_are_not() {
        assert_eq!(did_you_mean("spere", ["sphere", "disk"]), Some("sphere"));
        assert_eq!(did_you_mean("relfectance", ["reflectance"]), Some("reflectance"));
        assert_eq!(did_you_mean("banana", ["sphere", "disk"]), None);
    }

    #[test]
    fn endless_errors_are_cut_and_kinds_are_said_once() {
        let mut d = Diagnostics::default();
        for _ in 0..1000 {
            d.push(Diagnostic::error("E0001", "x", Span::NONE));
            d.push(Diagnostic::warning("W0001", "y", Span::NONE).not_honoured("medium: vacuum"));
        }
        assert_eq!(d.error_count(), Diagnostics::MAX_ERRORS);
        assert_eq!(d.not_honoured().count(), 1);
        d.forget_not_honoured("integrator ");
        assert_eq!(d.not_honoured().count(), 1);
        d.forget_not_honoured("medium");
        assert_eq!((d.not_honoured().count(), d.error_count()), (0, Diagnostics::MAX_ERRORS));
    }
}
