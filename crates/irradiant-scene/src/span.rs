//! Where in which file something was said: byte offsets; line and column are computed only to print.

use std::sync::Arc;

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
}

/// The texts that spans point into.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<Source>,
}

impl Sources {
    /// Adds a text.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<Arc<[u8]>>) -> FileId {
        self.files.push(Source { name: name.into(), text: text.into() });
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

    /// Line and column (both from 1; the column counts characters) of the start of a span, with the line's text.
    pub fn locate(&self, span: Span) -> Option<(usize, usize, String)> {
        let text = &self.get(span.file)?.text;
        let start = (span.start as usize).min(text.len());
        let line_start = text[..start].iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        let line_end = text[start..].iter().position(|&b| b == b'\n').map_or(text.len(), |i| start + i);
        let line = text[..line_start].iter().filter(|&&b| b == b'\n').count() + 1;
        let column = String::from_utf8_lossy(&text[line_start..start]).chars().count() + 1;
        Some((line, column, String::from_utf8_lossy(&text[line_start..line_end]).into_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_located_by_line_and_character() {
        let mut sources = Sources::default();
        let file = sources.add("a.pbrt", "first\nzwölf \"x\"\n".as_bytes());
        let (line, column, text) = sources.locate(Span { file, start: 13, end: 16 }).unwrap();
        assert_eq!((line, column, text.as_str()), (2, 7, "zwölf \"x\""));
        assert!(sources.locate(Span::NONE).is_none());
    }
}
