//! Why a writer stopped.

use std::path::Path;

use trueup_core::Error;

/// Why a codec stopped, before it is tied to the file.
#[derive(Debug)]
pub(crate) enum WriteFailure {
    /// The picture could not hand out its rows, or the work is cancelled.
    Picture(Error),
    /// The file could not be written.
    Io(std::io::Error),
}

impl WriteFailure {
    /// As an error about the file at `path`.
    pub(crate) fn at(self, path: &Path) -> Error {
        match self {
            Self::Picture(error) => error,
            Self::Io(error) => Error::io("writing", path, error),
        }
    }
}

impl From<Error> for WriteFailure {
    fn from(error: Error) -> Self {
        Self::Picture(error)
    }
}

impl From<std::io::Error> for WriteFailure {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}
