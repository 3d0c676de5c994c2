//! The program `irradiant`. Each subcommand is a file; this one only routes.
#![forbid(unsafe_code)]

mod check;
mod compare;
mod exit;
mod image;
mod integrators;
mod interrupts;
mod options;
mod probe;
mod progress;
mod render;
mod say;
mod stats;
mod teach;

use clap::{Parser, Subcommand};
use exit::Exit;
use say::say;
use std::process::ExitCode;

/// Physically based path tracing: right, and provably so.
///
/// `irradiant render` without a scene renders the built-in Cornell box to cornell-box.exr and cornell-box.png.
#[derive(Parser)]
#[command(name = "irradiant", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(render::RenderArguments),
    Check(check::CheckArguments),
    Compare(compare::CompareArguments),
    Probe(probe::ProbeArguments),
    Image(image::ImageArguments),
    Integrators(integrators::IntegratorsArguments),
    Teach(teach::TeachArguments),
}

fn main() -> ExitCode {
    // Every bug that panics is reported as one, with its own exit code.
    let default_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        // But not that standard output cannot be written: whoever read it has left (`| head`), or a disk is full.
        if let Some(why) = info.payload().downcast_ref::<String>()
            && why.starts_with("failed printing to stdout")
        {
            if !why.contains("Broken pipe") {
                say!("irradiant: {why}");
            }
            std::process::exit(Exit::Output as i32);
        }
        default_hook(info);
        say!("irradiant: this is a bug; please report it with the scene and the command");
    }));
    let arguments = Arguments::try_parse().unwrap_or_else(|error| {
        let _ = error.print();
        if error.kind() == clap::error::ErrorKind::UnknownArgument {
            render::say_audit_hint();
        }
        std::process::exit(error.exit_code());
    });
    let run = || match arguments.command {
        Command::Render(a) if a.picture.asks_for_integrators() => integrators::list(),
        Command::Probe(a) if a.picture.asks_for_integrators() => integrators::list(),
        Command::Render(a) => render::run(&a),
        Command::Check(a) => check::run(&a),
        Command::Compare(a) => compare::run(&a),
        Command::Probe(a) => probe::run(&a),
        Command::Image(a) => image::run(&a),
        Command::Integrators(a) => integrators::run(&a),
        Command::Teach(a) => teach::run(&a),
    };
    let exit = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or(Exit::Bug);
    ExitCode::from(exit as u8)
}
