//! `irradiant render`: a scene in, a picture out.

use crate::exit::Exit;
use crate::options::{PictureOptions, parse_duration};
use crate::progress::{Reporter, short_count, short_time};
use crate::stats::Clock;
use clap::Args;
use irradiant::{Error, Job, Rendering, SceneFile};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Render a scene (pbrt-v4 text; "-" reads standard input; none: the built-in Cornell box)
#[derive(Args, Debug)]
pub struct RenderArguments {
    /// Scene file
    scene: Option<PathBuf>,
    /// Picture to write; the kind follows from the extension: .exr .png .pfm .hdr .qoi .jpg. May be given several times
    /// [default: the scene's own name, as .exr and .png, in the current directory]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    picture: PictureOptions,
    /// Stop after this time (60s, 5m, 1h) with what is there
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    time: Option<Duration>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Brighten display pictures (.png, .qoi, .jpg) by this many stops; .exr, .pfm and .hdr stay as they are
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
    /// A quick look: a quarter of the pixels, at most 16 samples each
    #[arg(long)]
    preview: bool,
    /// Write seconds, CPU seconds, rays, memory as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(ev) if ev.abs() <= 64.0 => Ok(ev),
        Ok(_) => Err("must be between -64 and 64".into()),
        Err(_) => Err("not a number".into()),
    }
}

/// Loads, renders, writes.
pub fn run(arguments: &RenderArguments) -> Exit {
    match render(arguments) {
        Ok(()) => Exit::Ok,
        Err(error) => Exit::of(&error),
    }
}

fn render(arguments: &RenderArguments) -> Result<(), Error> {
    let mut clock = Clock::start();
    let file = match &arguments.scene {
        Some(path) => irradiant::load(path)?,
        None => irradiant::cornell_box(),
    };
    clock.lap("read");
    let outputs = output_paths(arguments, &file)?;
    let mut settings = arguments.picture.settings();
    settings.threads = arguments.threads.unwrap_or(0) as usize;
    settings.time_limit = arguments.time;
    if arguments.preview {
        let full = settings.resolution.unwrap_or(file.desc.film.resolution.value);
        settings.resolution = Some(full.map(|n| (n / 2).max(1)));
        let spp = settings.samples_per_pixel.unwrap_or(file.desc.sampler.samples_per_pixel.value);
        settings.samples_per_pixel = Some(spp.min(16));
    }
    let job = Job::new(&file, &settings)?;
    clock.lap("compile");
    if !arguments.quiet && !job.report.diagnostics.is_empty() {
        eprintln!("{}", job.report);
    }
    if !arguments.quiet {
        let bounds = job.scene.new_film().bounds();
        eprintln!(
            "{}: {} x {} pixels, {} samples each, {}",
            file.name,
            bounds.width(),
            bounds.height(),
            job.header.samples_per_pixel,
            job.header.estimate
        );
    }

    let rendering = watch(&job, arguments.quiet)?;
    clock.lap("render");
    for path in &outputs {
        rendering.save_exposed(path, arguments.exposure)?;
    }
    clock.lap("write");

    if let Some(path) = &arguments.stats {
        let threads = job_threads(arguments);
        let command: Vec<String> = std::env::args().collect();
        let json = clock.json(&rendering.stats, threads, &command);
        let text = serde_json::to_string_pretty(&json).unwrap_or_default() + "\n";
        irradiant::image::atomic_write(path, text.as_bytes())
            .map_err(|why| Error::Output { path: path.clone(), why })?;
    }
    report_refused(&rendering);
    if !arguments.quiet {
        let names: Vec<String> = outputs.iter().map(|p| p.display().to_string()).collect();
        let (seconds, cpu) = clock.total();
        eprintln!(
            "wrote {} ({}, {:.1} CPU s, {}paths/s)",
            names.join(", "),
            short_time(Duration::from_secs_f64(seconds)),
            cpu,
            short_count(rendering.stats.paths as f64 / clock.seconds("render").max(1e-9))
        );
    }
    Ok(())
}

fn job_threads(arguments: &RenderArguments) -> usize {
    match arguments.threads {
        Some(n) => n as usize,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// Renders with progress; Ctrl-C ends early with the picture so far, a second one at once.
fn watch(job: &Job, quiet: bool) -> Result<Rendering, Error> {
    let interrupts = Arc::new(AtomicU32::new(0));
    let counter = Arc::clone(&interrupts);
    // A handler that cannot be set (there is one already, in an embedding process) only means no early picture.
    let _ = ctrlc::set_handler(move || {
        if counter.fetch_add(1, Ordering::Relaxed) > 0 {
            std::process::exit(130);
        }
    });
    let session = job.start();
    let mut reporter = Reporter::new(quiet);
    let (mut noise, mut noise_at) = (0.0, Instant::now());
    let mut interrupted = false;
    loop {
        let progress = session.progress();
        if progress.finished {
            break;
        }
        if reporter.wants_noise() && (noise == 0.0 || noise_at.elapsed() > Duration::from_secs(2)) {
            (noise, noise_at) = (session.totals().relative_error, Instant::now());
        }
        reporter.update(&progress, noise);
        if !interrupted && interrupts.load(Ordering::Relaxed) > 0 {
            interrupted = true;
            session.cancel();
            eprintln!("stopping; writing the picture so far (Ctrl-C again quits without it)");
        }
        std::thread::sleep(Duration::from_millis(if progress.elapsed.as_millis() < 500 { 2 } else { 25 }));
    }
    reporter.finish();
    let finished = session.wait();
    if finished.worker_panicked {
        return Err(Error::Internal("a render thread stopped; please report the scene and the command".into()));
    }
    Ok(job.rendering(finished.film, finished.stats))
}

/// Where to write: as asked for, else the scene's own name in the current directory, EXR and PNG.
fn output_paths(arguments: &RenderArguments, file: &SceneFile) -> Result<Vec<PathBuf>, Error> {
    let paths = if arguments.output.is_empty() {
        let named = file.desc.film.filename.as_ref().map(|f| f.value.clone());
        let stem = named.as_deref().map(Path::new).and_then(Path::file_stem);
        let from_scene = arguments.scene.as_deref().and_then(Path::file_stem);
        let stem = stem.or(from_scene).map_or("irradiant".into(), |s| s.to_string_lossy().into_owned());
        vec![PathBuf::from(format!("{stem}.exr")), PathBuf::from(format!("{stem}.png"))]
    } else {
        arguments.output.clone()
    };
    // Tell now, not after hours of rendering.
    for path in &paths {
        if irradiant::image::FileFormat::from_name(&path.to_string_lossy()).is_none() {
            return Err(Error::Settings(format!(
                "--output {}: unknown kind of picture; known are .exr .png .pfm .hdr .qoi .jpg",
                path.display()
            )));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(Error::Settings(format!(
                "--output {}: there is no folder {}",
                path.display(),
                folder.display()
            )));
        }
    }
    Ok(paths)
}

/// Refused samples are never hidden: how many, and where the first ones are.
fn report_refused(rendering: &Rendering) {
    let totals = rendering.film.totals();
    let refused = totals.not_finite + totals.out_of_range;
    if refused == 0 {
        return;
    }
    eprintln!(
        "warning: {refused} of {} samples were not finite or out of range and are left out of the means, in {} pixels; replay the first with",
        totals.samples + refused,
        totals.pixels_with_refused
    );
    for (x, y, index) in rendering.stats.refused.iter().take(3) {
        eprintln!("    irradiant probe SCENE --pixel {x},{y} --sample {index}");
    }
}
