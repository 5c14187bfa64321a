//! Progress bars on standard error.

use std::sync::{Mutex, MutexGuard, PoisonError};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use trueup::{Progress, StageContext};

use crate::stopping::cancel_token;

const TEMPLATE: &str = "{prefix:16} {bar:32} {pos:>6} of {len:<6} {elapsed}";

/// What `work` comes to, with its progress on standard error, or with none of it if `quiet`, until the first request to
/// stop. The bars are gone when it returns.
pub(crate) fn shown<T>(quiet: bool, work: impl FnOnce(&StageContext) -> T) -> T {
    let cancel = cancel_token();
    let bars = Bars::new(quiet);
    let outcome = work(&StageContext::new(&bars, &cancel));
    bars.clear();
    outcome
}

/// A bar per stage with its counts. Draws nothing unless standard error is a terminal.
struct Bars {
    drawn: MultiProgress,
    /// The stages begun, in that order.
    stages: Mutex<Vec<(String, ProgressBar)>>,
}

impl Bars {
    /// Bars on standard error; `quiet` ones draw nothing at all.
    fn new(quiet: bool) -> Self {
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        Self { drawn: MultiProgress::with_draw_target(target), stages: Mutex::default() }
    }

    /// Takes every bar from the screen, to make room for the summary.
    fn clear(&self) {
        for (_, bar) in self.stages().drain(..) {
            bar.finish_and_clear();
        }
    }

    fn stages(&self) -> MutexGuard<'_, Vec<(String, ProgressBar)>> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with(&self, stage: &str, act: impl Fn(&ProgressBar)) {
        if let Some((_, bar)) = self.stages().iter().find(|(name, _)| name == stage) {
            act(bar);
        }
    }
}

impl Progress for Bars {
    fn begin(&self, stage: &str, total: u64) {
        // What the stages before needed.
        trueup_terminal::give_back();
        let mut stages = self.stages();
        // A stage that ran for an earlier panorama begins again: a comparison would fill the screen with bars.
        if let Some((_, bar)) = stages.iter().find(|(name, _)| name == stage) {
            bar.set_length(total);
            bar.reset();
            return;
        }
        let style = ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = self.drawn.add(ProgressBar::new(total).with_style(style).with_prefix(stage.to_owned()));
        stages.push((stage.to_owned(), bar));
    }

    fn advance(&self, stage: &str, steps: u64) {
        self.with(stage, |bar| bar.inc(steps));
    }

    fn finish(&self, stage: &str) {
        self.with(stage, ProgressBar::finish);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_that_runs_twice_has_one_bar_and_steps_of_unknown_stages_are_ignored() {
        let bars = Bars::new(true);
        bars.advance("nothing", 1);
        for _ in 0..2 {
            bars.begin("render", 3);
            bars.advance("render", 2);
            bars.finish("render");
        }
        assert_eq!(bars.stages().len(), 1);
        bars.with("render", |bar| assert_eq!((bar.position(), bar.is_finished()), (3, true)));
        bars.clear();
        assert!(bars.stages().is_empty());
    }
}
