//! Others who do a part of rendering, and what they are handed.

use serde::{Deserialize, Serialize};
use trueup_core::Result;

use crate::blend::{RegionOf, RegionWork, TakeRegion};
use crate::crop::CellsAhead;
use crate::small_views::TakeSmall;

/// Others who do a part of rendering.
pub trait RenderHelpers: Sync {
    /// Has the photographs at these positions made small by [`make_small`](super::make_small), and hands each once, in
    /// any order, to `take`.
    ///
    /// # Errors
    /// What keeps them from it; those of `take`.
    fn make_small(&self, work: &SmallWork, positions: &[usize], take: TakeSmall<'_>) -> Result<()>;

    /// Has regions 0 to `count` finished by [`finish_region`](super::finish_region), and hands each once, in any order,
    /// to `take`. What `region` returns is large: no more of them are to be asked for than there is room for.
    ///
    /// # Errors
    /// What keeps them from it; those of `region` and `take`.
    fn finish(&self, work: &RegionWork, count: usize, region: RegionOf<'_>, take: TakeRegion<'_>) -> Result<()>;
}

/// What making photographs small takes beside what is rendered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SmallWork {
    /// Where the photographs are looked at for a frame; `None` if none is chosen.
    pub(crate) border: Option<CellsAhead>,
}
