//! One run of the stitcher on one set, and what came of it.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use serde::{Deserialize, Serialize};
use trueup::{Error, Phase, Result, StitchOptions};

use crate::methods::VIEW;

/// What is to be run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trial {
    /// The experiment it belongs to.
    pub experiment: &'static str,
    /// The set's name.
    pub set: String,
    /// Name of the options in the experiment's tables.
    pub variant: String,
    /// Departures from the default options, each `table.option=value`.
    pub overrides: Vec<String>,
    /// Share of the vanishing directions that are replaced by random ones, 0 to 1.
    pub random_directions: f64,
    /// Seed of everything after matching.
    pub seed: u64,
    /// Position of the reference photograph; `None` leaves it to the stitcher.
    pub reference: Option<usize>,
    /// Only so many photographs of the set; `None` for all.
    pub photograph_count: Option<usize>,
    /// Whether these are the ones around the middle of the set, with the middle one for the reference, instead of the
    /// first.
    pub central: bool,
    /// Whether the photographs are also compared pixel by pixel.
    pub pixels: bool,
}

impl Trial {
    /// A run with these overrides on a whole set.
    pub(crate) fn new(experiment: &'static str, set: &str, variant: &str, overrides: &[&str]) -> Self {
        Self {
            experiment,
            set: set.to_owned(),
            variant: variant.to_owned(),
            overrides: overrides.iter().map(|one| (*one).to_owned()).collect(),
            random_directions: 0.0,
            seed: 0,
            reference: None,
            photograph_count: None,
            central: false,
            pixels: false,
        }
    }

    /// The options of the run: the defaults but for the view, which is the mesh's own, see [`VIEW`].
    ///
    /// # Errors
    /// Those of an override that does not exist or is out of range.
    pub(crate) fn options(&self) -> Result<StitchOptions> {
        let mut options = StitchOptions::default();
        options.matching.random.seed = self.seed;
        options.set(VIEW)?;
        for assignment in &self.overrides {
            options.set(assignment)?;
        }
        options.validate()?;
        Ok(options)
    }

    /// The overrides that change what is measured and matched; the others act on what was matched already.
    pub(crate) fn matching_overrides(&self) -> Vec<String> {
        let tables = StitchOptions::tables();
        let concerns = |assignment: &&String| {
            let named = |table: &&(&str, Option<Phase>)| assignment.starts_with(&format!("{}.", table.0));
            tables.iter().find(named).and_then(|(_, phase)| *phase).is_some_and(|phase| phase <= Phase::Match)
        };
        self.overrides.iter().filter(concerns).cloned().collect()
    }

    /// Everything that decides the figures on a set, as text: two trials of different experiments with the same are one
    /// piece of work.
    ///
    /// # Errors
    /// Those of [`Self::options`].
    pub(crate) fn work(&self) -> Result<String> {
        let options = serde_json::to_string(&self.options()?)
            .map_err(|error| Error::input("options", error, "Report this as a defect."))?;
        let random = (self.random_directions > 0.0).then_some((self.random_directions, self.seed));
        Ok(format!("{options} {random:?} {:?} {:?} {}", self.reference, self.photograph_count, self.central))
    }

    /// What identifies the run. `set_fingerprint` stands for the set's content.
    pub(crate) fn key(&self, set_fingerprint: &str, version: &str) -> TrialKey {
        TrialKey {
            experiment: self.experiment.to_owned(),
            set: self.set.clone(),
            variant: self.variant.clone(),
            seed: self.seed,
            reference: self.reference,
            photograph_count: self.photograph_count,
            inputs: fingerprint(&(&self.overrides, set_fingerprint, self.central, self.random_directions.to_bits())),
            version: version.to_owned(),
        }
    }
}

/// What identifies a result: the same key, the same figures.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct TrialKey {
    /// [`Trial::experiment`].
    pub experiment: String,
    /// [`Trial::set`].
    pub set: String,
    /// [`Trial::variant`].
    pub variant: String,
    /// [`Trial::seed`].
    pub seed: u64,
    /// [`Trial::reference`].
    pub reference: Option<usize>,
    /// [`Trial::photograph_count`].
    pub photograph_count: Option<usize>,
    /// Fingerprint of the overrides and the set.
    pub inputs: String,
    /// [`crate::build_stamp::BuildStamp::identity`] of the program.
    pub version: String,
}

/// A result as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    /// What was run.
    #[serde(flatten)]
    pub key: TrialKey,
    /// The figures by name, units in the names. What could not be measured is absent.
    pub measures: BTreeMap<String, f64>,
    /// Why vanishing points were not believed, or what went wrong; often empty.
    pub note: String,
}

impl Row {
    /// A figure, if it was measured.
    pub(crate) fn measure(&self, name: &str) -> Option<f64> {
        self.measures.get(name).copied()
    }
}

/// 16 hexadecimal digits that differ wherever the value does.
pub(crate) fn fingerprint(value: &impl Hash) -> String {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_reach_the_options_and_wrong_ones_are_named() {
        let trial = Trial { seed: 7, ..Trial::new("test", "01", "loose", &["similarity.rejection=0.5"]) };
        let options = trial.options().expect("valid");
        assert_eq!((options.align.similarity.rejection, options.matching.random.seed), (0.5, 7));
        let wrong = Trial::new("test", "01", "wrong", &["similarity.rejektion=1"]);
        assert!(wrong.options().expect_err("no such option").to_string().contains("similarity.rejektion"));
    }

    #[test]
    fn only_early_stages_need_matching_anew() {
        let trial = Trial::new(
            "test",
            "01",
            "mixed",
            &["mesh.cell_px=20", "matching.max_distance_ratio=0.7", "lines.min_length_px=30", "stitch.align=points"],
        );
        assert_eq!(trial.matching_overrides(), ["matching.max_distance_ratio=0.7", "lines.min_length_px=30"]);
    }

    #[test]
    fn trials_that_come_to_the_same_options_are_one_piece_of_work() {
        let trial = |variant, overrides| Trial::new("test", "01", variant, overrides).work().expect("valid");
        let plain = trial("plain", &[]);
        assert_eq!(trial("the default, named", &["similarity.rejection=0.24"]), plain);
        assert_ne!(trial("plain", &["similarity.rejection=0.25"]), plain);
        let other = Trial { reference: Some(0), ..Trial::new("test", "01", "plain", &[]) };
        assert_ne!(other.work().expect("valid"), plain);
    }

    #[test]
    fn the_key_changes_with_everything_that_changes_the_figures() {
        let trial = Trial::new("test", "01", "plain", &["mesh.cell_px=20"]);
        let key = trial.key("set", "1");
        assert_eq!(key, trial.clone().key("set", "1"));
        let others = [
            trial.key("other set", "1"),
            trial.key("set", "2"),
            Trial { seed: 1, ..trial.clone() }.key("set", "1"),
            Trial { reference: Some(0), ..trial.clone() }.key("set", "1"),
            Trial { photograph_count: Some(2), ..trial.clone() }.key("set", "1"),
            Trial { central: true, ..trial.clone() }.key("set", "1"),
            Trial { overrides: vec!["mesh.cell_px=21".to_owned()], ..trial }.key("set", "1"),
        ];
        assert!(others.iter().all(|other| *other != key));
    }
}
