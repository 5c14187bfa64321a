//! Executions of one target.

use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use trueup_fuzz::{Target, Work};

use crate::mutation::mutated;

/// How long a target is tried: until the first of the two is reached.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Length {
    pub(crate) time: Duration,
    pub(crate) executions: u64,
}

/// What came of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Findings {
    pub(crate) executions: u64,
    /// Inputs that panicked.
    pub(crate) panics: u64,
    /// The longest time that one input took.
    pub(crate) slowest: Duration,
}

/// Panics in all threads of the program, those that were caught within as well: trueup contains what a decoder does,
/// and here it is a finding still.
static PANICS: AtomicU64 = AtomicU64::new(0);

/// Held while a target is tried: whose panic it is, nobody could tell otherwise.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn count_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            PANICS.fetch_add(1, Ordering::Relaxed);
            print(panic);
        }));
    });
}

/// Whether a target panics at an input.
fn panics(target: &Target, work: &Work, input: &[u8]) -> bool {
    let before = PANICS.load(Ordering::Relaxed);
    let is_caught = panic::catch_unwind(AssertUnwindSafe(|| (target.read)(work, input))).is_err();
    is_caught || PANICS.load(Ordering::Relaxed) > before
}

/// Tries a target with mutations of its seeds and of the files in `corpus`; keeps what panics in `findings`.
///
/// # Errors
/// Those of the file system.
pub(crate) fn fuzz(
    target: &Target,
    seed: u64,
    length: Length,
    corpus: Option<&Path>,
    findings: &Path,
) -> io::Result<Findings> {
    count_panics();
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let work = Work::new()?;
    let mut seeds = (target.seeds)();
    if let Some(folder) = corpus.filter(|folder| folder.is_dir()) {
        let mut paths: Vec<_> = std::fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
        paths.sort_by_key(std::fs::DirEntry::file_name);
        for entry in paths {
            seeds.push(std::fs::read(entry.path())?);
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Findings { executions: 0, panics: 0, slowest: Duration::ZERO };
    let started = Instant::now();
    while found.executions < length.executions && started.elapsed() < length.time {
        // The seeds themselves first.
        let input = match usize::try_from(found.executions).ok().and_then(|number| seeds.get(number)) {
            Some(seed) => seed.clone(),
            None => mutated(&seeds, &mut random),
        };
        let begun = Instant::now();
        if panics(target, &work, &input) {
            let name = format!("{}-{seed}-{}", target.name, found.executions);
            std::fs::create_dir_all(findings)?;
            std::fs::write(findings.join(name), &input)?;
            found.panics += 1;
        }
        found.slowest = found.slowest.max(begun.elapsed());
        found.executions += 1;
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_fuzz::TARGETS;

    fn executions(executions: u64) -> Length {
        Length { time: Duration::MAX, executions }
    }

    #[test]
    fn a_panic_is_found_and_its_input_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let target =
            Target { name: "broken", seeds: || vec![b"ab".to_vec()], read: |_, input| assert!(input.len() < 3) };
        let found = fuzz(&target, 1, executions(50), None, folder.path()).expect("executed");
        assert!(found.panics > 0 && found.executions == 50, "{found:?}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count() as u64, found.panics);
    }

    #[test]
    fn a_panic_that_is_contained_is_found_as_well() {
        let folder = tempfile::tempdir().expect("a folder");
        let contained = |_: &Work, input: &[u8]| drop(panic::catch_unwind(|| assert!(input.len() < 3)));
        let target = Target { name: "contained", seeds: || vec![b"abc".to_vec()], read: contained };
        let found = fuzz(&target, 1, executions(1), None, folder.path()).expect("executed");
        assert_eq!(found.panics, 1);
    }

    /// So many inputs for each target: a few seconds.
    const EXECUTIONS: u64 = 400;

    #[test]
    fn no_malformed_input_makes_anything_panic() {
        let folder = tempfile::tempdir().expect("a folder");
        for target in &TARGETS {
            let found = fuzz(target, 7, executions(EXECUTIONS), None, folder.path()).expect("executed");
            assert_eq!(found.panics, 0, "{}", target.name);
        }
    }
}
