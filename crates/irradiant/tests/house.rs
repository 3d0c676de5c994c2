//! The house keeps its own rules: ARCHITECTURE.md, STYLE.md and the guide say what is true of the tree.
//!
//! Plain std, reads the sources as text. Every check prints all that it found, not the first.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Lines of one source file at most; generated tables are exempt.
const MAX_LINES: usize = 900;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn text(path: &Path) -> String {
    let bytes = fs::read(path).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
    // Checked out with other line ends, a file is still the same.
    String::from_utf8(bytes).unwrap_or_else(|_| panic!("{}: not UTF-8", path.display())).replace("\r\n", "\n")
}

/// Path from the root, with slashes on every platform.
fn name(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).to_string_lossy().replace('\\', "/")
}

/// All files below a folder of the root that end so, in order.
fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    fn walk(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) {
        let Ok(entries) = fs::read_dir(folder) else { return };
        for path in entries.flatten().map(|e| e.path()) {
            if path.is_dir() {
                if !path.ends_with("target") && !path.ends_with(".git") {
                    walk(&path, ending, found);
                }
            } else if path.to_string_lossy().ends_with(ending) {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join(folder), ending, &mut found);
    found.sort();
    found
}

fn crates() -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(root().join("crates"))
        .expect("crates/")
        .flatten()
        .filter(|e| e.path().join("Cargo.toml").is_file())
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn markdown() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(root())
        .expect("the root")
        .flatten()
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
        .collect();
    found.extend(files("docs", ".md"));
    found.extend(files("crates", ".md"));
    found.extend(files("bench", ".md"));
    found.sort();
    found
}

/// Words in backticks outside of fenced blocks.
fn code_words(text: &str) -> Vec<&str> {
    let mut fenced = false;
    let mut words = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            words.extend(line.split('`').skip(1).step_by(2));
        }
    }
    words
}

fn assert_none(what: &str, mut found: Vec<String>) {
    found.sort();
    found.dedup();
    assert!(found.is_empty(), "{what}:\n  {}", found.join("\n  "));
}

/// `| 3 | `irradiant-core` | ...` of ARCHITECTURE.md: crate to floor.
fn floors() -> BTreeMap<String, u32> {
    let map = text(&root().join("ARCHITECTURE.md"));
    let row = |line: &str| {
        let mut cells = line.strip_prefix('|')?.split('|').map(str::trim);
        let floor = cells.next()?.parse().ok()?;
        let name = cells.next()?.trim_matches('`').to_string();
        Some((name, floor))
    };
    map.lines().filter_map(row).collect()
}

/// One dependency of a manifest.
struct Dependency {
    name: String,
    dev: bool,
    explained: bool,
    line: usize,
}

fn dependencies(manifest: &str) -> Vec<Dependency> {
    let mut section = "";
    let mut commented = false;
    let mut found = Vec::new();
    for (i, line) in manifest.lines().map(str::trim).enumerate() {
        if line.starts_with('[') {
            section = line;
        }
        // `[target.'cfg(...)'.dependencies]` counts too.
        let dev = section.ends_with("dev-dependencies]");
        let applies = section.ends_with("dependencies]") && section != "[workspace.dependencies]";
        if applies && !line.is_empty() && !line.starts_with(['#', '[']) {
            let name: String =
                line.chars().take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_')).collect();
            found.push(Dependency { name, dev, explained: commented, line: i + 1 });
        }
        commented = line.starts_with('#');
    }
    found
}

#[test]
fn the_map_names_every_crate_and_folder_and_no_other() {
    let map = text(&root().join("ARCHITECTURE.md"));
    let words = code_words(&map);
    let mut wrong = Vec::new();
    for word in &words {
        let is_path = ["crates/", "docs/", "scenes/", "bench/", ".ci/"].iter().any(|p| word.starts_with(p));
        if is_path && !word.contains(['*', '<', ' ']) && !root().join(word).exists() {
            wrong.push(format!("named and not there: {word}"));
        }
    }
    let floors = floors();
    for name in crates() {
        if !floors.contains_key(&name) {
            wrong.push(format!("not in the table of floors: {name}"));
        }
    }
    for name in floors.keys() {
        if !root().join("crates").join(name).is_dir() {
            wrong.push(format!("in the table of floors and not there: {name}"));
        }
    }
    let said: BTreeSet<&str> = words.iter().map(|w| w.trim_end_matches('/')).collect();
    for file in files("crates", ".rs") {
        let name = name(&file);
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        let parts = folder.matches('/').count();
        let is_tests = folder.ends_with("/tests");
        if parts >= 3 && folder.contains("/src/") && !is_tests && !said.contains(folder) {
            wrong.push(format!("there and not named: {folder}"));
        }
    }
    assert_none("ARCHITECTURE.md does not tell the truth", wrong);
}

#[test]
fn dependencies_go_down_the_floors() {
    let floors = floors();
    assert!(floors.len() >= 10, "the table of floors was not understood");
    let mut wrong = Vec::new();
    for krate in crates() {
        let manifest = text(&root().join("crates").join(&krate).join("Cargo.toml"));
        for d in dependencies(&manifest) {
            let (Some(own), Some(other)) = (floors.get(&krate), floors.get(&d.name)) else { continue };
            // Tests may use the kit and the crates of their own floor.
            // Statistics are what the lessons are made of; everywhere else they are for tests.
            let kit = d.name == "irradiant-testkit" && krate != "irradiant-teach";
            let allowed = if d.dev { other <= own } else { other < own && !kit };
            if !allowed {
                wrong.push(format!("{krate} (floor {own}) depends on {} (floor {other})", d.name));
            }
        }
        if krate == "irradiant-testkit" && !dependencies(&manifest).is_empty() {
            wrong.push("irradiant-testkit depends on something".into());
        }
    }
    assert_none("dependencies that do not go down", wrong);
}

#[test]
fn every_dependency_says_why_it_is_there() {
    let mut wrong = Vec::new();
    for krate in crates() {
        let manifest = text(&root().join("crates").join(&krate).join("Cargo.toml"));
        for d in dependencies(&manifest) {
            if !d.explained && !d.name.starts_with("irradiant") {
                wrong.push(format!("crates/{krate}/Cargo.toml:{}: {}", d.line, d.name));
            }
        }
    }
    assert_none("a line of why above each dependency, please", wrong);
}

/// What a source says to the compiler: comments and, from `#[cfg(test)]` on, tests left out.
fn code_of(path: &Path) -> Vec<(usize, String)> {
    if path.ends_with("tests.rs") || name(path).contains("/tests/") {
        return Vec::new();
    }
    let source = text(path);
    let lines = source.lines().enumerate().take_while(|(_, l)| l.trim() != "#[cfg(test)]");
    lines.filter(|(_, l)| !l.trim_start().starts_with("//")).map(|(i, l)| (i + 1, l.to_string())).collect()
}

/// Where any of the words stands in the code of the crates.
fn places(crates: &[&str], words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for krate in crates {
        for file in files(&format!("crates/{krate}/src"), ".rs") {
            for (line, code) in code_of(&file) {
                for word in words {
                    if code.contains(word) {
                        found.push(format!("{}:{line}: {word}", name(&file)));
                    }
                }
            }
        }
    }
    found
}

#[test]
fn the_lower_floors_do_not_touch_the_outside_world() {
    let pure = ["irradiant-math", "irradiant-spectrum", "irradiant-bvh", "irradiant-scene", "irradiant-core"];
    let words = ["std::fs", "std::env", "std::time", "std::net", "std::process", "println!", "Instant::now"];
    assert_none("files, clocks and the environment are for the edges", places(&pure, &words));
}

#[test]
fn light_transport_has_the_same_bits_everywhere() {
    // The system's elementary functions differ in their last bits between machines; fused products between CPUs.
    let words = [
        ".sin()",
        ".cos()",
        ".sin_cos()",
        ".tan()",
        ".exp()",
        ".ln()",
        ".log2()",
        ".powf(",
        ".asin()",
        ".acos()",
        ".atan()",
        ".atan2(",
        ".mul_add(",
    ];
    let transport = ["irradiant-core", "irradiant-render", "irradiant-bvh"];
    assert_none("use irradiant_math::elementary", places(&transport, &words));
}

#[test]
fn unsafe_is_forbidden_but_in_the_bvh() {
    let mut wrong = Vec::new();
    for krate in crates() {
        let source = root().join("crates").join(&krate).join("src");
        for file in ["lib.rs", "main.rs"].map(|f| source.join(f)).iter().filter(|p| p.is_file()) {
            let wanted = if krate == "irradiant-bvh" { "#![deny(unsafe_code)]" } else { "#![forbid(unsafe_code)]" };
            if !text(file).lines().any(|l| l.trim() == wanted) {
                wrong.push(format!("{}: no {wanted}", name(file)));
            }
        }
    }
    // The benchmark calls a foreign library in one file, and may nowhere else.
    let foreign = "bench/src/rays/embree.rs";
    for file in files("bench/src", ".rs").iter().filter(|f| name(f) != foreign) {
        if text(file).contains("allow(unsafe_code)") {
            wrong.push(format!("{}: unsafe code outside of {foreign}", name(file)));
        }
    }
    let main = text(&root().join("bench/src/main.rs"));
    if !main.lines().any(|l| l.trim() == "#![deny(unsafe_code)]") {
        wrong.push("bench/src/main.rs: no #![deny(unsafe_code)]".into());
    }
    for file in files("crates/irradiant-bvh/src", ".rs").into_iter().chain([root().join(foreign)]) {
        let source = text(&file);
        let lines: Vec<&str> = source.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            let is_block = code.contains("unsafe {");
            if is_block && !lines[i.saturating_sub(6)..i].iter().any(|l| l.contains("SAFETY:")) {
                wrong.push(format!("{}:{}: no SAFETY comment", name(&file), i + 1));
            }
        }
    }
    assert_none("unsafe code", wrong);
}

#[test]
fn files_are_of_a_size_to_read() {
    let is_table = |path: &Path| {
        let name = name(path);
        name.contains("/data/") || name.ends_with("sobol_directions.rs") || name.ends_with("codes.rs")
    };
    let all = files("crates", ".rs").into_iter().chain(files("bench/src", ".rs"));
    let long = all.filter(|f| !is_table(f)).filter_map(|f| {
        let lines = text(&f).lines().count();
        (lines > MAX_LINES).then(|| format!("{}: {lines} lines", name(&f)))
    });
    assert_none("which second noun has moved in?", long.collect());
}

/// Codes of diagnostics in the code of a crate, its table of explanations left out.
fn codes(krate: &str) -> BTreeSet<String> {
    let is_code = |word: &&str| {
        word.len() == 5 && word.starts_with(['E', 'W', 'N']) && word[1..].bytes().all(|b| b.is_ascii_digit())
    };
    let sources = files(&format!("crates/{krate}/src"), ".rs").into_iter().filter(|f| !f.ends_with("codes.rs"));
    let lines = sources.flat_map(|f| code_of(&f));
    lines.flat_map(|(_, l)| l.split('"').filter(is_code).map(String::from).collect::<Vec<_>>()).collect()
}

#[test]
fn every_code_means_one_thing_and_is_explained() {
    let (reading, compiling) = (codes("irradiant-formats"), codes("irradiant-core"));
    assert!(reading.len() > 50 && compiling.len() > 50, "the codes were not understood");
    let mut wrong: Vec<String> = reading.intersection(&compiling).map(|c| format!("{c} means two things")).collect();
    for (krate, used) in [("irradiant-formats/src/pbrt", &reading), ("irradiant-core/src", &compiling)] {
        let table = text(&root().join(format!("crates/{krate}/codes.rs")));
        let unexplained = used.iter().filter(|c| !table.contains(&format!("\"{c}\"")));
        wrong.extend(unexplained.map(|c| format!("{c} is not in crates/{krate}/codes.rs")));
    }
    assert_none("codes of diagnostics", wrong);
}

#[test]
fn nothing_is_left_for_later() {
    // Written in two halves, or this file would find itself.
    let words = [concat!("to", "do!("), concat!("unimple", "mented!("), concat!("#[ig", "nore"), concat!("dbg", "!(")];
    let mut wrong = Vec::new();
    for file in files("crates", ".rs").into_iter().chain(files("bench/src", ".rs")) {
        for (i, line) in text(&file).lines().enumerate() {
            for word in words {
                if line.contains(word) {
                    wrong.push(format!("{}:{}: {word}", name(&file), i + 1));
                }
            }
        }
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if ["utils", "util", "common", "helpers", "misc"].contains(&stem.as_str()) {
            wrong.push(format!("{}: a drawer, not a noun", name(&file)));
        }
    }
    assert_none("unfinished", wrong);
}

#[test]
fn links_between_the_papers_lead_somewhere() {
    let anchors = |path: &Path| -> BTreeSet<String> {
        let slug = |heading: &str| -> String {
            let kept = heading.trim().to_lowercase();
            let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect()
        };
        text(path).lines().filter(|l| l.starts_with('#')).map(|l| slug(l.trim_start_matches('#'))).collect()
    };
    let mut wrong = Vec::new();
    for file in markdown() {
        let source = text(&file);
        let folder = file.parent().expect("a folder").to_path_buf();
        let mut fenced = false;
        for (i, line) in source.lines().enumerate() {
            if line.trim_start().starts_with("```") {
                fenced = !fenced;
            }
            if fenced {
                continue;
            }
            for target in line.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
                if target.contains("://") || target.starts_with("mailto:") {
                    continue;
                }
                let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
                let to = if path.is_empty() { file.clone() } else { folder.join(path) };
                let is_there = to.exists() && (anchor.is_empty() || anchors(&to).contains(anchor));
                if !is_there {
                    wrong.push(format!("{}:{}: {target}", name(&file), i + 1));
                }
            }
        }
    }
    assert_none("links to nowhere", wrong);
}

#[test]
fn the_guide_knows_every_flag_code_and_attribute() {
    let guide = text(&root().join("docs/guide/command-line.md"));
    let mut wanted: Vec<(String, String)> = Vec::new();
    for file in files("crates/irradiant-cli/src", ".rs") {
        let source = text(&file);
        let mut pending = false;
        for line in source.lines().map(str::trim) {
            if line.starts_with("#[arg(") {
                pending = line.contains("long");
            } else if pending && !line.starts_with(['#', '/']) {
                let field = line.trim_start_matches("pub ").split(':').next().unwrap_or("");
                wanted.push((format!("`--{}", field.replace('_', "-")), name(&file)));
                pending = false;
            }
        }
    }
    assert!(wanted.len() >= 15, "the flags were not understood: {wanted:?}");
    let exit = text(&root().join("crates/irradiant-cli/src/exit.rs"));
    for line in exit.lines().map(str::trim) {
        if let Some(code) = line.strip_suffix(',').and_then(|l| l.split_once(" = ")).map(|(_, code)| code) {
            wanted.push((format!("| {code} |"), "exit.rs".into()));
        }
    }
    let header = text(&root().join("crates/irradiant/src/header.rs"));
    for attribute in header.split('"').filter(|s| s.starts_with("irradiant/")) {
        wanted.push((format!("`{attribute}`"), "header.rs".into()));
    }
    let missing = wanted.into_iter().filter(|(word, _)| !guide.contains(word.as_str()));
    assert_none("not in docs/guide/command-line.md", missing.map(|(w, from)| format!("{w} of {from}")).collect());
}

#[test]
fn the_changelog_knows_this_version() {
    let log = text(&root().join("CHANGELOG.md"));
    let version = env!("CARGO_PKG_VERSION");
    assert!(log.contains(&format!("## [{version}]")) || log.contains("## [Unreleased]"), "no entry for {version}");
}
