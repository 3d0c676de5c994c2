//! Scenes that read well and mean nothing: each is refused (or remarked upon) with a code, at its place, all at once.

use irradiant::{Error, Job, RenderSettings, load_text};
use std::fmt::Write as _;

/// A scene in which everything is right; `$` marks where a case puts its own words.
const HEAD: &str =
    "Camera \"perspective\" \"float fov\" 40\nFilm \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n";
const WORLD: &str = "WorldBegin\nLightSource \"point\" \"point3 from\" [0 1 0]\nTranslate 0 0 5\n";

/// Codes that reading and compiling give, each with the line of its first label (0: nowhere), and whether it is refused.
fn complaints(text: &str) -> (Vec<(String, usize)>, bool, String) {
    // Beside this file there is no image of any name used below.
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let result = load_text("case.pbrt", text, folder).and_then(|file| Job::new(&file, &RenderSettings::default()));
    let (report, refused) = match result {
        Ok(job) => (job.report.clone(), false),
        Err(Error::Scene(report)) => (*report, true),
        Err(other) => panic!("neither a scene nor a report: {other}"),
    };
    let line = |d: &irradiant::scene::Diagnostic| report.sources.locate(d.labels[0].0).map_or(0, |l| l.0);
    let list = report.diagnostics.iter().map(|d| (d.code.to_string(), line(d))).collect();
    (list, refused, report.to_string())
}

/// A statement of the head or of the world, and the code that it must give.
const HEADS: &[(&str, &str)] = &[
    ("Camera \"perspective\" \"float fov\" 0", "E0912"),
    ("Camera \"perspective\" \"float fov\" 180", "E0912"),
    ("Camera \"perspective\" \"float fov\" -40", "E0912"),
    ("Camera \"perspective\" \"float lensradius\" -1", "E0912"),
    ("Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 0", "E0912"),
    ("Camera \"perspective\" \"float frameaspectratio\" 0", "E0912"),
    ("Camera \"perspective\" \"float screenwindow\" [1 1 0 1]", "E0913"),
    ("Camera \"realistic\"", "E0304"),
    ("Film \"rgb\" \"integer xresolution\" 0", "E0309"),
    ("Film \"rgb\" \"integer xresolution\" 1000000", "E0901"),
    ("Film \"rgb\" \"integer xresolution\" 65536 \"integer yresolution\" 65536", "E0907"),
    ("Film \"rgb\" \"float cropwindow\" [.5 .5 0 1]", "E0902"),
    ("Film \"rgb\" \"float cropwindow\" [.9 .1 0 1]", "E0902"),
    ("Film \"rgb\" \"integer pixelbounds\" [5000 6000 0 1]", "E0902"),
    ("Film \"spectral\" \"float lambdamin\" 700 \"float lambdamax\" 400", "E0908"),
    ("Film \"spectral\" \"float lambdamin\" 500 \"float lambdamax\" 500.01", "E0908"),
    ("Film \"rgb\" \"float iso\" 0", "E0905"),
    ("Film \"rgb\" \"float iso\" -100", "E0905"),
    ("Film \"rgb\" \"float exposuretime\" 0", "E0905"),
    ("PixelFilter \"box\" \"float xradius\" 0", "E0903"),
    ("PixelFilter \"gaussian\" \"float yradius\" -2", "E0903"),
    ("PixelFilter \"gaussian\" \"float sigma\" 0", "E0904"),
    ("Sampler \"independent\" \"integer pixelsamples\" 0", "E0309"),
];

const WORLDS: &[(&str, &str)] = &[
    ("Shape \"sphere\" \"float radius\" 0", "E0501"),
    ("Shape \"sphere\" \"float radius\" -1", "E0501"),
    ("Shape \"disk\" \"float radius\" -1", "E0501"),
    ("Shape \"cylinder\" \"float radius\" 0", "E0501"),
    ("Shape \"sphere\" \"float phimax\" 0", "E0502"),
    ("Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 2", "W0503"),
    ("Shape \"disk\" \"float radius\" 1 \"float innerradius\" 1", "W0503"),
    ("Shape \"cylinder\" \"float zmin\" 1 \"float zmax\" 1", "W0503"),
    ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0]", "W0511"),
    ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" -1", "E0506"),
    ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"integer splitdepth\" 40", "E0309"),
    ("Material \"diffuse\" \"rgb reflectance\" [1.5 0 0]", "E0306"),
    ("Material \"diffuse\" \"spectrum reflectance\" [400 1.5 700 1.5]", "W0701"),
    ("Material \"diffuse\" \"float reflectance\" 2", "E0302"),
    ("Material \"conductor\" \"float roughness\" -.1", "E0702"),
    ("Material \"coateddiffuse\" \"float thickness\" -1", "E0704"),
    ("Material \"coateddiffuse\" \"float g\" 2", "E0705"),
    ("Material \"coateddiffuse\" \"integer maxdepth\" -1", "E0309"),
    ("Material \"coateddiffuse\" \"integer nsamples\" 0", "E0309"),
    ("Material \"dielectric\" \"float eta\" 0", "W0703"),
    ("Material \"diffusetransmission\" \"float scale\" -1", "E0707"),
    ("Material \"diffuse\" \"string normalmap\" \"no-normals.png\"", "E1001"),
    (
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\" Material \"diffuse\" \"texture reflectance\" \"t\"",
        "E1001",
    ),
    ("LightSource \"point\" \"float scale\" -1", "E0801"),
    ("LightSource \"point\" \"blackbody I\" -5", "E0309"),
    ("LightSource \"distant\" \"point3 from\" [1 1 1] \"point3 to\" [1 1 1]", "E0305"),
    ("LightSource \"spot\" \"float coneangle\" 0", "E0804"),
    ("LightSource \"infinite\" \"string filename\" \"no-sky.exr\"", "E1001"),
    ("LightSource \"infinite\" \"string filename\" \"refused.rs\"", "E0602"),
    ("LightSource \"projection\" \"string filename\" \"none.png\"", "E1001"),
    ("LightSource \"goniometric\" \"string filename\" \"none.png\"", "E1001"),
    ("AreaLightSource \"diffuse\" \"rgb L\" [-1 0 0] Shape \"disk\"", "E0306"),
    ("AreaLightSource \"diffuse\" \"float scale\" -1 Shape \"disk\"", "E0801"),
    ("AreaLightSource \"diffuse\" \"string filename\" \"none.png\" Shape \"disk\"", "E1001"),
    (
        "Texture \"t\" \"float\" \"fbm\" \"integer octaves\" -1 Material \"conductor\" \"texture roughness\" \"t\"",
        "E0309",
    ),
    (
        "Texture \"t\" \"float\" \"checkerboard\" \"integer dimension\" 4 Material \"conductor\" \"texture roughness\" \"t\"",
        "E0309",
    ),
    ("Scale 0 1 1 Shape \"sphere\"", "E0107"),
];

#[test]
fn what_cannot_be_meant_is_refused_at_its_place() {
    let shape = "Shape \"disk\"\n";
    let heads = HEADS.iter().map(|(words, code)| (format!("# first\n{words}\n{WORLD}{shape}"), 2, words, code));
    let before = HEAD.lines().count() + WORLD.lines().count();
    let worlds = WORLDS.iter().map(|(words, code)| (format!("{HEAD}{WORLD}{words}\n{shape}"), before + 1, words, code));
    let mut failures = String::new();
    for (text, line, words, code) in heads.chain(worlds) {
        let (list, refused, shown) = complaints(&text);
        let right = list.iter().any(|(c, l)| c == code && *l == line) && refused == code.starts_with('E');
        if !right {
            let _ = writeln!(failures, "{words}\n  wanted {code} at line {line}, refused {refused}\n{shown}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn all_mistakes_of_a_scene_come_at_once() {
    let text = "Camera \"perspective\" \"float fov\" 0\nFilm \"rgb\" \"integer xresolution\" 0\n\
        PixelFilter \"box\" \"float xradius\" 0\nWorldBegin\nLightSource \"point\" \"float scale\" -1\n\
        Material \"conductor\" \"float roughness\" -1\nShape \"sphere\" \"float radius\" 0\n";
    let (list, refused, shown) = complaints(text);
    assert!(refused, "{shown}");
    for code in ["E0912", "E0309", "E0903", "E0801", "E0702", "E0501"] {
        assert!(list.iter().any(|(c, _)| c == code), "{code} is missing:\n{shown}");
    }
}

#[test]
fn an_empty_scene_renders_black_with_a_remark() {
    for text in ["WorldBegin", "WorldBegin Shape \"sphere\"", "WorldBegin LightSource \"point\""] {
        let (list, refused, shown) = complaints(text);
        assert!(!refused, "{text:?}: {shown}");
        let dark = !text.contains("Light");
        assert_eq!(list.iter().any(|(c, _)| c == "W0501"), dark, "{text:?}: {shown}");
    }
    let text = "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin";
    let file = load_text("empty.pbrt", text, ".").unwrap_or_else(|e| panic!("{e}"));
    let picture = irradiant::render(&file, &RenderSettings::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(picture.image().to_f32().iter().all(|v| *v == 0.0));
}
