//! One self-contained HTML page of a lesson: pictures inside, nothing loaded from anywhere.

use crate::row::{Outcome, Picture, Verdict};
use crate::rows::gaps;
use crate::teach::{Lesson, Told};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Bytes as base64 with padding (RFC 4648).
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let sextet = word >> (18 - 6 * i) & 63;
            text.push(if i <= chunk.len() { LETTERS[sextet as usize] as char } else { '=' });
        }
    }
    text
}

/// Text for HTML, in elements and in attributes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The lectures' chapters, for headings: first row of each.
const CHAPTERS: &[(&str, &str)] = &[
    ("A01", "What global illumination looks like"),
    ("A10", "Reflection and materials"),
    ("A18", "The reflection equation"),
    ("A28", "The rendering equation and its operators"),
    ("A37", "Bounce by bounce"),
    ("A41", "Paths"),
    ("A46", "Russian roulette and path tracing"),
    ("A56", "Samples and lights"),
    ("A63", "Numerical precision"),
    ("A69", "Good scenes, hard scenes, and the progression"),
    ("B01", "The rendering equation"),
    ("B12", "Solving it: the series"),
    ("B18", "Paths and their probabilities"),
    ("B26", "Notes: densities"),
    ("B33", "Notes: specular surfaces and emitters"),
    ("B39", "The good and the bad"),
];

fn word(outcome: &Outcome) -> (&'static str, &'static str) {
    match outcome.verdict {
        Verdict::Passes => ("passes", "\u{2713} passes"),
        Verdict::Fails(_) if outcome.is_only_slow() => ("slow", "\u{2026} too slow, not wrong"),
        Verdict::Fails(_) => ("fails", "\u{2717} fails"),
        Verdict::Waits(_) => ("waits", "\u{2026} waits"),
    }
}

fn picture(p: &Picture) -> String {
    format!(
        "<figure style=\"--aspect:{:.3}\"><img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption></figure>\n",
        p.width as f64 / p.height.max(1) as f64,
        escaped(&p.caption),
        p.width,
        p.height,
        base64(&p.png),
        escaped(&p.caption)
    )
}

fn measures(outcome: &Outcome) -> String {
    if outcome.measures.is_empty() {
        return String::new();
    }
    let n = outcome.measures.len();
    let failed = outcome.measures.iter().filter(|m| !m.passes).count();
    let label = match (n, failed) {
        (1, 0) => "1 measure, within its bound".to_string(),
        (1, _) => "1 measure, out of bounds".to_string(),
        (n, 0) => format!("{n} measures, all within their bounds"),
        (n, f) => format!("{n} measures, {f} out of bounds"),
    };
    let mut html = format!(
        "<details{}><summary>{label}</summary><div class=\"measures\">\n",
        if n <= 4 || failed > 0 { " open" } else { "" }
    );
    for m in &outcome.measures {
        let _ = writeln!(
            html,
            "<div class=\"measure{}\"><div class=\"what\">{}</div><dl><dt>measured</dt><dd>{}</dd><dt>bound</dt><dd>{}</dd><dt>would see</dt><dd>{}</dd></dl></div>",
            if m.passes { "" } else { " out" },
            escaped(&m.what),
            escaped(&m.value),
            escaped(&m.bound),
            escaped(&m.detectable)
        );
    }
    html + "</div></details>\n"
}

fn row(told: &Told, here: &Here) -> String {
    let (row, outcome) = (&told.row, &told.outcome);
    let (class, label) = word(outcome);
    let mut html = format!(
        "<article class=\"row {class}\" id=\"{0}\"><header><a class=\"id\" href=\"#{0}\">{0}</a><h3>{1}</h3><span class=\"verdict\">{label}</span></header>\n",
        row.id,
        escaped(row.name)
    );
    let _ = writeln!(
        html,
        "<p><b class=\"kind\">Slide</b> {}</p><p><b class=\"kind\">Check</b> {}</p>",
        if row.says == "-" { "(a figure)".into() } else { escaped(row.says) },
        escaped(row.check)
    );
    if let Verdict::Fails(why) | Verdict::Waits(why) = &outcome.verdict {
        let _ = writeln!(html, "<p class=\"why\">{}</p>", escaped(why));
    }
    if !outcome.pictures.is_empty() {
        html += "<div class=\"pictures\">";
        outcome.pictures.iter().for_each(|p| html += &picture(p));
        html += "</div>\n";
    }
    html += &measures(outcome);
    for note in &outcome.notes {
        let _ = writeln!(html, "<p class=\"note\">{}</p>", linked(note, here));
    }
    if !outcome.commands.is_empty() {
        let lines: Vec<String> = outcome.commands.iter().map(|c| escaped(c)).collect();
        let _ = writeln!(html, "<pre>{}</pre>", lines.join("\n"));
    }
    html + "</article>\n"
}

/// The rows that are on the page.
type Here<'a> = BTreeSet<&'a str>;

/// Names of rows that are on the page as links.
fn linked(text: &str, here: &Here) -> String {
    let mut out = String::new();
    for word in escaped(text).split_inclusive(|c: char| !c.is_ascii_alphanumeric()) {
        let name = word.trim_end_matches(|c: char| !c.is_ascii_alphanumeric());
        if here.contains(name) {
            let _ = write!(out, "<a href=\"#{name}\">{name}</a>{}", &word[name.len()..]);
        } else {
            out += word;
        }
    }
    out
}

fn lecture(lesson: &Lesson, letter: char, title: &str, intro: &str) -> String {
    let told: Vec<&Told> = lesson.told.iter().filter(|t| t.row.id.starts_with(letter)).collect();
    if told.is_empty() {
        return String::new();
    }
    let mut html = format!(
        "<section id=\"lecture-{}\"><h2>{title}</h2><p class=\"intro\">{intro}</p>\n",
        letter.to_ascii_lowercase()
    );
    let mut chapter = None;
    let here: Here = lesson.told.iter().map(|t| t.row.id).collect();
    for t in told {
        let own = CHAPTERS.iter().rfind(|(first, _)| first.starts_with(letter) && *first <= t.row.id);
        if own.map(|c| c.0) != chapter {
            chapter = own.map(|c| c.0);
            if let Some((_, name)) = own {
                let _ = writeln!(html, "<h4 class=\"chapter\">{name}</h4>");
            }
        }
        html += &row(t, &here);
    }
    html + "</section>\n"
}

/// A number with its noun, or verb.
fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Rows whose goal of speed this machine does not meet, if there are any.
fn slow_too(slow: usize) -> String {
    if slow == 0 { String::new() } else { format!(", {} too slow, not wrong", counted(slow, "is", "are")) }
}

/// The page. Pictures of `hero` rows stand at its top.
pub fn page(lesson: &Lesson) -> String {
    let (n, passed) = (lesson.told.len(), lesson.passed());
    let here: Here = lesson.told.iter().map(|t| t.row.id).collect();
    let count = |class: &str| lesson.told.iter().filter(|t| word(&t.outcome).0 == class).count();
    let (fails, slow, waits) = (count("fails"), count("slow"), count("waits"));
    let measures: usize = lesson.told.iter().map(|t| t.outcome.measures.len()).sum();
    let mut html = String::with_capacity(1 << 22);
    let _ = writeln!(
        html,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>Irradiant: {passed} of {n} rows pass</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>",
        include_str!("page.css")
    );
    let budget = match lesson.budget {
        crate::Budget::Quick => "quick",
        crate::Budget::Full => "full",
    };
    let _ = writeln!(
        html,
        "<div class=\"top\"><h1>Two lectures, executable</h1>\n<p class=\"lead\">What two lectures on global illumination say, claim by claim, and what Irradiant {} measures of it. A row passes only through a measurement that could have failed.</p>\n<p class=\"score\"><strong>{passed}</strong> of {n} rows pass</p>\n<div class=\"bar\" role=\"img\" aria-label=\"{passed} pass, {fails} fail, {slow} too slow, {waits} wait\"><i class=\"passes\" style=\"flex:{passed}\"></i><i class=\"fails\" style=\"flex:{fails}\"></i><i class=\"slow\" style=\"flex:{slow}\"></i><i class=\"waits\" style=\"flex:{waits}\"></i></div>\n<p class=\"facts\">{}, {}, {} \u{b7} {budget} budget, seed {}, {:.0} s</p>",
        irradiant::VERSION,
        counted(measures, "measure", "measures"),
        counted(fails, "row fails", "rows fail") + &slow_too(slow),
        counted(waits, "waits", "wait"),
        lesson.seed,
        lesson.seconds
    );
    if let Some(fault) = &lesson.fault {
        let _ = writeln!(
            html,
            "<p class=\"why\">With a fault on purpose ({}): {}. Row {} must fail.</p>",
            fault.name,
            escaped(fault.what),
            fault.row
        );
    }
    // The progression, as the lecture's own best picture.
    if let Some(p) = lesson.told.iter().find(|t| t.row.id == "A73").and_then(|t| t.outcome.pictures.first()) {
        html += &format!("<div class=\"hero\">{}</div>\n", picture(p));
    }
    html += "<fieldset class=\"filter\"><legend>Show</legend>";
    for (id, label, n) in [
        ("all", "all", n),
        ("fails", "fails", fails),
        ("slow", "too slow, not wrong", slow),
        ("waits", "waits", waits),
        ("pictures", "with pictures", lesson.told.iter().filter(|t| !t.outcome.pictures.is_empty()).count()),
    ] {
        let checked = if id == "all" { " checked" } else { "" };
        let _ =
            write!(html, "<label><input type=\"radio\" name=\"show\" value=\"{id}\"{checked}> {label} ({n})</label>");
    }
    html += "</fieldset>\n<nav class=\"grid\" aria-label=\"Rows\">";
    for t in &lesson.told {
        let _ = write!(
            html,
            "<a class=\"{}\" href=\"#{1}\" title=\"{2}\">{1}</a>",
            word(&t.outcome).0,
            t.row.id,
            escaped(t.row.name)
        );
    }
    html += "</nav></div>\n<main>\n";
    html +=
        &lecture(lesson, 'A', "Lecture A: Global illumination and path tracing", "Berkeley CS184/284A, lecture 13.");
    html += &lecture(
        lesson,
        'B',
        "Lecture B: Rendering algorithms",
        "Universit\u{e4}t Bern, spring 2014: the rendering equation, Monte Carlo path tracing.",
    );
    html += "<section id=\"gaps\"><h2>Where the slides are wrong or incomplete</h2>\n<dl class=\"gaps\">";
    for (rows, what) in gaps() {
        let _ = write!(html, "<dt>{}</dt><dd>{}</dd>", linked(rows, &here), escaped(what));
    }
    html += "</dl></section>\n<section id=\"faults\"><h2>Faults on purpose</h2>\n<p class=\"intro\">Each makes its row fail: <code>irradiant teach --fault NAME</code>. A test holds this.</p><dl class=\"gaps\">";
    for fault in crate::faults() {
        let _ = write!(
            html,
            "<dt><code>{}</code> \u{2192} {}</dt><dd>{}</dd>",
            fault.name,
            linked(fault.row, &here),
            escaped(fault.what)
        );
    }
    html += "</dl></section>\n</main>\n<script>\n";
    html += include_str!("page.js");
    html += "</script>\n</body>\n</html>\n";
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (text, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(text.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xff, 0xfe, 0xfd]), "//79");
    }

    #[test]
    fn numbers_agree_with_their_words() {
        assert_eq!(counted(1, "row fails", "rows fail"), "1 row fails");
        assert_eq!(counted(0, "row fails", "rows fail") + &slow_too(0), "0 rows fail");
        assert_eq!(counted(2, "row fails", "rows fail") + &slow_too(1), "2 rows fail, 1 is too slow, not wrong");
    }

    #[test]
    fn names_of_rows_become_links_and_nothing_else_does() {
        let here = Here::from(["A38"]);
        assert_eq!(linked("See A38, A99.", &here), "See <a href=\"#A38\">A38</a>, A99.");
        assert_eq!(linked("a < b", &here), "a &lt; b");
    }
}
