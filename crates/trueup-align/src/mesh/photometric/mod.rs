//! Photometric alignment: the pixels of overlapping pictures themselves draw the grids together.
//!
//! # Source
//! After the photometric term of generalized content-preserving warps (Chen and others, 2018), reconstructed: direct
//! alignment as in Lucas and Kanade (1981), linear in the vertices of both grids, next to the energies of the mesh. The
//! averaged slope of both pictures is that of efficient second-order minimization (Benhimane and Malis, 2004).
//!
//! # Departures
//! Every number that is not an option's is a reconstruction; gain and bias of a cell come from means and standard
//! deviations instead of a regression.

mod pair;
mod pyramid;

use rayon::prelude::*;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::{NormalEquations, evidence};
use crate::match_points::OverlapWarp;
use pair::{Overlap, OverlapEquations};
pub use pyramid::Pyramid;

trueup_core::options! {
    /// How pixels align the grids (`stitch.align = photometric`).
    pub struct PhotometricOptions("photometric") {
        /// Weight of a squared difference of gray levels, for samples 4 px apart.
        weight: f64 = 0.01, between(0.0, 1000.0), "per gray level squared";
        /// Standard deviation of the difference that the weight belongs to: overlaps that agree better weigh more.
        noise_level: f64 = 10.0, between(0.1, 255.0), "gray levels";
        /// Smaller deviations are not believed: rounding and compression differ from place to place.
        least_noise: f64 = 3.0, between(0.1, 255.0), "gray levels";
        /// Misalignment, common to neighboring cells of an overlap, from which on its pixels weigh fully; with less their
        /// weight falls with its square.
        full_px: f64 = 0.5, between(0.001, 1000.0), "panorama units, per axis";
        /// Distance of the samples in the finest pictures; twice as far in each coarser one.
        spacing_px: f64 = 4.0, between(1.0, 1000.0), "working px";
        /// Samples with a smaller change of gray in both pictures are passed over.
        min_gradient: f64 = 2.0, between(0.0, 255.0), "gray levels per working px";
        /// Pictures of halved size that are aligned one after the other, the smallest first.
        levels: usize = 3, between(1.0, 8.0), "";
        /// Most rounds at a level; each solves the mesh once.
        rounds: usize = 4, between(1.0, 100.0), "";
        /// A level ends when the mean difference falls by less than this share in a round.
        settled: f64 = 0.01, between(0.0, 1.0), "";
        /// A round that raises the root mean square distance of match points by more than this, over all rounds, is
        /// undone.
        max_departure_px: f64 = 1.0, between(0.0, 1000.0), "panorama units";
        /// Strength, in samples, with which the color difference in a cell is drawn to that of the whole overlap.
        color_ridge: f64 = 10.0, between(0.0, 1000000.0), "samples";
        /// Largest difference in contrast that is believed.
        max_gain: f64 = 4.0, between(1.0, 100.0), "";
        /// Overlaps with fewer samples are left as they are.
        min_samples: usize = 50, between(8.0, 1000000.0), "";
    }
}

/// The spacing of samples that the weight belongs to.
const PUBLISHED_SPACING_PX: f64 = 4.0;
/// Overlaps whose equations are held in memory at a time.
const OVERLAPS_AT_A_TIME: usize = 32;

/// What photometric alignment looks at.
#[derive(Debug, Clone, Copy)]
pub struct PhotometricInput<'a> {
    /// The pictures' pyramids.
    pub pyramids: &'a [Pyramid],
    /// How.
    pub options: &'a PhotometricOptions,
}

impl PhotometricInput<'_> {
    /// Adds the equations of all overlaps, linearized around the present grids, at a level; gives the mean difference in
    /// gray levels. `solved` are the grids whose vertices are unknown, `fine` the same subdivided along their bases,
    /// `shares` the share of its weight that every overlap has.
    pub(super) fn add(
        &self,
        equations: &mut NormalEquations,
        warps: &[OverlapWarp],
        [solved, fine]: [&[GridMesh]; 2],
        (level, shares): (usize, &[f64]),
        context: &StageContext,
    ) -> Result<f64> {
        let overlaps = self.overlaps(warps, [solved, fine]);
        let (mut sum, mut count) = (0.0, 0.0);
        for (several, shares) in overlaps.chunks(OVERLAPS_AT_A_TIME).zip(shares.chunks(OVERLAPS_AT_A_TIME)) {
            context.check_cancelled()?;
            let found: Vec<OverlapEquations> = several
                .par_iter()
                .zip(shares)
                .map(|(overlap, &share)| overlap.equations(level, share, self.options))
                .collect();
            for overlap in found {
                for cells in &overlap.cells {
                    equations.add_summed(&cells.members, &cells.metrics, &cells.right);
                }
                sum += overlap.misfit[0];
                count += overlap.misfit[1];
            }
        }
        Ok(if count > 0.0 { sum / count } else { 0.0 })
    }

    /// For every overlap the share of its weight that it has: how much of the misalignment that its pixels see, at the
    /// size at which they see most, is common to neighboring cells.
    pub(super) fn shares(
        &self,
        warps: &[OverlapWarp],
        grids: [&[GridMesh]; 2],
        context: &StageContext,
    ) -> Result<Vec<f64>> {
        context.check_cancelled()?;
        let levels = 0..self.options.levels;
        let share = |overlap: &Overlap| {
            let most = levels.clone().map(|level| overlap.common_square(level, self.options)).fold(0.0, f64::max);
            evidence::share(most, self.options.full_px)
        };
        Ok(self.overlaps(warps, grids).par_iter().map(share).collect())
    }

    /// Each overlap once: its pixels say the same from either side.
    fn overlaps<'a>(&'a self, warps: &'a [OverlapWarp], [solved, fine]: [&'a [GridMesh]; 2]) -> Vec<Overlap<'a>> {
        warps
            .iter()
            .filter(|warp| warp.from < warp.to)
            .map(|warp| {
                let ends = [warp.from, warp.to];
                Overlap {
                    warp,
                    solved: ends.map(|end| &solved[end]),
                    fine: ends.map(|end| &fine[end]),
                    pyramids: ends.map(|end| &self.pyramids[end]),
                }
            })
            .collect()
    }
}
