//! What the similarity prior is made from.

use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::options::StageOptions;
use trueup_core::source::{RecordedGravity, WorkingFrame};
use trueup_core::{Error, Result};

use super::options::{PriorMethod, SimilarityOptions};
use crate::far_horizon::ShownPhotograph;
use crate::match_points::OverlapWarp;
use crate::vanishing::{TriadOutcome, VanishingOptions};

/// What the prior is made from. Photographs are counted 0..N; all lists but `gravity`, `shown`, `edges` and `overlaps`
/// have N entries.
#[derive(Debug, Clone, Copy)]
pub struct PriorInput<'a> {
    /// Which prior is wanted.
    pub method: PriorMethod,
    /// Cameras in working pixels, in any common world frame.
    pub cameras: &'a [Camera],
    /// Each photograph's vanishing directions.
    pub triads: &'a [TriadOutcome],
    /// Each photograph's segments, unfiltered.
    pub lines: &'a [Vec<LineSegment>],
    /// Each photograph's working frame.
    pub frames: &'a [WorkingFrame],
    /// Which way each photograph's camera recorded as down, if it did. May be empty: then none did.
    pub gravity: &'a [Option<RecordedGravity>],
    /// What the far horizon is sought in. May be empty: then it does not tell.
    pub shown: &'a [ShownPhotograph<'a>],
    /// The joined pairs.
    pub edges: &'a [PairMatches],
    /// Grid vertices carried across the pairs, both directions. May be empty: then overlaps correct nothing.
    pub overlaps: &'a [OverlapWarp],
    /// Largest cell of the grids of `overlaps`, working pixels.
    pub cell_px: f64,
    /// The options the triads were found with; they choose the segments of the joint refinement too.
    pub vanishing: &'a VanishingOptions,
    /// Clockwise turn in radians that the user wants on top of upright for the whole panorama.
    pub turn: f64,
    /// The reference photograph; only the published global similarity priors heed it.
    pub reference: usize,
}

impl PriorInput<'_> {
    /// Refuses what no prior can be made from.
    ///
    /// # Errors
    /// [`Error::Unsolvable`] if there are no photographs, the lists differ in length, an edge or the reference names a
    /// photograph that does not exist, a camera is not finite, or overlaps come without a usable grid.
    pub(super) fn check(&self) -> Result<()> {
        let input = self;
        let count = input.cameras.len();
        let unsolvable = |why: String| {
            Err(Error::unsolvable(SimilarityOptions::STAGE, "similarity prior", why, "Give one entry per photograph"))
        };
        if count == 0 {
            return unsolvable("there are no photographs".to_owned());
        }
        let gravity = if input.gravity.is_empty() { count } else { input.gravity.len() };
        let shown = if input.shown.is_empty() { count } else { input.shown.len() };
        let lengths = [input.triads.len(), input.lines.len(), input.frames.len(), gravity, shown];
        if lengths.iter().any(|&length| length != count) {
            return unsolvable(format!(
                "cameras, triads, segments, frames, gravity and what photographs show differ in number from {count}"
            ));
        }
        if let Some(edge) = input.edges.iter().find(|edge| edge.a >= count || edge.b >= count || edge.a == edge.b) {
            return unsolvable(format!("there is no pair {} - {} among {count} photographs", edge.a, edge.b));
        }
        if input.reference >= count {
            return unsolvable(format!("there is no reference {} among {count} photographs", input.reference));
        }
        let finite = |camera: &Camera| {
            camera.focal_px > 0.0
                && camera.focal_px.is_finite()
                && camera.camera_from_world.iter().flatten().all(|value| value.is_finite())
        };
        let frame_is_sane =
            |frame: &WorkingFrame| frame.width > 0.0 && frame.height > 0.0 && frame.diagonal().is_finite();
        let has_grid = input.cell_px >= 1.0 && input.frames.iter().all(frame_is_sane);
        if !input.overlaps.is_empty() && !has_grid {
            return unsolvable(format!("there is no grid of cells of {} pixels on every photograph", input.cell_px));
        }
        match input.cameras.iter().position(|camera| !finite(camera)) {
            Some(index) => unsolvable(format!("camera {index} is not finite")),
            None => Ok(()),
        }
    }
}
