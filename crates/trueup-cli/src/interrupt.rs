//! Ctrl-C: the first asks the work to stop, the second ends the program.

use std::sync::Arc;

use trueup::CancelToken;

use crate::failure::STATUS_INTERRUPTED;

/// A token that the first Ctrl-C cancels. Without a way to catch signals, Ctrl-C ends the program as it always does.
pub(crate) fn cancel_token() -> Arc<CancelToken> {
    let token = Arc::new(CancelToken::default());
    let handled = token.clone();
    let caught = ctrlc::set_handler(move || {
        if handled.is_cancelled() {
            std::process::exit(i32::from(STATUS_INTERRUPTED));
        }
        handled.cancel();
    });
    if let Err(error) = caught {
        eprintln!("trueup: warning: Ctrl-C cannot be caught ({error})");
    }
    token
}
