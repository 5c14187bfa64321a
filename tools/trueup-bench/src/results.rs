//! The rows that a report is made of, and how experiments ask for them.

use crate::sets::{Catalogue, SetSpec};
use crate::trial::Row;

/// What was run and what came of it.
#[derive(Debug)]
pub(crate) struct Results<'a> {
    /// The sets.
    pub catalogue: &'a Catalogue,
    /// The results, in the order of the trials.
    pub rows: Vec<Row>,
}

impl Results<'_> {
    /// The rows of an experiment.
    pub(crate) fn of<'a>(&'a self, experiment: &'a str) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.key.experiment == experiment)
    }

    /// A figure of one set under one variant: one value per seed, reference and number of photographs that gave one.
    pub(crate) fn values(&self, experiment: &str, set: &str, variant: &str, measure: &str) -> Vec<f64> {
        self.of(experiment)
            .filter(|row| row.key.set == set && row.key.variant == variant)
            .filter_map(|row| row.measure(measure))
            .collect()
    }

    /// The values of [`Results::values`] of several sets, joined.
    pub(crate) fn values_of_all(&self, experiment: &str, sets: &[SetSpec], variant: &str, measure: &str) -> Vec<f64> {
        sets.iter().flat_map(|set| self.values(experiment, &set.name, variant, measure)).collect()
    }
}

/// A set's name without its folders.
pub(crate) fn short_name(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}
