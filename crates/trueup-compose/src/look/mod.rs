//! What is done with differences of exposure beyond those that a picture can bear.
//!
//! Corrections make the light of all photographs one: beside photographs of sunlight, what was exposed for the shade
//! comes out as dark as it is, and a room behind a sunlit door is black. Here every photograph gets back a part of its
//! own exposure, and this goes over into what its neighbors get as widely and smoothly as they overlap. Each place of
//! the canvas has one factor for all photographs: they fit together as before, contours and all, and no contour has a
//! halo.

use trueup_core::StageContext;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::mesh::GridMesh;

use crate::deformed_grid::DeformedGrid;
use crate::layout::CanvasLayout;
use crate::light::{Correction, ExposureMap, LocalExposure};
use crate::render_options::Look;
use crate::weights::Feather;

/// How much of a difference of exposure is evened out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bearing {
    /// Stops from the panorama's level up to which photographs are evened out wholly.
    whole_stops: f64,
    /// Stops that a photograph is evened out by at most, however far from the panorama's level it is.
    most_stops: f64,
}

impl Look {
    /// The stops by which a photograph is evened out of the `stops` that would make it fit.
    pub(crate) fn borne(self, stops: f64) -> f64 {
        self.bearing().map_or(stops, |bearing| bearing.borne(stops))
    }

    /// What it bears; `None` for everything.
    fn bearing(self) -> Option<Bearing> {
        match self {
            // A photograph that was exposed well has about a stop and a half between its highlights and white, and as
            // much of its shadows can be spared. Photographs up to two stops apart are brought together wholly.
            Self::Natural => Some(Bearing { whole_stops: 1.0, most_stops: 1.5 }),
            Self::Hdr => Some(Bearing { whole_stops: 0.25, most_stops: 0.5 }),
            Self::Linear => None,
        }
    }
}

impl Bearing {
    /// The stops by which a photograph is evened out of the `stops` that would make it fit: the same up to
    /// [`Self::whole_stops`], from there ever less, smoothly towards [`Self::most_stops`].
    fn borne(self, stops: f64) -> f64 {
        let room = self.most_stops - self.whole_stops;
        let beyond = (stops.abs() - self.whole_stops).max(0.0);
        let borne = stops.abs().min(self.whole_stops) + room * (1.0 - (-beyond / room).exp());
        borne.copysign(stops)
    }
}

/// The factors that a look lays over the canvas, for photographs with these corrections (one for each placed); `None`
/// if all are 1.
///
/// They depend on where the photographs lie, not on what is kept of the canvas.
///
/// # Source
/// The exposure that a camera chose for a view is what a photographer would choose for that part of the scene; blending
/// exposures instead of pixels is the exposure field of Lischinski, Farbman, Uyttendaele, Szeliski, "Interactive local
/// adjustment of tonal values", SIGGRAPH 2006.
///
/// # Departures
/// The field there follows contours of the picture, with strokes by hand; here it is smooth, and what it changes is
/// told by the photographs' exposures.
pub(crate) fn local_exposure(layout: &CanvasLayout, corrections: &[Correction], look: Look) -> Option<LocalExposure> {
    let bearing = look.bearing()?;
    let given_back = |correction: &Correction| {
        let stops = correction.brightness().log2();
        bearing.borne(stops) - stops
    };
    let stops: Vec<f64> = corrections.iter().map(given_back).collect();
    if stops.iter().all(|stops| stops.abs() < LEAST_STOPS) {
        return None;
    }
    let field = Field::new(layout)?;
    let (layout, originals) = layout.unrolled(0);
    let mut sums = vec![[0.0_f64; 2]; field.cells[0] * field.cells[1]];
    for (placed, original) in layout.placed.iter().zip(originals) {
        field.add(&placed.mesh, *stops.get(original)?, &mut sums);
    }
    Some(field.smoothed(&sums).into())
}

/// Says how far apart the exposures are that a look brings together in part.
pub(crate) fn report(corrections: &[Correction], look: Look, context: &StageContext) {
    let stops = corrections.iter().map(|correction| correction.brightness().log2());
    let (low, high) = stops.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| (low.min(one), high.max(one)));
    let (apart, borne) = (high - low, look.borne(high) - look.borne(low));
    let message = format!("exposures lie {apart:.1} stops apart, of which {borne:.1} are evened out");
    let hint = "Choose --look linear for one exposure everywhere, --look hdr for more detail in sun and shade.";
    context.report(Diagnostic::note("exposures-far-apart", Subject::stage("panorama"), message, hint));
}

/// Stops that are not seen: half of an 8-bit level of the brightest gray.
const LEAST_STOPS: f64 = 5e-3;

/// Cells of the field along the shorter side of a photograph: a transition is some thirty of them wide.
const CELLS_PER_SIDE: f64 = 48.0;

/// Most cells of a field, 190 MB while it is made. A thousand photographs have fewer.
const MOST_CELLS: f64 = 2e6;

/// Standard deviation of the smoothing as a share of the photographs' shorter side: where overlaps are narrow, the
/// change takes about half of a photograph.
const SMOOTHING: f64 = 0.15;

/// Exponent of the weight of a photograph towards its border: the change takes the whole overlap.
const FEATHER_EXPONENT: f64 = 1.0;

/// Where the factors are known: cells over all that the photographs cover.
struct Field {
    cells: [usize; 2],
    cell_px: [f64; 2],
    corner: [f64; 2],
    around: bool,
    /// Standard deviation of the smoothing along x and y, cells.
    deviation: [f64; 2],
}

impl Field {
    /// For the photographs of a layout; `None` if they cover nothing.
    fn new(layout: &CanvasLayout) -> Option<Self> {
        let bounds = layout.placed.iter().map(|placed| placed.mesh.bounds());
        let (low, high) = bounds.reduce(|one, other| (one.0.inf(&other.0), one.1.sup(&other.1)))?;
        let (mut corner, mut size) = ([low.x, low.y], [high.x - low.x, high.y - low.y]);
        if let Some(period) = layout.period {
            (corner[0], size[0]) = (0.0, period as f64);
        }
        if !size.iter().all(|&length| length.is_finite() && length > 0.0) {
            return None;
        }
        let side = layout.photograph_side();
        let cell =
            (side / CELLS_PER_SIDE).max((size[0] * size[1] / MOST_CELLS).sqrt()).max(size[0].max(size[1]) / MOST_CELLS);
        let cells = size.map(|length| (length / cell).ceil().max(1.0) as usize);
        let cell_px = [size[0] / cells[0] as f64, size[1] / cells[1] as f64];
        let deviation = cell_px.map(|px| SMOOTHING * side / px);
        Some(Self { cells, cell_px, corner, around: layout.period.is_some(), deviation })
    }

    /// Adds weight * stops, and the weight, of a photograph to the cells it covers.
    fn add(&self, mesh: &GridMesh, stops: f64, sums: &mut [[f64; 2]]) {
        let mut mesh = mesh.clone();
        for vertex in &mut mesh.target {
            *vertex = [0, 1].map(|axis| (vertex[axis] - self.corner[axis]) / self.cell_px[axis]);
        }
        let [across, down] = self.cells;
        let grid = DeformedGrid::new(&mesh, 1.0, false, across, down);
        let feather = Feather::new(grid.size, FEATHER_EXPONENT);
        grid.each_place(&(0..across), &(0..down), |[x, y], place, _| {
            let [column, row] = place.map(|position| (position - 0.5).floor());
            let (across_px, down_px) = ((place[0] - 0.5 - column) as f32, (place[1] - 0.5 - row) as f32);
            let weight = f64::from(feather.at(column as i32, row as i32, across_px, down_px)).max(LEAST_WEIGHT);
            let sum = &mut sums[y * across + x];
            *sum = [sum[0] + weight * stops, sum[1] + weight];
        });
    }

    /// The factors: means of the stops where something is covered, smoothed over what is covered.
    fn smoothed(&self, sums: &[[f64; 2]]) -> ExposureMap {
        let means = sums.iter().map(|&[stops, weight]| if weight > 0.0 { [stops / weight, 1.0] } else { [0.0; 2] });
        let means: Vec<[f64; 2]> = means.collect();
        let [across, down] = self.cells;
        let kernels = self.deviation.map(bell);
        let along_rows = convolved(&means, [across, down], &kernels[0], |x, step| match self.around {
            true => Some((x + step).rem_euclid(across as i64)),
            false => (0..across as i64).contains(&(x + step)).then_some(x + step),
        });
        let columns = transposed(&along_rows, [across, down]);
        let along_columns = convolved(&columns, [down, across], &kernels[1], |y, step| {
            (0..down as i64).contains(&(y + step)).then_some(y + step)
        });
        let smooth = transposed(&along_columns, [down, across]);
        let factors =
            smooth.iter().map(|&[stops, weight]| if weight > 0.0 { (stops / weight).exp2() as f32 } else { 1.0 });
        ExposureMap {
            cells: self.cells,
            cell_px: self.cell_px,
            corner: self.corner,
            around: self.around,
            factors: factors.collect(),
        }
    }
}

/// Weight of a photograph at its very border, where its feather is 0.
const LEAST_WEIGHT: f64 = 1e-3;

/// Half of a bell curve of so many cells' standard deviation, from its middle to where it has all but vanished.
fn bell(deviation: f64) -> Vec<f64> {
    /// Standard deviations after which a bell curve is cut off: below 1 % of its height.
    const REACH: f64 = 3.0;
    let reach = (REACH * deviation).ceil() as usize;
    (0..=reach).map(|step| (-0.5 * (step as f64 / deviation.max(f64::MIN_POSITIVE)).powi(2)).exp()).collect()
}

/// Every row convolved with a symmetric kernel of which half is given; `at` tells which cell lies some steps from
/// another.
fn convolved(
    cells: &[[f64; 2]],
    [across, _]: [usize; 2],
    half: &[f64],
    at: impl Fn(i64, i64) -> Option<i64>,
) -> Vec<[f64; 2]> {
    let reach = half.len() as i64 - 1;
    let mut out = Vec::with_capacity(cells.len());
    for row in cells.chunks_exact(across) {
        for x in 0..across as i64 {
            let mut sum = [0.0; 2];
            for step in -reach..=reach {
                if let Some(other) = at(x, step) {
                    let (weight, [stops, share]) = (half[step.unsigned_abs() as usize], row[other as usize]);
                    sum = [sum[0] + weight * stops, sum[1] + weight * share];
                }
            }
            out.push(sum);
        }
    }
    out
}

/// Rows as columns.
fn transposed(cells: &[[f64; 2]], [across, down]: [usize; 2]) -> Vec<[f64; 2]> {
    (0..across).flat_map(|x| (0..down).map(move |y| cells[y * across + x])).collect()
}

#[cfg(test)]
mod tests;
