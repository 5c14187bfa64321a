//! One photograph alone on the canvas: for measuring, and row by row for files.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::Result;
use trueup_core::raster::{LUMA, Raster, RowSource};
use trueup_core::source::PhotographSource;

use super::checked::check;
use super::input::RenderInput;
use crate::deformed_grid::DeformedGrid;
use crate::layout::{CanvasLayout, TURNS, columns_around};
use crate::light::{ByResponse, PhotographLight};
use crate::render_options::RenderOptions;
use crate::transfer_curve::Encoding;
use crate::unframed::Unframed;
use crate::warped::{Resampling, SamplingMemory, WarpedPhotograph, check_photograph};
use crate::weights::WHOLE;
use crate::window::Window;

/// Rows of a layer that are sampled at once; its cells are found once for all of them.
const BAND_ROWS: usize = 16;

/// What one photograph shows of the canvas: its bounding box there. On a cylinder it may run past the width into the
/// next turn, but does not meet itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// First column of the canvas.
    pub left: usize,
    /// First row of the canvas.
    pub top: usize,
    /// Rec. 601 luma of the encoded colors, 0 to 255, one channel; 0 outside the photograph.
    pub gray: Raster<f32>,
    /// Whether the photograph covers the whole pixel; one channel.
    pub covered: Raster<bool>,
}

/// Renders the photograph at `layout.placed[position]` alone, corrected, as [`super::run`] would, but that one drawn
/// smaller is averaged anew for every pixel.
///
/// # Errors
/// Those of [`super::run`], and [`trueup_core::Error::Input`] if there is no such position.
pub fn layer(input: &RenderInput<'_>, position: usize, options: &RenderOptions) -> Result<Layer> {
    // Measured as it is, without a step between the photograph and the canvas.
    let resampling = Resampling::of(options.interpolation).in_few_places();
    let (warped, encoding) = alone(input, position, options, &resampling)?;
    let layout = input.layout;
    let (all, rows) = (warped.columns(), warped.rows());
    let columns = all.start..all.end.min(all.start + layout.period.unwrap_or(all.len()));
    let (on_canvas, turned) = columns_around(columns.clone(), layout.period);
    let (width, height) = (columns.len(), rows.len());
    let mut layer = Layer {
        left: on_canvas.start,
        top: rows.start,
        gray: Raster::new(width, height, 1),
        covered: Raster::new(width, height, 1),
    };
    let encode = &encoding.linear;
    let mut memory = SamplingMemory::default();
    let mut samples = Vec::new();
    for first in rows.clone().step_by(BAND_ROWS) {
        let band = first..(first + BAND_ROWS).min(rows.end);
        samples.resize(width * band.len(), [0.0; 4]);
        warped.sample(Window { columns: &columns, rows: &band }, &mut samples, &resampling, &mut memory);
        for (y, samples) in band.zip(samples.chunks_exact(width.max(1))) {
            let gray = layer.gray.row_mut(y - rows.start);
            let covered = layer.covered.row_mut(y - rows.start);
            for ((gray, covered), sample) in gray.iter_mut().zip(covered).zip(samples) {
                let [r, g, b, share] = *sample;
                if share > 0.0 {
                    let levels = [r, g, b].map(|root| f32::from(encode.level(encoding.light_of_root(root))));
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

/// Photograph `layout.placed[position]` alone, and how it is written.
fn alone(
    input: &RenderInput<'_>,
    position: usize,
    options: &RenderOptions,
    resampling: &Resampling,
) -> Result<(WarpedPhotograph<'static>, Encoding)> {
    check(input, options)?;
    let &RenderInput { layout, corrections, photographs } = input;
    let Some(placed) = layout.placed.get(position) else {
        return Err(trueup_core::Error::input(
            "canvas",
            format!("there is no photograph {position} on it"),
            "Ask for one of the photographs placed.",
        ));
    };
    let photographs = &Unframed(photographs);
    let photograph = photographs.photograph(placed.photograph)?;
    check_photograph(placed, &photograph)?;
    let photographs = ByResponse::new(photographs, corrections)?;
    let curve = photographs.transfer_curve();
    let local = photographs.local_exposure(layout, options.look);
    let light =
        PhotographLight { curve: &curve, correction: &photographs.corrections()[position], local: local.as_ref() };
    let mesh = &placed.in_first_turn(layout.period).mesh;
    let size = unrolled_size(layout);
    let warped = WarpedPhotograph::new(Cow::Owned(photograph), mesh, size, light, resampling);
    Ok((warped, photographs.encoding()))
}

/// The canvas, on a cylinder with the turns that a photograph may reach into.
fn unrolled_size(layout: &CanvasLayout) -> [usize; 2] {
    [layout.width * if layout.period.is_some() { TURNS } else { 1 }, layout.height]
}

/// Columns of the canvas that a box of `columns` takes: all of them if it lies across the ends of a cylinder.
fn columns_of_box(columns: &Range<usize>, layout: &CanvasLayout) -> Range<usize> {
    let (around, _) = columns_around(columns.clone(), layout.period);
    if around.end > layout.width { 0..layout.width } else { around }
}

/// One photograph alone on the canvas, corrected, with alpha: its bounding box, row by row. Holds the photograph and no
/// pixel of the canvas.
pub struct LayerRows {
    /// First column of the canvas.
    pub left: usize,
    /// First row of the canvas.
    pub top: usize,
    width: usize,
    /// Width of the canvas.
    turn: usize,
    warped: WarpedPhotograph<'static>,
    encoding: Encoding,
    resampling: Resampling,
}

impl std::fmt::Debug for LayerRows {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("LayerRows").field("left", &self.left).field("top", &self.top).finish_non_exhaustive()
    }
}

/// Prepares photograph `layout.placed[position]` to be rendered alone, as [`super::run`] would; `None` if none of it
/// lies on the canvas.
///
/// # Errors
/// Those of [`layer`].
pub fn layer_rows(input: &RenderInput<'_>, position: usize, options: &RenderOptions) -> Result<Option<LayerRows>> {
    let resampling = Resampling::of(options.interpolation);
    let (warped, encoding) = alone(input, position, options, &resampling)?;
    let layout = input.layout;
    let (columns, rows) = (warped.columns(), warped.rows());
    if columns.is_empty() || rows.is_empty() {
        return Ok(None);
    }
    let on_canvas = columns_of_box(&columns, layout);
    Ok(Some(LayerRows {
        left: on_canvas.start,
        top: rows.start,
        width: on_canvas.len(),
        turn: layout.width,
        warped,
        encoding,
        resampling,
    }))
}

/// Width and height of the box of photograph `layout.placed[position]` on the canvas, in pixels; 0 if there is no such
/// position.
pub fn layer_size(layout: &CanvasLayout, position: usize) -> [usize; 2] {
    let Some(placed) = layout.placed.get(position) else { return [0, 0] };
    let [width, height] = unrolled_size(layout);
    let grid = DeformedGrid::new(&placed.in_first_turn(layout.period).mesh, 1.0, true, width, height);
    [columns_of_box(&grid.columns, layout).len(), grid.rows.len()]
}

impl LayerRows {
    /// Row `y` of the box: roots of linear light, and the share that is covered.
    fn samples(&self, y: usize) -> Vec<[f32; 4]> {
        let columns = self.warped.columns();
        let rows = self.top + y..self.top + y + 1;
        let mut samples = vec![[0.0; 4]; columns.len()];
        let window = Window { columns: &columns, rows: &rows };
        self.warped.sample(window, &mut samples, &self.resampling, &mut SamplingMemory::default());
        // Across the ends of a cylinder, what runs past the last column goes on in the first.
        let mut row = vec![[0.0; 4]; self.width];
        for (x, sample) in columns.zip(samples) {
            let at = x % self.turn - self.left;
            if sample[3] > row[at][3] {
                row[at] = sample;
            }
        }
        row
    }

    fn row<T: Copy + Default>(
        &self,
        y: usize,
        row: &mut [T],
        color: impl Fn(f32) -> T,
        alpha: impl Fn(f32) -> T,
    ) -> Result<()> {
        for (pixel, [r, g, b, share]) in row.chunks_exact_mut(4).zip(self.samples(y)) {
            let [r, g, b] = [r, g, b].map(|root| color(self.encoding.light_of_root(root)));
            match share > 0.0 {
                true => pixel.copy_from_slice(&[r, g, b, alpha(share.min(1.0))]),
                false => pixel.fill(T::default()),
            }
        }
        Ok(())
    }
}

impl RowSource for LayerRows {
    fn width(&self) -> usize {
        self.width
    }

    fn height(&self) -> usize {
        self.warped.rows().len()
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        self.row(y, row, |light| self.encoding.linear.level(light), |share| (share * 255.0 + 0.5) as u8)
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        let encode = self.encoding.linear16();
        self.row(y, row, |light| encode.level(light), |share| (share * 65535.0 + 0.5) as u16)
    }

    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        self.row(y, row, |light| self.encoding.profile_light(light), |share| share)
    }
}
