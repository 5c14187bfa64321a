//! What a seam costs.

use rayon::prelude::*;

use super::band::Band;
use super::options::SeamOptions;
use super::shading::{FRACTION, Shading, shading};
use super::softness::Softness;
use crate::small_views::{CLIPPED, Depths, IGNORED, KEPT, PARTLY, SmallPixel, SmallView, WHOLE_LACK, WHOLLY, luma};

/// Cost of a seam for its length alone, gray levels of difference. Higher makes seams shorter.
const LENGTH: f64 = 2.0;

/// Weight of the difference of gradients beside that of colors. Higher keeps seams from crossing contours that do not
/// meet.
const GRADIENT_WEIGHT: f64 = 1.0;

/// Cost of showing a photograph where its highlights are clipped and another one's are not, gray levels per pixel.
const CLIPPED_COST: f64 = 1.5;

/// Costs are whole numbers; one gray level of 255 is this many.
pub(super) const UNIT: i32 = 16;

/// Cost of a pixel that the user does not want so: no seam that saves it is too long.
const AGAINST_WISHES: i32 = 1 << 16;

/// Difference taken for a pixel that only one of the two photographs shows: no less than any other, since at the border
/// of a photograph there is no room to blend.
const UNSEEN: i32 = MAX_DIFFERENCE;

/// A step between photographs that there is no room to blend counts as a slope of the shading by this part of it.
const SLOPES_PER_STEP: i32 = 2;
/// Steps that a short transition hides, gray levels.
const HIDDEN_STEP: i16 = 8;

/// Largest difference of a pixel; that of three photographs obeys the triangle inequality with it, too.
const MAX_DIFFERENCE: i32 = 128 * UNIT;

/// One level of the pyramid of small canvases: the photographs, and what is derived from them.
pub(super) struct SeamEnergy<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Columns of a turn on a cylinder, its width; 0 on a plane.
    pub(super) turn: usize,
    pub(super) views: &'a [SmallView],
    /// Horizontal and vertical differences of the luma, for every pixel of every view that is prepared.
    gradients: Vec<Vec<[i16; 2]>>,
    /// Shading of every pixel of every view that is prepared; empty if it does not count.
    shading: Vec<Shading>,
    /// For every canvas pixel that is prepared: by how much more than [`HIDDEN_STEP`] the photographs' mean brightness
    /// lies apart there, in [`FRACTION`]s of a level. Empty if it does not count.
    steps: Vec<i16>,
    depths: Vec<Depths>,
    softness: &'a [Softness],
    /// How often the canvas that the softness is of was halved.
    halvings: u32,
    /// For every canvas pixel: bit flags of what all photographs say of it.
    anyone: Vec<u8>,
    /// Number of the moving thing that covers a canvas pixel; 0 for none.
    pub(super) moving: &'a [u32],
    length: i32,
    gradient_weight: i32,
    shading_weight: i32,
    depth_weight: i32,
    sharpness_weight: i32,
    clipped_cost: i32,
    moving_cost: i32,
}

/// Someone covers the pixel wholly.
const ANY_WHOLE: u8 = 1;
/// Someone who may be shown covers it wholly without being clipped.
const ANY_UNCLIPPED: u8 = 2;
/// Someone is to be kept there.
const ANY_KEPT: u8 = 4;

impl<'a> SeamEnergy<'a> {
    pub(super) fn new(
        views: &'a [SmallView],
        [width, height]: [usize; 2],
        turn: usize,
        moving: &'a [u32],
        (softness, halvings): (&'a [Softness], u32),
        options: &SeamOptions,
    ) -> Self {
        let mut anyone = vec![0_u8; width * height];
        anyone.par_chunks_exact_mut(width).enumerate().for_each(|(y, anyone)| {
            for view in views.iter().filter(|view| view.rows.contains(&y)) {
                let across = view.columns.len();
                let row = &view.pixels[(y - view.rows.start) * across..][..across];
                for (x, pixel) in view.columns.clone().zip(row) {
                    let anyone = &mut anyone[if x < width { x } else { x - width }];
                    let flags = pixel[3];
                    let whole = flags & WHOLLY != 0;
                    let shown = whole && flags & (CLIPPED | IGNORED) == 0;
                    *anyone |= (u8::from(whole) * ANY_WHOLE)
                        | (u8::from(shown) * ANY_UNCLIPPED)
                        | (u8::from(whole && flags & KEPT != 0) * ANY_KEPT);
                }
            }
        });
        Self {
            width,
            height,
            turn,
            views,
            gradients: Vec::new(),
            shading: Vec::new(),
            steps: Vec::new(),
            depths: views.par_iter().map(SmallView::depths).collect(),
            softness,
            halvings,
            anyone,
            moving,
            length: in_units(LENGTH),
            gradient_weight: in_units(GRADIENT_WEIGHT),
            shading_weight: in_units(options.shading_weight),
            depth_weight: in_units(options.depth_weight),
            sharpness_weight: in_units(options.sharpness_weight),
            clipped_cost: in_units(CLIPPED_COST),
            moving_cost: in_units(options.moving_cost),
        }
    }

    /// Finds what [`Self::seam_cost`] and [`Self::difference`] need, at the canvas pixels that are `wanted`; before
    /// that, and elsewhere, they are not to be asked.
    pub(super) fn prepare_differences(&mut self, wanted: &Band) {
        let views = self.views;
        self.gradients = views.par_iter().map(|view| gradients(view, wanted)).collect();
        if self.shading_weight > 0 {
            self.shading = views.par_iter().map(|view| shading(view, wanted)).collect();
            self.steps = self.steps(wanted);
        }
    }

    /// See [`Self::steps`], the field.
    fn steps(&self, wanted: &Band) -> Vec<i16> {
        let hidden = HIDDEN_STEP * FRACTION as i16;
        let mut steps = vec![0; self.width * self.height];
        steps.par_chunks_exact_mut(self.width.max(1)).enumerate().for_each(|(y, steps)| {
            let mut prepared = wanted.within(&(0..self.width), y);
            let Some(first) = prepared.next() else { return };
            let last = prepared.last().unwrap_or(first);
            let mut range = vec![(i16::MAX, 0_i16); last + 1 - first];
            for (view, shading) in self.views.iter().zip(&self.shading).filter(|(view, _)| view.rows.contains(&y)) {
                let row = &shading.means[(y - view.rows.start) * view.columns.len()..][..view.columns.len()];
                for x in wanted.within(&view.columns, y) {
                    let mean = row[x - view.columns.start];
                    if mean > 0 {
                        let (least, most) = &mut range[self.column(x) - first];
                        (*least, *most) = ((*least).min(mean), (*most).max(mean));
                    }
                }
            }
            for (step, (least, most)) in steps[first..].iter_mut().zip(range) {
                *step = most.saturating_sub(least).saturating_sub(hidden).max(0);
            }
        });
        steps
    }

    /// The canvas column of a column that may lie in the next turn.
    #[inline]
    pub(super) fn column(&self, x: usize) -> usize {
        if x < self.width { x } else { x - self.turn }
    }

    /// Whether photograph `label` may be shown at a canvas pixel: where no one covers it wholly, those that cover it in
    /// part may.
    pub(super) fn allowed(&self, label: usize, x: usize, y: usize) -> bool {
        let wanted = if self.anyone[y * self.width + x] & ANY_WHOLE != 0 { WHOLLY } else { PARTLY };
        self.views[label].flags(x, y, self.turn) & wanted != 0
    }

    /// Tells `found` of those of `columns` in row `y` where photograph `label` may not be shown.
    pub(super) fn each_not_allowed(
        &self,
        label: usize,
        columns: std::ops::Range<usize>,
        y: usize,
        found: &mut impl FnMut(usize),
    ) {
        let view = &self.views[label];
        let in_first_turn = view.columns.start <= columns.start && columns.end <= view.columns.end;
        if !in_first_turn || !view.rows.contains(&y) {
            return columns.filter(|&x| !self.allowed(label, x, y)).for_each(found);
        }
        let start = (y - view.rows.start) * view.columns.len() + columns.start - view.columns.start;
        let pixels = &view.pixels[start..start + columns.len()];
        let anyone = &self.anyone[y * self.width + columns.start..][..columns.len()];
        for (x, (pixel, anyone)) in columns.zip(pixels.iter().zip(anyone)) {
            let wanted = if anyone & ANY_WHOLE != 0 { WHOLLY } else { PARTLY };
            if pixel[3] & wanted == 0 {
                found(x);
            }
        }
    }

    /// How deep inside photograph `label` a canvas pixel lies, 0 to 255.
    pub(super) fn depth(&self, label: usize, x: usize, y: usize) -> u8 {
        self.views[label].index_around(x, y, self.turn).map_or(0, |index| self.depths[label].at(index))
    }

    /// Cost of showing photograph `label`, which is allowed there, at a canvas pixel.
    pub(super) fn data_cost(&self, label: usize, x: usize, y: usize) -> i32 {
        let flags = self.views[label].flags(x, y, self.turn);
        let anyone = self.anyone[y * self.width + x];
        let mut cost = self.depth_weight * (255 - i32::from(self.depth(label, x, y))) / 255;
        if let Some(softness) = self.softness.get(label) {
            let own = if self.views[label].columns.contains(&x) { x } else { x + self.turn };
            cost += self.sharpness_weight * i32::from(softness.at([own, y], self.halvings)) / 255;
        }
        if flags & CLIPPED != 0 && anyone & ANY_UNCLIPPED != 0 {
            cost += self.clipped_cost;
        }
        let against_wishes = flags & IGNORED != 0 || anyone & ANY_KEPT != 0 && flags & KEPT == 0;
        cost + if against_wishes { AGAINST_WISHES } else { 0 }
    }

    /// Cost of a seam between neighboring canvas pixels, `a` shown at `p` and `b` at `q`; 0 for equal labels.
    ///
    /// The differences at both pixels, of colors, gradients and shading: Kwatra and others, "Graphcut textures",
    /// SIGGRAPH 2003, equation 1, with the gradients added instead of divided by: a division draws seams into textured
    /// parts, which in photographs taken from different places fit worst.
    pub(super) fn seam_cost(&self, p: [usize; 2], a: usize, q: [usize; 2], b: usize) -> i32 {
        if a == b {
            return 0;
        }
        self.cost_of(p, q, self.difference(a, b, p) + self.difference(a, b, q))
    }

    /// Cost of a seam between neighboring pixels from the sum of the differences at both.
    #[inline]
    pub(super) fn cost_of(&self, p: [usize; 2], q: [usize; 2], difference: i32) -> i32 {
        let (at_p, at_q) = (self.moving[p[1] * self.width + p[0]], self.moving[q[1] * self.width + q[0]]);
        let through = if at_p != 0 && at_p == at_q { self.moving_cost } else { 0 };
        self.length + difference + through
    }

    /// How differently two photographs show a canvas pixel.
    pub(super) fn difference(&self, a: usize, b: usize, [x, y]: [usize; 2]) -> i32 {
        let index = |label: usize| self.views[label].index_around(x, y, self.turn);
        let (Some(i), Some(j)) = (index(a), index(b)) else { return UNSEEN };
        let (first, second) = (self.views[a].pixels[i], self.views[b].pixels[j]);
        if first[3] & second[3] & PARTLY == 0 {
            return UNSEEN;
        }
        let color: i32 = (0..3).map(|c| i32::from(first[c].abs_diff(second[c]))).sum();
        let (g, h) = (self.gradients[a][i], self.gradients[b][j]);
        let gradient: i32 = (0..2).map(|axis| i32::from(g[axis] - h[axis]).abs()).sum();
        let mut difference = color * UNIT / 3 + gradient * self.gradient_weight / 2;
        if !self.shading.is_empty() {
            let (g, h) = (self.shading[a].slopes[i], self.shading[b].slopes[j]);
            let slope: i32 = (0..2).map(|axis| (i32::from(g[axis]) - i32::from(h[axis])).abs()).sum();
            difference += slope * self.shading_weight / FRACTION;
            // Of all photographs, not of these two: so three obey the triangle inequality.
            let step = i32::from(self.steps[y * self.width + self.column(x)]);
            if step > 0 {
                let lack = self.depths[a].lack_of_room(i) + self.depths[b].lack_of_room(j);
                difference += step * lack / WHOLE_LACK * self.shading_weight / (FRACTION * SLOPES_PER_STEP);
            }
        }
        difference.min(MAX_DIFFERENCE)
    }
}

/// Gray levels as a cost.
fn in_units(levels: f64) -> i32 {
    (levels * f64::from(UNIT)).round() as i32
}

/// Central differences of the luma over covered pixels; one-sided or zero at the border. 0 where they are not `wanted`.
fn gradients(view: &SmallView, wanted: &Band) -> Vec<[i16; 2]> {
    let (width, height) = (view.columns.len(), view.rows.len());
    let luma = |index: usize| {
        let pixel: &SmallPixel = &view.pixels[index];
        (pixel[3] & PARTLY != 0).then(|| (luma(pixel) >> 8) as i16)
    };
    let mut out = vec![[0; 2]; width * height];
    for (y, row) in view.rows.clone().enumerate() {
        for x in wanted.within(&view.columns, row).map(|x| x - view.columns.start) {
            let index = y * width + x;
            let Some(middle) = luma(index) else { continue };
            let or_middle = |inside: bool, at: usize| if inside { luma(at).unwrap_or(middle) } else { middle };
            let left = or_middle(x > 0, index.wrapping_sub(1));
            let right = or_middle(x + 1 < width, index + 1);
            let above = or_middle(y > 0, index.wrapping_sub(width));
            let below = or_middle(y + 1 < height, index + width);
            out[index] = [right - left, below - above];
        }
    }
    out
}
