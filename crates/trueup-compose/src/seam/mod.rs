//! Which photograph the panorama shows where: seams along which the photographs agree.
//!
//! Every canvas pixel is given to one photograph, so that nothing is shown twice. The seams between them run where the
//! photographs look alike, stay away from the borders of the photographs, and do not cut things that moved. They are found
//! on a small canvas by graph cuts and followed down to finer ones in a narrow band.

mod energy;
mod expansion;
mod labels;
mod max_flow;
mod moving;
mod neighbors;
mod options;
mod shading;
mod softness;

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

pub use crate::label::{Label, NOBODY};
pub use labels::Seams;
pub use options::SeamOptions;

use crate::small_views::{COARSE_PIXELS, SmallView};
use crate::window::Window;
use energy::SeamEnergy;
use expansion::{Expansions, deepest, deepest_at};
use moving::moving_things;
use softness::Softness;

/// Half width, in pixels, of the band in which a seam may move when it is followed to a canvas of twice the size.
const BAND_PX: usize = 3;

/// Rounds over all photographs on the coarse canvas, at most.
const ROUNDS: usize = 2;

/// The photographs between which seams are found.
#[derive(Debug, Clone, Copy)]
pub struct SeamInput<'a> {
    /// Every photograph on one small canvas.
    pub views: &'a [SmallView],
    /// Width and height of that canvas, pixels.
    pub size: [usize; 2],
    /// Whether the canvas is a cylinder, whose first column lies beside its last.
    pub around: bool,
}

/// A labelling of one canvas, from which that of a finer one begins.
struct Labelled {
    labels: Vec<Label>,
    /// The things that moved.
    moving: Vec<u32>,
    size: [usize; 2],
}

/// Finds the seams between photographs.
///
/// # Errors
/// [`Error::Options`]; [`Error::Input`] if there are too many views or one does not fit the canvas; [`Error::Cancelled`].
///
/// # Source
/// Kwatra, Schoedl, Essa, Turk, Bobick, "Graphcut textures: image and video synthesis using graph cuts", SIGGRAPH 2003;
/// Agarwala and others, "Interactive digital photomontage", SIGGRAPH 2004.
///
/// # Departures
/// Coarse to fine as Lombaert, Sun, Grady, Xu, "A multilevel banded graph cuts method for fast image segmentation", ICCV
/// 2005; things that moved are found first, and their parts kept together; differences of shading count, and the lack of detail, too.
pub fn run(input: &SeamInput<'_>, options: &SeamOptions, context: &StageContext) -> Result<Seams> {
    coarse_to_fine(input, COARSE_PIXELS, options, context)
}

/// [`run`], beginning on a canvas of at most `coarse_pixels`.
fn coarse_to_fine(
    input: &SeamInput<'_>,
    coarse_pixels: f64,
    options: &SeamOptions,
    context: &StageContext,
) -> Result<Seams> {
    options.check()?;
    check(input)?;
    let &SeamInput { views, size, around } = input;
    let turn = |[width, _]: [usize; 2]| if around { width } else { 0 };
    let softness = if options.sharpness_weight > 0.0 { Softness::of(views, turn(size)) } else { Vec::new() };
    let mut levels = vec![(Cow::Borrowed(views), size)];
    while let Some((finest, [width, height])) = levels.last() {
        // A cylinder stays one only if all its pixels are halved.
        let halves = !around || width.is_multiple_of(2);
        if (width * height) as f64 <= coarse_pixels || finest.len() < 2 || !halves {
            break;
        }
        let half = (finest.par_iter().map(SmallView::halved).collect(), [width.div_ceil(2), height.div_ceil(2)]);
        levels.push(half);
    }
    let mut expansions = Expansions::default();
    let mut coarser: Option<Labelled> = None;
    while let Some((views, size)) = levels.pop() {
        context.check_cancelled()?;
        let moving = match &coarser {
            None => moving_things(&views, size, turn(size)),
            Some(coarse) => doubled(&coarse.moving, coarse.size, size),
        };
        // The levels that are left are the finer ones.
        let softness = (softness.as_slice(), levels.len() as u32);
        let mut energy = SeamEnergy::new(&views, size, turn(size), &moving, softness, options);
        let labels = match &coarser {
            None => search(&mut energy, &mut expansions, context)?,
            Some(coarse) => follow(&mut energy, doubled(&coarse.labels, coarse.size, size), &mut expansions, context)?,
        };
        drop(energy);
        if levels.is_empty() {
            return Ok(Seams::new(labels, &views, size, turn(size)));
        }
        coarser = Some(Labelled { labels, moving, size });
    }
    Err(Error::input("seams", "there is no canvas to find them on", "Give a canvas of at least one pixel."))
}

fn check(input: &SeamInput<'_>) -> Result<()> {
    let &SeamInput { views, size: [width, height], around } = input;
    let fits = |view: &SmallView| {
        let in_one_turn = view.columns.start <= width && view.columns.len() <= width;
        (view.columns.end <= width || around && in_one_turn)
            && view.rows.end <= height
            && view.columns.len().checked_mul(view.rows.len()) == Some(view.pixels.len())
    };
    if views.len() < usize::from(NOBODY)
        && width.checked_mul(height).is_some_and(|pixels| pixels > 0)
        && views.iter().all(fits)
    {
        return Ok(());
    }
    Err(Error::input(
        "seams",
        format!("{} photographs do not fit on a canvas of {width} x {height} px", views.len()),
        "Give at most 65534 photographs, each inside the canvas.",
    ))
}

/// The labelling of the coarse canvas.
fn search(energy: &mut SeamEnergy<'_>, expansions: &mut Expansions, context: &StageContext) -> Result<Vec<Label>> {
    energy.prepare_differences(|_| true);
    let energy = &*energy;
    let mut labels = deepest(energy);
    // A photograph whose surroundings stayed as it left them would take nothing.
    let mut last_change = vec![1_usize; energy.views.len()];
    let mut last_try = vec![0_usize; energy.views.len()];
    let mut clock = 1;
    for _ in 0..ROUNDS {
        for (label, view) in energy.views.iter().enumerate() {
            context.check_cancelled()?;
            if last_try[label] >= last_change[label] {
                continue;
            }
            clock += 1;
            last_try[label] = clock;
            if expansions.expand(
                energy,
                &mut labels,
                label,
                Window { columns: &view.columns, rows: &view.rows },
                &|_| true,
            ) {
                for (other, neighbor) in energy.views.iter().enumerate() {
                    if other != label && view.meets(neighbor, energy.turn) {
                        last_change[other] = clock;
                    }
                }
            }
        }
    }
    Ok(labels)
}

/// The labelling of a finer canvas from that of a coarser one: seams move within a band.
fn follow(
    energy: &mut SeamEnergy<'_>,
    mut labels: Vec<Label>,
    expansions: &mut Expansions,
    context: &StageContext,
) -> Result<Vec<Label>> {
    let (width, height) = (energy.width, energy.height);
    labels.par_chunks_exact_mut(width).enumerate().for_each(|(y, labels)| {
        for (x, label) in labels.iter_mut().enumerate() {
            if *label == NOBODY || !energy.allowed(usize::from(*label), x, y) {
                *label = deepest_at(energy, [x, y]);
            }
        }
    });
    let band = band(&labels, [width, height], energy.turn, BAND_PX);
    // Costs are asked for within the band, and from there across its border.
    let beside = with_neighbors(&band, [width, height], energy.turn);
    energy.prepare_differences(|at| beside[at]);
    let energy = &*energy;
    let mut boxes = vec![[usize::MAX, usize::MAX, 0, 0]; energy.views.len()];
    for (at, &label) in labels.iter().enumerate() {
        if band[at] && label != NOBODY {
            let (x, y) = (at % width, at / width);
            let x = if energy.views[usize::from(label)].columns.contains(&x) { x } else { x + energy.turn };
            let [left, top, right, bottom] = boxes[usize::from(label)];
            boxes[usize::from(label)] = [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)];
        }
    }
    for (label, (view, [left, top, right, bottom])) in energy.views.iter().zip(boxes).enumerate() {
        context.check_cancelled()?;
        if right == 0 {
            continue;
        }
        let reach = 2 * BAND_PX + 1;
        let columns = left.saturating_sub(reach).max(view.columns.start)..(right + reach).min(view.columns.end);
        let rows = top.saturating_sub(reach).max(view.rows.start)..(bottom + reach).min(view.rows.end);
        expansions.expand(energy, &mut labels, label, Window { columns: &columns, rows: &rows }, &|at| band[at]);
    }
    Ok(labels)
}

/// Pixels within `reach` of a change of labels, on a cylinder of `turn` columns or with 0 on a plane.
fn band(labels: &[Label], [width, height]: [usize; 2], turn: usize, reach: usize) -> Vec<bool> {
    let is_edge = |at: usize| {
        let differs = |other: usize| labels[other] != labels[at];
        let x = at % width;
        let left = if x > 0 { Some(at - 1) } else { (turn > 0).then(|| at + turn - 1) };
        let right = if x + 1 < width { Some(at + 1) } else { (turn > 0).then(|| at + 1 - turn) };
        let above = at.checked_sub(width);
        let below = Some(at + width).filter(|&below| below < labels.len());
        [left, right, above, below].into_iter().flatten().any(differs)
    };
    // A square dilation: along rows, then along columns.
    let mut wide = vec![false; labels.len()];
    wide.par_chunks_exact_mut(width).enumerate().for_each(|(y, wide)| {
        for x in (0..width).filter(|x| is_edge(y * width + x)) {
            wide[x.saturating_sub(reach)..(x + reach + 1).min(width)].fill(true);
            if turn > 0 && (x < reach || x + reach >= width) {
                (x + turn - reach.min(turn)..=x + turn + reach).for_each(|x| wide[x % turn] = true);
            }
        }
    });
    let mut band = vec![false; labels.len()];
    band.par_chunks_exact_mut(width).enumerate().for_each(|(y, band)| {
        for v in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            band.iter_mut().zip(&wide[v * width..]).for_each(|(band, &wide)| *band |= wide);
        }
    });
    band
}

/// A part of a canvas with the four neighbors of each of its pixels; `turn` as for [`band`].
fn with_neighbors(part: &[bool], [width, height]: [usize; 2], turn: usize) -> Vec<bool> {
    let mut wider = part.to_vec();
    for at in (0..part.len()).filter(|&at| part[at]) {
        let (x, y) = (at % width, at / width);
        let left = if x > 0 { Some(at - 1) } else { (turn > 0).then(|| at + turn - 1) };
        let right = if x + 1 < width { Some(at + 1) } else { (turn > 0).then(|| at + 1 - turn) };
        let below = (y + 1 < height).then(|| at + width);
        for beside in [left, right, at.checked_sub(width), below].into_iter().flatten() {
            wider[beside] = true;
        }
    }
    wider
}

/// A map of a canvas of half the size, every pixel four times.
fn doubled<T: Copy + Send + Sync>(map: &[T], [coarse_width, _]: [usize; 2], [width, height]: [usize; 2]) -> Vec<T> {
    (0..width * height).into_par_iter().map(|at| map[(at / width / 2) * coarse_width + at % width / 2]).collect()
}

#[cfg(test)]
mod tests;
