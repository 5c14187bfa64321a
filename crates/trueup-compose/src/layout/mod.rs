//! The canvas: deformed grids in any common unit become grids in canvas pixels.

mod canvas;
mod checked;
mod cylinder;
mod options;
mod size;
#[cfg(test)]
mod tests;
mod unrolled;

use nalgebra::Vector2;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use size::{canvas_size, most_pixels, scale_within};

pub(crate) use canvas::reaches_into;
pub use canvas::{CanvasLayout, Placed};
pub(crate) use checked::check_mesh;
pub(crate) use cylinder::{TURNS, columns_around, unit_of_turn};
pub use options::{CanvasOptions, Crop};
pub use size::median_cell_scale;
pub(crate) use unrolled::Unrolled;

const STAGE: &str = CanvasOptions::STAGE;

/// Lays the grids on one canvas: shifted by the smallest vertex, scaled so that the photograph `placed[reference]`
/// keeps its pixel scale times [`CanvasOptions::scale`].
///
/// Targets may be in any unit common to all grids. The canvas is `ceil(max - min)` of the scaled vertices; above
/// [`CanvasOptions::max_pixels`] and [`CanvasOptions::max_growth`] all vertices are reduced evenly and `canvas-reduced`
/// is reported.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if there is no grid, `reference` is not one of them, or a grid's size and
/// number of vertices disagree; [`Error::Unsolvable`] if a vertex is not finite or the reference has no area.
///
/// # Departures
/// The scale of the reference is the median over its cells, so that a few stretched cells at its border do not count.
pub fn run(
    placed: Vec<Placed>,
    reference: usize,
    options: &CanvasOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    run_around(placed, reference, None, options, context)
}

/// As [`run`]; with a `period`, on a cylinder: places that far apart in x, in the unit of the targets, are the same.
/// The canvas then is the one period around the middle of the grids; its scale is the nearest to that asked for, by at
/// most a 64th or 4 pixels, at which the period is a whole number of the samples that blending takes, see
/// [`CanvasLayout::period`].
///
/// # Errors
/// As [`run`]; [`Error::Unsolvable`] if the period is not a positive length.
pub fn run_around(
    placed: Vec<Placed>,
    reference: usize,
    period: Option<f64>,
    options: &CanvasOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    check(&placed, options)?;
    let Some(anchor) = placed.get(reference) else {
        return Err(Error::input(
            "canvas",
            format!("photograph {reference} of {} cannot be the reference", placed.len()),
            "Choose one of the photographs in use.",
        ));
    };
    let pixel_scale = median_cell_scale(&anchor.mesh);
    if !(pixel_scale.is_finite() && pixel_scale > 0.0) {
        return Err(Error::unsolvable(
            STAGE,
            format!("photograph {}", anchor.photograph),
            "the reference has no area in the panorama",
            "Choose another reference or another method.",
        ));
    }
    let frame = Frame { canvas_from_target: options.scale / pixel_scale, window: None, period, whole_from: None };
    fitted(placed, &frame, options, context)
}

/// What part of the common unit's plane becomes the canvas, and how large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Canvas pixels wanted per unit of the targets; [`CanvasOptions::scale`] is in it.
    pub canvas_from_target: f64,
    /// Smallest and largest target that may be shown; `None`: all that the grids cover.
    pub window: Option<[Vector2<f64>; 2]>,
    /// Places that far apart in x are the same: the canvas is a cylinder of that many units, from the window's left
    /// end.
    pub period: Option<f64>,
    /// Share of the window's height, 0 to 1, from which on, if the grids reach over it, all of the window becomes the
    /// canvas; `None`: never more than they reach over.
    pub whole_from: Option<f64>,
}

/// Lays the grids on one canvas as `frame` wants it: of the window the part that the grids cover. Grids that show
/// nothing in it are left out.
///
/// # Errors
/// Those of [`run_around`]; [`Error::Unsolvable`] if no grid shows anything in the window.
pub fn framed(
    placed: Vec<Placed>,
    frame: &Frame,
    options: &CanvasOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    check(&placed, options)?;
    fitted(placed, frame, options, context)
}

fn check(placed: &[Placed], options: &CanvasOptions) -> Result<()> {
    options.check()?;
    placed.iter().try_for_each(check_mesh)
}

/// [`framed`] of what has been checked.
fn fitted(
    mut placed: Vec<Placed>,
    frame: &Frame,
    options: &CanvasOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    let (mut low, mut high) = bounds(&placed);
    if frame.period.is_some_and(|period| period.is_nan() || period <= 0.0) {
        return Err(Error::unsolvable(STAGE, "a full turn", "its period is not a length", "Choose another method."));
    }
    if let Some(period) = frame.period {
        low.x = frame.window.map_or(0.5 * (low.x + high.x - period), |[window_low, _]| window_low.x);
        high.x = low.x + period;
    }
    if let Some([window_low, window_high]) = frame.window {
        (low, high) = (low.sup(&window_low), high.inf(&window_high));
        let share = (high.y - low.y) / (window_high.y - window_low.y);
        if frame.whole_from.is_some_and(|least| share >= least) {
            (low.y, high.y) = (window_low.y, window_high.y);
        }
        if let Some(period) = frame.period {
            // All of a turn is shown.
            high.x = low.x + period;
        }
        placed.retain(|item| reaches_into(&item.mesh, frame.period.is_some(), low, high));
    }
    let extent = high - low;
    if placed.is_empty() || !extent.max().is_finite() || extent.min() < 0.0 {
        let (reason, hint) = match placed.is_empty() || extent.max().is_finite() {
            true => (
                "no photograph lies in the frame",
                "Widen projection.fov, turn the view towards the photographs, or choose another projection.",
            ),
            false => (
                "the photographs lie too far apart to be measured",
                "Leave out the photographs that are not part of the scene.",
            ),
        };
        return Err(Error::unsolvable(STAGE, "all photographs", reason, hint));
    }
    let max_pixels = most_pixels(&placed, options);
    let wanted = frame.canvas_from_target;
    let size = |scale: f64| canvas_size(extent, scale, frame.period);
    let found = scale_within(size, extent, wanted, max_pixels);
    let [width, height] = size(found);
    let canvas_from_target = frame.period.map_or(found, |period| width / period);
    if found < wanted {
        let [wanted_width, wanted_height] = size(wanted);
        context.report(Diagnostic::warning(
            "canvas-reduced",
            Subject::stage(STAGE),
            format!(
                "a canvas of {wanted_width:.0} x {wanted_height:.0} px is above the limit of {max_pixels:.0} px; it was \
                 reduced to {width:.0} x {height:.0}"
            ),
            "Raise canvas.max_pixels or canvas.max_growth, or choose a projection that stretches the borders less.",
        ));
    }
    for vertex in placed.iter_mut().flat_map(|item| &mut item.mesh.target) {
        *vertex = ((Vector2::from(*vertex) - low) * canvas_from_target).into();
    }
    let (width, height) = (width as usize, height as usize);
    let (origin, period) = (low.into(), frame.period.map(|_| width));
    Ok(CanvasLayout { width, height, canvas_from_target, origin, placed, period })
}

fn bounds(placed: &[Placed]) -> (Vector2<f64>, Vector2<f64>) {
    let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    placed.iter().fold(start, |(low, high), item| {
        let (item_low, item_high) = item.mesh.bounds();
        (low.inf(&item_low), high.sup(&item_high))
    })
}
