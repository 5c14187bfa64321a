//! How a canvas is cut into tiles, and which levels are finished tile by tile.

/// Log2 of the canvas pixels per sample of the finest level that is blended as a whole, on a canvas of this size; at
/// least [`LEAST_FIRST_LEVEL`]. It follows from the canvas alone, so that the memory there is does not show in the
/// panorama.
pub(crate) fn first_level([width, height]: [usize; 2]) -> u32 {
    let samples = |level: u32| width.div_ceil(1 << level).saturating_mul(height.div_ceil(1 << level));
    (LEAST_FIRST_LEVEL..).find(|&level| samples(level) <= MOST_SAMPLES).unwrap_or(LEAST_FIRST_LEVEL)
}

/// Log2 of 8 pixels.
const LEAST_FIRST_LEVEL: u32 = 3;

/// A level of more samples is not blended as a whole: 64 MB, of a canvas of 256 million pixels at an eighth. Some three
/// such levels are held at once, of which a gigabyte must leave room for photographs.
const MOST_SAMPLES: usize = 4_000_000;

/// Side of a tile in canvas pixels, a multiple of 2^first_level: 128 for the canvases of most panoramas. Larger tiles
/// waste less on margins, smaller ones less on pixels that only one photograph shows.
pub(crate) const fn tile_side(first_level: u32) -> usize {
    16 << first_level
}

/// Canvas pixels beside a tile that its fine levels are made of, a multiple of 2^first_level.
///
/// Interpolating wants one sample beside the tile at every level, and reducing two of the finer level beside the
/// middles of those that it makes: m samples of a level take 2 m + 2 of the one below. One at the coarsest of the fine
/// levels, the last below `first_level`, becomes 3 2^(first_level - 1) - 2 pixels.
pub(crate) const fn tile_margin(first_level: u32) -> usize {
    2 << first_level
}

/// The same for the masks, which are reduced once more: 3 2^first_level - 2 pixels.
pub(crate) const fn mask_margin(first_level: u32) -> usize {
    3 << first_level
}
