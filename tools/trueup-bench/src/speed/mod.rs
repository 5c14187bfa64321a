//! `trueup-bench speed`: how long a stitch takes, beside other stitchers on the same photographs.

mod programs;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use trueup::{CancelToken, Result, StageContext, check_place, write_atomically};

use crate::arguments::SpeedArguments;
use crate::child::{ScratchFolder, find_trueup};
use crate::progress::Tracker;
use crate::sets::{name_of, photographs_in};
use crate::stopping;
use programs::{Program, Taken};

/// A folder of photographs.
#[derive(Debug)]
struct SpeedSet {
    name: String,
    photographs: Vec<PathBuf>,
    megapixels: f64,
}

/// What the programs took for a set: of each program its runs, in the order of the programs.
#[derive(Debug)]
struct MeasuredSet {
    set: SpeedSet,
    runs: Vec<Vec<Taken>>,
}

/// Times all programs on all sets, and writes the table.
///
/// # Errors
/// Those of finding the photographs and trueup; of starting a program; of writing the table. A set that a program
/// cannot stitch is a cell of the table.
pub(crate) fn run(arguments: &SpeedArguments) -> Result<ExitCode> {
    let cancel = stopping::cancel_token();
    let trueup = find_trueup(arguments.trueup.as_deref())?;
    arguments.out.as_deref().map_or(Ok(()), check_place)?;
    let sets = arguments.folders.iter().map(|folder| speed_set(folder)).collect::<Result<Vec<_>>>()?;
    let scratch = ScratchFolder::new()?;
    let mut programs = vec![Program::Trueup(trueup)];
    if arguments.peers {
        for peer in [Program::OpenCv(arguments.python.clone()), Program::Hugin] {
            match peer.is_installed(scratch.path(), &cancel) {
                true => programs.push(peer),
                false => trueup_terminal::complain(&format!("trueup-bench: {} is not installed\n", peer.name())),
            }
        }
    }
    let tracker = Tracker::new("sets", sets.len() as u64, arguments.quiet);
    let mut measured = Vec::new();
    for set in sets {
        tracker.working_on(&set.name);
        let runs = timed(&set, &programs, arguments.runs, scratch.path(), &cancel)?;
        tracker.advance(1);
        tracker.finished(&set.name);
        measured.push(MeasuredSet { set, runs });
    }
    tracker.close();
    let table = table::table(&programs, &measured);
    match &arguments.out {
        Some(path) => write_atomically(path, table.as_bytes())?,
        None => print!("{table}"),
    }
    Ok(ExitCode::SUCCESS)
}

fn speed_set(folder: &Path) -> Result<SpeedSet> {
    let images = photographs_in(folder, &StageContext::default())?;
    let pixels: f64 = images.iter().map(|image| image.width as f64 * image.height as f64).sum();
    Ok(SpeedSet {
        name: name_of(folder),
        megapixels: pixels / images.len() as f64 / 1e6,
        photographs: images.into_iter().map(|image| image.path).collect(),
    })
}

/// The runs of every program, in turn, so that a machine that grows slower is slower for all.
fn timed(
    set: &SpeedSet,
    programs: &[Program],
    runs: u32,
    scratch: &Path,
    cancel: &CancelToken,
) -> Result<Vec<Vec<Taken>>> {
    let mut taken = vec![Vec::new(); programs.len()];
    for _ in 0..runs {
        for (program, taken) in programs.iter().zip(&mut taken) {
            taken.push(program.stitch(&set.photographs, scratch, cancel)?);
        }
    }
    Ok(taken)
}
