//! A photograph that the page shows.

use std::path::PathBuf;

/// A photograph that the page shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Listed {
    /// Its file, as the command would name it.
    pub path: PathBuf,
    /// Whether it was dropped on the page, and lies on the desk.
    pub dropped: bool,
}

impl Listed {
    /// What people call it.
    pub(crate) fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}
