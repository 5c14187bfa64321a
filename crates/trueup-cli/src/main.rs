//! The `trueup` command: reads arguments, calls the `trueup` library, prints what it decided and why.
//!
//! No algorithm and no default lives here; [`trueup::StitchOptions`] holds every default.
#![forbid(unsafe_code)]

mod arguments;
mod evaluate;
mod failure;
mod inspect;
mod interrupt;
mod option_list;
mod output;
mod progress;
mod stitch;
mod summary;
mod words;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Command, LowArgs};

fn main() -> ExitCode {
    let outcome = match LowArgs::parse().command {
        Command::Stitch(args) => stitch::run(*args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Options(args) => option_list::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprint!("{failure}");
            failure.exit_code()
        }
    }
}
