//! What trueup's commands share at the terminal. Ctrl-C: the first asks the work to stop, the second ends the program.
#![forbid(unsafe_code)]

use std::sync::Arc;

use trueup_core::context::CancelToken;

/// 128 + SIGINT, as shells count a program that Ctrl-C ended.
pub const STATUS_INTERRUPTED: u8 = 130;

/// A token that the first Ctrl-C cancels, to be asked for once in a program; `said` is then printed on standard error,
/// unless it is empty. Without a way to catch signals, Ctrl-C ends `program` as it always does, which a warning says.
pub fn cancel_token(program: &str, said: &'static str) -> Arc<CancelToken> {
    let token = Arc::new(CancelToken::default());
    let handled = token.clone();
    let caught = ctrlc::set_handler(move || {
        if handled.is_cancelled() {
            std::process::exit(i32::from(STATUS_INTERRUPTED));
        }
        handled.cancel();
        if !said.is_empty() {
            eprintln!("{said}");
        }
    });
    if let Err(error) = caught {
        eprintln!("{program}: warning: Ctrl-C cannot be caught ({error})");
    }
    token
}
