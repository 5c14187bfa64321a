//! Wishes in the order they came, so that they can be undone.

use super::wishes::Wishes;
use crate::limits::MAX_STEPS;

/// What was wished so far, and where in it we are.
#[derive(Debug)]
pub(crate) struct History {
    /// At least one.
    steps: Vec<Wishes>,
    now: usize,
}

impl Default for History {
    fn default() -> Self {
        Self::beginning_with(Wishes::default())
    }
}

impl History {
    /// A history of one step.
    pub(crate) fn beginning_with(wishes: Wishes) -> Self {
        Self { steps: vec![wishes], now: 0 }
    }

    /// What is wished now.
    pub(crate) fn now(&self) -> &Wishes {
        &self.steps[self.now]
    }

    /// Goes on to other wishes; those that were undone are gone. Of more than [`MAX_STEPS`] steps, the first are
    /// forgotten.
    pub(crate) fn go_on(&mut self, wishes: Wishes) {
        if wishes == *self.now() {
            return;
        }
        self.steps.truncate(self.now + 1);
        self.steps.push(wishes);
        let forgotten = self.steps.len().saturating_sub(MAX_STEPS);
        self.steps.drain(..forgotten);
        self.now = self.steps.len() - 1;
    }

    /// One step back, if there is one.
    pub(crate) fn undo(&mut self) {
        self.now = self.now.saturating_sub(1);
    }

    /// One step forth, if one was undone.
    pub(crate) fn redo(&mut self) {
        self.now = (self.now + 1).min(self.steps.len() - 1);
    }

    pub(crate) fn can_undo(&self) -> bool {
        self.now > 0
    }

    pub(crate) fn can_redo(&self) -> bool {
        self.now + 1 < self.steps.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(number: usize) -> Wishes {
        Wishes { left_out: [number].into(), ..Wishes::default() }
    }

    #[test]
    fn what_was_undone_comes_back_until_something_else_is_wished() {
        let mut history = History::default();
        assert!(!history.can_undo() && !history.can_redo());
        (0..3).for_each(|number| history.go_on(step(number)));
        history.go_on(step(2));
        history.undo();
        history.undo();
        assert_eq!((history.now(), history.can_redo()), (&step(0), true));
        history.redo();
        assert_eq!(*history.now(), step(1));
        history.go_on(step(9));
        assert!(history.can_undo() && !history.can_redo());
        (0..9).for_each(|_| history.undo());
        assert_eq!(*history.now(), Wishes::default());
    }

    #[test]
    fn the_oldest_steps_are_forgotten() {
        let mut history = History::default();
        (0..2 * MAX_STEPS).for_each(|number| history.go_on(step(number)));
        (0..2 * MAX_STEPS).for_each(|_| history.undo());
        assert_eq!(*history.now(), step(MAX_STEPS));
    }
}
