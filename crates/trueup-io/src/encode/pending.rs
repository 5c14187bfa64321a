//! A file that appears complete or not at all.

use std::fs::File;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_core::{Error, Result};

/// A file under a temporary name beside its target; dropped uncommitted, it is removed.
#[derive(Debug)]
pub(crate) struct PendingFile {
    temporary: NamedTempFile,
    target: PathBuf,
}

impl PendingFile {
    /// Makes an empty file in the folder of `path`.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        // A link is followed, so that the file behind it is replaced and not the link.
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Some(folder) => folder,
            None => Path::new("/"),
        };
        if target.is_dir() {
            return Err(Error::input(path.display(), "it is a folder", "Give the name of a file in it."));
        }
        if !folder.is_dir() {
            let reason = format!("the folder {} does not exist", folder.display());
            return Err(Error::input(path.display(), reason, "Create it or choose another folder."));
        }
        let existing = target.metadata().ok();
        if existing.as_ref().is_some_and(|metadata| metadata.permissions().readonly()) {
            return Err(Error::input(
                path.display(),
                "the file is write-protected",
                "Choose another name or unprotect it.",
            ));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".trueup-").suffix(".part");
        // The permissions of the file it replaces, else those of any new file; temporary files are private otherwise.
        match existing {
            Some(metadata) => drop(builder.permissions(metadata.permissions())),
            None => allow_umask(&mut builder),
        }
        let temporary = builder.tempfile_in(folder).map_err(|error| Error::io("writing into", folder, error))?;
        Ok(Self { temporary, target })
    }

    /// The file to write to.
    pub(crate) fn file(&mut self) -> &mut File {
        self.temporary.as_file_mut()
    }

    /// Gives the file its name; returns its length in bytes.
    pub(crate) fn commit(self) -> Result<u64> {
        let length =
            self.temporary.as_file().metadata().map_err(|error| Error::io("writing", &self.target, error))?.len();
        self.temporary.persist(&self.target).map_err(|failed| Error::io("writing", &self.target, failed.error))?;
        Ok(length)
    }
}

#[cfg(unix)]
fn allow_umask(builder: &mut tempfile::Builder) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(std::fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn allow_umask(_builder: &mut tempfile::Builder) {}
