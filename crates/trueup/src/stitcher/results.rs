//! What the stages hand on.

use std::sync::Arc;

use trueup_compose::exposure::Corrections;
use trueup_compose::layout::CanvasLayout;
use trueup_core::diagnostics::Diagnostic;
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;
use trueup_io::decode::FilePhotographs;

use crate::cache::Key;
use crate::clock::Clock;
use crate::matched::Matched;
use crate::memory::OverlapMemory;
use crate::project::Project;

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
    pub(super) photographs: Arc<FilePhotographs>,
    pub(super) clock: Clock,
    pub(super) findings: Vec<Diagnostic>,
    pub(super) memory: Option<OverlapMemory>,
    /// What decides each photograph's measurements; empty without a cache.
    pub(super) keys: Vec<Option<Key>>,
}

impl MatchedPhotographs {
    /// Lets alignments share the cameras and overlaps that they have in common: for experiments that align the same
    /// photographs many times. The seconds that a shared stage took when it ran are counted in every alignment.
    pub fn remembering(self) -> Self {
        Self { memory: Some(OverlapMemory::default()), ..self }
    }

    /// The photographs, in the order of [`Project::images`].
    pub(crate) fn photographs(&self) -> &FilePhotographs {
        &self.photographs
    }

    /// The line segments of a photograph, in the pixels of its working frame; `None` if it could not be decoded.
    pub(crate) fn lines_of(&self, photograph: usize) -> Option<(&[LineSegment], WorkingFrame)> {
        let measured = self.matched.measured.get(photograph)?.as_ref()?;
        Some((&measured.lines, measured.frame))
    }
}

/// The geometry of one panorama, ready to be composed.
#[derive(Debug)]
pub struct Alignment {
    /// The record so far; complete but for the seconds that composing and writing take.
    pub project: Project,
    pub(super) layout: CanvasLayout,
    pub(super) corrections: Corrections,
    pub(super) photographs: Arc<FilePhotographs>,
    pub(super) clock: Clock,
}

impl Alignment {
    /// Where the photographs lie on the canvas.
    pub(crate) fn layout(&self) -> &CanvasLayout {
        &self.layout
    }

    /// The photographs, in the order of [`Project::images`].
    pub(crate) fn photographs(&self) -> &FilePhotographs {
        &self.photographs
    }

    /// Adds what composing found to the record.
    pub(crate) fn record_findings(&mut self, findings: Vec<Diagnostic>) {
        self.project.diagnostics.extend(findings);
    }

    /// Adds the wall seconds that a later stage took to the record.
    pub(crate) fn record_seconds(&mut self, stage: &str, duration: std::time::Duration) {
        self.clock.add(stage, duration);
        self.project.seconds.clone_from(self.clock.seconds());
    }
}
