//! How a stitcher divides rendering.

use trueup_compose::render::{FinishedRegion, RegionOf, RegionWork, RenderHelpers, SmallWork, TakeRegion, TakeSmall};
use trueup_core::Result;
use trueup_core::source::SourceImage;

use super::Workers;
use super::handing_out::{PHOTOGRAPHS_PER_TASK, run};
use super::tasks::{Common, Kind, Placement, SmallResult, damaged};
use crate::options::StitchOptions;

/// Workers that render one panorama.
pub(crate) struct DividedRendering<'a> {
    workers: &'a dyn Workers,
    options: &'a StitchOptions,
    images: Vec<SourceImage>,
    panorama: Placement,
}

impl<'a> DividedRendering<'a> {
    pub(super) fn new(
        workers: &'a dyn Workers,
        options: &'a StitchOptions,
        images: Vec<SourceImage>,
        panorama: Placement,
    ) -> Self {
        Self { workers, options, images, panorama }
    }

    fn common(&self, kind: impl FnOnce(Placement) -> Kind) -> Common {
        let Placement { layout, corrections } = &self.panorama;
        let panorama = Placement { layout: layout.clone(), corrections: corrections.clone() };
        Common::new(self.options, self.images.clone(), kind(panorama))
    }
}

impl RenderHelpers for DividedRendering<'_> {
    fn make_small(&self, work: &SmallWork, positions: &[usize], take: TakeSmall<'_>) -> Result<()> {
        let common = self.common(|panorama| Kind::Small { panorama, work: work.clone() });
        let tasks: Vec<&[usize]> = positions.chunks(PHOTOGRAPHS_PER_TASK).collect();
        run(
            self.workers,
            &common,
            tasks.len(),
            |number| Ok(tasks[number].to_vec()),
            |number, made: SmallResult| {
                if made.len() != tasks[number].len() {
                    return Err(damaged("photographs are missing"));
                }
                tasks[number].iter().zip(made).try_for_each(|(&position, made)| take(position, made))
            },
        )
    }

    fn finish(&self, work: &RegionWork, count: usize, region: RegionOf<'_>, take: TakeRegion<'_>) -> Result<()> {
        let common = self.common(|panorama| Kind::Finish { panorama, work: work.clone() });
        run(self.workers, &common, count, region, |number, finished: FinishedRegion| take(number, finished))
    }
}
