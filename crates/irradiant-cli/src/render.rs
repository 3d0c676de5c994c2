//! `irradiant render`: a scene in, a picture out.

use crate::exit::Exit;
use crate::interrupts::Interrupts;
use crate::options::{Color, PictureOptions, parse_duration, parse_exposure};
use crate::progress::{Reporter, short_count, short_time};
use crate::say::say;
use crate::stats::{self, Clock};
use clap::Args;
use irradiant::image::FileFormat;
use irradiant::renderer::Progress;
use irradiant::renderer::inspect::{AuditSettings, AuditWatch, EnergyAudit, watched_audit};
use irradiant::scene::desc::SamplerKind;
use irradiant::{Aov, Error, IntegratorChoice, Job, MaxDepth, Rendering, SceneFile};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Render a scene (pbrt-v4 text; "-" reads standard input; none: the built-in Cornell box)
#[derive(Args, Debug)]
pub struct RenderArguments {
    /// Scene file
    scene: Option<PathBuf>,
    /// Picture to write; the kind follows from the extension: .exr .png .pfm .hdr .qoi .jpg. May be given several times
    /// [default: the base name of the scene's film, as .exr and .png, in the current directory]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    pub picture: PictureOptions,
    /// Stop after this time (60s, 5m, 1h) with what is there
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse_duration)]
    time: Option<Duration>,
    /// How rays leave surfaces: robust, or, to see what it is good for, none, epsilon=E, skip-id, project or fp64 (by the
    /// integrator selfintersection; biased)
    #[arg(long, value_name = "MODE", value_parser = parse_self_intersection, conflicts_with_all = ["integrator", "estimator"])]
    self_intersection: Option<SelfIntersection>,
    /// Trace light from the lamps too (so many paths), and print where the energy goes
    #[arg(long, value_name = "PATHS", num_args = 0..=1, require_equals = true, default_missing_value = "200000", value_parser = parse_audit)]
    audit: Option<u64>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Brighten display pictures (.png, .qoi, .jpg) by this many stops; .exr, .pfm and .hdr stay as they are
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
    /// Layers by kinds of paths, in the .exr: NAME=EXPRESSION (as in caustics=LS+DE), bounces:N, partial:N, lights, groups,
    /// techniques or gi; may be given several times
    #[arg(long, value_name = "LAYERS")]
    aov: Vec<Aov>,
    /// Write the picture and its layers, small and labelled, on one sheet
    #[arg(long, value_name = "FILE.png")]
    contact_sheet: Option<PathBuf>,
    /// A quick look: a quarter of the pixels, at most 16 samples each, by zsobol; --resolution, --spp and --sampler stay as they are said
    #[arg(long)]
    preview: bool,
    /// Write seconds, CPU seconds, rays, memory as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Say nothing but errors and refused samples
    #[arg(short, long)]
    quiet: bool,
}

/// `--self-intersection`: robust is what every integrator does.
#[derive(Clone, Debug)]
struct SelfIntersection(Option<IntegratorChoice>);

/// Particles of `--audit`.
fn parse_audit(text: &str) -> Result<u64, String> {
    let wanted = "a whole number of paths from 1000 to 1000000000, e.g. --audit=200000; --audit alone takes 200000";
    match text.parse() {
        Ok(n @ 1000..=1_000_000_000) => Ok(n),
        Ok(n) => Err(format!("{n} is not between 1000 and 1000000000: write {wanted}")),
        Err(_) => Err(format!("\"{text}\" is not a number: write {wanted}")),
    }
}

/// A number that stands behind `--audit` as a word of its own is read as a scene's name: says how to write it.
pub fn say_audit_hint() {
    let words: Vec<String> = std::env::args().collect();
    let number = words.windows(2).find(|w| w[0] == "--audit" && w[1].parse::<u64>().is_ok()).map(|w| &w[1]);
    if let Some(number) = number {
        say!("help: for an audit of {number} paths write --audit={number}");
    }
}

fn parse_self_intersection(text: &str) -> Result<SelfIntersection, String> {
    if text == "robust" {
        return Ok(SelfIntersection(None));
    }
    let (leaving, epsilon) = text.split_once('=').map_or((text, None), |(word, e)| (word, Some(e)));
    let known = ["robust", "none", "epsilon=E", "skip-id", "project", "fp64"];
    if epsilon.is_some() != (leaving == "epsilon") || !known.iter().any(|k| k.trim_end_matches("=E") == leaving) {
        return Err(format!("known are {}", known.join(", ")));
    }
    let choice = IntegratorChoice::named("selfintersection").and_then(|c| c.with("leaving", leaving));
    let choice = choice.and_then(|c| epsilon.map_or(Ok(c.clone()), |e| c.with("epsilon", e)));
    choice.map(|c| SelfIntersection(Some(c))).map_err(|why| why.to_string())
}

/// Loads, renders, writes.
pub fn run(arguments: &RenderArguments) -> Exit {
    match render(arguments) {
        Ok(exit) => exit,
        Err(error) => {
            let exit = Exit::of(&error);
            if matches!(error, Error::Unreadable { .. }) {
                say_audit_hint();
            }
            exit
        }
    }
}

fn render(arguments: &RenderArguments) -> Result<Exit, Error> {
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
    settings.aovs = arguments.aov.clone();
    if let Some(SelfIntersection(Some(choice))) = &arguments.self_intersection {
        if !arguments.aov.is_empty() {
            return Err(Error::Settings(
                "--aov and --self-intersection do not go together: layers are those of the integrator path, and ways of leaving a \
                 surface are shown by the integrator selfintersection; leave one of the two out (--self-intersection robust is what \
                 path does)"
                    .into(),
            ));
        }
        settings.integrator = Some(choice.clone());
    }
    if arguments.preview {
        settings.resolution.get_or_insert(file.desc.film.resolution.value.map(|n| (n / 2).max(1)));
        settings.samples_per_pixel.get_or_insert(file.desc.sampler.samples_per_pixel.value.min(16));
        // Blue noise: a sixth to a half less of what is left when an eye blurs the picture (decision 7).
        settings.sampler.get_or_insert(SamplerKind::ZSobol);
    }
    let job = Job::new(&file, &settings)?;
    clock.lap("compile");
    if !arguments.quiet && !job.report.diagnostics.is_empty() {
        say!("{}", job.report);
    }
    if !arguments.quiet {
        let bounds = job.scene.bounds();
        say!(
            "{}: {} x {} pixels, {} sample{} each, {}",
            file.name,
            bounds.width(),
            bounds.height(),
            job.header.samples_per_pixel,
            if job.header.samples_per_pixel == 1 { "" } else { "s" },
            job.header.estimate
        );
    }

    let interrupts = Interrupts::listen();
    let Watched { rendering, interrupted, worker_panicked } = watch(&job, &interrupts, arguments.quiet);
    clock.lap("render");
    // One that cannot be written must not cost the others.
    let mut failed = None;
    for path in &outputs {
        if let Err(why) = rendering.save_exposed(path, arguments.exposure) {
            if failed.is_none() {
                failed = Some(why);
            } else {
                say!("{why}");
            }
        }
    }
    if let Some(path) = &arguments.contact_sheet
        && let Err(why) = rendering.save_contact_sheet(path, arguments.exposure)
    {
        say!("{why}");
        failed.get_or_insert(why);
    }
    if let Some(why) = failed {
        return Err(why);
    }
    clock.lap("write");

    let (mut audit, mut interrupted) = (None, interrupted);
    if let Some(paths) = arguments.audit {
        if interrupts.asked() {
            say!("the audit is left out");
            interrupted = true;
        } else {
            let settings = AuditSettings { paths, max_depth: job.max_depth(), seed: job.header.seed };
            let (books, stopped) = watch_audit(&job, &settings, &interrupts, arguments.quiet);
            (audit, interrupted) = (books, interrupted || stopped);
            clock.lap("audit");
        }
    }
    if let Some(books) = &audit {
        print!("{}", stats::audit_in_words(&job.scene, books));
    }
    if let Some(path) = &arguments.stats {
        let threads = job_threads(arguments);
        let command: Vec<String> = std::env::args().collect();
        let mut json = clock.json(&rendering.stats, threads, &command);
        json["pixels_without_samples"] = rendering.totals.pixels_without_samples.into();
        if let Some(books) = &audit {
            json["audit"] = stats::audit_as_json(&job.scene, books);
        }
        let text = serde_json::to_string_pretty(&json).unwrap_or_default() + "\n";
        irradiant::image::atomic_write(path, text.as_bytes())
            .map_err(|why| Error::Output { path: path.clone(), why })?;
    }
    report_refused(&job, &rendering, arguments);
    let stopped = rendering.stats.stopped_paths;
    if stopped > 0 && !arguments.quiet {
        say!(
            "{stopped} paths were ended by the safety stop of {}; what they would have found is missing",
            job.integrator_choice()
        );
    }
    if let (false, Some([least, most])) = (arguments.quiet, rendering.header.samples_taken) {
        say!("stopped early: {least} to {most} of {} samples per pixel", rendering.header.samples_per_pixel);
        let (none, all) = (rendering.totals.pixels_without_samples, rendering.film.bounds().area());
        if none > 0 {
            say!(
                "warning: {none} of {all} pixels ({:.1} %) have no sample and show nothing; a longer --time, a smaller --resolution or --preview helps",
                100.0 * none as f64 / all as f64
            );
        }
    }
    if !arguments.quiet {
        report_layers(&rendering);
        report_missing_light(&job);
        report_black(&job, &rendering);
        let names: Vec<String> =
            outputs.iter().chain(&arguments.contact_sheet).map(|p| p.display().to_string()).collect();
        let (seconds, cpu) = clock.total();
        say!(
            "wrote {} ({}, {:.1} CPU s, {}paths/s)",
            names.join(", "),
            short_time(Duration::from_secs_f64(seconds)),
            cpu,
            short_count(rendering.stats.paths as f64 / clock.seconds("render").max(1e-9))
        );
    }
    if worker_panicked {
        return Err(Error::Internal("a render thread stopped; the picture was written without its last tile".into()));
    }
    // A limit of time is a wish that was fulfilled; an interrupt leaves less than was wished for.
    Ok(if interrupted { Exit::Interrupted } else { Exit::Ok })
}

fn job_threads(arguments: &RenderArguments) -> usize {
    match arguments.threads {
        Some(n) => n as usize,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// What rendering left.
struct Watched {
    rendering: Rendering,
    /// Ctrl-C or a termination signal ended it.
    interrupted: bool,
    /// A bug: the picture lacks what that worker had under way.
    worker_panicked: bool,
}

/// Renders with progress; Ctrl-C ends early with the picture so far.
fn watch(job: &Job, interrupts: &Interrupts, quiet: bool) -> Watched {
    let session = job.start();
    let mut reporter = Reporter::new(quiet, "");
    let mut interrupted = false;
    loop {
        let progress = session.progress();
        if progress.finished {
            break;
        }
        reporter.update(&progress, || {
            let totals = session.totals();
            // With one sample a pixel has no variance to speak of.
            (totals.min_count >= 2).then_some(totals.relative_error)
        });
        if !interrupted && interrupts.asked() {
            interrupted = true;
            session.cancel();
            say!("stopping; writing the picture so far (Ctrl-C again quits without it)");
        }
        std::thread::sleep(wait(progress.elapsed));
    }
    reporter.finish();
    let finished = session.wait();
    let rendering = job.rendering(finished.film, finished.stats);
    // One that came when all samples were taken cost nothing.
    let interrupted = interrupted && rendering.header.samples_taken.is_some();
    Watched { rendering, interrupted, worker_panicked: finished.worker_panicked }
}

/// How long to look away.
fn wait(elapsed: Duration) -> Duration {
    Duration::from_millis(if elapsed.as_millis() < 500 { 2 } else { 25 })
}

/// Keeps the books with progress, or says why there are none; a signal ends it with the particles so far, and the second value says so.
fn watch_audit(
    job: &Job,
    settings: &AuditSettings,
    interrupts: &Interrupts,
    quiet: bool,
) -> (Option<EnergyAudit>, bool) {
    let watch = AuditWatch::default();
    let started = Instant::now();
    let mut reporter = Reporter::new(quiet, "audit ");
    let books = std::thread::scope(|scope| {
        let books = scope.spawn(|| watched_audit(&job.scene, settings, &watch));
        while !books.is_finished() {
            let elapsed = started.elapsed();
            let samples_done = watch.done.load(Ordering::Relaxed);
            reporter
                .update(&Progress { samples_done, samples_total: settings.paths, elapsed, finished: false }, || None);
            if interrupts.asked() {
                watch.stop.store(true, Ordering::Relaxed);
            }
            std::thread::sleep(wait(elapsed));
        }
        books.join().unwrap_or_else(|why| std::panic::resume_unwind(why))
    });
    reporter.finish();
    let traced = watch.done.load(Ordering::Relaxed);
    let stopped = watch.stop.load(Ordering::Relaxed) && traced < settings.paths;
    if stopped {
        say!("the audit was stopped after {traced} of {} particles; the picture has been written", settings.paths);
    } else if books.is_none() {
        say!("audit: there is no light in the scene");
    }
    (books, stopped)
}

/// Where to write: as asked for, else the scene's own name in the current directory, EXR and PNG.
fn output_paths(arguments: &RenderArguments, file: &SceneFile) -> Result<Vec<PathBuf>, Error> {
    let paths = if arguments.output.is_empty() {
        let named = file.desc.film.filename.as_ref().map(|f| f.value.clone());
        let stem = named.as_deref().map(Path::new).and_then(Path::file_stem);
        let from_scene = arguments.scene.as_deref().and_then(Path::file_stem).filter(|s| *s != "-");
        let stem = stem.or(from_scene).map_or("irradiant".into(), |s| s.to_string_lossy().into_owned());
        vec![PathBuf::from(format!("{stem}.exr")), PathBuf::from(format!("{stem}.png"))]
    } else {
        arguments.output.clone()
    };
    // Tell now, not after hours of rendering.
    for path in paths.iter().chain(&arguments.stats).chain(&arguments.contact_sheet) {
        check_folder(path)?;
    }
    refuse_doubles(paths.iter().chain(&arguments.stats).chain(&arguments.contact_sheet))?;
    if let Some(path) = &arguments.contact_sheet
        && FileFormat::from_name(&path.to_string_lossy()) != Some(FileFormat::Png)
    {
        return Err(Error::Settings(format!("--contact-sheet {}: sheets are .png", path.display())));
    }
    let format = |path: &PathBuf| FileFormat::from_name(&path.to_string_lossy());
    for path in &paths {
        if format(path).is_none_or(|f| matches!(f, FileFormat::Tga | FileFormat::Bmp)) {
            return Err(Error::Settings(format!(
                "--output {}: not a kind of picture that can be written; these can: .exr .png .pfm .hdr .qoi .jpg",
                path.display()
            )));
        }
    }
    if !arguments.aov.is_empty() && !paths.iter().any(|path| format(path) == Some(FileFormat::Exr)) {
        let names = paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
        if arguments.contact_sheet.is_none() {
            return Err(Error::Settings(format!(
                "--aov: {names} cannot hold layers; write an .exr too (-o layers.exr), or --contact-sheet sheet.png to look at them"
            )));
        }
        if !arguments.quiet {
            say!(
                "warning: --aov: {names} cannot hold layers, which will be on the contact sheet only; an .exr holds them"
            );
        }
    }
    Ok(paths)
}

/// That no two of these are one file, of which only the last would stay. Their folders exist.
fn refuse_doubles<'a>(paths: impl Iterator<Item = &'a PathBuf>) -> Result<(), Error> {
    let mut seen = HashSet::new();
    for path in paths {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !seen.insert((folder.canonicalize().ok(), path.file_name())) {
            return Err(Error::Settings(format!(
                "{}: named twice, and one file cannot be both; leave one out or give it another name",
                path.display()
            )));
        }
    }
    Ok(())
}

/// That a file can be made where `path` wants to be.
fn check_folder(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let refuse = |what: String| Err(Error::Settings(format!("{}: {what}", path.display())));
    if path.is_dir() {
        return refuse("is a folder, not a file to write".into());
    }
    if !folder.is_dir() {
        return refuse(format!("there is no folder {}", folder.display()));
    }
    let trial = folder.join(format!(".irradiant-trial-{}", std::process::id()));
    match std::fs::OpenOptions::new().write(true).create_new(true).open(&trial) {
        Ok(_) => {
            let _ = std::fs::remove_file(&trial);
            Ok(())
        }
        Err(error) => {
            let why = irradiant::image::ImageError::Io { path: folder.to_owned(), error };
            Err(Error::Output { path: path.to_owned(), why })
        }
    }
}

/// How much of the picture's light each layer shows; terms K^i with their ratio to the one before.
fn report_layers(rendering: &Rendering) {
    let layers = rendering.layer_light();
    let widest = layers.iter().map(|l| l.name.len()).max().unwrap_or(0);
    let mut before: Option<(u32, f64)> = None;
    for layer in &layers {
        let bounces = layer.name.strip_prefix('K').and_then(|n| n.parse::<u32>().ok());
        let ratio = match (before, bounces) {
            (Some((i, share)), Some(j)) if j == i + 1 && share > 0.0 => format!("   x {:.3}", layer.share / share),
            _ => String::new(),
        };
        say!("  {:widest$} {:9.4} %  {}{ratio}", layer.name, 100.0 * layer.share, layer.expression);
        before = bounces.map(|i| (i, layer.share));
    }
}

/// Paths with light beyond the depth limit from which its amount and its error can be told.
const ENOUGH: u64 = 16;
/// Standard error over what it is of, beyond which a number tells nothing.
const VAGUE: f64 = 0.3;

/// What a depth limit leaves out, where so few paths can tell; that there is a limit stands in the label.
fn report_missing_light(job: &Job) {
    let (Some(max_depth), Some(missing)) = (job.max_depth(), job.missing_light()) else { return };
    if missing.found < ENOUGH || missing.standard_error > VAGUE * missing.share {
        return;
    }
    say!(
        "maxdepth {max_depth} leaves out light: {:.2} % of the picture's, +- {:.2}, by {} paths without limit",
        100.0 * missing.share,
        100.0 * missing.standard_error,
        missing.paths
    );
}

/// A picture without any light is seldom what was wanted.
fn report_black(job: &Job, rendering: &Rendering) {
    let b = rendering.film.bounds();
    let pixels = || (b.y0..b.y1).flat_map(|y| (b.x0..b.x1).map(move |x| (x, y)));
    let (splats, totals) = (rendering.film.has_splats(), rendering.totals);
    if !splats && pixels().all(|(x, y)| rendering.film.pixel(x, y).mean() == [0.0; 3]) && totals.samples > 0 {
        let whose = if totals.not_finite + totals.out_of_range > 0 { "paths that were not refused" } else { "paths" };
        say!(
            "warning: the picture is black: none of its {whose} found light by {}; is there a lamp, does the camera see what it \
             lights, and can this estimator find it (see the label above)?",
            job.integrator_choice()
        );
    }
}

/// Refused samples are never hidden: how many, and where the first ones are; with the commands that replay them, if `probe` can.
fn report_refused(job: &Job, rendering: &Rendering, arguments: &RenderArguments) {
    let totals = rendering.totals;
    let refused = totals.not_finite + totals.out_of_range;
    if refused == 0 {
        return;
    }
    let warning = format!(
        "warning: {refused} of {} samples were not finite or out of range and are left out of the means, in {} pixels",
        totals.samples + refused,
        totals.pixels_with_refused
    );
    let first = rendering.stats.refused.iter().take(3);
    if job.path_integrator().is_none() {
        let places: Vec<String> = first.map(|(x, y, index)| format!("    pixel {x},{y} sample {index}\n")).collect();
        say!(
            "{warning}{}\n{}help: irradiant probe follows paths of the integrator path only, which are not those of {}; render with \
             --integrator path to see whether it refuses samples too, and probe those",
            if places.is_empty() { "" } else { "; the first are" },
            places.concat(),
            job.integrator_choice().name()
        );
        return;
    }
    say!("{warning}; replay the first with");
    let scene = arguments.scene.as_deref().map_or(String::new(), |p| format!("{} ", p.display()));
    let flags = replay_flags(rendering, arguments);
    for (x, y, index) in first {
        say!("    irradiant probe {scene}--pixel {x},{y} --sample {index}{flags}");
    }
}

/// What `probe` must be told to draw the samples of this render, whose integrator is `path`.
fn replay_flags(rendering: &Rendering, arguments: &RenderArguments) -> String {
    let picture = &arguments.picture;
    let mut flags = format!(" --spp {} --seed {}", rendering.header.samples_per_pixel, rendering.header.seed);
    if picture.resolution.is_some() || arguments.preview {
        let [width, height] = rendering.film.full_resolution();
        flags += &format!(" --resolution {width}x{height}");
    }
    if picture.sampler.is_some() || arguments.preview {
        flags += &format!(" --sampler {}", rendering.header.sampler);
    }
    if picture.integrator.is_some() {
        flags += " --integrator path";
    }
    for words in &picture.estimator {
        flags += &format!(" --estimator {words}");
    }
    match picture.max_depth {
        Some(MaxDepth::None) => flags += " --max-depth none",
        Some(MaxDepth::Limit(n)) => flags += &format!(" --max-depth {n}"),
        None => {}
    }
    if matches!(picture.color, Color::Rgb) {
        flags += " --color rgb";
    }
    flags
}
