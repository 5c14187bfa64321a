//! The match phase: from features to matched pairs and their graph, as far as they are not known from earlier runs.
//! Photographs that are left over are looked at again, by what is coarse in them, and by what their few matches lay
//! over each other.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use trueup_align::stitch_graph::StitchGraph;
use trueup_core::diagnostics::{Diagnostic, Reported, Subject};
use trueup_core::matches::{PairMatches, PairVerdict};
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::told_lens::ToldLens;
use trueup_core::{Result, StageContext};
use trueup_vision::features::FeatureSource;
use trueup_vision::matching::{self, Demand, Stranger, StrangersInput};
use trueup_vision::pairing::{Apart, Likeness, Proposals, likeness, pairs_apart};

use crate::memo::{Key, KeyMaker, LIKENESS, Memo, PAIR};
use crate::options::MatchOptions;
use crate::workers::Division;

/// The code of pairs that are joined by what is coarse alone.
pub(crate) const JOINED_BY_COARSE: &str = "joined-by-coarse-features";

/// The code of pairs of which few matches agree, but all that these lay over each other looks alike.
pub(crate) const JOINED_BY_LOOKS: &str = "joined-by-looks";

/// The code of two photographs alone that are joined although what lies between their matches looks different.
pub(crate) const JOINED_ALTHOUGH_DIFFERENT: &str = "joined-although-different";

/// What the phase works on. Photographs are counted 0..N; `features`, `coarse`, `frames`, `told`, `usable`, `images`
/// and `keys` have N entries.
#[derive(Debug)]
pub(crate) struct MatchInput<'a> {
    pub features: &'a dyn FeatureSource,
    /// What is coarse in them, asked for where photographs are left over.
    pub coarse: &'a dyn FeatureSource,
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

impl MatchInput<'_> {
    /// What pairs must show to be joined.
    fn demand(&self) -> Demand {
        if self.wished.is_empty() { Demand::Test } else { Demand::Graph }
    }
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

/// Which of the photographs' features are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// The strongest of all sizes.
    First,
    /// Coarse ones.
    Coarse,
}

impl Look {
    /// The features that are compared.
    fn features<'a>(self, input: &MatchInput<'a>) -> &'a dyn FeatureSource {
        match self {
            Self::First => input.features,
            Self::Coarse => input.coarse,
        }
    }

    /// What is found by this look, beside what else decides it.
    fn key(self, maker: KeyMaker) -> KeyMaker {
        match self {
            Self::First => maker,
            Self::Coarse => maker.part("coarse"),
        }
    }
}

/// Matches the pairs of photographs that are worth it, or those wished for; where photographs are left over, those once
/// more by what is coarse, and then by what their few matches lay over each other. Two photographs alone are trusted.
///
/// # Errors
/// Those of [`likeness`], [`Proposals::new`] and [`matching::run`].
pub(crate) fn run(input: &MatchInput, options: &MatchOptions, context: &StageContext) -> Result<Reported<Matches>> {
    context.gather(|context| {
        let pairs = context.time("matching", || match_pairs(input, options, context))?;
        let matches = context.time("matching", || look_again(input, judged(input, pairs), options, context))?;
        let matches = context.time("matching", || join_by_looks(input, matches, options, context))?;
        let matches = context.time("matching", || trusted_if_alone(input, matches, options, context))?;
        let known = without(&matches.strangers, &matches.pairs);
        // A marked photograph is meant to stand for itself beside others of its view.
        let unmarked = |pair: &&PairMatches| [pair.a, pair.b].iter().all(|&one| !input.marked[one]);
        matching::report_near_duplicates(known.filter(unmarked), context);
        Ok(matches)
    })
}

/// What pairs come to: which photographs are none of the scene, and which of the others are joined.
fn judged(input: &MatchInput, pairs: Vec<PairMatches>) -> Matches {
    let strangers = if input.wished.is_empty() { strangers(input, &pairs) } else { Vec::new() };
    let graph = StitchGraph::new(input.features.photographs(), without(&strangers, &pairs));
    Matches { pairs, strangers, graph }
}

/// The pairs of photographs that are no strangers.
fn without<'a>(strangers: &'a [Stranger], pairs: &'a [PairMatches]) -> impl Iterator<Item = &'a PairMatches> {
    pairs.iter().filter(|pair| !is_stranger(strangers, pair.a) && !is_stranger(strangers, pair.b))
}

fn is_stranger(strangers: &[Stranger], photograph: usize) -> bool {
    strangers.iter().any(|stranger| stranger.photograph == photograph)
}

/// Whether each photograph can be used and is none of the `strangers`.
fn usable(input: &MatchInput, strangers: &[Stranger]) -> Vec<bool> {
    (0..input.usable.len()).map(|one| input.usable[one] && !is_stranger(strangers, one)).collect()
}

/// Looks at the pairs that are apart by what is coarse, and joins those that overlap by that; a pair that does not
/// keeps its verdict. Where nothing is left over, nothing is looked at.
fn look_again(input: &MatchInput, first: Matches, options: &MatchOptions, context: &StageContext) -> Result<Matches> {
    // What looks different does so however it is looked at.
    let differing = first.pairs.iter().filter(|pair| pair.verdict == PairVerdict::LooksDifferent);
    let mut tried: BTreeSet<(usize, usize)> = differing.map(|pair| (pair.a, pair.b)).collect();
    let mut matches = first;
    let known = OnceCell::new();
    let looks = || match known.get() {
        Some(likeness) => Ok(likeness),
        None => known_likeness(input, Look::Coarse, options, context).map(|likeness| known.get_or_init(|| likeness)),
    };
    loop {
        let usable = usable(input, &matches.strangers);
        let groups = &matches.graph.components;
        let apart = Apart { groups, usable: &usable, wished: input.wished, tried: &tried };
        let candidates = pairs_apart(&apart, &options.pairing, looks)?;
        if candidates.is_empty() {
            break;
        }
        let mut found = match_candidates(input, &candidates, Look::Coarse, input.demand(), options, context)?;
        found.retain(|pair| pair.verdict.is_joined());
        if found.is_empty() {
            break;
        }
        tried.extend(candidates);
        for pair in &found {
            context.report(Diagnostic::note(
                JOINED_BY_COARSE,
                Subject::Pair(pair.a, pair.b),
                "they share only what is coarse, as where one of them is blurred",
                "Leave out what is blurred, if others show the same.",
            ));
        }
        let pairs = replaced(matches.pairs, found, !input.wished.is_empty());
        matches = judged(input, pairs);
    }
    Ok(matches)
}

/// Joins the pairs that are apart for want of agreeing matches, and of which all that these lay over each other looks
/// alike: photographs that are noisy, coarsely compressed or that share little, as the tiles of a scan.
fn join_by_looks(
    input: &MatchInput,
    matches: Matches,
    options: &MatchOptions,
    context: &StageContext,
) -> Result<Matches> {
    if !input.wished.is_empty() {
        return Ok(matches);
    }
    let is_in_question = |pair: &&PairMatches| {
        pair.verdict == PairVerdict::TooFewInliers && pair.agreeing >= options.matching.fewest_if_alike()
    };
    let (usable, tried) = (usable(input, &matches.strangers), BTreeSet::new());
    let apart = Apart { groups: &matches.graph.components, usable: &usable, wished: input.wished, tried: &tried };
    let in_question = matches.pairs.iter().filter(is_in_question).map(|pair| (pair.a, pair.b));
    let candidates: Vec<(usize, usize)> = in_question.filter(apart.is_apart()).collect();
    if candidates.is_empty() {
        return Ok(matches);
    }
    let mut found = match_candidates(input, &candidates, Look::First, Demand::FewIfAlike, options, context)?;
    found.retain(|pair| pair.verdict.is_joined());
    for pair in &found {
        context.report(Diagnostic::note(
            JOINED_BY_LOOKS,
            Subject::Pair(pair.a, pair.b),
            format!(
                "only {} of {} matches agree, but all that they lay over each other looks alike",
                pair.agreeing, pair.putative
            ),
            "If things stand together that do not belong together, leave one of the photographs out.",
        ));
    }
    if found.is_empty() { Ok(matches) } else { Ok(judged(input, replaced(matches.pairs, found, false))) }
}

/// Joins two photographs that are all there is although what lies between their matches looks different: who gives two
/// means that they overlap, and clouds, leaves and water that moved look so as well as equal things in different
/// places.
fn trusted_if_alone(
    input: &MatchInput,
    matches: Matches,
    options: &MatchOptions,
    context: &StageContext,
) -> Result<Matches> {
    let is_alone = input.usable.iter().filter(|&&usable| usable).count() == 2;
    let differing = matches.pairs.iter().find(|pair| pair.verdict == PairVerdict::LooksDifferent);
    let Some(alone) = differing.filter(|_| is_alone).map(|pair| [(pair.a, pair.b)]) else { return Ok(matches) };
    let found = match_candidates(input, &alone, Look::First, Demand::Graph, options, context)?;
    context.report(Diagnostic::warning(
        JOINED_ALTHOUGH_DIFFERENT,
        Subject::Pair(alone[0].0, alone[0].1),
        "what lies between their matches looks different, as where clouds moved, or as equal things in different places do",
        "If things stand together that do not belong together, shoot one frame between them.",
    ));
    Ok(judged(input, replaced(matches.pairs, found, false)))
}

/// The pairs with those `found` in the place of their own first look; in the order of photographs, unless they are
/// `wished` for in their own.
fn replaced(mut pairs: Vec<PairMatches>, found: Vec<PairMatches>, wished: bool) -> Vec<PairMatches> {
    for pair in found {
        match pairs.iter_mut().find(|known| (known.a, known.b) == (pair.a, pair.b)) {
            Some(known) => *known = pair,
            None => pairs.push(pair),
        }
    }
    if !wished {
        pairs.sort_by_key(|pair| (pair.a, pair.b));
    }
    pairs
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
        return match_candidates(input, input.wished, Look::First, input.demand(), options, context);
    }
    let looks = || known_likeness(input, Look::First, options, context);
    let mut proposals = Proposals::new(input.features, input.frames, &options.pairing, looks)?;
    let mut all: Vec<PairMatches> = Vec::new();
    let mut candidates = proposals.next(&[]);
    while !candidates.is_empty() {
        let matched = match_candidates(input, &candidates, Look::First, input.demand(), options, context)?;
        candidates = proposals.next(&matched);
        all.extend(matched);
    }
    all.sort_by_key(|pair| (pair.a, pair.b));
    Ok(all)
}

/// How the photographs look like each other, kept for the same ones in the same order.
fn known_likeness(input: &MatchInput, look: Look, options: &MatchOptions, context: &StageContext) -> Result<Likeness> {
    let content = input.keys.iter().try_fold(KeyMaker::new(), |maker, key| Some(maker.key(key.as_ref()?)));
    let key = input.memo.key(LIKENESS, content.map(|content| look.key(content)), options);
    input.memo.found_or_made(LIKENESS, key.as_ref(), |_| true, || likeness(look.features(input), context))
}

/// These pairs by a look at them, in their order, without those of photographs that could not be measured.
fn match_candidates(
    input: &MatchInput,
    candidates: &[(usize, usize)],
    look: Look,
    demand: Demand,
    options: &MatchOptions,
    context: &StageContext,
) -> Result<Vec<PairMatches>> {
    let is_usable = |&(a, b): &(usize, usize)| input.usable[a] && input.usable[b];
    let candidates: Vec<(usize, usize)> = candidates.iter().copied().filter(is_usable).collect();
    let told = input.told;
    let content = |a: usize, b: usize| {
        let (of_a, of_b) = (input.keys[a].as_ref()?, input.keys[b].as_ref()?);
        let maker = KeyMaker::new().key(of_a).key(of_b).part(&demand);
        Some(look.key(maker.part(&[told[a], told[b]])))
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
    let (features, frames) = (look.features(input), input.frames);
    if look == Look::Coarse {
        // Each once, before several threads ask for the same.
        let seen: BTreeSet<usize> = missing.iter().flat_map(|&(a, b)| [a, b]).collect();
        seen.into_par_iter().try_for_each(|one| features.features(one).map(drop))?;
    }
    let unmatched = matching::MatchingInput { features, frames, told, pairs: &missing, demand };
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

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use trueup_core::raster::Photograph;

    use super::*;
    use crate::inputs::Inputs;
    use crate::memo::PhotographCache;
    use crate::options::StitchOptions;
    use crate::pipeline::{Alignment, Stitcher};
    use crate::test_room::{TOO_FEW_FEATURES, room_in_memory, room_with_a_blurred_photograph};

    fn aligned(assignments: &[&str], cache: Option<&PhotographCache>, threads: usize) -> Alignment {
        let mut options = StitchOptions::default();
        let assignments = [TOO_FEW_FEATURES].into_iter().chain(assignments.iter().copied());
        assignments.for_each(|assignment| options.set(assignment).expect("an option"));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let context = StageContext::default();
            let stitcher = Stitcher::new(&options, &context).with_cache(cache);
            stitcher.align(&room_with_a_blurred_photograph()).expect("a panorama").alignments.remove(0)
        })
    }

    /// The pairs that are joined by what is coarse.
    fn coarse(alignment: &Alignment) -> Vec<&Subject> {
        let told = alignment.project.diagnostics.iter().filter(|one| one.code == JOINED_BY_COARSE);
        told.map(|one| &one.subject).collect()
    }

    fn are_of_the_last(pairs: &[&Subject]) -> bool {
        !pairs.is_empty() && pairs.iter().all(|pair| matches!(pair, Subject::Pair(_, 4)))
    }

    /// By its strongest features, the last photograph has too few matches with the others.
    #[test]
    fn a_blurred_photograph_is_joined_by_what_is_coarse() {
        let desk = tempfile::tempdir().expect("a folder");
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let found = aligned(&[], None, 1);
        assert_eq!(found.project.used(), 5);
        assert!(are_of_the_last(&coarse(&found)), "{:?}", coarse(&found));
        let made = |cache: &PhotographCache| cache.uses().get("pair").map_or(0, |pairs| pairs.made);
        for threads in [2, 3] {
            let again = aligned(&[], Some(&cache), threads);
            assert_eq!(again.project.images, found.project.images);
            assert_eq!(coarse(&again), coarse(&found));
            assert_eq!(made(&cache), 14, "ten pairs, and four of them once more; none in the second run");
        }
        // By their looks where not all pairs are matched.
        let by_looks = aligned(&["pairing.exhaustive_up_to=2"], None, 2);
        assert_eq!(by_looks.project.used(), 5);
        assert!(are_of_the_last(&coarse(&by_looks)), "{:?}", coarse(&by_looks));
    }

    #[test]
    fn where_nothing_is_left_over_nothing_is_looked_at_again() {
        let desk = tempfile::tempdir().expect("a folder");
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let (options, context) = (StitchOptions::default(), StageContext::default());
        let stitcher = Stitcher::new(&options, &context).with_cache(Some(&cache));
        let aligned = stitcher.align(&room_in_memory(|photograph| photograph)).expect("a panorama");
        assert!(coarse(&aligned.alignments[0]).is_empty());
        assert_eq!(cache.uses().get("pair").map_or(0, |pairs| pairs.made), 10);
    }

    /// Height from which on a photograph is changed, as a share of it: enough matches are left above it, few enough
    /// for what lies below to be compared.
    const CHANGED_FROM: f64 = 0.4;

    /// The room's photographs, of the second of which what lies below [`CHANGED_FROM`] is mirrored: it is nowhere in
    /// the others.
    fn room_in_which_the_second_changed() -> Inputs {
        let seen = Cell::new(0);
        room_in_memory(|photograph| {
            let index = seen.replace(seen.get() + 1);
            match photograph {
                Photograph::Eight(mut raster) if index == 1 => {
                    let first = (CHANGED_FROM * raster.height() as f64) as usize;
                    let (width, channels) = (raster.width(), raster.channels());
                    for row in raster.data_mut().chunks_exact_mut(width * channels).skip(first) {
                        let mirrored: Vec<u8> = row.chunks_exact(channels).rev().flatten().copied().collect();
                        row.copy_from_slice(&mirrored);
                    }
                    Photograph::Eight(raster)
                }
                unchanged => unchanged,
            }
        })
    }

    #[test]
    fn two_photographs_alone_are_joined_although_what_lies_between_their_matches_differs() {
        let (options, context) = (StitchOptions::default(), StageContext::default());
        let warned = |photographs: usize| {
            let mut inputs = room_in_which_the_second_changed();
            inputs.photographs.truncate(photographs);
            let aligned = Stitcher::new(&options, &context).align(&inputs).expect("a panorama").alignments.remove(0);
            let is_warning = |one: &Diagnostic| one.code == JOINED_ALTHOUGH_DIFFERENT;
            (aligned.project.used(), aligned.project.diagnostics.iter().filter(|one| is_warning(one)).count())
        };
        assert_eq!(warned(2), (2, 1));
        // Beside others, what looks different is believed to be.
        assert_eq!(warned(3).1, 0);
    }

    /// The room's first two photographs have half of the agreeing matches that are asked for, in coarse looks as well,
    /// and show the same.
    #[test]
    fn few_matches_join_what_looks_alike() {
        let context = StageContext::default();
        let aligned = |options: &StitchOptions| {
            let mut inputs = room_in_memory(|photograph| photograph);
            inputs.photographs.truncate(2);
            Stitcher::new(options, &context).align(&inputs).expect("a panorama").alignments.remove(0).project
        };
        let mut options = StitchOptions::default();
        let [pair] = aligned(&options).pairs.try_into().expect("one pair");
        assert_eq!(pair.verdict, PairVerdict::Joined);
        options.matching.matching.min_inliers = 2 * pair.inliers;
        let by_looks = aligned(&options);
        assert_eq!(by_looks.pairs[0].verdict, PairVerdict::JoinedByLooks);
        assert!(by_looks.diagnostics.iter().any(|one| one.code == JOINED_BY_LOOKS));
    }
}
