//! A folder that appears complete or not at all.

use std::fs::File;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup_core::{Error, Result};

use super::pending::{allow_umask, require_folder, takes_nothing};
use super::stale::{PART, PREFIX, STALE_AGE, clear_stale, mark_in_use};
use super::unfinished::{UNFINISHED, UnfinishedEntry};

/// Permissions that any new folder asks for.
const NEW_FOLDER: u32 = 0o777;

/// A folder under a temporary name beside its target; dropped uncommitted, it is removed with everything in it.
#[derive(Debug)]
pub struct PendingFolder {
    temporary: TempDir,
    target: PathBuf,
    /// After the folder, which is gone before it leaves the list.
    entry: UnfinishedEntry<'static>,
    /// Marks the folder as that of a living program, where folders can be opened.
    _mark: Option<File>,
}

impl PendingFolder {
    /// Makes an empty folder beside `target`, whose parent folder must exist, and clears away what programs that were
    /// killed left there. What is at `target` stays as it is.
    ///
    /// # Errors
    /// [`Error::Input`] if `target` is a file, has no name, or its parent does not exist or takes nothing;
    /// [`Error::Io`] if the operating system refuses.
    pub fn create(target: &Path) -> Result<Self> {
        let shown = target.display();
        // A link is followed, so that the folder behind it is replaced and not the link; this names ".", too.
        let target = target.canonicalize().unwrap_or_else(|_| target.to_owned());
        if target.exists() && !target.is_dir() {
            return Err(Error::input(shown, "it is a file", "Give the name of a folder."));
        }
        let parent = match target.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) if target.file_name().is_some() => parent,
            _ => return Err(Error::input(shown, "it is no folder that can be made", "Give the name of a new folder.")),
        };
        require_folder(parent, shown)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(PART);
        allow_umask(&mut builder, NEW_FOLDER);
        let make = || builder.tempdir_in(parent).map_err(|error| takes_nothing(parent, &error));
        let (temporary, entry) = UNFINISHED.begin(make, TempDir::path)?;
        let mark = File::open(temporary.path()).ok();
        mark.iter().for_each(mark_in_use);
        clear_stale(parent, STALE_AGE);
        Ok(Self { temporary, target, entry, _mark: mark })
    }

    /// Where files are to be written until the folder has its name.
    pub fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Gives the folder its name. A folder of that name is replaced, with all that it holds: whether that may be is for
    /// the caller to judge. If the new one cannot take its place, the old one is put back.
    ///
    /// # Errors
    /// [`Error::Io`] if the operating system refuses.
    pub fn commit(self) -> Result<()> {
        let Self { temporary, target, entry, _mark } = self;
        let committed = UNFINISHED.complete(|| Self::replace(temporary, &target));
        drop(entry);
        committed
    }

    fn replace(temporary: TempDir, target: &Path) -> Result<()> {
        let failed = |error: std::io::Error| Error::io("writing", target, error);
        if !target.exists() {
            std::fs::rename(temporary.path(), target).map_err(failed)?;
            let _ = temporary.keep();
            return Ok(());
        }
        match exchange(temporary.path(), target) {
            // The temporary name is the old folder's now, which goes with it.
            Ok(()) => return Ok(()),
            Err(error) if is_unknown(&error) => {}
            Err(error) => return Err(failed(error)),
        }
        replace_in_two_steps(temporary, target).map_err(failed)
    }
}

/// Two folders of one file system take each other's names, at once: there is no moment in which one has none.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(one: &Path, other: &Path) -> std::io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

/// Elsewhere no operating system does that.
#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_one: &Path, _other: &Path) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// Whether the kernel, or the file system there, does not know how to exchange names, rather than that it would not.
fn is_unknown(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::Unsupported | std::io::ErrorKind::InvalidInput)
}

/// Moves the old folder into a second temporary one, with which it goes, and the new one to its place. A program that
/// is killed between the two leaves the old one under that other name.
fn replace_in_two_steps(temporary: TempDir, target: &Path) -> std::io::Result<()> {
    let parent = temporary.path().parent().unwrap_or(Path::new("."));
    let aside = tempfile::Builder::new().prefix(PREFIX).suffix(".old").tempdir_in(parent)?;
    let old = aside.path().join("old");
    std::fs::rename(target, &old)?;
    if let Err(error) = std::fs::rename(temporary.path(), target) {
        // The first failure is the one to tell of; should this fail, too, the old folder must not be dropped.
        if std::fs::rename(&old, target).is_err() {
            let _ = aside.keep();
        }
        return Err(error);
    }
    let _ = temporary.keep();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("readable");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_appears_whole_and_takes_the_place_of_an_older_one() {
        let desk = tempfile::tempdir().expect("a folder");
        let target = desk.path().join("out");
        for round in ["first", "second"] {
            let pending = PendingFolder::create(&target).expect("possible");
            std::fs::write(pending.path().join(round), round).expect("written");
            pending.commit().expect("committed");
            assert_eq!(names(desk.path()), ["out"]);
            assert_eq!(names(&target), [round]);
        }
    }

    #[test]
    fn a_file_system_that_exchanges_no_names_gets_the_new_folder_in_two_steps() {
        let desk = tempfile::tempdir().expect("a folder");
        let target = desk.path().join("out");
        std::fs::create_dir(&target).expect("made");
        std::fs::write(target.join("old"), "old").expect("written");
        let new = tempfile::tempdir_in(desk.path()).expect("a folder");
        std::fs::write(new.path().join("new"), "new").expect("written");
        replace_in_two_steps(new, &target).expect("replaced");
        assert_eq!((names(desk.path()), names(&target)), (vec!["out".to_owned()], vec!["new".to_owned()]));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn folders_exchange_their_names_and_what_does_not_exist_is_an_error_of_its_own() {
        let desk = tempfile::tempdir().expect("a folder");
        let [one, other] = ["one", "other"].map(|name| desk.path().join(name));
        for folder in [&one, &other] {
            std::fs::create_dir(folder).expect("made");
            std::fs::write(folder.join(folder.file_name().expect("a name")), "").expect("written");
        }
        // A kernel older than this, or a file system that does not, is told from a refusal.
        match exchange(&one, &other) {
            Ok(()) => assert_eq!((names(&one), names(&other)), (vec!["other".to_owned()], vec!["one".to_owned()])),
            Err(error) => assert!(is_unknown(&error), "{error}"),
        }
        let error = exchange(&one, &desk.path().join("none")).expect_err("there is none");
        assert!(error.kind() == std::io::ErrorKind::NotFound || is_unknown(&error), "{error}");
    }

    #[test]
    fn a_folder_given_up_leaves_nothing_and_the_old_one_as_it_was() {
        let desk = tempfile::tempdir().expect("a folder");
        let target = desk.path().join("out");
        std::fs::create_dir(&target).expect("made");
        std::fs::write(target.join("kept"), "kept").expect("written");
        let pending = PendingFolder::create(&target).expect("possible");
        std::fs::write(pending.path().join("new"), "new").expect("written");
        drop(pending);
        assert_eq!((names(desk.path()), names(&target)), (vec!["out".to_owned()], vec!["kept".to_owned()]));
    }

    #[test]
    fn impossible_places_are_refused() {
        let desk = tempfile::tempdir().expect("a folder");
        std::fs::write(desk.path().join("file"), "").expect("written");
        for (name, reason) in [("file", "it is a file"), ("none/out", "does not exist")] {
            let message = PendingFolder::create(&desk.path().join(name)).expect_err("must fail").to_string();
            assert!(message.contains(reason), "{message}");
        }
        assert!(PendingFolder::create(Path::new("/")).is_err());
        assert_eq!(names(desk.path()), ["file"]);
    }
}
