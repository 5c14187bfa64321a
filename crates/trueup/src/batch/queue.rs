//! Which set is worked at next.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use trueup_core::{Result, StageContext};

/// How long to wait before looking again at sets that other programs work at.
const LOOK_AGAIN: Duration = Duration::from_secs(1);
/// How long a request to stop may go unheard meanwhile.
const HEARD_WITHIN: Duration = Duration::from_millis(50);

/// The sets that are not known to be done, by their positions; shared by all that work at them.
#[derive(Debug, Default)]
pub(super) struct Queue(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    next: VecDeque<usize>,
    /// Those that other programs work at. These may be killed, so that they are looked at again.
    elsewhere: Vec<usize>,
    /// Whether nothing more is to be begun.
    is_closed: bool,
}

impl Queue {
    /// A queue of these sets, in their order.
    pub(super) fn new(sets: impl IntoIterator<Item = usize>) -> Self {
        Self(Mutex::new(Waiting { next: sets.into_iter().collect(), ..Waiting::default() }))
    }

    /// The next set; waits where only sets are left that other programs work at. `None` when there is nothing more to
    /// do.
    ///
    /// # Errors
    /// [`trueup_core::Error::Cancelled`].
    pub(super) fn next(&self, context: &StageContext) -> Result<Option<usize>> {
        loop {
            context.check_cancelled()?;
            {
                let mut waiting = self.waiting();
                if waiting.is_closed {
                    return Ok(None);
                }
                if let Some(set) = waiting.next.pop_front() {
                    return Ok(Some(set));
                }
                if waiting.elsewhere.is_empty() {
                    return Ok(None);
                }
            }
            let began = Instant::now();
            while began.elapsed() < LOOK_AGAIN {
                context.check_cancelled()?;
                std::thread::sleep(HEARD_WITHIN);
            }
            let mut waiting = self.waiting();
            let again = std::mem::take(&mut waiting.elsewhere);
            waiting.next.extend(again);
        }
    }

    /// Puts a set back that another program works at.
    pub(super) fn is_elsewhere(&self, set: usize) {
        self.waiting().elsewhere.push(set);
    }

    /// Lets nothing more be begun.
    pub(super) fn close(&self) {
        self.waiting().is_closed = true;
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::Error;
    use trueup_core::context::{CancelToken, Silent};

    use super::*;

    #[test]
    fn sets_of_others_come_last_and_again_until_they_are_done() {
        let queue = Queue::new([4, 2, 7]);
        let context = StageContext::default();
        let next = || queue.next(&context).expect("not cancelled");
        assert_eq!(next(), Some(4));
        queue.is_elsewhere(4);
        assert_eq!((next(), next()), (Some(2), Some(7)));
        // Twice worked at elsewhere, then not any more.
        assert_eq!(next(), Some(4));
        queue.is_elsewhere(4);
        assert_eq!((next(), next()), (Some(4), None));
    }

    #[test]
    fn a_closed_queue_and_a_stopped_one_hand_out_nothing() {
        let (silent, token) = (Silent, CancelToken::default());
        let context = StageContext::new(&silent, &token);
        let queue = Queue::new([1, 2]);
        assert!(matches!(queue.next(&context), Ok(Some(1))));
        queue.close();
        assert!(matches!(queue.next(&context), Ok(None)));
        let waiting = Queue::new([]);
        waiting.is_elsewhere(3);
        token.cancel();
        assert!(matches!(waiting.next(&context), Err(Error::Cancelled)));
    }
}
