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
mod shading;
mod view;

use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

pub use labels::Seams;
pub use view::{CLIPPED, IGNORED, KEPT, PARTLY, View, ViewPixel, WHOLLY};

use energy::Scene;
use expansion::{Expansions, deepest};
use moving::moving_things;

/// Position of a photograph among those placed.
pub type Label = u16;

/// Label of pixels that no photograph covers.
pub const NOBODY: Label = Label::MAX;

trueup_core::options! {
    /// Where one photograph ends and the next begins.
    pub struct SeamOptions("seam") {
        /// Pixels of the canvas on which seams are found first. More sees smaller things, and takes longer.
        coarse_pixels: f64 = 120_000.0, between(1_000.0, 1e8), "px";
        /// Pixels of the canvas down to which seams are followed. More lets them run closer to contours.
        fine_pixels: f64 = 1.5e6, between(1_000.0, 1e9), "px";
        /// Half width of the band in which a seam may move when it is followed to a canvas of twice the size.
        band_px: usize = 3, between(1.0, 64.0), "px";
        /// Rounds over all photographs on the coarse canvas, at most.
        rounds: usize = 2, between(1.0, 100.0), "";
        /// Cost of a seam for its length alone, gray levels of difference. Higher makes seams shorter.
        length: f64 = 2.0, between(0.0, 255.0), "level";
        /// Weight of the difference of gradients beside that of colors. Higher keeps seams from crossing contours that do
        /// not meet.
        gradient_weight: f64 = 1.0, between(0.0, 100.0), "";
        /// Weight of the difference of shading beside that of colors: of how the brightness changes over a few pixels, averaged
        /// along a line. Higher keeps seams from where only a step could join the photographs.
        shading_weight: f64 = 3.0, between(0.0, 100.0), "";
        /// Pixels of the seams' canvas over which shading is averaged to either side; half of it across.
        shading_reach: usize = 4, between(1.0, 64.0), "px";
        /// Cost of showing a photograph at its border instead of in its middle, per pixel of the canvas. Higher moves seams
        /// towards the middle of overlaps.
        depth_weight: f64 = 2.5, between(0.0, 100.0), "level";
        /// Cost of showing a photograph where its highlights are clipped and another one's are not, per pixel.
        clipped_cost: f64 = 1.5, between(0.0, 255.0), "level";
        /// Further cost of a seam through a thing that moved.
        moving_cost: f64 = 60.0, between(0.0, 1000.0), "level";
        /// Difference from which on photographs are taken to show different things.
        moving_high: f64 = 32.0, between(0.0, 255.0), "level";
        /// Difference down to which such a thing extends.
        moving_low: f64 = 14.0, between(0.0, 255.0), "level";
    }
}

/// The size of a canvas of at most `fine_pixels` pixels, and at most half of the canvas along each side. `around` a
/// cylinder it can be halved as often as the search for seams wants to.
pub(crate) fn small_size(canvas: [usize; 2], around: bool, options: &SeamOptions) -> [usize; 2] {
    let pixels = options.fine_pixels;
    let scale = (pixels / (canvas[0] as f64 * canvas[1] as f64)).sqrt().min(0.5);
    let size = canvas.map(|length| ((length as f64 * scale) as usize).max(1));
    let halvings = (pixels / options.coarse_pixels).max(1.0).log2() / 2.0;
    // The cast saturates.
    let unit = 1_usize << (halvings.ceil() as u32).min(size[0].ilog2());
    if around { [size[0] / unit * unit, size[1]] } else { size }
}

/// Finds the seams between `views`, photographs on a canvas of `size` pixels (width, height). `around` says that the canvas
/// is a cylinder, whose first column lies beside its last.
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
/// 2005; things that moved are found first, and their parts kept together; differences of shading count, too.
pub fn run(
    views: Vec<View>,
    size: [usize; 2],
    around: bool,
    options: &SeamOptions,
    context: &StageContext,
) -> Result<Seams> {
    options.check()?;
    check(&views, size, around)?;
    let turn = |[width, _]: [usize; 2]| if around { width } else { 0 };
    let mut levels = vec![(views, size)];
    while let Some((finest, [width, height])) = levels.last() {
        // A cylinder stays one only if all its pixels are halved.
        let halves = !around || width.is_multiple_of(2);
        if (width * height) as f64 <= options.coarse_pixels || finest.len() < 2 || !halves {
            break;
        }
        let half = (finest.iter().map(View::halved).collect(), [width.div_ceil(2), height.div_ceil(2)]);
        levels.push(half);
    }
    let mut expansions = Expansions::default();
    let mut coarser: Option<(Vec<Label>, Vec<u32>, [usize; 2])> = None;
    while let Some((views, size)) = levels.pop() {
        context.check_cancelled()?;
        let moving = match &coarser {
            None => moving_things(&views, size, turn(size), options),
            Some((_, moving, coarse)) => doubled(moving, *coarse, size),
        };
        let scene = Scene::new(&views, size, turn(size), &moving, options);
        let labels = match &coarser {
            None => search(&scene, &mut expansions, options, context)?,
            Some((labels, _, coarse)) => {
                follow(&scene, doubled(labels, *coarse, size), &mut expansions, options, context)?
            }
        };
        drop(scene);
        if levels.is_empty() {
            return Ok(Seams::new(labels, views, size, turn(size)));
        }
        coarser = Some((labels, moving, size));
    }
    Err(Error::input("seams", "there is no canvas to find them on", "Give a canvas of at least one pixel."))
}

fn check(views: &[View], [width, height]: [usize; 2], around: bool) -> Result<()> {
    let fits = |view: &View| {
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
fn search(
    scene: &Scene<'_>,
    expansions: &mut Expansions,
    options: &SeamOptions,
    context: &StageContext,
) -> Result<Vec<Label>> {
    let mut labels = deepest(scene);
    // A photograph whose surroundings stayed as it left them would take nothing.
    let mut last_change = vec![1_usize; scene.views.len()];
    let mut last_try = vec![0_usize; scene.views.len()];
    let mut clock = 1;
    for _ in 0..options.rounds {
        for (label, view) in scene.views.iter().enumerate() {
            context.check_cancelled()?;
            if last_try[label] >= last_change[label] {
                continue;
            }
            clock += 1;
            last_try[label] = clock;
            if expansions.expand(scene, &mut labels, label, (&view.columns, &view.rows), &|_| true) {
                for (other, neighbor) in scene.views.iter().enumerate() {
                    if other != label && view.meets(neighbor, scene.turn) {
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
    scene: &Scene<'_>,
    mut labels: Vec<Label>,
    expansions: &mut Expansions,
    options: &SeamOptions,
    context: &StageContext,
) -> Result<Vec<Label>> {
    let (width, height) = (scene.width, scene.height);
    let best = deepest(scene);
    for (at, label) in labels.iter_mut().enumerate() {
        if *label == NOBODY || !scene.allowed(usize::from(*label), at % width, at / width) {
            *label = best[at];
        }
    }
    let band = band(&labels, [width, height], scene.turn, options.band_px);
    let mut boxes = vec![[usize::MAX, usize::MAX, 0, 0]; scene.views.len()];
    for (at, &label) in labels.iter().enumerate() {
        if band[at] && label != NOBODY {
            let (x, y) = (at % width, at / width);
            let x = if scene.views[usize::from(label)].columns.contains(&x) { x } else { x + scene.turn };
            let [left, top, right, bottom] = boxes[usize::from(label)];
            boxes[usize::from(label)] = [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)];
        }
    }
    for (label, (view, [left, top, right, bottom])) in scene.views.iter().zip(boxes).enumerate() {
        context.check_cancelled()?;
        if right == 0 {
            continue;
        }
        let reach = 2 * options.band_px + 1;
        let columns = left.saturating_sub(reach).max(view.columns.start)..(right + reach).min(view.columns.end);
        let rows = top.saturating_sub(reach).max(view.rows.start)..(bottom + reach).min(view.rows.end);
        expansions.expand(scene, &mut labels, label, (&columns, &rows), &|at| band[at]);
    }
    Ok(labels)
}

/// Pixels within `reach` of a change of labels, on a cylinder of `turn` columns or with 0 on a plane.
fn band(labels: &[Label], [width, height]: [usize; 2], turn: usize, reach: usize) -> Vec<bool> {
    let mut edge = vec![false; labels.len()];
    for at in 0..labels.len() {
        if at % width + 1 < width && labels[at] != labels[at + 1] {
            edge[at] = true;
            edge[at + 1] = true;
        }
        if at + width < labels.len() && labels[at] != labels[at + width] {
            edge[at] = true;
            edge[at + width] = true;
        }
        let next_turn = at + 1 - turn.min(at + 1);
        if turn > 0 && at % width + 1 == width && labels[at] != labels[next_turn] {
            edge[at] = true;
            edge[next_turn] = true;
        }
    }
    // A square dilation: along rows, then along columns.
    let mut wide = vec![false; labels.len()];
    for (row, wide) in edge.chunks_exact(width).zip(wide.chunks_exact_mut(width)) {
        for x in (0..width).filter(|&x| row[x]) {
            wide[x.saturating_sub(reach)..(x + reach + 1).min(width)].fill(true);
            if turn > 0 && (x < reach || x + reach >= width) {
                (x + turn - reach.min(turn)..=x + turn + reach).for_each(|x| wide[x % turn] = true);
            }
        }
    }
    let mut band = vec![false; labels.len()];
    for y in 0..height {
        for v in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            for x in 0..width {
                band[y * width + x] |= wide[v * width + x];
            }
        }
    }
    band
}

/// A map of a canvas of half the size, every pixel four times.
fn doubled<T: Copy>(map: &[T], [coarse_width, _]: [usize; 2], [width, height]: [usize; 2]) -> Vec<T> {
    (0..width * height).map(|at| map[(at / width / 2) * coarse_width + at % width / 2]).collect()
}

#[cfg(test)]
mod tests;
