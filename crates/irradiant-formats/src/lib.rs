//! Scene and mesh files in: pbrt-v4 text, PLY.
//!
//! # Layout
//! [`FORMATS`] lists what can be read; [`pbrt`] is the native language; [`mesh`] holds what several formats share;
//! [`files`] reads from disk and is the only place that does. A reader never fails: it returns a [`Parsed`] with the
//! description that it understood and all that it has to complain about, located.
//!
//! Knows nothing of rendering: values are checked for form, count and reference; ranges that matter to a model are
//! checked when the scene is compiled.
#![forbid(unsafe_code)]

pub mod files;
pub mod mesh;
pub mod pbrt;

pub use files::FileAssets;
pub use pbrt::{read_pbrt, read_pbrt_with};

use irradiant_scene::{Assets, Diagnostics, SceneDesc, Sources};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file format of scenes.
pub trait Format: Sync {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// How its files' names end, in lower case without the first dot.
    fn extensions(&self) -> &'static [&'static str];
    /// Understands a text as far as possible; `main` is its name in messages.
    fn read(&self, main: &str, text: Arc<[u8]>, assets: &dyn Assets) -> Parsed;
}

/// All formats that can be read; the first is the native one.
pub const FORMATS: &[&dyn Format] = &[&pbrt::Pbrt];

/// The format of a file by its name; names that say nothing are taken for pbrt-v4.
pub fn format_of(path: &Path) -> &'static dyn Format {
    let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let ends = |f: &&&dyn Format| f.extensions().iter().any(|e| name.ends_with(&format!(".{e}")));
    *FORMATS.iter().find(ends).unwrap_or(&FORMATS[0])
}

/// What a reader made of a scene.
#[derive(Clone, Debug, Default)]
pub struct Parsed {
    /// What the author said, as far as it was understood; to be used only when there are no errors.
    pub desc: SceneDesc,
    /// The texts that spans point into, the main one first.
    pub sources: Sources,
    /// Everything that is wrong or not honoured.
    pub diagnostics: Diagnostics,
    /// The other files that were read, in the order of their first use.
    pub assets_read: Vec<AssetRead>,
}

/// A file that a reader has read: with the main text, what determines the scene. Images are read later.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetRead {
    /// As the scene wrote it.
    pub name: String,
    /// As it was resolved.
    pub path: PathBuf,
    /// Bytes, after decompression by the assets.
    pub length: u64,
    /// Hash of those bytes.
    pub hash: u64,
}

/// How much a scene may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one file, decompressed.
    pub max_file_bytes: u64,
    /// Bytes of scene text in total, counting a file each time that it is included.
    pub max_total_bytes: u64,
    /// Includes within includes.
    pub max_includes: usize,
    /// `AttributeBegin`s and `ObjectBegin`s within one another.
    pub max_nesting: usize,
    /// Triangles of one subdivided mesh.
    pub max_subdivided_faces: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_file_bytes: FileAssets::MAX_FILE_BYTES,
            max_total_bytes: 16 << 30,
            max_includes: 64,
            max_nesting: 4096,
            max_subdivided_faces: 1 << 24,
        }
    }
}
