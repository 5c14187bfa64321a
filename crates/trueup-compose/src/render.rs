//! Warp, gain and blend: the full-resolution photographs onto the canvas.
//!
//! Photographs are decoded as many at a time as the current thread pool has threads, then added to the canvas one after
//! the other, each in parallel over bands of rows: the sums are the same for any number of threads.

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::diagnostics::Diagnostic;
use trueup_core::mesh::GridMesh;
use trueup_core::options::StageOptions;
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result, StageContext};

use crate::deformed_grid::{DeformedGrid, Run, count_folded_triangles};
use crate::layout::{CanvasLayout, Placed, check_mesh};
use crate::sampling::{Bicubic, Bilinear, MAX_STRETCH, interpolate, reduce_by_two};
use crate::simd::{Combine, Contribution, Positions, accumulate, invert_row};
use crate::transfer_curve::Encode;
use crate::weights::{Feather, alpha};

const STAGE: &str = RenderOptions::STAGE;

/// Rows of the canvas that one task renders; large enough to find its cells once, small enough to share evenly.
const BAND_ROWS: usize = 16;

trueup_core::choice! {
    /// How a photograph is read between its samples.
    pub enum Interpolation {
        /// Two samples along each axis: soft, never rings.
        Bilinear = "bilinear",
        /// Four samples along each axis (Catmull-Rom): keeps detail.
        Bicubic = "bicubic",
    }
}

trueup_core::choice! {
    /// What a canvas pixel shows where photographs overlap.
    pub enum Blend {
        /// Their mean, each weighted by its distance from its own border.
        Feather = "feather",
        /// Their plain mean: shows misalignment best.
        Average = "average",
        /// Only the photograph that lies deepest there: shows every seam.
        None = "none",
    }
}

trueup_core::options! {
    /// How the photographs become one picture.
    pub struct RenderOptions("render") {
        /// How a photograph is read between its samples.
        interpolation: Interpolation = Interpolation::Bicubic, Allowed::Any, "";
        /// What a pixel shows where photographs overlap.
        blend: Blend = Blend::Feather, Allowed::Any, "";
        /// Power of the feather weight. Higher values let the photograph that lies deepest prevail, which shortens the
        /// transition and with it ghosts; 1 blends over the whole overlap.
        feather_exponent: f64 = 3.0, between(0.1, 16.0), "";
        /// Photograph pixels per canvas pixel above which the photograph is averaged instead of interpolated. Lower is
        /// softer, higher lets fine patterns shimmer.
        minification_threshold: f64 = 1.25, between(1.0, 4.0), "";
    }
}

/// The finished panorama: sums of linear light and weights, 16 bytes a pixel, encoded as its rows are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    width: usize,
    height: usize,
    /// Sums over the photographs of weight * (red, green, blue) in linear light, and of the weights; row-major.
    sums: Vec<[f32; 4]>,
}

impl Panorama {
    /// Bytes that rendering a canvas of `width` x `height` pixels takes beside the decoded photographs.
    pub fn required_bytes(width: usize, height: usize) -> usize {
        width.saturating_mul(height).saturating_mul(size_of::<[f32; 4]>())
    }

    /// Linear light (red, green, blue; 1 is white, more is possible) and alpha (0 to 1) of pixel (x, y); all 0 where no
    /// photograph is.
    pub fn linear_pixel(&self, x: usize, y: usize) -> [f32; 4] {
        let [r, g, b, sum] = self.sums[y * self.width + x];
        if sum > 0.0 { [r / sum, g / sum, b / sum, alpha(sum)] } else { [0.0; 4] }
    }
}

impl RowSource for Panorama {
    fn width(&self) -> usize {
        self.width
    }

    fn height(&self) -> usize {
        self.height
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) {
        let encode = Encode::table();
        let sums = &self.sums[y * self.width..(y + 1) * self.width];
        for (pixel, &[r, g, b, sum]) in row.chunks_exact_mut(4).zip(sums) {
            let opacity = (alpha(sum) * 255.0 + 0.5) as u8;
            let scale = if opacity > 0 { 1.0 / sum } else { 0.0 };
            let levels = [encode.level(r * scale), encode.level(g * scale), encode.level(b * scale), opacity];
            pixel.copy_from_slice(&levels);
        }
    }
}

/// Renders the panorama: every photograph warped by its grid, multiplied by its gain and blended.
///
/// `gains` holds a factor on linear light for each placed photograph. A canvas pixel sees the photograph at exactly one
/// position, found by inverting the bilinear map of the cell that covers it; where a grid folds over itself, the later
/// cell (row-major) covers. Progress counts photographs.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if gains, grids and photographs do not fit together or the canvas is empty;
/// [`Error::Unsolvable`] if a vertex is not finite; [`Error::Cancelled`]; and what `photographs` returns.
///
/// # Departures
/// The published renderer splits cells into two triangles with an affine map each, which kinks straight lines along the
/// cells' diagonals; here the inverse is bilinear like the warp itself.
pub fn run(
    layout: &CanvasLayout,
    gains: &[f64],
    photographs: &dyn PhotographSource,
    options: &RenderOptions,
    context: &StageContext,
) -> Result<Panorama> {
    check(layout, gains, options)?;
    report_folds(layout, context);
    let (width, height) = (layout.width, layout.height);
    let mut panorama = Panorama { width, height, sums: vec![[0.0; 4]; width * height] };
    context.progress().begin(STAGE, layout.placed.len() as u64);
    let at_a_time = rayon::current_num_threads().max(1);
    for (placed, gains) in layout.placed.chunks(at_a_time).zip(gains.chunks(at_a_time)) {
        context.check_cancelled()?;
        let prepared: Vec<Prepared> = placed
            .par_iter()
            .zip(gains)
            .map(|(placed, &gain)| Prepared::new(placed, gain, layout, photographs, options))
            .collect::<Result<_>>()?;
        panorama.sums.par_chunks_mut(width * BAND_ROWS).enumerate().try_for_each(|(band, sums)| {
            context.check_cancelled()?;
            let rows = band * BAND_ROWS..(band * BAND_ROWS + sums.len() / width);
            let mut scratch = Scratch::default();
            for picture in &prepared {
                picture.add_to_band(&rows, sums, width, options, &mut scratch);
            }
            Ok(())
        })?;
        context.progress().advance(STAGE, placed.len() as u64);
    }
    context.progress().finish(STAGE);
    Ok(panorama)
}

fn check(layout: &CanvasLayout, gains: &[f64], options: &RenderOptions) -> Result<()> {
    options.check()?;
    layout.placed.iter().try_for_each(check_mesh)?;
    if gains.len() != layout.placed.len() || gains.iter().any(|gain| !(gain.is_finite() && *gain > 0.0)) {
        return Err(Error::input(
            "gains",
            format!("{} gains for {} photographs, or one not above zero", gains.len(), layout.placed.len()),
            "Give one positive factor for each photograph.",
        ));
    }
    let pixels = layout.width.checked_mul(layout.height).filter(|&pixels| pixels > 0);
    if pixels.is_none_or(|pixels| pixels > isize::MAX as usize / size_of::<[f32; 4]>()) {
        return Err(Error::input(
            "canvas",
            format!("{} x {} px cannot be held in memory", layout.width, layout.height),
            "Lower canvas.scale or canvas.max_pixels.",
        ));
    }
    Ok(())
}

fn report_folds(layout: &CanvasLayout, context: &StageContext) {
    for placed in &layout.placed {
        let folded = count_folded_triangles(&placed.mesh);
        if folded > 0 {
            let triangles = 2 * (placed.mesh.rows - 1) * (placed.mesh.columns - 1);
            context.report(Diagnostic::warning(
                "grid-folded",
                format!("photograph {}", placed.photograph),
                format!("{folded} of {triangles} triangles of its grid are folded over"),
                "The photograph may not fit the others: leave it out, or try another method.",
            ));
        }
    }
}

/// A decoded photograph with its grid and feather.
struct Prepared {
    /// Reduced by two as often as the canvas allows.
    photograph: Photograph,
    /// In the reduced photograph's pixels.
    grid: DeformedGrid,
    feather: Feather,
    gain: f32,
}

/// Working memory of one task.
#[derive(Default)]
struct Scratch {
    candidates: Vec<u32>,
    owner: Vec<u32>,
    runs: Vec<Run>,
    positions: Positions,
    samples: Vec<[f32; 4]>,
    at_border: Vec<usize>,
}

impl Prepared {
    fn new(
        placed: &Placed,
        gain: f64,
        layout: &CanvasLayout,
        photographs: &dyn PhotographSource,
        options: &RenderOptions,
    ) -> Result<Self> {
        let mut photograph = photographs.photograph(placed.photograph)?;
        check_photograph(placed, &photograph)?;
        let grid_of = |mesh: &GridMesh| DeformedGrid::new(mesh, 1.0, true, layout.width, layout.height);
        let mut grid = grid_of(&placed.mesh);
        let halvings = halvings_before_sampling(&grid, options.minification_threshold);
        if halvings > 0 {
            for _ in 0..halvings {
                photograph = reduce_by_two(&photograph);
            }
            let mut mesh = placed.mesh.clone();
            mesh.width /= f64::from(1_u32 << halvings);
            mesh.height /= f64::from(1_u32 << halvings);
            grid = grid_of(&mesh);
        }
        let feather = Feather::new(grid.size, options.feather_exponent);
        Ok(Self { photograph, grid, feather, gain: gain as f32 })
    }

    /// Adds the photograph to `sums`, the canvas rows `rows`.
    fn add_to_band(
        &self,
        rows: &Range<usize>,
        sums: &mut [[f32; 4]],
        width: usize,
        options: &RenderOptions,
        scratch: &mut Scratch,
    ) {
        let covered = rows.start.max(self.grid.rows.start)..rows.end.min(self.grid.rows.end);
        if covered.is_empty() {
            return;
        }
        self.grid.cells_in_rows(&covered, &mut scratch.candidates);
        for y in covered {
            let sums = &mut sums[(y - rows.start) * width..][..width];
            self.grid.runs(y, &scratch.candidates, &mut scratch.owner, &mut scratch.runs);
            for index in 0..scratch.runs.len() {
                let run = scratch.runs[index].clone();
                self.add_run(y, &run, &mut sums[run.columns.clone()], options, scratch);
            }
        }
    }

    /// Samples one run and adds it to its canvas pixels.
    fn add_run(&self, y: usize, run: &Run, sums: &mut [[f32; 4]], options: &RenderOptions, scratch: &mut Scratch) {
        let cell = &self.grid.cells[run.cell];
        let Scratch { positions, samples, at_border, .. } = scratch;
        positions.resize(run.columns.len());
        samples.resize(run.columns.len(), [0.0; 4]);
        invert_row(&cell.inverse_along_row(y), run.columns.start, positions);
        let stretch = cell.footprint.map(|pixels| (pixels / options.minification_threshold).clamp(1.0, MAX_STRETCH));
        match options.interpolation {
            Interpolation::Bilinear => {
                interpolate::<Bilinear>(&self.photograph, positions, stretch, samples, at_border)
            }
            Interpolation::Bicubic => interpolate::<Bicubic>(&self.photograph, positions, stretch, samples, at_border),
        }
        let contribution = Contribution {
            feather: &self.feather,
            gain: self.gain,
            border_footprint: cell.near_border.then(|| cell.footprint.map(|pixels| pixels as f32)),
            combine: match options.blend {
                Blend::Feather => Combine::Feathered,
                Blend::Average => Combine::Equal,
                Blend::None => Combine::Heaviest,
            },
        };
        accumulate(contribution, positions, samples, sums);
    }
}

fn check_photograph(placed: &Placed, photograph: &Photograph) -> Result<()> {
    let (width, height) = (photograph.width(), photograph.height());
    let fits = width as f64 == placed.mesh.width.round() && height as f64 == placed.mesh.height.round();
    if fits && matches!(photograph.channels(), 1 | 3 | 4) {
        return Ok(());
    }
    Err(Error::input(
        format!("photograph {}", placed.photograph),
        format!(
            "{width} x {height} px with {} channels does not fit a grid over {} x {} px",
            photograph.channels(),
            placed.mesh.width,
            placed.mesh.height
        ),
        "Give the photograph that was measured, with 1, 3 or 4 channels.",
    ))
}

/// How often the photograph can be halved and still have, in every cell, at least the samples that the widened kernel
/// of the least reduced cell wants.
fn halvings_before_sampling(grid: &DeformedGrid, minification_threshold: f64) -> u32 {
    let least = grid.cells.iter().flat_map(|cell| cell.footprint).fold(f64::INFINITY, f64::min);
    let shorter = grid.size[0].min(grid.size[1]);
    let wanted = (least / minification_threshold).min(shorter);
    if wanted >= 2.0 { wanted.log2().floor().min(16.0) as u32 } else { 0 }
}

mod layer;

pub use layer::{Layer, layer};

#[cfg(test)]
mod tests;
