//! The coarse levels: every photograph at an eighth of the canvas, blended as a whole.

use rayon::prelude::*;

use super::Base;
use super::pyramid::{LEAST_SHARE, Plane, add_base, add_detail, collapse};
use super::unrolled::Unrolled;
use crate::seam::{Label, NOBODY, Seams};

/// Log2 of the canvas pixels per sample of the finest level that is blended as a whole.
pub(super) const FIRST_LEVEL: u32 = 3;

/// Points along each axis of a sample at which labels are asked for.
const LABELS_PER_SAMPLE: usize = 4;

/// The blended level [`FIRST_LEVEL`] of a canvas, from the photographs' own. `levels` more are blended above it.
pub(super) fn blend(bases: &[Base], seams: &Seams, unrolled: &Unrolled<'_>, levels: u32) -> Plane<[f32; 4]> {
    let size = |level: u32| unrolled.canvas().map(|length| length.div_ceil(1 << (FIRST_LEVEL + level)));
    let mut sums: Vec<Plane<[f32; 4]>> = (0..=levels)
        .map(|level| {
            let [width, height] = size(level);
            Plane::new(0..width, 0..height)
        })
        .collect();
    // As many pyramids at a time as there are threads, added up in order.
    for (group, bases) in bases.chunks(rayon::current_num_threads().max(1)).enumerate() {
        let first = group * rayon::current_num_threads().max(1);
        let pyramids: Vec<_> = bases
            .par_iter()
            .enumerate()
            .map(|(index, base)| pyramid(base, mask(base, first + index, seams, unrolled), levels))
            .collect();
        for pyramid in pyramids {
            sums.par_iter_mut().enumerate().for_each(|(level, sum)| {
                let (own, mask) = &pyramid[level];
                match pyramid.get(level + 1) {
                    Some((coarser, _)) => add_detail(sum, own, coarser, mask),
                    None => add_base(sum, own, mask),
                }
            });
        }
    }
    let mut blended: Option<Plane<[f32; 4]>> = None;
    while let Some(mut sum) = sums.pop() {
        collapse(&mut sum, blended.as_ref());
        blended = Some(sum);
    }
    blended.unwrap_or_default()
}

type Levels = Vec<(Plane<[f32; 4]>, Plane<f32>)>;

fn pyramid(base: &Base, mask: Plane<f32>, levels: u32) -> Levels {
    let mut pyramid = vec![(base.plane.clone(), mask)];
    for _ in 0..levels {
        if let Some((plane, mask)) = pyramid.last() {
            pyramid.push((plane.reduced(), mask.reduced()));
        }
    }
    pyramid
}

/// The share of every sample's surroundings that shows the photograph of a placement.
fn mask(base: &Base, placement: usize, seams: &Seams, unrolled: &Unrolled<'_>) -> Plane<f32> {
    let label = unrolled.label(placement as Label);
    let mut mask: Plane<f32> = Plane::new(base.plane.columns.clone(), base.plane.rows.clone());
    let step = (1 << FIRST_LEVEL) / LABELS_PER_SAMPLE;
    let down = unrolled.canvas()[1].div_ceil(step);
    let share = 1.0 / (LABELS_PER_SAMPLE * LABELS_PER_SAMPLE) as f32;
    let mut labels = Vec::new();
    // The sample's own place is its middle: half of the points lie before it.
    let before = LABELS_PER_SAMPLE / 2;
    for y in base.plane.rows.clone() {
        let columns = mask.columns.clone();
        let row = mask.row_mut(y);
        for v in y * LABELS_PER_SAMPLE..(y + 1) * LABELS_PER_SAMPLE {
            let v = v.saturating_sub(before).min(down - 1);
            let across = columns.start * LABELS_PER_SAMPLE..columns.end * LABELS_PER_SAMPLE;
            let shifted = across.start.saturating_sub(before)..across.end;
            let lead = shifted.start + before - across.start;
            unrolled.labels(seams, (v, &shifted), step, &mut labels);
            for (x, weight) in row.iter_mut().enumerate() {
                for point in 0..LABELS_PER_SAMPLE {
                    let at = (x * LABELS_PER_SAMPLE + point).saturating_sub(lead);
                    let shown = labels[at.min(labels.len() - 1)];
                    if shown != NOBODY && shown == label {
                        *weight += share;
                    }
                }
            }
        }
    }
    mask
}

/// Log2 of the canvas pixels per sample at which photographs are sampled for the coarse levels.
pub(super) const SAMPLED_LEVEL: u32 = 2;

/// The level [`FIRST_LEVEL`] of a photograph from its samples at [`SAMPLED_LEVEL`]: what of it is coarser than two samples.
///
/// Photographs are read at different places between their own samples; what they say of the finest contours there differs
/// although they agree. The band that is left out here is blended with the fine levels.
pub(super) fn base(sampled: Plane<[f32; 4]>) -> Plane<[f32; 4]> {
    let mut level = sampled;
    for _ in SAMPLED_LEVEL..FIRST_LEVEL {
        level = level.reduced();
    }
    let mut base = level.reduced().expanded(&level.columns, &level.rows);
    spread(&mut base);
    base
}

/// Gives samples beside covered ones their neighbours' colour with next to no share, so that finer samples between the two
/// always have something to be compared with.
fn spread(plane: &mut Plane<[f32; 4]>) {
    const NEXT_TO_NOTHING: f32 = 1e-3;
    let (width, height) = (plane.columns.len(), plane.rows.len());
    let old = plane.texels.clone();
    for (at, texel) in plane.texels.iter_mut().enumerate() {
        if old[at][3] > LEAST_SHARE {
            continue;
        }
        let (x, y) = (at % width, at / width);
        let mut sum = [0.0_f32; 4];
        for v in y.saturating_sub(1)..(y + 2).min(height) {
            for u in x.saturating_sub(1)..(x + 2).min(width) {
                for (sum, value) in sum.iter_mut().zip(old[v * width + u]) {
                    *sum += value;
                }
            }
        }
        if sum[3] > LEAST_SHARE {
            *texel = sum.map(|value| value / sum[3] * NEXT_TO_NOTHING);
        }
    }
}
