//! What trueup's commands share at the terminal. Ctrl-C: the first asks the work to stop, the second ends the program.
#![forbid(unsafe_code)]

use std::sync::Arc;
use std::time::Duration;

use trueup_core::context::CancelToken;

/// 128 + SIGINT, as shells count a program that Ctrl-C ended.
pub const STATUS_INTERRUPTED: u8 = 130;

/// How long work that was asked to stop may take to do so, where a [`LastResort`] is at hand. Decoders and solvers of other
/// people's making look at no token; people press Ctrl-C again after a second.
const PATIENCE: Duration = Duration::from_millis(700);

/// What is to be done before the program ends without waiting for its work any longer.
pub type LastResort = fn();

/// A token that the first Ctrl-C cancels, to be asked for once in a program; `said` is then printed on standard error,
/// unless it is empty. With a `last_resort`, the program ends by it if the work has not stopped within a second. Without a way to catch signals, Ctrl-C ends `program` as it always does, which a warning says.
pub fn cancel_token(program: &str, said: &'static str, last_resort: Option<LastResort>) -> Arc<CancelToken> {
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
        if let Some(last_resort) = last_resort {
            // On a thread of its own, so that a second Ctrl-C is heard.
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                last_resort();
                std::process::exit(i32::from(STATUS_INTERRUPTED));
            });
        }
    });
    if let Err(error) = caught {
        eprintln!("{program}: warning: Ctrl-C cannot be caught ({error})");
    }
    token
}
