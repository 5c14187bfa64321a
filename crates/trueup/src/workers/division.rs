//! How a stitcher divides measuring and matching.

use std::collections::BTreeSet;
use std::fmt;

use trueup_compose::exposure::Corrections;
use trueup_compose::layout::CanvasLayout;
use trueup_core::diagnostics::Reported;
use trueup_core::mask::Masks;
use trueup_core::matches::PairMatches;
use trueup_core::options::StageOptions;
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::matching::{MatchingInput, MatchingOptions};

use super::Workers;
use super::handing_out::{PHOTOGRAPHS_PER_TASK, run};
use super::rendering::DividedRendering;
use super::tasks::{
    Common, FeaturesOfOne, Kind, MatchResult, MatchTask, MeasureResult, MeasureTask, Placement, damaged,
};
use crate::options::StitchOptions;
use crate::pipeline::measured::Measured;

/// Pairs that a task matches. One takes a thread a few hundredths of a second; neighboring pairs have photographs in
/// common, which are handed over once for all of them.
const PAIRS_PER_TASK: usize = 64;

/// The workers of a stitcher, with its options.
#[derive(Clone, Copy)]
pub(crate) struct Division<'a> {
    workers: &'a dyn Workers,
    options: &'a StitchOptions,
}

impl fmt::Debug for Division<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Division").finish_non_exhaustive()
    }
}

impl<'a> Division<'a> {
    pub(crate) fn new(workers: &'a dyn Workers, options: &'a StitchOptions) -> Self {
        Self { workers, options }
    }

    /// What workers measure of `photographs`, with their numbers; those of which they find nothing are left out, as are
    /// those that only this program holds.
    ///
    /// # Errors
    /// Those of the workers; [`trueup_core::Error::Cancelled`].
    pub(crate) fn measured(
        &self,
        files: &FilePhotographs,
        photographs: &[usize],
        keep_grays: bool,
        context: &StageContext,
        mut take: impl FnMut(usize, Reported<Measured>),
    ) -> Result<()> {
        let Some(images) = elsewhere(files) else { return Ok(()) };
        let common = Common::new(self.options, images, Kind::Measure { keep_grays });
        let tasks: Vec<MeasureTask> = photographs.chunks(PHOTOGRAPHS_PER_TASK).map(<[usize]>::to_vec).collect();
        run(
            self.workers,
            &common,
            tasks.len(),
            |number| Ok(tasks[number].clone()),
            |number, result: MeasureResult| {
                context.check_cancelled()?;
                if result.len() != tasks[number].len() {
                    return Err(damaged("photographs are missing"));
                }
                for (&photograph, measured) in tasks[number].iter().zip(result) {
                    measured.into_iter().for_each(|measured| take(photograph, measured));
                }
                Ok(())
            },
        )
    }

    /// What workers find of the pairs of `input`, in their order, the smaller number first.
    ///
    /// # Errors
    /// Those of the workers; [`trueup_core::Error::Cancelled`].
    pub(crate) fn matched(&self, input: &MatchingInput, context: &StageContext) -> Result<Vec<PairMatches>> {
        let MatchingInput { features, frames, told, pairs, demand } = *input;
        const STAGE: &str = MatchingOptions::STAGE;
        context.progress().begin(STAGE, pairs.len() as u64);
        let common = Common::new(self.options, Vec::new(), Kind::Match);
        let ordered: Vec<(usize, usize)> = pairs.iter().map(|&(a, b)| (a.min(b), a.max(b))).collect();
        let tasks: Vec<&[(usize, usize)]> = ordered.chunks(PAIRS_PER_TASK).collect();
        let photographs_of = |number: usize| -> Vec<usize> {
            let both: BTreeSet<usize> = tasks[number].iter().flat_map(|&(a, b)| [a, b]).collect();
            both.into_iter().collect()
        };
        let task = |number: usize| {
            let photographs = photographs_of(number);
            // Ascending: which of a pair comes first is the same as here.
            let place = |photograph: usize| photographs.partition_point(|&other| other < photograph);
            let pair = |&(a, b): &(usize, usize)| (place(a), place(b));
            Ok(MatchTask {
                pairs: tasks[number].iter().map(pair).collect(),
                demand,
                photographs: photographs
                    .iter()
                    .map(|&one| Ok(FeaturesOfOne::new(features.features(one)?.as_ref(), frames[one], told[one])))
                    .collect::<Result<_>>()?,
            })
        };
        let mut found: Vec<MatchResult> = tasks.iter().map(|_| Vec::new()).collect();
        run(self.workers, &common, tasks.len(), task, |number, result: MatchResult| {
            context.check_cancelled()?;
            let photographs = photographs_of(number);
            let named = |pair: PairMatches| {
                Some(PairMatches { a: *photographs.get(pair.a)?, b: *photographs.get(pair.b)?, ..pair })
            };
            let result: Option<MatchResult> = result.into_iter().map(named).collect();
            let is_asked_for =
                |result: &MatchResult| result.iter().map(|pair| (pair.a, pair.b)).eq(tasks[number].iter().copied());
            found[number] = result.filter(is_asked_for).ok_or_else(|| damaged("other pairs"))?;
            context.progress().advance(STAGE, tasks[number].len() as u64);
            Ok(())
        })?;
        context.progress().finish(STAGE);
        Ok(found.concat())
    }

    /// Who renders photographs that lie on `layout` in this light; `None` if only this program holds the photographs.
    pub(crate) fn rendering(
        &self,
        files: &FilePhotographs,
        layout: &CanvasLayout,
        corrections: &Corrections,
    ) -> Option<DividedRendering<'a>> {
        let panorama = Placement { layout: layout.clone(), corrections: corrections.clone() };
        Some(DividedRendering::new(self.workers, self.options, elsewhere(files)?, panorama))
    }
}

/// The photographs as other programs find them; `None` if they cannot: pixels in memory, marked parts, and the range of
/// light that is brighter than white, are only here.
fn elsewhere(files: &FilePhotographs) -> Option<Vec<SourceImage>> {
    if files.light().is_some() {
        return None;
    }
    let is_only_here = |number: usize| {
        let Masks { ignored, kept } = files.given_masks(number);
        files.in_memory(number).is_some() || ignored.is_some() || kept.is_some()
    };
    let absolute = |image: &SourceImage| {
        let is_a_file = files.in_memory_photographs().of(image).is_none();
        let path = std::path::absolute(&image.path).ok().filter(|_| is_a_file)?;
        Some(SourceImage { path, ..image.clone() })
    };
    let image = |(number, image): (usize, &SourceImage)| {
        let mut image = absolute(image).filter(|_| !is_only_here(number))?;
        for member in &mut image.stack {
            member.source = absolute(&member.source)?;
        }
        Some(image)
    };
    files.sources().iter().enumerate().map(image).collect()
}
