//! One homography per photograph, onto the plane of the reference.

use nalgebra::{Matrix3, Vector2};
use trueup_core::camera::Camera;
use trueup_core::geometry::Homography;
use trueup_core::matches::PointMatch;
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use super::deformed::deformed;
use super::input::{STAGE, WarpInput};
use super::limits::{MIN_DEPTH, farthest_angle, least_depth, refuse, with_depth};
use super::options::WarpModel;
use super::options::{HomographySource, WarpOptions};
use crate::stitch_graph::StitchGraph;

/// Places every photograph by its homography onto the reference's plane.
///
/// # Source
/// Szeliski, "Image alignment and stitching: a tutorial" (2006), sections 2.1 and 6.1.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions) -> Result<Vec<GridMesh>> {
    let homographies = onto(input, input.reference, options.homographies)?;
    let behind = |photograph: &usize| least_depth(&homographies[*photograph], input, *photograph) <= MIN_DEPTH;
    let widest = (0..homographies.len())
        .filter(behind)
        .max_by(|&a, &b| farthest_angle(input, a).total_cmp(&farthest_angle(input, b)));
    if let Some(photograph) = widest {
        return Err(refuse(WarpModel::Homography, input, photograph, "does not lie in front of the panorama's plane"));
    }
    let mesh = |photograph: usize| {
        let onto_plane = |point| homographies[photograph].apply(input.straight(photograph, point));
        deformed(&input.grids[photograph], onto_plane)
    };
    Ok((0..homographies.len()).map(mesh).collect())
}

/// For every photograph the homography onto the plane of photograph `target`, its denominator the depth.
pub(super) fn onto(input: &WarpInput<'_>, target: usize, source: HomographySource) -> Result<Vec<Homography>> {
    match source {
        HomographySource::Cameras => {
            let to = &input.cameras[target];
            Ok(input.cameras.iter().map(|from| between(from, to)).collect())
        }
        HomographySource::Pairs => chained(input, target),
    }
}

/// `K_to R_to R_from^T K_from^-1`: where the photograph of one camera appears in that of the other, both at one place.
fn between(from: &Camera, to: &Camera) -> Homography {
    let intrinsic = |camera: &Camera| {
        let ([x, y], f) = (camera.principal_point, camera.focal_px);
        (
            Matrix3::new(f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0),
            Matrix3::new(1.0 / f, 0.0, -x / f, 0.0, 1.0 / f, -y / f, 0.0, 0.0, 1.0),
        )
    };
    Homography(intrinsic(to).0 * to.rotation() * from.rotation().transpose() * intrinsic(from).1)
}

/// The homographies of the pairs, chained along the spanning tree of the strongest overlaps.
fn chained(input: &WarpInput<'_>, target: usize) -> Result<Vec<Homography>> {
    let count = input.grids.len();
    let graph = StitchGraph::new(count, input.pairs);
    let all: Vec<usize> = (0..count).collect();
    let mut onto_target: Vec<Option<Homography>> = vec![None; count];
    onto_target[target] = Some(Homography::identity());
    for step in graph.spanning_tree(&all, target) {
        let Some(parent) = onto_target[step.parent] else { continue };
        let to_parent = of_pair(input, step.child, step.parent)?;
        onto_target[step.child] = Some(parent.after(&to_parent));
    }
    onto_target
        .into_iter()
        .enumerate()
        .map(|(photograph, found)| found.ok_or_else(|| undetermined(input, photograph)))
        .collect()
}

/// The homography from photograph `from` to photograph `to` by their matches, its denominator the depth; of what
/// pinholes would show, where a lens bends.
fn of_pair(input: &WarpInput<'_>, from: usize, to: usize) -> Result<Homography> {
    let pair = input.pairs.iter().find(|pair| (pair.a, pair.b) == (from.min(to), from.max(to)));
    let are_pinholes = [from, to].iter().all(|&one| input.cameras[one].lens.is_pinhole());
    let b_from_a = pair.and_then(|pair| match pair.b_from_a.filter(|_| are_pinholes) {
        Some(rows) => Some(Homography::from_rows(&rows)),
        None => {
            let ends = |one: &PointMatch| {
                [(pair.a, one.in_a), (pair.b, one.in_b)].map(|(k, end)| input.straight(k, end.into()))
            };
            let is_seen = |ends: &[Vector2<f64>; 2]| ends.iter().flatten().all(|value| value.is_finite());
            let (in_a, in_b): (Vec<_>, Vec<_>) =
                pair.inliers.iter().map(ends).filter(is_seen).map(<(_, _)>::from).unzip();
            Homography::fit(&in_a, &in_b, None)
        }
    });
    let directed = if from < to { b_from_a } else { b_from_a.and_then(|homography| homography.inverse()) };
    directed
        .and_then(|found| with_depth(&found, input.cameras[from].focal_px, input.cameras[to].focal_px))
        .ok_or_else(|| undetermined(input, from))
}

/// The homography from one photograph to a neighbor, its denominator the depth.
pub(super) fn of_pair_or_cameras(
    input: &WarpInput<'_>,
    from: usize,
    to: usize,
    source: HomographySource,
) -> Result<Homography> {
    match source {
        HomographySource::Cameras => Ok(between(&input.cameras[from], &input.cameras[to])),
        HomographySource::Pairs => of_pair(input, from, to),
    }
}

/// The error for a photograph whose matches are too few or degenerate.
pub(super) fn undetermined(input: &WarpInput<'_>, photograph: usize) -> Error {
    Error::unsolvable(
        STAGE,
        &input.names[photograph],
        "its matches determine no homography",
        "Leave this photograph out, or choose another method.",
    )
}
