//! The match phase: from features to matched pairs and their graph, as far as they are not known from earlier runs.

use std::collections::{BTreeMap, BTreeSet};

use trueup_align::stitch_graph::StitchGraph;
use trueup_core::diagnostics::Reported;
use trueup_core::matches::PairMatches;
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::told_lens::ToldLens;
use trueup_core::{Result, StageContext};
use trueup_vision::features::FeatureSource;
use trueup_vision::matching::{self, Stranger, StrangersInput};
use trueup_vision::pairing::{Likeness, Proposals, likeness};

use crate::memo::{Key, KeyMaker, LIKENESS, Memo, PAIR};
use crate::options::MatchOptions;
use crate::workers::Division;

/// What the phase works on. Photographs are counted 0..N; `features`, `frames`, `told`, `usable`, `images` and `keys` have N entries.
#[derive(Debug)]
pub(crate) struct MatchInput<'a> {
    pub features: &'a dyn FeatureSource,
    pub frames: &'a [WorkingFrame],
    /// What the user told of each lens.
    pub told: &'a [ToldLens],
    /// Whether each could be measured.
    pub usable: &'a [bool],
    /// The only pairs to be tried, whatever they look like; all that look worth it if there are none.
    pub wished: &'a [(usize, usize)],
    /// The photographs' files: which a camera took, and when.
    pub images: &'a [SourceImage],
    /// Whether there are masks of each.
    pub marked: &'a [bool],
    /// Whether copies of photographs are looked for: not where each exposure of a view is to stand for itself.
    pub copies: bool,
    /// What decides the features of each.
    pub keys: &'a [Option<Key>],
    /// Where pairs that earlier runs matched are found.
    pub memo: Memo<'a>,
    /// Who matches pairs elsewhere.
    pub workers: Option<Division<'a>>,
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
/// Those of [`likeness`], [`Proposals::new`] and [`matching::run`].
pub(crate) fn run(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Reported<Matches>> {
    context.gather(|context| {
        let pairs = context.time("matching", || match_pairs(input, options, context))?;
        let strangers = if input.wished.is_empty() { strangers(input, &pairs) } else { Vec::new() };
        let is_stranger = |photograph| strangers.iter().any(|stranger| stranger.photograph == photograph);
        let known = || pairs.iter().filter(|pair| !is_stranger(pair.a) && !is_stranger(pair.b));
        // A marked photograph is meant to stand for itself beside others of its view.
        let unmarked = |pair: &&PairMatches| [pair.a, pair.b].iter().all(|&one| !input.marked[one]);
        matching::report_near_duplicates(known().filter(unmarked), context);
        let graph = StitchGraph::new(input.features.photographs(), known());
        Ok(Matches { pairs, strangers, graph })
    })
}

/// The pictures that pairs and files show to be no photographs of the scene.
fn strangers(input: &MatchInput, pairs: &[PairMatches]) -> Vec<Stranger> {
    let by_camera: Vec<bool> = input.images.iter().map(SourceImage::is_by_camera).collect();
    let taken: Vec<Option<String>> = input.images.iter().map(|image| image.exposure.taken.clone()).collect();
    let MatchInput { frames, marked, copies, .. } = *input;
    matching::find_strangers(&StrangersInput { frames, pairs, by_camera: &by_camera, taken: &taken, marked, copies })
}

/// Every pair tried: those wished for in their order, or those proposed, ascending.
fn match_pairs(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Vec<PairMatches>> {
    if !input.wished.is_empty() {
        return match_candidates(input, input.wished, options, context);
    }
    let looks = || known_likeness(input, options, context);
    let mut proposals = Proposals::new(input.features, input.frames, &options.pairing, looks)?;
    let mut all: Vec<PairMatches> = Vec::new();
    let mut candidates = proposals.next(&[]);
    while !candidates.is_empty() {
        let matched = match_candidates(input, &candidates, options, context)?;
        candidates = proposals.next(&matched);
        all.extend(matched);
    }
    all.sort_by_key(|pair| (pair.a, pair.b));
    Ok(all)
}

/// How the photographs look like each other, kept for the same ones in the same order.
fn known_likeness(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Likeness> {
    let content = input.keys.iter().try_fold(KeyMaker::new(), |maker, key| Some(maker.key(key.as_ref()?)));
    let key = input.memo.key(LIKENESS, content, options);
    input.memo.found_or_made(LIKENESS, key.as_ref(), |_| true, || likeness(input.features, context))
}

/// These pairs, in their order, without those of photographs that could not be measured.
fn match_candidates(
    input: &MatchInput,
    candidates: &[(usize, usize)],
    options: &MatchOptions,
    context: &StageContext,
) -> Result<Vec<PairMatches>> {
    let is_usable = |&(a, b): &(usize, usize)| input.usable[a] && input.usable[b];
    let candidates: Vec<(usize, usize)> = candidates.iter().copied().filter(is_usable).collect();
    let forced: BTreeSet<(usize, usize)> = input.wished.iter().copied().collect();
    let told = input.told;
    let content = |a: usize, b: usize| {
        let (of_a, of_b) = (input.keys[a].as_ref()?, input.keys[b].as_ref()?);
        Some(KeyMaker::new().key(of_a).key(of_b).part(&forced.contains(&(a, b))).part(&[told[a], told[b]]))
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
    let (features, frames) = (input.features, input.frames);
    let unmatched = matching::MatchingInput { features, frames, told, pairs: &missing, forced: &forced };
    let found = match input.workers {
        Some(workers) => workers.matched(&unmatched, context)?,
        None => matching::run(&unmatched, &options.matching, context)?,
    };
    for pair in found {
        // Numbers of photographs belong to this run.
        input.memo.store(PAIR, key(pair.a, pair.b).as_ref(), &PairMatches { a: 0, b: 1, ..pair.clone() });
        matched.insert((pair.a, pair.b), pair);
    }
    Ok(candidates.iter().filter_map(|pair| matched.remove(&ordered(pair))).collect())
}
