//! A tree of folders stitched, a set of photographs after the other: gone on with after a stop, shared between programs
//! and machines, and never stopped by one bad set.

mod claim;
mod foreign;
mod names;
mod queue;
mod record;
mod sets;
mod work;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use trueup_core::{Error, Result, StageContext};
use trueup_io::encode;

use crate::options::StitchOptions;

use self::claim::Claim;
use self::queue::Queue;
use self::work::{Attempt, Work};

pub use record::{SetOutcome, SetRecord};
pub use sets::PhotographsOfFolder;

/// What progress calls the sets.
const STAGE: &str = "sets";

/// Which of how many parts of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Counted from 1.
    pub number: usize,
    /// How many there are, at least 1.
    pub count: usize,
}

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Whether the set at this position, counted from 0, belongs to the part.
    pub fn holds(self, position: usize) -> bool {
        position % self.count.max(1) + 1 == self.number
    }
}

/// A tree of folders to be stitched.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchJob {
    /// The folder that holds the photographs, or folders of them.
    pub folder: PathBuf,
    /// The folder for the panoramas; made if it is not there.
    pub output: PathBuf,
    /// The extension of the panoramas' files, which chooses their format.
    pub extension: String,
    /// A folder's photographs are parted where none was taken for longer than this, seconds; infinite to part nothing.
    pub gap_seconds: f64,
    /// The part of the sets that is stitched here.
    pub shard: Shard,
    /// Whether sets are tried again that made no panorama.
    pub retry: bool,
    /// How many sets are worked at at once, at least 1. Threads and memory are divided among them.
    pub at_once: usize,
    /// Number of threads in all; 0 for one per core.
    pub threads: usize,
}

impl BatchJob {
    /// [`Self::gap_seconds`] without another wish: nobody waits for so long between two photographs of one panorama.
    pub const GAP_SECONDS: f64 = 300.0;
    /// [`Self::extension`] without another wish.
    pub const EXTENSION: &str = "jpg";

    /// All sets of `folder`, one at a time, on all cores.
    pub fn new(folder: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            output: output.into(),
            extension: Self::EXTENSION.to_owned(),
            gap_seconds: Self::GAP_SECONDS,
            shard: Shard::WHOLE,
            retry: false,
            at_once: 1,
            threads: 0,
        }
    }
}

/// A job whose sets were found.
#[derive(Debug)]
pub struct Batch {
    job: BatchJob,
    sets: Vec<PhotographsOfFolder>,
    /// Records of sets whose folder takes none, by their positions: known as long as the program runs.
    unkept: Mutex<BTreeMap<usize, SetRecord>>,
}

impl Batch {
    /// The file in the folder of the batch of the lines of all sets.
    pub const LINES: &str = "batch.jsonl";
    /// That of the table of all panoramas.
    pub const TABLE: &str = "batch.csv";
    /// That of the page of all panoramas.
    pub const PAGE: &str = "index.html";
    /// The files of all sets. A set of one of these names fails: its folder would lie where the file does.
    pub const FILES: [&str; 3] = [Self::LINES, Self::TABLE, Self::PAGE];

    /// Refuses a file at `path`, where the batch writes one of its own, that no batch has written, and which `is_own`
    /// does not know by its first bytes; an empty one has nothing to lose.
    ///
    /// # Errors
    /// [`Error::Input`] for such a file, [`Error::Io`] if it cannot be read.
    pub fn refuse_over(path: &Path, is_own: impl FnOnce(&[u8]) -> bool) -> Result<()> {
        foreign::refuse_over(path, is_own)
    }

    /// Finds the sets of a job. A folder that cannot be read is passed over with the warning `folder-unreadable`, a
    /// photograph whose name is no UTF-8 with `photograph-name-unreadable`, photographs where the panoramas are to be
    /// with `output-holds-photographs`.
    ///
    /// # Errors
    /// [`Error::Input`] if the folder is none, holds no photographs, or is the one for the panoramas; [`Error::Io`] if
    /// it cannot be read; [`Error::Cancelled`].
    pub fn find(job: BatchJob, context: &StageContext) -> Result<Self> {
        if encode::same_place(&job.folder, &job.output) {
            let hint = "Choose another folder for the panoramas; it may lie within this one.";
            return Err(Error::input(job.output.display(), "it is the folder of the photographs", hint));
        }
        let sets = sets::photograph_sets(&job.folder, &job.output, job.gap_seconds, context)?;
        if sets.is_empty() {
            let hint = "Give the folder that holds the photographs, or folders of them.";
            return Err(Error::input(
                job.folder.display(),
                "there are no photographs in it, nor in folders within",
                hint,
            ));
        }
        Ok(Self { job, sets, unkept: Mutex::default() })
    }

    /// All sets, also those of other shards.
    pub fn sets(&self) -> &[PhotographsOfFolder] {
        &self.sets
    }

    /// The sets of this job's shard.
    pub fn planned(&self) -> impl Iterator<Item = &PhotographsOfFolder> {
        self.positions().map(|position| &self.sets[position])
    }

    /// What became of the sets so far, whoever worked at them, in their order.
    pub fn records(&self) -> impl Iterator<Item = SetRecord> {
        (0..self.sets.len()).filter_map(|position| self.record_of(position))
    }

    /// What became of the sets of this job's shard so far.
    pub fn planned_records(&self) -> impl Iterator<Item = SetRecord> {
        self.positions().filter_map(|position| self.record_of(position))
    }

    /// What became of the set at this position. Of what is kept and what could not be, the later counts: another
    /// program may have done the set since.
    fn record_of(&self, position: usize) -> Option<SetRecord> {
        let kept = SetRecord::read(&self.sets[position].folder_in(&self.job.output));
        let unkept = self.unkept.lock().unwrap_or_else(PoisonError::into_inner).get(&position).cloned();
        kept.into_iter().chain(unkept).max_by_key(|record| record.ended_ms)
    }

    /// Whether a set has this name.
    fn has_set(&self, name: &str) -> bool {
        self.sets.iter().any(|set| set.name == name)
    }

    /// Stitches the sets that are not done, those last that were begun before and came to no end; `tell` hears of each
    /// when its record is kept. A set that other programs work at is waited for, and taken over if they are killed:
    /// when this returns, all sets of the shard are done.
    ///
    /// A set is done when its record is there. It is done anew only if its photographs, the options that decide
    /// panoramas, the extension or the version of this program have changed, a file of its panoramas is gone or was cut
    /// short, a photograph that could not be read can be read by now, it failed for a reason that may pass, or
    /// [`BatchJob::retry`] asks for it. A set whose folder takes no record, or holds a file that no batch has written
    /// where one would come to lie, failed, as long as this `Batch` lives; the next run tries it again. Where the file
    /// system knows no locks, the warning `folder-without-locks` says so.
    ///
    /// # Errors
    /// [`Error::Options`], [`Error::Unsupported`] for what could be written of no set; [`Error::Input`] if the folder
    /// for the panoramas cannot be made; [`Error::Io`] if no records can be kept, as on a full disk;
    /// [`Error::Cancelled`]; what `tell` returns. What goes wrong with a set is in its record instead.
    pub fn run<E: From<Error> + Send>(
        &self,
        options: &StitchOptions,
        tell: &(dyn Fn(&SetRecord) -> std::result::Result<(), E> + Sync),
        context: &StageContext,
    ) -> std::result::Result<(), E> {
        let work = Work::new(self, options)?;
        let queue = Queue::new(self.order());
        context.progress().begin(STAGE, self.positions().count() as u64);
        let failure = Mutex::new(None);
        let keep_first = |error: E| {
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            queue.close();
        };
        let work_off = || {
            if let Err(error) = work_off(&work, &queue, tell, context) {
                keep_first(error);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..work.at_once() {
                if let Err(error) = std::thread::Builder::new().name("batch".to_owned()).spawn_scoped(scope, work_off) {
                    let hint = "Ask for fewer sets at once (--jobs).";
                    keep_first(Error::input("threads", error, hint).into());
                }
            }
            work_off();
        });
        context.progress().finish(STAGE);
        failure.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }

    /// The positions of the sets of this job's shard.
    fn positions(&self) -> impl Iterator<Item = usize> {
        (0..self.sets.len()).filter(|&position| self.job.shard.holds(position))
    }

    /// The same in the order of work: those last that were begun and not ended. One that kills the program is to keep
    /// no other from being made.
    fn order(&self) -> Vec<usize> {
        let is_begun = |&position: &usize| Claim::is_begun(&self.sets[position].folder_in(&self.job.output));
        let (begun, untouched): (Vec<usize>, Vec<usize>) = self.positions().partition(is_begun);
        [untouched, begun].concat()
    }
}

/// Works at sets until none is left.
fn work_off<E: From<Error>>(
    work: &Work,
    queue: &Queue,
    tell: &(dyn Fn(&SetRecord) -> std::result::Result<(), E> + Sync),
    context: &StageContext,
) -> std::result::Result<(), E> {
    while let Some(position) = queue.next(context)? {
        match work.attempt(position, context)? {
            Attempt::Elsewhere => {
                queue.is_elsewhere(position);
                continue;
            }
            Attempt::WasDone => {}
            Attempt::Done(record) => tell(&record)?,
        }
        context.progress().advance(STAGE, 1);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
