//! The first pass: small pictures of all photographs.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::mask::{Mask, Masks};
use trueup_core::mesh::GridMesh;
use trueup_core::options::StageOptions;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use super::bases::{Base, Bases};
use super::coarse::{self, SAMPLED_BELOW};
use super::pyramid::Plane;
use super::unrolled::Unrolled;
use crate::exposure::Correction;
use crate::layout::{Placed, TURNS, columns_around};
use crate::render::plan::Plan;
use crate::render::prepared::{Prepared, Scratch, Window, check_photograph};
use crate::render::{Interpolation, RenderOptions};
use crate::seam::{CLIPPED, IGNORED, KEPT, PARTLY, SeamOptions, View, ViewPixel, WHOLLY, small_size};
use crate::unwanted::{Covered, Unwanted, in_mask};
use crate::weights::WHOLE;

/// What the first pass makes.
pub(super) struct Small {
    /// For the seams; empty boxes for a single photograph.
    pub(super) views: Vec<View>,
    /// Size of their canvas.
    pub(super) size: [usize; 2],
    /// For the coarse levels; empty boxes without.
    pub(super) bases: Bases,
    /// Decoded photographs, as far as there is room for them.
    pub(super) kept: Vec<Option<Photograph>>,
    /// Bytes of each photograph.
    pub(super) bytes: Vec<usize>,
}

/// Level of the camera's own values (0 to 255) from which on a channel counts as saturated.
const SATURATED: f32 = 252.0;

/// Reads every photograph once; `first_level` is that of the coarse levels, if there are to be any.
pub(super) fn make(
    unrolled: &Unrolled<'_>,
    corrections: &[Correction],
    photographs: &dyn PhotographSource,
    (options, seam_options): (&RenderOptions, &SeamOptions),
    (first_level, plan): (Option<u32>, &Plan),
    context: &StageContext,
) -> Result<Small> {
    let layout = unrolled.original_layout();
    let canvas = [layout.width, layout.height];
    let curve = photographs.transfer_curve();
    let size = small_size(canvas, layout.period.is_some(), seam_options);
    let period = layout.period.map(|_| size[0]);
    let clip = [size[0] * if period.is_some() { TURNS } else { 1 }, size[1]];
    let bases = Bases::new(plan.bases.clone());
    let mut small = Small { views: Vec::new(), size, bases, kept: Vec::new(), bytes: Vec::new() };
    // Halved as often as can be, then read between samples: nothing here is ever looked at.
    let halving =
        RenderOptions { interpolation: Interpolation::Bilinear, minification_threshold: 1.0, ..options.clone() };
    let sampling = RenderOptions { minification_threshold: 4.0, ..halving.clone() };
    let covered = Covered::find(unrolled.layout(), photographs, small_size(unrolled.canvas(), false, seam_options));
    let covered = covered.map(Arc::new);
    let mut room = plan.photographs;
    let at_a_time = plan.at_a_time;
    for (chunk, (placed, corrections)) in layout.placed.chunks(at_a_time).zip(corrections.chunks(at_a_time)).enumerate()
    {
        context.check_cancelled()?;
        let made: Vec<(View, Vec<Base>, Photograph)> = placed
            .par_iter()
            .zip(corrections)
            .enumerate()
            .map(|(index, (placed, correction))| {
                let photograph = photographs.photograph(placed.photograph)?;
                check_photograph(placed, &photograph)?;
                // The larger picture first: the smaller is made from what is left of the photograph then.
                let first = placed.in_first_turn(layout.period);
                let mesh = scaled(&first.mesh, [0, 1].map(|axis| size[axis] as f64 / canvas[axis] as f64), 0.0);
                let prepared = Prepared::new(Cow::Borrowed(&photograph), &mesh, clip, (&curve, correction), &halving);
                let masks = photographs.masks(placed.photograph);
                let view = match layout.placed.len() {
                    1 => View::default(),
                    _ => view(&prepared, &masks, period, &sampling),
                };
                let placements = unrolled.placements(chunk * at_a_time + index);
                let base = |placement: usize| match first_level {
                    Some(level) => {
                        let (placed, canvas) = (&unrolled.placed()[placement], unrolled.canvas());
                        let (light, unwanted) = ((&curve, correction), (&masks, covered.as_ref()));
                        base(&prepared, placed, light, (canvas, level), unwanted, [&halving, &sampling])
                    }
                    None => Base::default(),
                };
                let bases = placements.map(base).collect();
                context.progress().advance(RenderOptions::STAGE, 1);
                Ok((view, bases, photograph))
            })
            .collect::<Result<_>>()?;
        for (view, bases, photograph) in made {
            small.views.push(view);
            bases.into_iter().try_for_each(|base| small.bases.push(base))?;
            let bytes = photograph.bytes();
            let fits = bytes <= room;
            room -= if fits { bytes } else { 0 };
            small.bytes.push(bytes);
            small.kept.push(fits.then_some(photograph));
        }
    }
    Ok(small)
}

/// The grid with its targets scaled by `scale` and then moved by `shift`.
fn scaled(mesh: &GridMesh, scale: [f64; 2], shift: f64) -> GridMesh {
    let mut mesh = mesh.clone();
    for vertex in &mut mesh.target {
        *vertex = [vertex[0] * scale[0] + shift, vertex[1] * scale[1] + shift];
    }
    mesh
}

/// `period` is the width of the small canvas if it is a cylinder.
fn view(prepared: &Prepared<'_>, masks: &Masks, period: Option<usize>, options: &RenderOptions) -> View {
    let (all, rows) = (prepared.columns(), prepared.rows());
    let columns = all.start..all.end.min(all.start + period.unwrap_or(all.len()));
    let mut samples = vec![[0.0; 4]; columns.len() * rows.len()];
    let mut clipped = vec![false; samples.len()];
    let window = Window { columns: &columns, rows: &rows };
    prepared.sample_with(window, &mut samples, options, &mut Scratch::default(), |first, raw| {
        for (clipped, sample) in clipped[first..].iter_mut().zip(raw) {
            *clipped = sample[..3].iter().any(|&level| level >= SATURATED);
        }
    });
    let mut pixels: Vec<ViewPixel> = samples
        .iter()
        .zip(clipped)
        .map(|(&[r, g, b, share], clipped)| {
            // The casts saturate.
            let level = |root: f32| (root * 255.0 + 0.5) as u8;
            let flags = (u8::from(share > 0.0) * PARTLY)
                | (u8::from(share >= WHOLE) * WHOLLY)
                | (u8::from(clipped && share > 0.0) * CLIPPED);
            [level(r), level(g), level(b), flags]
        })
        .collect();
    mark(&mut pixels, (&columns, &rows), prepared, masks);
    let (columns, turned) = columns_around(columns, period);
    if turned > 0 {
        pixels.chunks_exact_mut(columns.len()).for_each(|row| row.rotate_right(turned));
    }
    View { columns, rows, pixels }
}

/// Adds what the photographer marked to the pixels of so many columns and rows.
fn mark(
    pixels: &mut [ViewPixel],
    (columns, rows): (&Range<usize>, &Range<usize>),
    prepared: &Prepared<'_>,
    masks: &Masks,
) {
    if masks.ignored.is_none() && masks.kept.is_none() {
        return;
    }
    let size = prepared.grid().size;
    prepared.grid().each_place(columns, rows, |[x, y], place, footprint| {
        let flags = &mut pixels[(y - rows.start) * columns.len() + x - columns.start][3];
        if *flags & PARTLY == 0 {
            return;
        }
        let ignored = |mask: &Arc<Mask>| mask.any_within(in_mask(mask, place, size), in_mask(mask, footprint, size));
        let kept = |mask: &Arc<Mask>| mask.contains(in_mask(mask, place, size));
        *flags |= u8::from(masks.ignored.as_ref().is_some_and(ignored)) * IGNORED;
        *flags |= u8::from(masks.kept.as_ref().is_some_and(kept)) * KEPT;
    });
}

/// The coarse level of a photograph.
fn base(
    larger: &Prepared<'_>,
    placed: &Placed,
    light: (&TransferCurve, &Correction),
    (canvas, first_level): ([usize; 2], u32),
    (masks, covered): (&Masks, Option<&Arc<Covered>>),
    [halving, sampling]: [&RenderOptions; 2],
) -> Base {
    let level = first_level - SAMPLED_BELOW;
    let step = f64::from(1_u32 << level);
    // Sample i lies on the middle of pixel i * step.
    let mesh = scaled(&placed.mesh, [step.recip(); 2], 0.5 - 0.5 / step);
    let (photograph, [width, height]) = larger.photograph();
    let mesh = GridMesh { width, height, ..mesh };
    let size = canvas.map(|length| length.div_ceil(1 << level));
    let prepared = Prepared::new(Cow::Borrowed(photograph), &mesh, size, light, halving)
        .without(Unwanted::new(masks, covered, size));
    // Room for the interpolated rim, from a sample that every coarser level has.
    let grown = |range: Range<usize>, length: usize| {
        (range.start / RIM * RIM).saturating_sub(RIM)..(range.end + RIM).min(length)
    };
    let (columns, rows) = (grown(prepared.columns(), size[0]), grown(prepared.rows(), size[1]));
    let mut plane = Plane::new(columns.clone(), rows.clone());
    let window = Window { columns: &columns, rows: &rows };
    prepared.sample(window, &mut plane.texels, sampling, &mut Scratch::default());
    for texel in &mut plane.texels {
        let [r, g, b, share] = *texel;
        *texel = [r * share, g * share, b * share, share];
    }
    Base { plane: coarse::base(plane) }
}

/// Samples around a photograph that its coarser levels reach.
pub(super) const RIM: usize = 8;
