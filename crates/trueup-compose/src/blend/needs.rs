//! How much memory blending takes, before there is anything to blend.

use super::levels::WholeLevels;
use super::parts::most_of_a_tile;
use super::work::TILES_AT_ONCE;
use crate::layout::Unrolled;
use crate::memory_plan::{PartsBytes, WorkBytes, decoding_bytes};
use crate::pyramid::{first_level, mask_margin, tile_side};
use crate::small_views::{RIM, SAMPLE_BYTES, small_size};
use crate::store::{Pixel, RootPixel};

/// Bytes of the search for seams per pixel of all small views: pixels at all levels, gradients, depths.
const SEARCH_VIEW: f64 = 4.0 * 4.0 / 3.0 + 4.0 + 1.0;
/// The same per pixel of their canvas: labels, parts that moved, flags, each at two levels.
const SEARCH_CANVAS: f64 = 16.0;
/// The same per pixel of the largest small view: the flow network.
const SEARCH_CUT: f64 = 36.0;
/// A photograph's pyramid, its masks and interpolated levels, and its samples before they are reduced, in pictures of
/// its finest level.
const COARSE_COPIES: f64 = 8.0;
/// A tile's photograph, sums, masks and interpolated levels, in pictures of the tile with its margin.
const TILE_COPIES: f64 = 8.0;

/// Bytes that the photographs of `unrolled`, of so many `bytes` each, take to be made small, cut along seams and, if
/// there are any coarse `levels`, blended; and what that takes where they are held in parts.
pub(crate) fn needed_bytes(
    unrolled: &Unrolled<'_>,
    levels: Option<WholeLevels>,
    bytes: &[usize],
) -> (WorkBytes, PartsBytes) {
    let layout = unrolled.original_layout();
    let several = layout.placed.len() > 1;
    let first_level = first_level([layout.width, layout.height]);
    let canvas = unrolled.canvas();
    let threads = rayon::current_num_threads().max(1) as f64;
    let sample = SAMPLE_BYTES as f64;
    // Every photograph's box on the canvas, at a scale and with so many pixels on all sides.
    let boxes = |scale: f64, rim: f64| {
        unrolled.placed().iter().map(move |placed| {
            let (low, high) = placed.mesh.bounds();
            let side = |axis: usize| {
                let whole = canvas[axis] as f64;
                (high[axis].clamp(0.0, whole) - low[axis].clamp(0.0, whole)) * scale + 2.0 * rim
            };
            side(0) * side(1)
        })
    };
    let largest = |areas: &[f64]| areas.iter().copied().fold(0.0, f64::max);
    let small = small_size([layout.width, layout.height], layout.period.is_some()).map(|length| length as f64);
    let views: Vec<f64> = boxes(small[0] / layout.width as f64, 1.0).collect();
    let searching =
        SEARCH_VIEW * views.iter().sum::<f64>() + SEARCH_CANVAS * small[0] * small[1] + SEARCH_CUT * largest(&views);
    // The grown box at the sampled level has two of its samples for each of the first.
    let own_levels: Vec<f64> = boxes(f64::from(1 << first_level).recip(), RIM as f64).collect();
    let whole: f64 = canvas.iter().map(|&length| length.div_ceil(1 << first_level) as f64).product();
    // The level cut along the seams, sums at all levels and what one of them is interpolated to, beside some
    // photographs' own levels, and a byte for each sample of all: how much of it is shown.
    let masks: f64 = own_levels.iter().sum();
    let levels_of_one = if levels.is_none() { 0.0 } else { sample * COARSE_COPIES * largest(&own_levels) };
    let coarse = |at_once: f64| match levels {
        None => 0.0,
        Some(_) => sample * (whole * (1.0 + 4.0 / 3.0 + 1.0)) + at_once * levels_of_one + masks,
    };
    let side = (tile_side(first_level) + 2 * mask_margin(first_level)) as f64;
    // Those that are put on the canvas, and the next ones.
    let finished = (2 * TILES_AT_ONCE * RootPixel::BYTES) as f64 * (tile_side(first_level) as f64).powi(2);
    let busy_tiles = threads * (sample * TILE_COPIES * side * side + finished);
    let blended = if several { sample * whole } else { 0.0 };
    let tiles = blended + busy_tiles;
    let working = if several { searching.max(coarse(threads)).max(tiles) } else { tiles };
    let own_levels = if levels.is_none() { 0.0 } else { sample * own_levels.iter().sum::<f64>() };
    let photograph = bytes.iter().copied().max().unwrap_or(0);
    let decoding = decoding_bytes(photograph);
    // The casts saturate.
    let parts = PartsBytes {
        making_small: (SEARCH_VIEW * views.iter().sum::<f64>()) as usize
            + decoding.max(photograph.saturating_add(levels_of_one as usize)),
        seams: if several { searching as usize } else { 0 },
        coarse: coarse(1.0) as usize,
        levels_of_one: levels_of_one as usize,
        finishing: blended as usize + (busy_tiles as usize).max(decoding),
        photographs: most_of_a_tile(unrolled, first_level, bytes),
    };
    let work = WorkBytes {
        pixel_bytes: RootPixel::BYTES,
        working: working as usize,
        coarse_levels: own_levels as usize,
        band: 0,
    };
    (work, parts)
}
