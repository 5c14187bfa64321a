//! How true the panorama is to the photographs it was made of: steps across seams, and ghosts.
//!
//! Both measures ask, wherever two photographs lie on each other, how far the panorama's gradient is from that of the
//! photograph it resembles most there. A panorama that shows one photograph at a time has a distance of 0 but at its
//! seams; a mean of photographs that do not fit shows the contours of both, each at half its strength, and is far from
//! either.

mod ghosts;
mod measured;
mod steps;

use trueup_core::raster::{LUMA, Raster, RowSource};
use trueup_core::{Error, Result};

use crate::render::Layer;
use measured::{MeasuredPanorama, depths, fits};

pub use ghosts::GHOST_LEVEL;

/// How true a panorama is to its photographs; gray levels from 0 to 255 of encoded luma.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fidelity {
    /// Places along the lines where the photograph shown changes.
    pub line_px: usize,
    /// Mean absolute step across those lines that no photograph shows.
    pub step: f64,
    /// Places all over the overlaps at which feathering goes over from one photograph to another.
    pub overlap_line_px: usize,
    /// Mean absolute step at those places, in the direction in which feathering goes over, that no photograph shows.
    pub overlap_step: f64,
    /// Places along the line where the two ends of a full turn meet.
    pub wrap_px: usize,
    /// Mean absolute step across it that no photograph shows.
    pub wrap_step: f64,
    /// The same across columns within a full turn, 32 pixels apart: what `wrap_step` is to be compared with.
    pub column_step: f64,
    /// Pixels that two photographs cover.
    pub overlap_px: usize,
    /// Mean distance of the panorama's gradient from that of the nearest photograph: ghosts and blur.
    pub ghost: f64,
    /// Share of the overlaps where that distance is above [`GHOST_LEVEL`].
    pub ghost_share: f64,
}

/// Measures `panorama` against `layers`, its photographs on the same canvas; `shown` is the position of the photograph
/// that each canvas pixel shows, or shows most, row by row.
///
/// The step at a place on a line between two photographs is the mean of the eight pixels on one side minus that of the
/// eight on the other, where both photographs cover all sixteen. It is averaged over the places of a line within a
/// square of 32 pixels: what the eye takes for a seam has one sign along it, while contours that are a little out of
/// place change theirs. The panorama's is then compared with that of both photographs, and the nearer one counts.
///
/// The lines along which a panorama with seams changes photographs are few; a feathered one changes them everywhere in
/// an overlap by a little. `overlap_step` is therefore measured at the same places for any panorama: across all lines
/// parallel to that along which two photographs' borders are equally far, one in eight pixels, of all photographs that
/// cover a place the nearest counting.
///
/// With `around` the canvas is a cylinder, whose first column lies beside its last. The step between these two is
/// measured all along them, whoever is shown there. Most of such a line lies within one photograph, which a seam never
/// does; the same is therefore measured across other columns, one in 32, for comparison.
///
/// # Errors
/// [`Error::Input`] if the sizes do not fit.
pub fn measure(panorama: &dyn RowSource, layers: &[Layer], shown: &[u16], around: bool) -> Result<Fidelity> {
    let (width, height) = (panorama.width(), panorama.height());
    if shown.len() != width * height || !layers.iter().all(|layer| fits(layer, [width, height], around)) {
        return Err(Error::input(
            "fidelity",
            "panorama and photographs are not of one canvas",
            "Measure them together.",
        ));
    }
    let gray = luma(panorama)?;
    let depths: Vec<Vec<u32>> = layers.iter().map(depths).collect();
    let measured =
        MeasuredPanorama { gray: &gray, layers, depths: &depths, shown, turn: if around { width } else { 0 } };
    let steps = measured.steps();
    let overlaps = measured.overlap_steps();
    let ghosts = measured.ghosts();
    Ok(Fidelity {
        line_px: steps.seams.places,
        step: steps.seams.mean(),
        overlap_line_px: overlaps.places,
        overlap_step: overlaps.mean(),
        wrap_px: steps.wrap.places,
        wrap_step: steps.wrap.mean(),
        column_step: steps.columns.mean(),
        overlap_px: ghosts.pixels,
        ghost: ghosts.mean(),
        ghost_share: ghosts.share(),
    })
}

/// The position of the photograph whose border is farthest, for every canvas pixel: what a feathered panorama shows
/// most. `u16::MAX` where nothing is.
///
/// # Errors
/// [`Error::Input`] if a layer lies outside the canvas of `size` pixels (width, height), a cylinder if `around`, or
/// there are too many.
pub fn deepest(layers: &[Layer], [width, height]: [usize; 2], around: bool) -> Result<Vec<u16>> {
    let all_fit = layers.iter().all(|layer| fits(layer, [width, height], around));
    if layers.len() >= usize::from(u16::MAX) || !all_fit {
        return Err(Error::input(
            "fidelity",
            "a photograph lies outside the canvas",
            "Measure a panorama's own layers.",
        ));
    }
    let mut shown = vec![u16::MAX; width * height];
    let mut best = vec![0; width * height];
    for (position, layer) in layers.iter().enumerate() {
        for (row, depths) in depths(layer).chunks_exact(layer.covered.width().max(1)).enumerate() {
            let first = (layer.top + row) * width;
            for (x, &depth) in (layer.left..).zip(depths) {
                let at = first + x % width;
                if depth > best[at] {
                    best[at] = depth;
                    shown[at] = position as u16;
                }
            }
        }
    }
    Ok(shown)
}

fn luma(panorama: &dyn RowSource) -> Result<Raster<f32>> {
    let mut gray = Raster::new(panorama.width(), panorama.height(), 1);
    let mut row = vec![0; 4 * panorama.width()];
    for y in 0..panorama.height() {
        panorama.rgba8_row(y, &mut row)?;
        for (gray, pixel) in gray.row_mut(y).iter_mut().zip(row.chunks_exact(4)) {
            *gray = LUMA.iter().zip(pixel).map(|(share, &level)| share * f32::from(level)).sum();
        }
    }
    Ok(gray)
}

#[cfg(test)]
mod tests;
