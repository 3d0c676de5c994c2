//! Where in which file something was said: byte offsets; line and column are computed only to print.

use std::sync::{Arc, OnceLock};

/// Index of a source text in [`Sources`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

/// A range of bytes in a source text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The text.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// Of things that no file said: defaults, and scenes built by a program.
    pub const NONE: Self = Self { file: FileId(u32::MAX), start: 0, end: 0 };

    /// From the start of `self` to the end of `other` (same file).
    pub fn to(self, other: Span) -> Self {
        Self { end: other.end.max(self.end), ..self }
    }
}

/// A value with the place where the author wrote it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spanned<T> {
    /// What was said.
    pub value: T,
    /// Where.
    pub span: Span,
}

impl<T> Spanned<T> {
    /// A value said at `span`.
    pub const fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }

    /// A value that no file said.
    pub const fn unplaced(value: T) -> Self {
        Self { value, span: Span::NONE }
    }

    /// The value changed, the place kept.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Spanned<U> {
        Spanned { value: f(self.value), span: self.span }
    }
}

impl<T: Default> Default for Spanned<T> {
    fn default() -> Self {
        Self::unplaced(T::default())
    }
}

impl<T> std::ops::Deref for Spanned<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

/// One source text.
#[derive(Clone, Debug)]
pub struct Source {
    /// As the user would name it: a path, or `<stdin>`.
    pub name: String,
    /// The whole text (after decompression).
    pub text: Arc<[u8]>,
    /// Where its lines begin; found when a place in it is first asked for.
    line_starts: OnceLock<Vec<u32>>,
}

impl Source {
    fn line_starts(&self) -> &[u32] {
        self.line_starts.get_or_init(|| {
            let after_breaks = self.text.iter().zip(1..).filter(|(b, _)| **b == b'\n').map(|(_, i)| i);
            std::iter::once(0).chain(after_breaks).collect()
        })
    }
}

/// The texts that spans point into.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<Source>,
}

impl Sources {
    /// Adds a text.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<Arc<[u8]>>) -> FileId {
        self.files.push(Source { name: name.into(), text: text.into(), line_starts: OnceLock::new() });
        FileId(self.files.len() as u32 - 1)
    }

    /// The text of an id; `None` for [`Span::NONE`]'s.
    pub fn get(&self, file: FileId) -> Option<&Source> {
        self.files.get(file.0 as usize)
    }

    /// All texts, in the order they were opened.
    pub fn iter(&self) -> impl Iterator<Item = &Source> {
        self.files.iter()
    }

    /// Line and column (both from 1; the column counts characters) of the start of a span.
    pub fn locate(&self, span: Span) -> Option<(usize, usize)> {
        let source = self.get(span.file)?;
        let start = (span.start as usize).min(source.text.len());
        let line = source.line_starts().partition_point(|&s| s as usize <= start);
        let line_start = source.line_starts()[line - 1] as usize;
        Some((line, characters(&source.text[line_start..start]) + 1))
    }

    /// What stands around the start of a span in its line, at most `most` bytes to each side, and how many characters of it
    /// stand before the span.
    pub fn around(&self, span: Span, most: usize) -> Option<(String, usize)> {
        let text = &self.get(span.file)?.text;
        let start = (span.start as usize).min(text.len());
        let (before, after) = (&text[start.saturating_sub(most)..start], &text[start..text.len().min(start + most)]);
        let before = before.iter().rposition(|&b| b == b'\n').map_or(before, |i| &before[i + 1..]);
        let after = after.iter().position(|&b| b == b'\n').map_or(after, |i| &after[..i]);
        let before = String::from_utf8_lossy(before);
        let count = before.chars().count();
        Some((before.into_owned() + &String::from_utf8_lossy(after), count))
    }
}

/// Characters of UTF-8 text: bytes that do not continue one. Blocks whose count fits a byte, so that many are counted at once.
fn characters(text: &[u8]) -> usize {
    text.chunks(255).map(|c| usize::from(c.iter().map(|b| u8::from((b & 0xc0) != 0x80)).sum::<u8>())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_located_by_line_and_character() {
        let mut sources = Sources::default();
        let file = sources.add("a.pbrt", "first\nzwölf \"x\"\n".as_bytes());
        let span = Span { file, start: 13, end: 16 };
        assert_eq!(sources.locate(span), Some((2, 7)));
        assert_eq!(sources.around(span, 100), Some(("zwölf \"x\"".into(), 6)));
        assert_eq!(sources.around(span, 2), Some(("f \"x".into(), 2)));
        assert!(sources.locate(Span::NONE).is_none() && sources.around(Span::NONE, 100).is_none());
        // At the very end, and beyond it.
        for start in [17, 18, 1000] {
            assert!(sources.locate(Span { file, start, end: start }).is_some(), "{start}");
        }
        assert_eq!(sources.locate(Span { file, start: 5, end: 6 }), Some((1, 6)));
        assert_eq!(sources.locate(Span { file, start: 6, end: 7 }), Some((2, 1)));
    }

    /// A scene of one line of a hundred megabytes with a hundred mistakes must not take minutes to complain.
    #[test]
    fn places_in_a_huge_line_are_found_at_once() {
        let mut sources = Sources::default();
        let file = sources.add("a.pbrt", vec![b'1'; 20_000_000]);
        for i in 0..100 {
            let start = 19_000_000 + i;
            let span = Span { file, start, end: start + 1 };
            assert_eq!(sources.locate(span), Some((1, start as usize + 1)));
            assert_eq!(sources.around(span, 50).map(|a| (a.0.len(), a.1)), Some((100, 50)));
        }
    }
}
