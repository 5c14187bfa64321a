//! What trueup's commands share at the terminal: how they are asked to stop, and how they end where memory is refused.
//! The first Ctrl-C asks the work to stop, the second ends the program; so do, on Unix, the requests to terminate and
//! the end of the terminal.

mod complaint;
mod memory;
mod request;
#[cfg(unix)]
mod signals;

use std::sync::Arc;

use trueup_core::context::CancelToken;

use request::StopRequest;

pub use complaint::complain;
pub use memory::{NotingAllocator, WithoutMemory, end_without_memory, give_back};
pub use request::{Ending, LastResort, status_of_stopping};

/// A token that the first request to stop cancels, to be asked for once in a program; `said` is then printed on
/// standard error, unless it is empty. `ending` says how the program ends then.
///
/// Requests are Ctrl-C and, on Unix, SIGTERM (`kill`, `timeout`, the system's end) and SIGHUP (the terminal's end),
/// unless it is ignored, as `nohup` has it. A second Ctrl-C ends the program at once. A second of the others does so
/// only where the program might not end soon without it ([`Ending::WhenStopped`]): some programs send several.
///
/// Without a way to catch them, they end `program` as they always do, which a warning says.
pub fn cancel_token(program: &str, said: &'static str, ending: Ending) -> Arc<CancelToken> {
    let token = Arc::new(CancelToken::default());
    let request = StopRequest { token: token.clone(), said, ending };
    #[cfg(unix)]
    if let Err(error) = signals::catch(request.clone()) {
        complain(&format!("{program}: warning: requests to terminate cannot be caught ({error})\n"));
    }
    if let Err(error) = ctrlc::set_handler(move || request.made(request::STATUS_INTERRUPTED, true)) {
        complain(&format!("{program}: warning: Ctrl-C cannot be caught ({error})\n"));
    }
    token
}
