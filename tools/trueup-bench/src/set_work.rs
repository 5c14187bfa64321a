//! What is known while the trials of one set run, so that nothing is done twice.

use std::collections::BTreeMap;

use trueup::{Error, MatchedPhotographs, PhotographCache, Result};

use crate::runner::Runner;
use crate::sets::ReadySet;
use crate::trial::{Row, Trial};

/// What came of one piece of work.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    /// The figures by name.
    pub measures: BTreeMap<String, f64>,
    /// Why vanishing points were not believed, or what went wrong; often empty.
    pub note: String,
}

/// What decides whether two trials can share their matches.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct MatchingKey {
    photograph_count: Option<usize>,
    central: bool,
    overrides: Vec<String>,
}

impl MatchingKey {
    /// The key of a trial.
    pub(crate) fn new(trial: &Trial) -> Self {
        Self { photograph_count: trial.photograph_count, central: trial.central, overrides: trial.matching_overrides() }
    }
}

/// What is known while the trials of one set run.
#[derive(Debug)]
pub(crate) struct SetWork<'a> {
    /// What is the same for all sets.
    pub runner: &'a Runner<'a>,
    /// The set.
    pub ready: &'a ReadySet,
    /// The matches that were made last.
    pub matched: Option<(MatchingKey, Result<MatchedPhotographs>)>,
    /// What came of each piece of work so far ([`Trial::work`]), of whichever experiment.
    pub known: BTreeMap<String, Outcome>,
    /// Measured photographs and matched pairs of sets that are matched in several parts.
    pub cache: Option<PhotographCache>,
}

impl SetWork<'_> {
    /// What comes of a trial: known from another one, or found out.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and options that cannot be; everything else is an outcome.
    pub(crate) fn outcome(&mut self, trial: &Trial) -> Result<Outcome> {
        let known = self.known.get(&trial.work()?);
        if let Some(known) = known.filter(|_| !trial.pixels) {
            return Ok(known.clone());
        }
        let wanted = MatchingKey::new(trial);
        if self.matched.as_ref().is_none_or(|(known, _)| *known != wanted) {
            // The old one goes before the new one is made: both together may be large.
            drop(self.matched.take());
            let found = self.runner.match_set(self.ready, trial, self.cache.as_ref());
            self.matched = Some((wanted, found));
        }
        let outcome = match &self.matched {
            Some((_, Ok(photographs))) => self.runner.align(self.ready, photographs, trial),
            Some((_, Err(error))) => Err(repeated(error)),
            None => Err(Error::Cancelled),
        };
        match outcome {
            Ok(outcome) => Ok(outcome),
            Err(error @ (Error::Cancelled | Error::Options(_))) => Err(error),
            Err(error @ Error::NotApplicable { .. }) => Ok(without_figures("refused", &error)),
            Err(error) => Ok(without_figures("failed", &error)),
        }
    }

    /// Keeps what came of a trial for those that come to the same.
    pub(crate) fn remember(&mut self, trial: &Trial, row: &Row) -> Result<()> {
        let outcome = || Outcome { measures: row.measures.clone(), note: row.note.clone() };
        self.known.entry(trial.work()?).or_insert_with(outcome);
        Ok(())
    }
}

/// What became of a run that has no figures.
fn without_figures(what: &str, error: &Error) -> Outcome {
    Outcome { measures: BTreeMap::from([(what.to_owned(), 1.0)]), note: error.to_string() }
}

/// The same error once more, for the next trial that shares the failed matching.
fn repeated(error: &Error) -> Error {
    match error {
        Error::Cancelled => Error::Cancelled,
        other => Error::input("matching", other.to_string().trim_end_matches('.'), ""),
    }
}
