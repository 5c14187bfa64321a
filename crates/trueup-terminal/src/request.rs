//! A request to stop: what it leads to, and the exit status that tells of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use trueup_core::context::CancelToken;

use crate::complaint::complain;

/// 128 + SIGINT, as shells count a program that Ctrl-C ended.
pub(crate) const STATUS_INTERRUPTED: u8 = 130;

/// The exit status by the request to stop that came first.
static STATUS: AtomicU8 = AtomicU8::new(STATUS_INTERRUPTED);

/// How long work that was asked to stop may take to do so, where there is a [`LastResort`]. Decoders and solvers of
/// other people's making look at no token; people press Ctrl-C again after a second.
const PATIENCE: Duration = Duration::from_millis(700);

/// What is to be done before the program ends without waiting for its work any longer.
pub type LastResort = fn();

/// How a program ends after the first request to stop.
#[derive(Debug, Clone, Copy)]
pub enum Ending {
    /// When its work has stopped, however long that takes. A second request of any kind ends it at once.
    WhenStopped,
    /// By itself within a second, whatever its work does, and with something to clean up first. A second Ctrl-C ends it
    /// at once; a second request of another kind changes nothing.
    Soon,
    /// When its work has stopped, or by the last resort within a second. A second request is as for [`Self::Soon`].
    By(LastResort),
}

/// The exit status of a program that stops on request, as shells count them: 130 for Ctrl-C, 143 where it was asked to
/// terminate, 129 where its terminal is gone.
pub fn status_of_stopping() -> u8 {
    STATUS.load(Ordering::Relaxed)
}

/// What a request to stop leads to.
#[derive(Clone)]
pub(crate) struct StopRequest {
    pub(crate) token: Arc<CancelToken>,
    pub(crate) said: &'static str,
    pub(crate) ending: Ending,
}

impl StopRequest {
    /// A request came that ends the program with `status`; an `impatient` one waits for nothing if it is not the first.
    pub(crate) fn made(&self, status: u8, impatient: bool) {
        if self.token.is_cancelled() {
            if impatient || matches!(self.ending, Ending::WhenStopped) {
                std::process::exit(i32::from(status));
            }
            return;
        }
        STATUS.store(status, Ordering::Relaxed);
        self.token.cancel();
        if !self.said.is_empty() {
            complain(&format!("{}\n", self.said));
        }
        if let Ending::By(last_resort) = self.ending {
            // On a thread of its own, so that a second Ctrl-C is heard.
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                last_resort();
                std::process::exit(i32::from(status));
            });
        }
    }
}
