//! Trees of folders, stitched set by set.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueup::{Batch, BatchJob, Error, Shard, StitchOptions};
use trueup_cli::{batch_lines, batch_plan, run_batch};

use crate::errors::exception;
use crate::keywords::Wishes;
use crate::work::{Surroundings, run, run_telling};

/// What is wished of a batch; what is `None` is as usual.
#[derive(Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BatchWishes {
    folder: PathBuf,
    output: PathBuf,
    format: Option<String>,
    gap: Option<f64>,
    shard: Option<(usize, usize)>,
    retry: bool,
    jobs: usize,
}

impl BatchWishes {
    fn job(self, threads: usize) -> Result<BatchJob, Error> {
        let usual = BatchJob::new(self.folder, self.output);
        let shard = match self.shard {
            None => Shard::WHOLE,
            Some((number, count)) if (1..=count).contains(&number) => Shard { number, count },
            Some((number, count)) => {
                let hint = "Give the part's number, counted from 1, and how many there are.";
                return Err(Error::input("shard", format!("there is no part {number} of {count}"), hint));
            }
        };
        if self.gap.is_some_and(|gap| gap.is_nan() || gap < 0.0) {
            return Err(Error::input("gap", "it is no time", "Give a number of seconds, 0 or more."));
        }
        if self.jobs == 0 {
            return Err(Error::input("jobs", "there must be one", "Give 1 or more."));
        }
        Ok(BatchJob {
            extension: self.format.unwrap_or(usual.extension),
            gap_seconds: self.gap.unwrap_or(usual.gap_seconds),
            folder: usual.folder,
            output: usual.output,
            shard,
            retry: self.retry,
            at_once: self.jobs,
            threads,
        })
    }
}

/// The sets of a batch that would be stitched, in lines of JSON.
#[pyfunction]
pub(crate) fn plan(py: Python<'_>, wishes: BatchWishes) -> PyResult<String> {
    let job = wishes.job(0).map_err(|error| exception(py, error))?;
    run(py, Surroundings { progress: None, threads: 1 }, |context| Ok(batch_plan(&Batch::find(job, context)?)))
}

/// Stitches the sets of a batch; returns what became of all, in lines of JSON. `told` is called with the lines of each
/// set when it is done.
#[pyfunction]
pub(crate) fn batch<'py>(
    py: Python<'py>,
    wishes: BatchWishes,
    keywords: &Bound<'py, PyDict>,
    told: Option<Bound<'py, PyAny>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<String> {
    let Wishes { options, threads, .. } = Wishes::of(keywords, "batch", StitchOptions::default())?;
    let job = wishes.job(threads).map_err(|error| exception(py, error))?;
    // Each set is worked at on threads of its own.
    run_telling(py, Surroundings { progress, threads: 1 }, told, |context, tell| {
        let output = job.output.clone();
        let batch = Batch::find(job, context)?;
        let heard = |record: &trueup::SetRecord| {
            tell(batch_lines(record));
            Ok(())
        };
        run_batch::<Error>(&batch, &output, &options, &heard, context)?;
        Ok(batch.planned_records().map(|record| batch_lines(&record)).collect())
    })
}
