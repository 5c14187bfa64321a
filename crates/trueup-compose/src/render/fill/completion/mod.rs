//! What the panorama shows elsewhere in gaps beside clouds, lawns and the like, which no smooth surface goes on as.
//!
//! [`samples`] is the panorama around gaps, reduced; [`part`] one gap; [`roughness`] how rough its border is, and
//! [`kinds`] what around it is of the kind of that; [`offsets`] by which this goes on along the border; [`labelling`]
//! which of them each place is filled from; [`correction`] what is added there, so that nothing ends in a step.

mod correction;
mod elsewhere;
mod kinds;
mod labelling;
mod offsets;
mod part;
mod roughness;
mod samples;

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::{Result, StageContext};

pub(super) use self::elsewhere::Elsewhere;
use self::labelling::{Energy, Shown};
use self::part::Part;
use self::samples::Samples;
use super::{Canvas, Shade};
use crate::pyramid::PyramidPlane;
use crate::store::PixelStore;

/// What is shown in gaps instead of a smooth surface.
#[derive(Debug, Default)]
pub(super) struct Completion {
    /// Log2 of the pixels per sample.
    level: u32,
    columns: usize,
    /// What is shown at every sample of the canvas: 0 the smooth surface, or one more than an index to `offsets`. Empty
    /// if nothing else is anywhere.
    shown: Vec<Shown>,
    /// Where it lies from there, pixels.
    offsets: Vec<[isize; 2]>,
    /// What is added to what is shown at every sample, roots of light.
    added: Vec<[f32; 3]>,
    /// Share of the pixels of every sample that is known.
    known: Vec<f32>,
}

/// What is shown in one gap; see [`Completion`].
struct Filled {
    offsets: Vec<[isize; 2]>,
    shown: Vec<Shown>,
    added: Vec<[f32; 3]>,
}

impl Completion {
    /// For the gaps of a canvas, with the smooth `colors` at its first level.
    ///
    /// # Errors
    /// Those of reading; [`trueup_core::Error::Cancelled`].
    pub(super) fn of<P: Shade>(
        canvas: &Canvas<'_>,
        store: &PixelStore<P>,
        colors: &PyramidPlane<[f32; 4]>,
        context: &StageContext,
    ) -> Result<Self> {
        let samples = Samples::of(canvas, store, context)?;
        let once = canvas.lead..canvas.lead + canvas.width;
        let parts = Part::all(&samples, &once, canvas.gaps.is_around());
        let smooth = |at: usize, part: &Part| {
            let place = [at % part.width() + part.columns.start, at / part.width() + part.rows.start];
            let scale = f64::from(1 << samples.level) / f64::from(1 << canvas.first_level);
            colors.color_at(place.map(|place| place as f64 * scale))
        };
        let filled = |part: &Part| {
            context.check_cancelled()?;
            let offsets = offsets::of(part);
            if offsets.is_empty() {
                return Ok(None);
            }
            let is_gap = part.is_gap();
            let smooth: Vec<Option<[f32; 3]>> =
                (0..is_gap.len()).map(|at| if is_gap[at] { smooth(at, part) } else { part.colors[at] }).collect();
            let energy = Energy::of(part, &offsets, &smooth);
            let shown = labelling::of(&energy);
            let added = correction::of(&energy, &shown);
            Ok(shown.iter().any(|&shown| shown > 0).then_some(Filled { offsets, shown, added }))
        };
        let filled: Vec<Option<Filled>> = parts.par_iter().map(filled).collect::<Result<_>>()?;
        let mut completion = Self {
            level: samples.level,
            columns: samples.columns,
            shown: vec![0; samples.open.len()],
            added: vec![[0.0; 3]; samples.open.len()],
            offsets: Vec::new(),
            known: samples.shares,
        };
        for (part, filled) in parts.iter().zip(filled) {
            if let Some(filled) = filled {
                completion.add(part, &filled);
            }
        }
        Ok(if completion.offsets.is_empty() { Self::default() } else { completion })
    }

    fn add(&mut self, part: &Part, filled: &Filled) {
        // Numbers of 16 bits are enough for sixteen stretches of a thousand gaps; of more, the last are smooth.
        let first = self.offsets.len();
        let (Ok(first), Ok(_)) = (Shown::try_from(first), Shown::try_from(first + filled.offsets.len())) else {
            return;
        };
        for (&at, (&shown, &added)) in part.gap.iter().zip(filled.shown.iter().zip(&filled.added)) {
            let (x, y) = (at % part.width() + part.columns.start, at / part.width() + part.rows.start);
            self.shown[y * self.columns + x] = if shown > 0 { shown + first } else { 0 };
            self.added[y * self.columns + x] = added;
        }
        let pixels = |[across, down]: &[isize; 2]| [across << self.level, down << self.level];
        self.offsets.extend(filled.offsets.iter().map(pixels));
    }

    /// The four samples around a pixel of the canvas, and the weights of each.
    fn around(&self, [x, y]: [usize; 2]) -> [(usize, f32); 4] {
        let step = (1 << self.level) as f32;
        let inside = (1 << self.level) - 1;
        let [u, v] = [x & inside, y & inside].map(|place| place as f32 / step);
        let at = (y >> self.level) * self.columns + (x >> self.level);
        let below = at + self.columns;
        [(at, (1.0 - u) * (1.0 - v)), (at + 1, u * (1.0 - v)), (below, (1.0 - u) * v), (below + 1, u * v)]
    }

    /// How much of what lies elsewhere is shown at a pixel: none at the border, all from a sample or so on, so that
    /// nothing ends at a line.
    fn share_at(&self, pixel: [usize; 2]) -> f32 {
        let known: f32 = self.around(pixel).map(|(at, weight)| weight * self.known[at]).iter().sum();
        // Half of what lies around a border is known.
        1.0 - (2.0 * known).min(1.0)
    }

    /// The offset, pixels, to what is shown at a sample; `None` for the smooth surface.
    fn offset(&self, at: usize) -> Option<[isize; 2]> {
        usize::from(self.shown[at]).checked_sub(1).map(|offset| self.offsets[offset])
    }

    /// The offsets that pixels of a box are filled from; `None` if all of it is the smooth surface as it is.
    fn offsets_within(&self, columns: &Range<usize>, rows: &Range<usize>) -> Option<Vec<[isize; 2]>> {
        if self.shown.is_empty() || columns.is_empty() || rows.is_empty() {
            return None;
        }
        let samples = |range: &Range<usize>| range.start >> self.level..((range.end - 1) >> self.level) + 2;
        let at = |row: usize| samples(columns).map(move |column| row * self.columns + column);
        let all: Vec<usize> = samples(rows).flat_map(at).collect();
        let mut labels: Vec<Shown> = all.iter().map(|&at| self.shown[at]).collect();
        labels.sort_unstable();
        labels.dedup();
        let is_other = labels.iter().any(|&label| label > 0) || all.iter().any(|&at| self.added[at] != [0.0; 3]);
        let offset = |label: Shown| usize::from(label).checked_sub(1).map(|offset| self.offsets[offset]);
        is_other.then(|| labels.into_iter().filter_map(offset).collect())
    }
}
