//! Where inputs lie as files.

use std::io;
use std::path::PathBuf;

use tempfile::TempDir;

/// A folder for files that are read.
#[derive(Debug)]
pub(crate) struct Work(TempDir);

impl Work {
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self(tempfile::tempdir()?))
    }

    /// The input as a file; the one before it is gone.
    pub(super) fn file(&self, name: &str, input: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, input).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path
    }
}
