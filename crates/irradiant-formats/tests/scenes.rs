//! Real scenes by others, where they are at hand.

use irradiant_formats::{FileAssets, read_pbrt};
use irradiant_scene::Severity;
use std::path::{Path, PathBuf};

/// The folder of scenes beside the repository, if it is there.
fn scenes() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if root.is_dir() {
        return Some(root);
    }
    eprintln!("SKIPPED: no scenes at {}", root.display());
    None
}

fn pbrt_files(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            pbrt_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "pbrt") {
            out.push(path);
        }
    }
}

#[test]
fn real_scenes_are_read_without_errors() {
    let Some(root) = scenes() else { return };
    let mut files = vec![];
    pbrt_files(&root, &mut files);
    assert!(files.len() > 30);
    // Fragments that others include, and one that is wrong on purpose.
    let not_scenes = ["killeroo.pbrt", "killeroo3.pbrt", "sequence.pbrt", "density_smoke.70.pbrt", "mix_material.pbrt"];
    let mut failures = String::new();
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read(&path).unwrap();
        let parsed = read_pbrt(&name, text.into(), &FileAssets::beside(&path));
        if name == "mix_material.pbrt" {
            let errors: Vec<_> = parsed.diagnostics.iter().filter(|d| d.severity == Severity::Error).collect();
            assert_eq!(errors.len(), 1);
            let text = errors[0].render(&parsed.sources);
            assert!(text.contains("E0306") && text.contains("mix_material.pbrt:28:"), "{text}");
        }
        if not_scenes.contains(&name.as_str()) {
            continue;
        }
        for d in parsed.diagnostics.iter() {
            if d.severity == Severity::Error {
                failures += &format!("{}: {}", path.display(), d.render(&parsed.sources));
            }
        }
        if !parsed.diagnostics.is_empty() {
            eprintln!("{name}: {}", parsed.diagnostics.iter().map(|d| d.render(&parsed.sources)).collect::<String>());
        }
        let n = parsed.desc.shapes.len() + parsed.desc.instances.len();
        assert!(n > 0 || name.contains("sky"), "{name} holds nothing");
    }
    assert!(failures.is_empty(), "{failures}");
}
