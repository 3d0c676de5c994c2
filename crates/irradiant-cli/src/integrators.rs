//! `irradiant integrators`: what `--integrator` and `--estimator` can be.

use crate::exit::Exit;
use clap::Args;
use irradiant::IntegratorChoice;
use irradiant::renderer::registry::{INTEGRATORS, IntegratorEntry};

/// List the integrators with their options, or describe one
#[derive(Args, Debug)]
pub struct IntegratorsArguments {
    /// Describe this one only
    name: Option<String>,
    /// As the guide has it, in Markdown
    #[arg(long)]
    markdown: bool,
}

/// Prints the list, or one.
pub fn run(arguments: &IntegratorsArguments) -> Exit {
    let entries = match arguments.name.as_deref().map(IntegratorChoice::named) {
        None => INTEGRATORS,
        Some(Ok(choice)) => std::slice::from_ref(choice.entry()),
        Some(Err(why)) => return Exit::of(&why.into()),
    };
    if arguments.markdown {
        let sections: String = entries.iter().map(IntegratorEntry::markdown).collect();
        println!("{}", sections.trim_end());
    } else {
        print(entries);
    }
    Exit::Ok
}

/// All of them.
pub fn list() -> Exit {
    print(INTEGRATORS);
    Exit::Ok
}

fn print(entries: &[IntegratorEntry]) {
    let texts: Vec<String> = entries.iter().map(IntegratorEntry::describe).collect();
    println!("{}", texts.join("\n").trim_end());
}
