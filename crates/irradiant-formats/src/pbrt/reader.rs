//! What every part of the reader shares: where complaints go, and where bytes come from.

use crate::files::gunzip;
use crate::{AssetRead, Limits};
use irradiant_math::hash::hash_bytes;
use irradiant_scene::desc::{FileDesc, MeshData};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{AssetError, Assets, Diagnostic, Diagnostics, FileId, Sources, Span, Spanned};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

type Cache<T> = RefCell<BTreeMap<PathBuf, Option<T>>>;

/// The shared part of one run of the reader.
pub(crate) struct Reader<'a> {
    assets: &'a dyn Assets,
    pub limits: Limits,
    diagnostics: RefCell<Diagnostics>,
    sources: RefCell<Sources>,
    reads: RefCell<Vec<AssetRead>>,
    pub texts: Cache<(FileId, Arc<[u8]>)>,
    pub meshes: Cache<Arc<MeshData>>,
    pub spectra: Cache<Arc<[(f32, f32)]>>,
    v3: RefCell<Option<Span>>,
    broken: RefCell<BTreeSet<String>>,
}

impl<'a> Reader<'a> {
    pub fn new(assets: &'a dyn Assets, limits: Limits) -> Self {
        Self {
            assets,
            limits,
            diagnostics: RefCell::default(),
            sources: RefCell::default(),
            reads: RefCell::default(),
            texts: RefCell::default(),
            meshes: RefCell::default(),
            spectra: RefCell::default(),
            v3: RefCell::default(),
            broken: RefCell::default(),
        }
    }

    pub fn into_parts(self) -> (Sources, Diagnostics, Vec<AssetRead>) {
        let mut diagnostics = self.diagnostics.into_inner();
        diagnostics.sort();
        if let Some(span) = self.v3.into_inner() {
            diagnostics.push(
                Diagnostic::new(
                    irradiant_scene::Severity::Note,
                    "N0601",
                    "this looks like a pbrt-v3 file; Irradiant reads pbrt-v4",
                    span,
                )
                .help("pbrt-v4 converts most of a v3 file: pbrt --upgrade old.pbrt > new.pbrt"),
            );
        }
        (self.sources.into_inner(), diagnostics, self.reads.into_inner())
    }

    pub fn push(&self, diagnostic: Diagnostic) {
        self.diagnostics.borrow_mut().push(diagnostic);
    }

    pub fn error(&self, code: &'static str, message: impl Into<String>, span: Span) {
        self.push(Diagnostic::error(code, message, span));
    }

    /// An error with what to try.
    pub fn error_help(&self, code: &'static str, message: impl Into<String>, span: Span, help: impl Into<String>) {
        self.push(Diagnostic::error(code, message, span).help(help));
    }

    pub fn warning(&self, code: &'static str, message: impl Into<String>, span: Span) {
        self.push(Diagnostic::warning(code, message, span));
    }

    /// Something known from pbrt-v3, with what it became.
    pub fn v3(&self, code: &'static str, message: impl Into<String>, span: Span, help: impl Into<String>) {
        self.v3.borrow_mut().get_or_insert(span);
        self.error_help(code, message, span, help);
    }

    /// Remembers a name whose definition could not be read, so that its uses are not errors too.
    pub fn defined_wrongly(&self, name: &str) {
        self.broken.borrow_mut().insert(name.into());
    }

    /// True for a name whose definition could not be read.
    pub fn is_defined_wrongly(&self, name: &str) -> bool {
        self.broken.borrow().contains(name)
    }

    /// An unknown word where one of `candidates` should stand.
    pub fn unknown(&self, code: &'static str, what: &str, word: &Spanned<String>, candidates: &[&str]) {
        let help = match did_you_mean(word, candidates.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None if candidates.is_empty() => "none is defined".into(),
            None if candidates.len() <= 24 => format!("known: {}", candidates.join(", ")),
            None => format!("for example: {}", candidates[..12].join(", ")),
        };
        self.error_help(code, format!("unknown {what} \"{}\"", word.value), word.span, help);
    }

    pub fn gave_up(&self) -> bool {
        self.diagnostics.borrow().error_count() >= Diagnostics::MAX_ERRORS
    }

    pub fn add_source(&self, name: &str, text: Arc<[u8]>) -> FileId {
        self.sources.borrow_mut().add(name, text)
    }

    pub fn resolve(&self, name: &str) -> PathBuf {
        self.assets.resolve(name)
    }

    pub fn assets_lack(&self, path: &Path) -> bool {
        !self.assets.exists(path)
    }

    /// The bytes of a file that the scene names at `span`, decompressed; an error is reported and gives `None`.
    pub fn bytes(&self, what: &str, name: &str, path: &Path, span: Span) -> Option<Arc<[u8]>> {
        let read = self.assets.read(path).and_then(|bytes| {
            self.reads.borrow_mut().push(AssetRead {
                name: name.into(),
                path: path.into(),
                length: bytes.len() as u64,
                hash: hash_bytes(&bytes),
            });
            gunzip(bytes, self.limits.max_file_bytes)
        });
        match read {
            Ok(bytes) => Some(bytes),
            Err(error) => {
                self.file_error(what, name, path, span, &error);
                None
            }
        }
    }

    fn file_error(&self, what: &str, name: &str, path: &Path, span: Span, error: &AssetError) {
        let diagnostic = match error {
            AssetError::NotFound => {
                Diagnostic::error("E1001", format!("{what} \"{name}\" does not exist"), span).missing()
            }
            _ => Diagnostic::error("E1002", format!("{what} \"{name}\": {error}"), span),
        };
        let help = format!("tried {}; names are relative to the folder of the scene's main file", path.display());
        self.push(diagnostic.help(help));
    }

    /// A file that the renderer will read later: it must exist now, so that its error has a place.
    pub fn file(&self, what: &str, name: Spanned<String>) -> Spanned<FileDesc> {
        let path = self.resolve(&name);
        if !self.assets.exists(&path) {
            self.file_error(what, &name, &path, name.span, &AssetError::NotFound);
        }
        name.map(|name| FileDesc { name, path })
    }
}
