//! Ctrl-C: the first asks the work to stop, the second ends the program.

use std::sync::Arc;

use trueup::CancelToken;

/// 128 + SIGINT, as shells count a program that Ctrl-C ended.
pub(crate) const STATUS_INTERRUPTED: u8 = 130;

/// A token that the first Ctrl-C cancels. Without a way to catch signals, Ctrl-C ends the program as it always does.
pub(crate) fn cancel_token() -> Arc<CancelToken> {
    let token = Arc::new(CancelToken::default());
    let handled = token.clone();
    let caught = ctrlc::set_handler(move || {
        if handled.is_cancelled() {
            std::process::exit(i32::from(STATUS_INTERRUPTED));
        }
        handled.cancel();
        eprintln!("stopping; what is done is kept");
    });
    if let Err(error) = caught {
        eprintln!("trueup-bench: warning: Ctrl-C cannot be caught ({error})");
    }
    token
}
