//! Cropping: the part of the canvas that becomes the panorama. Chosen last, when the panorama is there to be looked at, so
//! that neither seams nor light depend on it.

mod auto;
mod cells;
mod search;
mod smooth;
#[cfg(test)]
mod tests;
mod worth;

use trueup_core::Result;
use trueup_core::raster::RowSource;

use crate::layout::{CanvasLayout, CanvasOptions, Placed};

pub use crate::coverage::{Coverage, Rectangle};
pub use crate::layout::Crop;

/// The rectangle of the canvas that is to be kept; `None` for all of it as it is. Of a full turn, rows alone are cut.
///
/// `panorama` is all that was composed on the canvas of `layout`, and `coverage` what of it photographs cover, or what was
/// filled already. What [`Crop::Auto`] keeps may have holes that are to be filled: where the picture beside them is smooth.
///
/// # Errors
/// Those of reading the panorama.
pub fn choose(
    panorama: &dyn RowSource,
    layout: &CanvasLayout,
    coverage: &Coverage,
    options: &CanvasOptions,
) -> Result<Option<Rectangle>> {
    let is_enough = |rectangle: &Rectangle| match options.crop {
        Crop::Auto => coverage.area_within(rectangle) as f64 >= options.min_kept * coverage.area() as f64,
        Crop::None | Crop::Rectangle => true,
    };
    let rectangle = match (options.crop, layout.period) {
        (Crop::None, _) => None,
        (Crop::Rectangle, None) => Some(coverage.largest_rectangle()),
        (Crop::Rectangle, Some(_)) => Some(coverage.longest_whole_rows()),
        (Crop::Auto, _) => auto::rectangle(panorama, layout, coverage)?,
    };
    Ok(rectangle.filter(|rectangle| rectangle.area() > 0 && is_enough(rectangle)))
}

/// The layout of a part of its canvas. Photographs that show nothing of it stay, outside.
pub fn cropped(layout: CanvasLayout, rectangle: &Rectangle) -> CanvasLayout {
    let shift = rectangle.corner();
    let [width, height] = rectangle.size();
    let moved = |mut placed: Placed| {
        placed.mesh.target.iter_mut().for_each(|vertex| *vertex = [vertex[0] - shift[0], vertex[1] - shift[1]]);
        placed
    };
    let placed = layout.placed.into_iter().map(moved).collect();
    let origin = [0, 1].map(|axis| layout.origin[axis] + shift[axis] / layout.canvas_from_target);
    CanvasLayout { width, height, origin, placed, ..layout }
}
