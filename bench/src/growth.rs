//! How cost grows with triangles and with lamps.

use crate::Setting;
use crate::contestant::Contestant;
use crate::machine::Machine;
use crate::peers::{self, Contestants};
use crate::picture::{Mask, Picture, Truth};
use crate::pictures::write_scene;
use crate::rays::{self, builds, on_threads, ours, sets};
use crate::scene;
use cpu_time::ThreadTime;
use irradiant_bvh::Ray;
use serde::{Deserialize, Serialize};

/// One tracer at one size.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Size {
    /// Who.
    pub tracer: String,
    /// Triangles of the mesh and its floor.
    pub triangles: usize,
    /// CPU seconds of the build, one thread; 0 if it was left out.
    pub build_seconds: f64,
    /// Of them those of other threads than the one that asked; none: left out, or measured before they were told apart, when "one thread" may have been two.
    #[serde(default)]
    pub helped_seconds: Option<f64>,
    /// Nanoseconds per primary ray, one at a time.
    pub primary: f64,
    /// Nanoseconds per ray of the first bounce.
    pub bounce: f64,
    /// Bytes of nodes and leaves.
    pub memory_bytes: usize,
}

/// One renderer with so many lamps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Lamps {
    /// Who.
    pub name: String,
    /// Lamps.
    pub lamps: usize,
    /// CPU microseconds per path.
    pub microseconds: f64,
    /// relMSE at 16 samples per pixel, from the scatter of two pictures.
    pub error: f64,
    /// Seconds to read and compile the scene, ours only.
    pub load_seconds: Option<f64>,
}

/// All of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Where and when.
    pub machine: Machine,
    /// Which libraries of Embree.
    #[serde(default)]
    pub embrees: Vec<String>,
    /// By triangles.
    pub sizes: Vec<Size>,
    /// By lamps.
    pub lamps: Vec<Lamps>,
    /// What was left out.
    pub missing: Vec<String>,
}

/// Nanoseconds per ray, the best of three.
fn per_ray(rays: &[Ray], trace: impl Fn(&[Ray], &mut [f32])) -> f64 {
    let mut out = vec![0.0; rays.len()];
    let mut once = || {
        let start = ThreadTime::now();
        trace(rays, &mut out);
        start.elapsed().as_secs_f64()
    };
    let best = (0..3).map(|_| once()).fold(f64::INFINITY, f64::min);
    best / rays.len() as f64 * 1e9
}

fn sizes(largest: usize, embrees: &rays::Embrees, missing: &mut Vec<String>) -> Result<Vec<Size>, String> {
    const BUILDS: usize = 3;
    let mut found = Vec::new();
    for n in [71, 224, 708, 2237].into_iter().filter(|n| 2 * n * (n - 1) <= largest + largest / 100) {
        let subject = sets::displaced(n);
        let geometry = &subject.geometry;
        let tree = on_threads(1, || ours::Tree::build(geometry))?;
        let [primary, bounce, ..] = sets::rays(&subject, &tree, 512);
        let builds = builds::by_turns(&format!("displaced-{n}"), 1, &embrees.builders, BUILDS);
        let mut builds = embrees.builders.iter().zip(builds);
        let mut say = |trace: &dyn Fn(&[Ray], &mut [f32]), memory_bytes: usize| {
            let Some(((tracer, _), build)) = builds.next() else { return };
            // A build that was not on one thread is left out; rays are asked all the same.
            let (build_seconds, helped_seconds) = match build {
                Ok(builds::Once { spent, .. }) => (spent.cpu_seconds, Some(spent.helped_seconds)),
                Err(why) => {
                    println!("  build left out: {why}");
                    missing.push(why);
                    (0.0, None)
                }
            };
            let (primary, bounce) = (per_ray(&primary.rays, trace), per_ray(&bounce.rays, trace));
            let triangles = geometry.triangles();
            println!(
                "{triangles:9} triangles {tracer:12} build {build_seconds:7.3} CPU s, primary {primary:6.1} ns, bounce {bounce:6.1} ns"
            );
            let tracer = tracer.clone();
            found.push(Size { tracer, triangles, build_seconds, helped_seconds, primary, bounce, memory_bytes });
        };
        say(&|r, o| tree.closest(r, o), tree.memory_bytes());
        for e in &embrees.libraries {
            let tree = e.build(geometry, false, 1)?;
            say(&|r, o| tree.closest(r, o), tree.memory_bytes());
        }
    }
    Ok(found)
}

fn lamps(largest: usize, setting: &Setting, missing: &mut Vec<String>) -> Result<Vec<Lamps>, String> {
    const SPP: u32 = 16;
    let mut found = Vec::new();
    for count in [1, 10, 100, 1_000, 10_000, 100_000].into_iter().filter(|&n| n <= largest) {
        let scene = scene::hall_with_lamps(count);
        let own = Setting { work: setting.work.join(format!("lamps-{count}")), ..setting.clone() };
        let folder = write_scene(&scene, &own.work)?;
        let emission = folder.join("emission.pfm");
        peers::irradiant(setting, &folder, &["--color", "rgb", "--max-depth", "0"]).render(16, 1, &emission)?;
        let emission = Picture::read(&emission)?;
        let mut contestants: Contestants =
            vec![("Irradiant rgb".into(), Box::new(peers::irradiant(setting, &folder, &["--color", "rgb"])))];
        // Mitsuba takes minutes to load more.
        if count <= 1_000 {
            let (peers, lacking) = peers::all(setting, &folder);
            contestants.extend(peers.into_iter().filter(|(name, _)| name == "Mitsuba llvm"));
            missing.extend(lacking);
        }
        for (name, contestant) in &mut contestants {
            let mut pictures = Vec::new();
            let mut seconds = 0.0;
            let mut load_seconds = None;
            for seed in 1..=2 {
                let out = folder.join(format!("{}-{seed}.pfm", name.replace(' ', "-")));
                let cost = contestant.render(SPP, seed, &out)?;
                seconds += cost.cpu_seconds / 2.0;
                load_seconds = cost.load_seconds.or(load_seconds);
                pictures.push(Picture::read(&out)?);
            }
            let mask = Mask::without_lamps(&emission);
            let truth = Truth::new(pictures[0].clone(), pictures[1].clone(), mask).ok_or("no pictures")?;
            let error = truth.scatter(&pictures).unwrap_or(f64::NAN);
            let microseconds = seconds / (scene.pixels() as f64 * f64::from(SPP)) * 1e6;
            println!(
                "{count:7} lamps {name:15} {microseconds:7.3} CPU us per path, relMSE {error:.4}, loaded in {load_seconds:?} s"
            );
            found.push(Lamps { name: name.clone(), lamps: count, microseconds, error, load_seconds });
        }
    }
    Ok(found)
}

/// Measures up to so many triangles, and up to a hundredth of it lamps, and prints as it goes.
pub fn run(largest: usize, setting: &Setting) -> Result<Report, String> {
    let machine = Machine::here(&setting.repository, setting.given);
    let embrees = rays::embrees(setting);
    let mut missing = embrees.missing.clone();
    let sizes = sizes(largest, &embrees, &mut missing)?;
    let lamps = lamps(largest / 100, setting, &mut missing)?;
    missing.sort();
    missing.dedup();
    Ok(Report { machine, embrees: embrees.versions, sizes, lamps, missing })
}
