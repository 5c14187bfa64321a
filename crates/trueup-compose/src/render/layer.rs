//! One photograph alone on the canvas, for measuring.

use std::borrow::Cow;

use trueup_core::Result;
use trueup_core::raster::{LUMA, Raster};
use trueup_core::source::PhotographSource;

use super::prepared::{Prepared, Scratch, Window, check_photograph};
use super::{BAND_ROWS, RenderOptions, check};
use crate::exposure::Correction;
use crate::layout::CanvasLayout;
use crate::transfer_curve::Encode;
use crate::weights::WHOLE;

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

/// Renders photograph `layout.placed[position]` alone, corrected, as [`super::run`] would.
///
/// # Errors
/// Those of [`super::run`], and [`trueup_core::Error::Input`] if there is no such position.
pub fn layer(
    layout: &CanvasLayout,
    corrections: &[Correction],
    position: usize,
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
) -> Result<Layer> {
    check(layout, corrections, options)?;
    let Some(placed) = layout.placed.get(position) else {
        return Err(trueup_core::Error::input(
            "canvas",
            format!("there is no photograph {position} on it"),
            "Ask for one of the photographs placed.",
        ));
    };
    let photograph = photographs.photograph(placed.photograph)?;
    check_photograph(placed, &photograph)?;
    let size = [layout.width, layout.height];
    let curve = photographs.transfer_curve();
    let light = (&curve, &corrections[position]);
    let prepared = Prepared::new(Cow::Owned(photograph), &placed.mesh, size, light, options);
    let (columns, rows) = (prepared.columns(), prepared.rows());
    let (width, height) = (columns.len(), rows.len());
    let mut layer = Layer {
        left: columns.start,
        top: rows.start,
        gray: Raster::new(width, height, 1),
        covered: Raster::new(width, height, 1),
    };
    let encode = Encode::of(&curve);
    let mut scratch = Scratch::default();
    let mut samples = Vec::new();
    for first in rows.clone().step_by(BAND_ROWS) {
        let band = first..(first + BAND_ROWS).min(rows.end);
        samples.resize(width * band.len(), [0.0; 4]);
        prepared.sample(Window { columns: &columns, rows: &band }, &mut samples, options, &mut scratch);
        for (y, samples) in band.zip(samples.chunks_exact(width.max(1))) {
            let gray = layer.gray.row_mut(y - rows.start);
            let covered = layer.covered.row_mut(y - rows.start);
            for ((gray, covered), sample) in gray.iter_mut().zip(covered).zip(samples) {
                let [r, g, b, share] = *sample;
                if share > 0.0 {
                    let levels = [r, g, b].map(|root| f32::from(encode.level(root * root)));
                    *gray = levels.iter().zip(LUMA).map(|(level, share)| level * share).sum();
                    *covered = share >= WHOLE;
                }
            }
        }
    }
    Ok(layer)
}
