//! From a description to a picture.

use crate::aov;
use crate::error::{Error, Report};
use crate::header::Header;
use crate::load::SceneFile;
use crate::settings::{ColorMode, MaxDepth, RenderSettings};
use irradiant_core::film::{DevelopOptions, Film, FilmTotals};
use irradiant_core::scene::{CompileOptions, Scene};
use irradiant_image::metadata::Chromaticities;
use irradiant_image::{FileFormat, Image, ToneOptions, atomic_write};
use irradiant_render::layered_path::{LayeredPath, PathLayer, PathLayers};
use irradiant_render::path::PathIntegrator;
use irradiant_render::registry::IntegratorChoice;
use irradiant_render::session::Finished;
use irradiant_render::truncation::{MissingLight, missing_light};
use irradiant_render::{Integrator, Limit, RenderStats, Session, SessionSettings};
use irradiant_spectrum::{Basis, ColorSpace};
use std::path::Path;
use std::sync::Arc;

/// A compiled scene with everything decided: ready to start.
pub struct Job {
    /// The scene, ready to be walked.
    pub scene: Arc<Scene>,
    /// What will be written into the picture's header.
    pub header: Header,
    /// Complaints of reading and compiling (warnings only).
    pub report: Report,
    integrator: IntegratorChoice,
    max_depth: Option<u32>,
    layers: Option<Arc<PathLayers>>,
    session: SessionSettings,
}

impl Job {
    /// Compiles a scene under the settings. All errors at once.
    pub fn new(file: &SceneFile, settings: &RenderSettings) -> Result<Self, Error> {
        let integrator_desc = &file.desc.integrator;
        let chosen = settings.integrator.clone().unwrap_or_else(|| IntegratorChoice::from(integrator_desc));
        let integrator = settings.estimator.iter().try_fold(chosen, |choice, words| choice.with_words(words))?;
        let max_depth = match settings.max_depth {
            Some(MaxDepth::None) => None,
            Some(MaxDepth::Limit(n)) => Some(n),
            None if file.unlimited_depth => None,
            None => Some(integrator_desc.max_depth.value),
        };
        let options = CompileOptions {
            basis: match settings.color {
                ColorMode::Spectral => Basis::Spectral,
                ColorMode::Rgb => Basis::Rgb,
            },
            resolution: settings.resolution,
            crop: settings.crop,
            samples_per_pixel: settings.samples_per_pixel,
            seed: settings.seed,
            sampler: settings.sampler,
            light_sampler: integrator.light_sampler(),
            splats: integrator.integrator(max_depth).splats(),
            max_film_bytes: settings.max_film_bytes.unwrap_or(CompileOptions::MAX_FILM_BYTES),
        };
        if settings.samples_per_pixel == Some(0) {
            return Err(Error::Settings("0 samples per pixel make no picture".into()));
        }
        let mut report = file.report.clone();
        let compiled = Scene::compile(&file.desc, &file.assets, &options);
        report.diagnostics.extend(compiled.diagnostics);
        report.diagnostics.sort();
        if settings.integrator.is_some() {
            // The scene's own, and what stands in for it, are not asked.
            report.diagnostics.forget_not_honoured("integrator ");
        }
        if settings.strict {
            report.diagnostics.promote_not_honoured();
        }
        let mut scene = match compiled.scene {
            Some(scene) if !report.diagnostics.has_errors() => scene,
            _ => return Err(Error::Scene(Box::new(report))),
        };
        if !settings.aovs.is_empty() && integrator.name() != "path" {
            return Err(Error::Settings(format!(
                "--aov takes the paths of the integrator \"path\" apart, not those of \"{}\"; add --integrator path",
                integrator.name()
            )));
        }
        let layers = aov::declare(&settings.aovs, &mut scene, &options)?.map(Arc::new);
        let scene = Arc::new(scene);
        let samples_per_pixel = scene.samples_per_pixel;
        let mut job = Self {
            header: Header {
                scene_hash: file.hash(),
                integrator: integrator.to_string(),
                sampler: scene.sampler.name().into(),
                color: match settings.color {
                    ColorMode::Spectral => "spectral".into(),
                    ColorMode::Rgb => "rgb".into(),
                },
                seed: scene.seed,
                samples_per_pixel,
                samples_taken: None,
                estimate: String::new(),
                not_honoured: report.diagnostics.not_honoured().map(String::from).collect(),
                samples_refused: 0,
                layers: layers.iter().flat_map(|l| l.as_slice()).map(describe).collect(),
                world_to_camera: scene.world_to_camera(),
            },
            scene,
            report,
            integrator,
            max_depth,
            layers,
            session: SessionSettings { threads: settings.threads, samples_per_pixel, time_limit: settings.time_limit },
        };
        let integrator = job.integrator();
        integrator.check(&job.scene).map_err(Error::Settings)?;
        job.header.estimate = estimate_label(integrator.as_ref(), &job.scene);
        Ok(job)
    }

    /// Memory that the picture's sums take, bytes: of the picture, of its layers, and of what comes from paths that begin at lights.
    pub fn film_bytes(&self) -> u64 {
        film_bytes(
            &self.scene,
            self.layers.as_ref().map_or(0, |layers| layers.as_slice().len()),
            self.integrator().splats(),
        )
    }

    /// The integrator, with its limits.
    pub fn integrator(&self) -> Box<dyn Integrator> {
        match (&self.layers, self.path_integrator()) {
            (Some(layers), Some(path)) => Box::new(LayeredPath { path, layers: Arc::clone(layers) }),
            _ => self.integrator.integrator(self.max_depth),
        }
    }

    /// Which integrator, with what options.
    pub fn integrator_choice(&self) -> &IntegratorChoice {
        &self.integrator
    }

    /// Scattering events at most; `None`: no limit.
    pub fn max_depth(&self) -> Option<u32> {
        self.max_depth
    }

    /// The path integrator that replays samples, if this job uses it.
    pub fn path_integrator(&self) -> Option<PathIntegrator> {
        (self.integrator.name() == "path").then(|| PathIntegrator::of(self.integrator.options(), self.max_depth))
    }

    /// What the depth limit leaves out, estimated from a few paths without limit (a sixteenth of the picture's, at least 256 and at most
    /// 16384);
    /// `None` without a limit, and of other integrators than `path`.
    pub fn missing_light(&self) -> Option<MissingLight> {
        let samples = self.scene.bounds().area() as u64 * u64::from(self.scene.samples_per_pixel);
        let paths = (samples / 16).clamp(256, 16384) as u32;
        missing_light(&self.scene, &self.path_integrator()?, paths)
    }

    /// Starts rendering.
    pub fn start(&self) -> Session {
        Session::start(Arc::clone(&self.scene), self.integrator(), &self.session)
    }

    /// The picture of a film of this job (finished or not).
    pub fn rendering(&self, film: Film, stats: RenderStats) -> Rendering {
        let totals = film.totals();
        let mut header = self.header.clone();
        header.samples_refused = totals.not_finite + totals.out_of_range;
        let wanted = header.samples_per_pixel;
        if (totals.min_count, totals.max_count) != (wanted, wanted) {
            header.samples_taken = Some([totals.min_count, totals.max_count]);
        }
        let (variance, color_space) = (self.scene.layers.variance, self.scene.color_space());
        Rendering { film, totals, stats, header, variance, color_space }
    }
}

/// A picture: sums and counts, and what they are of.
pub struct Rendering {
    /// Sums and counts.
    pub film: Film,
    /// What they come to.
    pub totals: FilmTotals,
    /// What was done.
    pub stats: RenderStats,
    /// What determines the pixels.
    pub header: Header,
    variance: bool,
    pub(crate) color_space: &'static ColorSpace,
}

impl Rendering {
    /// The image of means, linear, with its header.
    pub fn image(&self) -> Image {
        let mut image = self.film.develop(DevelopOptions { standard_error: false, variance: self.variance });
        let bounds = self.film.bounds();
        let [width, height] = self.film.full_resolution();
        image.metadata.origin = [bounds.x0, bounds.y0];
        image.metadata.display_window = Some([0, 0, width as i32, height as i32]);
        let pair = |[x, y]: [f64; 2]| [x as f32, y as f32];
        let [red, green, blue] = self.color_space.primaries.map(pair);
        let white = pair(self.color_space.white);
        image.metadata.chromaticities = Some(Chromaticities { red, green, blue, white });
        self.header.write_to(&mut image.metadata);
        image
    }

    /// Writes a file, all of it or none; the format follows from the extension (exr, png, pfm, hdr, qoi, jpg).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.save_exposed(path, 0.0)
    }

    /// As [`Rendering::save`], with an exposure in stops for formats that are for display (png, qoi, jpg).
    pub fn save_exposed(&self, path: impl AsRef<Path>, exposure: f32) -> Result<(), Error> {
        let path = path.as_ref();
        let format = FileFormat::from_name(&path.to_string_lossy()).ok_or_else(|| {
            Error::Settings(format!(
                "{}: unknown kind of picture; known are .exr .png .pfm .hdr .qoi .jpg",
                path.display()
            ))
        })?;
        let output = |why| Error::Output { path: path.to_owned(), why };
        let image = self.image();
        let image = match format {
            FileFormat::Exr => image,
            FileFormat::Pfm | FileFormat::Hdr => image.to_rgb().unwrap_or(image),
            _ => irradiant_image::to_srgb8(&image, &ToneOptions { exposure, ..ToneOptions::default() })
                .map_err(output)?,
        };
        let bytes = irradiant_image::write(&image, format).map_err(output)?;
        atomic_write(path, &bytes).map_err(output)
    }
}

/// Loads nothing, decides everything, renders, waits.
pub fn render(file: &SceneFile, settings: &RenderSettings) -> Result<Rendering, Error> {
    let job = Job::new(file, settings)?;
    let Finished { film, stats, worker_panicked } = job.start().wait();
    if worker_panicked {
        return Err(Error::Internal("a render thread stopped; please report the scene".into()));
    }
    Ok(job.rendering(film, stats))
}

/// Memory of a scene's film with so many layers of paths, bytes.
pub(crate) fn film_bytes(scene: &Scene, path_layers: usize, splats: bool) -> u64 {
    let of_splats = if splats { Film::SPLAT_BYTES_PER_PIXEL } else { 0 };
    let channels = (scene.layers.channels() + 3 * path_layers) as u64;
    (scene.bounds().area() as u64).saturating_mul(Film::bytes_per_pixel(channels) + of_splats)
}

/// A layer in words that determine its pixels.
fn describe(layer: &PathLayer) -> String {
    format!("{} = {}", layer.name, layer.expression.text())
}

/// "unbiased", or why not: what is left out, what is biased, what else is estimated.
fn estimate_label(integrator: &dyn Integrator, scene: &Scene) -> String {
    let mut limits = integrator.limits();
    limits.retain(|limit| limit.concerns(scene));
    // What the surfaces' models leave out matters where they are asked.
    if integrator.scatters() {
        limits.extend(scene.truncations().iter().cloned().map(Limit::Truncation));
    }
    limits.extend(scene.biases().iter().cloned().map(Limit::Bias));
    let group = |word: &str, belongs: &dyn Fn(&Limit) -> bool| {
        let list: Vec<String> = limits.iter().filter(|l| belongs(l)).map(ToString::to_string).collect();
        (!list.is_empty()).then(|| format!("{word}: {}", list.join(", ")))
    };
    let groups = [
        group("truncated", &|l| matches!(l, Limit::MaxDepth(_) | Limit::Truncation(_) | Limit::Unfound(..))),
        group("biased", &|l| matches!(l, Limit::Bias(_))),
        group("estimates", &|l| matches!(l, Limit::OtherQuantity(_))),
    ];
    let label = groups.into_iter().flatten().collect::<Vec<_>>().join("; ");
    if label.is_empty() { "unbiased".into() } else { label }
}
