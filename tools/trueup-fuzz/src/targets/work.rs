//! Where inputs lie as files.

use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A folder for files that are read.
#[derive(Debug)]
pub struct Work(TempDir);

impl Work {
    /// An empty folder, which is removed with this.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn new() -> io::Result<Self> {
        Ok(Self(tempfile::tempdir()?))
    }

    /// The folder.
    pub(super) fn path(&self) -> &Path {
        self.0.path()
    }

    /// The input as a file; the one before it is gone.
    pub(super) fn file(&self, name: &str, input: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, input).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path
    }
}
