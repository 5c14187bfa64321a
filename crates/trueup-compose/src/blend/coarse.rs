//! The coarse levels: every photograph at an eighth of the canvas (less, if it is huge), blended as a whole.

use rayon::prelude::*;
use trueup_core::Result;

use super::levels::WholeLevels;
use super::shown::ShownWhere;
use super::things::{Beside, ShownAlone, take_out};
use crate::label::{Label, NOBODY};
use crate::pyramid::{
    LEAST_SHARE, LEAST_WEIGHT, NEXT_TO_NOTHING, PyramidPlane, add_base, add_detail, collapse, level_shares,
};
use crate::small_views::{CoarseLevel, CoarseLevels};

/// Points along each axis of a sample at which labels are asked for.
const LABELS_PER_SAMPLE: usize = 4;

/// What the coarse levels are blended from.
pub(super) struct CoarseBlend<'a> {
    /// The photographs' own levels, for each placement.
    pub(super) own: &'a CoarseLevels,
    pub(super) shown: ShownWhere<'a>,
    pub(super) levels: WholeLevels,
    /// Photographs whose levels are in memory at once.
    pub(super) at_a_time: usize,
}

impl CoarseBlend<'_> {
    /// The blended level `first_level` of a canvas, from the photographs' own, with the levels above it.
    ///
    /// What is blended is how each photograph differs from the level cut along the seams, which is added back: with
    /// masks that add up to 1 that is the same. But beside its border a photograph's coarser samples are means of one
    /// side only. Those of the photograph itself say that a bright sky beyond the border is as dark as the building
    /// before it, and the sky becomes gray; those of a difference say that it goes on as it is. What differs because
    /// one photograph shows a thing that another does not is no light ([`take_out`]).
    pub(super) fn blend(&self) -> Result<PyramidPlane<[f32; 4]>> {
        let Cut { level: cut, masks, shown } = self.cut()?;
        let change = self.blended_differences(&cut, &masks, &shown)?;
        let mut blended = cut;
        for (blended, change) in blended.texels.iter_mut().zip(&change.texels) {
            let [r, g, b, _] = *change;
            *blended = [blended[0] + r, blended[1] + g, blended[2] + b, blended[3]];
        }
        Ok(blended)
    }

    /// Zeros at so many levels above the first.
    fn zeros(&self, above: u32) -> PyramidPlane<[f32; 4]> {
        let samples = |length: usize| length.div_ceil(1 << (self.levels.first_level + above));
        let [width, height] = self.shown.unrolled.canvas().map(samples);
        PyramidPlane::new(0..width, 0..height)
    }

    /// Cuts the first level along the seams.
    fn cut(&self) -> Result<Cut> {
        let mut cut = self.zeros(0);
        let mut masks = Vec::with_capacity(self.own.len());
        let mut shown = ShownAlone::new([cut.columns.len(), cut.rows.len()]);
        let masked = |placement: usize| {
            let level = self.own.read(placement)?;
            let mask = self.mask(&level, placement);
            Ok((level, mask))
        };
        in_order(self.own.len(), self.at_a_time, masked, |(level, mask): (_, CountedMask)| {
            let over = mask.over(&level.plane);
            add_base(&mut cut, &level.plane, &over);
            shown.set(masks.len() as Label, &over);
            masks.push(mask);
        })?;
        collapse(&mut cut, None);
        Ok(Cut { level: cut, masks, shown })
    }

    /// How the photographs differ from the level that is `cut`, blended.
    fn blended_differences(
        &self,
        cut: &PyramidPlane<[f32; 4]>,
        masks: &[CountedMask],
        shown: &ShownAlone,
    ) -> Result<PyramidPlane<[f32; 4]>> {
        let mut sums: Vec<PyramidPlane<[f32; 4]>> = (0..=self.levels.above).map(|level| self.zeros(level)).collect();
        let differences = |placement: usize| {
            let mut level = self.own.read(placement)?.into_owned();
            let mask = masks[placement].over(&level.plane);
            subtract(&mut level.plane, cut);
            // Light is averaged over twice the widest transition.
            take_out(&mut level.plane, &Beside { cut, shown, mask: &mask, levels: self.levels.above + 1 });
            Ok(pyramid(level, mask, self.levels.above))
        };
        in_order(self.own.len(), self.at_a_time, differences, |pyramid: WeightedLevels| {
            sums.par_iter_mut().enumerate().for_each(|(level, sum)| {
                let (own, weights) = &pyramid[level];
                match pyramid.get(level + 1) {
                    Some((coarser, _)) => {
                        let mut coarser = coarser.clone();
                        level_shares(&mut coarser);
                        add_detail(sum, own, &coarser, weights, LEAST_WEIGHT);
                    }
                    None => add_base(sum, own, weights),
                }
            });
        })?;
        let mut blended: Option<PyramidPlane<[f32; 4]>> = None;
        while let Some(mut sum) = sums.pop() {
            collapse(&mut sum, blended.as_ref());
            blended = Some(sum);
        }
        Ok(blended.unwrap_or_default())
    }

    /// How much of every sample's surroundings shows the photograph of a placement.
    fn mask(&self, level: &CoarseLevel, placement: usize) -> CountedMask {
        let label = self.shown.label(placement as Label);
        let PyramidPlane { columns, rows, .. } = &level.plane;
        let mut points = vec![0_u8; columns.len() * rows.len()];
        if label == NOBODY {
            return CountedMask { points };
        }
        let step = (1 << self.levels.first_level) / LABELS_PER_SAMPLE;
        let down = self.shown.unrolled.canvas()[1].div_ceil(step);
        let (mut labels, mut padded) = (Vec::new(), Vec::new());
        // The sample's own place is its middle: half of the points lie before it.
        let before = LABELS_PER_SAMPLE / 2;
        for (y, row) in rows.clone().zip(points.chunks_exact_mut(columns.len().max(1))) {
            for v in y * LABELS_PER_SAMPLE..(y + 1) * LABELS_PER_SAMPLE {
                let v = v.saturating_sub(before).min(down - 1);
                let across = columns.start * LABELS_PER_SAMPLE..columns.end * LABELS_PER_SAMPLE;
                let shifted = across.start.saturating_sub(before)..across.end;
                let lead = shifted.start + before - across.start;
                self.shown.labels(v, &shifted, step, &mut labels);
                let Some(first) = labels.first() else { continue };
                padded.clear();
                padded.resize(lead, *first);
                padded.extend_from_slice(&labels);
                for (points, labels) in row.iter_mut().zip(padded.as_chunks::<LABELS_PER_SAMPLE>().0) {
                    *points += labels.iter().map(|&shown| u8::from(shown == label)).sum::<u8>();
                }
            }
        }
        CountedMask { points }
    }
}

/// A level cut along the seams.
struct Cut {
    level: PyramidPlane<[f32; 4]>,
    /// Every placement's.
    masks: Vec<CountedMask>,
    shown: ShownAlone,
}

/// Where a placement of a photograph is shown: of the points of every sample of its level how many.
struct CountedMask {
    points: Vec<u8>,
}

impl CountedMask {
    /// The same as shares, for the samples of a `level`.
    fn over(&self, level: &PyramidPlane<[f32; 4]>) -> PyramidPlane<f32> {
        const SHARE: f32 = 1.0 / (LABELS_PER_SAMPLE * LABELS_PER_SAMPLE) as f32;
        let texels = self.points.iter().map(|&points| f32::from(points) * SHARE).collect();
        PyramidPlane { columns: level.columns.clone(), rows: level.rows.clone(), texels }
    }
}

/// Makes something of each of `count` photographs, so many `at_a_time`, and uses them in order.
fn in_order<T: Send>(
    count: usize,
    at_a_time: usize,
    make: impl Fn(usize) -> Result<T> + Sync,
    mut take: impl FnMut(T),
) -> Result<()> {
    let at_a_time = at_a_time.max(1);
    for first in (0..count).step_by(at_a_time) {
        let made: Vec<T> = (first..(first + at_a_time).min(count)).into_par_iter().map(&make).collect::<Result<_>>()?;
        made.into_iter().for_each(&mut take);
    }
    Ok(())
}

/// Takes the blended level from a photograph's, wherever that covers anything. Beside its border the difference soon
/// counts next to nothing, by the fourth power of the share: there the photograph's own samples are means of one side
/// already.
fn subtract(plane: &mut PyramidPlane<[f32; 4]>, blended: &PyramidPlane<[f32; 4]>) {
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
type WeightedLevels = Vec<(PyramidPlane<[f32; 4]>, PyramidPlane<f32>)>;

/// Weights are the masks of the next coarser level, but for the widest band: how wide that changes is what was asked
/// for.
fn pyramid(level: CoarseLevel, mask: PyramidPlane<f32>, levels: u32) -> WeightedLevels {
    let mut pyramid = Vec::new();
    let (mut plane, mut mask) = (level.plane, mask);
    for _ in 0..levels {
        let (coarser_plane, coarser_mask) = (plane.reduced(), mask.reduced());
        let weights = coarser_mask.expanded(&plane.columns, &plane.rows);
        pyramid.push((plane, weights));
        (plane, mask) = (coarser_plane, coarser_mask);
    }
    pyramid.push((plane, mask));
    pyramid
}
