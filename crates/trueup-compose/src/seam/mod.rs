//! Which photograph the panorama shows where: seams along which the photographs agree.
//!
//! Every canvas pixel is given to one photograph, so that nothing is shown twice. The seams between them run where the
//! photographs look alike, stay away from the borders of the photographs, and do not cut things that moved. They are
//! found on a small canvas by graph cuts and followed down to finer ones in a narrow band.

mod band;
mod energy;
mod expansion;
mod labels;
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
use band::Band;
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
/// [`Error::Options`]; [`Error::Input`] if there are too many views or one does not fit the canvas;
/// [`Error::Cancelled`].
///
/// # Source
/// Kwatra, Schoedl, Essa, Turk, Bobick, "Graphcut textures: image and video synthesis using graph cuts", SIGGRAPH 2003;
/// Agarwala and others, "Interactive digital photomontage", SIGGRAPH 2004.
///
/// # Departures
/// Coarse to fine as Lombaert, Sun, Grady, Xu, "A multilevel banded graph cuts method for fast image segmentation",
/// ICCV 2005; things that moved are found first, and their parts kept together; differences of shading count, the lack
/// of detail, and steps that there is no room to blend, too.
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
    let everywhere = Band::whole([energy.width, energy.height], energy.turn);
    energy.prepare_differences(&everywhere);
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
                &everywhere,
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
    let width = energy.width;
    labels.par_chunks_exact_mut(width).enumerate().for_each(|(y, labels)| {
        let mut first = 0;
        while first < width {
            let label = labels[first];
            let end = first + labels[first..].iter().take_while(|&&other| other == label).count();
            let mut change = |x: usize| labels[x] = deepest_at(energy, [x, y]);
            match label {
                NOBODY => (first..end).for_each(change),
                _ => energy.each_not_allowed(usize::from(label), first..end, y, &mut change),
            }
            first = end;
        }
    });
    let band = Band::around_changes(&labels, width, energy.turn, BAND_PX);
    // Costs are asked for within the band, and from there across its border.
    energy.prepare_differences(&band.with_neighbors());
    let energy = &*energy;
    let mut boxes = vec![[usize::MAX, usize::MAX, 0, 0]; energy.views.len()];
    for [x, y] in band.pixels() {
        let label = labels[y * width + x];
        if label != NOBODY {
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
        expansions.expand(energy, &mut labels, label, Window { columns: &columns, rows: &rows }, &band);
    }
    Ok(labels)
}

/// A map of a canvas of half the size, every pixel four times.
fn doubled<T: Copy + Default + Send + Sync>(map: &[T], [coarse_width, _]: [usize; 2], size: [usize; 2]) -> Vec<T> {
    let [width, height] = size;
    let mut fine = vec![T::default(); width * height];
    fine.par_chunks_exact_mut(width.max(1)).enumerate().for_each(|(y, fine)| {
        let coarse = &map[y / 2 * coarse_width..][..coarse_width];
        for (pair, &value) in fine.chunks_mut(2).zip(coarse) {
            pair.fill(value);
        }
    });
    fine
}

#[cfg(test)]
mod tests;
