//! The `trueup` command: reads arguments, calls the `trueup` library, prints what it decided and why.
//!
//! No algorithm and no default lives here; [`trueup::StitchOptions`] holds every default.
#![forbid(unsafe_code)]

mod arguments;
mod chosen;
mod compare;
mod compose;
mod evaluate;
mod failure;
mod inspect;
mod option_list;
mod outcome;
mod output;
mod progress;
mod stitch;
mod stopping;
mod summary;
mod words;

use std::process::ExitCode;

use clap::Parser;

use arguments::{CommandLine, Task};

fn main() -> ExitCode {
    let outcome = match CommandLine::parse().task {
        Task::Stitch(args) => stitch::run(*args),
        Task::Compose(args) => compose::run(*args),
        Task::Compare(args) => compare::run(*args),
        Task::Inspect(args) => inspect::run(&args),
        Task::Evaluate(args) => evaluate::run(&args),
        Task::Options(args) => option_list::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            trueup_terminal::complain(&words::printable(&failure.to_string()));
            failure.exit_code()
        }
    }
}
