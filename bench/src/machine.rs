//! Where and when a figure was measured.

use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;

/// Said with every result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Machine {
    /// As the processor calls itself.
    pub processor: String,
    /// Vector extensions that matter here.
    pub vectors: Vec<String>,
    /// Logical processors.
    pub cores: usize,
    /// Kernel and distribution.
    pub system: String,
    /// Of the Rust compiler.
    pub compiler: String,
    /// Year, month, day, time of day, UTC.
    pub date: String,
    /// Of Irradiant, with "+" if the tree had changes.
    pub commit: String,
    /// Runnable processes on average over the last minute, before the experiment.
    pub load: f64,
}

fn said(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    output.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_string()).unwrap_or_default()
}

/// Runnable processes on average over the last minute; NaN where the system does not say.
pub fn load() -> f64 {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().and_then(|w| w.parse().ok()).unwrap_or(f64::NAN)
}

impl Machine {
    /// This one, now; `repository` is where Irradiant's sources are, `given` whether its program was built elsewhere.
    pub fn here(repository: &Path, given: bool) -> Self {
        let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let field = |name: &str| {
            let line = cpu.lines().find(|l| l.starts_with(name)).unwrap_or_default();
            line.split_once(':').map_or(String::new(), |(_, v)| v.trim().to_string())
        };
        let flags = field("flags");
        let known = ["sse4_2", "avx", "avx2", "fma", "avx512f", "avx512vl"];
        let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
        let name = release.lines().find_map(|l| l.strip_prefix("PRETTY_NAME=")).unwrap_or_default();
        let directory = repository.to_string_lossy();
        let changed = !said("git", &["-C", &directory, "status", "--porcelain", "--", "crates"]).is_empty();
        let commit = said("git", &["-C", &directory, "rev-parse", "--short=10", "HEAD"]);
        Self {
            processor: format!("{} (family {}, model {})", field("model name"), field("cpu family"), field("model")),
            vectors: known.iter().filter(|k| flags.split(' ').any(|f| f == **k)).map(ToString::to_string).collect(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{}, {}", said("uname", &["-sr"]), name.trim_matches('"')),
            compiler: said("rustc", &["--version"]),
            date: said("date", &["-u", "+%Y-%m-%d %H:%M UTC"]),
            commit: match (given, changed) {
                (true, _) => "not known: the program was given".into(),
                (false, true) => commit + "+",
                (false, false) => commit,
            },
            load: load(),
        }
    }
}
