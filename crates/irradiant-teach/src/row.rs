//! The words of a lesson: rows, what they measured, what came of it.

use crate::context::Context;
use irradiant::Error;

/// One claim of the lectures and the measurement that shows it.
#[derive(Clone, Copy)]
pub struct Row {
    /// `A01`..`A73`, `B01`..`B47`: the ledger's name, in the lectures' order.
    pub id: &'static str,
    /// What the lecture calls it.
    pub name: &'static str,
    /// What the lecture says, in our words.
    pub says: &'static str,
    /// What is measured.
    pub check: &'static str,
    /// The measurement.
    pub run: fn(&Context) -> Result<Outcome, Error>,
}

/// Something made wrong on purpose, so that a row must fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// As the command line names it.
    pub name: &'static str,
    /// The row that must notice.
    pub row: &'static str,
    /// What is wrong.
    pub what: &'static str,
}

/// How a row ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Every measure is within its bound.
    Passes,
    /// At least one is not, or the row could not run.
    Fails(String),
    /// What it needs is not built yet.
    Waits(String),
}

/// One measured quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// What was measured.
    pub what: String,
    /// What came out.
    pub value: String,
    /// What was allowed.
    pub bound: String,
    /// The error that would have been seen.
    pub detectable: String,
    /// Within the bound, and the bound was sharp enough.
    pub passes: bool,
    /// A goal for this machine's speed: where it is not met, nothing is wrong with the physics.
    pub of_speed: bool,
}

/// A picture of a row: PNG bytes.
#[derive(Clone, Debug)]
pub struct Picture {
    /// File name without folder or extension, unique in a lesson.
    pub name: String,
    /// What one sees.
    pub caption: String,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// The file.
    pub png: Vec<u8>,
}

/// What a row found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// In short.
    pub verdict: Verdict,
    /// In numbers.
    pub measures: Vec<Measure>,
    /// In pictures, in reading order.
    pub pictures: Vec<Picture>,
    /// Remarks for the reader, one paragraph each.
    pub notes: Vec<String>,
    /// What makes the pictures or numbers with the program alone.
    pub commands: Vec<String>,
    /// Wall seconds; of inherited results 0.
    pub seconds: f64,
}

impl Outcome {
    /// Whether goals of speed are all that was not met.
    pub fn is_only_slow(&self) -> bool {
        let mut out = self.measures.iter().filter(|m| !m.passes).peekable();
        matches!(self.verdict, Verdict::Fails(_)) && out.peek().is_some() && out.all(|m| m.of_speed)
    }

    /// Not measured, because something is missing.
    pub fn waits(why: impl Into<String>) -> Self {
        Self::ended(Verdict::Waits(why.into()))
    }

    /// Could not be measured.
    pub fn fails(why: impl Into<String>) -> Self {
        Self::ended(Verdict::Fails(why.into()))
    }

    fn ended(verdict: Verdict) -> Self {
        Self { verdict, measures: vec![], pictures: vec![], notes: vec![], commands: vec![], seconds: 0.0 }
    }
}
