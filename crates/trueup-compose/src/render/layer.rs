//! One photograph alone on the canvas, for measuring.

use trueup_core::Result;
use trueup_core::raster::{LUMA, Raster};
use trueup_core::source::PhotographSource;

use super::{BAND_ROWS, Prepared, RenderOptions, Scratch, check};
use crate::layout::CanvasLayout;
use crate::transfer_curve::Encode;
use crate::weights::alpha;

/// What one photograph shows of the canvas: its bounding box there.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// First column of the canvas.
    pub left: usize,
    /// First row of the canvas.
    pub top: usize,
    /// Rec. 601 luma of the encoded colours, 0 to 255, one channel; 0 outside the photograph.
    pub gray: Raster<f32>,
    /// Whether the photograph covers the whole pixel; one channel.
    pub covered: Raster<bool>,
}

/// Renders photograph `layout.placed[position]` alone, multiplied by its gain, as [`super::run`] would.
///
/// # Errors
/// Those of [`super::run`], and [`trueup_core::Error::Input`] if there is no such position.
pub fn layer(
    layout: &CanvasLayout,
    gains: &[f64],
    position: usize,
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
) -> Result<Layer> {
    check(layout, gains, options)?;
    let Some(placed) = layout.placed.get(position) else {
        return Err(trueup_core::Error::input(
            "canvas",
            format!("there is no photograph {position} on it"),
            "Ask for one of the photographs placed.",
        ));
    };
    let prepared = Prepared::new(placed, gains[position], layout, photographs, options)?;
    let (columns, rows) = (prepared.grid.columns.clone(), prepared.grid.rows.clone());
    let (width, height) = (columns.len(), rows.len());
    let mut layer = Layer {
        left: columns.start,
        top: rows.start,
        gray: Raster::new(width, height, 1),
        covered: Raster::new(width, height, 1),
    };
    let encode = Encode::table();
    let mut scratch = Scratch::default();
    for first in rows.clone().step_by(BAND_ROWS) {
        let band = first..(first + BAND_ROWS).min(rows.end);
        let mut sums = vec![[0.0; 4]; layout.width * band.len()];
        prepared.add_to_band(&band, &mut sums, layout.width, options, &mut scratch);
        for (y, sums) in band.zip(sums.chunks_exact(layout.width)) {
            let gray = layer.gray.row_mut(y - rows.start);
            let covered = layer.covered.row_mut(y - rows.start);
            for ((gray, covered), sum) in gray.iter_mut().zip(covered).zip(&sums[columns.clone()]) {
                let [r, g, b, weight] = *sum;
                if weight > 0.0 {
                    let levels = [r, g, b].map(|light| f32::from(encode.level(light / weight)));
                    *gray = levels.iter().zip(LUMA).map(|(level, share)| level * share).sum();
                    *covered = alpha(weight) >= 1.0;
                }
            }
        }
    }
    Ok(layer)
}
