//! How the command is asked to stop.

use std::sync::Arc;

use trueup::{CancelToken, Error};

use crate::failure::Failure;

/// A token that the first request to stop cancels; work that does not stop within a second is left, with nothing half
/// written. The second Ctrl-C ends the program.
pub(crate) fn cancel_token() -> Arc<CancelToken> {
    let last_resort = || {
        trueup::abandon_unfinished();
        trueup_terminal::complain(&Failure::from(Error::Cancelled).to_string());
    };
    trueup_terminal::cancel_token("trueup", "", Some(last_resort))
}
