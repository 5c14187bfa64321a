//! What every stage receives beside its input and options: progress, cancellation, seed and a sink for findings and
//! times.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::diagnostics::{Diagnostic, Reported, add_seconds};
use crate::error::{Error, Result};

/// Receives the progress of long work. Called from any thread.
pub trait Progress: Send + Sync {
    /// `stage` begins; it will report `total` steps.
    fn begin(&self, stage: &str, total: u64);
    /// `steps` more steps of `stage` are done.
    fn advance(&self, stage: &str, steps: u64);
    /// `stage` is over.
    fn finish(&self, stage: &str);
}

/// A [`Progress`] that tells nobody.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _stage: &str, _steps: u64) {}
    fn finish(&self, _stage: &str) {}
}

/// Set from anywhere (a signal handler, another thread) to stop the work at its next check.
#[derive(Debug, Default)]
pub struct CancelToken(AtomicBool);

impl CancelToken {
    /// Asks the work to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What stages tell beside their products.
#[derive(Debug, Default)]
struct Sink {
    findings: Vec<Diagnostic>,
    seconds: BTreeMap<String, f64>,
}

/// What a stage may use of the world around it.
///
/// Parallel work runs on the thread pool that is current when the stage is called; a stage starts no threads.
pub struct StageContext<'a> {
    progress: &'a dyn Progress,
    cancel: &'a CancelToken,
    seed: u64,
    sink: Mutex<Sink>,
}

impl std::fmt::Debug for StageContext<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("StageContext").field("seed", &self.seed).finish_non_exhaustive()
    }
}

static SILENT: Silent = Silent;
static NEVER: CancelToken = CancelToken(AtomicBool::new(false));

impl Default for StageContext<'_> {
    /// Silent, never cancelled, seed 0: for tests and small programs.
    fn default() -> Self {
        Self::new(&SILENT, &NEVER)
    }
}

impl<'a> StageContext<'a> {
    /// A context that reports to `progress` and stops on `cancel`; random choices derive from 0, see [`Self::seeded`].
    pub fn new(progress: &'a dyn Progress, cancel: &'a CancelToken) -> Self {
        Self { progress, cancel, seed: 0, sink: Mutex::default() }
    }

    /// The same cancellation and seed, for a part of the work whose progress is told by the whole. Findings are its
    /// own.
    pub fn without_progress(&self) -> StageContext<'a> {
        Self::new(&SILENT, self.cancel).seeded(self.seed)
    }

    /// Where progress goes.
    pub fn progress(&self) -> &dyn Progress {
        self.progress
    }

    /// Returns [`Error::Cancelled`] once a stop was asked for. Long loops call it at least every tenth of a second.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn check_cancelled(&self) -> Result<()> {
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// The same progress and cancellation, with random choices from `seed`. Findings are its own.
    pub fn seeded(&self, seed: u64) -> StageContext<'a> {
        Self { seed, ..Self::new(self.progress, self.cancel) }
    }

    /// The number from which every random choice derives.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// A generator for one subject of one stage (an image's or a pair's index), so that results depend neither on the
    /// order of the work nor on the number of threads.
    pub fn generator(&self, stage: &str, subject: u64) -> ChaCha8Rng {
        // FNV-1a over stage and subject, mixed with the run's seed; ChaCha expands it.
        const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
        const PRIME: u64 = 0x0000_0100_0000_01b3;
        let bytes = stage.bytes().chain(subject.to_le_bytes()).chain(self.seed.to_le_bytes());
        let hash = bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
        ChaCha8Rng::seed_from_u64(hash)
    }

    /// Records a finding. Stages call this from their sequential part only, so that the order is always the same.
    pub fn report(&self, diagnostic: Diagnostic) {
        self.sink().findings.push(diagnostic);
    }

    /// The findings recorded so far, in order.
    pub fn findings(&self) -> Vec<Diagnostic> {
        self.sink().findings.clone()
    }

    /// Wall seconds recorded so far, by the name of the stage that took them.
    pub fn seconds(&self) -> BTreeMap<String, f64> {
        self.sink().seconds.clone()
    }

    /// Runs `work` and records its wall time as that of `stage`.
    pub fn time<T>(&self, stage: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.spent(stage, start.elapsed());
        result
    }

    /// [`Self::time`] for a stage that is one step, and is reported as such.
    pub fn in_one_step<T>(&self, stage: &str, work: impl FnOnce() -> T) -> T {
        self.progress.begin(stage, 1);
        let result = self.time(stage, work);
        self.progress.advance(stage, 1);
        self.progress.finish(stage);
        result
    }

    /// Records wall time that `stage` took.
    pub fn spent(&self, stage: &str, duration: Duration) {
        *self.sink().seconds.entry(stage.to_owned()).or_default() += duration.as_secs_f64();
    }

    /// Records `wall` time as that of stages that ran interleaved, in proportion to the time that each was busy on any
    /// thread.
    pub fn share(&self, wall: Duration, busy: &[(&str, Duration)]) {
        let total: f64 = busy.iter().map(|(_, duration)| duration.as_secs_f64()).sum();
        for (stage, duration) in busy {
            let part = if total > 0.0 { duration.as_secs_f64() / total } else { 0.0 };
            self.spent(stage, wall.mul_f64(part));
        }
    }

    fn sink(&self) -> MutexGuard<'_, Sink> {
        self.sink.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` with a sink of its own, and hands out what it found there beside its product. Work done in parallel
    /// gathers its findings item by item, so that [`Self::absorb`] can put them into the order of the items.
    ///
    /// # Errors
    /// Those of `work`.
    pub fn gather<T>(&self, work: impl FnOnce(&StageContext) -> Result<T>) -> Result<Reported<T>> {
        let nested = self.seeded(self.seed);
        let value = work(&nested)?;
        let Sink { findings, seconds } = nested.sink.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Reported { value, findings, seconds })
    }

    /// Records the findings of a part of the work, and hands out its product.
    pub fn absorb<T>(&self, part: Reported<T>) -> T {
        let mut sink = self.sink();
        sink.findings.extend(part.findings);
        add_seconds(&mut sink.seconds, part.seconds);
        part.value
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;
    use crate::diagnostics::Subject;

    #[test]
    fn generators_differ_by_subject_and_repeat() {
        let context = StageContext::default();
        let draw = |stage: &str, subject| context.generator(stage, subject).next_u64();
        assert_eq!(draw("matching", 3), draw("matching", 3));
        assert_ne!(draw("matching", 3), draw("matching", 4));
        assert_ne!(draw("matching", 3), draw("vanishing", 3));
    }

    #[test]
    fn parts_of_the_work_gather_findings_of_their_own() {
        let context = StageContext::default();
        let note = |code: &str| Diagnostic::note(code, Subject::stage("test"), "", "");
        context.report(note("first"));
        let part = |code: &'static str| {
            let told = context.gather(|nested| {
                nested.report(note(code));
                Ok(())
            });
            told.expect("a part")
        };
        let (second, third) = (part("second"), part("third"));
        assert_eq!(context.findings().len(), 1, "nested findings stay where they were gathered");
        context.absorb(third);
        context.absorb(second);
        let codes: Vec<String> = context.findings().into_iter().map(|finding| finding.code).collect();
        assert_eq!(codes, ["first", "third", "second"]);
        let failed: Result<Reported<()>> = context.gather(|_| Err(Error::Cancelled));
        assert!(matches!(failed, Err(Error::Cancelled)));
    }

    #[test]
    fn cancelled_context_says_so() {
        let token = CancelToken::default();
        let context = StageContext::new(&SILENT, &token);
        assert!(context.check_cancelled().is_ok());
        token.cancel();
        assert!(matches!(context.check_cancelled(), Err(Error::Cancelled)));
    }
}
