//! How far the work is, on standard error: a bar on a terminal, elsewhere a line per set and now and then one between.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Counts steps of known number.
#[derive(Debug)]
pub(crate) struct Tracker {
    bar: ProgressBar,
    on_terminal: bool,
    title: String,
    done: AtomicU64,
    total: u64,
    start: Instant,
    /// Seconds from the start to the last line.
    told: AtomicU64,
}

/// Seconds without a line after which one says how far the work is.
const SILENCE_SECONDS: u64 = 30;

impl Tracker {
    /// A tracker of `total` steps; a quiet one prints nothing.
    pub(crate) fn new(title: &str, total: u64, quiet: bool) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let target = if on_terminal && !quiet { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let style = ProgressStyle::with_template("{prefix:12} {bar:32} {pos:>6} of {len:<6} {elapsed} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(total), target).with_style(style).with_prefix(title.to_owned());
        let lines = !on_terminal && !quiet;
        Self {
            bar,
            on_terminal: !lines,
            title: title.to_owned(),
            done: AtomicU64::new(0),
            total,
            start: Instant::now(),
            told: AtomicU64::new(0),
        }
    }

    /// Says what is being worked on.
    pub(crate) fn working_on(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// `steps` more are done.
    pub(crate) fn advance(&self, steps: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
        self.bar.inc(steps);
        let (now, last) = (self.start.elapsed().as_secs(), self.told.load(Ordering::Relaxed));
        let silent = !self.on_terminal && now >= last + SILENCE_SECONDS;
        // Of several workers, one says it.
        if silent && self.told.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            self.tell("");
        }
    }

    /// A part of the work is over: where there is no bar, a line says so.
    pub(crate) fn finished(&self, what: &str) {
        if !self.on_terminal {
            self.told.store(self.start.elapsed().as_secs(), Ordering::Relaxed);
            self.tell(&format!(" ({what})"));
        }
    }

    fn tell(&self, what: &str) {
        let (done, seconds) = (self.done.load(Ordering::Relaxed), self.start.elapsed().as_secs_f64());
        eprintln!("{}: {done} of {} after {seconds:.0} s{what}", self.title, self.total);
    }

    /// All is over.
    pub(crate) fn close(&self) {
        self.bar.finish_and_clear();
    }
}
