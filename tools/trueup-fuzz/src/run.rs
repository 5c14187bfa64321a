//! Executions of one target.

use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::mutation::mutated;
use crate::targets::{Target, Work};

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
        if panic::catch_unwind(AssertUnwindSafe(|| (target.read)(&work, &input))).is_err() {
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
    use crate::targets::TARGETS;

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
