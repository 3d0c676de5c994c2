//! Where the time went and what was done: for `--stats` and the closing line. None of it goes into picture files.

use cpu_time::ProcessTime;
use irradiant::renderer::RenderStats;
use serde_json::{Value, json};
use std::time::Instant;

/// Wall and CPU seconds of one phase.
struct Phase {
    name: &'static str,
    seconds: f64,
    cpu_seconds: f64,
}

/// Measures phases.
pub struct Clock {
    wall: Instant,
    cpu: ProcessTime,
    phases: Vec<Phase>,
}

impl Clock {
    /// Starts now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: ProcessTime::now(), phases: Vec::new() }
    }

    /// The phase that ends now.
    pub fn lap(&mut self, name: &'static str) {
        let (seconds, cpu_seconds) = (self.wall.elapsed().as_secs_f64(), self.cpu.elapsed().as_secs_f64());
        self.phases.push(Phase { name, seconds, cpu_seconds });
        (self.wall, self.cpu) = (Instant::now(), ProcessTime::now());
    }

    /// Seconds and CPU seconds of all phases.
    pub fn total(&self) -> (f64, f64) {
        self.phases.iter().fold((0.0, 0.0), |(w, c), p| (w + p.seconds, c + p.cpu_seconds))
    }

    /// Seconds of a phase; 0 if there was none.
    pub fn seconds(&self, name: &str) -> f64 {
        self.phases.iter().filter(|p| p.name == name).map(|p| p.seconds).sum()
    }

    /// CPU seconds of the whole process so far, including what came before this clock.
    fn process_cpu_seconds() -> f64 {
        ProcessTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
    }

    /// Everything, as JSON.
    pub fn json(&self, stats: &RenderStats, threads: usize, command: &[String]) -> Value {
        let phases: serde_json::Map<_, _> = self
            .phases
            .iter()
            .map(|p| (p.name.to_string(), json!({ "seconds": p.seconds, "cpu_seconds": p.cpu_seconds })))
            .collect();
        json!({
            "version": irradiant::VERSION,
            "command": command,
            "threads": threads,
            "phases": phases,
            "seconds": self.total().0,
            "cpu_seconds": Self::process_cpu_seconds(),
            "paths": stats.paths,
            "rays": {
                "camera": stats.camera_rays,
                "bounce": stats.bounce_rays,
                "shadow": stats.shadow_rays,
            },
            "mean_path_length": if stats.paths > 0 { stats.scatterings as f64 / stats.paths as f64 } else { 0.0 },
            "longest_path": stats.longest_path,
            "stopped_paths": stats.stopped_paths,
            "rays_by_depth": stats.rays_by_depth,
            "peak_memory_bytes": peak_memory_bytes(),
        })
    }
}

/// Peak resident memory of this process; `None` where the system does not say (Linux does).
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}
