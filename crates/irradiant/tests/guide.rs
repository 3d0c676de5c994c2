//! The scenes in the guide are scenes: each is read without a complaint and renders. Its list of estimators is the program's.

use irradiant::renderer::registry::INTEGRATORS;
use irradiant::{RenderSettings, load_text, render};

/// Fenced blocks marked `pbrt`, with the line that each begins at.
fn scenes(guide: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let mut inside = false;
    for (i, line) in guide.lines().enumerate() {
        if line.starts_with("```") {
            inside = line == "```pbrt";
            if inside {
                found.push((i + 2, String::new()));
            }
        } else if inside && let Some((_, text)) = found.last_mut() {
            text.push_str(line);
            text.push('\n');
        }
    }
    found
}

#[test]
fn every_scene_in_the_guide_renders() {
    let guide = include_str!("../../../docs/guide/scenes.md");
    let scenes = scenes(guide);
    assert_eq!(scenes.len(), 4, "scenes in the guide");
    let settings =
        RenderSettings { samples_per_pixel: Some(1), resolution: Some([16, 16]), ..RenderSettings::default() };
    for (line, text) in scenes {
        let name = format!("docs/guide/scenes.md:{line}");
        let file = load_text(&name, &text, ".").unwrap_or_else(|why| panic!("{name}: {why}"));
        assert!(file.report.diagnostics.is_empty(), "{name}: {}", file.report);
        let picture = render(&file, &settings).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert!(picture.header.not_honoured.is_empty(), "{name}: {:?}", picture.header.not_honoured);
        let light: f64 = (0..256).map(|i| picture.film.pixel(i % 16, i / 16).mean()[1]).sum();
        assert!(light > 0.0, "{name}: black");
    }
}

#[test]
fn the_guide_lists_the_estimators_that_there_are() {
    let guide = include_str!("../../../docs/guide/estimators.md").replace("\r\n", "\n");
    let (_, list) = guide.split_once("-->\n").expect("the list follows a comment");
    let expected: String = INTEGRATORS.iter().map(|e| e.markdown()).collect();
    for (i, (is, should)) in list.trim().lines().zip(expected.trim().lines()).enumerate() {
        assert_eq!(is, should, "line {} of the list; `irradiant integrators --markdown` prints it anew", i + 1);
    }
    assert_eq!(
        list.trim().lines().count(),
        expected.trim().lines().count(),
        "`irradiant integrators --markdown` prints the list"
    );
}
