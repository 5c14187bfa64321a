//! From features to matched pairs, as far as they are not known from earlier runs.

use std::collections::{BTreeMap, BTreeSet};

use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};
use trueup_vision::features::Features;
use trueup_vision::{matching, pairing};

use crate::cache::Known;
use crate::options::StitchOptions;

/// Matches the pairs of photographs that are worth it, or those `wished` for if there are any; `usable` photographs only.
///
/// # Errors
/// Those of [`pairing::propose`] and [`matching::run`].
pub(crate) fn run(
    features: &[Features],
    frames: &[WorkingFrame],
    wished: &[(usize, usize)],
    usable: &dyn Fn(usize) -> bool,
    known: Option<&Known<'_>>,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<PairMatches>> {
    let candidates = match wished {
        [] => propose(features, known, options, context)?,
        wished => wished.to_vec(),
    };
    let candidates: Vec<_> = candidates.into_iter().filter(|&(a, b)| usable(a) && usable(b)).collect();
    let forced: BTreeSet<(usize, usize)> = wished.iter().copied().collect();
    let recall = |&(a, b): &(usize, usize)| {
        let pair = (a.min(b), a.max(b));
        let found = known?.pair(pair, forced.contains(&pair), options)?;
        Some((pair, found))
    };
    let mut matched: BTreeMap<(usize, usize), PairMatches> = candidates.iter().filter_map(recall).collect();
    let missing: Vec<_> =
        candidates.iter().copied().filter(|&(a, b)| !matched.contains_key(&(a.min(b), a.max(b)))).collect();
    let input = matching::MatchingInput { features, frames, pairs: &missing, forced: &forced };
    for pair in matching::run(&input, &options.matching, context)? {
        if let Some(known) = known {
            known.keep_pair(&pair, forced.contains(&(pair.a, pair.b)), options);
        }
        matched.insert((pair.a, pair.b), pair);
    }
    let pairs = candidates.iter().filter_map(|&(a, b)| matched.get(&(a.min(b), a.max(b))).cloned()).collect::<Vec<_>>();
    matching::report_near_duplicates(&pairs, context);
    Ok(pairs)
}

fn propose(
    features: &[Features],
    known: Option<&Known<'_>>,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<(usize, usize)>> {
    let Some(known) = known.filter(|_| features.len() > options.pairing.exhaustive_up_to) else {
        return Ok(pairing::propose(features, &options.pairing, context)?.pairs);
    };
    let earlier: Vec<Vec<Option<usize>>> = (0..features.len()).map(|b| known.looks(b, options)).collect();
    let recall = |a: usize, b: usize| earlier[b][a];
    let looks = pairing::quick_looks(features, &recall, context)?;
    for (b, looks) in looks.iter().enumerate() {
        if earlier[b].iter().any(Option::is_none) {
            known.keep_looks(b, looks, options);
        }
    }
    Ok(pairing::propose_by(&looks, &options.pairing).pairs)
}
