//! What is written below a drawing: what the lines mean, and the numbers.

use super::canvas::{Area, Canvas, Stroke, Type};
use super::marks::{BOUNCE_COLORS, Ink, Mark};
use super::{DrawingOptions, EDGE, GAP, LAMP_RING, LEFT_WIDTH, PANEL, QUIET, RIGHT_WIDTH, WORDS};
use crate::render::Job;
use irradiant_render::inspect::PathStory;
use irradiant_render::record::{PathEnd, Technique};

const LINE: f32 = 19.0;
/// Rows of a table at most.
const ROWS: usize = 14;

/// Why a path ended, in words.
pub fn end_in_words(why: PathEnd) -> &'static str {
    match why {
        PathEnd::Escaped => "left the scene",
        PathEnd::MaxDepth => "depth limit",
        PathEnd::Absorbed => "absorbed",
        PathEnd::Roulette => "Russian roulette",
    }
}

/// A row of samples with their meaning; returns where it ends.
pub(super) fn legend(canvas: &mut Canvas, at: [f32; 2], marks: &[Mark]) -> f32 {
    let [mut x, mut y] = at;
    let right = GAP + LEFT_WIDTH + GAP + RIGHT_WIDTH;
    let used = |ink: &dyn Fn(Ink) -> bool| marks.iter().any(|m| ink(m.ink));
    let mut entries: Vec<(Ink, String)> = Vec::new();
    for i in 0..BOUNCE_COLORS.len() as u32 {
        let last = i as usize == BOUNCE_COLORS.len() - 1;
        let is = |b: u32| if last { b >= i } else { b == i };
        if used(&|ink| matches!(ink, Ink::Segment(b) | Ink::Lit(b) if is(b))) {
            let words = match i {
                0 => "from the eye".into(),
                1 => "after 1 bounce".into(),
                n if last => format!("after {n} and more"),
                n => format!("after {n}"),
            };
            entries.push((Ink::Segment(i), words));
        }
    }
    if used(&|ink| matches!(ink, Ink::Lit(_))) {
        entries.push((Ink::Lit(0), "light found (colour: bounces on its way)".into()));
    }
    if used(&|ink| ink == Ink::Blocked) {
        entries.push((Ink::Blocked, "light blocked".into()));
    }
    let words = Type { size: 13.0, color: WORDS, monospaced: false, bold: false };
    for (ink, text) in entries {
        let width = 48.0 + 6.9 * text.len() as f32;
        if x + width > right {
            (x, y) = (at[0], y + LINE + 3.0);
        }
        canvas.line(&[[x, y - 4.0], [x + 26.0, y - 4.0]], ink.look());
        canvas.text([x + 33.0, y], &text, words);
        x += width;
    }
    // What is no line: rings, dots, the camera.
    let note = Type { size: 13.0, color: QUIET, monospaced: false, bold: false };
    let ring = |color| Stroke { color, width: 1.5, opacity: 1.0, dash: "" };
    let dot = Stroke { color: "#000000", width: 1.0, opacity: 0.8, dash: "" };
    let mut signs: Vec<(Sign, &str)> = vec![(Sign::Disc("none", ring("#ffffff")), "the pixel")];
    if marks.iter().any(|m| m.is_vertex) {
        let numbered = marks.iter().any(|m| !m.label.is_empty());
        let words = if numbered { "a surface met (number: bounces before it)" } else { "a surface met" };
        signs.push((Sign::Disc("#ffffff", dot), words));
    }
    if used(&|ink| matches!(ink, Ink::Lit(_))) {
        signs.push((Sign::Disc("none", ring(LAMP_RING)), "light came from here"));
    }
    signs.push((Sign::Line(Ink::Eye), "the camera"));
    signs.push((Sign::Nothing, "yellowish surfaces: lamps"));
    signs.push((Sign::Nothing, "faint: hidden from the camera"));
    (x, y) = (at[0], y + LINE + 3.0);
    for (sign, text) in signs {
        let before = if matches!(sign, Sign::Nothing) { 0.0 } else { 33.0 };
        let width = before + 15.0 + 6.9 * text.len() as f32;
        if x + width > right {
            (x, y) = (at[0], y + LINE + 3.0);
        }
        match sign {
            Sign::Disc(fill, rim) => canvas.disc([x + 13.0, y - 4.0], 4.2, fill, rim),
            Sign::Line(ink) => canvas.line(&[[x, y - 4.0], [x + 26.0, y - 4.0]], ink.look()),
            Sign::Nothing => {}
        }
        canvas.text([x + before, y], text, note);
        x += width;
    }
    y
}

/// How a note of the legend begins.
enum Sign {
    /// Filled so, with a rim.
    Disc(&'static str, Stroke<'static>),
    Line(Ink),
    Nothing,
}

fn table(canvas: &mut Canvas, at: [f32; 2], heading: &str, head: &str, rows: &[String]) -> f32 {
    let shown = rows.len().min(ROWS);
    let lines = shown + usize::from(rows.len() > ROWS) + 2;
    let area = Area { x: at[0], y: at[1], width: LEFT_WIDTH + GAP + RIGHT_WIDTH, height: lines as f32 * LINE + 18.0 };
    canvas.panel(area, PANEL, EDGE, 6.0);
    let mut y = at[1] + 22.0;
    let look = |color, monospaced, bold| Type { size: 13.0, color, monospaced, bold };
    canvas.text([at[0] + 14.0, y], heading, look(WORDS, false, true));
    for (text, color) in std::iter::once((head, QUIET)).chain(rows[..shown].iter().map(|row| (row.as_str(), WORDS))) {
        y += LINE;
        canvas.text([at[0] + 14.0, y], text, look(color, true, false));
    }
    if rows.len() > ROWS {
        y += LINE;
        canvas.text([at[0] + 14.0, y], &format!("and {} more", rows.len() - ROWS), look(QUIET, false, false));
    }
    area.y + area.height
}

fn plural(vertices: usize) -> String {
    if vertices == 1 { "1 vertex".into() } else { format!("{vertices} vertices") }
}

fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most { text.into() } else { text.chars().take(most - 1).chain(['…']).collect() }
}

/// The numbers of one path, or a summary of several; returns where they end.
pub(super) fn write(
    canvas: &mut Canvas,
    at: [f32; 2],
    job: &Job,
    stories: &[PathStory],
    options: &DrawingOptions,
) -> f32 {
    match stories {
        [story] => one(canvas, at, job, story, options),
        _ => many(canvas, at, job, stories, options),
    }
}

fn one(canvas: &mut Canvas, at: [f32; 2], job: &Job, story: &PathStory, options: &DrawingOptions) -> f32 {
    let mut rows: Vec<String> = Vec::new();
    for (i, v) in story.vertices.iter().enumerate() {
        let p = job.scene.world_from_render().point(v.at.p);
        let on = v.step.map_or("the path ends here".to_string(), |s| {
            format!(
                "{:<22} {:>11.4e}  {:>9.5}  {:>8.4}",
                shortened(&format!("{:?}", s.scattering.lobe), 22),
                s.scattering.pdf,
                s.scattering.throughput.average(),
                s.scattering.survival.min(1.0)
            )
        });
        let place = format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z);
        rows.push(format!(
            "{i:>3}  {:<20} {:<36} {on}",
            shortened(job.scene.material_name(v.at.material), 20),
            shortened(&place, 36)
        ));
    }
    let heading = format!("The path: {}; end: {}", plural(story.vertices.len()), end_in_words(story.end));
    let head = format!(
        "  i  {:<20} {:<36} {:<22} {:>11}  {:>9}  {:>8}",
        "material", "place (world)", "lobe drawn", "pdf", "carried", "survival"
    );
    let bottom = table(canvas, at, &heading, &head, &rows);

    let wanted = |bounces: u32| options.bounces.as_ref().is_none_or(|range| range.contains(&bounces));
    let rows: Vec<String> = story
        .found
        .iter()
        .filter(|f| wanted(f.contribution.bounces))
        .map(|f| {
            let c = &f.contribution;
            let how = match c.technique {
                Technique::Hit => "met by chance",
                Technique::LightSample => "light sample",
            };
            let books = f.account.map_or("not kept: behind an interface".to_string(), |a| {
                format!("{:>14.6e}  {:>16.6e}  {:>9.1e}", a.density, a.density_in_weight, a.difference())
            });
            format!(
                "{:>7}  {how:<13}  {:>5}  {:>12.5e}  {:>10.5}  {books}",
                c.bounces,
                c.light.0,
                c.radiance.average(),
                c.mis_weight
            )
        })
        .collect();
    let heading = format!("Light that it found: {} of {}", rows.len(), story.found.len());
    let head = format!(
        "bounces  {:<13}  {:>5}  {:>12}  {:>10}  {:>14}  {:>16}  {:>9}",
        "found by", "light", "radiance", "MIS weight", "product of pdfs", "pdf in the weight", "differ by"
    );
    table(canvas, [at[0], bottom + GAP], &heading, &head, &rows)
}

fn many(canvas: &mut Canvas, at: [f32; 2], job: &Job, stories: &[PathStory], options: &DrawingOptions) -> f32 {
    let most = stories.iter().flat_map(|s| &s.found).map(|f| f.contribution.bounces).max().unwrap_or(0);
    let brightness = |story: &PathStory, bounces: Option<u32>| {
        let sum = story
            .found
            .iter()
            .filter(|f| bounces.is_none_or(|b| f.contribution.bounces == b))
            .fold(irradiant_spectrum::SampledSpectrum::ZERO, |sum, f| sum + f.contribution.radiance);
        let mut lambda = story.lambda;
        if story.secondary_ended {
            lambda.terminate_secondary();
        }
        let [r, g, b] = job.scene.film_rgb(sum, &lambda).map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let n = stories.len().max(1) as f64;
    let total = stories.iter().map(|s| brightness(s, None)).sum::<f64>() / n;
    let wanted = |bounces: u32| options.bounces.as_ref().is_none_or(|range| range.contains(&bounces));
    let rows: Vec<String> = (0..=most)
        .filter(|&b| wanted(b))
        .map(|b| {
            let found = stories.iter().flat_map(|s| &s.found).filter(|f| f.contribution.bounces == b).count();
            let mean = stories.iter().map(|s| brightness(s, Some(b))).sum::<f64>() / n;
            let share = if total > 0.0 { mean / total } else { 0.0 };
            let bar = "▇".repeat((40.0 * share.clamp(0.0, 1.0)).round() as usize);
            format!("{b:>7}  {found:>13}  {mean:>16.6}  {:>6.1} %  {bar}", 100.0 * share)
        })
        .collect();
    let vertices: usize = stories.iter().map(|s| s.vertices.len()).sum();
    let heading = format!("{} paths of {:.2} vertices in the mean", stories.len(), vertices as f64 / n);
    let head = format!("bounces  {:>13}  {:>16}  {:>8}", "times found", "mean luminance", "share");
    table(canvas, at, &heading, &head, &rows)
}
