//! What trueup's commands share at the terminal: how they are asked to stop. The first Ctrl-C asks the work to stop, the
//! second ends the program; so do, on Unix, the requests to terminate and the end of the terminal.
#![forbid(unsafe_code)]

#[cfg(unix)]
mod signals;

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use trueup_core::context::CancelToken;

/// 128 + SIGINT, as shells count a program that Ctrl-C ended.
const STATUS_INTERRUPTED: u8 = 130;

/// The exit status by the request to stop that came first.
static STATUS: AtomicU8 = AtomicU8::new(STATUS_INTERRUPTED);

/// How long work that was asked to stop may take to do so, where a [`LastResort`] is at hand. Decoders and solvers of other
/// people's making look at no token; people press Ctrl-C again after a second.
const PATIENCE: Duration = Duration::from_millis(700);

/// What is to be done before the program ends without waiting for its work any longer.
pub type LastResort = fn();

/// The exit status of a program that stops on request, as shells count them: 130 for Ctrl-C, 143 where it was asked to
/// terminate, 129 where its terminal is gone.
pub fn status_of_stopping() -> u8 {
    STATUS.load(Ordering::Relaxed)
}

/// Prints on standard error. It may be gone, with its terminal or its disk full: that ends no program, as `eprint!` would.
pub fn complain(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// A token that the first request to stop cancels, to be asked for once in a program; `said` is then printed on standard
/// error, unless it is empty. With a `last_resort`, the program ends by it if the work has not stopped within a second.
///
/// Requests are Ctrl-C and, on Unix, SIGTERM (`kill`, `timeout`, the system's end) and SIGHUP (the terminal's end), unless it
/// is ignored, as `nohup` has it. A second Ctrl-C ends the program at once. A second of the others does so only without a
/// `last_resort`: some programs send several.
///
/// Without a way to catch them, they end `program` as they always do, which a warning says.
pub fn cancel_token(program: &str, said: &'static str, last_resort: Option<LastResort>) -> Arc<CancelToken> {
    let token = Arc::new(CancelToken::default());
    let request = Request { token: token.clone(), said, last_resort };
    #[cfg(unix)]
    if let Err(error) = signals::catch(request.clone()) {
        complain(&format!("{program}: warning: requests to terminate cannot be caught ({error})\n"));
    }
    if let Err(error) = ctrlc::set_handler(move || request.made(STATUS_INTERRUPTED, true)) {
        complain(&format!("{program}: warning: Ctrl-C cannot be caught ({error})\n"));
    }
    token
}

/// What a request to stop leads to.
#[derive(Clone)]
struct Request {
    token: Arc<CancelToken>,
    said: &'static str,
    last_resort: Option<LastResort>,
}

impl Request {
    /// A request came that ends the program with `status`; an `impatient` one waits for nothing if it is not the first.
    fn made(&self, status: u8, impatient: bool) {
        if self.token.is_cancelled() {
            if impatient || self.last_resort.is_none() {
                std::process::exit(i32::from(status));
            }
            return;
        }
        STATUS.store(status, Ordering::Relaxed);
        self.token.cancel();
        if !self.said.is_empty() {
            complain(&format!("{}\n", self.said));
        }
        if let Some(last_resort) = self.last_resort {
            // On a thread of its own, so that a second Ctrl-C is heard.
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                last_resort();
                std::process::exit(i32::from(status));
            });
        }
    }
}
