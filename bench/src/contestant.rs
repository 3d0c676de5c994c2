//! Who renders: Irradiant's own program, and drivers of the peers that stay alive while they are asked.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// What a render cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Processor seconds of all threads, without loading and building.
    pub cpu_seconds: f64,
    /// Seconds on the wall.
    pub seconds: f64,
    /// What a first render needed more, compiling kernels for example.
    pub first_extra_seconds: Option<f64>,
    /// Reading and compiling the scene, where it was done for this picture.
    pub load_seconds: Option<f64>,
    /// Most memory that the process ever held.
    pub peak_memory_bytes: u64,
}

/// A renderer that has a scene ready.
pub trait Contestant {
    /// Renders `spp` samples per pixel to a PFM file.
    fn render(&mut self, spp: u32, seed: u32, out: &Path) -> Result<Cost, String>;
    /// Name and version.
    fn version(&self) -> String;
}

/// Irradiant's own program, started for each picture.
pub struct Irradiant {
    program: PathBuf,
    scene: PathBuf,
    arguments: Vec<String>,
    version: String,
    /// Added to every seed.
    seed_offset: u32,
}

impl Irradiant {
    /// The program, on a scene file.
    pub fn new(program: &Path, scene: &Path, threads: usize, extra: &[&str]) -> Self {
        let said = Command::new(program).arg("--version").output();
        let version = said.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_string()).unwrap_or_default();
        let mut arguments = vec!["--quiet".to_string(), "--threads".into(), threads.to_string()];
        arguments.extend(extra.iter().map(ToString::to_string));
        Self { program: program.into(), scene: scene.into(), arguments, version, seed_offset: 0 }
    }

    /// The same with seeds of its own, so that its pictures are independent.
    pub fn other_seeds(&self) -> Self {
        Self {
            program: self.program.clone(),
            scene: self.scene.clone(),
            arguments: self.arguments.clone(),
            version: self.version.clone(),
            seed_offset: 100_000,
        }
    }
}

impl Contestant for Irradiant {
    fn render(&mut self, spp: u32, seed: u32, out: &Path) -> Result<Cost, String> {
        let stats = out.with_extension("json");
        let run = Command::new(&self.program)
            .arg("render")
            .arg(&self.scene)
            .args(&self.arguments)
            .args(["--spp", &spp.to_string(), "--seed", &(seed + self.seed_offset).to_string(), "--stats"])
            .arg(&stats)
            .arg("--output")
            .arg(out)
            .output()
            .map_err(|e| format!("{}: {e}", self.program.display()))?;
        if !run.status.success() {
            return Err(String::from_utf8_lossy(&run.stderr).into_owned());
        }
        let text = std::fs::read_to_string(&stats).map_err(|e| format!("{}: {e}", stats.display()))?;
        let said: Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let phase = |field: &str| said["phases"]["render"][field].as_f64().ok_or("statistics without a render phase");
        Ok(Cost {
            cpu_seconds: phase("cpu_seconds")?,
            seconds: phase("seconds")?,
            first_extra_seconds: None,
            load_seconds: ["read", "compile"].iter().map(|p| said["phases"][p]["seconds"].as_f64()).sum(),
            peak_memory_bytes: said["peak_memory_bytes"].as_u64().unwrap_or(0),
        })
    }

    fn version(&self) -> String {
        self.version.clone()
    }
}

/// The driver of a peer, a Python program that has a scene loaded and answers requests.
pub struct Driver {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    version: String,
}

impl Driver {
    /// Starts a driver and waits until it has the scene; what it complains about goes to `log`.
    pub fn start(
        python: &Path,
        script: &Path,
        arguments: &[String],
        environment: &[(String, String)],
        log: &Path,
    ) -> Result<Self, String> {
        let fail = |e: std::io::Error| format!("{}: {e}", python.display());
        let errors = std::fs::File::create(log).map_err(|e| format!("{}: {e}", log.display()))?;
        let mut child = Command::new(python)
            .arg(script)
            .args(arguments)
            .envs(environment.iter().cloned())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(errors)
            .spawn()
            .map_err(fail)?;
        let requests = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().ok_or("no standard output")?);
        let mut driver = Self { child, requests, answers, version: String::new() };
        let ready = driver.answer().map_err(|e| format!("{e}; see {}", log.display()))?;
        driver.version = ready["version"].as_str().unwrap_or_default().to_string();
        Ok(driver)
    }

    fn answer(&mut self) -> Result<Value, String> {
        let mut line = String::new();
        loop {
            line.clear();
            if self.answers.read_line(&mut line).map_err(|e| e.to_string())? == 0 {
                return Err("the driver stopped".into());
            }
            if let Some(said) = line.strip_prefix("BENCH ") {
                return serde_json::from_str(said).map_err(|e| e.to_string());
            }
        }
    }
}

impl Contestant for Driver {
    fn render(&mut self, spp: u32, seed: u32, out: &Path) -> Result<Cost, String> {
        let request = json!({ "spp": spp, "seed": seed, "out": out });
        let stream = self.requests.as_mut().ok_or("the driver is closed")?;
        writeln!(stream, "{request}").and_then(|()| stream.flush()).map_err(|e| e.to_string())?;
        let said = self.answer()?;
        let number = |field: &str| said[field].as_f64();
        let seconds = number("seconds").ok_or("an answer without seconds")?;
        Ok(Cost {
            cpu_seconds: number("cpu_seconds").ok_or("an answer without CPU seconds")?,
            seconds,
            first_extra_seconds: number("first_seconds").map(|first| first - seconds),
            load_seconds: None,
            peak_memory_bytes: number("peak_memory_bytes").unwrap_or(0.0) as u64,
        })
    }

    fn version(&self) -> String {
        self.version.clone()
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // The end of its input is the end of the driver; LuxCore may abort while it stops, which is of no interest.
        self.requests = None;
        let _ = self.child.wait();
    }
}
