//! Regions of the canvas that others finish.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use trueup_core::Result;

use crate::coverage::Rectangle;
use crate::pyramid::PyramidPlane;
use crate::seam::Seams;
use crate::small_views::CoarseLevel;
use crate::store::RootPixel;

/// A region by its number.
pub type RegionOf<'a> = &'a dyn Fn(usize) -> Result<Region>;

/// Takes what a region became, with its number.
pub type TakeRegion<'a> = &'a mut dyn FnMut(usize, FinishedRegion) -> Result<()>;

/// What finishing any region takes beside what is rendered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RegionWork {
    pub(crate) seams: Seams,
    /// The coarse levels, blended; `None` to cut along the seams.
    pub(crate) blended: Option<PyramidPlane<[f32; 4]>>,
    /// Bytes of each photograph.
    pub(crate) bytes: Vec<usize>,
}

/// A region of the canvas.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Region {
    /// What of it is to be finished.
    pub(crate) parts: Vec<Rectangle>,
    /// The own coarse levels of the placements that it shows.
    pub(crate) own: Vec<(usize, CoarseLevel)>,
}

/// A finished region.
#[derive(Debug, Serialize, Deserialize)]
pub struct FinishedRegion {
    pub(crate) tiles: Vec<FinishedTile>,
    /// The placements that it shows.
    pub(crate) shown: Vec<usize>,
}

/// A tile of the canvas.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct FinishedTile {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    /// Row by row.
    #[serde(with = "crate::bulk")]
    pub(crate) pixels: Vec<RootPixel>,
}
