//! Photometric alignment: the pixels of overlapping photographs themselves draw the grids together.
//!
//! # Source
//! After the photometric term of generalized content-preserving warps (Chen and others, 2018), reconstructed: direct
//! alignment as in Lucas and Kanade (1981), linear in the vertices of both grids, next to the energies of the mesh. The
//! averaged slope of both photographs is that of efficient second-order minimization (Benhimane and Malis, 2004).
//!
//! # Departures
//! Every number that is not an option's is a reconstruction; gain and bias of a cell come from means and standard
//! deviations instead of a regression.

mod cell;
mod colors;
mod equations;
mod options;
mod overlap;
mod pyramid;
mod sample;
mod sampler;

use rayon::prelude::*;
use trueup_core::{Result, StageContext};

use super::current_grids::CurrentGrids;
use super::normal_equations::NormalEquations;
use crate::evidence;
use crate::match_points::OverlapWarp;
use equations::OverlapEquations;
pub use options::PhotometricOptions;
use overlap::PhotometricOverlap;
pub use pyramid::GrayPyramid;
pub(super) use pyramid::LEVELS;

/// Overlaps whose equations are held in memory at a time.
const OVERLAPS_AT_A_TIME: usize = 32;

/// What photometric alignment looks at.
#[derive(Debug, Clone, Copy)]
pub struct PhotometricInput<'a> {
    /// The photographs' pyramids.
    pub pyramids: &'a [GrayPyramid],
    /// How.
    pub options: &'a PhotometricOptions,
}

impl PhotometricInput<'_> {
    /// Adds the equations of all overlaps, linearized around the current grids, at a level; gives the mean difference
    /// in gray levels. `shares` holds the share of its weight that every overlap has.
    pub(super) fn add(
        &self,
        equations: &mut NormalEquations,
        warps: &[OverlapWarp],
        grids: &CurrentGrids,
        level: usize,
        shares: &[f64],
        context: &StageContext,
    ) -> Result<f64> {
        let overlaps = self.overlaps(warps, grids);
        let (mut sum, mut count) = (0.0, 0.0);
        for (several, shares) in overlaps.chunks(OVERLAPS_AT_A_TIME).zip(shares.chunks(OVERLAPS_AT_A_TIME)) {
            context.check_cancelled()?;
            let found: Vec<OverlapEquations> = several
                .par_iter()
                .zip(shares)
                .map(|(overlap, &share)| overlap.equations(level, share * self.options.weight))
                .collect();
            for overlap in found {
                overlap.cells.iter().for_each(|cells| equations.add_cell_pairs(cells));
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
        grids: &CurrentGrids,
        context: &StageContext,
    ) -> Result<Vec<f64>> {
        context.check_cancelled()?;
        /// Misalignment, common to neighboring cells of an overlap, from which on its pixels weigh fully, panorama
        /// units per axis; with less their weight falls with its square.
        const FULL_PX: f64 = 0.5;
        let share = |overlap: &PhotometricOverlap| {
            // The smallest size first, which costs least: with all of its weight there is no more to be had.
            let mut share = 0.0_f64;
            for level in (0..LEVELS).rev() {
                share = share.max(evidence::share(overlap.common_square(level), FULL_PX));
                if share >= 1.0 {
                    break;
                }
            }
            share
        };
        Ok(self.overlaps(warps, grids).par_iter().map(share).collect())
    }

    /// Each overlap once: its pixels say the same from either side.
    fn overlaps<'a>(&'a self, warps: &'a [OverlapWarp], grids: &CurrentGrids<'a>) -> Vec<PhotometricOverlap<'a>> {
        warps
            .iter()
            .filter(|warp| warp.from < warp.to)
            .map(|warp| {
                let ends = [warp.from, warp.to];
                PhotometricOverlap {
                    warp,
                    solved: ends.map(|end| &grids.solved[end]),
                    fine: ends.map(|end| &grids.fine[end]),
                    pyramids: ends.map(|end| &self.pyramids[end]),
                }
            })
            .collect()
    }
}
