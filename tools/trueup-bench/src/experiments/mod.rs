//! The experiments: which trials each needs, and what it says of their results.

pub(crate) mod ablations;
pub(crate) mod alignment;
pub(crate) mod estimated_gdic;
pub(crate) mod few_photographs;
pub(crate) mod focal_error;
pub(crate) mod gate;
mod grid;
pub(crate) mod methods_compared;
mod paper_figures;
pub(crate) mod photographs;
pub(crate) mod pitch_sweep;
pub(crate) mod reference_choice;
pub(crate) mod robust_scheme;
pub(crate) mod rolled_pairs;
pub(crate) mod runtime;
pub(crate) mod warps_compared;

use trueup::Result;

use crate::report::document::{Claim, Section};
use crate::results::Results;
use crate::sets::Catalogue;
use crate::trial::Trial;

/// An experiment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Experiment {
    /// Its name in rows and on the command line.
    pub name: &'static str,
    /// What it needs to be run.
    pub trials: fn(&Catalogue) -> Result<Vec<Trial>>,
    /// What it says.
    pub section: fn(&Results) -> Section,
    /// The claims it tests.
    pub claims: fn(&Results) -> Vec<Claim>,
}

/// Every experiment whose trials are run side by side, in the order of the report. Times are taken apart from them
/// ([`runtime`]).
pub(crate) const EXPERIMENTS: [Experiment; 13] = [
    Experiment {
        name: rolled_pairs::NAME,
        trials: rolled_pairs::trials,
        section: rolled_pairs::section,
        claims: rolled_pairs::claims,
    },
    Experiment {
        name: warps_compared::NAME,
        trials: warps_compared::trials,
        section: warps_compared::section,
        claims: warps_compared::claims,
    },
    Experiment {
        name: methods_compared::NAME,
        trials: methods_compared::trials,
        section: methods_compared::section,
        claims: methods_compared::claims,
    },
    Experiment {
        name: robust_scheme::NAME,
        trials: robust_scheme::trials,
        section: robust_scheme::section,
        claims: robust_scheme::claims,
    },
    Experiment {
        name: reference_choice::NAME,
        trials: reference_choice::trials,
        section: reference_choice::section,
        claims: reference_choice::claims,
    },
    Experiment { name: gate::NAME, trials: gate::trials, section: gate::section, claims: gate::claims },
    Experiment {
        name: alignment::NAME,
        trials: alignment::trials,
        section: alignment::section,
        claims: alignment::claims,
    },
    Experiment {
        name: photographs::NAME,
        trials: photographs::trials,
        section: photographs::section,
        claims: no_claims,
    },
    Experiment {
        name: estimated_gdic::NAME,
        trials: estimated_gdic::trials,
        section: estimated_gdic::section,
        claims: estimated_gdic::claims,
    },
    Experiment { name: ablations::NAME, trials: ablations::trials, section: ablations::section, claims: no_claims },
    Experiment {
        name: pitch_sweep::NAME,
        trials: pitch_sweep::trials,
        section: pitch_sweep::section,
        claims: no_claims,
    },
    Experiment {
        name: few_photographs::NAME,
        trials: few_photographs::trials,
        section: few_photographs::section,
        claims: no_claims,
    },
    Experiment {
        name: focal_error::NAME,
        trials: focal_error::trials,
        section: focal_error::section,
        claims: no_claims,
    },
];

/// The experiments of a quick run.
pub(crate) const QUICK_EXPERIMENTS: [&str; 4] =
    [methods_compared::NAME, robust_scheme::NAME, reference_choice::NAME, gate::NAME];

/// The claims that are expected to hold on the few rough sets of a quick run ([`Claim::id`]): if one of them does not,
/// a change broke something. The others are tried by the whole run alone: a handful of sets says little of them.
pub(crate) const QUICK_CLAIMS: [&str; 6] =
    ["methods-distortion", "default-direction", "default-distortion", "robust-scheme", "reference-vpg", "gate"];

fn no_claims(_: &Results) -> Vec<Claim> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets::GivenFolders;

    /// A method that fixes options refuses other values of them: an experiment that asks for one would end the whole
    /// run.
    #[test]
    fn every_trial_of_every_experiment_has_options_that_can_be() {
        for catalogue in [Catalogue::full(&GivenFolders::default()).expect("no folders"), Catalogue::quick()] {
            let mut work = std::collections::BTreeSet::new();
            for experiment in &EXPERIMENTS {
                for trial in (experiment.trials)(&catalogue).expect("trials") {
                    let said = |error| format!("{} {}: {error}", experiment.name, trial.variant);
                    // Options repeat over sets and seeds.
                    if work.insert(trial.overrides.clone()) {
                        trial.options().map_err(said).expect("options that can be");
                    }
                }
            }
            assert!(work.len() > 10, "{}", work.len());
        }
    }
}
