//! The `trueup` command.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(trueup_cli::run(std::env::args_os()))
}
