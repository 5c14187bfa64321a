//! How many pixels the canvas has.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::canvas::Placed;
use super::cylinder::unit_of_turn;
use super::options::CanvasOptions;

/// Target pixels per source pixel: median over the cells of the square root of target area per source area.
pub fn median_cell_scale(mesh: &GridMesh) -> f64 {
    let mut scales: Vec<f64> = mesh
        .whole_cells()
        .map(|corners| {
            let step = mesh.source(corners[2]) - mesh.source(corners[0]);
            let [top_left, top_right, bottom_right, bottom_left] =
                corners.map(|vertex| Vector2::from(mesh.target[vertex]));
            // Area of a quadrilateral from its diagonals.
            let (falling, rising) = (bottom_right - top_left, top_right - bottom_left);
            (0.5 * falling.perp(&rising).abs() / (step.x * step.y)).sqrt()
        })
        .collect();
    scales.sort_by(f64::total_cmp);
    scales.get(scales.len() / 2).copied().unwrap_or(0.0)
}

/// The largest canvas that is not reduced.
pub(super) fn most_pixels(placed: &[Placed], options: &CanvasOptions) -> f64 {
    /// Canvases of up to so many pixels are made in minutes; their growth is not looked at.
    const ANY_GROWTH_PIXELS: f64 = 400e6;
    let photographs: f64 = placed.iter().map(|item| item.mesh.width * item.mesh.height).sum();
    let grown = options.max_growth * photographs * options.scale.powi(2);
    options.max_pixels.min(grown.max(ANY_GROWTH_PIXELS))
}

/// Width and height of the canvas in whole pixels, at least 1 each. Around a cylinder the width is the nearest multiple
/// of its unit to its `period`, and the height follows from the scale which that makes.
pub(super) fn canvas_size(extent: Vector2<f64>, scale: f64, period: Option<f64>) -> [f64; 2] {
    // A photograph of 100 px placed at a fractional offset spans 100 px plus rounding; that is no 101st column.
    const ROUNDING_PX: f64 = 1e-6;
    let whole = |length: f64| (length - ROUNDING_PX).ceil().max(1.0);
    match period {
        None => [whole(extent.x * scale), whole(extent.y * scale)],
        Some(period) => {
            // The cast saturates.
            let unit = unit_of_turn((period * scale) as usize) as f64;
            let width = ((period * scale / unit).round() * unit).max(1.0);
            [width, whole(extent.y * (width / period))]
        }
    }
}

/// The largest scale, at most `wanted`, whose canvas holds at most `max_pixels`.
pub(super) fn scale_within(size: impl Fn(f64) -> [f64; 2], extent: Vector2<f64>, wanted: f64, max_pixels: f64) -> f64 {
    // Just below the exact ratio, so that rounding up to whole pixels fits after a step or two.
    const SAFETY: f64 = 1.0 - 1e-6;
    // Neither side alone may exceed the limit; this keeps the product below finite.
    let mut scale = wanted.min(max_pixels / extent.max());
    loop {
        let [width, height] = size(scale);
        let pixels = width * height;
        if pixels <= max_pixels {
            return scale;
        }
        scale *= (max_pixels / pixels).sqrt() * SAFETY;
    }
}
