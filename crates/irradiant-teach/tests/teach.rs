//! The lesson as a whole: 120 rows, faults that bite, a page that a browser can show.

use irradiant_teach::{Budget, Settings, Verdict, faults, page, rows, teach};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder of this test's own, gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("irradiant-teach-test-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn settings(folder: &Folder, only: &[&str], fault: Option<&str>) -> Settings {
    Settings {
        budget: Budget::Quick,
        only: only.iter().map(|s| s.to_string()).collect(),
        fault: fault.map(String::from),
        folder: Some(folder.0.clone()),
        ..Settings::default()
    }
}

#[test]
fn every_row_of_both_lectures_is_there_once() {
    let ids: Vec<&str> = rows().iter().map(|r| r.id).collect();
    let expected: Vec<String> =
        (1..=73).map(|i| format!("A{i:02}")).chain((1..=47).map(|i| format!("B{i:02}"))).collect();
    assert_eq!(ids, expected);
    for row in rows() {
        assert!(!row.name.is_empty() && !row.says.is_empty() && row.check.ends_with(['.', ')']), "{}", row.id);
    }
}

#[test]
fn there_are_at_least_twenty_faults_each_of_a_row_of_its_own() {
    let of: BTreeSet<&str> = faults().iter().map(|f| f.row).collect();
    assert!(of.len() >= 20 && of.len() == faults().len(), "{}", of.len());
    assert!(of.iter().all(|id| rows().iter().any(|r| r.id == *id)));
    let names: BTreeSet<&str> = faults().iter().map(|f| f.name).collect();
    assert_eq!(names.len(), faults().len());
}

#[test]
fn faults_make_their_rows_fail() {
    let folder = Folder::new("faults");
    let mut unnoticed = vec![];
    for fault in faults() {
        let wrong = teach(&settings(&folder, &[], Some(fault.name)), |_| {}).expect("runs");
        let told = &wrong.told[0];
        assert_eq!((wrong.told.len(), told.row.id), (1, fault.row));
        // A measure is out of bounds, not merely a render that could not be made.
        let failed =
            matches!(told.outcome.verdict, Verdict::Fails(_)) && told.outcome.measures.iter().any(|m| !m.passes);
        if !failed {
            unnoticed.push(format!("{} of {}: {:?}", fault.name, fault.row, told.outcome.verdict));
        }
    }
    assert!(unnoticed.is_empty(), "faults that their rows did not notice: {unnoticed:#?}");
}

/// The rows with faults that are quick enough to be run without them too; `irradiant teach` runs all.
const QUICK: [&str; 12] = ["A09", "A11", "A13", "A17", "A19", "A27", "A63", "A64", "B21", "B28", "B35", "B38"];

#[test]
fn the_same_rows_pass_without_faults() {
    let folder = Folder::new("right");
    let right = teach(&settings(&folder, &QUICK, None), |_| {}).expect("runs");
    for told in &right.told {
        assert_eq!(told.outcome.verdict, Verdict::Passes, "{} without a fault", told.row.id);
    }
    assert!(QUICK.iter().all(|id| faults().iter().any(|f| f.row == *id)));
}

/// Rows whose commands are of all kinds. That every command of every row names a scene that was written, the rows themselves check.
const COMMANDED: [&str; 7] = ["A09", "A19", "A27", "B18", "B28", "B38", "B47"];

#[test]
fn commands_name_scenes_that_parse_and_samples_that_they_have() {
    let folder = Folder::new("commands");
    let lesson = teach(&settings(&folder, &COMMANDED, None), |_| {}).expect("runs");
    let mut kinds = BTreeSet::new();
    for command in lesson.told.iter().flat_map(|t| &t.outcome.commands) {
        let words: Vec<&str> = command.split_whitespace().collect();
        let Some(path) = words.iter().find(|w| w.ends_with(".pbrt")) else { continue };
        kinds.insert(words[1]);
        let file = irradiant::load(Path::new(path)).unwrap_or_else(|e| panic!("{command}: {e}"));
        let scene = irradiant::Job::new(&file, &irradiant::RenderSettings::default())
            .unwrap_or_else(|e| panic!("{command}: {e}"))
            .scene;
        let after = |option: &str| words.iter().position(|w| *w == option).map(|i| words[i + 1]);
        if let Some(sample) = after("--sample") {
            assert!(sample.parse::<u32>().expect("a number") < scene.samples_per_pixel, "{command}");
        }
        if let Some((x, y)) = after("--pixel").and_then(|pixel| pixel.split_once(',')) {
            let bounds = scene.bounds();
            let (x, y): (i32, i32) = (x.parse().expect("a number"), y.parse().expect("a number"));
            assert!((bounds.x0..bounds.x1).contains(&x) && (bounds.y0..bounds.y1).contains(&y), "{command}");
        }
    }
    assert_eq!(kinds, BTreeSet::from(["check", "probe", "render"]));
}

#[test]
fn unknown_rows_and_faults_are_refused() {
    let folder = Folder::new("unknown");
    assert!(teach(&settings(&folder, &["A99"], None), |_| {}).is_err());
    assert!(teach(&settings(&folder, &[], Some("gremlins")), |_| {}).is_err());
}

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .flat_map(|d| ["chromium", "chromium-browser", "google-chrome"].map(|n| d.join(n)))
        .find(|p| p.is_file())
}

/// The page as a browser has it after scripts ran, with a probe appended that writes what it found into the title.
fn browse(page: &Path, width: u32, milliseconds: u32) -> Option<String> {
    let out = Command::new(chromium()?)
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .arg(format!("--virtual-time-budget={milliseconds}"))
        .arg(format!("--window-size={width},900"))
        .arg(format!("file://{}", page.display()))
        .output()
        .ok()?;
    Some(String::from_utf8_lossy(&out.stdout).into_owned())
}

#[test]
fn the_page_shows_on_a_phone_with_all_its_pictures_and_links() {
    let folder = Folder::new("page");
    let lesson = teach(&settings(&folder, &["A11", "A63", "A64", "B04", "B44"], None), |_| {}).expect("runs");
    let html = page::page(&lesson);
    // Nothing is loaded from anywhere.
    for outside in ["http://", "https://", "src=\"/", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.matches("data:image/png;base64,").count() >= 2);
    // Every link leads to a row or a section of the page.
    for target in html.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(html.contains(&format!("id=\"{target}\"")), "#{target} leads nowhere");
    }
    if chromium().is_none() {
        eprintln!("SKIPPED: no chromium on this machine; the page was not looked at by a browser");
        return;
    }
    // A frame of a phone's width holds the page: headless windows may not be that narrow.
    let probe = "<script>addEventListener('load',()=>{const i=[...document.images];Promise.all(i.map(x=>x.decode().then(()=>1,()=>0))).then(d=>{\
        const w=document.documentElement;let wide='';document.querySelectorAll('body *').forEach(e=>{const r=e.getBoundingClientRect();if(r.right>w.clientWidth+1&&!wide)wide=e.tagName+'.'+e.className});\
        const hidden=(()=>{document.querySelector('input[value=fails]').click();return [...document.querySelectorAll('.row')].filter(r=>r.offsetParent).length})();\
        parent.postMessage(['PROBE',i.length,d.filter(x=>x).length,w.clientWidth,w.scrollWidth,wide,hidden].join('|'),'*')})})</script>";
    let inner = folder.0.join("inner.html");
    std::fs::write(&inner, html.replace("</body>", &format!("{probe}</body>"))).expect("writes");
    for width in [360, 1200] {
        let frame = folder.0.join(format!("frame-{width}.html"));
        let outer = format!(
            "<!doctype html><p id=r>nothing</p><iframe src=\"inner.html\" style=\"width:{width}px;height:800px;border:0\"></iframe><script>addEventListener('message',e=>{{document.getElementById('r').textContent=e.data}})</script>"
        );
        std::fs::write(&frame, outer).expect("writes");
        // Pictures decode in the machine's time and the browser waits in its own: on a busy machine it may look too early.
        let answer = (0..8).find_map(|i| {
            let dom = browse(&frame, 1400, 4000 << i).expect("chromium runs");
            Some(dom.split("PROBE|").nth(1)?.split('<').next()?.to_owned())
        });
        let found = answer.expect("the page answers the probe");
        let parts: Vec<&str> = found.split('|').collect();
        let number = |i: usize| parts[i].parse::<u32>().expect("a number");
        assert!(number(0) >= 2 && number(0) == number(1), "{} of {} pictures decode", parts[1], parts[0]);
        assert!(number(2) <= width && number(3) <= number(2), "wider than its window at {width}: {found}");
        assert_eq!(parts[4], "", "sticks out at {width}");
        assert_eq!(number(5), 0, "the filter for failures shows rows that do not fail");
    }
}
