//! Where the time went and what was done: for `--stats` and the closing line. None of it goes into picture files.

use cpu_time::ProcessTime;
use irradiant::core::interaction::MaterialId;
use irradiant::core::scene::Scene;
use irradiant::renderer::RenderStats;
use irradiant::renderer::inspect::EnergyAudit;
use irradiant::renderer::inspect::audit::{MaterialBooks, Power};
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

/// Standard errors beyond which a material is named: once in 16,000 where all is right.
const SUSPICIOUS: f64 = 4.0;
const PBRT: &str = ", coat weighted as in pbrt-v4";
const KNOWN: &str = "coats weighted as in pbrt-v4 are evaluated brighter than they are sampled: known, and biased in the picture too; \"integer maxdepth\" 0 \
                     on the material is exact\n";
const DISAGREES: &str = ": how it is sampled and how it is evaluated disagree; please report the scene";

const REFUSED: &str = "; unless lights are so bright that 32-bit floats overflow (3e38; try a smaller \"scale\"), that is a bug: please report the scene\n";

/// The books of energy as lines. Where something is missing, the materials that are known to be evaluated brighter than they are sampled,
/// and those that are off by more than [`SUSPICIOUS`], and how many particles were refused.
pub fn audit_in_words(scene: &Scene, books: &EnergyAudit) -> String {
    let total = books.emitted.watts.max(f64::MIN_POSITIVE);
    let line = |name: &str, p: &Power| {
        format!("{name:<24} {:>14.6e} W +- {:.1e}  {:>8.3} %\n", p.watts, p.error, 100.0 * p.watts / total)
    };
    let mut text = format!("energy: {} particles from the lights, {:.2} events each\n", books.paths, books.mean_events);
    text += &line("emitted", &books.emitted);
    text += &format!("{:<24} {:>14.6e} W\n", "  by the lights' formula", books.emitted_by_formula);
    text += &line("absorbed", &books.absorbed);
    // A number tells materials of one name (that of their kind, where they have none) apart.
    let all: Vec<&str> = (0..scene.materials.len() as u32).map(|i| scene.material_name(MaterialId(i))).collect();
    let name_of = |id: MaterialId| {
        let name = scene.material_name(id);
        if all.iter().filter(|other| **other == name).count() > 1 { format!("{name} #{}", id.0) } else { name.into() }
    };
    for m in &books.by_material {
        text += &line(&format!("  by {}", name_of(m.material)), &m.absorbed);
    }
    text += &line("escaped", &books.escaped);
    text += &line("cut off by the limit", &books.cut_off);
    let missing = |name: &str, p: &Power, why: &str| {
        let line = line(name, p);
        format!("{}  {:+.2} standard errors{why}\n", line.trim_end(), p.z())
    };
    text += &missing("missing", &books.missing, "");
    if books.refused > 0 {
        text += &format!(
            "{:<24} {} of {} particles were not finite and are left out of the books",
            "refused", books.refused, books.paths
        );
        for m in books.by_material.iter().filter(|m| m.refused > 0) {
            text += &format!(", {} of them first at {}", m.refused, name_of(m.material));
        }
        text += REFUSED;
    }
    let known = books.by_material.iter().any(|m| m.evaluated_as_pbrt);
    for m in &books.by_material {
        let name = format!("  at {}", name_of(m.material));
        if m.evaluated_as_pbrt {
            text += &missing(&name, &m.missing, PBRT);
        } else if m.missing.z().abs() > SUSPICIOUS {
            text += &missing(&name, &m.missing, DISAGREES);
        }
    }
    if known {
        text += &missing("  elsewhere", &books.missing_elsewhere, "");
        text += KNOWN;
    }
    text
}

/// The same as JSON, watts.
pub fn audit_as_json(scene: &Scene, books: &EnergyAudit) -> Value {
    let power = |p: &Power| json!({ "watts": p.watts, "error": p.error });
    let by_material = |side: &dyn Fn(&MaterialBooks) -> Value| -> serde_json::Map<_, _> {
        let name = |m: &MaterialBooks| format!("{} {}", m.material.0, scene.material_name(m.material));
        books.by_material.iter().map(|m| (name(m), side(m))).collect()
    };
    let missing = |m: &MaterialBooks| json!({ "watts": m.missing.watts, "error": m.missing.error, "evaluated_as_pbrt": m.evaluated_as_pbrt });
    json!({
        "particles": books.paths,
        "refused": books.refused,
        "refused_by_material": by_material(&|m| json!(m.refused)),
        "emitted": power(&books.emitted),
        "emitted_by_formula": books.emitted_by_formula,
        "absorbed": power(&books.absorbed),
        "absorbed_by_material": by_material(&|m| power(&m.absorbed)),
        "escaped": power(&books.escaped),
        "cut_off": power(&books.cut_off),
        "missing": power(&books.missing),
        "missing_in_standard_errors": books.missing.z(),
        "missing_by_material": by_material(&missing),
        "missing_elsewhere": power(&books.missing_elsewhere),
        "missing_elsewhere_in_standard_errors": books.z(),
        "ended_by_roulette": books.ended_by_roulette,
        "mean_events": books.mean_events,
    })
}
