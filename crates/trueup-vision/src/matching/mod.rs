//! Matches between pairs of photographs, and which pairs overlap.
//!
//! Descriptors are compared exhaustively (`putative`), what was written at the same place of both photographs is left
//! out (`written`), a homography is sought that many matches agree on (`ransac`), the pair is judged by how many do
//! (`pair`), and the matches of a joined pair are completed by further planes (`planes`). Where a lens bends so that no
//! homography holds, or is told, turns are sought on rays (`turned`), and stand in for the homography. What surrounds a
//! match places it more exactly than its features (`refined`), and what lies between matches tells equal things from
//! one thing (`resemblance`). What the pairs show of each other tells which pictures are no photographs of the scene
//! (`strangers`). Whether or not homographies explain it, `consistent` finds what two photographs show alike, to
//! measure a panorama by (`epipolar`).

mod compared;
mod consistent;
mod duplicates;
mod epipolar;
mod local;
mod matched_points;
mod options;
mod overlap;
mod pair;
mod planes;
mod putative;
mod ransac;
mod refined;
mod resemblance;
mod search;
mod strangers;
#[cfg(test)]
mod tests;
mod turned;
mod written;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::matches::PairMatches;
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::told_lens::ToldLens;
use trueup_core::{Result, StageContext};

pub use consistent::{SeenFeatures, consistent_matches};
pub use duplicates::report_near_duplicates;
pub use options::MatchingOptions;
pub use putative::{PutativeMatch, putative_matches};
pub use search::{Nearest, Neighbor, SearchKernel};
pub use strangers::{Stranger, StrangerKind, StrangersInput, find_strangers};

pub(crate) use overlap::PredictedOverlap;
pub(crate) use search::{squared_distance, squared_distances};

use crate::features::{FeatureSource, Features, no_photograph};
use pair::{PairInput, PhotographFeatures, match_pair};

/// What a pair must show to be joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Demand {
    /// As many agreeing matches as the test of a pair wants, and nothing between them that looks different.
    Test,
    /// That, or two fifths of [`MatchingOptions::min_inliers`] that agree, if all that they lay over each other looks
    /// alike.
    FewIfAlike,
    /// The few agreeing matches that suffice where the user says that the photographs overlap, whatever they look like.
    Graph,
}

/// What matching reads.
#[derive(Debug, Clone, Copy)]
pub struct MatchingInput<'a> {
    /// Every photograph's features.
    pub features: &'a dyn FeatureSource,
    /// The frames these are measured in, one a photograph.
    pub frames: &'a [WorkingFrame],
    /// What the user told of each photograph's lens.
    pub told: &'a [ToldLens],
    /// The pairs to match, by the photographs' indices.
    pub pairs: &'a [(usize, usize)],
    /// What each of them must show to be joined.
    pub demand: Demand,
}

impl<'a> MatchingInput<'a> {
    /// A photograph that has these features.
    fn photograph<'b>(&self, index: usize, features: &'b Features) -> Result<PhotographFeatures<'b>>
    where
        'a: 'b,
    {
        match (self.frames.get(index), self.told.get(index)) {
            (Some(frame), Some(&told)) => Ok(PhotographFeatures { index, features, frame, told }),
            _ => Err(no_photograph(index)),
        }
    }
}

/// Matches the photographs of every pair, in parallel, and judges whether they overlap; the results are in the order of
/// the pairs, each naming the smaller index first.
///
/// A pair is joined if its homography is believable in the overlap it predicts, and the matches that agree with it are
/// at least `min_inliers` and pass the Brown-Lowe test, unless what lies between them looks different. [`Demand`] says
/// of which pairs fewer must agree.
///
/// # Errors
/// [`trueup_core::Error::Options`]; [`trueup_core::Error::Input`] if a pair names a photograph that is not there or
/// twice the same, or if features contradict themselves; those of reading features; [`trueup_core::Error::Cancelled`].
pub fn run(
    input: &MatchingInput<'_>,
    options: &MatchingOptions,
    context: &StageContext<'_>,
) -> Result<Vec<PairMatches>> {
    const STAGE: &str = MatchingOptions::STAGE;
    context.progress().begin(STAGE, input.pairs.len() as u64);
    // Pairs of one photograph in a row get its features once.
    let groups: Vec<&[(usize, usize)]> = input.pairs.chunk_by(|one, next| one.0 == next.0).collect();
    let matched: Result<Vec<Vec<PairMatches>>> = groups
        .into_par_iter()
        .map(|group| {
            let a = group[0].0;
            let of_a = input.features.features(a)?;
            let match_one = |&(_, b): &(usize, usize)| {
                let of_b = input.features.features(b)?;
                let pair = PairInput::new(input.photograph(a, &of_a)?, input.photograph(b, &of_b)?, input.demand);
                let matches = match_pair(&pair, options, context)?;
                context.progress().advance(STAGE, 1);
                Ok(matches)
            };
            group.par_iter().map(match_one).collect()
        })
        .collect();
    context.progress().finish(STAGE);
    Ok(matched?.concat())
}
