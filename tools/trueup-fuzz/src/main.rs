//! The `trueup-fuzz` command: malformed inputs for everything that trueup reads, for a given time a target.
#![forbid(unsafe_code)]

mod mutation;
mod run;

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;

use run::{Findings, Length, fuzz};
use trueup_fuzz::{TARGETS, Target};

/// Changes valid inputs at random and reads them. What panics is kept as a file and ends the command with status 1.
///
/// Mutations are drawn from a seeded generator: the same seed, target and number of executions try the same inputs.
/// What aborts the program at once, as a stack that overflows, leaves its input in the work folder.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// The targets; all without any
    #[arg(value_name = "TARGET")]
    targets: Vec<String>,

    /// Seconds for each target
    #[arg(long, value_name = "N", default_value_t = 20)]
    seconds: u64,

    /// Executions of each target at most
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    executions: u64,

    /// The mutations derive from this number
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Files in DIR/TARGET are inputs to start from, too
    #[arg(long, value_name = "DIR")]
    corpus: Option<PathBuf>,

    /// Print the names of all targets, and do nothing else
    #[arg(long)]
    list: bool,

    /// Write the targets' valid inputs to DIR/TARGET, and do nothing else
    #[arg(long, value_name = "DIR")]
    write_seeds: Option<PathBuf>,

    /// Where inputs that panic are kept
    #[arg(long, value_name = "DIR", default_value = "target/fuzz")]
    findings: PathBuf,
}

/// Writes the valid inputs of a target, each to a file of its own.
fn write_seeds(target: &Target, folder: &Path) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (number, seed) in (target.seeds)().iter().enumerate() {
        std::fs::write(folder.join(format!("seed-{number}")), seed)?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let known = |name: &String| TARGETS.iter().any(|target| target.name == name);
    if let Some(unknown) = arguments.targets.iter().find(|name| !known(name)) {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("trueup-fuzz: error: there is no target {unknown}; there are {}", names.join(", "));
        return ExitCode::from(2);
    }
    let wanted = TARGETS
        .iter()
        .filter(|target| arguments.targets.is_empty() || arguments.targets.iter().any(|name| name == target.name));
    if arguments.list {
        wanted.for_each(|target| println!("{}", target.name));
        return ExitCode::SUCCESS;
    }
    let mut found = 0;
    for target in wanted {
        if let Some(folder) = &arguments.write_seeds {
            if let Err(error) = write_seeds(target, &folder.join(target.name)) {
                eprintln!("trueup-fuzz: error: {}: {error}", folder.display());
                return ExitCode::FAILURE;
            }
            continue;
        }
        let length = Length { time: Duration::from_secs(arguments.seconds), executions: arguments.executions };
        let corpus = arguments.corpus.as_ref().map(|folder| folder.join(target.name));
        match fuzz(target, arguments.seed, length, corpus.as_deref(), &arguments.findings) {
            Ok(Findings { executions, panics, slowest }) => {
                println!("{:18} {executions:>9} executions, {panics} findings, slowest {slowest:.1?}", target.name);
                found += panics;
            }
            Err(error) => {
                eprintln!("trueup-fuzz: error: {}: {error}", target.name);
                return ExitCode::FAILURE;
            }
        }
    }
    if found == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
