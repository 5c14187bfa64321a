//! A batch that is worked at, and the files of all its sets: lines, a table, a page.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use trueup::{Batch, Error, SetRecord, StageContext, StitchOptions};

use super::{lines, page, table};

/// The file of all lines.
pub(super) const LINES: &str = Batch::LINES;
/// The table of all panoramas.
const TABLE: &str = Batch::TABLE;
/// The page of all panoramas.
pub(super) const PAGE: &str = Batch::PAGE;

/// How often the files of all sets are written while sets are worked at: each time every record is read.
const SUM_UP_EVERY: Duration = Duration::from_secs(60);

/// Works at a batch as `trueup batch` does: `tell` hears of each set when it is done, and now and then and at the end,
/// also of a batch that is stopped, the files of all sets are written into the folder `output` of the batch.
///
/// # Errors
/// Those of [`Batch::run`] and of writing these files; what `tell` returns; [`Error::Input`] where one of these files
/// is there that no batch has written.
pub fn run_batch<E: From<Error> + Send>(
    batch: &Batch,
    output: &Path,
    options: &StitchOptions,
    tell: &(dyn Fn(&SetRecord) -> Result<(), E> + Sync),
    context: &StageContext,
) -> Result<(), E> {
    refuse_over_others(output)?;
    let files = Files { batch, output, summed_up: Mutex::default() };
    let heard = |record: &SetRecord| -> Result<(), E> {
        tell(record)?;
        Ok(files.sum_up_now_and_then()?)
    };
    let outcome = batch.run(options, &heard, context);
    // Also of a batch that was stopped: what is made is to be seen. Why it stopped counts more than a page that failed.
    let summed_up = if output.is_dir() { files.sum_up_all() } else { Ok(()) };
    outcome?;
    Ok(summed_up?)
}

/// Refuses files that are called as those of all sets and that no batch has written, before work starts.
fn refuse_over_others(output: &Path) -> Result<(), Error> {
    Batch::refuse_over(&output.join(LINES), lines::is_own)?;
    Batch::refuse_over(&output.join(TABLE), table::is_own)?;
    Batch::refuse_over(&output.join(PAGE), page::is_own)
}

/// The files of all sets.
struct Files<'a> {
    batch: &'a Batch,
    /// Where they lie.
    output: &'a Path,
    /// When they were written last.
    summed_up: Mutex<Option<Instant>>,
}

impl Files<'_> {
    /// Writes them if they have not been for a while.
    fn sum_up_now_and_then(&self) -> Result<(), Error> {
        let mut last = self.summed_up.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= SUM_UP_EVERY) {
            self.sum_up(&self.records())?;
            *last = Some(Instant::now());
        }
        Ok(())
    }

    /// Writes them until they say what the records do: another run that wrote them meanwhile may have known less.
    fn sum_up_all(&self) -> Result<(), Error> {
        for file in [LINES, TABLE, PAGE].map(|name| self.file(name)) {
            trueup::check_place(&file)?;
        }
        loop {
            let records = self.records();
            self.sum_up(&records)?;
            if self.records() == records {
                return Ok(());
            }
        }
    }

    /// Writes them, of this shard and of others, as far as they are done.
    fn sum_up(&self, records: &[SetRecord]) -> Result<(), Error> {
        let lines: String = records.iter().map(lines::json).collect();
        trueup::write_atomically(&self.file(LINES), lines.as_bytes())?;
        trueup::write_atomically(&self.file(TABLE), table::text(records).as_bytes())?;
        trueup::write_atomically(&self.file(PAGE), page::text(records, self.batch.sets().len())?.as_bytes())
    }

    fn records(&self) -> Vec<SetRecord> {
        self.batch.records().collect()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.output.join(name)
    }
}
