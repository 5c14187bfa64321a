//! Which pairs of pictures are worth matching.

#[cfg(test)]
mod tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use crate::features::Features;
use crate::matching::{MatchingOptions, check_features, putative_matches};

trueup_core::options! {
    /// Which pairs of pictures are matched.
    pub struct PairingOptions("pairing") {
        /// All pairs are matched of at most so many pictures; of more, those that a quick look proposes.
        exhaustive_up_to: usize = 40, between(0.0, 100000.0), "pictures";
        /// For every picture, the neighbors proposed: those with which it has most matches at a quick look.
        neighbors: usize = 8, between(1.0, 1000.0), "pictures";
        /// Strongest features of each picture that the quick look compares.
        subset: usize = 1000, between(16.0, 100000.0), "features";
        /// Whether pictures that follow one another are proposed whatever the quick look says.
        consecutive: bool = true, Allowed::Any, "";
    }
}

/// The pairs to match.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CandidatePairs {
    /// Indices of two pictures, the smaller first; in ascending order, no pair twice.
    pub pairs: Vec<(usize, usize)>,
    /// Whether these are all pairs there are; if not, a pair that is missing was not proposed.
    pub exhaustive: bool,
}

/// Proposes all pairs of few pictures, and of many, for each picture the `neighbors` with which the strongest features
/// have most putative matches (the smaller index winning ties, none with no match at all).
///
/// # Errors
/// [`trueup_core::Error::Options`]; [`trueup_core::Error::Input`] if features contradict themselves; [`trueup_core::Error::Cancelled`].
///
/// # Departures
/// Brown and Lowe (section 3.1) take the 6 neighbors with most matches; we take 8, as the quick look is coarser, and
/// propose consecutive pictures, which photographers overlap.
pub fn propose(features: &[Features], options: &PairingOptions, context: &StageContext<'_>) -> Result<CandidatePairs> {
    options.check()?;
    let count = features.len();
    if count <= options.exhaustive_up_to {
        return Ok(CandidatePairs { pairs: all_pairs(count), exhaustive: true });
    }
    Ok(propose_by(&quick_looks(features, &|_, _| None, options, context)?, options))
}

/// The proposal of [`propose`] for many pictures, from the [`quick_looks`] at their pairs.
pub fn propose_by(looks: &[Vec<usize>], options: &PairingOptions) -> CandidatePairs {
    let count = looks.len();
    let mut pairs: Vec<(usize, usize)> = (0..count).flat_map(|picture| nearest(picture, looks, options)).collect();
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
/// As [`propose`].
pub fn quick_looks(
    features: &[Features],
    known: &(dyn Fn(usize, usize) -> Option<usize> + Sync),
    options: &PairingOptions,
    context: &StageContext<'_>,
) -> Result<Vec<Vec<usize>>> {
    options.check()?;
    for (index, features) in features.iter().enumerate() {
        check_features(index, features)?;
    }
    let subsets: Vec<Features> =
        features.iter().map(|features| features.strongest(options.subset).into_owned()).collect();
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
                Ok(putative_matches(&subsets[a], &subsets[b], &matching).len())
            };
            let looks: Result<Vec<usize>> = (0..b).map(look).collect();
            context.progress().advance(PairingOptions::STAGE, 1);
            looks
        })
        .collect();
    context.progress().finish(PairingOptions::STAGE);
    looks
}

/// A picture's pairs with its proposed neighbors.
fn nearest(picture: usize, looks: &[Vec<usize>], options: &PairingOptions) -> Vec<(usize, usize)> {
    let matches = |other: usize| looks[picture.max(other)][picture.min(other)];
    let mut others: Vec<usize> = (0..looks.len()).filter(|&other| other != picture && matches(other) > 0).collect();
    others.sort_by_key(|&other| (std::cmp::Reverse(matches(other)), other));
    others.truncate(options.neighbors);
    others.into_iter().map(|other| (picture.min(other), picture.max(other))).collect()
}
