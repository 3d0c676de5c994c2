//! Error times CPU time, on the same scenes, in one run.

use crate::Setting;
use crate::contestant::{Contestant, Cost};
use crate::machine::{Machine, load};
use crate::peers;
use crate::picture::{Mask, Picture, Truth};
use crate::scene::{self, Scene};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How much to render.
#[derive(Clone, Debug)]
pub struct Amount {
    /// Samples per pixel.
    pub spp: u32,
    /// Pictures of each renderer.
    pub seeds: u32,
    /// Samples per pixel of each of the two references.
    pub reference_spp: u32,
}

/// One renderer on one scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    /// Short, as in the tables.
    pub name: String,
    /// Whether it is Irradiant.
    pub ours: bool,
    /// Name and version.
    pub version: String,
    /// Samples per pixel.
    pub spp: u32,
    /// relMSE of each picture.
    pub errors: Vec<f64>,
    /// relMSE of means over blocks of pixels, of each picture.
    #[serde(default)]
    pub block_errors: Vec<f64>,
    /// CPU seconds of each picture.
    pub cpu_seconds: Vec<f64>,
    /// Seconds of each picture.
    pub seconds: Vec<f64>,
    /// Load of the machine before each picture.
    pub loads: Vec<f64>,
    /// relMSE from how the pictures scatter, without a reference.
    pub scatter: Option<f64>,
    /// Mean of the pictures over the mean of the references, channel by channel.
    pub mean_ratio: [f64; 3],
    /// Compilation of kernels, outside of the CPU seconds.
    pub first_extra_seconds: Option<f64>,
    /// Most memory of the process.
    pub peak_memory_bytes: u64,
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

impl Entry {
    /// The error that counts: against the reference for RGB; from the scatter for the spectral picture, whose colours differ, and for LuxCore,
    /// whose glossy metal does.
    pub fn error(&self) -> f64 {
        let differs = self.name.contains("spectral") || self.name == "LuxCore";
        if differs { self.scatter.unwrap_or(f64::NAN) } else { mean(&self.errors) }
    }

    /// Mean CPU seconds of a picture.
    pub fn cost(&self) -> f64 {
        mean(&self.cpu_seconds)
    }

    /// Error of block means times CPU seconds; NaN where it was not measured.
    pub fn block_product(&self) -> f64 {
        mean(&self.block_errors) * self.cost()
    }

    /// Error times CPU seconds: the measure.
    pub fn product(&self) -> f64 {
        self.error() * self.cost()
    }

    /// Standard error of the product's relative value, from the scatter of errors between seeds.
    pub fn uncertainty(&self) -> f64 {
        let (m, n) = (mean(&self.errors), self.errors.len() as f64);
        let variance = self.errors.iter().map(|e| (e - m).powi(2)).sum::<f64>() / (n - 1.0);
        (variance / n).sqrt() / m
    }
}

/// All renderers on one scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Where and when.
    pub machine: Machine,
    /// Of the scene.
    pub scene: String,
    /// Pixels.
    pub resolution: [u32; 2],
    /// Triangles.
    pub triangles: usize,
    /// Threads of each renderer.
    pub threads: usize,
    /// Pixels that see a lamp, in per cent.
    pub masked_percent: f64,
    /// Of each of the two references.
    pub reference_spp: u32,
    /// Which two.
    pub references: String,
    /// Mean of one over mean of the other.
    pub reference_ratio: [f64; 3],
    /// relMSE of one to the other.
    pub reference_apart: f64,
    /// In the order in which they ran.
    pub entries: Vec<Entry>,
    /// Peers that did not run, and why.
    pub missing: Vec<String>,
}

/// The scene, written for everybody.
pub fn write_scene(scene: &Scene, work: &Path) -> Result<PathBuf, String> {
    let folder = work.join(scene.name);
    scene::pbrt::write(scene, &folder)?;
    scene::neutral::write(scene, &folder)?;
    if let Some(sky) = &scene.sky {
        sky.write(&folder)?;
    }
    Ok(folder)
}

/// A reference of many samples, as the mean of independent pictures; those on disk are used again.
pub fn reference(name: &str, contestant: &mut dyn Contestant, spp: u32, folder: &Path) -> Result<Picture, String> {
    let each = spp.min(128);
    let mut pictures = Vec::new();
    for i in 0..spp.div_ceil(each) {
        let path = folder.join(format!("reference-{name}-{each}-{i}.pfm"));
        if !path.exists() {
            let partial = path.with_extension("partial.pfm");
            contestant.render(each, 7000 + i, &partial)?;
            std::fs::rename(&partial, &path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        pictures.push(Picture::read(&path)?);
    }
    Picture::mean(&pictures).ok_or_else(|| "no samples for the reference".into())
}

/// Samples per pixel of a picture, if `spp` is what the quick ones take.
fn samples(spp: u32, slow: bool) -> u32 {
    if slow { (spp / 4).max(1) } else { spp }
}

/// Compares on one scene and prints as it goes.
pub fn run(scene: &Scene, amount: &Amount, setting: &Setting) -> Result<Report, String> {
    let machine = Machine::here(&setting.repository, setting.given);
    let folder = write_scene(scene, &setting.work)?;
    println!("{}: {:?} pixels, {} triangles, {} spp", scene.name, scene.resolution, scene.triangles(), amount.spp);
    let (mut contestants, missing) = peers::all(setting, &folder);
    for what in &missing {
        println!("  left out: {what}");
    }
    // Pixels that see a lamp.
    let emission = folder.join("emission.pfm");
    peers::irradiant(setting, &folder, &["--color", "rgb", "--max-depth", "0"]).render(64, 1, &emission)?;
    let mask = Mask::without_lamps(&Picture::read(&emission)?);
    // Two references: ours and Mitsuba's, or, without it, two of ours.
    let mut ours = peers::irradiant(setting, &folder, &["--color", "rgb"]);
    let first = reference("irradiant", &mut ours, amount.reference_spp, &folder)?;
    let mitsuba = contestants.iter_mut().find(|(name, _)| name == "Mitsuba llvm");
    let (second, references) = match mitsuba {
        Some((_, m)) => {
            (reference("mitsuba", m.as_mut(), amount.reference_spp, &folder)?, "Irradiant rgb and Mitsuba llvm")
        }
        None => (
            reference("irradiant-again", &mut ours.other_seeds(), amount.reference_spp, &folder)?,
            "Irradiant rgb twice",
        ),
    };
    let truth = Truth::new(first, second, mask).ok_or("no reference")?;
    let (reference_ratio, reference_apart) = truth.agreement();
    println!("  references ({references}): ratio of means {reference_ratio:.5?}, apart {reference_apart:.2e}");
    // Interleaved: everybody's first picture, everybody's second, ...
    let mut costs: Vec<Vec<(Cost, f64)>> = contestants.iter().map(|_| Vec::new()).collect();
    let mut pictures: Vec<Vec<Picture>> = costs.iter().map(|_| Vec::new()).collect();
    for seed in 0..amount.seeds {
        for (i, (name, contestant)) in contestants.iter_mut().enumerate() {
            // The slowest peers are asked twice at most, for a quarter of the samples; their figures are far from mattering.
            let slow = peers::is_slow(name);
            if seed >= 2 && slow {
                continue;
            }
            let spp = samples(amount.spp, slow);
            let out = folder.join(format!("{}-{seed}.pfm", name.replace(' ', "-")));
            let before = load();
            let cost = match contestant.render(spp, seed + 1, &out) {
                Ok(cost) => cost,
                Err(why) => {
                    println!("  {name}: {why}");
                    continue;
                }
            };
            let picture = Picture::read(&out)?;
            let error = truth.relative_error(&picture);
            let rate = scene.pixels() as f64 * f64::from(spp) / cost.cpu_seconds / 1e6;
            println!(
                "  {name:18} seed {seed}, {spp:3} spp: relMSE {error:.5}, {:6.2} CPU s, {rate:6.3} Mpaths/CPU s, error x time {:.5}, load {before:.1}",
                cost.cpu_seconds,
                error * cost.cpu_seconds
            );
            costs[i].push((cost, before));
            pictures[i].push(picture);
        }
    }
    let expected = truth.average();
    let mut entries = Vec::new();
    for (((name, contestant), costs), pictures) in contestants.iter().zip(&costs).zip(&pictures) {
        let Some(mean_picture) = Picture::mean(pictures) else { continue };
        let found = mean_picture.average(truth.mask());
        entries.push(Entry {
            name: name.clone(),
            ours: name.starts_with("Irradiant"),
            version: contestant.version(),
            spp: samples(amount.spp, peers::is_slow(name)),
            errors: pictures.iter().map(|p| truth.relative_error(p)).collect(),
            cpu_seconds: costs.iter().map(|(c, _)| c.cpu_seconds).collect(),
            seconds: costs.iter().map(|(c, _)| c.seconds).collect(),
            loads: costs.iter().map(|(_, l)| *l).collect(),
            block_errors: pictures.iter().map(|p| truth.relative_error_of_blocks(p)).collect(),
            scatter: truth.scatter(pictures),
            mean_ratio: std::array::from_fn(|c| found[c] / expected[c]),
            first_extra_seconds: costs.iter().find_map(|(c, _)| c.first_extra_seconds),
            peak_memory_bytes: costs.iter().map(|(c, _)| c.peak_memory_bytes).max().unwrap_or(0),
        });
    }
    Ok(Report {
        machine,
        scene: scene.name.into(),
        resolution: scene.resolution,
        triangles: scene.triangles(),
        threads: setting.threads,
        masked_percent: 100.0 * (1.0 - truth.mask().len() as f64 / scene.pixels() as f64),
        reference_spp: amount.reference_spp,
        references: references.into(),
        reference_ratio,
        reference_apart,
        entries,
        missing,
    })
}
