//! What is known while the trials of one set run, so that nothing is done twice.

use std::collections::BTreeMap;

use trueup::{
    CancelToken, Error, Inputs, MatchedPhotographs, PhotographCache, Reference, Result, Silent, StageContext, Stitcher,
};

use crate::measure;
use crate::random_directions::with_random_directions;
use crate::sets::{ReadySet, central};
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
    /// Set by requests to stop.
    pub cancel: &'a CancelToken,
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
            let found = self.matches_of(trial);
            self.matched = Some((wanted, found));
        }
        let outcome = match &self.matched {
            Some((_, Ok(photographs))) => self.align(photographs, trial),
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

    /// Measures and matches the photographs of a trial.
    fn matches_of(&self, trial: &Trial) -> Result<MatchedPhotographs> {
        let unseeded = Trial { seed: 0, overrides: trial.matching_overrides(), ..trial.clone() };
        let options = unseeded.options()?;
        let context = StageContext::new(&Silent, self.cancel);
        Stitcher::new(&options, &context)
            .with_cache(self.cache.as_ref())
            .match_photographs(&inputs_of(self.ready, trial))
            .map(MatchedPhotographs::remembering)
    }

    /// Aligns and measures them.
    fn align(&self, photographs: &MatchedPhotographs, trial: &Trial) -> Result<Outcome> {
        let options = trial.options()?;
        let context = StageContext::new(&Silent, self.cancel).seeded(trial.seed);
        let (stitcher, inputs) = (Stitcher::new(&options, &context), inputs_of(self.ready, trial));
        let mut aligned = stitcher.align_matched(photographs, &inputs)?;
        if let Some(found) = aligned.alignments.first().filter(|_| trial.random_directions > 0.0) {
            let directions = with_random_directions(found.directions(), trial.random_directions, &context);
            aligned = stitcher.align_along(photographs, &inputs, &directions)?;
        }
        let first = aligned.alignments.into_iter().next();
        let project = first.ok_or_else(|| Error::input(&trial.set, "nothing was aligned", "Look at the set."))?.project;
        let mut measures = measure::figures(&project, self.ready.truth.as_ref())?;
        if trial.pixels {
            measures.extend(measure::pixel_figures(&project, &context)?);
        }
        Ok(Outcome { measures, note: project.manhattan.failed_clause.unwrap_or_default() })
    }
}

/// The photographs of a set that a trial is of, and its reference.
pub(crate) fn inputs_of(ready: &ReadySet, trial: &Trial) -> Inputs {
    let count = trial.photograph_count.unwrap_or(ready.photographs.len());
    let around = ready.truth.as_ref().filter(|_| trial.central).and_then(|truth| central(truth, count));
    if let Some((middle, around)) = around {
        let mut inputs = Inputs::new(around.iter().map(|&position| ready.photographs[position].clone()));
        inputs.reference = Reference::Named(ready.photographs[middle].clone());
        return inputs;
    }
    let mut inputs = Inputs::new(ready.photographs.iter().take(count).cloned());
    if let Some(photograph) = trial.reference.and_then(|reference| ready.photographs.get(reference)) {
        inputs.reference = Reference::Named(photograph.clone());
    }
    inputs
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
