//! Standard output.

use std::io::{ErrorKind, Write};
use std::path::Path;

use trueup::Error;

use crate::failure::Failure;
use crate::words::printable;

/// Writes `text` to standard output, without what would command a terminal. A reader that went away (`| head`) is no
/// failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(printable(text).as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::Io { action: "writing", path: Path::new("standard output").to_owned(), source: error }.into())
        }
        _ => Ok(()),
    }
}

/// Prints a report beside what was written: to standard error if standard output holds a file.
pub(crate) fn report(text: &str, is_output_taken: bool) -> Result<(), Failure> {
    if !is_output_taken {
        return print(text);
    }
    // As with messages: nobody is left to be told that nobody reads them.
    drop(std::io::stderr().lock().write_all(printable(text).as_bytes()));
    Ok(())
}
