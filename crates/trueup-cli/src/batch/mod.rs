//! `trueup batch`: from arguments to a checked job; what became of the sets, told, listed and shown on a page.

mod lines;
mod page;
mod table;

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use trueup::{Batch, BatchJob, Diagnostic, SetRecord, Severity, Shard, StageContext, StitchOptions};

use crate::arguments::BatchArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::output;
use crate::progress;
use crate::words::{one_line, printable};

/// The file of all lines.
const LINES: &str = "batch.jsonl";
/// The table of all panoramas.
const TABLE: &str = "batch.csv";
/// The page of all panoramas.
const PAGE: &str = "index.html";

/// How often the files of all sets are written while sets are worked at: each time every record is read.
const SUM_UP_EVERY: Duration = Duration::from_secs(60);

pub(crate) fn run(args: BatchArgs) -> Result<(), Failure> {
    let options = chosen::options(StitchOptions::default(), &args.tuning, &args.typed)?;
    progress::shown(args.quiet || args.json, |context| {
        let batch = Batch::find(job(&args), context)?;
        warn(&context.findings());
        if args.dry_run {
            return output::print(&lines::plan(&batch, args.json));
        }
        let told_before = context.findings().len();
        let outcome = Run { args: &args, batch: &batch, summed_up: Mutex::default() }.run(&options, context);
        warn(&context.findings()[told_before..]);
        outcome
    })
}

/// What was typed, as the library takes it.
fn job(args: &BatchArgs) -> BatchJob {
    BatchJob {
        extension: args.format.clone(),
        gap_seconds: args.gap,
        shard: args.shard.unwrap_or(Shard::WHOLE),
        retry: args.retry,
        at_once: usize::from(args.jobs),
        threads: chosen::threads(&args.tuning),
        ..BatchJob::new(&args.folder, &args.output)
    }
}

/// Findings before there are photographs name none.
const NAMELESS: &[&str] = &[];

/// Prints warnings, a line each, on standard error.
fn warn(findings: &[Diagnostic]) {
    let warnings = findings.iter().filter(|one| one.severity == Severity::Warning);
    let line = |one: &Diagnostic| {
        let said = format!("{}: {}. {}", one.subject.named(NAMELESS), one.message, one.hint);
        format!("trueup: warning: {}\n", one_line(&said))
    };
    let lines: String = warnings.map(line).collect();
    if !lines.is_empty() {
        trueup_terminal::complain(&printable(&lines));
    }
}

/// A batch that is worked at.
struct Run<'a> {
    args: &'a BatchArgs,
    batch: &'a Batch,
    /// When the files of all sets were written last.
    summed_up: Mutex<Option<Instant>>,
}

impl Run<'_> {
    fn run(&self, options: &StitchOptions, context: &StageContext) -> Result<(), Failure> {
        let outcome = self.batch.run(options, &|record| self.heard(record), context);
        // Also of a batch that was stopped: what is made is to be seen. Why it stopped counts more than a page that failed.
        let summed_up = if self.args.output.is_dir() { self.sum_up_all() } else { Ok(()) };
        outcome?;
        summed_up?;
        self.tell_all()
    }

    /// Says what became of a set, and now and then writes what became of all.
    fn heard(&self, record: &SetRecord) -> Result<(), Failure> {
        match (self.args.json, self.args.quiet) {
            (true, _) => output::print(&lines::json(record))?,
            (false, true) => {}
            (false, false) => output::print(&lines::words(record))?,
        }
        let mut last = self.summed_up.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= SUM_UP_EVERY) {
            self.sum_up(&self.records())?;
            *last = Some(Instant::now());
        }
        Ok(())
    }

    /// Writes the files of all sets until they say what the records do: another run that wrote them meanwhile may have known less.
    fn sum_up_all(&self) -> Result<(), Failure> {
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

    /// Writes the files of all sets, of this shard and of others, as far as they are done.
    fn sum_up(&self, records: &[SetRecord]) -> Result<(), Failure> {
        let lines: String = records.iter().map(lines::json).collect();
        trueup::write_atomically(&self.file(LINES), lines.as_bytes())?;
        trueup::write_atomically(&self.file(TABLE), table::text(records).as_bytes())?;
        trueup::write_atomically(&self.file(PAGE), page::text(records, self.batch.sets().len())?.as_bytes())?;
        Ok(())
    }

    /// Says what became of all sets of this shard.
    ///
    /// # Errors
    /// If some of them made no panorama.
    fn tell_all(&self) -> Result<(), Failure> {
        let records: Vec<SetRecord> = self.batch.planned_records().collect();
        if !self.args.json && !self.args.quiet {
            output::print(&lines::all(&records, &self.file(PAGE)))?;
        }
        match records.iter().filter(|record| record.has_failed()).count() {
            0 => Ok(()),
            count => Err(Failure::unsatisfied(
                format!("{} made no panorama", if count == 1 { "1 set".to_owned() } else { format!("{count} sets") }),
                format!("{} says why.", self.file(LINES).display()),
            )),
        }
    }

    fn records(&self) -> Vec<SetRecord> {
        self.batch.records().collect()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.args.output.join(name)
    }
}
