//! Long work beside the interpreter: on threads of its own, with progress, until Python is interrupted.

use std::collections::BTreeMap;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use trueup::{CancelToken, Progress, Result, StageContext, thread_pool};

use crate::errors::exception;

/// How often Python is asked whether it was interrupted: a person does not notice it, nor does the work.
const INTERRUPTIONS_EVERY: Duration = Duration::from_millis(50);

/// What work tells the thread that waits for it.
enum Event {
    Begin(String, u64),
    Advance(String, u64),
    Finish(String),
    /// Lines of JSON that are to be heard at once.
    Told(String),
}

/// Says something to the thread that waits, in lines of JSON.
pub(crate) type Teller<'a> = &'a (dyn Fn(String) + Sync);

/// Hands progress to the thread that waits. Nobody listens any more where that fails.
struct Telling(Sender<Event>);

impl Progress for Telling {
    fn begin(&self, stage: &str, total: u64) {
        drop(self.0.send(Event::Begin(stage.to_owned(), total)));
    }

    fn advance(&self, stage: &str, steps: u64) {
        drop(self.0.send(Event::Advance(stage.to_owned(), steps)));
    }

    fn finish(&self, stage: &str) {
        drop(self.0.send(Event::Finish(stage.to_owned())));
    }
}

/// Calls Python with the progress of every stage: its name, the steps done, and how many there are.
struct Listener<'py> {
    callback: Option<Bound<'py, PyAny>>,
    /// Called with what is told.
    told: Option<Bound<'py, PyAny>>,
    /// Done and total of every stage begun.
    stages: BTreeMap<String, (u64, u64)>,
}

impl Listener<'_> {
    fn hear(&mut self, event: Event) -> PyResult<()> {
        let event = match (event, &self.told) {
            (Event::Told(lines), Some(told)) => return told.call1((lines,)).map(drop),
            (event, _) => event,
        };
        let Some(callback) = &self.callback else { return Ok(()) };
        let (stage, done, total) = match event {
            Event::Begin(stage, total) => (stage, 0, total),
            Event::Advance(stage, steps) => {
                let (done, total) = self.stages.get(&stage).copied().unwrap_or_default();
                (stage, done + steps, total)
            }
            Event::Finish(stage) => {
                let (done, total) = self.stages.get(&stage).copied().unwrap_or_default();
                // A stage may know only at its end that there was less to do, or none.
                if done == total && total > 0 {
                    return Ok(());
                }
                (stage, total, total)
            }
            Event::Told(_) => return Ok(()),
        };
        callback.call1((&stage, done, total))?;
        self.stages.insert(stage, (done, total));
        Ok(())
    }
}

/// Where long work runs, and who hears of it.
pub(crate) struct Surroundings<'py> {
    /// Called with the progress, if it is not `None`.
    pub progress: Option<Bound<'py, PyAny>>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

/// What `work` comes to. Python goes on meanwhile: the interpreter is let go, and an interruption (Ctrl-C, or an
/// exception in the progress callback) stops the work at its next check and is raised.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    surroundings: Surroundings<'_>,
    work: impl FnOnce(&StageContext) -> Result<T> + Send,
) -> PyResult<T> {
    run_telling(py, surroundings, None, |context, _| work(context))
}

/// The same, where the work also says something as it goes on, which `told` is called with.
pub(crate) fn run_telling<'py, T: Send>(
    py: Python<'py>,
    surroundings: Surroundings<'py>,
    told: Option<Bound<'py, PyAny>>,
    work: impl FnOnce(&StageContext, Teller<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let Surroundings { progress, threads } = surroundings;
    let cancel = CancelToken::default();
    let (sender, receiver) = mpsc::channel();
    let receiver = Mutex::new(receiver);
    std::thread::scope(|scope| {
        let cancelled = &cancel;
        let worker = scope.spawn(move || {
            // Dropped when the work is over, which the receiver notices at once.
            let telling = Telling(sender);
            let context = StageContext::new(&telling, cancelled);
            let tell = |lines| drop(telling.0.send(Event::Told(lines)));
            thread_pool(threads)?.install(|| work(&context, &tell))
        });
        let mut listener = Listener { callback: progress, told, stages: BTreeMap::new() };
        let interruption = wait(py, &receiver, &mut listener, &cancel);
        let outcome = py.detach(|| worker.join()).unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        match interruption {
            Some(interruption) => Err(interruption),
            None => outcome.map_err(|error| exception(py, error)),
        }
    })
}

/// Waits until nobody sends any more; returns the exception that interrupted, after which the work is asked to stop and
/// no longer listened to.
fn wait(
    py: Python<'_>,
    events: &Mutex<Receiver<Event>>,
    listener: &mut Listener,
    cancel: &CancelToken,
) -> Option<PyErr> {
    let mut interruption = None;
    loop {
        // Nobody else takes the lock: it only tells the compiler so.
        let next = || events.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(INTERRUPTIONS_EVERY);
        let received = py.detach(next);
        let heard = match received {
            Err(RecvTimeoutError::Disconnected) => return interruption,
            _ if interruption.is_some() => continue,
            Ok(event) => listener.hear(event).and_then(|()| py.check_signals()),
            Err(RecvTimeoutError::Timeout) => py.check_signals(),
        };
        if let Err(error) = heard {
            cancel.cancel();
            interruption = Some(error);
        }
    }
}
