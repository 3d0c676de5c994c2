//! The street: what 16 paths per pixel cost, how the error falls, and what the error of 16 independent samples costs.

use crate::Setting;
use crate::contestant::{Contestant, Irradiant};
use crate::machine::{Machine, load};
use crate::peers::{self, Contestants};
use crate::picture::{Mask, Picture, Truth, write_half_size};
use crate::pictures::{reference, write_scene};
use crate::scene;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How much to render.
#[derive(Clone, Copy, Debug)]
pub struct Amount {
    /// Samples per pixel of each of the two references.
    pub reference_spp: u32,
    /// The curve goes on to this number of samples per pixel, and at least to 16.
    pub largest_spp: u32,
    /// Width and height are divided by this.
    pub shrink: u32,
}

/// Pictures of one kind.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Who rendered.
    pub name: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Pictures, each of its own seed.
    #[serde(default = "one")]
    pub pictures: u32,
    /// relMSE, the mean over pictures.
    pub error: f64,
    /// Standard error of that mean, if there are pictures enough to tell.
    #[serde(default)]
    pub uncertainty: Option<f64>,
    /// CPU seconds, the mean over pictures.
    pub cpu_seconds: f64,
    /// Load of the machine before.
    pub load: f64,
    /// Name and version.
    #[serde(default)]
    pub version: String,
}

fn one() -> u32 {
    1
}

/// Pictures of a number of samples: a few samples leave an error that differs from seed to seed, half of which lies in one pixel of a hundred.
fn pictures(spp: u32) -> u32 {
    (8 / spp).max(1)
}

/// What a picture takes on a number of threads.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct OnThreads {
    /// How many.
    pub threads: usize,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds on the wall, without loading and building.
    pub seconds: f64,
    /// CPU seconds.
    pub cpu_seconds: f64,
    /// Load of the machine before.
    pub load: f64,
}

/// All of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Where and when.
    pub machine: Machine,
    /// Triangles.
    pub triangles: usize,
    /// Pixels.
    pub resolution: [u32; 2],
    /// Pixels that see the sky, in per cent.
    pub masked_percent: f64,
    /// Samples per pixel of each of two references.
    pub reference_spp: u32,
    /// Which two.
    pub references: String,
    /// Mean of one over mean of the other.
    pub reference_ratio: [f64; 3],
    /// Renders.
    pub points: Vec<Point>,
    /// relMSE of Irradiant with 16 independent samples.
    pub independent_error: f64,
    /// Samples per pixel that have this error, between those measured.
    pub equal_error_spp: Option<f64>,
    /// CPU seconds that they take.
    pub equal_error_cpu_seconds: Option<f64>,
    /// The same by shared paths.
    #[serde(default)]
    pub shared_equal_error_spp: Option<f64>,
    /// The same by shared paths.
    #[serde(default)]
    pub shared_equal_error_cpu_seconds: Option<f64>,
    /// 16 paths per pixel on two threads.
    #[serde(default)]
    pub on_two: Option<OnThreads>,
    /// What was left out.
    pub missing: Vec<String>,
}

/// Where a falling curve of (x, error, cost) crosses an error, on logarithmic scales.
fn crossing(curve: &[(f64, f64, f64)], error: f64) -> Option<(f64, f64)> {
    let pair = curve.windows(2).find(|w| w[0].1 >= error && w[1].1 <= error)?;
    let k = (error / pair[0].1).ln() / (pair[1].1 / pair[0].1).ln();
    let between = |a: f64, b: f64| a * (b / a).powf(k);
    Some((between(pair[0].0, pair[1].0), between(pair[0].2, pair[1].2)))
}

/// Renders and prints as it goes.
pub fn run(amount: &Amount, setting: &Setting) -> Result<Report, String> {
    let machine = Machine::here(&setting.repository, setting.given);
    let mut scene = scene::by_name("street").ok_or("no street")?;
    let reference_spp = amount.reference_spp;
    // References of one size are not those of another.
    let mut work = setting.work.clone();
    if amount.shrink > 1 {
        scene.resolution = scene.resolution.map(|n| n / amount.shrink);
        work.push(format!("shrunk-{}", amount.shrink));
    }
    let folder = write_scene(&scene, &work)?;
    println!("street: {} triangles, {:?} pixels", scene.triangles(), scene.resolution);
    let (mut peers, missing) = peers::all(setting, &folder);
    peers.retain(|(name, _)| name == "Mitsuba llvm");
    let rgb: &[&str] = &["--color", "rgb"];
    let emission = folder.join("emission.pfm");
    peers::irradiant(setting, &folder, &["--color", "rgb", "--max-depth", "0"]).render(16, 1, &emission)?;
    let mask = Mask::without_lamps(&Picture::read(&emission)?);
    let mut ours = peers::irradiant(setting, &folder, rgb);
    let first = reference("irradiant", &mut ours, reference_spp, &folder)?;
    let (second, references) = match peers.first_mut() {
        Some((_, m)) => (reference("mitsuba", m.as_mut(), reference_spp, &folder)?, "Irradiant rgb and Mitsuba llvm"),
        None => (reference("irradiant-again", &mut ours.other_seeds(), reference_spp, &folder)?, "Irradiant rgb twice"),
    };
    let truth = Truth::new(first, second, mask).ok_or("no reference")?;
    // The same scene with independent samples.
    let independent = folder.join("independent");
    scene::pbrt::link(&folder, &independent, "zsobol", "independent")?;
    let mut contestants: Contestants = vec![
        ("Irradiant rgb".into(), Box::new(ours)),
        (
            "Irradiant shared".into(),
            Box::new(peers::irradiant(setting, &folder, &["--color", "rgb", "--integrator", "sharedpath"])),
        ),
        ("Irradiant spectral".into(), Box::new(peers::irradiant(setting, &folder, &["--color", "spectral"]))),
        ("Irradiant independent".into(), Box::new(peers::irradiant(setting, &independent, rgb))),
    ];
    contestants.append(&mut peers);
    let mut points = Vec::new();
    for spp in [1, 2, 4, 8, 16, 32, 64].into_iter().filter(|&s| s <= amount.largest_spp.max(16)) {
        for (name, contestant) in &mut contestants {
            if spp != 16 && name != "Irradiant rgb" && name != "Irradiant shared" {
                continue;
            }
            let out = folder.join(format!("{}-{spp}.pfm", name.replace(' ', "-")));
            let before = load();
            let (mut errors, mut cpu_seconds) = (Vec::new(), 0.0);
            for seed in 1..=pictures(spp) {
                cpu_seconds += contestant.render(spp, seed, &out)?.cpu_seconds / f64::from(pictures(spp));
                errors.push(truth.relative_error(&Picture::read(&out)?));
            }
            if name == "Irradiant rgb" && spp == 16 {
                write_half_size(&out, &setting.results.join("street.jpg"), 1.3)?;
            }
            let (error, uncertainty) = mean_and_its_error(&errors);
            let rate = scene.pixels() as f64 * f64::from(spp) / cpu_seconds / 1e6;
            println!(
                "  {name:22} {spp:3} spp: relMSE {error:.5}, {cpu_seconds:6.2} CPU s, {rate:6.3} Mpaths/CPU s, load {before:.1}",
            );
            let (name, version, pictures) = (name.clone(), contestant.version(), pictures(spp));
            points.push(Point { name, spp, pictures, error, uncertainty, cpu_seconds, load: before, version });
        }
    }
    let on_two = on_threads(2, setting, &folder)?;
    let find = |name: &str| points.iter().filter(|p| p.name == name).collect::<Vec<_>>();
    let independent_error = find("Irradiant independent").first().map_or(f64::NAN, |p| p.error);
    let crossed_by = |name: &str| {
        let curve: Vec<_> = find(name).iter().map(|p| (f64::from(p.spp), p.error, p.cpu_seconds)).collect();
        crossing(&curve, independent_error)
    };
    let (crossed, shared) = (crossed_by("Irradiant rgb"), crossed_by("Irradiant shared"));
    Ok(Report {
        machine,
        triangles: scene.triangles(),
        resolution: scene.resolution,
        masked_percent: 100.0 * (1.0 - truth.mask().len() as f64 / scene.pixels() as f64),
        reference_spp,
        references: references.into(),
        reference_ratio: truth.agreement().0,
        points,
        independent_error,
        equal_error_spp: crossed.map(|c| c.0),
        equal_error_cpu_seconds: crossed.map(|c| c.1),
        shared_equal_error_spp: shared.map(|c| c.0),
        shared_equal_error_cpu_seconds: shared.map(|c| c.1),
        on_two: Some(on_two),
        missing,
    })
}

fn mean_and_its_error(errors: &[f64]) -> (f64, Option<f64>) {
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let square = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
    (mean, (n > 1.0).then(|| (square / (n - 1.0) / n).sqrt()))
}

/// 16 paths per pixel, whatever the number of threads that everybody else has.
fn on_threads(threads: usize, setting: &Setting, folder: &Path) -> Result<OnThreads, String> {
    let (spp, load) = (16, load());
    let mut ours = Irradiant::new(&setting.irradiant, &folder.join("scene.pbrt"), threads, &["--color", "rgb"]);
    let cost = ours.render(spp, 1, &folder.join(format!("on-{threads}-threads.pfm")))?;
    println!("  {threads} threads: {:.2} s on the wall, {:.2} CPU s, load {load:.1}", cost.seconds, cost.cpu_seconds);
    Ok(OnThreads { threads, spp, seconds: cost.seconds, cpu_seconds: cost.cpu_seconds, load })
}

#[cfg(test)]
mod tests {
    use super::{crossing, mean_and_its_error};

    #[test]
    fn means_have_errors_where_there_are_two() {
        assert_eq!(mean_and_its_error(&[3.0]), (3.0, None));
        let (mean, error) = mean_and_its_error(&[1.0, 3.0]);
        assert!(mean == 2.0 && (error.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_crossing_of_a_power_law_is_exact() {
        // error = 1 / x, cost = 3 x.
        let curve: Vec<_> = [1.0, 4.0, 16.0].iter().map(|&x| (x, 1.0 / x, 3.0 * x)).collect();
        let (x, cost) = crossing(&curve, 0.125).unwrap();
        assert!((x - 8.0f64).abs() < 1e-9 && (cost - 24.0f64).abs() < 1e-9);
        assert_eq!(crossing(&curve, 0.01), None);
    }
}
