//! One photograph, ready to be sampled anywhere on a canvas.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::mesh::GridMesh;
use trueup_core::raster::Photograph;
use trueup_core::{Error, Result};

use crate::deformed_grid::{Cell, CellRun, DeformedGrid};
use crate::ignored::IgnoredPart;
use crate::kernel::{Bicubic, Bilinear};
use crate::layout::Placed;
use crate::light::{LightTable, LocalExposure, PhotographLight};
use crate::render_options::Interpolation;
use crate::sampling::{MAX_STRETCH, interpolate, reduce_by, reduce_by_two};
use crate::simd::{Contribution, Development, Positions, accumulate, develop, invert_row};
use crate::weights::{FEATHER_EXPONENT, Feather, Weighting};
use crate::window::{Window, common};

/// Photograph pixels per canvas pixel above which a photograph is averaged instead of interpolated. Lower is softer,
/// higher lets fine patterns shimmer.
const MINIFICATION_THRESHOLD: f64 = 1.25;

/// The same of a photograph that was made to fit: the kernel that made it smaller took away most of what would shimmer.
/// What is as fine as the canvas can show keeps 0.51 (drawn largest) to 0.75 of its contrast by both kernels, 0.72 by
/// averaging; the finest that is left of the photograph 0.24, where interpolation alone, up to the threshold above, has
/// 0.49.
const FITTED_THRESHOLD: f64 = 1.6;

/// How a photograph is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Resampling {
    pub(crate) interpolation: Interpolation,
    /// Photograph pixels per canvas pixel above which the photograph is averaged instead of interpolated.
    pub(crate) minification_threshold: f64,
    /// Whether a photograph that would be averaged everywhere is made smaller first, once and evenly, until it need not
    /// be where it is drawn largest: interpolating then takes a fraction of averaging for every canvas pixel.
    pub(crate) fits_photographs: bool,
}

impl Resampling {
    /// For what is looked at.
    pub(crate) fn of(interpolation: Interpolation) -> Self {
        Self { interpolation, minification_threshold: MINIFICATION_THRESHOLD, fits_photographs: true }
    }

    /// The same for photographs that are looked at in few places: they are not made to fit.
    pub(crate) fn in_few_places(self) -> Self {
        Self { fits_photographs: false, ..self }
    }
}

/// A decoded photograph with its grid, feather and correction.
pub(crate) struct WarpedPhotograph<'a> {
    /// Reduced as far as the canvas allows; maybe some of its rows only.
    photograph: Cow<'a, Photograph>,
    /// Rows of it above the first that there is.
    rows_above: usize,
    /// So many rows of the photograph became one.
    reduced_by: f64,
    /// In the reduced photograph's pixels.
    grid: DeformedGrid,
    feather: Feather,
    light: LightTable,
    local: Option<LocalExposure>,
    ignored: Option<IgnoredPart>,
    /// Whether it was made to fit, see [`Resampling::fits_photographs`].
    is_fitted: bool,
}

/// Working memory of one task.
#[derive(Default)]
pub(crate) struct SamplingMemory {
    candidates: Vec<u32>,
    owner: Vec<u32>,
    runs: Vec<CellRun>,
    positions: Positions,
    samples: Vec<[f32; 4]>,
    at_border: Vec<usize>,
    factors: Vec<f32>,
}

/// Takes a photograph's samples, one row of a window after the other.
pub(crate) trait RowSink {
    /// The photograph's own values, 0 to 255, before they are developed, of some pixels of the row that comes next,
    /// from its pixel `first` on.
    fn own(&mut self, _first: usize, _samples: &[[f32; 4]]) {}

    /// Row `number` of the window, as [`WarpedPhotograph::sample`] has it.
    fn row(&mut self, number: usize, row: &mut [[f32; 4]]);
}

/// How a photograph joins a mean of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Averaging {
    pub(crate) resampling: Resampling,
    pub(crate) weighting: Weighting,
}

impl<'a> WarpedPhotograph<'a> {
    /// A photograph on a canvas of `size` pixels (width, height), where `mesh` puts it; the two fit together, see
    /// [`check_photograph`]. It is halved as often as `resampling` allows, and maybe made to fit.
    pub(crate) fn new(
        mut photograph: Cow<'a, Photograph>,
        mesh: &GridMesh,
        size: [usize; 2],
        light: PhotographLight<'_>,
        resampling: &Resampling,
    ) -> Self {
        let grid_of = |mesh: &GridMesh| DeformedGrid::new(mesh, 1.0, true, size[0], size[1]);
        let whole_height = mesh.height;
        let mut grid = grid_of(mesh);
        let halvings = halvings_before_sampling(&grid, resampling.minification_threshold);
        if halvings > 0 {
            for _ in 0..halvings {
                photograph = Cow::Owned(reduce_by_two(&photograph));
            }
            grid = grid_of(&reduced(mesh, f64::from(1_u32 << halvings)));
        }
        let mut is_fitted = false;
        if let Some(factor) = fitting_factor(&grid, resampling)
            && let Some(fitted) = reduce_by(&photograph, factor)
        {
            is_fitted = true;
            photograph = Cow::Owned(fitted);
            grid = grid_of(&reduced(mesh, f64::from(1_u32 << halvings) * factor));
        }
        let feather = Feather::new(grid.size, FEATHER_EXPONENT);
        let local = light.local.cloned();
        let light = LightTable::new(light, grid.size);
        let reduced_by = whole_height / grid.size[1];
        Self { photograph, rows_above: 0, reduced_by, grid, feather, light, local, ignored: None, is_fitted }
    }

    /// The same with no more of the photograph than some of its `rows`, of those that it had before it was reduced:
    /// where it is sampled, it is to be sampled within these.
    pub(crate) fn with_rows_only(self, rows: &Range<usize>) -> Self {
        let start = (rows.start as f64 / self.reduced_by).floor() as usize;
        let end = (rows.end as f64 / self.reduced_by).ceil() as usize;
        let photograph = Cow::Owned(self.photograph.some_rows(start..end));
        Self { photograph, rows_above: start, ..self }
    }

    /// The same without what is not to be seen of it.
    pub(crate) fn without(self, ignored: Option<IgnoredPart>) -> Self {
        Self { ignored, ..self }
    }

    /// The same with highlights spread as by a camera that levels them off all the way: without, bright things turn
    /// white together and could not be told apart any more.
    pub(crate) fn with_spread_highlights(&self) -> WarpedPhotograph<'_> {
        WarpedPhotograph {
            photograph: Cow::Borrowed(&self.photograph),
            rows_above: self.rows_above,
            reduced_by: self.reduced_by,
            grid: self.grid.clone(),
            feather: self.feather.clone(),
            light: self.light.clone().with_whole_shoulder(),
            local: self.local.clone(),
            ignored: self.ignored.clone(),
            is_fitted: self.is_fitted,
        }
    }

    /// The grid, in the pixels of [`Self::photograph`].
    pub(crate) fn grid(&self) -> &DeformedGrid {
        &self.grid
    }

    /// The photograph as it is sampled, maybe reduced, and its exact size. There may be some of its rows only.
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
        averaging: &Averaging,
        scratch: &mut SamplingMemory,
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
                self.add_run(y, &run, &mut sums[run.columns.clone()], averaging, scratch);
            }
        }
    }

    /// Samples one run and adds it to its canvas pixels.
    fn add_run(
        &self,
        y: usize,
        run: &CellRun,
        sums: &mut [[f32; 4]],
        averaging: &Averaging,
        scratch: &mut SamplingMemory,
    ) {
        let cell = &self.grid.cells[run.cell];
        let SamplingMemory { positions, samples, at_border, factors, .. } = scratch;
        samples.resize(run.columns.len(), [0.0; 4]);
        self.interpolate_run(y, run, &averaging.resampling, positions, samples, at_border);
        let contribution = Contribution {
            feather: &self.feather,
            light: &self.light,
            local: self.local_factors(y, &run.columns, factors),
            border_footprint: cell.near_border.then(|| cell.footprint.map(|pixels| pixels as f32)),
            weighting: averaging.weighting,
        };
        accumulate(contribution, positions, samples, sums);
    }

    /// Sets in `out`, the pixels of `window` row by row, which are zeros, the square root of corrected linear light and
    /// the share of the pixel that is covered, where anything is.
    pub(crate) fn sample(
        &self,
        window: Window<'_>,
        out: &mut [[f32; 4]],
        resampling: &Resampling,
        scratch: &mut SamplingMemory,
    ) {
        let width = window.columns.len();
        let (columns, rows) = (common(window.columns, &self.grid.columns), common(window.rows, &self.grid.rows));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        self.grid.cells_in_window(&columns, &rows, &mut scratch.candidates);
        for y in rows {
            let row = &mut out[(y - window.rows.start) * width..][..width];
            self.sample_row(y, &columns, window.columns.start, row, resampling, scratch, &mut |_, _| {});
        }
    }

    /// [`Self::sample`], which hands `sink` one row of the window after the other.
    pub(crate) fn sample_rows(
        &self,
        window: Window<'_>,
        resampling: &Resampling,
        scratch: &mut SamplingMemory,
        sink: &mut impl RowSink,
    ) {
        let Window { columns: all, rows: all_rows } = window;
        let mut row = vec![[0.0; 4]; all.len()];
        let (columns, rows) = (common(all, &self.grid.columns), common(all_rows, &self.grid.rows));
        if !columns.is_empty() && !rows.is_empty() {
            self.grid.cells_in_window(&columns, &rows, &mut scratch.candidates);
        }
        for y in all_rows.clone() {
            row.fill([0.0; 4]);
            if !columns.is_empty() && rows.contains(&y) {
                self.sample_row(y, &columns, all.start, &mut row, resampling, scratch, &mut |first, own| {
                    sink.own(first, own)
                });
            }
            sink.row(y - all_rows.start, &mut row);
        }
    }

    /// The pixels `columns` of canvas row `y`, of the `row` that begins at column `first`, among the candidates of
    /// `scratch`; `look` is shown the photograph's own values as [`RowSink::own`] is.
    #[allow(clippy::too_many_arguments)]
    fn sample_row(
        &self,
        y: usize,
        columns: &Range<usize>,
        first: usize,
        row: &mut [[f32; 4]],
        resampling: &Resampling,
        scratch: &mut SamplingMemory,
        look: &mut impl FnMut(usize, &[[f32; 4]]),
    ) {
        let SamplingMemory { candidates, owner, runs, positions, at_border, factors, .. } = scratch;
        self.grid.runs_within(y, columns, candidates, owner, runs);
        let covered = runs.first().map_or(0, |run| run.columns.start)..runs.last().map_or(0, |run| run.columns.end);
        let local = self.local_factors(y, &covered, factors);
        for run in &*runs {
            let start = run.columns.start - first;
            let samples = &mut row[start..start + run.columns.len()];
            self.interpolate_run(y, run, resampling, positions, samples, at_border);
            look(start, samples);
            let cell = &self.grid.cells[run.cell];
            let development = Development {
                feather: &self.feather,
                light: &self.light,
                local: local.map(|all| &all[run.columns.start - covered.start..run.columns.end - covered.start]),
                border_footprint: cell.near_border.then(|| cell.footprint.map(|pixels| pixels as f32)),
            };
            develop(development, positions, samples);
        }
    }

    /// The factors of the places along a row, made in `factors`; `None` if they are 1.
    fn local_factors<'f>(&self, y: usize, columns: &Range<usize>, factors: &'f mut Vec<f32>) -> Option<&'f [f32]> {
        self.local.as_ref()?.factors(y, columns.clone(), factors);
        Some(factors)
    }

    /// The photograph's own values (0 to 255) along one run.
    fn interpolate_run(
        &self,
        y: usize,
        run: &CellRun,
        resampling: &Resampling,
        positions: &mut Positions,
        samples: &mut [[f32; 4]],
        at_border: &mut Vec<usize>,
    ) {
        let cell = &self.grid.cells[run.cell];
        positions.resize(run.columns.len());
        invert_row(&cell.inverse_along_row(y), run.columns.start, positions);
        let threshold = if self.is_fitted { FITTED_THRESHOLD } else { resampling.minification_threshold };
        let stretch = cell.footprint.map(|pixels| (pixels / threshold).clamp(1.0, MAX_STRETCH));
        positions.move_up(self.rows_above);
        match resampling.interpolation {
            Interpolation::Bilinear => {
                interpolate::<Bilinear>(&self.photograph, positions, stretch, samples, at_border)
            }
            Interpolation::Bicubic => interpolate::<Bicubic>(&self.photograph, positions, stretch, samples, at_border),
        }
        positions.move_down(self.rows_above);
        if let Some(ignored) = &self.ignored {
            for (index, (x, sample)) in run.columns.clone().zip(samples).enumerate() {
                if ignored.hides(positions.place(index), self.grid.size, [x, y]) {
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

/// The grid over the photograph with so many times fewer pixels along each side.
fn reduced(mesh: &GridMesh, factor: f64) -> GridMesh {
    GridMesh { width: mesh.width / factor, height: mesh.height / factor, ..mesh.clone() }
}

/// The fewest photograph pixels per canvas pixel in any cell.
fn least_footprint(grid: &DeformedGrid) -> f64 {
    /// A cell that is stretched more unevenly lies at a pole of the projection; it asks for detail along one axis that
    /// it cannot show along the other.
    const UNEVEN: f64 = 4.0;
    let even =
        |cell: &&Cell| cell.footprint[0].max(cell.footprint[1]) <= UNEVEN * cell.footprint[0].min(cell.footprint[1]);
    grid.cells.iter().filter(even).flat_map(|cell| cell.footprint).fold(f64::INFINITY, f64::min)
}

/// How often the photograph can be halved and still have, in every cell, at least the samples that the widened kernel
/// of the least reduced cell wants.
fn halvings_before_sampling(grid: &DeformedGrid, minification_threshold: f64) -> u32 {
    let shorter = grid.size[0].min(grid.size[1]);
    let wanted = (least_footprint(grid) / minification_threshold).min(shorter);
    if wanted >= 2.0 { wanted.log2().floor().min(16.0) as u32 } else { 0 }
}

/// How many times smaller the photograph is made so that it need not be averaged where it is drawn largest; `None`
/// where that is not worth a second kernel.
fn fitting_factor(grid: &DeformedGrid, resampling: &Resampling) -> Option<f64> {
    /// Steps of the factor: the same for what is drawn twice on a cylinder, wherever it lies there.
    const STEPS: f64 = 64.0;
    /// Smallest side of what is made smaller, pixels.
    const SMALLEST: f64 = 16.0;
    let least = least_footprint(grid);
    let is_averaged = least.is_finite() && least >= FITTED_THRESHOLD;
    let is_large = grid.size[0].min(grid.size[1]) >= SMALLEST;
    let factor = (least / resampling.minification_threshold).min(MAX_STRETCH);
    (resampling.fits_photographs && is_averaged && is_large).then(|| (factor * STEPS).floor() / STEPS)
}
