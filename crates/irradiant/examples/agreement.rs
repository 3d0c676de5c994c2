//! Agreement with reference pictures of pbrt-v4, and CPU seconds beside its.
//!
//! `cargo run --release -p irradiant --example agreement -- FOLDER [NAME...] [--pictures DIR]`
//!
//! Looks below FOLDER for `NAME.ref.pbrt` with `NAME.ref.exr` (channels R, G, B: mean of 8 independent replicates;
//! SE.R, SE.G, SE.B: its standard error; attribute `comments`: JSON with samples per pixel and CPU seconds). Renders each
//! scene as 8 replicates of other seeds at the same total of samples and prints a table:
//!
//! - *mean*: ours over theirs over all tiles but those brighter than 20 medians, with the joint standard error;
//! - *tiles*: 16 x 16 tiles beyond 4.5 joint standard errors plus 0.5 % of the mean; of how many; in which share a
//!   2 % bias would have been seen;
//! - *lamps*: ours over theirs over pixels that see an emitter directly;
//! - *CPU s*: ours (reading, compiling and rendering of all replicates) and theirs.

use cpu_time::ProcessTime;
use irradiant::image::{Attribute, Image, ReadOptions, read_file};
use irradiant::{Job, MaxDepth, RenderSettings, load};
use std::path::{Path, PathBuf};

const REPLICATES: u32 = 8;
const TILE: usize = 16;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let pictures =
        arguments.iter().position(|a| a == "--pictures").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    let mut words = arguments.iter().filter(|a| *a != "--pictures" && pictures.as_deref() != Some(Path::new(a)));
    let Some(folder) = words.next() else {
        eprintln!("usage: agreement FOLDER [NAME...] [--pictures DIR]");
        std::process::exit(2);
    };
    let names: Vec<&String> = words.collect();
    let mut scenes = Vec::new();
    find(Path::new(folder), &mut scenes);
    scenes.sort();
    scenes.retain(|p| names.is_empty() || names.iter().any(|n| p.to_string_lossy().contains(n.as_str())));
    println!(
        "{:34} {:>6} {:>22} {:>4} {:>14} {:>6} {:>8} {:>8} {:>8} {:>7}",
        "scene", "spp", "mean (joint SE)", "", "tiles off", "seen", "lamps", "CPU s", "pbrt", "ratio"
    );
    let mut failures = 0;
    for scene in &scenes {
        match compare(scene, pictures.as_deref()) {
            Ok(passed) => failures += usize::from(!passed),
            Err(why) => {
                failures += 1;
                println!("{:34} {why}", label(scene));
            }
        }
    }
    println!("{} scenes, {failures} off", scenes.len());
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

/// Means and standard errors, three channels a pixel.
struct Estimate {
    mean: Vec<f64>,
    se: Vec<f64>,
}

fn compare(scene: &Path, pictures: Option<&Path>) -> Result<bool, String> {
    let reference = read_file(&scene.with_extension("exr"), &ReadOptions::default()).map_err(|e| e.to_string())?;
    let (width, height) = (reference.width(), reference.height());
    let theirs =
        Estimate { mean: channels(&reference, ["R", "G", "B"])?, se: channels(&reference, ["SE.R", "SE.G", "SE.B"])? };
    let facts = facts(&reference)?;
    let spp = (facts.spp / REPLICATES).max(1);

    let start = ProcessTime::now();
    let mut sum = vec![0.0; theirs.mean.len()];
    let mut squares = sum.clone();
    let mut last = None;
    for seed in 0..REPLICATES {
        let settings = RenderSettings {
            samples_per_pixel: Some(spp),
            seed: Some(u64::from(seed) + 1),
            ..RenderSettings::default()
        };
        let file = load(scene).map_err(|e| e.to_string())?;
        let rendering = irradiant::render(&file, &settings).map_err(|e| e.to_string())?;
        let image = rendering.image();
        for (i, x) in channels(&image, ["R", "G", "B"])?.into_iter().enumerate() {
            sum[i] += x;
            squares[i] += x * x;
        }
        last = Some(rendering);
    }
    let cpu = start.elapsed().as_secs_f64();
    let n = f64::from(REPLICATES);
    let ours = Estimate {
        se: sum.iter().zip(&squares).map(|(s, q)| ((q - s * s / n).max(0.0) / (n - 1.0) / n).sqrt()).collect(),
        mean: sum.into_iter().map(|s| s / n).collect(),
    };
    if ours.mean.len() != theirs.mean.len() {
        return Err("the pictures differ in size".into());
    }
    if let (Some(folder), Some(rendering)) = (pictures, &last) {
        let name = label(scene).replace('/', "-");
        rendering.save(folder.join(format!("{name}.png"))).map_err(|e| e.to_string())?;
        save_difference(folder.join(format!("{name}-ours.exr")), width, height, &ours.mean)?;
    }

    // Tiles.
    let mut tiles = Vec::new();
    for y0 in (0..height).step_by(TILE) {
        for x0 in (0..width).step_by(TILE) {
            let mut tile = Tile::default();
            for y in y0..(y0 + TILE).min(height) {
                for x in x0..(x0 + TILE).min(width) {
                    for c in 0..3 {
                        let i = (y * width + x) * 3 + c;
                        tile.n += 1.0;
                        tile.ours += ours.mean[i];
                        tile.theirs += theirs.mean[i];
                        tile.variance += ours.se[i].powi(2) + theirs.se[i].powi(2);
                    }
                }
            }
            tiles.push(tile.finish(x0, y0));
        }
    }
    let mut brightness: Vec<f64> = tiles.iter().map(|t| t.theirs).collect();
    brightness.sort_by(f64::total_cmp);
    let median = brightness[brightness.len() / 2];
    let dim: Vec<&Tile> = tiles.iter().filter(|t| t.theirs <= 20.0 * median).collect();
    let (a, b) = dim.iter().fold((0.0, 0.0), |(a, b), t| (a + t.ours * t.n, b + t.theirs * t.n));
    let joint = dim.iter().map(|t| t.variance * t.n * t.n).sum::<f64>().sqrt() / b;
    let ratio = a / b;
    let mean_ok = (ratio - 1.0).abs() < (3.0 * joint).max(0.005);
    let off: Vec<&Tile> = tiles.iter().filter(|t| (t.ours - t.theirs).abs() > t.bound()).collect();
    let seen = tiles.iter().filter(|t| 0.02 * t.theirs > t.bound()).count() as f64 / tiles.len() as f64;

    // Pixels that see an emitter directly: where a picture of emission alone is not black.
    let settings = RenderSettings {
        samples_per_pixel: Some(16),
        max_depth: Some(MaxDepth::Limit(0)),
        ..RenderSettings::default()
    };
    let file = load(scene).map_err(|e| e.to_string())?;
    let job = Job::new(&file, &settings).map_err(|e| e.to_string())?;
    let emission = job.rendering(job.start().wait().film, Default::default()).image();
    let emission = channels(&emission, ["R", "G", "B"])?;
    let (mut a, mut b, mut variance) = (0.0, 0.0, 0.0);
    for (i, e) in emission.iter().enumerate() {
        if *e > 0.0 {
            a += ours.mean[i];
            b += theirs.mean[i];
            variance += ours.se[i].powi(2) + theirs.se[i].powi(2);
        }
    }
    let lamps = if b > 0.0 { Some(a / b) } else { None };
    let lamps_ok = lamps.is_none_or(|r| (r - 1.0).abs() < (3.0 * variance.sqrt() / b).max(0.005));

    let passed = mean_ok && off.is_empty() && lamps_ok;
    println!(
        "{:34} {:>6} {:>12.5} ({:.5}) {:>4} {:>6} of {:>4} {:>5.0} % {:>8} {:>8.1} {:>8.1} {:>7.3}",
        label(scene),
        spp * REPLICATES,
        ratio,
        joint,
        if passed { "ok" } else { "OFF" },
        off.len(),
        tiles.len(),
        100.0 * seen,
        lamps.map_or("-".into(), |r| format!("{r:.5}")),
        cpu,
        facts.cpu_seconds,
        cpu / facts.cpu_seconds
    );
    let mut worst = off;
    worst.sort_by(|a, b| b.excess().total_cmp(&a.excess()));
    for t in worst.iter().take(5) {
        println!(
            "      tile {:3},{:3}: ours {:.5} theirs {:.5} ratio {:.4} z {:.1}",
            t.x,
            t.y,
            t.ours,
            t.theirs,
            t.ours / t.theirs,
            (t.ours - t.theirs) / t.variance.sqrt()
        );
    }
    Ok(passed)
}

#[derive(Default)]
struct Tile {
    x: usize,
    y: usize,
    n: f64,
    ours: f64,
    theirs: f64,
    variance: f64,
}

impl Tile {
    fn finish(self, x: usize, y: usize) -> Self {
        let n = self.n;
        Self { x, y, n, ours: self.ours / n, theirs: self.theirs / n, variance: self.variance / (n * n) }
    }

    fn bound(&self) -> f64 {
        4.5 * self.variance.sqrt() + 0.005 * self.theirs
    }

    fn excess(&self) -> f64 {
        (self.ours - self.theirs).abs() / self.bound().max(1e-12)
    }
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

fn save_difference(path: PathBuf, width: usize, height: usize, mean: &[f64]) -> Result<(), String> {
    let image = Image::from_f32(width, height, &["R", "G", "B"], mean.iter().map(|x| *x as f32).collect())
        .map_err(|e| e.to_string())?;
    let bytes = irradiant::image::write(&image, irradiant::image::FileFormat::Exr).map_err(|e| e.to_string())?;
    irradiant::image::atomic_write(&path, &bytes).map_err(|e| e.to_string())
}
