//! Runs trials: set by set, sets in parallel, each photograph measured and matched and each panorama aligned as seldom
//! as possible.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::PoisonError;

use trueup::{CancelToken, Error, PhotographCache, Result, Silent, StageContext};

use crate::progress::Tracker;
use crate::set_work::{MatchingKey, Outcome, SetWork};
use crate::sets::SetSpec;
use crate::store::ResultStore;
use crate::trial::{Row, Trial};

/// What every trial needs beside itself.
#[derive(Debug)]
pub(crate) struct Runner<'a> {
    /// Folder of the sets that are made.
    pub data: PathBuf,
    /// Where results go.
    pub store: &'a ResultStore,
    /// What stands for the build of the program.
    pub version: String,
    /// Folder for what is measured of a set that is matched in several parts; empty before and after.
    pub scratch: PathBuf,
    /// Sets that are worked on at a time.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
    /// Set by requests to stop.
    pub cancel: &'a CancelToken,
    /// Whether progress is kept quiet.
    pub quiet: bool,
}

/// Bytes of a set's measured photographs and matched pairs that are kept while its trials run: far more than any needs.
const SCRATCH_BYTES: f64 = 16e9;

/// The trials of one set.
#[derive(Debug)]
struct SetTrials<'t> {
    set: &'t SetSpec,
    trials: Vec<&'t Trial>,
}

impl Runner<'_> {
    /// Runs what is not stored yet and returns all rows in the order of the trials.
    ///
    /// A trial whose photographs cannot be stitched has a row that says why, marked `refused` if another method could;
    /// sets that cannot be made or read end the run.
    ///
    /// # Errors
    /// Those of making and reading sets, of options that cannot be, of writing; [`Error::Cancelled`].
    pub(crate) fn run(&self, sets: &[&SetSpec], trials: &[Trial]) -> Result<Vec<Row>> {
        let mut groups: Vec<SetTrials> = Vec::new();
        for set in sets {
            let members: Vec<&Trial> = trials.iter().filter(|trial| trial.set == set.name).collect();
            if !members.is_empty() && !groups.iter().any(|known| known.set.name == set.name) {
                groups.push(SetTrials { set, trials: members });
            }
        }
        let tracker = Tracker::new("trials", trials.len() as u64, self.quiet);
        // The largest sets first, so that none is left over for one worker at the end.
        groups.sort_by_key(|group| group.set.photograph_count().unwrap_or(0));
        let queue = Mutex::new(groups);
        let found: Mutex<BTreeMap<(String, usize), Row>> = Mutex::default();
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let work = || -> Result<()> {
            let pool = thread_pool(self.threads)?;
            while let Some(SetTrials { set, trials }) = next() {
                tracker.working_on(&set.name);
                let rows = pool.install(|| self.run_set(set, &trials, &tracker))?;
                let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
                found.extend(rows.into_iter().enumerate().map(|(index, row)| ((set.name.clone(), index), row)));
                tracker.finished(&set.name);
            }
            Ok(())
        };
        let outcomes: Vec<Result<()>> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..self.jobs.max(1)).map(|_| scope.spawn(work)).collect();
            workers
                .into_iter()
                .map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect()
        });
        tracker.close();
        outcomes.into_iter().collect::<Result<()>>()?;
        let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut position: BTreeMap<&str, usize> = BTreeMap::new();
        let in_order = trials.iter().filter_map(|trial| {
            let index = position.entry(&trial.set).or_default();
            *index += 1;
            found.remove(&(trial.set.clone(), *index - 1))
        });
        Ok(in_order.collect())
    }

    /// The rows of one set's trials, in their order.
    fn run_set(&self, set: &SetSpec, trials: &[&Trial], tracker: &Tracker) -> Result<Vec<Row>> {
        let context = StageContext::new(&Silent, self.cancel);
        let ready = set.prepare(&self.data, &context)?;
        let mut work =
            SetWork { cancel: self.cancel, ready: &ready, matched: None, known: BTreeMap::new(), cache: None };
        let mut rows = vec![None; trials.len()];
        // Trials that share their matches lie side by side, so that one matching is held at a time; those that compare
        // pixels first, since the others can take their figures over.
        let mut order: Vec<usize> = (0..trials.len()).collect();
        order.sort_by_key(|&index| (MatchingKey::new(trials[index]), !trials[index].pixels));
        let parts: BTreeSet<MatchingKey> = trials.iter().map(|trial| MatchingKey::new(trial)).collect();
        let scratch = self.scratch.join(set.name.replace('/', "-"));
        if parts.len() > 1 {
            work.cache = Some(PhotographCache::open(&scratch, SCRATCH_BYTES)?);
        }
        for index in order {
            context.check_cancelled()?;
            let trial = trials[index];
            let key = trial.key(&ready.fingerprint, &self.version);
            let row = match self.store.get(&key) {
                Some(row) => row,
                None => {
                    let Outcome { measures, note } = work.outcome(trial)?;
                    let row = Row { key, measures, note };
                    self.store.add(row.clone())?;
                    row
                }
            };
            work.remember(trial, &row)?;
            rows[index] = Some(row);
            tracker.advance(1);
        }
        if work.cache.take().is_some() {
            // What is left there after a failure is overwritten or taken over by the next run of the same build.
            std::fs::remove_dir_all(&scratch).map_err(|error| Error::io("clearing", &scratch, error))?;
        }
        Ok(rows.into_iter().flatten().collect())
    }
}

/// A pool of this many threads.
///
/// # Errors
/// [`Error::Input`] if they cannot be started.
pub(crate) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::input("threads", error, "Ask for fewer with --jobs."))
}

#[cfg(test)]
mod tests {
    use trueup_scenes::{LightQuality, Quality, RigOptions, SceneOptions};

    use super::*;
    use crate::sets::Recipe;

    fn small_set() -> SetSpec {
        let scene = SceneOptions { seed: 3, light: LightQuality::Fast, ..SceneOptions::default() };
        let rig = RigOptions { seed: 3, pictures: 2, width: 320, height: 240, ..RigOptions::default() };
        SetSpec::rendered(
            "test/small".to_owned(),
            Some(true),
            Recipe { scene, rig, quality: Quality::Preview, second_roll_deg: 0.0 },
        )
    }

    #[test]
    fn a_second_run_takes_everything_from_the_store_in_the_order_of_the_trials() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("rows.jsonl");
        let cancel = CancelToken::default();
        let set = small_set();
        let trials = [
            Trial::new("test", &set.name, "default", &[]),
            Trial::new("test", &set.name, "small working copy", &["working.pixels=50000"]),
            Trial { seed: 1, random_directions: 0.5, ..Trial::new("test", &set.name, "default", &[]) },
            Trial::new("another", &set.name, "the same", &[]),
        ];
        let run = || {
            let store = ResultStore::open(&path, "1").expect("opens");
            let runner = Runner {
                data: folder.path().join("data"),
                scratch: folder.path().join("scratch"),
                store: &store,
                version: "1".to_owned(),
                jobs: 2,
                threads: 1,
                cancel: &cancel,
                quiet: true,
            };
            runner.run(&[&set], &trials).expect("runs")
        };
        let (first, stored) = (run(), std::fs::read_to_string(&path).expect("rows"));
        assert_eq!(stored.lines().count(), 4);
        let order: Vec<(&str, u64)> = first.iter().map(|row| (row.key.variant.as_str(), row.key.seed)).collect();
        assert_eq!(order, [("default", 0), ("small working copy", 0), ("default", 1), ("the same", 0)]);
        assert_eq!((&first[3].measures, &first[3].note), (&first[0].measures, &first[0].note));
        assert!(!folder.path().join("scratch/test-small").exists());
        assert_eq!((first[0].measure("used"), first[2].measure("used")), (Some(2.0), Some(2.0)), "{first:?}");
        assert_eq!(run(), first);
        assert_eq!(std::fs::read_to_string(&path).expect("rows"), stored);
        cancel.cancel();
        let store = ResultStore::open(&path, "1").expect("opens");
        let runner = Runner {
            data: folder.path().join("data"),
            scratch: folder.path().join("scratch"),
            store: &store,
            version: "2".to_owned(),
            jobs: 1,
            threads: 1,
            cancel: &cancel,
            quiet: true,
        };
        assert!(matches!(runner.run(&[&set], &trials), Err(Error::Cancelled)));
    }
}
