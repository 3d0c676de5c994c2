//! Files that are wrong on purpose: each gives the error that its first line expects, at that place, with help.

use irradiant_formats::{FileAssets, read_pbrt};
use irradiant_scene::{Diagnostic, Severity};
use std::path::Path;

#[test]
fn every_broken_file_gives_a_located_and_helpful_error() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/broken");
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files.retain(|f| f.extension().is_some_and(|e| e == "pbrt"));
    assert!(files.len() >= 90);
    let mut failures = String::new();
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let expected: Vec<&str> = text.lines().next().unwrap().split_whitespace().collect();
        let ["#", "expect", code, "line", line] = expected[..] else { panic!("{name}: no expectation") };
        let parsed = read_pbrt(&name, text.as_bytes().into(), &FileAssets::below(&folder));
        let errors: Vec<&Diagnostic> = parsed.diagnostics.iter().filter(|d| d.severity == Severity::Error).collect();
        let shown: String = errors.iter().map(|d| d.render(&parsed.sources)).collect();
        let first = errors.first().unwrap_or_else(|| panic!("{name}: no error"));
        let place = parsed.sources.locate(first.labels[0].0).unwrap_or_else(|| panic!("{name}: no place"));
        let mut check = |right: bool, what: &str| {
            if !right {
                failures += &format!("{name}: {what}\n{shown}");
            }
        };
        check(first.code == code, "another code");
        check(place.0.to_string() == line, "another line");
        // One mistake, one error: no cascades.
        check(errors.len() == 1 + usize::from(name == "crossed-nesting.pbrt"), "a cascade");
        let speaks = first.help.is_some() || first.labels.iter().any(|l| !l.1.is_empty()) || first.message.len() > 20;
        check(speaks, "too short");
        check(first.missing_file == name.starts_with("missing-"), "missing file");
        let help = first.help.as_deref().unwrap_or_default();
        check(!name.starts_with("misspelt-") || help.starts_with("did you mean"), "no suggestion");
        check(!name.starts_with("v3-") || parsed.diagnostics.iter().any(|d| d.code == "N0601"), "not seen as v3");
    }
    assert!(failures.is_empty(), "{failures}");
}
