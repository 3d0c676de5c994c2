//! Bytes by name: how readers and the compiler reach files without knowing of file systems.

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why an asset could not be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AssetError {
    /// Nothing there.
    NotFound,
    /// There, but reading failed or is not allowed.
    Unreadable(String),
    /// Larger than the reader allows.
    TooLarge {
        /// Size found, bytes.
        bytes: u64,
        /// Limit, bytes.
        limit: u64,
    },
}

impl std::fmt::Display for AssetError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFound => write!(f, "no such file"),
            Self::Unreadable(why) => write!(f, "cannot be read: {why}"),
            Self::TooLarge { bytes, limit } => write!(f, "too large: {bytes} bytes, the limit is {limit}"),
        }
    }
}

impl std::error::Error for AssetError {}

/// A place that files come from: a folder, an archive, memory.
pub trait Assets: Sync {
    /// The whole content of a file. `path` is as resolved by [`Assets::resolve`].
    fn read(&self, path: &Path) -> Result<Arc<[u8]>, AssetError>;

    /// The path that a name in a scene means; relative names are relative to the
    /// scene's main file, as in pbrt-v4.
    fn resolve(&self, name: &str) -> PathBuf;

    /// True when there is a file to read; cheaper than reading it where the place allows.
    fn exists(&self, path: &Path) -> bool {
        self.read(path).is_ok()
    }
}

/// Assets in memory, for tests and for scenes that a program builds.
#[derive(Clone, Debug, Default)]
pub struct MemoryAssets {
    files: std::collections::BTreeMap<PathBuf, Arc<[u8]>>,
}

impl MemoryAssets {
    /// Adds a file.
    pub fn with(mut self, name: impl Into<PathBuf>, bytes: impl Into<Arc<[u8]>>) -> Self {
        self.files.insert(name.into(), bytes.into());
        self
    }
}

impl Assets for MemoryAssets {
    fn read(&self, path: &Path) -> Result<Arc<[u8]>, AssetError> {
        self.files.get(path).cloned().ok_or(AssetError::NotFound)
    }

    fn resolve(&self, name: &str) -> PathBuf {
        PathBuf::from(name)
    }
}
