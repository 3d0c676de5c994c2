//! Agreement with reference pictures of pbrt-v4, and CPU seconds beside its.
//!
//! `cargo run --release -p irradiant --example agreement -- FOLDER [NAME...] [--scale S] [--times K] [--seed N]
//! [--json FILE] [--pictures DIR]`
//!
//! Looks below FOLDER for `NAME.ref.pbrt` with `NAME.ref.exr` (channels R, G, B: mean of 8 independent replicates;
//! SE.R, SE.G, SE.B: its standard error; attribute `comments`: JSON with samples per pixel and CPU seconds). Renders each
//! scene as 8 replicates of other seeds (1 to 8) at the same total of samples and prints a table:
//!
//! - *mean*: ours over theirs over all tiles but those brighter than 20 medians, with the joint standard error; agrees
//!   within 0.5 % or 3 errors;
//! - *off*: of how many 16 x 16 tiles how many are beyond 4.5 joint standard errors plus 0.5 % of their mean; the worst
//!   stand below the line;
//! - *seen*: the share of tiles in which a 2 % bias would have been seen;
//! - *lamps*: ours over theirs over pixels that see an emitter directly; agrees within 0.5 %;
//! - *CPU s*: ours, reading, compiling and rendering of all replicates; *pbrt*: its, times `--scale` (how many times
//!   slower this machine is than the one of the references) and `--times`; *ratio*: ours over that;
//! - the verdict.
//!
//! `--times K` renders 8 K replicates (not longer ones: the footprint of textures, and so the expectation, depends on a
//! replicate's samples), `--seed N` starts at another seed: whether a tile is off by chance or in truth. `--pictures DIR`
//! keeps the last replicate as PNG and the mean as EXR; `--json FILE` the table with all its digits.
//!
//! The statistics, with their reasons and tests, are in `statistics.rs`. Ends with 1 if a scene is off, 0 else.

mod statistics;

use cpu_time::ProcessTime;
use irradiant::image::{Attribute, FileFormat, Image, ReadOptions, atomic_write, read_file, write};
use irradiant::{Job, MaxDepth, RenderSettings, load};
use statistics::{Agreement, Picture, Replicates};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Replicates of the references.
const REPLICATES: u32 = 8;
const USAGE: &str =
    "usage: agreement FOLDER [NAME...] [--scale S] [--times K] [--seed N] [--json FILE] [--pictures DIR]";

struct Arguments {
    folder: PathBuf,
    names: Vec<String>,
    scale: f64,
    times: u32,
    seed: u64,
    json: Option<PathBuf>,
    pictures: Option<PathBuf>,
}

impl Arguments {
    fn parse(mut words: impl Iterator<Item = String>) -> Option<Self> {
        let (mut scale, mut times, mut seed, mut json, mut pictures) = (1.0, 1, 1, None, None);
        let mut plain = Vec::new();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--scale" => scale = words.next()?.parse().ok().filter(|s| *s > 0.0)?,
                "--times" => times = words.next()?.parse().ok().filter(|k| (1..1000).contains(k))?,
                "--seed" => seed = words.next()?.parse().ok()?,
                "--json" => json = Some(words.next()?.into()),
                "--pictures" => pictures = Some(words.next()?.into()),
                option if option.starts_with("--") => return None,
                _ => plain.push(word),
            }
        }
        let mut plain = plain.into_iter();
        Some(Self { folder: plain.next()?.into(), names: plain.collect(), scale, times, seed, json, pictures })
    }
}

fn main() -> ExitCode {
    let Some(arguments) = Arguments::parse(std::env::args().skip(1)) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let mut scenes = Vec::new();
    find(&arguments.folder, &mut scenes);
    scenes.sort();
    scenes.retain(|p| {
        arguments.names.is_empty() || arguments.names.iter().any(|n| p.to_string_lossy().contains(n.as_str()))
    });
    println!(
        "{:34} {:>5} {:>17} {:>11} {:>5} {:>8} {:>7} {:>7} {:>6}",
        "scene", "spp", "mean (error)", "tiles off", "seen", "lamps", "CPU s", "pbrt", "ratio"
    );
    let mut rows = Vec::new();
    let (mut off, mut cpu, mut pbrt) = (0, 0.0, 0.0);
    for scene in &scenes {
        match compare(scene, &arguments) {
            Ok(row) => {
                row.print();
                off += usize::from(!row.found.agrees());
                cpu += row.cpu;
                pbrt += row.pbrt;
                rows.push(row.json());
            }
            Err(why) => {
                off += 1;
                println!("{:34} OFF: {why}", label(scene));
                rows.push(format!("{{\"scene\": {:?}, \"agrees\": false, \"error\": {why:?}}}", label(scene)));
            }
        }
    }
    let n = scenes.len();
    println!("{n} scenes, {} agree, {off} off; {cpu:.1} CPU s, pbrt {pbrt:.1}, ratio {:.3}", n - off, cpu / pbrt);
    if let Some(file) = &arguments.json {
        let text = format!(
            "{{\"scale\": {}, \"times\": {}, \"seed\": {}, \"off\": {off}, \"scenes\": [\n  {}\n]}}\n",
            arguments.scale,
            arguments.times,
            arguments.seed,
            rows.join(",\n  ")
        );
        if let Err(why) = atomic_write(file, text.as_bytes()) {
            eprintln!("{why}");
            return ExitCode::from(74);
        }
    }
    ExitCode::from(u8::from(off > 0 || n == 0))
}

fn find(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            find(&path, found);
        } else if path.to_string_lossy().ends_with(".ref.pbrt") && path.with_extension("exr").exists() {
            found.push(path);
        }
    }
}

fn label(scene: &Path) -> String {
    let part = |p: Option<&std::ffi::OsStr>| p.unwrap_or_default().to_string_lossy().into_owned();
    let folder = part(scene.parent().and_then(Path::file_name));
    format!("{folder}/{}", part(scene.file_name()).trim_end_matches(".ref.pbrt"))
}

/// One scene's line of the table.
struct Row {
    scene: String,
    spp: u32,
    found: Agreement,
    cpu: f64,
    pbrt: f64,
}

impl Row {
    fn print(&self) {
        let found = &self.found;
        println!(
            "{:34} {:>5} {:>8.5} ({:.5}) {:>3} of {:>4} {:>3.0} % {:>8} {:>7.1} {:>7.1} {:>6.3}  {}",
            self.scene,
            self.spp,
            found.mean.value,
            found.mean.se,
            found.off.len(),
            found.n_tiles,
            100.0 * found.seen,
            found.lamps.map_or("-".into(), |r| format!("{:.5}", r.value)),
            self.cpu,
            self.pbrt,
            self.cpu / self.pbrt,
            found.verdict()
        );
        for t in found.off.iter().take(5) {
            let ratio = t.ours / t.theirs;
            println!(
                "      tile {},{}: ours {:.5} theirs {:.5} ratio {ratio:.4} z {:.1}",
                t.x,
                t.y,
                t.ours,
                t.theirs,
                t.z()
            );
        }
    }

    fn json(&self) -> String {
        // JSON has no NaN.
        let number = |x: f64| if x.is_finite() { format!("{x}") } else { "null".into() };
        let found = &self.found;
        let (lamps, lamps_se) = found.lamps.map_or(("null".into(), "null".into()), |r| (number(r.value), number(r.se)));
        let tiles = found.off.iter().map(|t| {
            let [ours, theirs, z] = [t.ours, t.theirs, t.z()].map(number);
            format!("{{\"x\": {}, \"y\": {}, \"ours\": {ours}, \"theirs\": {theirs}, \"z\": {z}}}", t.x, t.y)
        });
        format!(
            "{{\"scene\": {:?}, \"spp\": {}, \"mean\": {}, \"mean_se\": {}, \"tiles\": {}, \"tiles_off\": [{}], \
             \"seen\": {}, \"lamps\": {lamps}, \"lamps_se\": {lamps_se}, \"cpu_seconds\": {}, \
             \"pbrt_cpu_seconds\": {}, \"ratio\": {}, \"agrees\": {}, \"verdict\": {:?}}}",
            self.scene,
            self.spp,
            number(found.mean.value),
            number(found.mean.se),
            found.n_tiles,
            tiles.collect::<Vec<_>>().join(", "),
            number(found.seen),
            number(self.cpu),
            number(self.pbrt),
            number(self.cpu / self.pbrt),
            found.agrees(),
            found.verdict()
        )
    }
}

fn compare(scene: &Path, arguments: &Arguments) -> Result<Row, String> {
    let reference = read_file(&scene.with_extension("exr"), &ReadOptions::default()).map_err(|e| e.to_string())?;
    let theirs = Picture {
        width: reference.width(),
        height: reference.height(),
        mean: channels(&reference, ["R", "G", "B"])?,
        se: channels(&reference, ["SE.R", "SE.G", "SE.B"])?,
    };
    let pixels = theirs.width * theirs.height;
    let facts = facts(&reference)?;
    let spp = facts.spp.div_ceil(REPLICATES);
    let count = REPLICATES * arguments.times;

    let start = ProcessTime::now();
    let mut ours = Replicates::new(pixels);
    let mut last = None;
    for replicate in 0..count {
        let settings = RenderSettings {
            samples_per_pixel: Some(spp),
            seed: Some(arguments.seed.wrapping_add(u64::from(replicate))),
            ..RenderSettings::default()
        };
        let file = load(scene).map_err(|e| e.to_string())?;
        let rendering = irradiant::render(&file, &settings).map_err(|e| e.to_string())?;
        if !ours.add(&channels(&rendering.image(), ["R", "G", "B"])?) {
            return Err("the pictures differ in size".into());
        }
        last = Some(rendering);
    }
    let cpu = start.elapsed().as_secs_f64();

    if let (Some(folder), Some(rendering)) = (&arguments.pictures, &last) {
        let name = label(scene).replace('/', "-");
        rendering.save(folder.join(format!("{name}.png"))).map_err(|e| e.to_string())?;
        let mean = (0..3 * pixels).map(|i| ours.mean(i) as f32).collect();
        save(&folder.join(format!("{name}-ours.exr")), theirs.width, theirs.height, mean)?;
    }
    Ok(Row {
        scene: label(scene),
        spp: spp * count,
        found: Agreement::new(&ours, &theirs, &lamp_pixels(scene)?),
        cpu,
        pbrt: facts.cpu_seconds * arguments.scale * f64::from(arguments.times),
    })
}

/// Pixels that see an emitter directly: where a picture of emission alone is not black.
fn lamp_pixels(scene: &Path) -> Result<Vec<bool>, String> {
    let settings = RenderSettings {
        samples_per_pixel: Some(16),
        max_depth: Some(MaxDepth::Limit(0)),
        ..RenderSettings::default()
    };
    let file = load(scene).map_err(|e| e.to_string())?;
    let job = Job::new(&file, &settings).map_err(|e| e.to_string())?;
    let emission = job.rendering(job.start().wait().film, Default::default()).image();
    Ok(channels(&emission, ["R", "G", "B"])?.chunks_exact(3).map(|p| p.iter().any(|e| *e > 0.0)).collect())
}

struct Facts {
    spp: u32,
    cpu_seconds: f64,
}

fn facts(reference: &Image) -> Result<Facts, String> {
    let Some(Attribute::Text(text)) = reference.metadata.attribute("comments") else {
        return Err("the reference has no comments attribute".into());
    };
    let number = |key: &str| -> Option<f64> {
        let rest = &text[text.find(&format!("\"{key}\":"))? + key.len() + 3..];
        let end = rest.find([',', '}'])?;
        rest[..end].trim().parse().ok()
    };
    match (number("spp"), number("cpu_seconds")) {
        (Some(spp), Some(cpu_seconds)) => Ok(Facts { spp: spp as u32, cpu_seconds }),
        _ => Err("the reference's comments lack spp or cpu_seconds".into()),
    }
}

fn channels(image: &Image, names: [&str; 3]) -> Result<Vec<f64>, String> {
    let selected = image.select(&names).ok_or_else(|| format!("no channels {names:?}"))?;
    Ok(selected.to_f32().into_iter().map(f64::from).collect())
}

fn save(path: &Path, width: usize, height: usize, values: Vec<f32>) -> Result<(), String> {
    let image = Image::from_f32(width, height, &["R", "G", "B"], values).map_err(|e| e.to_string())?;
    let bytes = write(&image, FileFormat::Exr).map_err(|e| e.to_string())?;
    atomic_write(path, &bytes).map_err(|e| e.to_string())
}
