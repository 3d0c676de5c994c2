//! What can be wrong with an image file or with a request.

use std::fmt;
use std::path::PathBuf;

/// Why an image could not be read or written.
#[derive(Debug)]
pub enum ImageError {
    /// The bytes contradict their format.
    Invalid {
        /// What was found and what was expected.
        what: String,
        /// Where in the file, in bytes from its start, if known.
        offset: Option<u64>,
    },
    /// Well formed as far as we can tell, but a kind that this crate does not handle.
    Unsupported {
        /// Which kind.
        what: String,
    },
    /// The picture would take more memory than the caller or the file's own size allows.
    TooLarge {
        /// Bytes that the header asks for.
        needed: u64,
        /// Bytes that would have been allowed.
        allowed: u64,
    },
    /// The file system refused.
    Io {
        /// Which file.
        path: PathBuf,
        /// What it said.
        error: std::io::Error,
    },
}

impl ImageError {
    /// An [`ImageError::Invalid`] without a place.
    pub(crate) fn invalid(what: impl Into<String>) -> Self {
        Self::Invalid { what: what.into(), offset: None }
    }

    /// An [`ImageError::Invalid`] at a byte offset.
    pub(crate) fn invalid_at(offset: usize, what: impl Into<String>) -> Self {
        Self::Invalid { what: what.into(), offset: Some(offset as u64) }
    }

    /// An [`ImageError::Unsupported`].
    pub(crate) fn unsupported(what: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into() }
    }
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid { what, offset: Some(at) } => write!(f, "invalid image: {what} (at byte {at})"),
            Self::Invalid { what, offset: None } => write!(f, "invalid image: {what}"),
            Self::Unsupported { what } => write!(f, "unsupported image: {what}"),
            Self::TooLarge { needed, allowed } => {
                write!(f, "image too large: it needs {needed} bytes, {allowed} are allowed")
            }
            Self::Io { path, error } => write!(f, "{}: {}", path.display(), plain_reason(error)),
        }
    }
}

/// Why the file system refused, in words that are the same wherever the program runs; what has none here as the system says it.
pub fn plain_reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".into(),
        std::io::ErrorKind::IsADirectory => "it is a folder".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => error.to_string(),
    }
}

impl std::error::Error for ImageError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { error, .. } => Some(error),
            Self::Invalid { .. } | Self::Unsupported { .. } | Self::TooLarge { .. } => None,
        }
    }
}
