//! The match phase: from features to matched pairs and their graph, as far as they are not known from earlier runs.

use std::collections::{BTreeMap, BTreeSet};

use trueup_align::stitch_graph::StitchGraph;
use trueup_core::diagnostics::Reported;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};
use trueup_vision::features::Features;
use trueup_vision::matching::Stranger;
use trueup_vision::{matching, pairing};

use crate::memo::{Key, KeyMaker, LOOKS, Memo, PAIR};
use crate::options::MatchOptions;

/// What the phase works on. Photographs are counted 0..N; `features`, `frames`, `usable` and `keys` have N entries.
#[derive(Debug)]
pub(crate) struct MatchInput<'a> {
    pub features: &'a [Features],
    pub frames: &'a [WorkingFrame],
    /// Whether each could be measured.
    pub usable: &'a [bool],
    /// The only pairs to be tried, whatever they look like; all that look worth it if there are none.
    pub wished: &'a [(usize, usize)],
    /// What decides the features of each.
    pub keys: &'a [Option<Key>],
    /// Where pairs that earlier runs matched are found.
    pub memo: Memo<'a>,
}

/// What the phase makes of them.
#[derive(Debug)]
pub(crate) struct Matches {
    /// Every pair tried, in the order of the candidates.
    pub pairs: Vec<PairMatches>,
    /// Pictures that are no photographs of the scene; none are looked for among pairs that were wished.
    pub strangers: Vec<Stranger>,
    /// The joined pairs without strangers.
    pub graph: StitchGraph,
}

/// Matches the pairs of photographs that are worth it, or those wished for.
///
/// # Errors
/// Those of [`pairing::propose`] and [`matching::run`].
pub(crate) fn run(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Reported<Matches>> {
    context.gather(|context| {
        let pairs = context.time("matching", || match_pairs(input, options, context))?;
        let strangers =
            if input.wished.is_empty() { matching::find_strangers(input.frames, &pairs) } else { Vec::new() };
        let is_stranger = |photograph| strangers.iter().any(|stranger| stranger.photograph == photograph);
        let known = || pairs.iter().filter(|pair| !is_stranger(pair.a) && !is_stranger(pair.b));
        matching::report_near_duplicates(known(), context);
        let graph = StitchGraph::new(input.features.len(), known());
        Ok(Matches { pairs, strangers, graph })
    })
}

fn match_pairs(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Vec<PairMatches>> {
    let candidates = match input.wished {
        [] => propose(input, options, context)?,
        wished => wished.to_vec(),
    };
    let candidates: Vec<(usize, usize)> =
        candidates.into_iter().filter(|&(a, b)| input.usable[a] && input.usable[b]).collect();
    let forced: BTreeSet<(usize, usize)> = input.wished.iter().copied().collect();
    let content = |a: usize, b: usize| {
        let (of_a, of_b) = (input.keys[a].as_ref()?, input.keys[b].as_ref()?);
        Some(KeyMaker::new().key(of_a).key(of_b).part(&forced.contains(&(a, b))))
    };
    let key = |a: usize, b: usize| input.memo.key(PAIR, content(a, b), options);
    let ordered = |&(a, b): &(usize, usize)| (a.min(b), a.max(b));
    let recall = |pair: &(usize, usize)| {
        let (a, b) = ordered(pair);
        let found = input.memo.load::<PairMatches>(PAIR, key(a, b).as_ref())?;
        Some(((a, b), PairMatches { a, b, ..found }))
    };
    let mut matched: BTreeMap<(usize, usize), PairMatches> = candidates.iter().filter_map(recall).collect();
    let missing: Vec<(usize, usize)> =
        candidates.iter().copied().filter(|pair| !matched.contains_key(&ordered(pair))).collect();
    let unmatched =
        matching::MatchingInput { features: input.features, frames: input.frames, pairs: &missing, forced: &forced };
    for pair in matching::run(&unmatched, &options.matching, context)? {
        // Numbers of photographs belong to this run.
        input.memo.store(PAIR, key(pair.a, pair.b).as_ref(), &PairMatches { a: 0, b: 1, ..pair.clone() });
        matched.insert((pair.a, pair.b), pair);
    }
    Ok(candidates.iter().filter_map(|pair| matched.get(&ordered(pair)).cloned()).collect())
}

/// The pairs that are worth matching.
fn propose(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Vec<(usize, usize)>> {
    let MatchInput { features, keys, memo, .. } = input;
    if memo.disk.is_none() || features.len() <= options.pairing.exhaustive_up_to {
        return Ok(pairing::propose(features, &options.pairing, context)?.pairs);
    }
    // How a photograph looks like each one before it, by their keys: it is looked at again with those that are new.
    let key = |b: usize| memo.key(LOOKS, keys[b].as_ref().map(|key| KeyMaker::new().key(key)), options);
    let earlier: Vec<Vec<Option<usize>>> = (0..features.len())
        .map(|b| {
            let known = memo.load::<Vec<(Key, usize)>>(LOOKS, key(b).as_ref()).unwrap_or_default();
            let known: BTreeMap<Key, usize> = known.into_iter().collect();
            keys[..b].iter().map(|key| known.get(key.as_ref()?).copied()).collect()
        })
        .collect();
    let recall = |a: usize, b: usize| earlier[b][a];
    let looks = pairing::quick_looks(features, &recall, context)?;
    for (b, looks) in looks.iter().enumerate() {
        if earlier[b].iter().any(Option::is_none) {
            let looks: Vec<(Key, usize)> =
                keys.iter().zip(looks).filter_map(|(key, &look)| Some(((*key)?, look))).collect();
            memo.store(LOOKS, key(b).as_ref(), &looks);
        }
    }
    Ok(pairing::propose_by(&looks, &options.pairing).pairs)
}
