//! What the phases hand on.

use std::sync::Arc;

use trueup_align::vanishing::TriadOutcome;
use trueup_compose::crop::{self, Frame, Rectangle};
use trueup_compose::exposure::Corrections;
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::RenderInput;
use trueup_core::diagnostics::{Reported, add_seconds};
use trueup_core::lines::LineSegment;
use trueup_core::source::{PhotographSource, SourceImage, WorkingFrame};
use trueup_io::decode::FilePhotographs;

use super::matched::Matched;
use crate::memo::MemoryStore;
use crate::project::fill::record_crop;
use crate::project::record::{CropRecord, Project};
use crate::report::evidence::Evidence;

/// What [`Stitcher::align`](super::Stitcher::align) found: one alignment per group of
/// photographs to be stitched, the largest first.
#[derive(Debug)]
pub struct Aligned {
    /// At least one.
    pub alignments: Vec<Alignment>,
}

/// Photographs that were found, measured and matched, ready to be aligned.
#[derive(Debug)]
pub struct MatchedPhotographs {
    pub(super) matched: Matched,
    /// What was told on the way.
    pub(super) told: Reported<()>,
    pub(super) memory: Option<MemoryStore>,
}

impl MatchedPhotographs {
    /// Lets alignments share the cameras and overlaps that they have in common: for experiments that align the same
    /// photographs many times. The seconds that a shared stage took when it ran are counted in every alignment.
    #[must_use]
    pub fn remembering(self) -> Self {
        Self { memory: Some(MemoryStore::default()), ..self }
    }

    /// The photographs' files, in the order of [`Project::images`].
    pub fn images(&self) -> &[SourceImage] {
        &self.matched.set.images
    }

    /// The photographs' pixels, in the order of [`Project::images`].
    pub fn photographs(&self) -> &(dyn PhotographSource + Sync) {
        self.matched.set.files.as_ref()
    }

    /// The line segments of a photograph, in the pixels of its working frame; `None` if it could not be decoded.
    pub fn lines_of(&self, photograph: usize) -> Option<(&[LineSegment], WorkingFrame)> {
        let measured = self.matched.measured.get(photograph)?.as_ref()?;
        Some((&measured.lines, measured.frame))
    }
}

/// The geometry of one panorama, ready to be composed. Copies share the photographs.
#[derive(Debug, Clone)]
pub struct Alignment {
    /// The record so far; complete but for what composing finds: what of the canvas is kept (until then, all of it is
    /// recorded), and the seconds that composing and writing take.
    pub project: Project,
    /// All of the canvas.
    pub(super) layout: CanvasLayout,
    /// What becomes of it; `None` until that is decided: by the record, or by the first composing.
    pub(super) kept: Option<Frame>,
    pub(super) corrections: Corrections,
    pub(super) photographs: Arc<FilePhotographs>,
    pub(super) directions: Vec<TriadOutcome>,
    /// Positions in [`Project::images`] of the photographs that the layout numbers, where these numbers are others.
    pub(super) positions: Option<Vec<usize>>,
    /// What another view is measured by; `None` where nothing was matched, or the geometry is read from a record.
    pub(super) evidence: Option<Arc<Evidence>>,
}

impl Alignment {
    /// What its panorama is rendered from, before it is cropped.
    pub(crate) fn render_input(&self) -> RenderInput<'_> {
        self.render_input_on(&self.layout)
    }

    /// The same photographs in the same light on another canvas.
    pub(crate) fn render_input_on<'a>(&'a self, layout: &'a CanvasLayout) -> RenderInput<'a> {
        RenderInput { layout, corrections: &self.corrections, photographs: self.photographs.as_ref() }
    }

    /// Where the photographs lie on all of the canvas.
    pub(crate) fn layout(&self) -> &CanvasLayout {
        &self.layout
    }

    /// The position in [`Project::images`] of the photograph that the layout gives this number.
    pub(crate) fn position_of(&self, number: usize) -> usize {
        match &self.positions {
            Some(positions) => positions.get(number).copied().unwrap_or(number),
            None => number,
        }
    }

    /// What of the canvas is the panorama: all of it before it is composed.
    pub(crate) fn kept(&self) -> Rectangle {
        self.kept.as_ref().unwrap_or(&Frame::Whole).part_of([self.layout.width, self.layout.height])
    }

    /// Where the photographs lie on the panorama.
    pub(crate) fn kept_layout(&self) -> CanvasLayout {
        crop::cropped(self.layout.clone(), &self.kept())
    }

    /// The photographs, in the order of [`Project::images`].
    pub(crate) fn photographs(&self) -> &FilePhotographs {
        &self.photographs
    }

    /// The vanishing directions of the photographs used, in their order; none for a single photograph, and where the
    /// geometry is a recorded one.
    pub fn directions(&self) -> &[TriadOutcome] {
        &self.directions
    }

    /// Records what of the canvas is the panorama.
    pub(super) fn keep(&mut self, kept: Frame, lost: f64, filled: f64) {
        let (canvas_width, canvas_height) = (self.layout.width, self.layout.height);
        if self.project.crop.is_none() {
            let part = kept.part_of([canvas_width, canvas_height]);
            let (left, top) = (part.columns.start, part.rows.start);
            let crop = CropRecord { left, top, canvas_width, canvas_height, lost, filled };
            record_crop(&mut self.project, &part, crop);
        }
        self.kept = Some(kept);
    }

    /// Adds what a later stage told, of photographs as the layout numbers them, to the record.
    pub(crate) fn record(&mut self, told: Reported<()>) {
        let told = told.renumbered(|number| self.position_of(number));
        self.project.diagnostics.extend(told.findings);
        add_seconds(&mut self.project.seconds, told.seconds);
    }
}
