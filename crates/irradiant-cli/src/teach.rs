//! `irradiant teach`: the two lectures as checks, and a page of what they found.

use crate::exit::Exit;
use crate::say::say;
use clap::Args;
use irradiant::Error;
use irradiant_teach::{Budget, Settings, Told, Verdict, faults, page, rows, teach};
use std::path::PathBuf;

/// Check what the two lectures say, claim by claim, and write one HTML page of it
#[derive(Args, Debug)]
pub struct TeachArguments {
    /// Folder for the page (index.html), the pictures and the scenes
    #[arg(short, long, value_name = "DIR", default_value = "teach")]
    output: PathBuf,
    /// Under three minutes on two cores, instead of under forty
    #[arg(long)]
    quick: bool,
    /// Run this row only (A38); may be given several times
    #[arg(long, value_name = "ROW")]
    row: Vec<String>,
    /// Make something wrong on purpose; its row must fail (--list names them)
    #[arg(long, value_name = "NAME")]
    fault: Option<String>,
    /// List rows and faults
    #[arg(long)]
    list: bool,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1, allow_hyphen_values = true, value_parser = crate::options::parse_seed)]
    seed: u64,
    /// Rows at a time [default: one per core]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// Runs the rows, writes the page.
pub fn run(arguments: &TeachArguments) -> Exit {
    if arguments.list {
        for row in rows() {
            println!("{}  {}: {}", row.id, row.name, row.check);
        }
        println!("\nfaults:");
        for fault in faults() {
            println!("{}  {}: {}", fault.row, fault.name, fault.what);
        }
        return Exit::Ok;
    }
    let settings = Settings {
        // One row is quick enough to be run in full only when asked for.
        budget: if arguments.quick { Budget::Quick } else { Budget::Full },
        seed: arguments.seed,
        threads: arguments.threads.unwrap_or(0) as usize,
        only: arguments.row.clone(),
        fault: arguments.fault.clone(),
        folder: Some(arguments.output.clone()),
    };
    let lesson = match teach(&settings, print) {
        Ok(lesson) => lesson,
        Err(error) => return Exit::of(&error),
    };
    if let Err(error) = write(arguments, &lesson) {
        return Exit::of(&error);
    }
    println!("\n{}", lesson.summary());
    say!("wrote {}", arguments.output.join("index.html").display());
    if lesson.failed() { Exit::Failed } else { Exit::Ok }
}

fn print(told: &Told) {
    let (word, why) = match &told.outcome.verdict {
        Verdict::Passes => ("passes", None),
        Verdict::Fails(why) => ("FAILS", Some(why)),
        Verdict::Waits(why) => ("waits", Some(why)),
    };
    println!("{} {word}  {}  ({:.1} s)", told.row.id, told.row.name, told.outcome.seconds);
    if let Some(why) = why {
        println!("    {why}");
    }
    for m in &told.outcome.measures {
        let mark = if m.passes { ' ' } else { '!' };
        println!("  {mark} {}: {}; bound: {}; would see: {}", m.what, m.value, m.bound, m.detectable);
    }
}

fn write(arguments: &TeachArguments, lesson: &irradiant_teach::Lesson) -> Result<(), Error> {
    let save = |path: PathBuf, bytes: &[u8]| {
        irradiant::image::atomic_write(&path, bytes).map_err(|why| Error::Output { path: path.clone(), why })
    };
    let pictures = arguments.output.join("pictures");
    std::fs::create_dir_all(&pictures).map_err(|error| Error::Output {
        path: pictures.clone(),
        why: irradiant::image::ImageError::Io { path: pictures.clone(), error },
    })?;
    for picture in lesson.told.iter().flat_map(|t| &t.outcome.pictures) {
        save(pictures.join(format!("{}.png", picture.name)), &picture.png)?;
    }
    save(arguments.output.join("index.html"), page::page(lesson).as_bytes())
}
