//! The canvas: deformed grids in any common unit become grids in canvas pixels.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::Diagnostic;
use trueup_core::mesh::{GridLines, GridMesh};
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use crate::crop::Crop;

const STAGE: &str = CanvasOptions::STAGE;

trueup_core::options! {
    /// How large the panorama becomes.
    pub struct CanvasOptions("canvas") {
        /// Size of the panorama relative to the reference photograph's own pixels: 1 keeps every detail the reference
        /// has, 0.25 makes a quick preview.
        scale: f64 = 1.0, between(1e-4, 16.0), "";
        /// Largest number of canvas pixels. A larger canvas is reduced evenly to fit, and a diagnostic says so. What memory
        /// and disk hold is checked besides.
        max_pixels: f64 = 1e12, between(1.0, 1e12), "px";
        /// Canvas pixels for each pixel of the photographs (as large as the scale makes them) above which a canvas of more
        /// than 400 million pixels is reduced evenly: a shape that runs away is not worth its time.
        max_growth: f64 = 8.0, between(1.0, 1e6), "";
        /// What of the canvas is kept.
        crop: Crop = Crop::None, Allowed::Any, "";
        /// Share of the covered pixels that the largest rectangle must keep for `crop = auto` to crop to it.
        min_kept: f64 = 0.75, between(0.0, 1.0), "";
        /// Gaps between and beside the photographs of up to twice this width, as a share of a photograph's side, are filled with
        /// a smooth surface over their borders' colours: small ones in an even sky or wall are not noticed. 0 fills nothing.
        fill: f64 = 0.0, between(0.0, 1.0), "";
    }
}

/// A photograph and the deformed grid that carries it to the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Index of the photograph in the [`trueup_core::source::PhotographSource`].
    pub photograph: usize,
    /// Grid over the full-resolution photograph: width and height are its pixels.
    pub mesh: GridMesh,
}

/// The canvas and where every photograph lies on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CanvasLayout {
    /// Width of the canvas in pixels, at least 1.
    pub width: usize,
    /// Height of the canvas in pixels, at least 1.
    pub height: usize,
    /// Canvas pixels per unit of the targets that were given.
    pub canvas_from_target: f64,
    /// What lies at the canvas's corner (0, 0), in the unit of the targets that were given.
    #[serde(default)]
    pub origin: [f64; 2],
    /// The photographs used, in the order given; targets are canvas pixels and may lie outside the canvas.
    pub placed: Vec<Placed>,
    /// The canvas is a cylinder of that many columns, its width: what lies beyond one end is seen at the other. A multiple
    /// of 8, so that the finer levels of a blend repeat exactly; with others its ends may show a faint step.
    #[serde(default)]
    pub period: Option<usize>,
}

/// Lays the grids on one canvas: shifted by the smallest vertex, scaled so that the photograph `placed[reference]`
/// keeps its pixel scale times [`CanvasOptions::scale`].
///
/// Targets may be in any unit common to all grids. The canvas is `ceil(max - min)` of the scaled vertices; above
/// [`CanvasOptions::max_pixels`] and [`CanvasOptions::max_growth`] all vertices are reduced evenly and `canvas-reduced` is
/// reported.
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

/// As [`run`]; with a `period`, on a cylinder: places that far apart in x, in the unit of the targets, are the same. The
/// canvas then is the one period around the middle of the grids; its scale is the nearest to that asked for at which the
/// period is a multiple of 8 pixels.
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
    options.check()?;
    for item in &placed {
        check_mesh(item)?;
    }
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
    let frame = Frame { canvas_from_target: options.scale / pixel_scale, window: None, period };
    framed(placed, &frame, options, context)
}

/// What part of the common unit's plane becomes the canvas, and how large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Canvas pixels wanted per unit of the targets; [`CanvasOptions::scale`] is in it.
    pub canvas_from_target: f64,
    /// Smallest and largest target that may be shown; `None`: all that the grids cover.
    pub window: Option<[Vector2<f64>; 2]>,
    /// Places that far apart in x are the same: the canvas is a cylinder of that many units, from the window's left end.
    pub period: Option<f64>,
}

/// Lays the grids on one canvas as `frame` wants it: of the window the part that the grids cover. Grids that show nothing in
/// it are left out.
///
/// # Errors
/// Those of [`run_around`]; [`Error::Unsolvable`] if no grid shows anything in the window.
pub fn framed(
    mut placed: Vec<Placed>,
    frame: &Frame,
    options: &CanvasOptions,
    context: &StageContext,
) -> Result<CanvasLayout> {
    options.check()?;
    for item in &placed {
        check_mesh(item)?;
    }
    let (mut low, mut high) = bounds(&placed);
    if frame.period.is_some_and(|period| period.is_nan() || period <= 0.0) {
        return Err(Error::unsolvable(STAGE, "the canvas", "its period is not a length", "Choose another method."));
    }
    if let Some(period) = frame.period {
        low.x = frame.window.map_or(0.5 * (low.x + high.x - period), |[window_low, _]| window_low.x);
        high.x = low.x + period;
    }
    if let Some([window_low, window_high]) = frame.window {
        (low, high) = (low.sup(&window_low), high.inf(&window_high));
        placed.retain(|item| shows(&item.mesh, frame.period.is_some(), low, high));
    }
    let extent = high - low;
    if placed.is_empty() || !extent.max().is_finite() || extent.min() < 0.0 {
        return Err(match placed.is_empty() || extent.max().is_finite() {
            true => Error::unsolvable(
                STAGE,
                "the canvas",
                "no photograph lies in the frame",
                "Widen projection.fov, turn the view towards the photographs, or choose another projection.",
            ),
            false => Error::unsolvable(
                STAGE,
                "the canvas",
                "the photographs lie too far apart to be measured",
                "Leave out the photographs that are not part of the scene.",
            ),
        });
    }
    let max_pixels = most_pixels(&placed, options);
    let wanted = frame.canvas_from_target;
    let size = |scale: f64| canvas_size(extent, scale, frame.period.is_some());
    let found = scale_within(size, extent, wanted, max_pixels);
    let [width, height] = size(found);
    let canvas_from_target = frame.period.map_or(found, |period| width / period);
    if found < wanted {
        let [wanted_width, wanted_height] = size(wanted);
        context.report(Diagnostic::warning(
            "canvas-reduced",
            STAGE,
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

/// Whether a whole cell of the grid reaches into the box; on a cylinder, into its rows.
pub(crate) fn shows(mesh: &GridMesh, around: bool, low: Vector2<f64>, high: Vector2<f64>) -> bool {
    mesh.whole_cells().any(|corners| {
        let corners = corners.map(|vertex| mesh.target[vertex]);
        (usize::from(around)..2).all(|axis| {
            corners.iter().any(|corner| corner[axis] > low[axis])
                && corners.iter().any(|corner| corner[axis] < high[axis])
        })
    })
}

impl CanvasLayout {
    /// The smaller side of a photograph on the canvas, pixels: the median over those placed; 1 if there is none.
    pub(crate) fn photograph_side(&self) -> f64 {
        let side = |placed: &Placed| {
            let (low, high) = placed.mesh.bounds();
            (high - low).min()
        };
        let mut sides: Vec<f64> = self.placed.iter().map(side).collect();
        sides.sort_by(f64::total_cmp);
        sides.get(sides.len() / 2).copied().unwrap_or(1.0)
    }

    /// The layout without its period: every photograph at every place at which it meets the columns from `-reach` to
    /// `width + reach`. With `reach`, the canvas is wider by it on both sides and begins that much farther left.
    ///
    /// Gives for each of the photographs placed the position of its original. Without a period nothing changes.
    pub(crate) fn unrolled(&self, reach: usize) -> (Cow<'_, Self>, Vec<usize>) {
        let Some(period) = self.period else { return (Cow::Borrowed(self), (0..self.placed.len()).collect()) };
        let (mut placed, mut originals) = (Vec::new(), Vec::new());
        let (reach_px, width) = (reach as f64, self.width as f64);
        for (position, item) in self.placed.iter().enumerate() {
            let (low, high) = item.mesh.bounds();
            // One pixel more for what the border's pixels take from beyond it.
            let first = ((-reach_px - high.x - 1.0) / period as f64).ceil();
            let last = ((width + reach_px - low.x + 1.0) / period as f64).floor();
            let mut turn = first;
            while turn <= last {
                placed.push(item.moved(turn * period as f64 + reach_px));
                originals.push(position);
                turn += 1.0;
            }
        }
        (Cow::Owned(Self { width: self.width + 2 * reach, placed, period: None, ..*self }), originals)
    }
}

/// Turns that a photograph of [`Placed::in_first_turn`] may reach into: its own, those that a very wide one takes up.
pub(crate) const TURNS: usize = 4;

/// The columns of a photograph of [`Placed::in_first_turn`], beginning in the first turn and not longer than one. One that
/// goes all the way round is to be turned to the right by the second number of columns, after which it begins at 0.
pub(crate) fn columns_around(columns: Range<usize>, period: Option<usize>) -> (Range<usize>, usize) {
    let Some(period) = period else { return (columns, 0) };
    let start = columns.start % period;
    if columns.len() >= period { (0..period, start) } else { (start..start + columns.len(), 0) }
}

impl Placed {
    /// The photograph moved to the right.
    fn moved(&self, by: f64) -> Self {
        let mut moved = self.clone();
        for vertex in &mut moved.mesh.target {
            vertex[0] += by;
        }
        moved
    }

    /// The photograph moved by whole turns, so that it begins in the first turn or soon after and no column before it is
    /// wanted for its border; without a period where it is.
    pub(crate) fn in_first_turn(&self, period: Option<usize>) -> Cow<'_, Self> {
        let Some(period) = period else { return Cow::Borrowed(self) };
        // As a share of the period: pixels of any smaller canvas that the border cuts.
        const RIM: f64 = 1.0 / 16.0;
        let turns = RIM - self.mesh.bounds().0.x / period as f64;
        let moved = turns.ceil() * period as f64;
        if moved == 0.0 { Cow::Borrowed(self) } else { Cow::Owned(self.moved(moved)) }
    }
}

/// The largest canvas that is not reduced.
fn most_pixels(placed: &[Placed], options: &CanvasOptions) -> f64 {
    /// Canvases of up to so many pixels are made in minutes; their growth is not looked at.
    const ANY_GROWTH_PIXELS: f64 = 400e6;
    let photographs: f64 = placed.iter().map(|item| item.mesh.width * item.mesh.height).sum();
    let grown = options.max_growth * photographs * options.scale.powi(2);
    options.max_pixels.min(grown.max(ANY_GROWTH_PIXELS))
}

/// Refuses grids no later step could walk.
pub(crate) fn check_mesh(placed: &Placed) -> Result<()> {
    let mesh = &placed.mesh;
    let subject = || format!("photograph {}", placed.photograph);
    let whole = mesh.rows >= 2
        && mesh.columns >= 2
        && mesh.rows.checked_mul(mesh.columns) == Some(mesh.target.len())
        && mesh.width >= 1.0
        && mesh.height >= 1.0
        && mesh.width.max(mesh.height).is_finite();
    if !whole {
        return Err(Error::input(
            subject(),
            format!(
                "a grid of {} x {} with {} vertices over {} x {} px is not one",
                mesh.rows,
                mesh.columns,
                mesh.target.len(),
                mesh.width,
                mesh.height
            ),
            "Give rows * columns vertices, at least 2 x 2, over a picture of at least one pixel.",
        ));
    }
    let lined = |lines: &GridLines| {
        let ascending = |lines: &[f64], count: usize| {
            lines.len() == count
                && lines[0] == 0.0
                && lines[count - 1] == 1.0
                && lines.windows(2).all(|pair| pair[0] < pair[1])
        };
        ascending(&lines.columns, mesh.columns) && ascending(&lines.rows, mesh.rows)
    };
    if !mesh.lines.as_ref().is_none_or(lined) {
        return Err(Error::input(
            subject(),
            "the lines of its grid do not ascend from 0 to 1",
            "Give one share for every column and row of vertices.",
        ));
    }
    let infinite = mesh.target.iter().any(|vertex| {
        vertex.iter().any(|coordinate| coordinate.is_infinite()) || vertex[0].is_nan() != vertex[1].is_nan()
    });
    if infinite || mesh.whole_cells().next().is_none() {
        return Err(Error::unsolvable(
            STAGE,
            subject(),
            if infinite { "its grid has vertices that are not finite" } else { "its grid has no cell that is whole" },
            "Leave this photograph out, or choose another method or projection.",
        ));
    }
    Ok(())
}

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

fn bounds(placed: &[Placed]) -> (Vector2<f64>, Vector2<f64>) {
    let start = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    placed.iter().fold(start, |(low, high), item| {
        let (item_low, item_high) = item.mesh.bounds();
        (low.inf(&item_low), high.sup(&item_high))
    })
}

/// Columns of which a cylinder has a whole number of times: those of a sample of the level from which on blending is done
/// as a whole.
pub(crate) const CYLINDER_UNIT: usize = 8;

/// Width and height of the canvas in whole pixels, at least 1 each; `around` a cylinder the width is the nearest multiple of
/// its unit, and the height follows.
fn canvas_size(extent: Vector2<f64>, scale: f64, around: bool) -> [f64; 2] {
    // A photograph of 100 px placed at a fractional offset spans 100 px plus rounding; that is no 101st column.
    const ROUNDING_PX: f64 = 1e-6;
    let units = (extent.x * scale / CYLINDER_UNIT as f64).round().max(1.0);
    let around = around.then_some(units * CYLINDER_UNIT as f64);
    let scale_y = around.map_or(scale, |width| width / extent.x);
    let width = around.unwrap_or((extent.x * scale - ROUNDING_PX).ceil());
    [width.max(1.0), (extent.y * scale_y - ROUNDING_PX).ceil().max(1.0)]
}

/// The largest scale, at most `wanted`, whose canvas holds at most `max_pixels`.
fn scale_within(size: impl Fn(f64) -> [f64; 2], extent: Vector2<f64>, wanted: f64, max_pixels: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(scale: f64, shift: [f64; 2]) -> Placed {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        for vertex in &mut mesh.target {
            *vertex = [vertex[0] * scale + shift[0], vertex[1] * scale + shift[1]];
        }
        Placed { photograph: 0, mesh }
    }

    #[test]
    fn the_reference_keeps_its_pixel_scale() {
        let context = StageContext::default();
        let pictures = vec![placed(0.25, [-7.0, 3.0]), placed(0.5, [43.0, 3.0])];
        let layout = run(pictures.clone(), 0, &CanvasOptions::default(), &context).expect("two grids");
        // In units of 0.25: the first spans 400 px, the second starts 200 px in and is twice as large.
        assert_eq!((layout.width, layout.height), (1000, 600));
        assert!((layout.canvas_from_target - 4.0).abs() < 1e-12);
        let half = CanvasOptions { scale: 0.5, ..CanvasOptions::default() };
        let layout = run(pictures, 1, &half, &context).expect("two grids");
        assert_eq!((layout.width, layout.height), (250, 150));
        assert!(context.take_diagnostics().is_empty());
    }

    #[test]
    fn a_canvas_above_the_limit_is_reduced_and_reported() {
        let context = StageContext::default();
        let options = CanvasOptions { max_pixels: 1000.0, ..CanvasOptions::default() };
        let layout = run(vec![placed(1.0, [0.0, 0.0])], 0, &options, &context).expect("one grid");
        assert!(layout.width * layout.height <= 1000);
        assert!(layout.width * layout.height > 900, "{} x {}", layout.width, layout.height);
        assert_eq!(context.take_diagnostics()[0].code, "canvas-reduced");
    }

    #[test]
    fn a_cylinder_is_its_period_in_whole_pixels_around_the_middle() {
        let context = StageContext::default();
        // From -10 to 490, with a period of 380.3: 59.85 beyond each end. 384 is the nearest multiple of 8.
        let pictures = vec![placed(1.0, [-10.0, 3.0]), placed(1.0, [90.0, 3.0])];
        let options = CanvasOptions::default();
        let layout = run_around(pictures.clone(), 0, Some(380.3), &options, &context).expect("two grids");
        assert_eq!((layout.width, layout.height, layout.period), (384, 303, Some(384)));
        let share = 384.0 / 380.3;
        assert!((layout.canvas_from_target - share).abs() < 1e-12);
        let (low, _) = layout.placed[0].mesh.bounds();
        let (_, high) = layout.placed[1].mesh.bounds();
        assert!((low.x + 59.85 * share).abs() < 1e-9 && (high.x - 384.0 - 59.85 * share).abs() < 1e-9);
        assert!(run_around(pictures.clone(), 0, Some(f64::NAN), &options, &context).is_err());
        // Each lies across one end, and so is placed there again; 100 px further out, both are seen once more.
        let (wide, originals) = layout.unrolled(0);
        assert_eq!((originals.as_slice(), wide.width, wide.period), ([0, 0, 1, 1].as_slice(), 384, None));
        let (wide, originals) = layout.unrolled(100);
        assert_eq!((originals.as_slice(), wide.width), ([0, 0, 0, 1, 1, 1].as_slice(), 584));
        assert!((wide.placed[1].mesh.target[0][0] - wide.placed[0].mesh.target[0][0] - 384.0).abs() < 1e-9);
        let first = layout.placed[0].in_first_turn(layout.period);
        assert!((first.mesh.bounds().0.x - (384.0 - 59.85 * share)).abs() < 1e-9);
        let second = layout.placed[1].in_first_turn(layout.period);
        assert_eq!(second, Cow::Borrowed(&layout.placed[1]));
        assert_eq!(columns_around(350..420, Some(380)), (350..420, 0));
        assert_eq!(columns_around(390..420, Some(380)), (10..40, 0));
        assert_eq!(columns_around(390..800, Some(380)), (0..380, 10));
        assert_eq!(columns_around(390..800, None), (390..800, 0));
        let flat = run(pictures, 0, &options, &context).expect("two grids");
        assert_eq!(flat.unrolled(100), (Cow::Borrowed(&flat), vec![0, 1]));
    }

    #[test]
    fn a_canvas_that_runs_away_is_reduced() {
        let context = StageContext::default();
        let options = CanvasOptions::default();
        // Two photographs of 0.12 million pixels, 100,000 of their widths apart.
        let far = vec![placed(1.0, [0.0, 0.0]), placed(1.0, [4e7, 0.0])];
        let layout = run(far, 0, &options, &context).expect("two grids");
        assert!(layout.width * layout.height <= 400_000_000);
        assert_eq!(context.take_diagnostics()[0].code, "canvas-reduced");
        // One of them enlarged to 1.2 billion pixels is what was asked for.
        let large = CanvasOptions { scale: 16.0, ..options };
        let mut photograph = placed(1.0, [0.0, 0.0]);
        (photograph.mesh.width, photograph.mesh.height) = (4000.0, 3000.0);
        photograph.mesh.target.iter_mut().flatten().for_each(|coordinate| *coordinate *= 10.0);
        let layout = run(vec![photograph], 0, &large, &context).expect("one grid");
        assert_eq!((layout.width, layout.height), (64_000, 48_000));
        assert!(context.take_diagnostics().is_empty());
    }

    #[test]
    fn a_very_long_strip_is_reduced_too() {
        let mut strip = placed(1.0, [0.0, 0.0]);
        for vertex in &mut strip.mesh.target {
            vertex[0] *= 1e9;
            vertex[1] *= 1e-9;
        }
        let options = CanvasOptions { max_pixels: 1e5, ..CanvasOptions::default() };
        let layout = run(vec![strip], 0, &options, &StageContext::default()).expect("one grid");
        assert!(layout.width <= 100_000 && layout.height == 1);
    }

    #[test]
    fn unusable_grids_are_named() {
        let context = StageContext::default();
        let options = CanvasOptions::default();
        let mut infinite = placed(1.0, [0.0, 0.0]);
        infinite.mesh.target[5][1] = f64::INFINITY;
        assert!(matches!(run(vec![infinite], 0, &options, &context), Err(Error::Unsolvable { .. })));
        let mut short = placed(1.0, [0.0, 0.0]);
        short.mesh.target.pop();
        assert!(matches!(run(vec![short], 0, &options, &context), Err(Error::Input { .. })));
        assert!(matches!(run(vec![], 0, &options, &context), Err(Error::Input { .. })));
        let point = placed(0.0, [0.0, 0.0]);
        assert!(matches!(run(vec![point], 0, &options, &context), Err(Error::Unsolvable { .. })));
        let bad = CanvasOptions { scale: 0.0, ..options };
        assert!(matches!(run(vec![], 0, &bad, &context), Err(Error::Options(_))));
    }
}
