//! The photographs that are in memory while tiles are finished.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::options::StageOptions;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use super::order::Batch;
use super::parts::{HeldPhotographs, WantedRows};
use crate::label::Label;
use crate::layout::Unrolled;
use crate::light::{Correction, LocalExposure, PhotographLight};
use crate::render_options::RenderOptions;
use crate::warped::{Resampling, WarpedPhotograph, check_photograph};

/// What photographs are made ready from.
#[derive(Clone, Copy)]
pub(super) struct PhotographLoader<'a> {
    pub(super) unrolled: &'a Unrolled<'a>,
    pub(super) curve: &'a TransferCurve,
    pub(super) corrections: &'a [Correction],
    /// What is done to the light of all of them, over the unrolled canvas.
    pub(super) local: Option<&'a LocalExposure>,
    pub(super) photographs: &'a dyn PhotographSource,
    pub(super) resampling: Resampling,
    pub(super) context: &'a StageContext<'a>,
}

/// Photographs in memory, within a number of bytes. Since the order of the work is known, the one that is wanted last
/// makes room for others (Belady, IBM Systems Journal 5(2), 1966): no other choice decodes fewer files.
pub(super) struct LoadedPhotographs<'a> {
    loader: PhotographLoader<'a>,
    room: usize,
    at_a_time: usize,
    /// Decoded, as the first pass left them.
    kept: Vec<Option<Photograph>>,
    warped: Vec<Option<WarpedPhotograph<'a>>>,
    /// The rows of them that are held.
    rows: Vec<Range<usize>>,
    /// For every photograph, the batches that show it.
    uses: Vec<Vec<usize>>,
    /// Whether progress was reported for a photograph.
    counted: Vec<bool>,
}

impl<'a> LoadedPhotographs<'a> {
    pub(super) fn new(
        loader: PhotographLoader<'a>,
        kept: Vec<Option<Photograph>>,
        batches: &[Batch],
        room: usize,
        at_a_time: usize,
    ) -> Self {
        let count = kept.len();
        let mut uses = vec![Vec::new(); count];
        for (index, batch) in batches.iter().enumerate() {
            for &label in batch.shown.keys() {
                uses[usize::from(label)].push(index);
            }
        }
        Self {
            loader,
            room,
            at_a_time,
            kept,
            warped: (0..count).map(|_| None).collect(),
            rows: vec![0..0; count],
            uses,
            counted: vec![false; count],
        }
    }

    /// The photographs that are ready, by label.
    pub(super) fn warped(&self) -> &[Option<WarpedPhotograph<'a>>] {
        &self.warped
    }

    /// Makes ready what batch number `index` shows, as far as it is to be `held`. Others may go.
    pub(super) fn prepare(&mut self, index: usize, batch: &Batch, held: &HeldPhotographs) -> Result<()> {
        let wanted: Vec<(usize, Range<usize>)> =
            batch.shown.iter().map(|(&label, rows)| (usize::from(label), rows.clone())).collect();
        for (at, rows) in &wanted {
            let is_held = self.rows[*at].start <= rows.start && rows.end <= self.rows[*at].end;
            if !is_held {
                self.warped[*at] = None;
            }
        }
        let missing: Vec<(usize, Range<usize>)> =
            wanted.iter().filter(|(at, _)| self.warped[*at].is_none()).cloned().collect();
        let from_files = missing.iter().filter(|(at, _)| self.kept[*at].is_none());
        let coming: usize = from_files.map(|(at, rows)| held.part(*at, rows)).sum();
        self.make_room(index, &batch.shown, coming);
        for group in missing.chunks(self.at_a_time.max(1)) {
            let ready: Vec<(usize, &Range<usize>, Option<Photograph>)> =
                group.iter().map(|(at, rows)| (*at, rows, self.kept[*at].take())).collect();
            let loader = self.loader;
            let load = |(at, rows, kept): (usize, &Range<usize>, Option<Photograph>)| {
                Ok((at, rows.clone(), loader.ready(at, kept, rows, held.height(at))?))
            };
            let loaded: Vec<(usize, Range<usize>, WarpedPhotograph<'a>)> =
                ready.into_par_iter().map(load).collect::<Result<_>>()?;
            for (at, rows, prepared) in loaded {
                self.warped[at] = Some(prepared);
                self.rows[at] = rows;
                if !std::mem::replace(&mut self.counted[at], true) {
                    loader.context.progress().advance(RenderOptions::STAGE, 1);
                }
            }
        }
        Ok(())
    }

    /// Lets go of photographs that are not `wanted` in batch `index` until `coming` more bytes fit: at first those that
    /// are never wanted again, then those that are wanted last.
    fn make_room(&mut self, index: usize, wanted: &WantedRows, coming: usize) {
        let next_use = |at: usize| {
            let uses = &self.uses[at];
            uses.get(uses.partition_point(|&batch| batch < index)).copied()
        };
        let mut others: Vec<(Option<usize>, usize)> = (0..self.kept.len())
            .filter(|&at| !wanted.contains_key(&(at as Label)))
            .map(|at| (next_use(at), at))
            .collect();
        // None, never, sorts first: it is to go first; then the latest, ties by the higher index.
        others.sort_unstable_by(|(a, i), (b, j)| (a.is_some(), b, j).cmp(&(b.is_some(), a, i)));
        for (next, at) in others {
            if next.is_some() && self.held_bytes().saturating_add(coming) <= self.room {
                break;
            }
            self.kept[at] = None;
            self.warped[at] = None;
        }
    }

    fn held_bytes(&self) -> usize {
        let kept: usize = self.kept.iter().flatten().map(Photograph::bytes).sum();
        kept + self.warped.iter().flatten().map(|photograph| photograph.photograph().0.bytes()).sum::<usize>()
    }
}

impl<'a> PhotographLoader<'a> {
    /// So many `rows` of photograph `at`, which has `height`, decoded unless it was kept.
    fn ready(
        &self,
        at: usize,
        kept: Option<Photograph>,
        rows: &Range<usize>,
        height: usize,
    ) -> Result<WarpedPhotograph<'a>> {
        self.context.check_cancelled()?;
        let placed = &self.unrolled.placed()[at];
        let photograph = match kept {
            Some(photograph) => photograph,
            None => self.photographs.photograph(placed.photograph)?,
        };
        check_photograph(placed, &photograph)?;
        let correction = &self.corrections[self.unrolled.original(at)];
        let light = PhotographLight { curve: self.curve, correction, local: self.local };
        let (photograph, size) = (Cow::Owned(photograph), self.unrolled.canvas());
        let warped = WarpedPhotograph::new(photograph, &placed.mesh, size, light, &self.resampling);
        Ok(if *rows == (0..height) { warped } else { warped.with_rows_only(rows) })
    }
}
