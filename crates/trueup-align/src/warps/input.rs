//! What warp models are made from.

use nalgebra::{Matrix2, Matrix3, Vector2};
use trueup_core::camera::Camera;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result};

use super::options::WarpOptions;
use crate::match_points::OverlapWarp;

/// The stage's name in progress and generators.
pub(super) const STAGE: &str = WarpOptions::STAGE;

/// What a warp model is made from. Photographs are counted 0..N; `cameras`, `frames`, `grids`, `match_grids`, `names`
/// and `seeds` have N entries.
#[derive(Debug, Clone, Copy)]
pub struct WarpInput<'a> {
    /// Cameras in working pixels, in any common world frame.
    pub cameras: &'a [Camera],
    /// Each photograph's working frame.
    pub frames: &'a [WorkingFrame],
    /// Undeformed grids, as fine as they are to be delivered.
    pub grids: &'a [GridMesh],
    /// The pairs whose overlaps are to meet, with their matches; they connect all photographs.
    pub pairs: &'a [PairMatches],
    /// The grids whose vertices `overlaps` carry, of the same photographs.
    pub match_grids: &'a [GridMesh],
    /// Match points, by which the alignment is measured.
    pub overlaps: &'a [OverlapWarp],
    /// Names of the photographs, for messages.
    pub names: &'a [String],
    /// For each photograph a number that does not depend on the order of the photographs; random choices derive from
    /// it.
    pub seeds: &'a [u64],
    /// The photograph that stays in place in models that have such a one.
    pub reference: usize,
    /// The rotation that levels the cameras' world: y down, the mean viewing direction above z.
    pub level_from_world: Matrix3<f64>,
    /// Direction of the cut in the level world where the photographs go all the way round, radians from z towards x.
    pub cut_yaw: Option<f64>,
    /// Clockwise turn in radians that the user wants of the whole panorama.
    pub turn: f64,
}

impl WarpInput<'_> {
    /// Where a pinhole of the camera's focal length and principal point shows what its photograph shows at `pixel`:
    /// what homographies are of. Not finite for what no pinhole sees.
    pub(super) fn straight(&self, photograph: usize, pixel: Vector2<f64>) -> Vector2<f64> {
        let camera = &self.cameras[photograph];
        if camera.lens.is_pinhole() {
            return pixel;
        }
        let bearing = camera.bearing(pixel);
        match bearing.z > 0.0 {
            true => bearing.xy() / bearing.z * camera.focal_px + Vector2::from(camera.principal_point),
            false => Vector2::repeat(f64::NAN),
        }
    }

    /// How [`Self::straight`] moves with the pixel; `None` for what no pinhole sees.
    pub(super) fn straight_jacobian(&self, photograph: usize, pixel: Vector2<f64>) -> Option<Matrix2<f64>> {
        let camera = &self.cameras[photograph];
        if camera.lens.is_pinhole() {
            return Some(Matrix2::identity());
        }
        let bearing = camera.bearing(pixel);
        let by_pixel = camera.projection_derivatives(bearing)?.bearing_by_pixel().filter(|_| bearing.z > 0.0)?;
        // Of x / z and y / z.
        let aside = bearing.xy() / bearing.z;
        let by_pixel = by_pixel.fixed_rows::<2>(0) - aside * by_pixel.fixed_rows::<1>(2);
        Some(by_pixel * (camera.focal_px / bearing.z))
    }

    /// Refuses lists that do not fit each other.
    pub(super) fn check(&self) -> Result<()> {
        let count = self.grids.len();
        let lengths =
            [self.cameras.len(), self.frames.len(), self.match_grids.len(), self.names.len(), self.seeds.len()];
        let known = |photograph: usize| photograph < count;
        let whole = lengths.iter().all(|&length| length == count)
            && known(self.reference)
            && self.pairs.iter().all(|pair| known(pair.a) && known(pair.b) && pair.a != pair.b)
            && self.overlaps.iter().all(|overlap| known(overlap.from) && known(overlap.to));
        match whole {
            true => Ok(()),
            false => Err(Error::unsolvable(
                STAGE,
                "warp model",
                format!("cameras, frames, names, pairs or the reference do not fit {count} photographs"),
                "Give one entry per photograph.",
            )),
        }
    }
}
