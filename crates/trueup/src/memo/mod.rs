//! What was made once and need not be made again: one memo for every phase.
//!
//! A result is known by its [`Key`]: of what it is, what it was made from, and the options of its phase and of those
//! before it. Nothing else may decide it, and nothing can be forgotten: [`Memo::run`] hands the work just these, and
//! the work is a function that catches nothing else.
//!
//! Results are kept on the disk ([`PhotographCache`]) between runs, or in memory for experiments that do the same work
//! many times. They decide how long the work takes, never what comes of it.

mod folder;
mod key;
mod kind;
mod memory;

use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;
use trueup_core::diagnostics::Reported;
use trueup_core::{Result, StageContext};

pub use folder::{CacheUse, PhotographCache};
pub(crate) use folder::{checked_content, entry_with_content};
pub(crate) use key::{Key, KeyMaker, PROGRAM};
pub(crate) use kind::{GEOMETRY, Kind, LIGHT, LIKENESS, MEASURED, OVERLAPS, PAIR, PARALLAX, STACKS};
pub(crate) use memory::MemoryStore;

/// Where results are kept; nowhere by default.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Memo<'a> {
    pub disk: Option<&'a PhotographCache>,
    pub memory: Option<&'a MemoryStore>,
}

impl Memo<'_> {
    /// The key of a result of this kind, made from `input` by `options`; `None` where nothing is kept on the disk, or
    /// the input cannot be known again.
    pub(crate) fn key(&self, kind: Kind, input: Option<KeyMaker>, options: &impl Serialize) -> Option<Key> {
        self.disk?;
        Some(input?.part(&kind.0).part(options).finish())
    }

    /// The result of this key, if it is kept on the disk.
    pub(crate) fn load<T: DeserializeOwned>(&self, kind: Kind, key: Option<&Key>) -> Option<T> {
        self.disk?.load(kind, key?)
    }

    /// Keeps a result on the disk.
    pub(crate) fn store<T: Serialize>(&self, kind: Kind, key: Option<&Key>, result: &T) {
        if let (Some(disk), Some(key)) = (self.disk, key) {
            disk.store(kind, key, result);
        }
    }

    /// The result of this key that the disk holds, if it `is_whole`; else what `make` comes to, which is kept.
    ///
    /// # Errors
    /// Those of `make`.
    pub(crate) fn found_or_made<T: Serialize + DeserializeOwned>(
        &self,
        kind: Kind,
        key: Option<&Key>,
        is_whole: impl Fn(&T) -> bool,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        if let Some(known) = self.load(kind, key).filter(is_whole) {
            return Ok(known);
        }
        let made = make()?;
        self.store(kind, key, &made);
        Ok(made)
    }

    /// What `work` makes of `input` by `options`, with its findings, unless the disk holds it under `key`, which must
    /// say all that decides `input` and `options`.
    ///
    /// # Errors
    /// Those of `work`.
    pub(crate) fn run<I: ?Sized, O: ?Sized, T: Serialize + DeserializeOwned>(
        &self,
        kind: Kind,
        key: Option<&Key>,
        input: &I,
        options: &O,
        work: fn(&I, &O, &StageContext) -> Result<T>,
        context: &StageContext,
    ) -> Result<Reported<T>> {
        match self.recall(kind, key) {
            Some(known) => Ok(known),
            None => self.make(kind, key, input, options, work, context),
        }
    }

    /// The result that the disk holds under `key`, with its findings, as [`Self::run`] keeps it.
    pub(crate) fn recall<T: DeserializeOwned>(&self, kind: Kind, key: Option<&Key>) -> Option<Reported<T>> {
        let mut known = self.load::<Reported<T>>(kind, key)?;
        // Times are those of this run.
        known.seconds.clear();
        Some(known)
    }

    /// [`Self::run`] without looking for what is known already.
    ///
    /// # Errors
    /// Those of `work`.
    pub(crate) fn make<I: ?Sized, O: ?Sized, T: Serialize>(
        &self,
        kind: Kind,
        key: Option<&Key>,
        input: &I,
        options: &O,
        work: fn(&I, &O, &StageContext) -> Result<T>,
        context: &StageContext,
    ) -> Result<Reported<T>> {
        let made = context.gather(|context| work(input, options, context))?;
        self.store(kind, key, &made);
        Ok(made)
    }

    /// The same in memory, where one is at hand; the seconds that the work took when it was done are told each time.
    /// `from` says what decides the input among all that is done with this memory.
    ///
    /// # Errors
    /// Those of `work`.
    pub(crate) fn run_in_memory<I: ?Sized, O: Serialize + ?Sized, T: Clone + Send + Sync + 'static>(
        &self,
        kind: Kind,
        from: &impl Serialize,
        input: &I,
        options: &O,
        work: fn(&I, &O, &StageContext) -> Result<T>,
        context: &StageContext,
    ) -> Result<Arc<Reported<T>>> {
        let make = || context.gather(|context| work(input, options, context)).map(Arc::new);
        let Some(memory) = self.memory else { return make() };
        let key = KeyMaker::new().part(&kind.0).part(&context.seed()).part(from).part(options).finish();
        memory.recall(key, make)
    }
}
