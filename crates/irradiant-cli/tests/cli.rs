//! The program as a user drives it.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("irradiant-cli-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("writable");
        path
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_irradiant"));
        command.args(arguments).current_dir(&self.0).stdin(Stdio::null());
        command
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(&self.0)
            .expect("readable")
            .map(|e| e.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap_or(-1)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn integrators_are_listed_with_their_options_and_named_in_the_header() {
    let folder = Folder::new("integrators");
    folder.write("scene.pbrt", &SCENE.replace("Shape", "Material \"dielectric\"\nShape"));
    folder.write("matt.pbrt", SCENE);
    let list = stdout(&folder.run(&["integrators"]));
    assert_eq!(list, stdout(&folder.run(&["render", "--integrator", "help"])));
    for word in ["path", "randomwalk", "samplebsdf=true", "lightsampler=scene", "exhaustive"] {
        assert!(list.contains(word), "{word} is not listed");
    }
    let output = folder.run(&[
        "render",
        "scene.pbrt",
        "-q",
        "-o",
        "x.exr",
        "--integrator",
        "simplepath",
        "--estimator",
        "samplebsdf=false",
    ]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let bytes = std::fs::read(folder.0.join("x.exr")).expect("written");
    let header = String::from_utf8_lossy(&bytes);
    assert!(header.contains("simplepath samplelights=true samplebsdf=false lightsampler=scene"), "not in the header");
    assert!(header.contains("delta lobes"), "the label does not say what is left out");
    // Only what the scene has can be lost.
    let output = folder.run(&[
        "render",
        "matt.pbrt",
        "-o",
        "x.exr",
        "--max-depth",
        "none",
        "--integrator",
        "simplepath",
        "--estimator",
        "samplebsdf=false",
        "--estimator",
        "samplelights=false",
    ]);
    assert!(stderr(&output).contains(" unbiased\n"), "{}", stderr(&output));
    // Options of the scene's own integrator; and what stands in for it is no matter once another is asked for.
    folder.write("mlt.pbrt", &format!("Integrator \"mlt\"\n{SCENE}"));
    let strict = ["render", "mlt.pbrt", "-q", "-o", "y.exr", "--strict"];
    assert_eq!(code(&folder.run(&strict)), 65);
    let output = folder.run(&[&strict[..], &["--integrator", "path", "--estimator", "lightsampler=power"]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let output = folder.run(&["render", "mlt.pbrt", "-q", "-o", "z.exr", "--estimator", "lightsampler=power"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    for name in ["y.exr", "z.exr"] {
        let bytes = std::fs::read(folder.0.join(name)).expect("written");
        assert!(
            String::from_utf8_lossy(&bytes)
                .contains("path regularize=false roulette=throughput q=0.1 lights=1 candidates=2 lightsampler=power"),
            "{name}"
        );
    }
}

const SMALL: [&str; 4] = ["--resolution", "24x24", "--spp", "2"];
const SCENE: &str = "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 12 \"string filename\" \"deep/ball.exr\"\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nTranslate 0 0 3\nShape \"sphere\"\n";

#[test]
fn without_a_scene_the_cornell_box_is_rendered_beside_a_png() {
    let folder = Folder::new("default");
    let output = folder.run(&[&["render"], &SMALL[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(folder.names(), ["cornell-box.exr", "cornell-box.png"]);
    assert!(stderr(&output).contains("unbiased"), "{}", stderr(&output));
}

#[test]
fn without_o_the_picture_has_the_films_name_in_this_directory() {
    let folder = Folder::new("name");
    folder.write("scene.pbrt", SCENE);
    let output = folder.run(&["render", "scene.pbrt", "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    assert_eq!(folder.names(), ["ball.exr", "ball.png", "scene.pbrt"]);
}

#[test]
fn a_scene_comes_from_standard_input_too() {
    use std::io::Write;
    let folder = Folder::new("stdin");
    let mut child =
        folder.command(&["render", "-", "-o", "x.pfm", "-q"]).stdin(Stdio::piped()).spawn().expect("starts");
    child.stdin.take().expect("piped").write_all(SCENE.as_bytes()).expect("writable");
    assert!(child.wait().expect("ends").success());
    assert_eq!(folder.names(), ["x.pfm"]);
}

#[test]
fn equal_pixels_are_equal_files_for_any_number_of_threads() {
    let folder = Folder::new("bytes");
    for (threads, name) in [("1", "a.exr"), ("3", "b.exr")] {
        let output = folder.run(&[&["render", "--threads", threads, "-o", name], &SMALL[..]].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    let read = |name: &str| std::fs::read(folder.0.join(name)).expect("written");
    assert_eq!(read("a.exr"), read("b.exr"));
    // Another seed is another picture, not only another header.
    for (seed, name) in [("0", "a.pfm"), ("9", "c.pfm")] {
        folder.run(&[&["render", "--seed", seed, "-o", name], &SMALL[..]].concat());
    }
    assert_ne!(read("a.pfm"), read("c.pfm"));
}

#[test]
fn exit_codes_tell_who_can_fix_it() {
    let folder = Folder::new("codes");
    folder.write("broken.pbrt", "WorldBegin\nShape \"spere\"\n");
    folder.write(
        "mesh.pbrt",
        "WorldBegin\nLightSource \"infinite\"\nShape \"plymesh\" \"string filename\" \"gone.ply\"\n",
    );
    folder.write("ok.pbrt", SCENE);
    for (arguments, expected, says) in [
        (&["render", "missing.pbrt"][..], 66, "missing.pbrt"),
        (&["render", "broken.pbrt"], 65, "did you mean \"sphere\"?"),
        (&["check", "broken.pbrt"], 65, "broken.pbrt:2:7"),
        (&["render", "mesh.pbrt"], 66, "gone.ply"),
        (&["render", "ok.pbrt", "--max-dept", "3"], 2, "--max-depth"),
        (&["render", "ok.pbrt", "--integrator", "pth"], 2, "did you mean"),
        (&["render", "ok.pbrt", "--estimator", "lightsampler=treee"], 2, "bvh"),
        (&["render", "ok.pbrt", "--integrator", "simplepath", "--estimator", "samplebdsf=true"], 2, "samplebsdf"),
        (&["probe", "ok.pbrt", "--pixel", "1,1", "--integrator", "randomwalk"], 2, "--integrator path"),
        (&["integrators", "simplpath"], 2, "did you mean \"simplepath\"?"),
        (&["render", "ok.pbrt", "-o", "x.gif"], 2, ".exr"),
        (&["render", "--audit", "5000"], 66, "--audit=5000"),
        (&["render", "ok.pbrt", "--audit", "5000"], 2, "--audit=5000"),
        (&["render", "ok.pbrt", "--audit=abc"], 2, "\"abc\" is not a number: write a whole number of paths from 1000"),
        (&["render", "ok.pbrt", "--audit=5"], 2, "5 is not between 1000 and"),
        (
            &["render", "ok.pbrt", "--aov", "gi", "-o", "x.png", "-o", "x.hdr"],
            2,
            "x.png, x.hdr cannot hold layers; write an .exr",
        ),
        (&["render", "ok.pbrt", "--integrator", "bdpt", "--estimator", "s=2"], 2, "try t=1 or t=2"),
        (&["render", "ok.pbrt", "--integrator", "bdpt", "--estimator", "t=99"], 2, "--max-depth 97"),
        (&["render", "ok.pbrt", "--integrator", "bdpt", "--estimator", "weighted=false"], 2, "s=1 and t=2"),
        (&["render", "ok.pbrt", "--integrator", "bdpt", "--estimator", "t=1"], 2, "s=0 and t=2"),
        (
            &[
                "render",
                "ok.pbrt",
                "--integrator",
                "distribution",
                "--estimator",
                "rays=64",
                "--estimator",
                "stop=16",
                "--max-depth",
                "none",
            ],
            2,
            "64^16 after 16 events, for each sample of each pixel; it takes on 65536: try --estimator stop=2, or --estimator rays=2",
        ),
        (&["render", "ok.pbrt", "--aov", "a=L(D|)E"], 2, "D?"),
        (&["render", "ok.pbrt", "-o", "nowhere/x.exr"], 2, "nowhere"),
        (&["render", "ok.pbrt", "--crop", "0,2,0,1"], 2, "crop"),
        (&["probe", "ok.pbrt", "--pixel", "99,0"], 2, "columns 0 to 15"),
        (&["compare", "gone.exr", "gone.exr"], 66, "gone.exr"),
        (&["compare", "ok.pbrt", "ok.pbrt"], 65, "ok.pbrt"),
        (&["frobnicate"], 2, "Usage"),
        (&["render", "missing.pbrt"], 66, "cannot read missing.pbrt: there is no such file\n"),
        (&["compare", "gone.exr", "gone.exr"], 66, "cannot read gone.exr: there is no such file\n"),
        (&["image", "gone.exr", "-o", "x.png"], 66, "cannot read gone.exr: there is no such file\n"),
        (&["render", "ok.pbrt", "--spp", "-1"], 2, "'-1' for '--spp <N>': -1 is not in 1..="),
        (&["render", "ok.pbrt", "--seed", "-1"], 2, "'-1' for '--seed <N>': write a whole number from 0 to"),
        (
            &["render", "ok.pbrt", "--max-depth", "-1"],
            2,
            "'-1' for '--max-depth <N|none>': write a whole number, 0 or more",
        ),
        (&["render", "ok.pbrt", "--time", "-3s"], 2, "'-3s' for '--time <TIME>': not a time that can pass"),
        (&["render", "ok.pbrt", "--threads", "-2"], 2, "'-2' for '--threads <N>'"),
        (&["render", "ok.pbrt", "--crop", "-0.1,1,0,1"], 2, "needs 0 <= x0"),
        (&["probe", "ok.pbrt", "--pixel", "1,1", "--sample", "-1"], 2, "'-1' for '--sample <I>'"),
        (&["teach", "--seed", "-1"], 2, "'-1' for '--seed <N>'"),
        (&["render", "ok.pbrt", "-o", "x.png", "-o", "./x.png"], 2, "./x.png: named twice"),
        (&["render", "ok.pbrt", "-o", "x.png", "--contact-sheet", "x.png"], 2, "x.png: named twice"),
    ] {
        let output = folder.run(arguments);
        assert_eq!(code(&output), expected, "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(says), "{arguments:?} should say {says}: {}", stderr(&output));
    }
    assert_eq!(folder.names(), ["broken.pbrt", "mesh.pbrt", "ok.pbrt"], "an error left files behind");
}

#[test]
fn a_picture_that_was_there_survives_a_failed_render() {
    let folder = Folder::new("survive");
    folder.write("keep.exr", "precious");
    folder.write("broken.pbrt", "WorldBegin\nShape \"spere\"\n");
    folder.run(&["render", "broken.pbrt", "-o", "keep.exr"]);
    assert_eq!(std::fs::read_to_string(folder.0.join("keep.exr")).expect("there"), "precious");
}

#[test]
fn compare_measures_and_says_so_in_json() {
    let folder = Folder::new("compare");
    for (seed, name) in [("1", "a.exr"), ("2", "b.exr")] {
        folder.run(&[&["render", "--seed", seed, "-o", name], &SMALL[..]].concat());
    }
    let same = folder.run(&["compare", "a.exr", "a.exr", "--json"]);
    assert_eq!(code(&same), 0);
    let value: serde_json::Value = serde_json::from_slice(&same.stdout).expect("JSON");
    assert_eq!(value["mse"], 0.0);
    assert_eq!(value["mean_ratio"], 1.0);
    let other: serde_json::Value =
        serde_json::from_slice(&folder.run(&["compare", "a.exr", "b.exr", "--json"]).stdout).expect("JSON");
    assert!(other["relmse"].as_f64().is_some_and(|x| x > 0.0));
    folder.run(&["render", "--resolution", "10x24", "--spp", "1", "-o", "c.exr"]);
    assert_eq!(code(&folder.run(&["compare", "a.exr", "c.exr"])), 65);
}

#[test]
fn stats_are_json_and_the_picture_does_not_know_of_them() {
    let folder = Folder::new("stats");
    folder.run(&[&["render", "-o", "a.exr", "--stats", "s.json"], &SMALL[..]].concat());
    folder.run(&[&["render", "-o", "b.exr"], &SMALL[..]].concat());
    let text = std::fs::read(folder.0.join("s.json")).expect("written");
    let value: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    assert_eq!(value["paths"], 24 * 24 * 2);
    for key in ["phases", "rays", "mean_path_length", "cpu_seconds", "threads"] {
        assert!(!value[key].is_null(), "{key} is missing");
    }
    let read = |name: &str| std::fs::read(folder.0.join(name)).expect("written");
    assert_eq!(read("a.exr"), read("b.exr"));
}

#[test]
fn probe_replays_a_sample() {
    let folder = Folder::new("probe");
    let output = folder.run(&["probe", "--pixel", "256,300", "--sample", "5"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let text = stdout(&output);
    for word in ["wavelengths", "vertex 0", "material white", "radiance", "film", "survival: 1 after the first event"] {
        assert!(text.contains(word), "{word} is missing in {text}");
    }
    // The film's numbers follow from what is printed.
    let numbers = |line: &str| -> Vec<f64> {
        let inside = line.split(['[', ']']).nth(1).unwrap_or("");
        inside.split_whitespace().map(|x| x.parse().expect("a number")).collect()
    };
    let line = |start: &str| text.lines().find(|l| l.trim_start().starts_with(start)).expect(start);
    let radiance = numbers(line("radiance "));
    let red: f64 = radiance.iter().zip(numbers(line("film R is"))).map(|(l, factor)| l * factor).sum();
    let film = line("film         R").split_whitespace().nth(2).map(|x| x.parse::<f64>().expect("a number"));
    assert!(film.is_some_and(|film| (film - red).abs() < 1e-4 * red.abs()), "{film:?} {red}: {text}");
    // Light that nothing brought is told to be missing, of one sample and of many.
    for paths in ["1", "4"] {
        let none = stdout(&folder.run(&["probe", "--pixel", "256,300", "--bounces", "500..600", "--paths", paths]));
        assert!(none.contains("light after 500 to 600 bounces"), "{none}");
    }
    assert_eq!(text, stdout(&folder.run(&["probe", "--pixel", "256,300", "--sample", "5"])));
}

/// A lamp that is too bright for the film: its samples are refused. Commands that replay them are printed where they do, and places where no
/// command would.
#[test]
fn refused_samples_are_told_with_commands_that_replay_them() {
    let folder = Folder::new("refused");
    let sun = "LightSource \"point\" \"rgb I\" [ 1e30 1e30 1e30 ] \"point3 from\" [ 0 0 0 ]\n";
    folder.write("huge.pbrt", &SCENE.replace("LightSource \"infinite\"\n", sun));
    let render = |words: &[&str]| {
        let output = folder.run(&[&["render", "huge.pbrt", "--spp", "2", "-o", "x.exr"], words].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert!(stderr(&output).contains("samples were not finite or out of range"), "{}", stderr(&output));
        stderr(&output)
    };
    for (words, expected) in [
        (&[][..], ""),
        (&["--integrator", "path", "--estimator", "roulette=constant", "--max-depth", "3"], "roulette=constant"),
        (&["--preview"], "--sampler zsobol"),
        (&["--sampler", "halton"], "--sampler halton"),
    ] {
        let said = render(words);
        let commands: Vec<&str> = said.lines().filter_map(|l| l.trim().strip_prefix("irradiant ")).collect();
        assert!(!commands.is_empty(), "{said}");
        for command in commands {
            assert!(command.contains(expected), "{command}");
            let output = folder.run(&command.split(' ').collect::<Vec<_>>());
            assert_eq!(code(&output), 0, "{command}: {}", stderr(&output));
        }
    }
    for words in [
        &["--integrator", "simplepath", "--estimator", "samplebsdf=true"][..],
        &["--integrator", "direct", "--estimator", "shadow=firsthit"],
    ] {
        let said = render(words);
        assert!(said.contains("the first are\n    pixel ") && said.contains(" sample 0\n"), "{said}");
        assert!(said.contains("integrator path only") && !said.contains("irradiant probe huge"), "{said}");
    }
    // The ball is all that the lamp shines on, and its samples are the refused ones; the others found no light, which is not said of all.
    let said = render(&[]);
    assert!(said.contains("none of its paths that were not refused found light"), "{said}");
}

#[test]
fn probe_draws_and_speaks_json() {
    let folder = Folder::new("probe-json");
    folder.write("s.pbrt", SCENE);
    let output = folder.run(&["probe", "s.pbrt", "--pixel", "8,6", "--paths", "3", "--json", "-o", "paths.svg"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(value["paths"].as_array().map(Vec::len), Some(3));
    let path = &value["paths"][1];
    assert_eq!(path["sample"], 1);
    let contribution = &path["contributions"][0];
    let (product, weight) = (&contribution["product_of_pdfs"], &contribution["density_in_weight"]);
    let (product, weight) = (product.as_f64().expect("a number"), weight.as_f64().expect("a number"));
    assert!((product / weight - 1.0).abs() < 1e-4, "{product} {weight}");
    assert!(std::fs::read_to_string(folder.0.join("paths.svg")).expect("written").starts_with("<svg"));
    let png = folder.run(&["probe", "s.pbrt", "--pixel", "8,6", "-o", "paths.png"]);
    assert_eq!(code(&png), 2);
    assert!(stderr(&png).contains(".svg"), "{}", stderr(&png));
}

#[test]
fn light_at_a_point_and_the_rendering_equation_are_measured() {
    let folder = Folder::new("light");
    let flags = ["--resolution", "16x16", "--pixel", "8,12", "--side", "6", "--rays", "4"];
    let output = folder.run(&[&["probe", "--incident", "light.exr", "--json"], &flags[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(value["scattered"]["rgb"][1].as_f64().is_some_and(|x| x > 0.0), "{value}");
    assert!(value["path_traced"]["error"][1].as_f64().is_some_and(|x| x > 0.0), "{value}");
    assert!(folder.0.join("light.exr").exists());
    let png = folder.run(&[&["probe", "--incident", "light.png"], &flags[..]].concat());
    assert_eq!(code(&png), 2, "{}", stderr(&png));
    let output = folder.run(&["probe", "--residual", "4", "--rays", "8"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("standard error"), "{}", stdout(&output));
    // Paths need a pixel.
    assert_eq!(code(&folder.run(&["probe"])), 2);
    // An equation that was tested nowhere does not hold.
    folder.write("away.pbrt", &SCENE.replace("0 0 3", "0 0 -3"));
    for form in [&[][..], &["--json"]] {
        let output = folder.run(&[&["probe", "away.pbrt", "--residual", "5", "--rays", "2"], form].concat());
        assert_eq!(code(&output), 2, "{}", stdout(&output));
        assert!(stderr(&output).contains("nothing was tested") && output.stdout.is_empty(), "{}", stderr(&output));
    }
    // Nor has darkness a share.
    folder.write("dark.pbrt", &SCENE.replace("LightSource \"infinite\"\n", "").replace("0 0 3", "0 0 1.1"));
    let dark = folder.run(&["probe", "dark.pbrt", "--residual", "9", "--rays", "2", "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&dark.stdout).expect("JSON");
    assert!(
        value["relative_residual"].is_null() && value["points"].as_array().is_some_and(|p| !p.is_empty()),
        "{value}"
    );
}

#[test]
fn the_books_of_energy_are_printed_and_kept() {
    let folder = Folder::new("audit");
    let output =
        folder.run(&[&["render", "-q", "-o", "a.exr", "--audit=2000", "--stats", "s.json"], &SMALL[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    for word in ["emitted", "absorbed", "by red", "escaped", "missing"] {
        assert!(stdout(&output).contains(word), "{word} is missing in {}", stdout(&output));
    }
    let text = std::fs::read(folder.0.join("s.json")).expect("written");
    let value: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    let watts = |side: &str| value["audit"][side]["watts"].as_f64().expect("a number");
    let sides = watts("absorbed") + watts("escaped") + watts("cut_off") + watts("missing");
    assert!((sides / watts("emitted") - 1.0).abs() < 1e-9, "{value}");
    // Rough coats with pbrt-v4's weights are named where something is missing.
    let coat = "Material \"coateddiffuse\" \"rgb reflectance\" [ .9 .9 .9 ] \"float roughness\" 0.3\nShape";
    folder.write("coat.pbrt", &SCENE.replace("Shape", coat));
    let said = stdout(&folder.run(&["render", "coat.pbrt", "-q", "-o", "c.exr", "--audit"]));
    assert!(said.contains("standard errors, coat weighted as in pbrt-v4\n") && said.contains("  elsewhere"), "{said}");
    assert!(!said.contains("disagree"), "{said}");
    // Particles that are not finite: lamps as bright as floats go. (A direction in the surface, which is drawn once in some millions of events, is no
    // such case: this seed has one.)
    let sun = "LightSource \"point\" \"rgb I\" [ 1e36 1e36 1e36 ]\n";
    folder.write("huge.pbrt", &SCENE.replace("LightSource \"infinite\"\n", sun));
    let said = stdout(&folder.run(&["render", "huge.pbrt", "-q", "-o", "h.exr", "--audit=2000", "--stats", "h.json"]));
    assert!(said.contains("of 2000 particles were not finite") && !said.contains("NaN"), "{said}");
    let text = std::fs::read(folder.0.join("h.json")).expect("written");
    let value: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    assert!(value["audit"]["refused"].as_u64().is_some_and(|n| n > 0), "{value}");
    let rare = ["render", "-q", "-o", "r.exr", "--spp", "1", "--resolution", "4x4", "--seed", "5", "--audit"];
    let said = stdout(&folder.run(&rare));
    assert!(said.contains("standard errors") && !said.contains("NaN") && !said.contains("refused"), "{said}");
    // Materials of one name are told apart.
    let two = "Material \"diffuse\"\nShape \"sphere\"\nTranslate 3 0 0\nMaterial \"diffuse\" \"rgb reflectance\" [ .1 .1 .1 ]\nShape";
    folder.write("two.pbrt", &SCENE.replace("Shape", two));
    let said = stdout(&folder.run(&["render", "two.pbrt", "-q", "-o", "c.exr", "--audit=2000"]));
    let names: Vec<&str> = said.lines().filter(|l| l.starts_with("  by diffuse #")).map(|l| &l[..15]).collect();
    assert!(names.len() == 2 && names[0] != names[1], "{said}");
    // The picture is the same as without.
    folder.run(&[&["render", "-q", "-o", "b.exr"], &SMALL[..]].concat());
    let read = |name: &str| std::fs::read(folder.0.join(name)).expect("written");
    assert_eq!(read("a.exr"), read("b.exr"));
}

#[test]
fn ways_of_leaving_a_surface_are_labelled() {
    let folder = Folder::new("leaving");
    let render = |mode: &str, name: &str| {
        folder.run(&[&["render", "-o", name, "--self-intersection", mode], &SMALL[..]].concat())
    };
    for (mode, label) in [
        ("none", "biased: self-intersection none"),
        ("epsilon=0.5", "self-intersection epsilon=0.5"),
        ("robust", "unbiased"),
    ] {
        let output = render(mode, "a.exr");
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert!(stderr(&output).contains(label), "{mode}: {}", stderr(&output));
    }
    for bad in ["epsilon", "none=1", "magic", "epsilon=-1", "epsilon=inf", "epsilon=nan"] {
        assert_eq!(code(&render(bad, "a.exr")), 2, "{bad}");
    }
    let both = folder.run(&["render", "--self-intersection", "none", "--integrator", "path"]);
    assert_eq!(code(&both), 2);
    let layers = folder.run(&["render", "--self-intersection", "none", "--aov", "gi"]);
    assert_eq!(code(&layers), 2);
    assert!(
        !stderr(&layers).contains("--integrator path") && stderr(&layers).contains("leave one"),
        "{}",
        stderr(&layers)
    );
}

#[test]
fn check_tells_what_a_scene_holds() {
    let folder = Folder::new("check");
    folder.write("s.pbrt", SCENE);
    let output = folder.run(&["check", "s.pbrt"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("16 x 12"), "{}", stdout(&output));
    assert!(stdout(&output).contains("truncated: maxdepth 5"), "{}", stdout(&output));
    // Light that paths from lamps bring has memory of its own.
    let film = |text: &str| -> f64 {
        folder.write(
            "m.pbrt",
            &text.replace("xresolution\" 16", "xresolution\" 1600").replace("yresolution\" 12", "yresolution\" 1200"),
        );
        let said = stdout(&folder.run(&["check", "m.pbrt"]));
        let line = said.lines().find(|l| l.contains("of film")).expect("a line about memory");
        line.split(", ").nth(1).and_then(|s| s.split(' ').next()).and_then(|s| s.parse().ok()).expect("MB")
    };
    assert!(film(&format!("Integrator \"bdpt\"\n{SCENE}")) > 1.2 * film(SCENE));
}

#[test]
fn what_is_not_honoured_is_said_and_strict_makes_it_an_error() {
    let folder = Folder::new("strict");
    folder.write(
        "fog.pbrt",
        &SCENE.replace(
            "WorldBegin\n",
            "WorldBegin\nMakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nMediumInterface \"fog\" \"\"\n",
        ),
    );
    let output = folder.run(&["render", "fog.pbrt"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("warning"), "{}", stderr(&output));
    assert_eq!(code(&folder.run(&["render", "fog.pbrt", "--strict"])), 65);
}

#[test]
fn images_are_converted() {
    let folder = Folder::new("image");
    folder.run(&[&["render", "-o", "a.exr"], &SMALL[..]].concat());
    for name in ["a.png", "a.pfm", "a.hdr", "a.qoi", "a.jpg"] {
        let output = folder.run(&["image", "a.exr", "-o", name, "--exposure", "-1"]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    assert_eq!(folder.names().len(), 6);
    // Linear values stay as they are, and whoever asks for a curve is told so.
    let output = folder.run(&["image", "a.exr", "-o", "t.exr", "--tone", "aces"]);
    assert!(code(&output) == 0 && stderr(&output).contains("t.exr keeps linear values"), "{}", stderr(&output));
    assert_eq!(stderr(&folder.run(&["image", "a.exr", "-o", "t.png", "--tone", "aces"])), "");
}

#[test]
fn a_time_limit_ends_a_long_render() {
    let folder = Folder::new("time");
    let output = folder.run(&["render", "--resolution", "64x64", "--spp", "1000000", "--time", "300ms", "-o", "x.exr"]);
    // What can be had in that time is what was wished for.
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let bytes = std::fs::read(folder.0.join("x.exr")).expect("written");
    assert!(bytes.windows(19).any(|w| w == b"irradiant/spp_taken"));
}

#[test]
fn pixels_that_no_sample_came_to_are_told_of() {
    let folder = Folder::new("holes");
    // More pixels than any one thread samples in this time.
    let flags = ["--resolution", "512x512", "--time", "1ms", "--threads", "1"];
    let output = folder.run(&[&["render", "-o", "x.pfm", "--stats", "s.json"], &flags[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("of 262144 pixels (") && said.contains("have no sample"), "{said}");
    let stats: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.0.join("s.json")).expect("written")).expect("JSON");
    assert!(stats["pixels_without_samples"].as_u64().is_some_and(|n| n > 0 && n <= 262_144), "{stats}");
}

#[test]
fn a_preview_is_small_but_for_what_is_said() {
    let folder = Folder::new("preview");
    folder.write("s.pbrt", SCENE);
    let label =
        |flags: &[&str]| stderr(&folder.run(&[&["render", "s.pbrt", "--preview", "-o", "x.png"], flags].concat()));
    assert!(label(&[]).contains("s.pbrt: 8 x 6 pixels, 16 samples each"), "{}", label(&[]));
    let said = label(&["--resolution", "20x20", "--spp", "17"]);
    assert!(said.contains("s.pbrt: 20 x 20 pixels, 17 samples each"), "{said}");
}

#[test]
fn a_preview_has_blue_noise_whatever_the_scene_says() {
    let folder = Folder::new("preview-sampler");
    folder.write("a.pbrt", &format!("Sampler \"halton\"\n{SCENE}"));
    folder.write("b.pbrt", &format!("Sampler \"zsobol\"\n{SCENE}"));
    let picture = |flags: &[&str]| {
        let output = folder.run(&[&["render", "--quiet", "--spp", "2", "-o", "x.pfm"], flags].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let bytes = std::fs::read(folder.0.join("x.pfm")).expect("written");
        std::fs::remove_file(folder.0.join("x.pfm")).expect("removed");
        bytes
    };
    let blue = picture(&["b.pbrt", "--preview"]);
    assert_eq!(picture(&["a.pbrt", "--preview"]), blue);
    assert_eq!(picture(&["a.pbrt", "--preview", "--sampler", "zsobol"]), blue);
    let independent = picture(&["a.pbrt", "--preview", "--sampler", "independent"]);
    assert_ne!(independent, blue);
    assert_eq!(picture(&["b.pbrt", "--preview", "--sampler", "independent"]), independent);
    assert_ne!(picture(&["a.pbrt"]), picture(&["b.pbrt"]));
    // The flag means what the scene's directive means.
    for name in ["zsobol", "paddedsobol", "independent", "halton", "sobol", "pmj02bn"] {
        folder.write("c.pbrt", &format!("Sampler \"{name}\"\n{SCENE}"));
        assert_eq!(picture(&["b.pbrt", "--sampler", name]), picture(&["c.pbrt"]), "{name}");
    }
}

#[test]
fn a_crop_is_compared_with_the_whole_where_both_are() {
    let folder = Folder::new("part");
    for (crop, name) in [("0,1,0,1", "all.exr"), ("0.5,1,0.25,1", "part.exr"), ("0,0.25,0,1", "left.exr")] {
        let output = folder.run(&[&["render", "--crop", crop, "-o", name], &SMALL[..]].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    let output = folder.run(&["compare", "part.exr", "all.exr", "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(value["mse"], 0.0);
    assert_eq!(value["part"], serde_json::json!({ "x": 12, "y": 6, "width": 12, "height": 18 }));
    // The worst tile lies there too.
    assert!(value["worst_tile"]["x"].as_i64().is_some_and(|x| x >= 12), "{value}");
    let apart = folder.run(&["compare", "part.exr", "left.exr"]);
    assert_eq!(code(&apart), 65);
    assert!(stderr(&apart).contains("no pixel in common"), "{}", stderr(&apart));
}

/// Waits for a render to be under way, stops it as Ctrl-C (`INT`) or a scheduler (`TERM`) does.
#[cfg(unix)]
fn stopped_render(folder: &Folder, signals: &[&str]) -> (i32, String) {
    let mut child = folder
        .command(&["render", "--resolution", "64x64", "--spp", "10000000", "-o", "x.exr"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    // The first line comes before the first sample; then half a second for the handler and some samples.
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().expect("piped")));
    lines.next().expect("a line").expect("text");
    std::thread::sleep(std::time::Duration::from_millis(500));
    // One shell, so that nothing comes between them.
    let kills: Vec<String> = signals.iter().map(|signal| format!("kill {signal} {}", child.id())).collect();
    assert!(Command::new("sh").args(["-c", &kills.join("; ")]).status().expect("a shell").success());
    let said: Vec<String> = lines.map_while(Result::ok).collect();
    // No status (it was killed) is no code of ours.
    (child.wait().expect("ends").code().unwrap_or(-1), said.join("\n"))
}

#[cfg(unix)]
#[test]
fn an_interrupt_writes_the_picture_so_far_and_ends_with_130() {
    for signal in ["-INT", "-TERM"] {
        let folder = Folder::new("interrupt");
        let (code, said) = stopped_render(&folder, &[signal]);
        assert_eq!(code, 130, "{signal}: {said}");
        assert!(said.contains("writing the picture so far") && said.contains("stopped early"), "{said}");
        // The header says how many samples the pixels really have.
        let bytes = std::fs::read(folder.0.join("x.exr")).expect("written");
        assert!(bytes.windows(19).any(|w| w == b"irradiant/spp_taken"));
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_an_audit_and_the_picture_is_there() {
    let folder = Folder::new("audit-interrupt");
    let mut child = folder
        .command(&[&["render", "-q", "-o", "x.pfm", "--audit=100000000"], &SMALL[..]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    // The picture is written before the audit begins.
    while !folder.0.join("x.pfm").exists() {
        assert!(child.try_wait().expect("can be asked").is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs").success());
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    assert!(stderr(&output).contains("of 100000000 particles; the picture has been written"), "{}", stderr(&output));
    // The books of the particles so far.
    assert!(stdout(&output).contains("emitted"), "{}", stdout(&output));
}

/// As GNU timeout does: it signals its child, and at once the group that the child is in.
#[cfg(unix)]
#[test]
fn two_signals_at_once_are_one_wish() {
    let folder = Folder::new("timeout");
    let (code, said) = stopped_render(&folder, &["-TERM", "-INT"]);
    assert_eq!(code, 130, "{said}");
    assert!(said.contains("stopped early") && folder.names() == ["x.exr"], "{said}");
}

#[test]
fn versions_and_help_are_there() {
    let folder = Folder::new("help");
    assert!(stdout(&folder.run(&["--version"])).contains(env!("CARGO_PKG_VERSION")));
    let help = stdout(&folder.run(&["render", "--help"]));
    for flag in [
        "--output",
        "--spp",
        "--time",
        "--seed",
        "--sampler",
        "--threads",
        "--resolution",
        "--crop",
        "--integrator",
        "--estimator",
        "--max-depth",
        "--color",
        "--exposure",
        "--preview",
        "--stats",
        "--quiet",
        "--strict",
    ] {
        assert!(help.contains(flag), "{flag} is not documented");
    }
}

#[test]
fn layers_are_written_beside_the_picture_and_told_of() {
    let folder = Folder::new("layers");
    let aov = ["--aov", "bounces:2", "--aov", "red=L.*D'red'.*E", "--max-depth", "2", "--contact-sheet", "sheet.png"];
    // Paths enough to tell what the limit leaves out.
    let size = ["--resolution", "64x64", "--spp", "16"];
    let output = folder.run(&[&["render", "-o", "box.exr"], &size[..], &aov].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(folder.names(), ["box.exr", "sheet.png"]);
    for told in [
        "K2",
        "Krest",
        "L.*D'red'.*E",
        "maxdepth 2 leaves out light: ",
        " % of the picture's, +- ",
        "box.exr, sheet.png",
    ] {
        assert!(stderr(&output).contains(told), "{told}: {}", stderr(&output));
    }
    let file = std::fs::read(folder.0.join("box.exr")).expect("readable");
    let image = irradiant::image::read(&file, "box.exr", &irradiant::image::ReadOptions::default()).expect("an EXR");
    for channel in ["R", "K0.R", "K2.B", "Krest.G", "red.R"] {
        assert!(image.channel_index(channel).is_some(), "{channel}: {:?}", image.channels());
    }
    // Too few say nothing.
    let few = folder.run(&["render", "-o", "few.exr", "--resolution", "24x24", "--spp", "1", "--max-depth", "5"]);
    assert!(code(&few) == 0 && !stderr(&few).contains("leaves out light"), "{}", stderr(&few));
    let sheet = std::fs::read(folder.0.join("sheet.png")).expect("readable");
    assert!(irradiant::image::read(&sheet, "sheet.png", &irradiant::image::ReadOptions::default()).is_ok());
}

#[test]
fn pictures_that_cannot_hold_layers_are_told_of() {
    let folder = Folder::new("no-layers");
    let sheet = ["render", "-o", "box.png", "--aov", "gi", "--contact-sheet", "sheet.png"];
    let output = folder.run(&[&sheet[..], &SMALL[..]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("warning: --aov: box.png cannot hold layers"), "{}", stderr(&output));
    // Beside an .exr that holds them there is nothing to say.
    let output = folder.run(&[&["render", "-o", "box.png", "-o", "box.exr", "--aov", "gi"], &SMALL[..]].concat());
    assert!(code(&output) == 0 && !stderr(&output).contains("warning"), "{}", stderr(&output));
}

#[test]
fn a_black_picture_is_told_of() {
    let folder = Folder::new("black");
    folder.write("point.pbrt", &SCENE.replace("infinite", "point"));
    let output = folder.run(&["render", "point.pbrt", "-o", "x.exr", "--integrator", "try2"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("delta lights") && said.contains("the picture is black"), "{said}");
    // With too few paths that found any, nothing is said of how much light a limit leaves out.
    let output = folder.run(&["render", "point.pbrt", "-o", "x.exr", "--max-depth", "1"]);
    let said = stderr(&output);
    assert!(!said.contains("leaves out") && !said.contains("beyond") && !said.contains("black"), "{said}");
}

#[test]
fn mistakes_in_expressions_are_shown_in_their_place() {
    let folder = Folder::new("expressions");
    let cases: [(&[&str], &str); 6] = [
        (&["--aov", "a=LXDE"], "LXDE\n   ^"),
        (&["--aov", "a=LD'rde'E"], "did you mean 'red'?"),
        (&["--aov", "bouces:3"], "did you mean \"bounces\"?"),
        (&["--aov", "groups"], "string group"),
        (&["--aov", "gi", "--integrator", "randomwalk"], "--integrator path"),
        (&["--contact-sheet", "sheet.jpg"], "sheets are .png"),
    ];
    for (flags, told) in cases {
        let output = folder.run(&[&["render"], &SMALL[..], flags].concat());
        assert_eq!(code(&output), 2, "{flags:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(told), "{flags:?}: {}", stderr(&output));
    }
    assert!(folder.names().is_empty());
}
