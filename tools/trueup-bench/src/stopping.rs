//! Requests to stop.

use std::sync::Arc;

use trueup::CancelToken;

/// A token that the first request to stop cancels; the second ends the program.
pub(crate) fn cancel_token() -> Arc<CancelToken> {
    trueup_terminal::cancel_token(
        "trueup-bench",
        "stopping; what is done is kept",
        trueup_terminal::Ending::WhenStopped,
    )
}
