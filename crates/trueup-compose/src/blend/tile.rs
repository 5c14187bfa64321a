//! One tile of the canvas, finished.

use std::borrow::Cow;
use std::ops::Range;

use trueup_core::mask::Mask;

use super::work::BlendWork;
use crate::ignored::in_mask;
use crate::label::{Label, NOBODY};
use crate::layout::Unrolled;
use crate::pyramid::{
    Expansion, LEAST_WEIGHT, PyramidPlane, add_detail, collapse, color, level_shares, mask_margin, tile_margin,
};
use crate::simd::{VectorLoop, with_vector_instructions};
use crate::small_views::CoarseLevel;
use crate::store::RootPixel;
use crate::warped::{RowSink, SamplingMemory, WarpedPhotograph};
use crate::window::{Window, common, widened};

/// A box with so many pixels more on all sides, cut at the canvas.
fn grown([columns, rows]: [&Range<usize>; 2], margin: usize, unrolled: &Unrolled<'_>) -> (Range<usize>, Range<usize>) {
    let [width, height] = unrolled.canvas();
    (widened(columns, margin, width), widened(rows, margin, height))
}

/// What of the canvas is sampled for a tile: the tile, and what its fine levels are made of beside it.
pub(super) fn sampled_window(
    tile: [&Range<usize>; 2],
    first_level: u32,
    unrolled: &Unrolled<'_>,
) -> (Range<usize>, Range<usize>) {
    grown(tile, tile_margin(first_level), unrolled)
}

/// A part of the canvas; `columns` and `rows` start at multiples of 2^first_level.
#[derive(Debug, Clone)]
pub(super) struct BlendTile {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    /// The placements of photographs it is made of.
    pub(super) shown: Vec<Label>,
}

impl BlendTile {
    /// The tile of these columns and rows.
    pub(super) fn new(work: &BlendWork<'_>, columns: Range<usize>, rows: Range<usize>) -> Self {
        let (wide, high) = Self::with_margin(&columns, &rows, work);
        Self { shown: work.shown.shown_in(&wide, &high), columns, rows }
    }

    /// What of the canvas decides which photographs a tile is made of: the tile and as much as its masks reach.
    fn with_margin(columns: &Range<usize>, rows: &Range<usize>, work: &BlendWork<'_>) -> (Range<usize>, Range<usize>) {
        grown([columns, rows], mask_margin(work.first_level), work.shown.unrolled)
    }

    /// The finished pixels, row by row.
    pub(super) fn finish(
        &self,
        work: &BlendWork<'_>,
        photographs: &[Option<WarpedPhotograph<'_>>],
        scratch: &mut SamplingMemory,
    ) -> Vec<RootPixel> {
        let width = self.columns.len();
        let mut pixels = vec![[0; 4]; width * self.rows.len()];
        let mut rows: Vec<&mut [RootPixel]> = pixels.chunks_exact_mut(width.max(1)).collect();
        self.finish_in(&mut rows, work, photographs, scratch);
        pixels
    }

    /// Finishes the tile in its `out`, rows of empty pixels.
    pub(super) fn finish_in(
        &self,
        out: &mut [&mut [RootPixel]],
        work: &BlendWork<'_>,
        photographs: &[Option<WarpedPhotograph<'_>>],
        scratch: &mut SamplingMemory,
    ) {
        let photograph = |label: &Label| photographs.get(usize::from(*label)).and_then(Option::as_ref);
        match self.shown.as_slice() {
            [] => {}
            [only] => {
                if let Some(photograph) = photograph(only) {
                    self.of_one(out, work, photograph, usize::from(*only), scratch);
                }
            }
            several => {
                let shown: Vec<_> = several.iter().filter_map(|label| Some((*label, photograph(label)?))).collect();
                if work.levels.is_some() {
                    self.blended(out, work, &shown, scratch);
                } else {
                    self.cut(out, work, &shown, scratch);
                }
            }
        }
    }

    fn window<'a>(&self, columns: &'a Range<usize>, rows: &'a Range<usize>) -> Window<'a> {
        Window { columns, rows }
    }

    /// A tile that shows one photograph: its fine levels are that photograph's, its coarse ones may not be.
    fn of_one(
        &self,
        out: &mut [&mut [RootPixel]],
        work: &BlendWork<'_>,
        photograph: &WarpedPhotograph<'_>,
        label: usize,
        scratch: &mut SamplingMemory,
    ) {
        let offset = work
            .levels
            .as_ref()
            .and_then(|levels| self.offset(&levels.blended, levels.own.at(label), work.first_level));
        let mut finishing = FinishingRows {
            offsets: offset.as_ref().map(|offset| offset.expansion(&self.columns, self.rows.start)),
            change: vec![[0.0; 4]; self.columns.len()],
            out,
        };
        let window = self.window(&self.columns, &self.rows);
        photograph.sample_rows(window, &work.resampling, scratch, &mut finishing);
    }

    /// What the coarse levels change of a photograph, around the tile at half its size; `None` if nothing.
    fn offset(
        &self,
        blended: &PyramidPlane<[f32; 4]>,
        base: &CoarseLevel,
        first_level: u32,
    ) -> Option<PyramidPlane<[f32; 4]>> {
        let reach = |range: &Range<usize>, length: usize| {
            (range.start >> first_level).saturating_sub(2)..(((range.end - 1) >> first_level) + 3).min(length)
        };
        let columns = reach(&self.columns, blended.columns.end);
        let rows = reach(&self.rows, blended.rows.end);
        let mut plane = PyramidPlane::new(columns.clone(), rows.clone());
        let mut any = false;
        for y in rows.clone().filter(|y| base.plane.rows.contains(y)) {
            let (own, all) = (base.plane.row(y), blended.row(y));
            for (x, texel) in columns.clone().zip(plane.row_mut(y)) {
                if !base.plane.columns.contains(&x) {
                    continue;
                }
                let own = color(own[x - base.plane.columns.start]);
                if let (Some(own), Some(all)) = (own, color(all[x - blended.columns.start])) {
                    *texel = [all[0] - own[0], all[1] - own[1], all[2] - own[2], 1.0];
                    any |= texel[..3].iter().any(|channel| channel.abs() > NO_CHANGE);
                }
            }
        }
        if !any {
            return None;
        }
        for level in (1..first_level).rev() {
            let within = |range: &Range<usize>, length: usize| {
                // Two samples more than the next finer level asks for.
                (range.start >> level).saturating_sub(2)..(((range.end - 1) >> level) + 3).min(length)
            };
            // At least as many samples as the canvas has.
            let columns = within(&self.columns, blended.columns.end << (first_level - level));
            let rows = within(&self.rows, blended.rows.end << (first_level - level));
            plane = plane.expanded(&columns, &rows);
            level_shares(&mut plane);
        }
        Some(plane)
    }

    /// Every pixel from the photograph that the seams give it to, as opaque as all that show it make it together.
    fn cut(
        &self,
        out: &mut [&mut [RootPixel]],
        work: &BlendWork<'_>,
        shown: &[(Label, &WarpedPhotograph<'_>)],
        scratch: &mut SamplingMemory,
    ) {
        let width = self.columns.len();
        let mut taken = vec![0.0_f32; width * self.rows.len()];
        let mut opacity = vec![0.0_f32; taken.len()];
        let mut labels = Vec::new();
        for (label, photograph) in shown {
            let mut pixels = vec![[0.0; 4]; taken.len()];
            photograph.sample(self.window(&self.columns, &self.rows), &mut pixels, &work.resampling, scratch);
            for (row, y) in self.rows.clone().enumerate() {
                work.shown.labels(y, &self.columns, 1, &mut labels);
                for (x, own) in labels.iter().enumerate() {
                    let at = row * width + x;
                    // Where the owner covers nothing, whoever covers most.
                    let claim = pixels[at][3] * if *own == work.shown.label(*label) { 2.0 } else { 1.0 };
                    opacity[at] += pixels[at][3];
                    if claim > taken[at] {
                        taken[at] = claim;
                        out[row][x] = finished(pixels[at]);
                    }
                }
            }
        }
        for (pixel, opacity) in out.iter_mut().flat_map(|row| row.iter_mut()).zip(opacity) {
            if opacity > 0.0 {
                pixel[3] = finished_sample(opacity);
            }
        }
    }

    /// The fine levels of several photographs blended, on top of the blended coarse ones.
    pub(super) fn blended(
        &self,
        out: &mut [&mut [RootPixel]],
        work: &BlendWork<'_>,
        shown: &[(Label, &WarpedPhotograph<'_>)],
        scratch: &mut SamplingMemory,
    ) {
        let (columns, rows) = Self::with_margin(&self.columns, &self.rows, work);
        let masks = self.masks(work, shown, &columns, &rows);
        for claim in [Claim::OwnersAlone, Claim::Everyone] {
            if self.blended_by(claim, out, &masks, work, shown, scratch).is_some() {
                break;
            }
        }
    }

    /// [`Self::blended`] of photographs that are shown by `masks`; `None`, and nothing of `out` set, if the claim does
    /// not do.
    fn blended_by(
        &self,
        claim: Claim,
        out: &mut [&mut [RootPixel]],
        masks: &[PyramidPlane<f32>],
        work: &BlendWork<'_>,
        shown: &[(Label, &WarpedPhotograph<'_>)],
        scratch: &mut SamplingMemory,
    ) -> Option<()> {
        let levels = work.levels.as_ref()?;
        let (columns, rows) = sampled_window([&self.columns, &self.rows], work.first_level, work.shown.unrolled);
        let mut sums = zero_levels(&columns, &rows, work.first_level);
        let mut opacity = vec![0.0_f32; self.columns.len() * self.rows.len()];
        let instead = match claim {
            // All that is hidden lies below what covers it wholly.
            Claim::OwnersAlone => None,
            Claim::Everyone => self.shown_instead([&columns, &rows], masks, work, shown, scratch),
        };
        let mut owned = match claim {
            Claim::OwnersAlone => columns.len() * rows.len(),
            Claim::Everyone => 0,
        };
        for ((label, photograph), mask) in shown.iter().zip(masks) {
            let (columns, rows) = match claim {
                Claim::OwnersAlone => felt(mask, work.first_level, [&columns, &rows]),
                Claim::Everyone => (columns.clone(), rows.clone()),
            };
            let mut plane = PyramidPlane::new(columns.clone(), rows.clone());
            photograph.sample(self.window(&columns, &rows), &mut plane.texels, &work.resampling, scratch);
            // Contours at the finest level change at the seam itself.
            let mut weights = mask.part(&columns, &rows);
            if claim == Claim::OwnersAlone {
                let mut shown = weights.texels.iter().zip(&plane.texels).filter(|(weight, _)| **weight > 0.0);
                owned = shown.try_fold(owned, |left, (_, texel)| (texel[3] >= 1.0).then(|| left.wrapping_sub(1)))?;
            }
            for texel in &mut plane.texels {
                let [r, g, b, share] = *texel;
                *texel = [r * share, g * share, b * share, share];
            }
            self.add_opacity(&plane, &mut opacity);
            let ignored = work.ignored[usize::from(*label)].as_deref();
            hide_ignored(&mut plane, &weights, photograph, ignored, instead.as_deref());
            let mut mask: Cow<'_, PyramidPlane<f32>> = Cow::Borrowed(mask);
            for (level, sum) in sums.iter_mut().enumerate() {
                mask = Cow::Owned(mask.reduced());
                if level > 0 {
                    weights = mask.expanded(&plane.columns, &plane.rows);
                }
                if level + 1 == work.first_level as usize {
                    let coarser = &levels.own.at(usize::from(*label)).plane;
                    add_detail(sum, &plane, coarser, &weights, claim.least_weight());
                } else {
                    let reduced = plane.reduced();
                    let mut coarser = reduced.clone();
                    level_shares(&mut coarser);
                    add_detail(sum, &plane, &coarser, &weights, claim.least_weight());
                    plane = reduced;
                }
            }
        }
        if owned != 0 {
            return None;
        }
        let mut blended: Option<PyramidPlane<[f32; 4]>> = None;
        while let Some(mut sum) = sums.pop() {
            collapse(&mut sum, Some(blended.as_ref().unwrap_or(&levels.blended)));
            blended = Some(sum);
        }
        let blended = blended?;
        let shift = self.columns.start - columns.start;
        let mut row = vec![[0.0; 4]; self.columns.len()];
        for ((y, opacity), out) in self.rows.clone().zip(opacity.chunks_exact(row.len())).zip(out) {
            for (pixel, (texel, &opacity)) in row.iter_mut().zip(blended.row(y)[shift..].iter().zip(opacity)) {
                *pixel = [texel[0], texel[1], texel[2], if texel[3] > 0.0 { opacity } else { 0.0 }];
            }
            finish_all(&row, out);
        }
        Some(())
    }

    /// Where in a window what is shown by `masks` covers anything; `None` if nobody asks because nothing is ignored.
    /// Labels may reach beyond what a photograph covers: they were found in small views.
    fn shown_instead(
        &self,
        [columns, rows]: [&Range<usize>; 2],
        masks: &[PyramidPlane<f32>],
        work: &BlendWork<'_>,
        shown: &[(Label, &WarpedPhotograph<'_>)],
        scratch: &mut SamplingMemory,
    ) -> Option<Vec<bool>> {
        if shown.iter().all(|(label, _)| work.ignored[usize::from(*label)].is_none()) {
            return None;
        }
        let mut covered = vec![false; columns.len() * rows.len()];
        for ((_, photograph), mask) in shown.iter().zip(masks) {
            let mut pixels = vec![[0.0; 4]; covered.len()];
            photograph.sample(self.window(columns, rows), &mut pixels, &work.resampling, scratch);
            let weights = mask.part(columns, rows);
            for ((covered, pixel), weight) in covered.iter_mut().zip(&pixels).zip(&weights.texels) {
                *covered |= pixel[3] > 0.0 && *weight > 0.0;
            }
        }
        Some(covered)
    }

    /// Where each photograph is shown, 0 or 1.
    fn masks(
        &self,
        work: &BlendWork<'_>,
        shown: &[(Label, &WarpedPhotograph<'_>)],
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) -> Vec<PyramidPlane<f32>> {
        let mut masks: Vec<PyramidPlane<f32>> =
            shown.iter().map(|_| PyramidPlane::new(columns.clone(), rows.clone())).collect();
        let mut labels = Vec::new();
        for y in rows.clone() {
            work.shown.labels(y, columns, 1, &mut labels);
            for (mask, (placement, _)) in masks.iter_mut().zip(shown) {
                let label = work.shown.label(*placement);
                for (weight, own) in mask.row_mut(y).iter_mut().zip(&labels) {
                    *weight = if *own == label && *own != NOBODY { 1.0 } else { 0.0 };
                }
            }
        }
        masks
    }

    /// Adds what a photograph's `plane` covers of the tile.
    fn add_opacity(&self, plane: &PyramidPlane<[f32; 4]>, opacity: &mut [f32]) {
        let (columns, rows) = (common(&self.columns, &plane.columns), common(&self.rows, &plane.rows));
        if columns.is_empty() {
            return;
        }
        for y in rows {
            let start = (y - self.rows.start) * self.columns.len() + columns.start - self.columns.start;
            let texels = &plane.row(y)[columns.start - plane.columns.start..];
            for (opacity, texel) in opacity[start..start + columns.len()].iter_mut().zip(texels) {
                *opacity += texel[3];
            }
        }
    }
}

/// Finishes rows as they come: what is near in memory is used again at once.
struct FinishingRows<'a, 'out> {
    /// What is added to each.
    offsets: Option<Expansion<'a, [f32; 4]>>,
    change: Vec<[f32; 4]>,
    out: &'a mut [&'out mut [RootPixel]],
}

impl RowSink for FinishingRows<'_, '_> {
    fn row(&mut self, number: usize, row: &mut [[f32; 4]]) {
        if let Some(offsets) = &mut self.offsets {
            offsets.next_row(&mut self.change);
            with_vector_instructions(Changing { pixels: row, changes: &self.change });
        }
        finish_all(row, self.out[number]);
    }
}

/// Which photographs count at a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Claim {
    /// The one that is shown there, and what blending brings over the seams from others. It does where all pixels are
    /// covered wholly by the one they show: then the others are only read as far as they are felt.
    OwnersAlone,
    /// All that cover it, those that are not shown hardly: where the one that is shown ends, they show.
    Everyone,
}

impl Claim {
    /// How much a photograph counts at least.
    fn least_weight(self) -> f32 {
        match self {
            Self::OwnersAlone => 0.0,
            Self::Everyone => LEAST_WEIGHT,
        }
    }
}

/// The part of a window in which a photograph shown by `mask` is felt at the levels below the first, from and to
/// samples that all of these have.
fn felt(
    mask: &PyramidPlane<f32>,
    first_level: u32,
    [columns, rows]: [&Range<usize>; 2],
) -> (Range<usize>, Range<usize>) {
    let is_shown = |weights: &[f32]| weights.iter().any(|&weight| weight > 0.0);
    let of_columns = |y: usize| {
        let row = mask.row(y);
        let first = row.iter().position(|&weight| weight > 0.0)?;
        let last = row.iter().rposition(|&weight| weight > 0.0)?;
        Some(mask.columns.start + first..mask.columns.start + last + 1)
    };
    let joined = |a: Range<usize>, b: Range<usize>| a.start.min(b.start)..a.end.max(b.end);
    let across = mask.rows.clone().filter_map(of_columns).reduce(joined).unwrap_or(0..0);
    let first = mask.rows.clone().find(|&y| is_shown(mask.row(y))).unwrap_or(0);
    let last = mask.rows.clone().rfind(|&y| is_shown(mask.row(y))).map_or(0, |last| last + 1);
    // Weights reach 3 2^first_level - 2 pixels beyond what is shown ([`mask_margin`]); what they weigh is made of
    // 2^first_level - 2 pixels farther away.
    let reach = 4 << first_level;
    let grown = |shown: Range<usize>, window: &Range<usize>| {
        if shown.is_empty() {
            return window.start..window.start;
        }
        let start = (shown.start.saturating_sub(reach) >> first_level << first_level).max(window.start);
        let end = (shown.end + reach).next_multiple_of(1 << first_level).min(window.end);
        start..end.max(start)
    };
    (grown(across, columns), grown(first..last, rows))
}

/// Zeros at all levels below the first that is blended as a whole.
fn zero_levels(columns: &Range<usize>, rows: &Range<usize>, first_level: u32) -> Vec<PyramidPlane<[f32; 4]>> {
    let at = |range: &Range<usize>, level: u32| range.start.div_ceil(1 << level)..range.end.div_ceil(1 << level);
    (0..first_level).map(|level| PyramidPlane::new(at(columns, level), at(rows, level))).collect()
}

/// Takes from a photograph's `plane` what its photographer ignores and another photograph is shown for, so that nothing
/// of it reaches over the seam; `instead` says where another one covers anything, everywhere if not given.
fn hide_ignored(
    plane: &mut PyramidPlane<[f32; 4]>,
    shown: &PyramidPlane<f32>,
    photograph: &WarpedPhotograph<'_>,
    ignored: Option<&Mask>,
    instead: Option<&[bool]>,
) {
    let Some(ignored) = ignored else { return };
    let (columns, rows) = (plane.columns.clone(), plane.rows.clone());
    photograph.grid().each_place(&columns, &rows, |[x, y], place, _| {
        let at = (y - rows.start) * columns.len() + x - columns.start;
        let is_shown_instead = shown.texels[at] == 0.0 && instead.is_none_or(|covered| covered[at]);
        if is_shown_instead && ignored.contains(in_mask(ignored, place, photograph.grid().size)) {
            plane.texels[at] = [0.0; 4];
        }
    });
}

/// A change of the square root of linear light too small for 16 bits.
const NO_CHANGE: f32 = 1e-6;

/// Pixels of the panorama.
fn finish_all(pixels: &[[f32; 4]], out: &mut [RootPixel]) {
    with_vector_instructions(Finishing { pixels, out });
}

struct Finishing<'a> {
    pixels: &'a [[f32; 4]],
    out: &'a mut [RootPixel],
}

impl VectorLoop for Finishing<'_> {
    #[inline(always)]
    fn run(self) {
        for (out, &value) in self.out.as_flattened_mut().iter_mut().zip(self.pixels.as_flattened()) {
            *out = finished_sample(value);
        }
    }
}

/// A row of pixels, and what is added to their colors.
struct Changing<'a> {
    pixels: &'a mut [[f32; 4]],
    changes: &'a [[f32; 4]],
}

impl VectorLoop for Changing<'_> {
    #[inline(always)]
    fn run(self) {
        for (pixel, &change) in self.pixels.iter_mut().zip(self.changes) {
            let [r, g, b] = color(change).unwrap_or_default();
            // The share is the offset's own.
            *pixel = [pixel[0] + r, pixel[1] + g, pixel[2] + b, pixel[3]];
        }
    }
}

/// A pixel of the panorama from the square root of linear light and the share covered.
fn finished(pixel: [f32; 4]) -> RootPixel {
    pixel.map(finished_sample)
}

/// 65535 for 1, and for all above; 0 for what is below it, and for no number.
#[allow(clippy::manual_clamp)]
#[inline(always)]
fn finished_sample(value: f32) -> u16 {
    // `max` first: unlike `clamp`, it turns NaN into a number. By 32 bits, since vector instructions have no shorter
    // conversion.
    (value * 65535.0 + 0.5).max(0.0).min(65535.0) as i32 as u16
}
