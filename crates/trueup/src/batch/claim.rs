//! Who works at a set: one program at a time, on this machine or on another that shares the folder.

use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use trueup_core::{Error, Result};

use super::{foreign, names};

/// The byte in it for every beginning.
const BEGINNING: u8 = b'.';
/// Bytes of a file of that name that are looked at: more beginnings than any set has.
const MOST_LOOKED_AT: u64 = 4096;

/// A set that this program works at. Nobody else does while it lives: the file is locked, and a lock goes with the
/// program that holds it, however it ends.
#[derive(Debug)]
pub(super) struct Claim {
    path: PathBuf,
    file: File,
    /// How many times work at the set was begun before, by programs that were killed at it or, where the lock does not
    /// hold, may be at it.
    begun: u64,
    /// Whether the lock holds: file systems that know none let every program take every set.
    pub(super) is_locked: bool,
}

impl Claim {
    /// Takes the set whose folder this is, which is made if it is not there; `None` if another program works at it.
    ///
    /// Where the file system knows no locks, every program takes every set: work is done twice then, and comes to the
    /// same.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] if a file of that name is there that no batch has written.
    pub(super) fn take(folder: &Path) -> Result<Option<Self>> {
        std::fs::create_dir_all(folder).map_err(|error| Error::io("making", folder, error))?;
        let path = folder.join(names::CLAIM);
        let wrong = |error| Error::io("writing", &path, error);
        let mut file = File::options().create(true).read(true).append(true).open(&path).map_err(wrong)?;
        let is_locked = match file.try_lock() {
            Ok(()) => true,
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(_)) => false,
        };
        // Whoever had it may have taken the file away after it was opened here.
        if !is_at(&file, &path) {
            return Ok(None);
        }
        let mut beginnings = Vec::new();
        (&file).take(MOST_LOOKED_AT).read_to_end(&mut beginnings).map_err(wrong)?;
        if beginnings.iter().any(|&byte| byte != BEGINNING) {
            return Err(foreign::refusal(&path));
        }
        let begun = file.metadata().map_err(wrong)?.len();
        if let Err(error) = file.write_all(&[BEGINNING]) {
            // Nothing is to tell of work that never began.
            if is_locked && begun == 0 {
                drop(std::fs::remove_file(&path));
            }
            return Err(wrong(error));
        }
        Ok(Some(Self { path, file, begun, is_locked }))
    }

    /// How many times work at the set was begun before, and never came to an end. Where the lock does not hold, nothing
    /// tells programs that were killed from those that are at it: none is counted.
    pub(super) fn unended(&self) -> u64 {
        if self.is_locked { self.begun } else { 0 }
    }

    /// Whether nobody has begun with the set, so that nothing half made of it can be there.
    pub(super) fn is_first(&self) -> bool {
        self.begun == 0
    }

    /// Whether work at the set of this folder was begun and did not end, or has not yet.
    pub(super) fn is_begun(folder: &Path) -> bool {
        folder.join(names::CLAIM).exists()
    }

    /// Gives the set up, when all is said of it or it is to be begun anew: nothing tells of this work any more.
    pub(super) fn release(self) {
        // A file that stays is locked by nobody, and the set's record counts. It goes before the lock does.
        drop(std::fs::remove_file(&self.path));
        drop(self.file);
    }
}

/// Whether the open `file` is the one that lies at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata().map(identity), path.metadata().map(identity)) {
        (Ok(own), Ok(there)) => own == there,
        _ => false,
    }
}

/// A file that is open is not taken away elsewhere than on Unix.
#[cfg(not(unix))]
fn is_at(_file: &File, _path: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_one_program_s_until_it_ends_and_every_unended_beginning_counts() {
        let desk = tempfile::tempdir().expect("a folder");
        let folder = desk.path().join("a/b");
        assert!(!Claim::is_begun(&folder));
        let first = Claim::take(&folder).expect("possible").expect("nobody has it");
        assert_eq!((first.unended(), first.is_locked, first.is_first()), (0, true, true));
        assert!(Claim::is_begun(&folder));
        assert!(Claim::take(&folder).expect("possible").is_none(), "it is taken");
        // As when the program is killed: the lock goes, the file stays.
        drop(first);
        assert!(Claim::is_begun(&folder));
        let second = Claim::take(&folder).expect("possible").expect("nobody has it");
        assert_eq!((second.unended(), second.is_first()), (1, false));
        second.release();
        assert!(!Claim::is_begun(&folder));
        assert_eq!(Claim::take(&folder).expect("possible").expect("nobody has it").unended(), 0);
    }

    /// Without locks, all tasks of a cluster take a set at once: it does not kill them.
    #[test]
    fn where_nothing_is_locked_programs_at_work_are_not_counted_as_killed() {
        let desk = tempfile::tempdir().expect("a folder");
        for _ in 0..7 {
            drop(Claim::take(desk.path()).expect("possible").expect("nobody has it"));
        }
        let locked = Claim::take(desk.path()).expect("possible").expect("nobody has it");
        assert_eq!((locked.unended(), locked.is_first()), (7, false));
        let unlocked = Claim { is_locked: false, ..locked };
        assert_eq!((unlocked.unended(), unlocked.is_first()), (0, false));
    }

    /// A program opens the file, another takes it away when it is done, a third makes it anew: the first holds the lock
    /// of a file that is gone.
    #[cfg(unix)]
    #[test]
    fn a_file_that_was_taken_away_is_no_claim() {
        let desk = tempfile::tempdir().expect("a folder");
        let path = desk.path().join(names::CLAIM);
        let opened = File::options().create(true).append(true).open(&path).expect("made");
        assert!(is_at(&opened, &path));
        std::fs::remove_file(&path).expect("removed");
        assert!(!is_at(&opened, &path));
        std::fs::write(&path, "").expect("made anew");
        assert!(!is_at(&opened, &path));
    }
}
