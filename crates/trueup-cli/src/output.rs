//! Standard output.

use std::io::{ErrorKind, Write};
use std::path::Path;

use trueup::Error;

use crate::failure::Failure;

/// Writes `text` to standard output. A reader that went away (`| head`) is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::Io { action: "writing", path: Path::new("standard output").to_owned(), source: error }.into())
        }
        _ => Ok(()),
    }
}
