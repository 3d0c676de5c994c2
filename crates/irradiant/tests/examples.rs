//! The examples run. `cargo test` builds them beside the tests.

use std::process::Command;

#[test]
fn the_first_image_is_written() {
    writes("01_first_image", &["first_image.exr", "first_image.png"]);
}

#[test]
fn the_layers_are_written() {
    writes("02_layers", &["layers.exr", "layers.png"]);
}

/// Runs an example in a folder of its own.
fn writes(name: &str, files: &[&str]) {
    let mut program = std::env::current_exe().expect("a test has a path");
    program.pop();
    program.pop();
    let program = program.join("examples").join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    if !program.exists() {
        eprintln!("SKIPPED: {} is not built; run `cargo test` without --test", program.display());
        return;
    }
    let folder = std::env::temp_dir().join(format!("irradiant-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let output = Command::new(program).current_dir(&folder).output().expect("the example starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for name in files {
        assert!(std::fs::metadata(folder.join(name)).is_ok_and(|m| m.len() > 1000), "{name}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
