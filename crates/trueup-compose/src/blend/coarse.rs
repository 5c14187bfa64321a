//! The coarse levels: every photograph at an eighth of the canvas (less, if it is huge), blended as a whole.

use rayon::prelude::*;
use trueup_core::Result;

use super::bases::{Base, Bases};
use super::pyramid::{LEAST_SHARE, Plane, add_base, add_detail, collapse};
use super::unrolled::Unrolled;
use crate::seam::{Label, NOBODY, Seams};

/// Log2 of the canvas pixels per sample of the finest level that is blended as a whole, on a canvas of this size; at least
/// [`LEAST_FIRST_LEVEL`]. It follows from the canvas alone, so that the memory there is does not show in the panorama.
pub(crate) fn first_level([width, height]: [usize; 2]) -> u32 {
    let samples = |level: u32| width.div_ceil(1 << level).saturating_mul(height.div_ceil(1 << level));
    (LEAST_FIRST_LEVEL..).find(|&level| samples(level) <= MOST_SAMPLES).unwrap_or(LEAST_FIRST_LEVEL)
}

/// Log2 of 8 pixels.
pub(super) const LEAST_FIRST_LEVEL: u32 = 3;

/// A level of more samples is not blended as a whole: 64 MB, of a canvas of 256 million pixels at an eighth. Some three such levels are
/// held at once, of which a gigabyte must leave room for photographs.
const MOST_SAMPLES: usize = 4_000_000;

/// Points along each axis of a sample at which labels are asked for.
const LABELS_PER_SAMPLE: usize = 4;

/// The blended level `first_level` of a canvas, from the photographs' own. `levels` more are blended above it.
///
/// What is blended is how each photograph differs from the level cut along the seams, which is added back: with masks that
/// add up to 1 that is the same. But beside its border a photograph's coarser samples are means of one side only. Those of
/// the photograph itself say that a bright sky beyond the border is as dark as the building before it, and the sky becomes
/// gray; those of a difference say that it goes on as it is.
pub(super) fn blend(
    bases: &Bases,
    seams: &Seams,
    unrolled: &Unrolled<'_>,
    (first_level, levels): (u32, u32),
) -> Result<Plane<[f32; 4]>> {
    let sums = |level: u32| {
        let [width, height] = unrolled.canvas().map(|length| length.div_ceil(1 << (first_level + level)));
        Plane::new(0..width, 0..height)
    };
    let mask = |base: &Base, label: usize| mask(base, label, seams, (unrolled, first_level));
    let mut cut = sums(0);
    let masked = |label: usize| {
        let base = bases.read(label)?;
        let mask = mask(&base, label);
        Ok((base, mask))
    };
    in_order(bases.len(), masked, |(base, mask)| add_base(&mut cut, &base.plane, &mask))?;
    collapse(&mut cut, None);

    let mut blended: Vec<Plane<[f32; 4]>> = (0..=levels).map(sums).collect();
    let differences = |label: usize| {
        let mut base = bases.read(label)?.into_owned();
        let mask = mask(&base, label);
        subtract(&mut base.plane, &cut);
        Ok(pyramid(base, mask, levels))
    };
    in_order(bases.len(), differences, |pyramid: Levels| {
        blended.par_iter_mut().enumerate().for_each(|(level, sum)| {
            let (own, weights) = &pyramid[level];
            match pyramid.get(level + 1) {
                Some((coarser, _)) => add_detail(sum, own, coarser, weights),
                None => add_base(sum, own, weights),
            }
        });
    })?;
    let mut coarser: Option<Plane<[f32; 4]>> = None;
    while let Some(mut sum) = blended.pop() {
        collapse(&mut sum, coarser.as_ref());
        coarser = Some(sum);
    }
    for (cut, change) in cut.texels.iter_mut().zip(coarser.iter().flat_map(|plane| &plane.texels)) {
        let [r, g, b, _] = *change;
        *cut = [cut[0] + r, cut[1] + g, cut[2] + b, cut[3]];
    }
    Ok(cut)
}

/// Makes something of each of `count` photographs, as many at a time as there are threads, and uses them in order.
fn in_order<T: Send>(count: usize, make: impl Fn(usize) -> Result<T> + Sync, mut take: impl FnMut(T)) -> Result<()> {
    let at_a_time = rayon::current_num_threads().max(1);
    for first in (0..count).step_by(at_a_time) {
        let made: Vec<T> = (first..(first + at_a_time).min(count)).into_par_iter().map(&make).collect::<Result<_>>()?;
        made.into_iter().for_each(&mut take);
    }
    Ok(())
}

/// Takes the blended level from a photograph's, wherever that covers anything. Beside its border the difference soon counts
/// next to nothing, by the fourth power of the share: there the photograph's own samples are means of one side already.
fn subtract(plane: &mut Plane<[f32; 4]>, blended: &Plane<[f32; 4]>) {
    let columns = plane.columns.clone();
    for y in plane.rows.clone() {
        for (texel, blended) in plane.row_mut(y).iter_mut().zip(&blended.row(y)[columns.clone()]) {
            let [r, g, b, share] = *texel;
            let trusted = (share * share * (share * share)).max(share.min(NEXT_TO_NOTHING));
            let trust = trusted / share.max(LEAST_SHARE);
            let difference = [r - blended[0] * share, g - blended[1] * share, b - blended[2] * share, share];
            *texel = difference.map(|value| value * trust);
        }
    }
}

/// A photograph's samples and their weights, from fine to coarse.
type Levels = Vec<(Plane<[f32; 4]>, Plane<f32>)>;

/// Weights are the masks of the next coarser level, but for the widest band: how wide that changes is what was asked for.
fn pyramid(base: Base, mask: Plane<f32>, levels: u32) -> Levels {
    let mut pyramid = Vec::new();
    let (mut plane, mut mask) = (base.plane, mask);
    for _ in 0..levels {
        let (coarser_plane, coarser_mask) = (plane.reduced(), mask.reduced());
        let weights = coarser_mask.expanded(&plane.columns, &plane.rows);
        pyramid.push((plane, weights));
        (plane, mask) = (coarser_plane, coarser_mask);
    }
    pyramid.push((plane, mask));
    pyramid
}

/// The share of every sample's surroundings that shows the photograph of a placement.
fn mask(base: &Base, placement: usize, seams: &Seams, (unrolled, first_level): (&Unrolled<'_>, u32)) -> Plane<f32> {
    let label = unrolled.label(placement as Label);
    let mut mask: Plane<f32> = Plane::new(base.plane.columns.clone(), base.plane.rows.clone());
    let step = (1 << first_level) / LABELS_PER_SAMPLE;
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

/// Photographs are sampled for the coarse levels at the level so far below [`first_level`].
pub(super) const SAMPLED_BELOW: u32 = 1;

/// The level [`first_level`] of a photograph from its samples [`SAMPLED_BELOW`] it: what of it is coarser than two samples.
///
/// Photographs are read at different places between their own samples; what they say of the finest contours there differs
/// although they agree. The band that is left out here is blended with the fine levels.
pub(super) fn base(sampled: Plane<[f32; 4]>) -> Plane<[f32; 4]> {
    let mut level = sampled;
    for _ in 0..SAMPLED_BELOW {
        level = level.reduced();
    }
    let mut base = level.reduced().expanded(&level.columns, &level.rows);
    spread(&mut base);
    base
}

/// Share of samples that are there only so that others have something to be compared with.
const NEXT_TO_NOTHING: f32 = 1e-3;

/// Gives samples beside covered ones their neighbors' color with next to no share, so that finer samples between the two
/// always have something to be compared with.
fn spread(plane: &mut Plane<[f32; 4]>) {
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
