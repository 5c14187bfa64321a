//! Means of all photographs that cover a place.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::options::StageOptions;
use trueup_core::source::PhotographSource;
use trueup_core::{Result, StageContext};

use crate::deformed_grid::DeformedGrid;
use crate::ignored::{IgnoredPart, ShownElsewhere};
use crate::layout::{CanvasLayout, Placed};
use crate::light::{Correction, LocalExposure, PhotographLight};
use crate::memory_plan::{MemoryPlan, WorkBytes};
use crate::render_options::RenderOptions;
use crate::small_views::small_size;
use crate::store::{Block, Pixel, PixelStore, SumPixel};
use crate::warped::{Averaging, SamplingMemory, WarpedPhotograph, check_photograph};

const STAGE: &str = RenderOptions::STAGE;

/// Rows of the canvas that one task renders; large enough to find its cells once, small enough to share evenly.
const BAND_ROWS: usize = 16;

/// Bytes that averaging takes on a canvas so wide.
pub(super) fn needed_bytes(width: usize) -> WorkBytes {
    let band = width * BAND_ROWS * SumPixel::BYTES;
    WorkBytes { pixel_bytes: SumPixel::BYTES, working: 0, coarse_levels: 0, band }
}

/// What is averaged.
pub(super) struct AverageInput<'a> {
    /// Where the photographs lie.
    pub(super) layout: &'a CanvasLayout,
    /// One for each of them.
    pub(super) corrections: &'a [Correction],
    /// What is done to the light of all of them.
    pub(super) local: Option<&'a LocalExposure>,
    pub(super) photographs: &'a dyn PhotographSource,
    pub(super) averaging: Averaging,
    pub(super) plan: &'a MemoryPlan,
}

/// Photographs that were averaged.
pub(super) struct Averaged {
    pub(super) sums: PixelStore<SumPixel>,
    /// Whether some photograph has an alpha channel.
    pub(super) has_alpha: bool,
}

/// The weighted mean of all photographs at every pixel: sums over as many rows at once as there is memory for.
pub(super) fn run(input: &AverageInput<'_>, context: &StageContext) -> Result<Averaged> {
    let &AverageInput { photographs, plan, .. } = input;
    let (layout, originals) = input.layout.unrolled(0);
    let (width, height) = (layout.width, layout.height);
    let elsewhere = ShownElsewhere::find(&layout, photographs, small_size([width, height], false)).map(Arc::new);
    let summing =
        Summing { input, layout: &layout, originals: &originals, curve: photographs.transfer_curve(), elsewhere };
    let part_rows = plan.sum_rows(width, BAND_ROWS);
    let parts: Vec<Range<usize>> =
        (0..height).step_by(part_rows).map(|first| first..first.saturating_add(part_rows).min(height)).collect();
    let covered = covered_rows(&layout);
    let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
    let covering =
        |part: &Range<usize>| -> Vec<usize> { (0..covered.len()).filter(|&at| meet(&covered[at], part)).collect() };
    let covering: Vec<Vec<usize>> = parts.iter().map(covering).collect();
    context.progress().begin(STAGE, covering.iter().map(Vec::len).sum::<usize>() as u64);
    let mut has_alpha = false;
    let mut store = plan.on_disk().then(|| plan.store([width, height], [width, BAND_ROWS]));
    for (part, covering) in parts.into_iter().zip(covering) {
        let sums = summing.sums(&part, &covering, &mut has_alpha, context)?;
        match &mut store {
            // All rows at once.
            None => store = Some(PixelStore::of_pixels(width, sums)),
            Some(store) => {
                let rows = |band: usize| part.start + band * BAND_ROWS;
                let bands: Vec<Block<'_, SumPixel>> = sums
                    .chunks(width * BAND_ROWS)
                    .enumerate()
                    .map(|(band, sums)| Block {
                        columns: 0..width,
                        rows: rows(band)..rows(band) + sums.len() / width,
                        pixels: sums,
                    })
                    .collect();
                store.put(&bands)?;
            }
        }
    }
    context.progress().finish(STAGE);
    let sums = store.unwrap_or_else(|| PixelStore::in_memory([width, height]));
    Ok(Averaged { sums, has_alpha })
}

/// What is the same for all rows.
struct Summing<'a> {
    input: &'a AverageInput<'a>,
    /// The photographs wherever they are seen.
    layout: &'a CanvasLayout,
    /// For each of them the position of its photograph in the input.
    originals: &'a [usize],
    curve: TransferCurve,
    elsewhere: Option<Arc<ShownElsewhere>>,
}

impl Summing<'_> {
    /// Sums over the rows `part` of the canvas, of the photographs at the positions `covering`; notes whether one of
    /// these `has_alpha`.
    fn sums(
        &self,
        part: &Range<usize>,
        covering: &[usize],
        has_alpha: &mut bool,
        context: &StageContext,
    ) -> Result<Vec<SumPixel>> {
        let width = self.layout.width;
        let mut sums = vec![[0.0; 4]; width * part.len()];
        for group in covering.chunks(self.input.plan.at_a_time) {
            context.check_cancelled()?;
            let warped: Vec<WarpedPhotograph<'_>> =
                group.par_iter().map(|&at| self.warped(at)).collect::<Result<_>>()?;
            *has_alpha |= warped.iter().any(|warped| warped.photograph().0.has_alpha());
            sums.par_chunks_mut(width * BAND_ROWS).enumerate().try_for_each(|(band, sums)| {
                context.check_cancelled()?;
                let first = part.start + band * BAND_ROWS;
                let rows = first..first + sums.len() / width;
                let mut memory = SamplingMemory::default();
                for photograph in &warped {
                    photograph.add_to_band(&rows, sums, width, &self.input.averaging, &mut memory);
                }
                Ok(())
            })?;
            context.progress().advance(STAGE, group.len() as u64);
        }
        Ok(sums)
    }

    /// The photograph at a position, decoded.
    fn warped(&self, at: usize) -> Result<WarpedPhotograph<'static>> {
        let &AverageInput { corrections, local, photographs, averaging, .. } = self.input;
        let placed = &self.layout.placed[at];
        let photograph = photographs.photograph(placed.photograph)?;
        check_photograph(placed, &photograph)?;
        let size = [self.layout.width, self.layout.height];
        let light = PhotographLight { curve: &self.curve, correction: &corrections[self.originals[at]], local };
        let ignored = IgnoredPart::new(&photographs.masks(placed.photograph), self.elsewhere.as_ref(), size);
        let photograph = Cow::Owned(photograph);
        Ok(WarpedPhotograph::new(photograph, &placed.mesh, size, light, &averaging.resampling).without(ignored))
    }
}

/// The rows of the canvas that each photograph may cover.
fn covered_rows(layout: &CanvasLayout) -> Vec<Range<usize>> {
    let rows = |placed: &Placed| {
        let rows = DeformedGrid::new(&placed.mesh, 1.0, true, layout.width, layout.height).rows;
        // Reduced photographs have the same grid but for rounding.
        rows.start.saturating_sub(1)..(rows.end + 1).min(layout.height)
    };
    layout.placed.par_iter().map(rows).collect()
}
