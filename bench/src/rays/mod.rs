//! Ray rates against Embree: the same rays for all, interleaved, in one run.

pub mod builds;
pub mod embree;
pub mod ours;
pub mod sets;

use crate::Setting;
use crate::machine::Machine;
use cpu_time::ThreadTime;
use irradiant_bvh::Ray;
use serde::{Deserialize, Serialize};
use sets::{Set, Subject};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// One tracer on one set of rays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Rate {
    /// Of the scene.
    pub scene: String,
    /// Of ray.
    pub kind: String,
    /// Who traced.
    pub tracer: String,
    /// Threads that traced.
    pub threads: usize,
    /// Million rays per CPU second, the best pass.
    pub best: f64,
    /// Million rays per CPU second, the median pass.
    pub median: f64,
    /// Rays in the set.
    pub rays: usize,
    /// Rays whose answer differs from that of Irradiant one at a time: hit against miss, or distances apart by more than 1e-4.
    pub different: usize,
}

/// One build.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Build {
    /// Of the scene.
    pub scene: String,
    /// Triangles, instances counted.
    pub triangles: usize,
    /// Who built.
    pub tracer: String,
    /// Threads allowed.
    pub threads: usize,
    /// On the wall, the least of some.
    pub seconds: f64,
    /// All threads, the least of some.
    pub cpu_seconds: f64,
    /// Of them those of other threads than the one that asked; none: measured before they were told apart, and "1 thread" may have been two.
    #[serde(default)]
    pub helped_seconds: Option<f64>,
    /// Nodes and leaves.
    pub memory_bytes: usize,
}

/// All of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Where and when.
    pub machine: Machine,
    /// Which libraries of Embree.
    #[serde(default)]
    pub embrees: Vec<String>,
    /// Passes over each set.
    pub passes: usize,
    /// Rates.
    pub rates: Vec<Rate>,
    /// Builds.
    pub builds: Vec<Build>,
    /// What was left out, and why.
    pub missing: Vec<String>,
}

type Trace<'a> = Box<dyn Fn(&Set, &[Ray], &mut [f32]) + Sync + 'a>;

/// CPU seconds of all threads together for one pass.
fn pass(trace: &Trace, set: &Set, threads: usize, out: &mut [f32]) -> f64 {
    const CHUNK: usize = 8192;
    let next = AtomicUsize::new(0);
    let chunks: Vec<std::sync::Mutex<&mut [f32]>> = out.chunks_mut(CHUNK).map(std::sync::Mutex::new).collect();
    let work = || {
        let start = ThreadTime::now();
        loop {
            let i = next.fetch_add(1, Relaxed);
            let Some(out) = chunks.get(i) else { break };
            let mut out = out.lock().unwrap_or_else(|e| e.into_inner());
            let n = out.len();
            trace(set, &set.rays[i * CHUNK..i * CHUNK + n], &mut out);
        }
        start.elapsed().as_secs_f64()
    };
    if threads == 1 {
        return work();
    }
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().map(|w| w.join().unwrap_or(f64::NAN)).sum()
    })
}

fn different(truth: &[f32], found: &[f32]) -> usize {
    let apart = |(&a, &b): (&f32, &f32)| a.is_finite() != b.is_finite() || (a - b).abs() > 1e-4 * a.abs().max(1e-3);
    truth.iter().zip(found).filter(|&(a, b)| apart((a, b))).count()
}

/// Who builds, by name: ours, or a library of Embree.
pub type Builder = (String, Option<PathBuf>);

/// Embree as it is here.
pub struct Embrees {
    /// Those that could be loaded.
    pub libraries: Vec<embree::Embree>,
    /// Irradiant and they.
    pub builders: Vec<Builder>,
    /// What they call themselves, and the files that they are in.
    pub versions: Vec<String>,
    /// What is not here.
    pub missing: Vec<String>,
}

/// Loads all that there are.
pub fn embrees(setting: &Setting) -> Embrees {
    let (paths, missing) = libraries(setting);
    let builders = vec![("Irradiant".into(), None)];
    let mut all = Embrees { libraries: vec![], builders, versions: vec![], missing };
    for path in paths {
        match embree::Embree::load(&path) {
            Ok(embree) => {
                let file = path.file_name().unwrap_or_default().to_string_lossy();
                all.versions.push(format!("Embree {} (`{file}`)", embree.version()));
                all.builders.push((format!("Embree {}", embree.major), Some(path)));
                all.libraries.push(embree);
            }
            Err(why) => all.missing.push(why),
        }
    }
    all
}

/// Libraries of Embree that there are: 4 from the wheel, 3 from Debian.
fn libraries(setting: &Setting) -> (Vec<PathBuf>, Vec<String>) {
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let wheel = setting.peers.as_ref().and_then(|peers| {
        let packages = std::fs::read_dir(peers.join("embree/lib")).ok()?;
        let homes = packages.flatten().map(|e| e.path().join("site-packages/embreex.libs"));
        let files = homes.filter_map(|h| std::fs::read_dir(h).ok()).flatten().flatten().map(|e| e.path());
        files.into_iter().find(|p| p.to_string_lossy().contains("libembree4"))
    });
    match wheel {
        Some(path) => found.push(path),
        None => missing.push("Embree 4.4: no wheel in the folder of --peers".into()),
    }
    let debian = ["/usr/lib/x86_64-linux-gnu/libembree3.so.3", "/usr/lib/aarch64-linux-gnu/libembree3.so.3"];
    match debian.iter().map(PathBuf::from).find(|p| p.exists()) {
        Some(path) => found.push(path),
        None => missing.push("Embree 3: Debian's libembree3-3 is not installed".into()),
    }
    (found, missing)
}

/// Runs on a pool of so many threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())?;
    Ok(pool.install(work))
}

fn on_subject(
    (scene, subject): (&str, &Subject),
    embrees: &[embree::Embree],
    builders: &[Builder],
    passes: usize,
    width: usize,
    report: &mut Report,
) -> Result<(), String> {
    let geometry = &subject.geometry;
    println!("{}: {} triangles", subject.name, geometry.triangles());
    for threads in [1, 2] {
        for (found, (tracer, _)) in builds::by_turns(scene, threads, builders, passes).into_iter().zip(builders) {
            match found {
                Ok(builds::Once { spent, memory_bytes }) => {
                    println!(
                        "  build {tracer:20} {threads} thread(s): {:6.3} s, {:6.3} CPU s, {:6.1} MB",
                        spent.seconds,
                        spent.cpu_seconds,
                        memory_bytes as f64 / 1e6
                    );
                    report.builds.push(Build {
                        scene: subject.name.into(),
                        triangles: geometry.triangles(),
                        tracer: tracer.clone(),
                        threads,
                        seconds: spent.seconds,
                        cpu_seconds: spent.cpu_seconds,
                        helped_seconds: Some(spent.helped_seconds),
                        memory_bytes,
                    });
                }
                Err(why) => {
                    println!("  left out: {why}");
                    report.missing.push(why);
                }
            }
        }
    }
    let tree = ours::Tree::build(geometry);
    let sets = sets::rays(subject, &tree, width);
    let mut built = Vec::new();
    for e in embrees {
        for robust in [false, true] {
            let name = format!("Embree {}{}", e.major, if robust { " robust" } else { "" });
            built.push((name, e.build(geometry, robust, 2)?));
        }
    }
    let mut tracers: Vec<(String, Trace)> = Vec::new();
    let tree = &tree;
    tracers.push((
        "Irradiant".into(),
        Box::new(|set, rays, out| if set.occlusion { tree.occluded(rays, out) } else { tree.closest(rays, out) }),
    ));
    tracers.push((
        "Irradiant batch".into(),
        Box::new(
            |set, rays, out| if set.occlusion { tree.occluded_batch(rays, out) } else { tree.closest_batch(rays, out) },
        ),
    ));
    for (name, tree) in &built {
        tracers.push((
            name.clone(),
            Box::new(|set, rays, out| if set.occlusion { tree.occluded(rays, out) } else { tree.closest(rays, out) }),
        ));
        // Embree's hint that rays are coherent may help or not: both are asked, but only where they are.
        for hint in [false, true] {
            tracers.push((
                format!("{name} x16{}", if hint { " hint" } else { "" }),
                Box::new(move |set, rays, out| {
                    let hint = hint && set.coherent;
                    if set.occlusion { tree.occluded16(rays, out, hint) } else { tree.closest16(rays, out, hint) }
                }),
            ));
        }
    }
    for set in &sets {
        for threads in [1, 2] {
            let mut times: Vec<Vec<f64>> = tracers.iter().map(|_| Vec::new()).collect();
            let mut answers: Vec<Vec<f32>> = tracers.iter().map(|_| vec![f32::NAN; set.rays.len()]).collect();
            for _ in 0..passes {
                for (i, (name, trace)) in tracers.iter().enumerate() {
                    if name.ends_with("hint") && !set.coherent {
                        continue;
                    }
                    times[i].push(pass(trace, set, threads, &mut answers[i]));
                }
            }
            for (i, (name, _)) in tracers.iter().enumerate() {
                if times[i].is_empty() {
                    continue;
                }
                times[i].sort_by(f64::total_cmp);
                let rate = |seconds: f64| set.rays.len() as f64 / seconds / 1e6;
                let different = different(&answers[0], &answers[i]);
                let (best, median) = (rate(times[i][0]), rate(times[i][passes / 2]));
                println!(
                    "  {:10} {threads} thread(s) {name:20} {best:7.3} Mrays/CPU s (median {median:7.3}), {different} different",
                    set.kind
                );
                report.rates.push(Rate {
                    scene: subject.name.into(),
                    kind: set.kind.into(),
                    tracer: name.clone(),
                    threads,
                    best,
                    median,
                    rays: set.rays.len(),
                    different,
                });
            }
        }
    }
    Ok(())
}

/// Measures on all three scenes and prints as it goes.
pub fn run(passes: usize, width: usize, setting: &Setting) -> Result<Report, String> {
    let Embrees { libraries, builders, versions, missing } = embrees(setting);
    missing.iter().for_each(|m| println!("left out: {m}"));
    let machine = Machine::here(&setting.repository, false);
    let mut report = Report { machine, embrees: versions, passes, rates: vec![], builds: vec![], missing };
    for scene in ["objects", "displaced-708", "instances"] {
        let subject = sets::by_name(scene).ok_or("no such scene")?;
        on_subject((scene, &subject), &libraries, &builders, passes, width, &mut report)?;
    }
    Ok(report)
}
