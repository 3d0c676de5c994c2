//! How long a million triangles take from the disk to the first pass over the picture, and in how much memory.
//!
//! `cargo run --release -p irradiant --example million` makes a bumpy mesh of 999,698 triangles as binary PLY and as
//! pbrt text in the system's temporary folder, and prints for each CPU seconds (all threads) to load, to build and to
//! render one sample of 64 x 64 pixels, and the peak of memory (Linux only). Promised: under 3 s (text: 6 s), 300 MB.

use irradiant::{Job, RenderSettings, load};
use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Vertices on a side.
const SIDE: usize = 708;

const SCENE: &str = "LookAt 0 -3 2 0 0 0 0 0 1\nCamera \"perspective\" \"float fov\" 40\n\
    Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 64\nWorldBegin\nLightSource \"infinite\"\n";

fn vertex(x: usize, y: usize) -> [f32; 3] {
    let (u, v) = (x as f32 / (SIDE - 1) as f32 * 2.0 - 1.0, y as f32 / (SIDE - 1) as f32 * 2.0 - 1.0);
    [u, v, 0.1 * (9.0 * u).sin() * (7.0 * v).cos() + 0.02 * (61.0 * u + 5.0 * v).sin() * (53.0 * v).cos()]
}

fn vertices() -> impl Iterator<Item = [f32; 3]> {
    (0..SIDE * SIDE).map(|i| vertex(i % SIDE, i / SIDE))
}

fn triangles() -> impl Iterator<Item = [usize; 3]> {
    let corners = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
    corners.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]])
}

fn write_ply(folder: &Path) -> std::io::Result<PathBuf> {
    let mut out = BufWriter::new(std::fs::File::create(folder.join("million.ply"))?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uint8 int vertex_indices\nend_header\n",
        SIDE * SIDE,
        triangles().count()
    )?;
    for c in vertices().flatten() {
        out.write_all(&c.to_le_bytes())?;
    }
    for face in triangles() {
        out.write_all(&[3])?;
        for i in face {
            out.write_all(&(i as u32).to_le_bytes())?;
        }
    }
    out.flush()?;
    let scene = folder.join("million-ply.pbrt");
    std::fs::write(&scene, format!("{SCENE}Shape \"plymesh\" \"string filename\" \"million.ply\"\n"))?;
    Ok(scene)
}

fn write_text(folder: &Path) -> std::io::Result<PathBuf> {
    let scene = folder.join("million-text.pbrt");
    let mut out = BufWriter::new(std::fs::File::create(&scene)?);
    writeln!(out, "{SCENE}Shape \"trianglemesh\" \"point3 P\" [")?;
    for [x, y, z] in vertices() {
        writeln!(out, "{x} {y} {z}")?;
    }
    writeln!(out, "] \"integer indices\" [")?;
    for [a, b, c] in triangles() {
        writeln!(out, "{a} {b} {c}")?;
    }
    writeln!(out, "]")?;
    out.flush()?;
    Ok(scene)
}

fn cpu() -> f64 {
    cpu_time::ProcessTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
}

/// Most memory that this process has had so far, MB; `None` where the system does not say it in a file.
fn peak_megabytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_ascii_whitespace().nth(1)?.parse::<f64>().ok()? * 1.024e-3)
}

/// One line of figures; a process of its own for each scene, since the peak of memory never falls.
fn measure(scene: &Path) -> Result<String, irradiant::Error> {
    let settings = RenderSettings { samples_per_pixel: Some(1), ..RenderSettings::default() };
    let start = cpu();
    let file = load(scene)?;
    let loaded = cpu();
    let job = Job::new(&file, &settings)?;
    let built = cpu();
    // What the front door does in one go is done here step by step, to time it.
    drop(file);
    job.start().wait();
    let done = cpu();
    let facts = job.scene.facts();
    let mut line = format!(
        "{} triangles: load {:.2}, build {:.2}, first pass {:.2}, together {:.2} CPU s; {:.1} MB of geometry",
        facts.triangles,
        loaded - start,
        built - loaded,
        done - built,
        done - start,
        facts.geometry_bytes as f64 / 1e6
    );
    if let Some(peak) = peak_megabytes() {
        let _ = write!(line, ", {peak:.0} MB at most in all");
    }
    Ok(line)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    if let Some(scene) = std::env::args_os().nth(1) {
        println!("{}", measure(Path::new(&scene)).map_err(|e| e.to_string())?);
        return Ok(());
    }
    let folder = std::env::temp_dir().join(format!("irradiant-million-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    for scene in [write_ply(&folder)?, write_text(&folder)?] {
        print!("{}: ", scene.file_name().unwrap_or_default().to_string_lossy());
        std::io::stdout().flush()?;
        std::process::Command::new(std::env::current_exe()?).arg(&scene).status()?;
    }
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
