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
mod output;
mod progress;
mod stitch;
mod summary;
mod words;

use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;

use trueup::{CancelToken, Error};

use arguments::{Command, LowArgs};
use failure::Failure;

fn main() -> ExitCode {
    let outcome = match LowArgs::parse().command {
        Command::Stitch(args) => stitch::run(*args),
        Command::Compose(args) => compose::run(*args),
        Command::Compare(args) => compare::run(*args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Options(args) => option_list::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            trueup_terminal::complain(&failure.to_string());
            failure.exit_code()
        }
    }
}

/// A token that the first request to stop cancels; work that does not stop within a second is left, with nothing half
/// written. The second Ctrl-C ends the program.
fn cancel_token() -> Arc<CancelToken> {
    let last_resort = || {
        trueup::abandon_unfinished();
        trueup_terminal::complain(&Failure::from(Error::Cancelled).to_string());
    };
    trueup_terminal::cancel_token("trueup", "", Some(last_resort))
}
