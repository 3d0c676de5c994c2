//! What a row is given: how much to spend, seeds, the fault to suffer, other rows' results, a place for scenes.

use crate::estimate::{Estimator, Production};
use crate::row::{Fault, Measure, Outcome, Row, Verdict};
use crate::sheet::Sheet;
use crate::walk::{Walk, Wrong};
use irradiant::core::scene::Scene;
use irradiant::renderer::Integrator;
use irradiant::renderer::registry::IntegratorChoice;
use irradiant::{ColorMode, Error, Job, MaxDepth, RenderSettings, Rendering, SceneFile, load_text, render};
use std::any::Any;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// How much time a lesson may take on two cores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// Under three minutes.
    Quick,
    /// Under forty.
    Full,
}

type Kept = Arc<OnceLock<Arc<dyn Any + Send + Sync>>>;

/// What all rows of a lesson share.
pub(crate) struct Lesson {
    pub(crate) rows: Vec<Row>,
    pub(crate) outcomes: Vec<OnceLock<Outcome>>,
    pub(crate) budget: Budget,
    pub(crate) seed: u64,
    pub(crate) folder: Option<PathBuf>,
    pub(crate) fault: Option<(Fault, Wrong)>,
    kept: Mutex<BTreeMap<String, Kept>>,
    /// What each row is at; none of those that do not run.
    running: Vec<Mutex<Option<Running>>>,
}

/// A row at work.
struct Running {
    since: Instant,
    /// Scenes that it has read.
    scenes: u32,
    /// The last of them.
    scene: String,
}

impl Lesson {
    pub(crate) fn new(
        rows: Vec<Row>,
        budget: Budget,
        seed: u64,
        folder: Option<PathBuf>,
        fault: Option<(Fault, Wrong)>,
    ) -> Self {
        let outcomes = rows.iter().map(|_| OnceLock::new()).collect();
        let running = rows.iter().map(|_| Mutex::default()).collect();
        Self { rows, outcomes, budget, seed, folder, fault, kept: Mutex::default(), running }
    }

    /// What rows that have run for `patience` or longer are at, a line for each.
    pub(crate) fn news(&self, patience: Duration) -> Vec<String> {
        let news = |(row, running): (&Row, &Mutex<Option<Running>>)| {
            let running = running.lock().unwrap_or_else(|e| e.into_inner());
            let at = running.as_ref().filter(|at| at.since.elapsed() >= patience)?;
            let seconds = at.since.elapsed().as_secs();
            Some(match at.scenes {
                0 => format!("{}: {seconds} s so far", row.id),
                n => format!("{}: {seconds} s so far, scene {n}: {}", row.id, at.scene),
            })
        };
        self.rows.iter().zip(&self.running).filter_map(news).collect()
    }

    /// The outcome of a row, measured once.
    pub(crate) fn outcome(&self, index: usize) -> &Outcome {
        self.outcomes[index].get_or_init(|| {
            let row = &self.rows[index];
            let started = Instant::now();
            let at = |running| *self.running[index].lock().unwrap_or_else(|e| e.into_inner()) = running;
            at(Some(Running { since: started, scenes: 0, scene: String::new() }));
            let context = Context { lesson: self, id: row.id, index, seeds: AtomicU64::new(0) };
            // A panic is a failure of this row, not of the lesson.
            let ran = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| (row.run)(&context)));
            let mut outcome = match ran {
                Ok(Ok(outcome)) => outcome,
                Ok(Err(error)) => Outcome::fails(format!("{error}")),
                Err(_) => Outcome::fails("it panicked"),
            };
            let quick = if self.budget == Budget::Quick { "--quick " } else { "" };
            at(None);
            if let Some(missing) = context.command_without_scene(&outcome) {
                // No measures: it must not be taken for a row that is only slow.
                let verdict = Verdict::Fails(format!("no scene for its command: {missing}"));
                outcome = Outcome { verdict, measures: vec![], ..outcome };
            }
            outcome.commands.push(format!("irradiant teach {quick}--row {}", row.id));
            outcome.seconds = started.elapsed().as_secs_f64();
            outcome
        })
    }
}

/// How a scene is compiled or rendered for a row, over what it says itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Setup {
    /// Pixels; none: the scene's.
    pub size: Option<[u32; 2]>,
    /// Samples that low-discrepancy patterns are laid out for, or that are rendered; none: the scene's.
    pub spp: Option<u32>,
    /// With wavelengths; else three numbers.
    pub spectral: bool,
    /// Scattering events at most; none: no limit.
    pub max_depth: Option<u32>,
}

impl Setup {
    /// So many pixels on a side and samples.
    pub fn square(size: u32, spp: u32) -> Self {
        Self { size: Some([size; 2]), spp: Some(spp), ..Self::default() }
    }
}

/// What a row is given.
pub struct Context<'a> {
    lesson: &'a Lesson,
    /// The row.
    pub id: &'static str,
    index: usize,
    seeds: AtomicU64,
}

impl Context<'_> {
    /// How much to spend.
    pub fn budget(&self) -> Budget {
        self.lesson.budget
    }

    /// Samples: so many when quick, eight times as many in full.
    pub fn spp(&self, quick: u32) -> u32 {
        match self.lesson.budget {
            Budget::Quick => quick,
            Budget::Full => quick * 8,
        }
    }

    /// Side of a picture: so many pixels when quick, twice as many in full.
    pub fn side(&self, quick: u32) -> u32 {
        match self.lesson.budget {
            Budget::Quick => quick,
            Budget::Full => quick * 2,
        }
    }

    /// Another seed at each call, the same ones in each lesson of the same seed.
    pub fn seed(&self) -> u64 {
        let n = self.seeds.fetch_add(1, Ordering::Relaxed);
        self.lesson.seed.wrapping_mul(1 << 32) + self.index as u64 * 1000 + n + 1
    }

    /// Whether this row is to suffer the fault of that name.
    pub fn faulty(&self, name: &str) -> bool {
        self.lesson.fault.is_some_and(|(f, _)| f.row == self.id && f.name == name)
    }

    /// Whether this row suffers a fault and a measure has told so already: the rest would tell nothing more.
    pub fn noticed(&self, sheet: &Sheet) -> bool {
        self.lesson.fault.is_some_and(|(f, _)| f.row == self.id) && sheet.has_failed()
    }

    /// What is to be wrong with the estimator of this row.
    pub fn wrong(&self) -> Wrong {
        self.lesson.fault.filter(|(f, _)| f.row == self.id).map_or(Wrong::Nothing, |(_, wrong)| wrong)
    }

    /// The production estimator; under a fault the witness with something wrong.
    pub fn production(&self, max_depth: Option<u32>) -> Box<dyn Estimator> {
        match self.wrong() {
            Wrong::Nothing => Box::new(Production { max_depth, ..Production::default() }),
            wrong => Box::new(Walk { max_depth, wrong, ..Walk::WEIGHED }),
        }
    }

    /// The same, each surface asking the one light that the light sampler picks.
    pub fn production_of_one_light(&self, max_depth: Option<u32>) -> Box<dyn Estimator> {
        match self.wrong() {
            Wrong::Nothing => Box::new(Production { max_depth, one_light: true, ..Production::default() }),
            _ => self.production(max_depth),
        }
    }

    /// Reads a scene, and leaves it in the lesson's folder under `name` for whoever wants to render it.
    pub fn file(&self, name: &str, text: &str) -> Result<SceneFile, Error> {
        if let Some(at) = self.lesson.running[self.index].lock().unwrap_or_else(|e| e.into_inner()).as_mut() {
            (at.scenes, at.scene) = (at.scenes + 1, name.to_string());
        }
        let folder = self.scenes_folder();
        let path = folder.join(format!("{name}.pbrt"));
        let output = |error| Error::Output {
            path: path.clone(),
            why: irradiant::image::ImageError::Io { path: path.clone(), error },
        };
        std::fs::create_dir_all(&folder).map_err(output)?;
        std::fs::write(&path, text).map_err(output)?;
        load_text(name, text, folder)
    }

    /// Where scenes and what belongs to them are left: the lesson's folder, or one of the system's for the while.
    pub fn scenes_folder(&self) -> PathBuf {
        match &self.lesson.folder {
            Some(folder) => folder.join("scenes"),
            None => std::env::temp_dir().join(format!("irradiant-teach-{}", std::process::id())),
        }
    }

    /// The command that renders a scene of this lesson.
    pub fn command(&self, name: &str, rest: &str) -> String {
        format!("irradiant render {}/{name}.pbrt {rest}", self.told_folder().display())
    }

    /// Where commands say that scenes are.
    fn told_folder(&self) -> PathBuf {
        self.lesson.folder.as_deref().unwrap_or(std::path::Path::new("teach")).join("scenes")
    }

    /// A command that names a scene which was not written.
    fn command_without_scene<'a>(&self, outcome: &'a Outcome) -> Option<&'a str> {
        let there = |command: &str| {
            let told = format!("{}/", self.told_folder().display());
            let name = command.split_once(&told).and_then(|(_, rest)| rest.split_once(".pbrt"));
            name.is_some_and(|(name, _)| self.scenes_folder().join(format!("{name}.pbrt")).is_file())
        };
        outcome.commands.iter().map(String::as_str).find(|command| command.contains(".pbrt") && !there(command))
    }

    fn settings(&self, setup: Setup) -> RenderSettings {
        RenderSettings {
            samples_per_pixel: setup.spp,
            seed: Some(self.seed()),
            resolution: setup.size,
            max_depth: Some(setup.max_depth.map_or(MaxDepth::None, MaxDepth::Limit)),
            color: if setup.spectral { ColorMode::Spectral } else { ColorMode::Rgb },
            threads: 1,
            ..RenderSettings::default()
        }
    }

    /// Compiles a scene with a seed of its own.
    pub fn scene(&self, name: &str, text: &str, setup: Setup) -> Result<Arc<Scene>, Error> {
        Ok(Job::new(&self.file(name, text)?, &self.settings(setup))?.scene)
    }

    /// Renders a scene as the program does, with a seed of its own.
    pub fn render(&self, name: &str, text: &str, setup: Setup) -> Result<Rendering, Error> {
        render(&self.file(name, text)?, &self.settings(setup))
    }

    /// As [`Context::render`], with more to say.
    pub fn render_with(
        &self,
        name: &str,
        text: &str,
        setup: Setup,
        change: impl FnOnce(&mut RenderSettings),
    ) -> Result<Rendering, Error> {
        let mut settings = self.settings(setup);
        change(&mut settings);
        render(&self.file(name, text)?, &settings)
    }

    /// An integrator of the program by name, with options; `None` where this build has none of that name.
    pub fn integrator(
        &self,
        name: &str,
        options: &[(&str, &str)],
        max_depth: Option<u32>,
    ) -> Result<Option<Box<dyn Integrator>>, Error> {
        let Ok(mut choice) = IntegratorChoice::named(name) else { return Ok(None) };
        for (key, value) in options {
            choice = choice.with(key, value).map_err(|why| Error::Settings(why.to_string()))?;
        }
        Ok(Some(choice.integrator(max_depth)))
    }

    /// What several rows need, made by the first that asks.
    pub fn once<T: Send + Sync + 'static>(
        &self,
        key: &str,
        make: impl FnOnce() -> Result<T, Error>,
    ) -> Result<Arc<T>, Error> {
        let cell = {
            let mut kept = self.lesson.kept.lock().unwrap_or_else(|e| e.into_inner());
            Arc::clone(kept.entry(key.to_string()).or_default())
        };
        let mut failed = None;
        let any = cell.get_or_init(|| match make() {
            Ok(value) => Arc::new(value),
            Err(error) => {
                failed = Some(error);
                Arc::new(())
            }
        });
        if let Some(error) = failed {
            return Err(error);
        }
        Arc::clone(any).downcast().map_err(|_| Error::Internal(format!("{key} could not be made")))
    }

    /// The results of other rows, which cover this one.
    pub fn inherit(&self, ids: &[&str]) -> Outcome {
        let mut outcome = Outcome {
            verdict: Verdict::Passes,
            measures: vec![],
            pictures: vec![],
            notes: vec![format!("Covered by {}.", ids.join(", "))],
            commands: vec![],
            seconds: 0.0,
        };
        for id in ids {
            let Some(index) = self.lesson.rows.iter().position(|r| r.id == *id) else {
                return Outcome::fails(format!("there is no row {id}"));
            };
            let other = self.lesson.outcome(index);
            match (&other.verdict, &outcome.verdict) {
                (Verdict::Passes, _) | (Verdict::Waits(_), Verdict::Fails(_)) => {}
                (Verdict::Waits(why), _) => outcome.verdict = Verdict::Waits(format!("as {id}: {why}")),
                (Verdict::Fails(why), _) => outcome.verdict = Verdict::Fails(format!("as {id}: {why}")),
            }
            outcome
                .measures
                .extend(other.measures.iter().map(|m| Measure { what: format!("{id}: {}", m.what), ..m.clone() }));
        }
        outcome
    }
}
