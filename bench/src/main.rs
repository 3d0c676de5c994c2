//! Irradiant against its peers. `README.md` beside the manifest says how to run it and how to read what it says.
#![deny(unsafe_code)]

mod contestant;
mod growth;
mod machine;
mod page;
mod peers;
mod picture;
mod pictures;
mod plot;
mod rays;
mod scene;
mod street;
mod vector;

use clap::{Args, Parser, Subcommand};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Where everything is.
#[derive(Clone)]
pub struct Setting {
    /// Irradiant's sources.
    pub repository: PathBuf,
    /// Irradiant's program.
    pub irradiant: PathBuf,
    /// Whether it was given, and not built from these sources.
    pub given: bool,
    /// Virtual environments of the peers.
    pub peers: Option<PathBuf>,
    /// Scenes and pictures; may be deleted.
    pub work: PathBuf,
    /// Results as data, and the page.
    pub results: PathBuf,
    /// Threads of each renderer.
    pub threads: usize,
    /// Peers to run; empty: all.
    pub only: Vec<String>,
}

#[derive(Parser)]
#[command(about = "Irradiant against its peers", version)]
struct Cli {
    #[command(subcommand)]
    what: What,
    #[command(flatten)]
    places: Places,
}

#[derive(Args)]
struct Places {
    /// Folder with the virtual environments of the peers; without it there are no peers
    #[arg(long, global = true)]
    peers: Option<PathBuf>,
    /// Folder for scenes and pictures
    #[arg(long, global = true)]
    work: Option<PathBuf>,
    /// Folder for results
    #[arg(long, global = true)]
    results: Option<PathBuf>,
    /// Irradiant's program, built already; without it, it is built from the sources around this folder
    #[arg(long, global = true)]
    irradiant: Option<PathBuf>,
    /// Threads of each renderer
    #[arg(long, global = true, default_value_t = 1)]
    threads: usize,
    /// Only peers whose names contain one of these
    #[arg(long, global = true, value_delimiter = ',')]
    only: Vec<String>,
}

#[derive(Subcommand)]
enum What {
    /// Install the peers into the folder of --peers, pinned versions from PyPI
    Install {
        /// A Python 3.11, for which Blender's package is made
        #[arg(long, default_value = "python3.11")]
        python: String,
    },
    /// Error times CPU time against all peers
    Pictures {
        /// Scenes: cornell, veach, mesh, lamps, interior
        #[arg(default_values = scene::PICTURES)]
        scenes: Vec<String>,
        /// Samples per pixel
        #[arg(long, default_value_t = 64)]
        spp: u32,
        /// Pictures of each renderer
        #[arg(long, default_value_t = 4)]
        seeds: u32,
        /// Samples per pixel of each reference
        #[arg(long, default_value_t = 1024)]
        reference_spp: u32,
    },
    /// Ray rates against Embree
    Rays {
        /// Passes over each set of rays
        #[arg(long, default_value_t = 5)]
        passes: usize,
        /// Primary rays are this number squared
        #[arg(long, default_value_t = 1024)]
        width: usize,
    },
    /// The lectures' street: cost of 16 paths per pixel, error by time
    Street {
        /// Samples per pixel of each reference
        #[arg(long, default_value_t = 128)]
        reference_spp: u32,
        /// The curve goes on to this number of samples per pixel
        #[arg(long, default_value_t = 64)]
        largest_spp: u32,
        /// Width and height are divided by this, to try the experiment out
        #[arg(long, default_value_t = 1)]
        shrink: u32,
    },
    /// How cost grows with triangles and lamps
    Growth {
        /// The most triangles; lamps go up to a hundredth of it
        #[arg(long, default_value_t = 10_000_000)]
        largest: usize,
    },
    /// Write the page of results from the data
    Page,
    /// Build a scene once and print what it cost: what the benchmark starts for each build that it measures
    #[command(hide = true)]
    BuildOnce {
        /// As `rays::sets::by_name` knows it
        scene: String,
        /// Exactly so many
        threads: usize,
        /// Of Embree; without it, ours builds
        library: Option<PathBuf>,
    },
    /// Everything, and the page
    All {
        /// Fewer samples, seeds and rays: minutes instead of hours
        #[arg(long)]
        quick: bool,
    },
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), String> {
    let text = serde_json::to_string_pretty(value).map_err(|e| e.to_string())?;
    std::fs::write(path, text + "\n").map_err(|e| format!("{}: {e}", path.display()))
}

fn absolute(path: &Path) -> Result<PathBuf, String> {
    std::path::absolute(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn setting(places: &Places) -> Result<Setting, String> {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR"));
    let repository = bench.parent().ok_or("the benchmark has no repository around it")?.to_path_buf();
    let irradiant = match &places.irradiant {
        Some(path) => path.clone(),
        None => {
            let cargo = Command::new("cargo")
                .args(["build", "--release", "--quiet", "-p", "irradiant-cli"])
                .current_dir(&repository)
                // The folder of targets that cargo told this program is not the one of the repository.
                .env_remove("CARGO_MANIFEST_DIR")
                .status();
            if !cargo.is_ok_and(|s| s.success()) {
                return Err("irradiant could not be built".into());
            }
            let target = std::env::var_os("CARGO_TARGET_DIR").map_or(repository.join("target"), PathBuf::from);
            target.join("release/irradiant")
        }
    };
    let work = absolute(places.work.as_deref().unwrap_or(&bench.join("work")))?;
    let results = absolute(places.results.as_deref().unwrap_or(&bench.join("results")))?;
    for folder in [&work, &results] {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    let peers = places.peers.as_deref().map(absolute).transpose()?;
    let irradiant = absolute(&irradiant)?;
    let given = places.irradiant.is_some();
    Ok(Setting {
        repository,
        irradiant,
        given,
        peers,
        work,
        results,
        threads: places.threads,
        only: places.only.clone(),
    })
}

fn run(cli: &Cli) -> Result<(), String> {
    if let What::Install { python } = &cli.what {
        let folder = cli.places.peers.as_deref().ok_or("where to? say --peers FOLDER, outside of the repository")?;
        return peers::install(&absolute(folder)?, python);
    }
    if let What::BuildOnce { scene, threads, library } = &cli.what {
        return rays::builds::child(scene, *threads, library.as_deref());
    }
    let setting = setting(&cli.places)?;
    let pictures = |scenes: &[String], amount: &pictures::Amount| -> Result<(), String> {
        for name in scenes {
            let scene = scene::by_name(name).ok_or_else(|| format!("{name}: no such scene"))?;
            let report = pictures::run(&scene, amount, &setting)?;
            write_json(&setting.results.join(format!("pictures-{name}.json")), &report)?;
        }
        Ok(())
    };
    let rays = |passes: usize, width: usize| {
        write_json(&setting.results.join("rays.json"), &rays::run(passes.max(1), width, &setting)?)
    };
    let street =
        |amount: &street::Amount| write_json(&setting.results.join("street.json"), &street::run(amount, &setting)?);
    let growth = |largest| write_json(&setting.results.join("growth.json"), &growth::run(largest, &setting)?);
    match &cli.what {
        What::Install { .. } | What::BuildOnce { .. } => return Ok(()),
        What::Pictures { scenes, spp, seeds, reference_spp } => {
            pictures(scenes, &pictures::Amount { spp: *spp, seeds: *seeds, reference_spp: *reference_spp })?;
        }
        What::Rays { passes, width } => rays(*passes, *width)?,
        What::Street { reference_spp, largest_spp, shrink } => {
            let (reference_spp, largest_spp, shrink) = (*reference_spp, *largest_spp, (*shrink).max(1));
            street(&street::Amount { reference_spp, largest_spp, shrink })?;
        }
        What::Growth { largest } => growth(*largest)?,
        What::Page => {}
        What::All { quick } => {
            let all = scene::PICTURES.map(String::from);
            let (spp, seeds, reference_spp) = if *quick { (16, 2, 128) } else { (64, 4, 1024) };
            pictures(&all, &pictures::Amount { spp, seeds, reference_spp })?;
            let (reference_spp, largest_spp, shrink) = if *quick { (64, 32, 4) } else { (128, 64, 1) };
            street(&street::Amount { reference_spp, largest_spp, shrink })?;
            if *quick {
                rays(3, 256)?
            } else {
                rays(5, 1024)?
            }
            growth(if *quick { 1_000_000 } else { 10_000_000 })?;
        }
    }
    page::write(&setting.results)
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
