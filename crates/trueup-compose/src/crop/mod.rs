//! Cropping: the part of the canvas that becomes the panorama.

#[cfg(test)]
mod tests;

use nalgebra::Vector2;

use crate::gaps::Gaps;
use crate::layout::{CanvasLayout, CanvasOptions, Placed, reaches_into};

pub use crate::coverage::{Coverage, Rectangle};
pub use crate::layout::Crop;

/// The rectangle of the canvas that is to be kept; `None` for all of it. Of a full turn, rows alone are cut.
///
/// Gaps that will be filled are no holes.
pub fn choose(layout: &CanvasLayout, options: &CanvasOptions) -> Option<Rectangle> {
    let &CanvasOptions { crop, min_kept, fill, .. } = options;
    if crop == Crop::None {
        return None;
    }
    let mut coverage = Coverage::of(layout);
    if fill > 0.0 {
        coverage = Gaps::find(layout, coverage, fill).filled_coverage();
    }
    let rectangle = match layout.period {
        None => coverage.largest_rectangle(),
        Some(_) => coverage.longest_whole_rows(),
    };
    let enough = match crop {
        Crop::None => false,
        Crop::Rectangle => rectangle.area() > 0,
        Crop::Auto => rectangle.area() > 0 && rectangle.area() as f64 >= min_kept * coverage.area() as f64,
    };
    let all = rectangle.columns == (0..layout.width) && rectangle.rows == (0..layout.height);
    (enough && !all).then_some(rectangle)
}

/// The layout of a part of its canvas; photographs that show nothing of it are left out.
pub fn cropped(layout: CanvasLayout, rectangle: &Rectangle) -> CanvasLayout {
    let shift = [rectangle.columns.start, rectangle.rows.start].map(|start| start as f64);
    let size = [rectangle.columns.len(), rectangle.rows.len()];
    let moved = |mut placed: Placed| {
        for vertex in &mut placed.mesh.target {
            *vertex = [vertex[0] - shift[0], vertex[1] - shift[1]];
        }
        placed
    };
    let around = layout.period.is_some();
    let placed = layout.placed.into_iter().map(moved).filter(|placed| shows(placed, around, size)).collect();
    let origin = [0, 1].map(|axis| layout.origin[axis] + shift[axis] / layout.canvas_from_target);
    CanvasLayout { width: size[0], height: size[1], origin, placed, ..layout }
}

/// Whether a photograph reaches into a canvas of `size` pixels.
fn shows(placed: &Placed, around: bool, size: [usize; 2]) -> bool {
    let end = Vector2::new(size[0] as f64, size[1] as f64);
    reaches_into(&placed.mesh, around, Vector2::zeros(), end)
}
