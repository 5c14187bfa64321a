//! How the command is asked to stop.

use std::sync::Arc;

use trueup::{CancelToken, Error};
use trueup_terminal::{Ending, WithoutMemory};

use crate::failure::{Failure, STATUS_FAILURE};

const BYTES_PER_MEGABYTE: f64 = 1e6;

/// A token that the first request to stop cancels; work that does not stop within a second is left, with nothing half
/// written. The second Ctrl-C ends the program.
pub(crate) fn cancel_token() -> Arc<CancelToken> {
    let last_resort = || {
        trueup::abandon_unfinished();
        trueup_terminal::complain(&Failure::from(Error::Cancelled).to_string());
    };
    trueup_terminal::cancel_token("trueup", "", Ending::By(last_resort))
}

/// Has the program end by an error, with nothing half written, where Rust would abort it for want of memory. For a
/// program whose allocator is [`trueup_terminal::NotingAllocator`], before anything else.
pub fn end_without_memory() {
    trueup_terminal::end_without_memory(WithoutMemory {
        say: |text, bytes| {
            writeln!(
                text,
                "trueup: error: memory: the system refused {:.1} MB more",
                bytes as f64 / BYTES_PER_MEGABYTE
            )?;
            writeln!(text, "trueup: hint: Close other programs, or have trueup take less with --memory 1GB.")
        },
        last_resort: trueup::abandon_unfinished_soon,
        status: i32::from(STATUS_FAILURE),
    });
}
