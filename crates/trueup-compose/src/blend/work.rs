//! What all tiles need: options, labels, and the coarse levels, blended.

use std::sync::Arc;

use trueup_core::Result;
use trueup_core::mask::Mask;

use super::coarse::CoarseBlend;
use super::levels::WholeLevels;
use super::shown::ShownWhere;
use crate::pyramid::PyramidPlane;
use crate::small_views::CoarseLevels;
use crate::warped::Resampling;

/// Tiles for each thread that are finished before they are put on the canvas, while the next ones are.
pub(super) const TILES_AT_ONCE: usize = 8;

/// The coarse levels, blended.
pub(super) struct BlendedLevels {
    /// The blended level `first_level`.
    pub(super) blended: PyramidPlane<[f32; 4]>,
    /// The same level of every photograph.
    pub(super) own: CoarseLevels,
}

impl BlendedLevels {
    /// Blends what the photographs show `shown` where, so many of them `at_a_time`.
    pub(super) fn new(
        mut own: CoarseLevels,
        shown: ShownWhere<'_>,
        levels: WholeLevels,
        at_a_time: usize,
    ) -> Result<Self> {
        let blended = CoarseBlend { own: &own, shown, levels, at_a_time }.blend()?;
        own.level_all();
        Ok(Self { blended, own })
    }
}

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
