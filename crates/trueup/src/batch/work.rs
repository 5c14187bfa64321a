//! The work at one set: whether it is to be done, by whom, and what becomes of it.

use std::any::Any;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use serde_json::{Value, json};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode;

use super::claim::Claim;
use super::foreign;
use super::names::{self, PANORAMA};
use super::record::{PHOTOGRAPHS, SetOutcome, SetRecord, UNREADABLE, below, milliseconds, now_ms};
use super::{Batch, PhotographsOfFolder};
use crate::inputs::Inputs;
use crate::job::{Outputs, SideOutput, StitchJob};
use crate::options::StitchOptions;
use crate::pipeline::memory_of_each;

/// A set that was begun so many times without an end is not begun again: it kills the program, most likely by the
/// memory it takes.
const MOST_UNENDED: u64 = 5;
/// How long another program may take at most from making a temporary file to marking it as its own: a thousand times
/// what it does.
const MARKED_WITHIN: Duration = Duration::from_secs(1);

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
    /// [`Error::Options`]; [`Error::Unsupported`] if the format is none, or has not what is asked of it;
    /// [`Error::Input`] if the folder cannot be made.
    pub(super) fn new(batch: &'a Batch, options: &StitchOptions) -> Result<Self> {
        options.validate()?;
        let job = &batch.job;
        let name = PathBuf::from(format!("{PANORAMA}.{}", job.extension));
        encode::check_format(&name, &options.compose.output)?;
        make_output(&job.output)?;
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

    /// Does the set at this position, if it is to be done and nobody else is at it. One whose folder takes nothing
    /// failed: its record is kept by the batch alone.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and [`Error::Io`] where no set could be kept.
    pub(super) fn attempt(&self, position: usize, context: &StageContext) -> Result<Attempt> {
        let set = &self.batch.sets[position];
        let outcome = match self.refusal(set) {
            Some(refusal) => SetOutcome::failed(&refusal),
            None => match self.attempt_in_folder(position, context) {
                Err(error) if !concerns_all(&error) => unkeepable(&error),
                done => return done,
            },
        };
        let record = self.record(position, self.made_of(set, |_| true), &self.panoramas_of(position), outcome);
        self.batch.unkept.lock().unwrap_or_else(PoisonError::into_inner).insert(position, record.clone());
        Ok(Attempt::Done(record))
    }

    /// Why a set can have no folder: files of the batch are called as its folder would be.
    fn refusal(&self, set: &PhotographsOfFolder) -> Option<Error> {
        let place = names::place_of_a_file(&set.name, |name| self.batch.has_set(name))?;
        let place = self.batch.job.output.join(place);
        let reason = "its folder would lie here, where the batch writes a file of its own";
        Some(Error::input(place.display(), reason, "Rename the folder of its photographs."))
    }

    /// Does the set at this position in its folder, if it is to be done and nobody else is at it.
    ///
    /// # Errors
    /// [`Error::Cancelled`], those of making the folder and keeping the record, and [`Error::Input`] for a file that no
    /// batch has written where one of its own would come to lie.
    fn attempt_in_folder(&self, position: usize, context: &StageContext) -> Result<Attempt> {
        let (set, folder) = (&self.batch.sets[position], self.folder_of(position));
        if self.is_done(position) && !Claim::is_begun(&folder) {
            return Ok(Attempt::WasDone);
        }
        let Some(claim) = Claim::take(&folder)? else { return Ok(Attempt::Elsewhere) };
        // Another program may have done it in between, or been killed as soon as it was done.
        if self.is_done(position) {
            claim.release();
            return Ok(Attempt::WasDone);
        }
        if !claim.is_locked && !self.told_of_locks.swap(true, Ordering::Relaxed) {
            context.report(without_locks(&self.batch.job.output));
        }
        // What others have half made is theirs, be they killed or at it.
        let is_first = claim.is_first();
        if let Some(file) =
            foreign::in_set(&folder, &self.batch.job.output, &self.batch.job.extension).filter(|_| is_first)
        {
            claim.release();
            return Err(foreign::refusal(&file));
        }
        // As the photographs are before they are read: what changes under way is to be seen next time.
        let made_of = self.made_of(set, |_| true);
        let earlier = self.panoramas_of(position);
        let done = self.outcome(set, &folder, &claim, context).and_then(|outcome| {
            let record = self.record(position, made_of, &earlier, outcome);
            record.write(&folder).map(|()| record)
        });
        claim.release();
        done.map(Attempt::Done)
    }

    /// The panoramas that lie in a set's folder, with when they were written.
    fn panoramas_of(&self, position: usize) -> BTreeMap<PathBuf, Option<SystemTime>> {
        let panoramas = names::panoramas_in(&self.folder_of(position)).into_iter();
        panoramas.map(|path| (path.clone(), written_at(&path))).collect()
    }

    /// What is to be kept of a set now. Of `earlier` panoramas, which were there before, those that are neither gone
    /// nor written anew are outdated; what this attempt has written before it failed is no earlier one's.
    fn record(
        &self,
        position: usize,
        made_of: Value,
        earlier: &BTreeMap<PathBuf, Option<SystemTime>>,
        outcome: SetOutcome,
    ) -> SetRecord {
        let (set, output) = (&self.batch.sets[position], &self.batch.job.output);
        let shown = |path: PathBuf| path.strip_prefix(output).unwrap_or(&path).display().to_string();
        let left = names::panoramas_in(&self.folder_of(position)).into_iter();
        let left = left.filter(|path| earlier.get(path) == Some(&written_at(path)));
        let mut record = SetRecord {
            set: set.name.clone(),
            photographs: set.photographs.len(),
            made_of,
            ended_ms: now_ms(),
            outcome,
            outdated: left.map(shown).collect(),
        };
        let current: Vec<String> =
            record.panoramas().iter().filter_map(|one| one["panorama"].as_str().map(str::to_owned)).collect();
        record.outdated.retain(|file| !current.contains(file));
        record
    }

    /// Whether a set need not be stitched again.
    fn is_done(&self, position: usize) -> bool {
        let Some(record) = SetRecord::read(&self.folder_of(position)) else { return false };
        // To open every photograph of an archive in each run takes long, and says something only where one could not be
        // read then.
        let made_of = || self.made_of(&self.batch.sets[position], |photograph| record.was_unreadable(photograph));
        let is_tried_again = self.failed_before.get(&position) == Some(&record.ended_ms);
        !is_tried_again && record.is_of(&made_of()) && record.files_are_whole(&self.batch.job.output)
    }

    /// What decides the panoramas of a set: the program, the options and the photographs as they lie on the disk. Where
    /// the tree of folders is mounted decides nothing: machines that share it may differ in that. Whether a photograph
    /// can be read is found out where `is_opened` says so, by its position.
    fn made_of(&self, set: &PhotographsOfFolder, is_opened: impl Fn(usize) -> bool) -> Value {
        let photograph = |(position, path): (usize, &PathBuf)| {
            let metadata = std::fs::metadata(path).ok();
            let modified = metadata.as_ref().and_then(|metadata| metadata.modified().ok());
            // Its permissions are no part of what it is; whether they let it be read is.
            let is_file = metadata.as_ref().is_some_and(std::fs::Metadata::is_file);
            let is_unreadable = is_file && is_opened(position) && File::open(path).is_err();
            let mut photograph = json!({
                "path": path.strip_prefix(&self.batch.job.folder).unwrap_or(path).display().to_string(),
                "bytes": metadata.map(|metadata| metadata.len()),
                "modified_ms": modified.map(milliseconds),
            });
            if is_unreadable {
                photograph[UNREADABLE] = true.into();
            }
            photograph
        };
        let mut made_of = self.decided_by.clone();
        made_of[PHOTOGRAPHS] = set.photographs.iter().enumerate().map(photograph).collect();
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
        self.clear_parts(folder, claim);
        if set.is_alone() {
            return Ok(SetOutcome::Alone);
        }
        if claim.unended() >= MOST_UNENDED {
            return Ok(deadly(claim.unended()));
        }
        // A defect that one set finds is not to cost the others.
        match catch_unwind(AssertUnwindSafe(|| self.stitch(set, folder, context))) {
            Ok(Err(Error::Cancelled)) => Err(Error::Cancelled),
            Ok(Err(error)) => Ok(SetOutcome::failed(&error)),
            Ok(Ok(panoramas)) => Ok(SetOutcome::Made(panoramas)),
            Err(panic) => Ok(defect(panic.as_ref())),
        }
    }

    /// Takes away what was half written when a program was killed at this set.
    fn clear_parts(&self, folder: &Path, claim: &Claim) {
        if folder != self.batch.job.output {
            encode::clear_parts(folder, Duration::ZERO);
        } else if claim.unended() > 0 {
            // In the folder of the batch itself, other programs write what they sum up: what is theirs is marked soon.
            std::thread::sleep(MARKED_WITHIN);
            encode::clear_parts(folder, MARKED_WITHIN);
        }
    }

    /// Stitches a set; returns the summaries of its panoramas.
    fn stitch(&self, set: &PhotographsOfFolder, folder: &Path, context: &StageContext) -> Result<Vec<Value>> {
        let job = &self.batch.job;
        let outputs = Outputs::new(folder.join(format!("{PANORAMA}.{}", job.extension)))
            .with(SideOutput::Project, folder.join(names::project()))
            .with(SideOutput::Thumbnail, folder.join(names::thumbnail()));
        let photographs = set.photographs.iter().map(|path| path.display().to_string());
        let inputs = Inputs { all: true, refuse_single: true, ..Inputs::new(photographs) };
        // Findings are a set's own, and so is progress where there is one at a time.
        let own = if self.at_once > 1 { context.without_progress() } else { context.seeded(context.seed()) };
        let written = StitchJob { inputs, outputs, cache: None, threads: self.threads }.run(&self.options, &own)?;
        Ok(written.iter().map(|one| below(one.summary(), &job.output)).collect())
    }
}

/// When a file was written last, as far as the file system says.
fn written_at(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|metadata| metadata.modified()).ok()
}

/// Makes the folder for the panoramas, if it is not there.
///
/// # Errors
/// [`Error::Input`] if there is a file of its name, or the operating system refuses.
fn make_output(output: &Path) -> Result<()> {
    let hint = "Choose another folder for the panoramas.";
    if output.exists() && !output.is_dir() {
        return Err(Error::input(output.display(), "it is no folder, but a file", hint));
    }
    std::fs::create_dir_all(output).map_err(|error| match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Error::io("making", output, error),
        _ => Error::input(output.display(), format!("this folder cannot be made ({error})"), hint),
    })
}

/// Whether an error would come at every set: a stop, a disk that takes nothing more.
fn concerns_all(error: &Error) -> bool {
    match error {
        Error::Cancelled => true,
        Error::Io { source, .. } => {
            matches!(source.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::ReadOnlyFilesystem)
        }
        _ => false,
    }
}

/// A set of which nothing can be kept.
fn unkeepable(error: &Error) -> SetOutcome {
    let mut outcome = SetOutcome::failed(error);
    if let SetOutcome::Failed { hint, may_pass, .. } = &mut outcome {
        *may_pass = true;
        if hint.is_empty() {
            "Check the permissions of the set's folder there, and whether something else has its name."
                .clone_into(hint);
        }
    }
    outcome
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::BatchJob;
    use crate::test_room::ROOM;

    /// As on a full disk, which takes the panorama and nothing more.
    #[test]
    fn what_a_failed_attempt_has_written_is_of_no_earlier_one() {
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(ROOM);
        let (photographs, output) = (desk.path().join("in"), desk.path().join("out"));
        std::fs::create_dir_all(&photographs).expect("a folder");
        for name in ["00.jpg", "01.jpg"] {
            std::fs::copy(room.join(name), photographs.join(name)).expect("copied");
        }
        let batch = Batch::find(BatchJob::new(&photographs, &output), &StageContext::default()).expect("a set");
        let work = Work::new(&batch, &StitchOptions::default()).expect("work");
        let failed = || SetOutcome::failed(&Error::input("thumbnail.jpg", "there is no room", ""));
        let earlier = work.panoramas_of(0);
        std::fs::write(output.join("panorama.jpg"), "new").expect("written");
        assert!(work.record(0, Value::Null, &earlier, failed()).outdated.is_empty());
        let earlier = work.panoramas_of(0);
        assert_eq!(work.record(0, Value::Null, &earlier, failed()).outdated, ["panorama.jpg"]);
    }
}
