//! Running rows: two at a time, told in the lectures' order.

use crate::context::{Budget, Lesson as Shared};
use crate::row::{Fault, Outcome, Row, Verdict};
use crate::rows;
use crate::walk::Wrong;
use irradiant::Error;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// What to run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How much to spend.
    pub budget: Budget,
    /// Of the random numbers.
    pub seed: u64,
    /// Rows at a time; 0: one per core.
    pub threads: usize,
    /// Rows to run; none: all.
    pub only: Vec<String>,
    /// The fault to suffer, by name.
    pub fault: Option<String>,
    /// Where scenes and pictures are left; none: nowhere.
    pub folder: Option<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { budget: Budget::Quick, seed: 1, threads: 0, only: vec![], fault: None, folder: None }
    }
}

/// A row and what it found.
#[derive(Clone)]
pub struct Told {
    /// The claim.
    pub row: Row,
    /// The finding.
    pub outcome: Outcome,
}

/// All that was run.
pub struct Lesson {
    /// In the lectures' order.
    pub told: Vec<Told>,
    /// How much was spent.
    pub budget: Budget,
    /// Of the random numbers.
    pub seed: u64,
    /// The fault that was suffered.
    pub fault: Option<Fault>,
    /// Wall seconds.
    pub seconds: f64,
}

impl Lesson {
    /// How many rows pass.
    pub fn passed(&self) -> usize {
        self.told.iter().filter(|t| t.outcome.verdict == Verdict::Passes).count()
    }

    /// The closing words: how many pass, and which do not and why.
    pub fn summary(&self) -> String {
        let mut text = format!("{} of {} rows pass", self.passed(), self.told.len());
        for told in &self.told {
            match &told.outcome.verdict {
                Verdict::Passes => {}
                Verdict::Fails(why) if told.outcome.is_only_slow() => text += &format!("\n  {}: {why}", told.row.id),
                Verdict::Fails(why) => text += &format!("\n  {} fails: {why}", told.row.id),
                Verdict::Waits(why) => text += &format!("\n  {} waits: {why}", told.row.id),
            }
        }
        text
    }

    /// True when a row that could be measured failed.
    pub fn failed(&self) -> bool {
        self.told.iter().any(|t| matches!(t.outcome.verdict, Verdict::Fails(_)))
    }
}

/// Rows that measure time; they run when nothing else does.
const ALONE: [&str; 1] = ["A70"];

/// A row that runs longer than this says on stderr what it is at, again and again.
const PATIENCE: Duration = Duration::from_secs(10);

/// Runs rows; `listen` hears of each in the lectures' order, as soon as it and all before it are done.
pub fn teach(settings: &Settings, listen: impl Fn(&Told) + Sync) -> Result<Lesson, Error> {
    let started = Instant::now();
    let all = rows();
    for id in &settings.only {
        if !all.iter().any(|r| r.id.eq_ignore_ascii_case(id)) {
            return Err(Error::Settings(format!(
                "there is no row {id}; the rows are A01 to A73 and B01 to B47 (--list)"
            )));
        }
    }
    let fault = match &settings.fault {
        None => None,
        Some(name) => {
            let found = rows::FAULTS.iter().find(|(f, _)| f.name == *name);
            let names = || rows::FAULTS.iter().map(|(f, _)| f.name).collect::<Vec<_>>().join(", ");
            Some(*found.ok_or_else(|| Error::Settings(format!("there is no fault {name}; known are {}", names())))?)
        }
    };
    let chosen = |row: &Row| match (&settings.only[..], &fault) {
        ([], Some((fault, _))) => row.id == fault.row,
        ([], None) => true,
        (only, _) => only.iter().any(|id| row.id.eq_ignore_ascii_case(id)),
    };
    let order: Vec<usize> = (0..all.len()).filter(|&i| chosen(&all[i])).collect();
    let (last, first): (Vec<usize>, Vec<usize>) = order.iter().partition(|&&i| ALONE.contains(&all[i].id));
    let shared = Shared::new(all, settings.budget, settings.seed, settings.folder.clone(), fault);
    let threads = match settings.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let told = std::sync::Mutex::new(0);
    let tell = || {
        let mut told = told.lock().unwrap_or_else(|e| e.into_inner());
        while let Some(&i) = order.get(*told)
            && let Some(outcome) = shared.outcomes[i].get()
        {
            listen(&Told { row: shared.rows[i], outcome: outcome.clone() });
            *told += 1;
        }
    };
    std::thread::scope(|scope| {
        let (done, waiting) = channel::<()>();
        let shared = &shared;
        scope.spawn(move || {
            while waiting.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                shared.news(PATIENCE).iter().for_each(|line| eprintln!("{line}"));
            }
        });
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    while let Some(&i) = first.get(next.fetch_add(1, Ordering::Relaxed)) {
                        shared.outcome(i);
                        tell();
                    }
                });
            }
        });
        for &i in &last {
            shared.outcome(i);
        }
        drop(done);
    });
    tell();
    let told = order.iter().map(|&i| Told { row: shared.rows[i], outcome: shared.outcome(i).clone() }).collect();
    Ok(Lesson {
        told,
        budget: settings.budget,
        seed: settings.seed,
        fault: fault.map(|(fault, _): (Fault, Wrong)| fault),
        seconds: started.elapsed().as_secs_f64(),
    })
}
