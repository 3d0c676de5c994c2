//! What builds cost: each in a process of its own, so that as many threads work as were asked for.
//!
//! The pool that Embree works on is as large as the first device of a process wanted it, and stays: a device that asks for one thread later is
//! built on two. So the benchmark starts itself anew for each build. The child builds something small first, so that the start of the
//! pool is not counted, and then the scene, once. CPU time that was not spent by the thread that asked shows whether others helped.

use super::embree::Embree;
use super::{on_threads, ours, sets};
use cpu_time::{ProcessTime, ThreadTime};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Runs from when it is made.
pub struct Stopwatch {
    wall: Instant,
    process: ProcessTime,
    thread: ThreadTime,
}

/// Time that went by.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Spent {
    /// On the wall.
    pub seconds: f64,
    /// All threads.
    pub cpu_seconds: f64,
    /// Of the CPU seconds those of other threads than the one that looks at the watch.
    pub helped_seconds: f64,
}

impl Stopwatch {
    /// From now on.
    pub fn start() -> Self {
        Self { wall: Instant::now(), process: ProcessTime::now(), thread: ThreadTime::now() }
    }

    /// Until now; to be asked by the thread that started it.
    pub fn spent(&self) -> Spent {
        let (seconds, cpu) = (self.wall.elapsed().as_secs_f64(), self.process.elapsed().as_secs_f64());
        Spent { seconds, cpu_seconds: cpu, helped_seconds: (cpu - self.thread.elapsed().as_secs_f64()).max(0.0) }
    }
}

/// One build.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Once {
    /// Of the build alone.
    pub spent: Spent,
    /// Nodes and leaves.
    pub memory_bytes: usize,
}

/// The child: builds [`sets::by_name`]'s scene once with Embree's library, or ours without one, and prints what it cost.
pub fn child(scene: &str, threads: usize, library: Option<&Path>) -> Result<(), String> {
    let subject = sets::by_name(scene).ok_or_else(|| format!("{scene}: no such scene"))?;
    let (warm, geometry) = (sets::displaced(224).geometry, &subject.geometry);
    let once = match library {
        Some(path) => {
            let embree = Embree::load(path)?;
            let _small = embree.build(&warm, false, threads)?;
            let tree = embree.build(geometry, false, threads)?;
            Once { spent: tree.spent, memory_bytes: tree.memory_bytes() }
        }
        None => on_threads(threads, || {
            let _small = ours::Tree::build(&warm);
            let tree = ours::Tree::build(geometry);
            Once { spent: tree.spent, memory_bytes: tree.memory_bytes() }
        })?,
    };
    println!("{}", serde_json::to_string(&once).map_err(|e| e.to_string())?);
    Ok(())
}

fn in_a_child(scene: &str, threads: usize, library: Option<&Path>) -> Result<Once, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let mut command = Command::new(program);
    command.args(["build-once", scene, &threads.to_string()]);
    command.args(library);
    let output = command.output().map_err(|e| e.to_string())?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).trim().to_string());
    }
    let once: Once = serde_json::from_slice(&output.stdout).map_err(|e| format!("a build said no figures: {e}"))?;
    let share = once.spent.helped_seconds / once.spent.cpu_seconds;
    if threads == 1 && share > 0.02 {
        return Err(format!("one thread was asked for, {:.0} % of the CPU time was spent by others", 100.0 * share));
    }
    Ok(once)
}

/// Builds a scene so many times by turns. For each, who is known by name and library, the least of each time, or why there is none.
pub fn by_turns(
    scene: &str,
    threads: usize,
    builders: &[(String, Option<PathBuf>)],
    times: usize,
) -> Vec<Result<Once, String>> {
    let mut least: Vec<Result<Once, String>> = builders.iter().map(|_| Err("not asked".into())).collect();
    for _ in 0..times {
        for ((name, library), least) in builders.iter().zip(&mut least) {
            let found = in_a_child(scene, threads, library.as_deref());
            let found = found.map_err(|why| format!("{name}, {scene} on {threads} thread(s): {why}"));
            *least = match (&*least, found) {
                (Ok(a), Ok(b)) => Ok(a.least(&b)),
                // On a busy machine a thread of Embree's may look for work now and then: such a turn does not count.
                (Ok(a), Err(_)) => Ok(*a),
                (Err(_), found) => found,
            };
        }
    }
    least
}

impl Once {
    fn least(&self, other: &Self) -> Self {
        let (a, b) = (self.spent, other.spent);
        // What others did belongs to the build whose CPU seconds are shown.
        let quicker = if a.cpu_seconds < b.cpu_seconds { a } else { b };
        Self { spent: Spent { seconds: a.seconds.min(b.seconds), ..quicker }, memory_bytes: self.memory_bytes }
    }
}
