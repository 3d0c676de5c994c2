//! What can go wrong, split by who can fix it.

use irradiant_image::ImageError;
use irradiant_image::error::plain_reason;
use irradiant_scene::{Diagnostics, Severity, Sources};
use std::path::PathBuf;

/// Complaints about a scene with the texts that they point into.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The complaints.
    pub diagnostics: Diagnostics,
    /// The texts.
    pub sources: Sources,
}

impl Report {
    /// True when a file that the scene mentions is missing.
    pub fn missing_file(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error && d.missing_file)
    }

    /// True when every error is about a missing file.
    pub fn only_missing_files(&self) -> bool {
        self.missing_file() && self.diagnostics.iter().all(|d| d.severity != Severity::Error || d.missing_file)
    }
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for diagnostic in self.diagnostics.iter() {
            writeln!(f, "{}", diagnostic.render(&self.sources))?;
        }
        let count = |s| self.diagnostics.iter().filter(|d| d.severity == s).count();
        match (count(Severity::Error), count(Severity::Warning)) {
            (0, 0) => Ok(()),
            (0, w) => write!(f, "{}", plural(w, "warning")),
            (e, w) => {
                let more = if e >= Diagnostics::MAX_ERRORS { " (what comes after them was not looked at)" } else { "" };
                let warnings = if w > 0 { format!(", {}", plural(w, "warning")) } else { String::new() };
                write!(f, "{}{more}{warnings}", plural(e, "error"))
            }
        }
    }
}

fn plural(n: usize, word: &str) -> String {
    format!("{n} {word}{}", if n == 1 { "" } else { "s" })
}

impl From<irradiant_render::registry::ChoiceError> for Error {
    fn from(why: irradiant_render::registry::ChoiceError) -> Self {
        Self::Settings(why.to_string())
    }
}

/// Why there is no picture.
///
/// `Debug` is `Display`: a `main` that returns this prints what a person can read.
pub enum Error {
    /// The scene is wrong: its author can fix it. The report says where.
    Scene(Box<Report>),
    /// The scene file itself cannot be read.
    Unreadable {
        /// Which.
        path: PathBuf,
        /// Why.
        why: std::io::Error,
    },
    /// A setting is wrong: the caller can fix it.
    Settings(String),
    /// The picture could not be written.
    Output {
        /// Where to.
        path: PathBuf,
        /// Why.
        why: ImageError,
    },
    /// A bug in Irradiant.
    Internal(String),
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene(report) => write!(f, "{report}"),
            Self::Unreadable { path, why } => write!(f, "cannot read {}: {}", path.display(), plain_reason(why)),
            Self::Settings(what) => write!(f, "{what}"),
            Self::Output { path, why } => write!(f, "cannot write {}: {why}", path.display()),
            Self::Internal(what) => write!(f, "a bug in Irradiant: {what}"),
        }
    }
}

impl std::fmt::Debug for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self}")
    }
}

impl std::error::Error for Error {}
