//! Who does tasks.

use trueup_compose::render::{self, RenderInput};
use trueup_core::scratch::NoScratch;
use trueup_core::{Error, Result, StageContext};
use trueup_vision::matching::{self, MatchingInput};

use super::tasks::{
    Common, FinishTask, Kind, MatchResult, MatchTask, MeasureResult, MeasureTask, Placement, SmallResult, SmallTask,
    damaged, read, written,
};
use crate::memo::{Memo, PROGRAM};
use crate::pipeline::light::WantedLight;
use crate::pipeline::measure::{self, MeasureInput};
use crate::pipeline::photographs::{FoundPhotographs, PhotographSet};
use crate::pipeline::shelf::Shelf;
use crate::pipeline::{composing_resources, scratch_folder};

/// Does tasks that a [`Stitcher`](crate::Stitcher) hands out by [`Workers`](super::Workers), in whatever program it did
/// not itself.
#[derive(Debug)]
pub struct Worker {
    common: Common,
    /// The photographs; `None` if they are not looked at.
    set: Option<PhotographSet>,
}

impl Worker {
    /// Gets ready for tasks that have `common` in common. Where photographs are looked at, their headers are read, and
    /// what is decoded of a small set is kept for further tasks.
    ///
    /// # Errors
    /// [`Error::Input`] if another version of the program wrote `common`; [`Error::Limits`] if a photograph is too
    /// large for the memory.
    pub fn new(common: &[u8], context: &StageContext) -> Result<Self> {
        let common: Common = read(common)?;
        if common.program != PROGRAM {
            return Err(Error::input(
                "work that is divided",
                format!("it was handed out by {}, and this is {PROGRAM}", common.program),
                "Run the same version of trueup on all machines.",
            ));
        }
        common.options.validate()?;
        // Only photographs whose light ends at white are handed out.
        let light = WantedLight::Known(None);
        let found = FoundPhotographs { images: common.images.clone(), light, ..FoundPhotographs::default() };
        let set = match common.kind {
            Kind::Match => None,
            _ => Some(PhotographSet::open(found, &common.options, context)?),
        };
        Ok(Self { common, set })
    }

    /// Does one task, on the current thread pool; what comes of it goes back to who handed it out.
    ///
    /// # Errors
    /// [`Error::Input`] if the task is none; what the work meets; [`Error::Cancelled`].
    pub fn run(&self, task: &[u8], context: &StageContext) -> Result<Vec<u8>> {
        let context = &context.seeded(self.common.options.matching.random.seed);
        match (&self.common.kind, &self.set) {
            (Kind::Measure { keep_grays }, Some(set)) => {
                written(&self.measured(set, &read(task)?, *keep_grays, context)?)
            }
            (Kind::Match, _) => written(&self.matched(read(task)?, context)?),
            (Kind::Small { panorama, work }, Some(set)) => {
                let positions: SmallTask = read(task)?;
                let mut made = SmallResult::new();
                self.composing(set, panorama, |input, resources| {
                    let render = &self.common.options.compose.render;
                    render::make_small(input, resources, render, work, &positions, context, &mut |_, one| {
                        made.push(one);
                        Ok(())
                    })
                })?;
                written(&made)
            }
            (Kind::Finish { panorama, work }, Some(set)) => {
                let region: FinishTask = read(task)?;
                let finished = self.composing(set, panorama, |input, resources| {
                    let render = &self.common.options.compose.render;
                    render::finish_region(input, resources, render, work, region, context)
                })?;
                written(&finished)
            }
            (_, None) => Err(damaged("there are no photographs")),
        }
    }

    fn measured(
        &self,
        set: &PhotographSet,
        task: &MeasureTask,
        keep_grays: bool,
        context: &StageContext,
    ) -> Result<MeasureResult> {
        if task.iter().any(|&photograph| photograph >= set.images.len()) {
            return Err(damaged("there is no such photograph"));
        }
        let shelf = &Shelf::new(&NoScratch, 0, usize::MAX);
        let input = MeasureInput { set, memo: Memo::default(), shelf, keep_grays, workers: None };
        measure::of_some(&input, task, &self.common.options.measure, context)
    }

    fn matched(&self, task: MatchTask, context: &StageContext) -> Result<MatchResult> {
        let MatchTask { photographs, pairs, demand } = task;
        let restored: Option<Vec<_>> = photographs.into_iter().map(super::tasks::FeaturesOfOne::restored).collect();
        let (mut features, mut frames, mut told) = (Vec::new(), Vec::new(), Vec::new());
        for (of_one, frame, lens) in restored.ok_or_else(|| damaged("descriptors"))? {
            features.push(of_one);
            frames.push(frame);
            told.push(lens);
        }
        let input = MatchingInput { features: &features, frames: &frames, told: &told, pairs: &pairs, demand };
        matching::run(&input, &self.common.options.matching.matching, context)
    }

    fn composing<T>(
        &self,
        set: &PhotographSet,
        Placement { layout, corrections }: &Placement,
        work: impl FnOnce(&RenderInput<'_>, &render::Resources<'_>) -> Result<T>,
    ) -> Result<T> {
        if layout.placed.iter().any(|placed| placed.photograph >= set.images.len()) {
            return Err(damaged("there is no such photograph"));
        }
        let options = &self.common.options;
        let scratch = scratch_folder(layout, options, None)?;
        let resources = composing_resources(options, &set.files, &scratch);
        work(&RenderInput { layout, corrections, photographs: set.files.as_ref() }, &resources)
    }
}
