//! A file that appears complete or not at all.

use std::fmt::Display;
use std::fs::File;
use std::io::{ErrorKind, Seek};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_core::{Error, Result};

use super::place::{open_through, passes_through, refuse_disk, resolved};
use super::stale::{PART, PREFIX, STALE_AGE, clear_stale, mark_in_use};
use super::unfinished::{UNFINISHED, UnfinishedEntry};

/// Permissions that any new file asks for.
const NEW_FILE: u32 = 0o666;

/// A file under a temporary name beside its target; dropped uncommitted, it is removed. What passes through a pipe or a
/// device is kept in a file without a name until it is whole.
#[derive(Debug)]
pub(crate) struct PendingFile {
    target: PathBuf,
    way: Way,
    durability: Durability,
}

/// What of a file is sure to be there when the computer loses power just after the file has its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Durability {
    /// All of it: it is on the disk before it has its name, where another one may have been.
    Whole,
    /// Perhaps nothing, at once: for what is looked through when it is read, and can be made again.
    Regained,
}

/// How what was written comes to its target.
#[derive(Debug)]
enum Way {
    /// By its name. The entry comes after the file, which is gone before it leaves the list.
    Renamed { temporary: NamedTempFile, _entry: UnfinishedEntry<'static> },
    /// Byte for byte into what is no regular file, and must not be replaced by one.
    Through(File),
}

impl PendingFile {
    /// Makes an empty file in the folder of `path`, or for what is no regular file in that for temporary files.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        refuse_folder(path)?;
        check_name(path)?;
        if passes_through(path) {
            return Self::create_through(path);
        }
        // A link is followed, so that the file behind it is replaced and not the link.
        let target = resolved(path);
        let folder = folder_of(&target);
        require_folder(folder, path.display())?;
        let existing = target.metadata().ok();
        if existing.as_ref().is_some_and(|metadata| metadata.permissions().readonly()) {
            return Err(Error::input(
                path.display(),
                "the file is write-protected",
                "Choose another name or unprotect it.",
            ));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(PART);
        // The permissions of the file it replaces, else those of any new file; temporary files are private otherwise.
        match existing {
            Some(metadata) => drop(builder.permissions(metadata.permissions())),
            None => allow_umask(&mut builder, NEW_FILE),
        }
        let make = || builder.tempfile_in(folder).map_err(|error| takes_nothing(folder, &error));
        let (temporary, _entry) = UNFINISHED.begin(make, NamedTempFile::path)?;
        mark_in_use(temporary.as_file());
        Ok(Self { target, way: Way::Renamed { temporary, _entry }, durability: Durability::Whole })
    }

    /// The same file, of which so much is sure.
    #[must_use]
    pub(crate) fn with_durability(self, durability: Durability) -> Self {
        Self { durability, ..self }
    }

    fn create_through(path: &Path) -> Result<Self> {
        refuse_disk(path)?;
        let folder = std::env::temp_dir();
        let kept = tempfile::tempfile_in(&folder).map_err(|error| takes_nothing(&folder, &error))?;
        Ok(Self { target: path.to_owned(), way: Way::Through(kept), durability: Durability::Whole })
    }

    /// The file to write to.
    pub(crate) fn file(&mut self) -> &mut File {
        match &mut self.way {
            Way::Renamed { temporary, .. } => temporary.as_file_mut(),
            Way::Through(kept) => kept,
        }
    }

    /// Where what is written lies until then, as errors name it: what passes through lies in the folder for temporary
    /// files, which may be full where the target is not.
    pub(crate) fn place(&self) -> PathBuf {
        match self.way {
            Way::Renamed { .. } => self.target.clone(),
            Way::Through(_) => std::env::temp_dir(),
        }
    }

    /// Gives the file its name, or passes it on; returns its length in bytes.
    pub(crate) fn commit(self) -> Result<u64> {
        let Self { target, way, durability } = self;
        let failed = |error| Error::io("writing", &target, error);
        match way {
            Way::Renamed { temporary, _entry } => {
                let length = temporary.as_file().metadata().map_err(failed)?.len();
                if durability == Durability::Whole {
                    sync(temporary.as_file()).map_err(failed)?;
                }
                UNFINISHED.complete(|| temporary.persist(&target).map_err(|error| failed(error.error)))?;
                Ok(length)
            }
            Way::Through(mut kept) => {
                let mut into = open_through(&target)?;
                kept.rewind().and_then(|()| std::io::copy(&mut kept, &mut into)).map_err(failed)
            }
        }
    }
}

/// Has the disk hold what was written to a file. Some file systems cannot be asked for that, which is no reason to have
/// no file.
fn sync(file: &File) -> std::io::Result<()> {
    match file.sync_all() {
        Err(error) if matches!(error.kind(), ErrorKind::Unsupported | ErrorKind::InvalidInput) => Ok(()),
        done => done,
    }
}

/// The folder that `target` lies in.
fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => Path::new("/"),
    }
}

/// Checks that a file of any kind could be written to `path`: the folder exists and takes files, and `path` is no
/// folder itself. Pipes and character devices are written through, disks refused. Nothing is left behind, nor what an
/// earlier program that was killed has left in that folder.
///
/// # Errors
/// [`Error::Input`] if the folder does not exist or takes no files, [`Error::Io`] if the operating system refuses.
pub fn check_place(path: &Path) -> Result<()> {
    PendingFile::create(path)?;
    if !passes_through(path) {
        clear_stale(folder_of(path), STALE_AGE);
    }
    Ok(())
}

/// Refuses a folder where a file is to be, and what names one by its end.
pub(crate) fn refuse_folder(path: &Path) -> Result<()> {
    let names_one =
        path.as_os_str().as_encoded_bytes().last().is_some_and(|&last| std::path::is_separator(last.into()));
    match path.is_dir() || names_one {
        true => Err(Error::input(path.display(), "it is a folder", "Give the name of a file in it.")),
        false => Ok(()),
    }
}

/// Checks that a file may be called as `path` is, wherever it comes to lie: its temporary name is short, and its own is
/// needed when all is done.
///
/// # Errors
/// [`Error::Input`] if its name, or the path, is longer than the operating system allows.
pub fn check_name(path: &Path) -> Result<()> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::InvalidFilename => {
            Err(Error::input(path.display(), "its name is too long", "Give it a shorter name."))
        }
        _ => Ok(()),
    }
}

/// Refuses `shown`, which is to lie in `folder`, if that folder does not exist.
pub(super) fn require_folder(folder: &Path, shown: impl Display) -> Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let reason = format!("the folder {} does not exist", folder.display());
    Err(Error::input(shown, reason, "Create it or choose another folder."))
}

/// Why nothing can be made in `folder`: a disk that is full fails the program and not this one output, a folder that
/// may not be written to is at fault itself.
pub(crate) fn takes_nothing(folder: &Path, error: &std::io::Error) -> Error {
    // The name that was tried, which follows, is temporary and nobody's concern.
    let said = error.to_string();
    let cause = said.split(" at path ").next().unwrap_or_default();
    if matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded) {
        return Error::io("writing into", folder, std::io::Error::new(error.kind(), cause));
    }
    let reason = format!("nothing can be written into this folder ({cause})");
    Error::input(folder.display(), reason, "Check its permissions or choose another folder.")
}

/// Gives what is built the permissions `mode` but for those that the user's umask withholds.
#[cfg(unix)]
pub(super) fn allow_umask(builder: &mut tempfile::Builder, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(mode));
}

#[cfg(not(unix))]
pub(super) fn allow_umask(_builder: &mut tempfile::Builder, _mode: u32) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn what_passes_through_lies_elsewhere_until_then() {
        let pending = |path: &str| PendingFile::create(Path::new(path)).expect("possible").place();
        assert_eq!(pending("/dev/null"), std::env::temp_dir());
        let desk = tempfile::tempdir().expect("a folder");
        let file = desk.path().join("pano.jpg");
        assert_eq!(PendingFile::create(&file).expect("possible").place(), resolved(&file));
    }

    #[test]
    fn what_ends_as_the_name_of_a_folder_is_no_file() {
        let desk = tempfile::tempdir().expect("a folder");
        let message = check_place(&desk.path().join("pano.jpg/")).expect_err("a folder").to_string();
        assert!(message.contains("pano.jpg/: it is a folder"), "{message}");
        assert!(check_place(&desk.path().join("pano.jpg")).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_is_too_long_is_found_before_it_is_needed() {
        let desk = tempfile::tempdir().expect("a folder");
        // Most file systems of Unix take 255 bytes.
        let named = |bytes: usize| desk.path().join(format!("{}.jpg", "p".repeat(bytes - 4)));
        check_place(&named(200)).expect("short enough");
        let message = check_place(&named(256)).expect_err("too long").to_string();
        assert!(message.ends_with("its name is too long. Give it a shorter name."), "{message}");
    }

    /// Linux refuses to sync a device of characters.
    #[cfg(target_os = "linux")]
    #[test]
    fn what_cannot_be_synced_is_no_error() {
        let device = File::options().write(true).open("/dev/null").expect("it is there");
        assert_eq!(device.sync_all().expect_err("it is no file").kind(), ErrorKind::InvalidInput);
        sync(&device).expect("nothing is lost");
    }

    #[test]
    fn a_full_disk_is_told_from_a_folder_that_takes_nothing() {
        let folder = Path::new("out");
        let said = |kind: ErrorKind| takes_nothing(folder, &std::io::Error::from(kind));
        assert!(matches!(said(ErrorKind::PermissionDenied), Error::Input { subject, .. } if subject == "out"));
        for kind in [ErrorKind::StorageFull, ErrorKind::QuotaExceeded] {
            assert!(matches!(said(kind), Error::Io { path, source, .. } if path == folder && source.kind() == kind));
        }
    }
}
