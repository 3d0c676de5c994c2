//! One render under way: workers on threads, progress to poll, a film to take at any time.

mod worker;

use crate::integrator::{Integrator, RenderStats};
use crate::schedule::Schedule;
use irradiant_core::film::{Film, FilmTotals, PixelBounds};
use irradiant_core::scene::Scene;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How to run a render. What determines pixels is in the scene and the integrator; this is about machines and time.
#[derive(Clone, Debug)]
pub struct SessionSettings {
    /// Worker threads; 0: one per core.
    pub threads: usize,
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Stop after this time with what is there; pixels then carry their own counts.
    pub time_limit: Option<Duration>,
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples done, all pixels together.
    pub samples_done: u64,
    /// Samples to do.
    pub samples_total: u64,
    /// Since the start.
    pub elapsed: Duration,
    /// True when no worker is left.
    pub finished: bool,
}

impl Progress {
    /// Done over total, in [0, 1].
    pub fn fraction(&self) -> f64 {
        if self.samples_total == 0 { 1.0 } else { self.samples_done as f64 / self.samples_total as f64 }
    }

    /// Samples per second so far.
    pub fn rate(&self) -> f64 {
        self.samples_done as f64 / self.elapsed.as_secs_f64().max(1e-9)
    }

    /// Time to the end at the rate so far; `None` before the first sample.
    pub fn time_left(&self) -> Option<Duration> {
        let left = self.samples_total.saturating_sub(self.samples_done) as f64;
        (self.samples_done > 0).then(|| Duration::from_secs_f64((left / self.rate()).min(1e9)))
    }
}

struct Shared {
    scene: Arc<Scene>,
    integrator: Box<dyn Integrator>,
    schedule: Schedule,
    next: AtomicUsize,
    cancelled: AtomicBool,
    samples_done: AtomicU64,
    started: Instant,
    deadline: Option<Instant>,
    film: Mutex<Film>,
    stats: Mutex<RenderStats>,
}

/// A render under way. Dropping it cancels.
pub struct Session {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

/// What a finished or cancelled session leaves.
pub struct Finished {
    /// Sums and counts.
    pub film: Film,
    /// What was done.
    pub stats: RenderStats,
    /// A worker panicked: a bug in Irradiant; the film lacks that worker's last unit.
    pub worker_panicked: bool,
}

impl Session {
    /// Starts rendering samples `0..samples_per_pixel` of every pixel of the scene's film.
    pub fn start(scene: Arc<Scene>, integrator: Box<dyn Integrator>, settings: &SessionSettings) -> Self {
        let film = scene.new_film();
        let most = integrator.samples_per_unit();
        let schedule = Schedule::new(film.bounds(), 0, settings.samples_per_pixel, most);
        let started = Instant::now();
        let shared = Arc::new(Shared {
            scene,
            integrator,
            schedule,
            next: AtomicUsize::new(0),
            cancelled: AtomicBool::new(false),
            samples_done: AtomicU64::new(0),
            started,
            deadline: settings.time_limit.and_then(|limit| started.checked_add(limit)),
            film: Mutex::new(film),
            stats: Mutex::new(RenderStats::default()),
        });
        let threads = match settings.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let workers: Vec<_> = (0..threads)
            .filter_map(|i| {
                let shared = Arc::clone(&shared);
                // Where the system refuses a thread those that started do the work.
                std::thread::Builder::new().name(format!("render {i}")).spawn(move || worker::work(&shared)).ok()
            })
            .collect();
        if workers.is_empty() {
            worker::work(&shared);
        }
        Self { shared, workers }
    }

    /// Stops after the units under way. The film keeps what is done.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        Progress {
            samples_done: self.shared.samples_done.load(Ordering::Relaxed),
            samples_total: self.shared.schedule.total_samples(),
            elapsed: self.shared.started.elapsed(),
            finished: self.workers.iter().all(JoinHandle::is_finished),
        }
    }

    /// The film so far; rendering goes on.
    pub fn snapshot(&self) -> Film {
        lock(&self.shared.film).clone()
    }

    /// Totals of the film so far, without copying it.
    pub fn totals(&self) -> FilmTotals {
        lock(&self.shared.film).totals()
    }

    /// Waits for the end and takes the film.
    pub fn wait(mut self) -> Finished {
        let mut worker_panicked = false;
        for worker in self.workers.drain(..) {
            worker_panicked |= worker.join().is_err();
        }
        // Taken, not copied: films are big.
        let nothing = Film::new([0, 0], PixelBounds { x0: 0, y0: 0, x1: 0, y1: 0 }, Vec::new());
        let film = std::mem::replace(&mut *lock(&self.shared.film), nothing);
        let stats = lock(&self.shared.stats).clone();
        Finished { film, stats, worker_panicked }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.cancel();
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

/// A poisoned lock still holds sums of whole units: a worker merges only finished ones.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
