//! From a project's record to the alignment it describes, without measuring or matching.

use trueup_compose::exposure::Corrections;
use trueup_compose::layout::CanvasLayout;
use trueup_core::Result;
use trueup_core::source::SourceImage;
use trueup_io::color::PhotographColors;
use trueup_io::decode::FilePhotographs;

use super::{Alignment, Stitcher};
use crate::align::camera_groups;
use crate::arrangement;
use crate::clock::Clock;
use crate::masks::AllMasks;
use crate::measure;
use crate::project::Project;
use crate::record::record_composition;
use crate::recorded::Recorded;

impl Stitcher<'_> {
    /// The geometry that `project` records, over `images` with their `masks`: those used in it, in its order, or others of
    /// their sizes. The canvas is laid out anew if the options ask for another one, and the corrections estimated anew if
    /// they ask for that.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] if the project was damaged; [`Error::NotApplicable`] if a projection is asked
    /// for and the project has no cameras; those of the layout; [`Error::Limits`]; [`Error::Cancelled`].
    ///
    /// [`Error::Cancelled`]: trueup_core::Error::Cancelled
    /// [`Error::Input`]: trueup_core::Error::Input
    /// [`Error::Limits`]: trueup_core::Error::Limits
    /// [`Error::NotApplicable`]: trueup_core::Error::NotApplicable
    /// [`Error::Options`]: trueup_core::Error::Options
    pub(crate) fn recall(&self, project: &Project, images: Vec<SourceImage>, masks: AllMasks) -> Result<Alignment> {
        self.options.validate()?;
        let mut clock = Clock::default();
        let Recorded { used, layout, corrections, reference } = Recorded::new(project)?;
        let (photographs, at_once) = self.open(images, masks.masks)?;
        let arrangement =
            clock.time("canvas", || arrangement::recall(layout, reference, project, self.options, self.context))?;
        let corrections = match self.options.exposure == project.options.exposure {
            true => corrections,
            false => {
                clock.time("exposure", || self.correct_anew(&arrangement.plane, reference, (&photographs, at_once)))?
            }
        };
        let same_canvas = self.options.canvas == project.options.canvas;
        let mut project = Project { options: self.options.clone(), ..project.clone() };
        let images = photographs.images();
        record_composition(&mut project, &used, images, &masks.records, &arrangement, &corrections);
        project.color_space = photographs.colors().map(PhotographColors::name).unwrap_or_default();
        if !same_canvas {
            project.measures = None;
        }
        let layout = arrangement.written;
        // Photographs are numbered by their place among those used.
        let corrections = corrections.of_placed(&layout, Some);
        let mut alignment = Alignment { project, layout, corrections, photographs, clock };
        alignment.record_findings(self.context.take_diagnostics());
        alignment.project.seconds.clone_from(alignment.clock.seconds());
        Ok(alignment)
    }

    /// What evens out the light of photographs that were only decoded, each placed once in `layout`.
    fn correct_anew(
        &self,
        layout: &CanvasLayout,
        reference: usize,
        (photographs, at_once): (&FilePhotographs, usize),
    ) -> Result<Corrections> {
        let images: Vec<&SourceImage> = photographs.images().iter().collect();
        let thumbnails = measure::thumbnails(photographs, at_once, self.options, self.context)?;
        let thumbnails =
            thumbnails.iter().zip(camera_groups(&images)).map(|((raster, frame), camera)| (raster, *frame, camera));
        self.correct(layout, reference, photographs, thumbnails)
    }
}
