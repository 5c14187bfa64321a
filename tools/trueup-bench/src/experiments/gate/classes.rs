//! The two classes of scenes, what the gates say of them, and what is claimed of that.

use trueup::Result;

use crate::experiments::paper_figures::THRESHOLD;
use crate::published_forms::VPG_AS_PUBLISHED;
use crate::report::document::{Claim, number};
use crate::results::Results;
use crate::roc;
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::share;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "gate";

pub(super) const FULL: &str = "full gate";
/// The published prior with its own vanishing points; its divergence is read off whatever the gate says.
pub(super) const PAPER: &str = "divergence alone, published prior";

/// The rates must differ by this much for the classes to count as separated.
const SEPARATED: f64 = 0.8;

/// The larger sets, which the gate is tried on as well.
pub(super) fn families(catalogue: &Catalogue) -> Vec<(&'static str, &[SetSpec])> {
    let all = [
        ("the study's sets", &catalogue.study[..]),
        ("their twins without dominant directions", &catalogue.twins),
        ("one vertical, horizontals at free angles", &catalogue.mixed),
        ("given sets", &catalogue.given),
    ];
    all.into_iter().filter(|(_, sets)| !sets.is_empty()).collect()
}

/// Both gates on every set of the gate experiment, the default one on the larger sets.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let variants: [(&str, &[&str]); 2] = [(FULL, &[]), (PAPER, &VPG_AS_PUBLISHED)];
    let each = |set: &SetSpec| variants.map(|(name, overrides)| Trial::new(NAME, &set.name, name, overrides));
    let families = families(catalogue).into_iter().flat_map(|(_, sets)| sets);
    let default = families.map(|set| Trial::new(NAME, &set.name, FULL, &[]));
    Ok(catalogue.gate.iter().flat_map(each).chain(default).collect())
}

/// One class of scenes under one gate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Class {
    /// Divergence per set that was stitched; infinite where no directions were found.
    pub(super) divergences: Vec<f64>,
    /// Sets whose dominant directions guide.
    pub(super) accepted: usize,
    /// Sets that the vertical alone guides.
    pub(super) vertical_only: usize,
    pub(super) stitched: usize,
    /// Sets that could not be stitched at all.
    pub(super) failed: usize,
}

/// Which sets are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Those that constants are chosen by.
    Seen,
    /// Those that they are judged by.
    HeldOut,
    /// Both.
    All,
}

impl Part {
    pub(super) fn holds(self, set: &SetSpec) -> bool {
        match self {
            Self::Seen => !set.held_out,
            Self::HeldOut => set.held_out,
            Self::All => true,
        }
    }
}

pub(super) fn class(results: &Results, manhattan: bool, variant: &str, part: Part) -> Class {
    let mut class = Class { divergences: Vec::new(), accepted: 0, vertical_only: 0, stitched: 0, failed: 0 };
    let of_class = |set: &&SetSpec| set.manhattan == Some(manhattan) && part.holds(set);
    for set in results.catalogue.gate.iter().filter(of_class) {
        for row in results.of(NAME).filter(|row| row.key.set == set.name && row.key.variant == variant) {
            match row.measure("accepted") {
                None => class.failed += 1,
                Some(accepted) => {
                    class.stitched += 1;
                    class.accepted += usize::from(accepted > 0.0);
                    class.vertical_only += usize::from(accepted == 0.0 && row.measure("guided") == Some(1.0));
                    class.divergences.push(row.measure("divergence").unwrap_or(f64::INFINITY));
                }
            }
        }
    }
    class
}

impl Class {
    pub(super) fn rate(&self) -> Option<f64> {
        (self.stitched > 0).then(|| self.accepted as f64 / self.stitched as f64)
    }

    /// Sets whose divergence a threshold lets through.
    pub(super) fn below(&self, threshold: f64) -> usize {
        self.divergences.iter().filter(|divergence| **divergence <= threshold).count()
    }
}

/// The threshold on the divergence alone that parts the classes best on the sets that constants are chosen by.
pub(super) fn fitted_threshold(results: &Results) -> Option<f64> {
    let [manhattan, other] = [true, false].map(|kind| class(results, kind, PAPER, Part::Seen).divergences);
    roc::best_threshold(&roc::curve(&manhattan, &other)?).map(|best| best.threshold)
}

/// The gate tells the two classes apart on sets that nothing was chosen by.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    vec![claim_full(results), claim_divergence(results)]
}

fn claim_full(results: &Results) -> Claim {
    let [manhattan, other] = [true, false].map(|kind| class(results, kind, FULL, Part::HeldOut));
    let rates = manhattan.rate().zip(other.rate());
    let (yes, wrongly) = (share(manhattan.accepted, manhattan.stitched), share(other.accepted, other.stitched));
    Claim {
        id: "gate",
        text: "The gate accepts Manhattan scenes and refuses others, on scenes that its constants were not chosen by."
            .to_owned(),
        holds: rates.map(|(accepted, wrongly)| accepted - wrongly >= SEPARATED),
        evidence: format!(
            "Vanishing points guide {yes} Manhattan sets and {wrongly} others (separated: the shares differ by {SEPARATED} or more)."
        ),
        reason: "",
        brief: format!("gate separates {yes} from {wrongly}"),
    }
}

fn claim_divergence(results: &Results) -> Claim {
    let [manhattan, other] = [true, false].map(|kind| class(results, kind, PAPER, Part::HeldOut));
    let fitted = fitted_threshold(results).filter(|_| manhattan.stitched > 0 && other.stitched > 0);
    let apart = |threshold: f64| {
        let rate = |class: &Class| class.below(threshold) as f64 / class.stitched as f64;
        rate(&manhattan) - rate(&other)
    };
    let counts = |threshold: f64| {
        let count = |class: &Class| share(class.below(threshold), class.stitched);
        format!("{} Manhattan sets and {} others", count(&manhattan), count(&other))
    };
    Claim {
        id: "gate-divergence",
        text: "The divergence alone, as published, tells them apart, with a threshold chosen on one half of the scenes and \
               judged on the other."
            .to_owned(),
        holds: fitted.map(|threshold| apart(threshold) >= SEPARATED),
        evidence: format!(
            "Up to {}, chosen on the first half, lie {} of the other half; up to the paper's {THRESHOLD:.2}, {}.",
            number(fitted, 4),
            fitted.map_or("-".to_owned(), counts),
            counts(THRESHOLD)
        ),
        reason: "A triad is fitted to whatever segments a photograph has, and few photographs of open country or of blocks at \
                 random turns often agree on one: their divergences overlap with those of Manhattan scenes (see also the few \
                 photographs below).",
        brief: format!("divergence alone: {}", fitted.map_or("-".to_owned(), counts)),
    }
}
