//! The `trueup-bench` command: experiments on sets with known cameras, the table of quality, and speed beside other
//! stitchers.
#![forbid(unsafe_code)]

mod arguments;
mod build_stamp;
mod child;
mod experiments;
mod figures;
mod measure;
mod methods;
mod paper;
mod progress;
mod published_forms;
mod quality;
mod random_directions;
mod report;
mod results;
mod roc;
mod rows;
mod runner;
mod set_work;
mod sets;
mod speed;
mod statistics;
mod stopping;
mod store;
mod trial;

use std::process::ExitCode;

use clap::Parser;
use trueup::Error;

use arguments::{Arguments, BenchCommand};

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        BenchCommand::Paper(arguments) => paper::run(&arguments),
        BenchCommand::Quality(arguments) => quality::run(&arguments),
        BenchCommand::Speed(arguments) => speed::run(&arguments),
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
