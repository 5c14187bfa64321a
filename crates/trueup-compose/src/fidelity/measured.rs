//! A panorama and the photographs it is compared with.

use trueup_core::raster::Raster;

use crate::distance::border_distances;
use crate::render::Layer;

/// A panorama and its photographs on one canvas.
pub(super) struct MeasuredPanorama<'a> {
    pub(super) gray: &'a Raster<f32>,
    pub(super) layers: &'a [Layer],
    /// Distances to the border of every layer's pixels, in thirds of a pixel.
    pub(super) depths: &'a [Vec<u32>],
    pub(super) shown: &'a [u16],
    /// Columns of a turn on a cylinder, its width; 0 on a plane.
    pub(super) turn: usize,
}

/// Distances to the border of a layer, in thirds of a pixel.
pub(super) fn depths(layer: &Layer) -> Vec<u32> {
    border_distances(layer.covered.data(), layer.covered.width())
}

/// Whether a layer lies on a canvas of this size, or `around` a cylinder of it.
pub(super) fn fits(layer: &Layer, [width, height]: [usize; 2], around: bool) -> bool {
    let in_one_turn = layer.left <= width && layer.gray.width() <= width;
    (layer.left + layer.gray.width() <= width || around && in_one_turn) && layer.top + layer.gray.height() <= height
}

/// Index of a canvas pixel within a layer, if it lies in its box, on a cylinder of `turn` columns or with 0 on a plane.
pub(super) fn index(layer: &Layer, x: usize, y: usize, turn: usize) -> Option<usize> {
    let x = if x < layer.left { x + turn } else { x };
    let (column, row) = (x.checked_sub(layer.left)?, y.checked_sub(layer.top)?);
    let inside = column < layer.gray.width() && row < layer.gray.height();
    inside.then(|| row * layer.gray.width() + column)
}

/// The level of a photograph at a canvas pixel, if it covers it.
pub(super) fn level(layer: &Layer, x: usize, y: usize, turn: usize) -> Option<f64> {
    let at = index(layer, x, y, turn)?;
    layer.covered.data()[at].then(|| f64::from(layer.gray.data()[at]))
}
