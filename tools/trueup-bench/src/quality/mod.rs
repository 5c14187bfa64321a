//! `trueup-bench quality`: every set stitched by the `trueup` command, one committed table.

mod discover;
mod measured;
mod page;
mod row;
mod tables;

use std::path::Path;
use std::process::ExitCode;

use trueup::{CancelToken, Error, Result, check_place};

use crate::arguments::QualityArguments;
use crate::child::{self, ScratchFolder};
use crate::progress::Tracker;
use crate::stopping;
use discover::{StitchSet, find_sets};
use measured::{MeasuredStitch, measure};
use row::{QualityRow, read_rows, write_rows};

/// Stitches the sets, then writes the table and its CSV file, whose places are checked before.
///
/// # Errors
/// Those of finding the sets and the command, of writing; [`Error::Cancelled`]. A set that cannot be stitched is a row.
pub(crate) fn run(arguments: &QualityArguments) -> Result<ExitCode> {
    let cancel = stopping::cancel_token();
    let command = child::find_trueup(arguments.trueup.as_deref())?;
    let csv_path = arguments.out.with_extension("csv");
    page::check(&arguments.out)?;
    check_place(&csv_path)?;
    let sets = find_sets(&arguments.truth_sets, &arguments.real, arguments.manifest.as_deref())?;
    let previous = match &arguments.previous {
        Some(path) => read_rows(path)?,
        None if csv_path.exists() => read_rows(&csv_path)?,
        None => Vec::new(),
    };
    let scratch = ScratchFolder::new()?;
    let measured = measure_all(&sets, &command, scratch.path(), &cancel, arguments.quiet)?;
    // Only now: what this process held while a child was started would count as the child's memory.
    let rows = sets
        .iter()
        .zip(&measured)
        .map(|(set, measured)| QualityRow::new(set, measured))
        .collect::<Result<Vec<QualityRow>>>()?;
    page::write(&arguments.out, &rows, &previous)?;
    write_rows(&csv_path, &kept(&rows, &previous))?;
    let stitched = rows.iter().filter(|row| row.used > 0).count();
    println!("quality: {stitched} of {} sets stitched; {}", rows.len(), arguments.out.display());
    Ok(ExitCode::SUCCESS)
}

/// This run's rows, and of the previous ones those of parts that were not run.
fn kept(rows: &[QualityRow], previous: &[QualityRow]) -> Vec<QualityRow> {
    let skipped = |row: &&QualityRow| !rows.iter().any(|new| new.part == row.part);
    rows.iter().chain(previous.iter().filter(skipped)).cloned().collect()
}

fn measure_all(
    sets: &[StitchSet],
    command: &Path,
    scratch: &Path,
    cancel: &CancelToken,
    quiet: bool,
) -> Result<Vec<MeasuredStitch>> {
    let tracker = Tracker::new("sets", sets.len() as u64, quiet);
    let mut measured = Vec::new();
    for (index, set) in sets.iter().enumerate() {
        if cancel.is_cancelled() {
            return Err(Error::Cancelled);
        }
        tracker.working_on(&set.title());
        measured.push(measure(command, set, scratch, index, cancel)?);
        tracker.advance(1);
        tracker.finished(&set.title());
    }
    tracker.close();
    Ok(measured)
}

#[cfg(test)]
mod tests {
    use super::discover::Part;
    use super::*;

    #[test]
    fn parts_that_were_not_run_keep_their_figures() {
        let row =
            |part, set: &str, seconds| QualityRow { seconds: Some(seconds), ..QualityRow::empty(part, set, "row") };
        let new = [row(Part::Known, "a", 1.0)];
        let old = [row(Part::Known, "gone", 9.0), row(Part::Photographs, "b", 2.0)];
        let kept: Vec<String> = kept(&new, &old).into_iter().map(|row| row.set).collect();
        assert_eq!(kept, ["a", "b"]);
    }
}
