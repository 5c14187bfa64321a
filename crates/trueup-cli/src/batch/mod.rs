//! `trueup batch`: from arguments to a checked job; what became of the sets, told, listed and shown on a page.

mod files;
mod lines;
mod page;
mod table;

use trueup::{Batch, BatchJob, Diagnostic, SetRecord, Severity, Shard, StitchOptions};

use crate::arguments::BatchArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::output;
use crate::progress;
use crate::words::{one_line, printable};

pub use files::run_batch;

/// The lines of JSON of what became of a set, as `trueup batch --json` prints them: one for every panorama, or one that
/// says why there is none.
pub fn batch_lines(record: &SetRecord) -> String {
    lines::json(record)
}

/// The lines of JSON of the sets that are to be stitched, as `trueup batch --dry-run --json` prints them.
pub fn batch_plan(batch: &Batch) -> String {
    lines::plan(batch, true)
}

pub(crate) fn run(args: BatchArgs) -> Result<(), Failure> {
    let options = chosen::options(StitchOptions::default(), &args.tuning, &args.typed)?;
    progress::shown(args.quiet || args.json, |context| {
        let found = Batch::find(job(&args), context);
        // What was passed over may be why there is nothing.
        warn(&context.findings());
        let batch = found?;
        if args.dry_run {
            return output::print(&lines::plan(&batch, args.json));
        }
        let told_before = context.findings().len();
        let outcome = run_batch(&batch, &args.output, &options, &|record| tell(record, &args), context);
        warn(&context.findings()[told_before..]);
        outcome.and_then(|()| tell_all(&batch, &args))
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

/// Says what became of a set.
fn tell(record: &SetRecord, args: &BatchArgs) -> Result<(), Failure> {
    match (args.json, args.quiet) {
        (true, _) => output::print(&lines::json(record)),
        (false, true) => Ok(()),
        (false, false) => output::print(&lines::words(record)),
    }
}

/// Says what became of all sets of this shard.
///
/// # Errors
/// If some of them made no panorama.
fn tell_all(batch: &Batch, args: &BatchArgs) -> Result<(), Failure> {
    let records: Vec<SetRecord> = batch.planned_records().collect();
    if !args.json && !args.quiet {
        output::print(&lines::all(&records, &args.output.join(files::PAGE)))?;
    }
    match records.iter().filter(|record| record.has_failed()).count() {
        0 => Ok(()),
        count => Err(Failure::unsatisfied(
            format!("{} made no panorama", if count == 1 { "1 set".to_owned() } else { format!("{count} sets") }),
            format!("{} says why.", args.output.join(files::LINES).display()),
        )),
    }
}
