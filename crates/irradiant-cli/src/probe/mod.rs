//! `irradiant probe`: samples replayed, their paths printed, drawn and accounted for.

mod json;
mod light;
mod print;

use crate::exit::Exit;
use crate::options::PictureOptions;
use clap::Args;
use irradiant::drawing::{DrawingOptions, draw_paths};
use irradiant::renderer::inspect::{PathStory, replay};
use irradiant::renderer::path::PathIntegrator;
use irradiant::{Error, Job};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Replay samples of one pixel: print their paths, draw them, keep their books
#[derive(Args, Debug)]
pub struct ProbeArguments {
    /// Scene file [default: the built-in Cornell box]
    scene: Option<PathBuf>,
    /// Pixel: column, row
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, allow_hyphen_values = true, required_unless_present = "residual")]
    pixel: Option<Pixel>,
    /// Which of the pixel's samples
    #[arg(long, value_name = "I", default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(u32))]
    sample: u32,
    /// So many samples, from that one on
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    paths: u32,
    /// Only light after so many scattering events: a number, or a range A..B
    #[arg(long, value_name = "N|A..B", allow_hyphen_values = true, value_parser = parse_bounces)]
    bounces: Option<RangeInclusive<u32>>,
    /// As one JSON object
    #[arg(long)]
    json: bool,
    /// Draw the paths: over the picture, and in the scene from outside and above (.svg)
    #[arg(short, long, value_name = "FILE.svg")]
    output: Option<PathBuf>,
    /// Instead of paths: a picture of the light that arrives at the surface in the middle of the pixel, and whether what
    /// it scatters is what the path tracer says
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sample", "paths", "bounces", "output", "residual"])]
    incident: Option<PathBuf>,
    /// Side of that picture, pixels
    #[arg(long, value_name = "N", default_value_t = 64, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=4096))]
    side: u32,
    /// Instead of paths: test the rendering equation at so many random points
    #[arg(long, value_name = "POINTS", conflicts_with_all = ["pixel", "sample", "paths", "bounces", "output"], allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    residual: Option<u32>,
    /// Paths for each pixel of the picture of --incident (64), or for each side of each equation of --residual (4096)
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    rays: Option<u32>,
    #[command(flatten)]
    pub picture: PictureOptions,
}

#[derive(Clone, Copy, Debug)]
struct Pixel([i32; 2]);

fn parse_pixel(text: &str) -> Result<Pixel, String> {
    let (x, y) = text.split_once(',').ok_or("write it as X,Y")?;
    let number = |s: &str| s.trim().parse::<i32>().map_err(|_| format!("\"{s}\" is not a whole number"));
    Ok(Pixel([number(x)?, number(y)?]))
}

fn parse_bounces(text: &str) -> Result<RangeInclusive<u32>, String> {
    let number = |s: &str| s.trim().parse::<u32>().map_err(|_| format!("\"{s}\" is not a whole number"));
    match text.split_once("..") {
        None => number(text).map(|n| n..=n),
        Some((a, b)) => {
            let range = number(a)?..=number(b.trim_start_matches('='))?;
            if range.is_empty() { Err(format!("{text} is empty; write the smaller number first")) } else { Ok(range) }
        }
    }
}

/// Traces, prints, draws.
pub fn run(arguments: &ProbeArguments) -> Exit {
    match probe(arguments) {
        Ok(()) => Exit::Ok,
        Err(error) => Exit::of(&error),
    }
}

fn probe(arguments: &ProbeArguments) -> Result<(), Error> {
    let file = match &arguments.scene {
        Some(path) => irradiant::load(path)?,
        None => irradiant::cornell_box(),
    };
    if let Some(path) = &arguments.output
        && path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("svg"))
    {
        return Err(Error::Settings(format!(
            "--output {}: drawings are SVG files; name it .svg (browsers and picture editors turn it into PNG)",
            path.display()
        )));
    }
    let job = Job::new(&file, &arguments.picture.settings())?;
    let scene = &job.scene;
    let integrator = path_integrator(&job)?;
    if let Some(points) = arguments.residual {
        return light::residual(&job, &integrator, &file.name, points, arguments.rays.unwrap_or(4096), arguments.json);
    }
    // One of the two is there: clap sees to it.
    let Some(Pixel(pixel)) = arguments.pixel else { return Ok(()) };
    check_sample(&job, pixel, arguments.sample, arguments.paths)?;
    if let Some(path) = &arguments.incident {
        let rays = arguments.rays.unwrap_or(64);
        return light::incident(&job, &integrator, &file.name, pixel, path, arguments.side, rays, arguments.json);
    }
    let stories: Vec<PathStory> = (arguments.sample..arguments.sample + arguments.paths)
        .filter_map(|sample| replay(scene, &integrator, pixel, sample))
        .collect();
    if arguments.json {
        let value = json::stories(&job, &file.name, &stories, arguments.bounces.as_ref());
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
    } else {
        let [x, y] = pixel;
        let samples = match arguments.paths {
            1 => format!("sample {}", arguments.sample),
            n => format!("samples {} to {}", arguments.sample, arguments.sample + n - 1),
        };
        println!("{} pixel {x},{y} {samples} seed {}", file.name, scene.seed);
        print::stories(&job, &stories, arguments.bounces.as_ref());
    }
    if let Some(path) = &arguments.output {
        let [x, y] = pixel;
        let filter = match &arguments.bounces {
            None => String::new(),
            Some(r) if r.start() == r.end() => format!(" · light after {} bounces", r.start()),
            Some(r) => format!(" · light after {} to {} bounces", r.start(), r.end()),
        };
        let samples = match arguments.paths {
            1 => format!("sample {}", arguments.sample),
            n => format!("{n} samples"),
        };
        let options = DrawingOptions {
            title: format!("{} · pixel {x}, {y} · {samples}{filter}", file.name),
            bounces: arguments.bounces.clone(),
            backdrop_samples: 16,
        };
        let drawn = draw_paths(&job, &integrator, &stories, &options)
            .and_then(|svg| irradiant::image::atomic_write(path, svg.as_bytes()));
        drawn.map_err(|why| Error::Output { path: path.clone(), why })?;
    }
    Ok(())
}

/// The job's path integrator: the only one that tells its story.
fn path_integrator(job: &Job) -> Result<PathIntegrator, Error> {
    job.path_integrator().ok_or_else(|| {
        let name = job.integrator_choice().name();
        Error::Settings(format!("probe replays the path integrator, not {name}; add --integrator path"))
    })
}

fn check_sample(job: &Job, [x, y]: [i32; 2], sample: u32, paths: u32) -> Result<(), Error> {
    let scene = &job.scene;
    let bounds = scene.bounds();
    if !bounds.contains(x, y) {
        return Err(Error::Settings(format!(
            "--pixel {x},{y} is outside the picture: columns {} to {}, rows {} to {}",
            bounds.x0,
            bounds.x1 - 1,
            bounds.y0,
            bounds.y1 - 1
        )));
    }
    if sample.saturating_add(paths) > scene.samples_per_pixel {
        return Err(Error::Settings(format!(
            "--sample {sample} --paths {paths}: the picture has {} samples per pixel (0 to {}); --spp raises it",
            scene.samples_per_pixel,
            scene.samples_per_pixel - 1
        )));
    }
    Ok(())
}
