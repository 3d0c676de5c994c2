//! `irradiant check`: what a scene holds, and what will not be honoured.

use crate::exit::Exit;
use crate::say::say;
use clap::Args;
use irradiant::{Job, RenderSettings};
use std::path::PathBuf;

/// Read and compile a scene without rendering: what it holds, what will not be honoured, all errors at once
#[derive(Args, Debug)]
pub struct CheckArguments {
    /// Scene file
    #[arg(required_unless_present = "explain")]
    scene: Option<PathBuf>,
    /// Scene content that is not honoured is an error
    #[arg(long)]
    strict: bool,
    /// Explain a diagnostic's code, e.g. E0101
    #[arg(long, value_name = "CODE")]
    explain: Option<String>,
}

/// Prints the facts.
pub fn run(arguments: &CheckArguments) -> Exit {
    if let Some(code) = &arguments.explain {
        return explain(code);
    }
    let Some(path) = &arguments.scene else { return Exit::Usage };
    let settings = RenderSettings { strict: arguments.strict, ..RenderSettings::default() };
    let result = irradiant::load(path).and_then(|file| Job::new(&file, &settings).map(|job| (file, job)));
    let (file, job) = match result {
        Ok(ok) => ok,
        Err(error) => return Exit::of(&error),
    };
    let facts = job.scene.facts();
    println!("{}", file.name);
    let bounds = job.scene.bounds();
    println!(
        "  film         {} x {} pixels, {} samples each",
        bounds.width(),
        bounds.height(),
        job.scene.samples_per_pixel
    );
    println!("  integrator   {} ({})", job.header.integrator, job.header.estimate);
    println!("  sampler      {}", job.header.sampler);
    println!("  camera       {}", facts.camera);
    println!(
        "  shapes       {} ({} triangles, {} other primitives, {} instances)",
        facts.shapes, facts.triangles, facts.other_primitives, facts.instances
    );
    println!("  materials    {}", facts.materials);
    println!("  textures     {} ({} images, {:.1} MB)", facts.textures, facts.images, facts.image_bytes as f64 / 1e6);
    println!(
        "  lights       {} ({} from emitting shapes, {} infinite)",
        facts.lights, facts.area_lights, facts.infinite_lights
    );
    println!(
        "  memory       {:.1} MB of geometry, {:.1} MB of film",
        facts.geometry_bytes as f64 / 1e6,
        job.film_bytes() as f64 / 1e6
    );
    let not_honoured: Vec<&str> = job.report.diagnostics.not_honoured().collect();
    if not_honoured.is_empty() {
        println!("  everything that the scene says is honoured");
    } else {
        println!("  not honoured {}", not_honoured.join("; "));
    }
    if !job.report.diagnostics.is_empty() {
        println!();
        print!("{}", job.report);
        println!();
    }
    Exit::Ok
}

fn explain(code: &str) -> Exit {
    if let Some(text) = irradiant::core::codes::explain(code) {
        println!("{}: {text}", code.to_ascii_uppercase());
        return Exit::Ok;
    }
    match irradiant::formats::pbrt::codes::explain(code) {
        Some(entry) => {
            println!("{}: {}\n\nFor example:\n\n{}", entry.code, entry.explanation, entry.example);
            Exit::Ok
        }
        None => {
            say!("there is no diagnostic {code}");
            Exit::Usage
        }
    }
}
