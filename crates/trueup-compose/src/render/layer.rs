//! One photograph alone on the canvas, for measuring.

use std::borrow::Cow;

use trueup_core::Result;
use trueup_core::raster::{LUMA, Raster};
use trueup_core::source::PhotographSource;

use super::prepared::{Prepared, Scratch, Window, check_photograph};
use super::{BAND_ROWS, RenderOptions, check};
use crate::exposure::Correction;
use crate::layout::{CanvasLayout, TURNS, columns_around};
use crate::transfer_curve::Encode;
use crate::weights::WHOLE;

/// What one photograph shows of the canvas: its bounding box there. On a cylinder it may run past the width into the next
/// turn, but does not meet itself.
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
    let size = [layout.width * if layout.period.is_some() { TURNS } else { 1 }, layout.height];
    let mesh = &placed.in_first_turn(layout.period).mesh;
    let prepared = Prepared::new(Cow::Owned(photograph), mesh, size, &corrections[position], options);
    let (all, rows) = (prepared.columns(), prepared.rows());
    let columns = all.start..all.end.min(all.start + layout.period.unwrap_or(all.len()));
    let (on_canvas, turned) = columns_around(columns.clone(), layout.period);
    let (width, height) = (columns.len(), rows.len());
    let mut layer = Layer {
        left: on_canvas.start,
        top: rows.start,
        gray: Raster::new(width, height, 1),
        covered: Raster::new(width, height, 1),
    };
    let encode = Encode::table();
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
            layer.gray.row_mut(y - rows.start).rotate_right(turned);
            layer.covered.row_mut(y - rows.start).rotate_right(turned);
        }
    }
    Ok(layer)
}
