//! Every deliberately broken file through the program: exit code 65 (66 where a file is missing), a located message that
//! helps, no picture, no panic.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn broken_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../irradiant-formats/tests/broken");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|why| panic!("{}: {why}", folder.display()));
    let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "pbrt"));
    files.sort();
    files
}

#[test]
fn every_broken_file_ends_in_65_or_66_with_a_place() {
    let files = broken_files();
    assert!(files.len() >= 90, "{} files", files.len());
    let folder = std::env::temp_dir().join(format!("irradiant-broken-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap_or_else(|why| panic!("{why}"));
    let mut failures = String::new();
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(file).unwrap_or_else(|why| panic!("{name}: {why}"));
        // "# expect E0301 line 4"
        let expected: Vec<&str> = text.lines().next().unwrap_or_default().split_whitespace().collect();
        let ["#", "expect", code, "line", line] = expected[..] else { panic!("{name}: no expectation") };
        let mut command = Command::new(env!("CARGO_BIN_EXE_irradiant"));
        command.args(["render", "--quiet", "--spp", "1"]).arg(file).current_dir(&folder).stdin(Stdio::null());
        let output = command.output().unwrap_or_else(|why| panic!("{why}"));
        let said = String::from_utf8_lossy(&output.stderr);
        let exit = if name.starts_with("missing-") { 66 } else { 65 };
        let right = output.status.code() == Some(exit)
            && said.contains(&format!("error[{code}]: "))
            && said.contains(&format!("{name}:{line}:"))
            && said.contains('^')
            // One mistake, one error, though compiling had its say too.
            && said.matches("error[").count() == 1 + usize::from(name == "crossed-nesting.pbrt")
            && !said.contains("panicked")
            && output.stdout.is_empty();
        if !right {
            let _ = writeln!(
                failures,
                "{name}: exit {:?}, wanted {exit} with {code} at line {line}\n{said}",
                output.status.code()
            );
        }
    }
    let left: Vec<_> = std::fs::read_dir(&folder).map(|e| e.flatten().map(|e| e.path()).collect()).unwrap_or_default();
    let _ = std::fs::remove_dir_all(&folder);
    assert!(failures.is_empty(), "{failures}");
    assert!(left.is_empty(), "pictures of broken scenes: {left:?}");
}
