//! The work at one set: whether it is to be done, by whom, and what becomes of it.

use std::any::Any;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::{Value, json};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode;

use super::claim::Claim;
use super::record::{SetOutcome, SetRecord, below, milliseconds, now_ms};
use super::{Batch, PhotographsOfFolder};
use crate::job::inputs::Inputs;
use crate::job::{Outputs, SideOutput, StitchJob};
use crate::options::StitchOptions;
use crate::pipeline::memory_of_each;

/// What a set's panorama is called in its folder, without extension.
const PANORAMA: &str = "panorama";
/// A set that was begun so many times without an end is not begun again: it kills the program, most likely by the memory it takes.
const MOST_UNENDED: u64 = 5;

/// What came of looking at a set.
pub(super) enum Attempt {
    /// It had been done, and nothing asks for it again.
    WasDone,
    /// Another program works at it.
    Elsewhere,
    /// It is done now.
    Done(SetRecord),
}

/// What all sets are worked at with.
pub(super) struct Work<'a> {
    batch: &'a Batch,
    /// With the memory of one of the sets that are worked at at once.
    options: StitchOptions,
    at_once: usize,
    /// Threads for each of them; 0 for one per core.
    threads: usize,
    /// What decides panoramas beside the photographs.
    decided_by: Value,
    /// When sets failed that are to be tried again, by their positions: once in this run, whoever does it.
    failed_before: BTreeMap<usize, u64>,
    /// Whether it was said that locks do not hold.
    told_of_locks: AtomicBool,
}

impl<'a> Work<'a> {
    /// Checks what holds for all sets, and makes the folder for them.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Unsupported`] if the format is none, or has not what is asked of it; [`Error::Io`].
    pub(super) fn new(batch: &'a Batch, options: &StitchOptions) -> Result<Self> {
        options.validate()?;
        let job = &batch.job;
        let name = PathBuf::from(format!("{PANORAMA}.{}", job.extension));
        encode::check_format(&name, &options.compose.output)?;
        std::fs::create_dir_all(&job.output).map_err(|error| Error::io("making", &job.output, error))?;
        let at_once = job.at_once.clamp(1, batch.positions().count().max(1));
        let mut for_one = options.clone();
        for_one.run.resources.memory = memory_of_each(options.run.resources.memory, at_once);
        let mut work = Self {
            batch,
            options: for_one,
            at_once,
            threads: threads_of_each(job.threads, at_once),
            decided_by: decided_by(options, &job.extension)?,
            failed_before: BTreeMap::new(),
            told_of_locks: AtomicBool::new(false),
        };
        work.failed_before = batch.positions().filter_map(|position| work.failure_to_try_again(position)).collect();
        Ok(work)
    }

    /// How many sets are worked at at once.
    pub(super) fn at_once(&self) -> usize {
        self.at_once
    }

    /// A set that failed and is to be tried again, with when it failed.
    fn failure_to_try_again(&self, position: usize) -> Option<(usize, u64)> {
        let record = SetRecord::read(&self.folder_of(position))?;
        let is_tried_again = record.may_pass() || (self.batch.job.retry && record.has_failed());
        is_tried_again.then_some((position, record.ended_ms))
    }

    fn folder_of(&self, position: usize) -> PathBuf {
        self.batch.sets[position].folder_in(&self.batch.job.output)
    }

    /// Does the set at this position, if it is to be done and nobody else is at it.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of keeping records.
    pub(super) fn attempt(&self, position: usize, context: &StageContext) -> Result<Attempt> {
        let (set, folder) = (&self.batch.sets[position], self.folder_of(position));
        let made_of = self.made_of(set);
        if self.is_done(position, &made_of) && !Claim::is_begun(&folder) {
            return Ok(Attempt::WasDone);
        }
        let Some(claim) = Claim::take(&folder)? else { return Ok(Attempt::Elsewhere) };
        // Another program may have done it in between, or been killed as soon as it was done.
        if self.is_done(position, &made_of) {
            claim.release();
            return Ok(Attempt::WasDone);
        }
        if !claim.is_locked && !self.told_of_locks.swap(true, Ordering::Relaxed) {
            context.report(without_locks(&self.batch.job.output));
        }
        let done = self.outcome(set, &folder, &claim, context).and_then(|outcome| {
            let record = SetRecord {
                set: set.name.clone(),
                photographs: set.photographs.len(),
                made_of,
                ended_ms: now_ms(),
                outcome,
            };
            record.write(&folder).map(|()| record)
        });
        claim.release();
        done.map(Attempt::Done)
    }

    /// Whether a set need not be stitched again.
    fn is_done(&self, position: usize, made_of: &Value) -> bool {
        let Some(record) = SetRecord::read(&self.folder_of(position)) else { return false };
        let is_tried_again = self.failed_before.get(&position) == Some(&record.ended_ms);
        !is_tried_again && record.made_of == *made_of && record.files_are_there(&self.batch.job.output)
    }

    /// What decides the panoramas of a set: the program, the options and the photographs as they lie on the disk. Where the
    /// tree of folders is mounted decides nothing: machines that share it may differ in that.
    fn made_of(&self, set: &PhotographsOfFolder) -> Value {
        let photograph = |path: &PathBuf| {
            let metadata = std::fs::metadata(path).ok();
            let modified = metadata.as_ref().and_then(|metadata| metadata.modified().ok());
            json!({
                "path": path.strip_prefix(&self.batch.job.folder).unwrap_or(path).display().to_string(),
                "bytes": metadata.map(|metadata| metadata.len()),
                "modified_ms": modified.map(milliseconds),
            })
        };
        let mut made_of = self.decided_by.clone();
        made_of["photographs"] = set.photographs.iter().map(photograph).collect();
        made_of
    }

    /// What becomes of a set. What goes wrong with it is an outcome, too.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and if the folder cannot be made ready.
    fn outcome(
        &self,
        set: &PhotographsOfFolder,
        folder: &Path,
        claim: &Claim,
        context: &StageContext,
    ) -> Result<SetOutcome> {
        SetRecord::forget(folder)?;
        // In the folder of the batch itself, other programs write what they sum up.
        if folder != self.batch.job.output {
            encode::clear_parts(folder);
        }
        if set.is_alone() {
            return Ok(SetOutcome::Alone);
        }
        if claim.unended >= MOST_UNENDED {
            return Ok(deadly(claim.unended));
        }
        // A defect that one set finds is not to cost the others.
        match catch_unwind(AssertUnwindSafe(|| self.stitch(set, folder, context))) {
            Ok(Err(Error::Cancelled)) => Err(Error::Cancelled),
            Ok(Err(error)) => Ok(SetOutcome::failed(&error)),
            Ok(Ok(panoramas)) => Ok(SetOutcome::Made(panoramas)),
            Err(panic) => Ok(defect(panic.as_ref())),
        }
    }

    /// Stitches a set; returns the summaries of its panoramas.
    fn stitch(&self, set: &PhotographsOfFolder, folder: &Path, context: &StageContext) -> Result<Vec<Value>> {
        let job = &self.batch.job;
        let outputs = Outputs::new(folder.join(format!("{PANORAMA}.{}", job.extension)))
            .with(SideOutput::Project, folder.join(format!("{PANORAMA}.json")))
            .with(SideOutput::Thumbnail, folder.join("thumbnail.jpg"));
        let photographs = set.photographs.iter().map(|path| path.display().to_string());
        let inputs = Inputs { all: true, ..Inputs::new(photographs) };
        // Findings are a set's own, and so is progress where there is one at a time.
        let own = if self.at_once > 1 { context.without_progress() } else { context.seeded(context.seed()) };
        let written = StitchJob { inputs, outputs, cache: None, threads: self.threads }.run(&self.options, &own)?;
        Ok(written.iter().map(|one| below(one.summary(), &job.output)).collect())
    }
}

/// What decides panoramas beside the photographs: options that say how the work is done do not.
fn decided_by(options: &StitchOptions, extension: &str) -> Result<Value> {
    let deciding: Vec<&str> =
        StitchOptions::tables().into_iter().filter_map(|(table, phase)| phase.map(|_| table)).collect();
    let decides = |name: &str| name.split_once('.').is_some_and(|(table, _)| deciding.contains(&table));
    let changed = options.changed()?.into_iter().filter(|one| decides(&one.description.name));
    let changed: Vec<String> = changed.map(|one| format!("{}={}", one.description.name, one.value)).collect();
    Ok(json!({ "program": env!("CARGO_PKG_VERSION"), "extension": extension, "options": changed }))
}

/// The threads of each of several sets at once; 0, for one per core, stays what it is for a single one.
fn threads_of_each(threads: usize, at_once: usize) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    match (threads, at_once) {
        (threads, 1) => threads,
        (0, _) => (cores() / at_once).max(1),
        (threads, _) => (threads / at_once).max(1),
    }
}

/// A set that ended the program too often.
fn deadly(unended: u64) -> SetOutcome {
    SetOutcome::Failed {
        error: format!("the program was ended {unended} times while it worked at this set"),
        hint:
            "If nobody stopped it, memory is short: set --memory, or give smaller photographs. --retry tries it again."
                .to_owned(),
        may_pass: false,
    }
}

/// A set on which the program failed.
fn defect(panic: &(dyn Any + Send)) -> SetOutcome {
    let said = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    SetOutcome::Failed {
        error: format!("the program failed on it ({})", said.unwrap_or("it does not say why")),
        hint: "Report this as a defect, with the photographs.".to_owned(),
        may_pass: false,
    }
}

fn without_locks(output: &Path) -> Diagnostic {
    Diagnostic::warning(
        "folder-without-locks",
        Subject::file(output.display()),
        "files in it cannot be locked: programs that work there at the same time make the same panoramas twice",
        "Give each a part of its own (--shard).",
    )
}
