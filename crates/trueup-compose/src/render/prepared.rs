//! One photograph, ready to be sampled anywhere on a canvas.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::color::TransferCurve;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Photograph;
use trueup_core::{Error, Result};

use super::{Blend, Interpolation, RenderOptions};
use crate::deformed_grid::{Cell, DeformedGrid, Run};
use crate::exposure::{Correction, LightTable};
use crate::layout::Placed;
use crate::sampling::{Bicubic, Bilinear, MAX_STRETCH, interpolate, reduce_by_two};
use crate::simd::{Combine, Contribution, Development, Positions, accumulate, develop, invert_row};
use crate::unwanted::Unwanted;
use crate::weights::Feather;

/// A decoded photograph with its grid, feather and correction.
pub(crate) struct Prepared<'a> {
    /// Reduced by two as often as the canvas allows.
    photograph: Cow<'a, Photograph>,
    /// In the reduced photograph's pixels.
    grid: DeformedGrid,
    feather: Feather,
    light: LightTable,
    unwanted: Option<Unwanted>,
}

/// Working memory of one task.
#[derive(Default)]
pub(crate) struct Scratch {
    candidates: Vec<u32>,
    owner: Vec<u32>,
    runs: Vec<Run>,
    positions: Positions,
    samples: Vec<[f32; 4]>,
    at_border: Vec<usize>,
}

/// A part of the canvas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window<'a> {
    pub(crate) columns: &'a Range<usize>,
    pub(crate) rows: &'a Range<usize>,
}

impl<'a> Prepared<'a> {
    /// A photograph on a canvas of `size` pixels (width, height), where `mesh` puts it; the two fit together, see
    /// [`check_photograph`]. Its samples become light by the transfer curve and the correction `light`.
    pub(crate) fn new(
        mut photograph: Cow<'a, Photograph>,
        mesh: &GridMesh,
        size: [usize; 2],
        light: (&TransferCurve, &Correction),
        options: &RenderOptions,
    ) -> Self {
        let grid_of = |mesh: &GridMesh| DeformedGrid::new(mesh, 1.0, true, size[0], size[1]);
        let mut grid = grid_of(mesh);
        let halvings = halvings_before_sampling(&grid, options.minification_threshold);
        if halvings > 0 {
            for _ in 0..halvings {
                photograph = Cow::Owned(reduce_by_two(&photograph));
            }
            let mut mesh = mesh.clone();
            mesh.width /= f64::from(1_u32 << halvings);
            mesh.height /= f64::from(1_u32 << halvings);
            grid = grid_of(&mesh);
        }
        let feather = Feather::new(grid.size, options.feather_exponent);
        let light = LightTable::new(light.0, light.1, grid.size);
        Self { photograph, grid, feather, light, unwanted: None }
    }

    /// The same without what is not to be seen of it.
    pub(crate) fn without(self, unwanted: Option<Unwanted>) -> Self {
        Self { unwanted, ..self }
    }

    /// The grid, in the pixels of [`Self::photograph`].
    pub(crate) fn grid(&self) -> &DeformedGrid {
        &self.grid
    }

    /// The photograph as it is sampled, maybe reduced, and its exact size.
    pub(crate) fn photograph(&self) -> (&Photograph, [f64; 2]) {
        (&self.photograph, self.grid.size)
    }

    /// Columns of the canvas that may be covered.
    pub(crate) fn columns(&self) -> Range<usize> {
        self.grid.columns.clone()
    }

    /// Rows of the canvas that may be covered.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.grid.rows.clone()
    }

    /// Adds the photograph to `sums`, the canvas rows `rows`.
    pub(crate) fn add_to_band(
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
        samples.resize(run.columns.len(), [0.0; 4]);
        self.interpolate_run(y, run, options, positions, samples, at_border);
        let contribution = Contribution {
            feather: &self.feather,
            light: &self.light,
            border_footprint: cell.near_border.then(|| cell.footprint.map(|pixels| pixels as f32)),
            combine: if options.blend == Blend::Average { Combine::Equal } else { Combine::Feathered },
        };
        accumulate(contribution, positions, samples, sums);
    }

    /// Fills `out`, the pixels of `window` row by row, with the square root of corrected linear light and the share of the
    /// pixel that is covered; zeros where nothing is.
    pub(crate) fn sample(
        &self,
        window: Window<'_>,
        out: &mut [[f32; 4]],
        options: &RenderOptions,
        scratch: &mut Scratch,
    ) {
        self.sample_with(window, out, options, scratch, |_, _| {});
    }

    /// [`Self::sample`], which shows `look` the photograph's own values (0 to 255) before they are developed, with their
    /// place in `out`.
    pub(crate) fn sample_with(
        &self,
        window: Window<'_>,
        out: &mut [[f32; 4]],
        options: &RenderOptions,
        scratch: &mut Scratch,
        mut look: impl FnMut(usize, &[[f32; 4]]),
    ) {
        let width = window.columns.len();
        let within = |a: &Range<usize>, b: &Range<usize>| a.start.max(b.start)..a.end.min(b.end);
        let (columns, rows) = (within(window.columns, &self.grid.columns), within(window.rows, &self.grid.rows));
        out.fill([0.0; 4]);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let Scratch { candidates, owner, runs, positions, at_border, .. } = scratch;
        self.grid.cells_in_window(&columns, &rows, candidates);
        for y in rows {
            self.grid.runs_within(y, &columns, candidates, owner, runs);
            let start = (y - window.rows.start) * width;
            for run in &*runs {
                let first = start + run.columns.start - window.columns.start;
                let samples = &mut out[first..first + run.columns.len()];
                self.interpolate_run(y, run, options, positions, samples, at_border);
                look(first, samples);
                let cell = &self.grid.cells[run.cell];
                let development = Development {
                    feather: &self.feather,
                    light: &self.light,
                    border_footprint: cell.near_border.then(|| cell.footprint.map(|pixels| pixels as f32)),
                };
                develop(development, positions, samples);
            }
        }
    }

    /// The photograph's own values (0 to 255) along one run.
    fn interpolate_run(
        &self,
        y: usize,
        run: &Run,
        options: &RenderOptions,
        positions: &mut Positions,
        samples: &mut [[f32; 4]],
        at_border: &mut Vec<usize>,
    ) {
        let cell = &self.grid.cells[run.cell];
        positions.resize(run.columns.len());
        invert_row(&cell.inverse_along_row(y), run.columns.start, positions);
        let stretch = cell.footprint.map(|pixels| (pixels / options.minification_threshold).clamp(1.0, MAX_STRETCH));
        match options.interpolation {
            Interpolation::Bilinear => {
                interpolate::<Bilinear>(&self.photograph, positions, stretch, samples, at_border)
            }
            Interpolation::Bicubic => interpolate::<Bicubic>(&self.photograph, positions, stretch, samples, at_border),
        }
        if let Some(unwanted) = &self.unwanted {
            for (index, (x, sample)) in run.columns.clone().zip(samples).enumerate() {
                if unwanted.hides(positions.place(index), self.grid.size, [x, y]) {
                    sample[3] = 0.0;
                }
            }
        }
    }
}

/// Refuses a photograph that is not the one its grid was made for.
pub(crate) fn check_photograph(placed: &Placed, photograph: &Photograph) -> Result<()> {
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
    /// A cell that is stretched more unevenly lies at a pole of the projection; it asks for detail along one axis that it
    /// cannot show along the other.
    const UNEVEN: f64 = 4.0;
    let even =
        |cell: &&Cell| cell.footprint[0].max(cell.footprint[1]) <= UNEVEN * cell.footprint[0].min(cell.footprint[1]);
    let least = grid.cells.iter().filter(even).flat_map(|cell| cell.footprint).fold(f64::INFINITY, f64::min);
    let shorter = grid.size[0].min(grid.size[1]);
    let wanted = (least / minification_threshold).min(shorter);
    if wanted >= 2.0 { wanted.log2().floor().min(16.0) as u32 } else { 0 }
}
