//! Results of earlier runs, kept in a folder by what they were made from.
//!
//! An entry is a file whose name is the hash of everything that decides its content: the photographs' bytes, the
//! options of the stages concerned, and the program's own stages. What is found is therefore what would be made again;
//! nothing is ever out of date. Entries are written beside their place and renamed, so that several programs may share
//! a folder.

mod entry;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde::de::DeserializeOwned;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode;

use super::key::Key;
use super::kind::{GEOMETRY, Kind, LIGHT, LIKENESS, MEASURED, PAIR, PARALLAX, STACKS};

pub(crate) use entry::{content as checked_content, with_checksum as entry_with_content};

/// The kinds of entries.
const KINDS: [Kind; 7] = [MEASURED, STACKS, PAIR, LIKENESS, GEOMETRY, PARALLAX, LIGHT];
/// How the files of entries end.
const EXTENSION: &str = "trueup";
/// How names of files begin and end that are not complete yet.
const PENDING: [&str; 2] = [".trueup-", ".part"];
/// A file that was not completed for so long belongs to a program that died.
const ABANDONED: Duration = Duration::from_secs(24 * 60 * 60);
/// Tells programs that make backups that the folder can be made again.
///
/// # Source
/// B. Ford, "Cache Directory Tagging Specification", 2004.
const TAG: (&str, &str) = (
    "CACHEDIR.TAG",
    "Signature: 8a477f597d28d172789f06886806bc55\n# Results that trueup keeps between runs. They may be deleted at any time.\n",
);

/// How often results were wanted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CacheUse {
    /// Results that were found.
    pub found: usize,
    /// Results that were not, and were made.
    pub made: usize,
}

/// A folder of results of earlier runs.
///
/// ```
/// use trueup::{Inputs, PhotographCache, StageContext, StitchOptions, Stitcher};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// # let desk = tempfile::tempdir()?;
/// let (options, context) = (StitchOptions::default(), StageContext::default());
/// for found in [0, 1] {
///     let cache = PhotographCache::open(desk.path(), 1e9)?;
///     Stitcher::new(&options, &context).with_cache(Some(&cache)).align(&Inputs::new([room]))?;
///     assert_eq!(cache.uses()["geometry"].found, found);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Entries that are damaged or unreadable are made again; a folder that no longer takes entries stops no work. When the
/// cache is dropped, the entries that were not used for the longest time are removed until the folder is no larger than
/// `max_bytes`.
#[derive(Debug)]
pub struct PhotographCache {
    folder: PathBuf,
    max_bytes: u64,
    uses: Mutex<BTreeMap<&'static str, CacheUse>>,
    /// Codes and messages of what went wrong, each once.
    trouble: Mutex<BTreeMap<&'static str, String>>,
}

impl PhotographCache {
    /// Opens or makes a folder, which may grow to `max_bytes` (`resources.cache_bytes`).
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] if the folder cannot be made or takes no files.
    pub fn open(folder: &Path, max_bytes: f64) -> Result<Self> {
        fs::create_dir_all(folder).map_err(|error| Error::io("making the folder", folder, error))?;
        let tag = folder.join(TAG.0);
        // What a program left that was killed as it made the folder is cleared away, too.
        encode::check_place(&folder.join(EXTENSION))?;
        if !tag.exists() {
            encode::write_atomically(&tag, TAG.1.as_bytes())?;
        }
        // The cast saturates.
        let max_bytes = max_bytes as u64;
        Ok(Self { folder: folder.to_owned(), max_bytes, uses: Mutex::default(), trouble: Mutex::default() })
    }

    /// How often results were found and made, by what they are: `measured` (a photograph), `stacks` (which of all are
    /// one), `pair`, `likeness` (how all look like each other), `geometry` (a panorama), `parallax` (how far its
    /// photographs give way) and `light` (what evens theirs out).
    pub fn uses(&self) -> BTreeMap<&'static str, CacheUse> {
        self.uses.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Reports what went wrong so far, once.
    pub(crate) fn report(&self, context: &StageContext) {
        let trouble = std::mem::take(&mut *self.trouble.lock().unwrap_or_else(PoisonError::into_inner));
        for (code, message) in trouble {
            context.report(Diagnostic::note(code, Subject::file(self.folder.display()), message, ""));
        }
    }

    /// The result of this kind and key, if there is one.
    pub(crate) fn load<T: DeserializeOwned>(&self, kind: Kind, key: &Key) -> Option<T> {
        let found = self.read(kind, key);
        let mut uses = self.uses.lock().unwrap_or_else(PoisonError::into_inner);
        let uses = uses.entry(kind.0).or_default();
        *if found.is_some() { &mut uses.found } else { &mut uses.made } += 1;
        found
    }

    fn read<T: DeserializeOwned>(&self, kind: Kind, key: &Key) -> Option<T> {
        let path = self.path(kind, key);
        let bytes = fs::read(&path).ok()?;
        let found = entry::content(&bytes).and_then(|content| rmp_serde::from_slice(content).ok());
        match found {
            // Only its age in the folder: without it, the entry goes a little earlier.
            Some(_) => drop(fs::File::open(&path).and_then(|file| file.set_modified(SystemTime::now()))),
            None => self.trouble("cache-entry-damaged", "an entry of the cache was damaged; it was made again"),
        }
        found
    }

    /// Keeps a result.
    pub(crate) fn store<T: Serialize>(&self, kind: Kind, key: &Key, result: &T) {
        let written = rmp_serde::to_vec_named(result).map_err(|error| error.to_string()).and_then(|content| {
            let bytes = entry::with_checksum(&content);
            encode::write_regained(&self.path(kind, key), &bytes).map_err(|error| error.to_string())
        });
        if let Err(reason) = written {
            self.trouble("cache-not-written", &format!("a result could not be kept: {reason}"));
        }
    }

    fn path(&self, kind: Kind, key: &Key) -> PathBuf {
        self.folder.join(format!("{}-{key}.{EXTENSION}", kind.0))
    }

    fn trouble(&self, code: &'static str, message: &str) {
        let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        trouble.entry(code).or_insert_with(|| message.to_owned());
    }

    /// Removes the entries not used for the longest time until the folder is small enough, and what died while it was
    /// written. Another program may remove files at the same time.
    fn trim(&self) {
        let Ok(files) = fs::read_dir(&self.folder) else { return };
        let mut entries: Vec<(SystemTime, PathBuf, u64)> = Vec::new();
        for file in files.flatten() {
            let Ok(metadata) = file.metadata() else { continue };
            let (path, name) = (file.path(), file.file_name().to_string_lossy().into_owned());
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if is_entry(&path) && metadata.is_file() {
                entries.push((used, path, metadata.len()));
            } else if name.starts_with(PENDING[0]) && name.ends_with(PENDING[1]) {
                let age = SystemTime::now().duration_since(used).unwrap_or_default();
                if age > ABANDONED {
                    drop(fs::remove_file(path));
                }
            }
        }
        entries.sort();
        let mut total: u64 = entries.iter().map(|(_, _, length)| length).sum();
        for (_, path, length) in entries {
            if total <= self.max_bytes {
                break;
            }
            // Gone already is as good.
            drop(fs::remove_file(path));
            total -= length;
        }
    }
}

impl Drop for PhotographCache {
    fn drop(&mut self) {
        self.trim();
    }
}

/// Whether a file is named like an entry: nothing else in the folder is ever removed.
fn is_entry(path: &Path) -> bool {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    path.extension().is_some_and(|extension| extension == EXTENSION)
        && stem
            .split_once('-')
            .is_some_and(|(kind, key)| KINDS.iter().any(|known| known.0 == kind) && Key::is_written(key))
}
