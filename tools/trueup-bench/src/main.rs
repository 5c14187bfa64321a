//! The `trueup-bench` command: experiments on sets with known cameras, and the table of quality.
#![forbid(unsafe_code)]

mod arguments;
mod experiments;
mod measure;
mod methods;
mod paper;
mod progress;
mod quality;
mod random_directions;
mod report;
mod results;
mod roc;
mod runner;
mod sets;
mod statistics;
mod store;
mod trial;

use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use trueup::{CancelToken, Error};

use arguments::{Arguments, Command};

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Quality(arguments) => quality::run(&arguments),
    };
    match outcome {
        Ok(status) => status,
        Err(error) => {
            trueup_terminal::complain(&format!("trueup-bench: error: {error}\n"));
            match error {
                Error::Cancelled => ExitCode::from(trueup_terminal::status_of_stopping()),
                Error::Options(_) | Error::Unsupported { .. } => ExitCode::from(2),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

/// A token that the first request to stop cancels; the second ends the program.
fn cancel_token() -> Arc<CancelToken> {
    trueup_terminal::cancel_token("trueup-bench", "stopping; what is done is kept", None)
}
