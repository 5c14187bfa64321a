//! The `trueup` command.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use trueup_terminal::NotingAllocator;

#[global_allocator]
static ALLOCATOR: NotingAllocator = NotingAllocator;

fn main() -> ExitCode {
    trueup_cli::end_without_memory();
    ExitCode::from(trueup_cli::run(std::env::args_os()))
}
