//! Which photograph a panorama shows where, and the photographs made small: what pictures of a panorama are drawn from.

use trueup_compose::render::Rendered;
use trueup_compose::seam::NOBODY;
use trueup_core::Result;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;

use crate::pipeline::Alignment;

/// Which photograph a panorama shows where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShownPhotographs {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Position in [`crate::Project::images`] of the photograph shown, row by row; `None` where none is.
    pub positions: Vec<Option<usize>>,
}

impl Alignment {
    /// Which photograph what was `rendered` of this shows where, on a raster of `width` x `height` places over the
    /// whole panorama; `None` where photographs were averaged.
    pub fn shown(&self, rendered: &Rendered, [width, height]: [usize; 2]) -> Option<ShownPhotographs> {
        let canvas = [self.layout().width, self.layout().height];
        let labels = rendered.seams.as_ref()?.on_places(&self.kept(), canvas, [width, height]);
        let position = |label: u16| {
            let placed = self.layout().placed.get(usize::from(label)).filter(|_| label != NOBODY)?;
            Some(self.position_of(placed.photograph))
        };
        Some(ShownPhotographs { width, height, positions: labels.into_iter().map(position).collect() })
    }

    /// The photograph in use at this position of [`crate::Project::images`], reduced to at most `max_pixels`: 8-bit RGB
    /// in the color space of the panorama, as it was taken; `None` if it is not used.
    ///
    /// # Errors
    /// Those of decoding it.
    pub fn reduced(&self, position: usize, max_pixels: f64) -> Result<Option<Raster<u8>>> {
        let used = self.project.used_positions();
        let numbers = self.photographs().sources();
        let Some(number) = (0..numbers.len()).find(|&number| self.position_of(number) == position) else {
            return Ok(None);
        };
        if used.binary_search(&position).is_err() {
            return Ok(None);
        }
        let frame = WorkingFrame::new(numbers[number].width, numbers[number].height, max_pixels);
        Ok(Some(self.photographs().working(number, &frame, max_pixels)?.thumbnail))
    }
}
