//! The `trueup` command: reads arguments, calls the `trueup` library, prints what it decided and why.
//!
//! No algorithm and no default lives here; [`trueup::StitchOptions`] holds every default. The command is a library too,
//! so that other fronts can run it as it is ([`run`]) and say the same in the same words: [`summary_text`],
//! [`batch_lines`], [`OPTION_FLAGS`].
#![forbid(unsafe_code)]

mod arguments;
mod batch;
mod chosen;
mod compare;
mod compose;
mod evaluate;
mod failure;
mod inspect;
mod installing;
mod option_list;
mod outcome;
mod output;
mod progress;
mod report;
mod serve;
mod stitch;
mod stopping;
mod summary;
mod words;

use std::ffi::OsString;

use clap::Parser;
use trueup::Project;

use arguments::{CommandLine, Task};

pub use arguments::{OPTION_FLAGS, OptionFlag};
pub use batch::{batch_lines, batch_plan, run_batch};
pub use stopping::end_without_memory;

/// Runs the command with these arguments, of which the first is its own name, and returns its exit status. To be called
/// once in a program: it catches Ctrl-C.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let task = match CommandLine::try_parse_from(arguments) {
        Ok(command_line) => command_line.task,
        Err(error) => {
            // Help that nobody reads is no failure.
            drop(error.print());
            return u8::try_from(error.exit_code()).unwrap_or(u8::MAX);
        }
    };
    let outcome = match task {
        Task::Stitch(args) => stitch::run(*args),
        Task::Compose(args) => compose::run(*args),
        Task::Compare(args) => compare::run(*args),
        Task::Inspect(args) => inspect::run(&args),
        Task::Evaluate(args) => evaluate::run(&args),
        Task::Batch(args) => batch::run(*args),
        Task::Report(args) => report::run(&args),
        Task::Serve(args) => serve::run(args),
        Task::Options(args) => option_list::run(&args),
        Task::Completions(args) => installing::completions(&args),
        Task::Manual(args) => installing::manual(&args),
    };
    match outcome {
        Ok(()) => 0,
        Err(failure) => {
            trueup_terminal::complain(&words::printable(&failure.to_string()));
            failure.status()
        }
    }
}

/// What was made of which photographs, and why, as `trueup inspect` prints it; `verbose` adds every pair, photograph,
/// note and stage.
pub fn summary_text(project: &Project, verbose: bool) -> String {
    summary::text(project, None, verbose)
}
