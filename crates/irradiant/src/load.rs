//! From a file to a description.

use crate::error::{Error, Report};
use irradiant_core::scene::{CompileOptions, Scene};
use irradiant_formats::FileAssets;
use irradiant_scene::desc::{SceneDesc, ShapeDesc, ShapeKind};
use irradiant_scene::{AssetError, Assets, Diagnostic, Diagnostics, Severity};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// A scene as it was read, with all that was said about it.
pub struct SceneFile {
    /// As the user named it.
    pub name: String,
    /// What it says.
    pub desc: SceneDesc,
    /// Complaints so far (warnings only) and the texts.
    pub report: Report,
    /// The scene is the built-in one or otherwise asks for no depth limit.
    pub(crate) unlimited_depth: bool,
    pub(crate) assets: HashingAssets,
    main_hash: blake3::Hash,
}

impl SceneFile {
    /// A hash over every byte that was read so far for this scene: the text, what it includes, meshes and, once it is
    /// compiled, images. 64 hexadecimal digits.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.main_hash.as_bytes());
        for (name, hash) in self.assets.hashes.lock().unwrap_or_else(|e| e.into_inner()).iter() {
            hasher.update(&(name.len() as u64).to_le_bytes());
            hasher.update(name.as_bytes());
            hasher.update(hash.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

/// Reads a scene file; the format follows from the extension, pbrt-v4 text by default. `-` reads standard input.
pub fn load(path: impl AsRef<Path>) -> Result<SceneFile, Error> {
    let path = path.as_ref();
    let unreadable = |why| Error::Unreadable { path: path.to_owned(), why };
    if path == Path::new("-") {
        let mut text = Vec::new();
        std::io::Read::read_to_end(&mut std::io::stdin().lock(), &mut text).map_err(unreadable)?;
        return read("<stdin>", text.into(), FileAssets::below("."), Path::new("."));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let assets = FileAssets::beside(path);
    let text = assets.read(path).map_err(|why| {
        unreadable(match why {
            AssetError::NotFound => std::io::Error::from(std::io::ErrorKind::NotFound),
            AssetError::Unreadable(why) => std::io::Error::other(why),
            other => std::io::Error::other(other.to_string()),
        })
    })?;
    read(&path.display().to_string(), text, assets, folder)
}

/// Reads a scene from text; files that it mentions are looked for in `folder`.
pub fn load_text(name: &str, text: &str, folder: impl AsRef<Path>) -> Result<SceneFile, Error> {
    read(name, text.as_bytes().into(), FileAssets::below(folder.as_ref()), folder.as_ref())
}

/// The built-in scene: the Cornell box from Cornell's measured geometry, reflectances and lamp, without depth limit.
pub fn cornell_box() -> SceneFile {
    let text = include_str!("../../../scenes/cornell-box.pbrt");
    let mut scene = read("cornell-box.pbrt", text.as_bytes().into(), FileAssets::below("."), Path::new("."))
        .unwrap_or_else(|e| unreachable!("the built-in scene is valid: {e}"));
    scene.unlimited_depth = true;
    scene
}

fn read(name: &str, text: Arc<[u8]>, files: FileAssets, folder: &Path) -> Result<SceneFile, Error> {
    let assets = HashingAssets { files, folder: folder.to_owned(), hashes: Mutex::default() };
    let main_hash = blake3::hash(&text);
    let parsed = irradiant_formats::format_of(Path::new(name)).read(name, text, &assets);
    let mut report = Report { diagnostics: parsed.diagnostics, sources: parsed.sources };
    if report.diagnostics.has_errors() {
        let more = errors_of_compiling(parsed.desc, &report);
        report.diagnostics.extend(more);
        report.diagnostics.sort();
        return Err(Error::Scene(Box::new(report)));
    }
    Ok(SceneFile { name: name.to_owned(), desc: parsed.desc, report, unlimited_depth: false, assets, main_hash })
}

/// What compiling would refuse in a scene that reading has refused already, so that an author sees all mistakes at once.
///
/// Meshes and images are left out: nobody wants to wait for them. So is what has no place, and what is wrong in a line of
/// which reading has complained: it would be the same mistake in other words.
fn errors_of_compiling(mut desc: SceneDesc, told: &Report) -> Diagnostics {
    struct NoFiles;
    impl Assets for NoFiles {
        fn read(&self, _: &Path) -> Result<Arc<[u8]>, AssetError> {
            Err(AssetError::NotFound)
        }
        fn resolve(&self, name: &str) -> PathBuf {
            PathBuf::from(name)
        }
        fn exists(&self, _: &Path) -> bool {
            false
        }
    }
    let quick = |s: &ShapeDesc| !matches!(s.kind, ShapeKind::Mesh(_));
    desc.shapes.retain(quick);
    desc.objects.iter_mut().for_each(|o| o.shapes.retain(quick));
    let line = |d: &Diagnostic| told.sources.locate(d.labels[0].0).map(|l| (d.labels[0].0.file, l.0));
    let lines: Vec<_> = told.diagnostics.iter().map(line).collect();
    let compiled = Scene::compile(&desc, &NoFiles, &CompileOptions::default());
    let mut errors = Diagnostics::default();
    for d in compiled.diagnostics.iter() {
        let at = line(d);
        if d.severity == Severity::Error && !d.missing_file && at.is_some() && !lines.contains(&at) {
            errors.push(d.clone());
        }
    }
    errors
}

/// Files, with a hash of each that was read: two renders whose hashes differ are of different scenes.
pub(crate) struct HashingAssets {
    files: FileAssets,
    folder: PathBuf,
    hashes: Mutex<BTreeMap<String, blake3::Hash>>,
}

impl Assets for HashingAssets {
    fn read(&self, path: &Path) -> Result<Arc<[u8]>, AssetError> {
        let bytes = self.files.read(path)?;
        // Named relative to the scene, so that a moved folder is still the same scene.
        let name = path.strip_prefix(&self.folder).unwrap_or(path).to_string_lossy().replace('\\', "/");
        self.hashes.lock().unwrap_or_else(|e| e.into_inner()).insert(name, blake3::hash(&bytes));
        Ok(bytes)
    }

    fn resolve(&self, name: &str) -> PathBuf {
        self.files.resolve(name)
    }

    fn exists(&self, path: &Path) -> bool {
        self.files.exists(path)
    }
}
