//! What all tiles need.

use std::sync::Arc;

use trueup_core::mask::Mask;

use super::levels::BlendedLevels;
use super::shown::ShownWhere;
use crate::warped::Resampling;

/// Tiles for each thread that are finished before they are put on the canvas.
pub(super) const TILES_AT_ONCE: usize = 16;

/// What all tiles need.
pub(super) struct BlendWork<'a> {
    pub(super) resampling: Resampling,
    pub(super) shown: ShownWhere<'a>,
    /// Log2 of the pixels per sample of the first level that is blended as a whole.
    pub(super) first_level: u32,
    /// `None` to cut without blending.
    pub(super) levels: Option<BlendedLevels>,
    /// What is ignored of the photograph of each placement.
    pub(super) ignored: Vec<Option<Arc<Mask>>>,
}
