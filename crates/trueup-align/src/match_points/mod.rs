//! Where the vertices of one photograph's grid appear in another: the data of the alignment energy.
//!
//! # Source
//! Chen and Chuang, "Natural image stitching with the global similarity prior" (2016), section 3.1: grid vertices
//! carried by local homographies replace the feature matches, because they cover the overlap uniformly.

mod residual;

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};

use residual::{CameraResidual, MAX_DEVIATION};

use crate::cameras::{CameraTransfer, Cameras};
use crate::evidence::{self, FULL_PX, NEGLIGIBLE_SHARE};
use crate::moving_dlt::{self, MovingDlt};

/// Matches that fix a homography.
const FIXING_MATCHES: f64 = 4.0;

/// The vertices of photograph `from`'s grid carried into photograph `to` (working pixels).
#[derive(Debug, Clone, PartialEq)]
pub struct OverlapWarp {
    /// Index of the photograph whose grid it is.
    pub from: usize,
    /// Index of the photograph it is carried into.
    pub to: usize,
    /// For every vertex of `from`'s grid, row-major: its place in `to`, or `None` outside the overlap.
    pub vertices: Vec<Option<[f64; 2]>>,
}

impl OverlapWarp {
    /// Where a pixel of photograph `from` is in `to`, by the vertices of `grid` around it: interpolated, or at the
    /// overlap's border moved like the nearest vertex that is carried. `None` outside the overlap.
    pub fn at(&self, grid: &GridMesh, point: Vector2<f64>) -> Option<Vector2<f64>> {
        let (corners, shares) = grid.bilinear(point);
        let places = corners.map(|corner| self.vertices.get(corner).copied().flatten().map(Vector2::from));
        if let [Some(a), Some(b), Some(c), Some(d)] = places {
            return Some(a * shares[0] + b * shares[1] + c * shares[2] + d * shares[3]);
        }
        let known = corners
            .iter()
            .zip(shares)
            .zip(places)
            .filter_map(|((corner, share), place)| Some((share, place? + point - grid.source(*corner))));
        known.max_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, place)| place)
    }
}

trueup_core::choice! {
    /// How a grid vertex is carried into another photograph.
    pub enum TransferModel {
        /// The cameras' transfer, corrected by the matches' local deviation from it; under parallax, as far as
        /// neighboring matches agree that the cameras are wrong, a homography fitted to the matches around the vertex.
        CameraResidual = "camera-residual",
        /// A homography fitted to the matches around the vertex (APAP), as published.
        MovingDlt = "moving-dlt",
    }
}

trueup_core::options! {
    /// How the overlap of two photographs is sampled.
    pub struct MatchPointOptions("match_points") {
        /// How a grid vertex is carried into another photograph. Choose the moving DLT to compare with published
        /// results, or for photographs whose cameras do more than turn.
        model: TransferModel = TransferModel::CameraResidual, Allowed::Any, "";
    }
}

/// Carries the grid of each photograph of every pair into the other: two warps a pair, a to b first.
///
/// `grids` are the undeformed grids of the photographs. Needs the pairs' inliers and homographies.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub fn run(
    frames: &[WorkingFrame],
    grids: &[GridMesh],
    cameras: &Cameras,
    pairs: &[PairMatches],
    options: &MatchPointOptions,
    context: &StageContext,
) -> Result<Vec<OverlapWarp>> {
    const STAGE: &str = "match points";
    context.progress().begin(STAGE, pairs.len() as u64);
    let warps: Vec<[OverlapWarp; 2]> = pairs
        .par_iter()
        .map(|pair| {
            context.check_cancelled()?;
            let points_a: Vec<Vector2<f64>> = pair.inliers.iter().map(|one| Vector2::from(one.in_a)).collect();
            let points_b: Vec<Vector2<f64>> = pair.inliers.iter().map(|one| Vector2::from(one.in_b)).collect();
            let b_from_a = pair.b_from_a.as_ref().map(Homography::from_rows);
            let a_from_b = b_from_a.and_then(|homography| homography.inverse());
            let model = options.model;
            let direction = |from: usize, to: usize, source: &[_], target: &[_], global: Option<Homography>| {
                let cameras = cameras.transfer(from, to);
                let transfer = Transfer { cameras, source, target, global, model };
                let vertices = transfer.carry(&grids[from], &frames[to]);
                OverlapWarp { from, to, vertices }
            };
            // Side by side, so that no core is left waiting for the last pair.
            let (there, back) = rayon::join(
                || direction(pair.a, pair.b, &points_a, &points_b, b_from_a),
                || direction(pair.b, pair.a, &points_b, &points_a, a_from_b),
            );
            context.progress().advance(STAGE, 1);
            Ok([there, back])
        })
        .collect::<Result<_>>()?;
    context.progress().finish(STAGE);
    Ok(warps.into_iter().flatten().collect())
}

/// One direction of a pair.
struct Transfer<'a> {
    cameras: CameraTransfer<'a>,
    source: &'a [Vector2<f64>],
    target: &'a [Vector2<f64>],
    global: Option<Homography>,
    model: TransferModel,
}

impl Transfer<'_> {
    fn carry(&self, grid: &GridMesh, frame: &WorkingFrame) -> Vec<Option<[f64; 2]>> {
        let inside = |place: Vector2<f64>| frame.contains(place.x, place.y).then_some([place.x, place.y]);
        match self.model {
            TransferModel::CameraResidual => {
                let places = self.by_cameras_and_matches(grid, frame);
                places.into_iter().map(|place| place.and_then(inside)).collect()
            }
            TransferModel::MovingDlt => {
                let by_matches = self.by_matches(frame);
                (0..grid.len()).map(|vertex| by_matches(grid.source(vertex)).and_then(inside)).collect()
            }
        }
    }

    /// By the cameras, corrected, where the photographs were taken from one point, and by the matches where they were
    /// not: the mean of both, weighed by how far neighboring matches agree that the cameras are wrong.
    ///
    /// The noise of matches has nothing in common: photographs taken from one point keep the cameras' consistency.
    /// Where the cameras are wrong and the matches far, nothing is known: a vertex is carried if the matches around it
    /// count for [`FIXING_MATCHES`] times the share of what they say, and no farther from where the cameras have it
    /// than any match lies from there: what goes beyond all matches was not told by them.
    fn by_cameras_and_matches(&self, grid: &GridMesh, frame: &WorkingFrame) -> Vec<Option<Vector2<f64>>> {
        let cameras = CameraResidual::new(self.cameras, self.source, self.target);
        let by_cameras = (0..grid.len()).map(|vertex| cameras.at(grid.source(vertex)));
        let share = evidence::share(cameras.common_square(), FULL_PX);
        if share <= NEGLIGIBLE_SHARE {
            return by_cameras.collect();
        }
        // Where the matches determine no homography the cameras alone must do.
        let by_matches = self.by_matches(frame);
        let farthest = cameras.largest_deviation();
        let mean = |(vertex, camera): (usize, Option<Vector2<f64>>)| {
            let (at, camera) = (grid.source(vertex), camera?);
            let is_told = moving_dlt::are_told_around(self.source, at, FIXING_MATCHES * share);
            let told = is_told.then(|| by_matches(at).map_or(camera, |matches| camera.lerp(&matches, share)));
            told.filter(|told| (told - camera).norm() <= farthest)
        };
        by_cameras.enumerate().map(mean).collect()
    }

    /// By moving DLT, as published: where a point of the photograph is in the other.
    fn by_matches(&self, frame: &WorkingFrame) -> impl Fn(Vector2<f64>) -> Option<Vector2<f64>> {
        let known = self.global.zip(MovingDlt::new(self.source, self.target));
        let limit = MAX_DEVIATION * frame.diagonal();
        let frame = *frame;
        move |vertex: Vector2<f64>| {
            let (global, model) = known.as_ref()?;
            let expected = global.apply(vertex);
            // Vertices that the global homography sees far outside need no local one.
            let near = (-limit..=frame.width + limit).contains(&expected.x)
                && (-limit..=frame.height + limit).contains(&expected.y)
                && global.denominator(vertex) > 0.0;
            if !near {
                return None;
            }
            let place = model.at(vertex).unwrap_or(*global).apply(vertex);
            ((place - expected).norm() <= limit).then_some(place)
        }
    }
}

#[cfg(test)]
mod tests;
