//! Which pairs of photographs are worth matching.
//!
//! All pairs of few photographs. Of many, those that a quick look proposes: how many of their strongest features look
//! alike.

#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use crate::features::Features;
use crate::matching::{MatchingOptions, putative_matches};

/// Strongest features of each photograph that the quick look compares.
const COMPARED_FEATURES: usize = 1000;

trueup_core::options! {
    /// Which pairs of photographs are matched.
    pub struct PairingOptions("pairing") {
        /// All pairs are matched of at most so many photographs; of more, those that a quick look proposes. Raise it if
        /// photographs that overlap are left out of a large panorama: the time grows with the square.
        exhaustive_up_to: usize = 40, between(0.0, 100000.0), "photographs", basic;
        /// For every photograph, the neighbors proposed: those with which it has most matches at a quick look. Raise it for
        /// photographs of many rows, each of which overlaps many others.
        neighbors: usize = 8, between(1.0, 1000.0), "photographs";
        /// Whether photographs that follow one another are proposed whatever the quick look says. Turn it off if their order
        /// says nothing of where they were taken.
        consecutive: bool = true, Allowed::Any, "";
    }
}

/// The pairs to match.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CandidatePairs {
    /// Indices of two photographs, the smaller first; in ascending order, no pair twice.
    pub pairs: Vec<(usize, usize)>,
    /// Whether these are all pairs there are; if not, a pair that is missing was not proposed.
    pub exhaustive: bool,
}

/// Proposes all pairs of few photographs, and of many, for each photograph the `neighbors` with which the strongest
/// features have most putative matches (the smaller index winning ties, none with no match at all).
///
/// # Errors
/// [`trueup_core::Error::Options`]; [`trueup_core::Error::Input`] if features contradict themselves; [`trueup_core::Error::Cancelled`].
///
/// # Departures
/// Brown and Lowe (section 3.1) take the 6 neighbors with most matches; we take 8, as the quick look is coarser, and
/// propose consecutive photographs, which photographers overlap.
pub fn propose(features: &[Features], options: &PairingOptions, context: &StageContext<'_>) -> Result<CandidatePairs> {
    options.check()?;
    let count = features.len();
    if count <= options.exhaustive_up_to {
        return Ok(CandidatePairs { pairs: all_pairs(count), exhaustive: true });
    }
    Ok(propose_by(&quick_looks(features, &|_, _| None, context)?, options))
}

/// The proposal of [`propose`] for many photographs, from the [`quick_looks`] at their pairs.
pub fn propose_by(looks: &[Vec<usize>], options: &PairingOptions) -> CandidatePairs {
    let count = looks.len();
    let mut pairs: Vec<(usize, usize)> =
        (0..count).flat_map(|photograph| nearest(photograph, looks, options)).collect();
    if options.consecutive {
        pairs.extend((1..count).map(|next| (next - 1, next)));
    }
    pairs.sort_unstable();
    pairs.dedup();
    let exhaustive = pairs.len() == count * count.saturating_sub(1) / 2;
    CandidatePairs { pairs, exhaustive }
}

fn all_pairs(count: usize) -> Vec<(usize, usize)> {
    (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))).collect()
}

/// Numbers of putative matches of the strongest features of all pairs: `looks[b][a]` for a < b. Pairs whose number
/// `known(a, b)` tells are not looked at.
///
/// # Errors
/// [`trueup_core::Error::Input`] if features contradict themselves; [`trueup_core::Error::Cancelled`].
pub fn quick_looks(
    features: &[Features],
    known: &(dyn Fn(usize, usize) -> Option<usize> + Sync),
    context: &StageContext<'_>,
) -> Result<Vec<Vec<usize>>> {
    looks_at_strongest(COMPARED_FEATURES, features, known, context)
}

/// [`quick_looks`] at so many features of each photograph.
fn looks_at_strongest(
    compared_features: usize,
    features: &[Features],
    known: &(dyn Fn(usize, usize) -> Option<usize> + Sync),
    context: &StageContext<'_>,
) -> Result<Vec<Vec<usize>>> {
    for (index, features) in features.iter().enumerate() {
        features.check(index)?;
    }
    let strongest: Vec<_> = features.iter().map(|features| features.strongest(compared_features)).collect();
    let matching = MatchingOptions::default();
    context.progress().begin(PairingOptions::STAGE, features.len() as u64);
    let looks = (0..features.len())
        .into_par_iter()
        .map(|b| {
            let look = |a: usize| {
                context.check_cancelled()?;
                if let Some(known) = known(a, b) {
                    return Ok(known);
                }
                Ok(putative_matches(&strongest[a], &strongest[b], &matching).len())
            };
            let looks: Result<Vec<usize>> = (0..b).map(look).collect();
            context.progress().advance(PairingOptions::STAGE, 1);
            looks
        })
        .collect();
    context.progress().finish(PairingOptions::STAGE);
    looks
}

/// A photograph's pairs with its proposed neighbors.
fn nearest(photograph: usize, looks: &[Vec<usize>], options: &PairingOptions) -> Vec<(usize, usize)> {
    let matches = |other: usize| looks[photograph.max(other)][photograph.min(other)];
    let mut others: Vec<usize> = (0..looks.len()).filter(|&other| other != photograph && matches(other) > 0).collect();
    others.sort_by_key(|&other| (std::cmp::Reverse(matches(other)), other));
    others.truncate(options.neighbors);
    others.into_iter().map(|other| (photograph.min(other), photograph.max(other))).collect()
}
