//! Long work on a thread of its own, one task at a time, with progress for the page, until it is done or stopped.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use trueup::{CancelToken, Error, Progress, Result, StageContext};

use crate::denial::{Denial, Trouble};
use crate::studio::{Stage, Studio, Task, Work};

/// Begins a task, if nothing is being done; tiles, which nobody asked for, make way for anything else.
///
/// # Errors
/// If something is being done.
pub(crate) fn start(
    studio: &Arc<Studio>,
    task: Task,
    work: impl FnOnce(&Studio, &StageContext) -> Result<()> + Send + 'static,
) -> std::result::Result<(), Denial> {
    let cancel = Arc::new(CancelToken::default());
    let begun = Work { task, stages: Vec::new(), cancel: cancel.clone() };
    studio.change(|state| match &state.work {
        Some(busy) if busy.task != Task::Tiles || task == Task::Tiles => {
            Err(Denial::not_now("something else is being done", "Wait for it, or stop it."))
        }
        making_way => {
            if let Some(busy) = making_way {
                busy.cancel.cancel();
            }
            state.work = Some(begun);
            state.trouble = None;
            Ok(())
        }
    })?;
    let studio = studio.clone();
    std::thread::spawn(move || {
        let teller = Teller { studio: &studio, cancel: &cancel };
        let context = StageContext::new(&teller, &cancel);
        let outcome = catch_unwind(AssertUnwindSafe(|| studio.pool.install(|| work(&studio, &context))));
        let trouble = match outcome {
            Ok(Ok(()) | Err(Error::Cancelled)) => None,
            Ok(Err(error)) => Some(Trouble::from(error)),
            Err(_) => Some(Trouble {
                message: "the program made a mistake".to_owned(),
                hint: "The terminal says more. Report it as a defect.".to_owned(),
            }),
        };
        studio.change(|state| {
            // What made way has been replaced.
            if state.work.as_ref().is_some_and(|work| Arc::ptr_eq(&work.cancel, &cancel)) {
                state.work = None;
                state.trouble = trouble;
            }
        });
    });
    Ok(())
}

/// Asks what is being done to stop, or only the tiles.
pub(crate) fn stop(studio: &Studio, only: Option<Task>) {
    studio.change(|state| {
        if let Some(work) = state.work.as_ref().filter(|work| only.is_none_or(|task| work.task == task)) {
            work.cancel.cancel();
        }
    });
}

/// Tells the page of the progress of a task that is still wanted.
struct Teller<'a> {
    studio: &'a Studio,
    cancel: &'a Arc<CancelToken>,
}

impl Teller<'_> {
    fn tell(&self, stage: &str, tell: impl FnOnce(&mut Stage)) {
        self.studio.change(|state| {
            let own = state.work.as_mut().filter(|work| Arc::ptr_eq(&work.cancel, self.cancel));
            let Some(work) = own else { return };
            let position = work.stages.iter().position(|known| known.name == stage).unwrap_or_else(|| {
                work.stages.push(Stage { name: stage.to_owned(), done: 0, total: 0, finished: false });
                work.stages.len() - 1
            });
            tell(&mut work.stages[position]);
        });
    }
}

impl Progress for Teller<'_> {
    fn begin(&self, stage: &str, total: u64) {
        self.tell(stage, |stage| (stage.done, stage.total, stage.finished) = (0, total, false));
    }

    fn advance(&self, stage: &str, steps: u64) {
        self.tell(stage, |stage| stage.done += steps);
    }

    fn finish(&self, stage: &str) {
        self.tell(stage, |stage| stage.finished = true);
    }
}
