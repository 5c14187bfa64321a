//! Start values of focal lengths by the local homographies of all overlaps.
//!
//! # Source
//! Chen and Chuang, "Natural image stitching with the global similarity prior" (2016), section 3.3: more homographies
//! than one a pair tell more focal lengths, whose median is more robust.

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;
use trueup_core::statistics::median;

use super::homography_focal::{FocalLengths, focal_from_homography};
use super::prior::CameraPrior;
use crate::moving_dlt::MovingDlt;

/// Side of the cells at whose vertices homographies are asked, working pixels: that of the mesh as published.
const CELL_PX: f64 = 40.0;

/// For every photograph the median of the focal lengths, working pixels, that the local homographies from it and to it
/// tell; width and height together where none tells any, as the authors have it.
pub(super) fn local_focal_lengths(priors: &[CameraPrior], pairs: &[&PairMatches]) -> Vec<f64> {
    let of_pairs: Vec<[Vec<FocalLengths>; 2]> = pairs.par_iter().map(|pair| told_by(pair, priors)).collect();
    let mut told: Vec<Vec<f64>> = vec![Vec::new(); priors.len()];
    for (pair, [there, back]) in pairs.iter().zip(of_pairs) {
        for (from, to, lengths) in [(pair.a, pair.b, there), (pair.b, pair.a, back)] {
            told[from].extend(lengths.iter().map(|lengths| lengths.source));
            told[to].extend(lengths.iter().map(|lengths| lengths.target));
        }
    }
    let of_photograph = |(prior, told): (&CameraPrior, &mut Vec<f64>)| {
        prior.believable_focal_px(median(told).unwrap_or(prior.frame.width + prior.frame.height))
    };
    priors.iter().zip(&mut told).map(of_photograph).collect()
}

/// What the local homographies of a pair tell, from the first to the second photograph and back.
fn told_by(pair: &PairMatches, priors: &[CameraPrior]) -> [Vec<FocalLengths>; 2] {
    let points = |of: fn(&PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
        pair.inliers.iter().map(|one| Vector2::from(of(one))).collect()
    };
    let (in_a, in_b) = (points(|one| one.in_a), points(|one| one.in_b));
    let (frame_a, frame_b) = (&priors[pair.a].frame, &priors[pair.b].frame);
    [told_from(frame_a, &in_a, frame_b, &in_b), told_from(frame_b, &in_b, frame_a, &in_a)]
}

/// What the homographies around those vertices of one photograph tell that they carry into the other.
fn told_from(
    source: &WorkingFrame,
    points: &[Vector2<f64>],
    target: &WorkingFrame,
    places: &[Vector2<f64>],
) -> Vec<FocalLengths> {
    let Some(dlt) = MovingDlt::new(points, places) else { return Vec::new() };
    let grid = GridMesh::regular(source.width, source.height, CELL_PX);
    let at_vertex = |vertex: Vector2<f64>| {
        let local = dlt.at(vertex)?;
        let place = local.apply(vertex);
        let is_inside = target.contains(place.x, place.y);
        is_inside.then(|| focal_from_homography(&local, [source, target])).flatten()
    };
    (0..grid.len()).filter_map(|vertex| at_vertex(grid.source(vertex))).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;
    use crate::cameras::tests::joined;

    const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };

    /// Exact matches between two cameras of these focal lengths, `yaw_deg` apart.
    fn pair(a: usize, b: usize, focal_px: [f64; 2], yaw_deg: f64) -> PairMatches {
        let turn = rotation_about_y(yaw_deg.to_radians())
            * rotation_about_x(5_f64.to_radians())
            * rotation_about_z(3_f64.to_radians());
        let first = Camera::new(focal_px[0], FRAME.width, FRAME.height, &Matrix3::identity());
        let second = Camera::new(focal_px[1], FRAME.width, FRAME.height, &turn.transpose());
        let matched = (0..300).filter_map(|k| {
            let (u, v) = ((f64::from(k) * 0.618_034).fract(), (f64::from(k) * 0.754_877).fract());
            let point = Vector2::new(u * FRAME.width, v * FRAME.height);
            let place = first.transfer(&second, point).filter(|place| FRAME.contains(place.x, place.y))?;
            Some(PointMatch { in_a: point.into(), in_b: place.into() })
        });
        joined(a, b, matched.collect())
    }

    /// The cameras that matches were made with are told, each its own, and a photograph nothing is known of has width
    /// and height together.
    #[test]
    fn every_photograph_has_the_focal_length_of_its_overlaps() {
        let priors = [CameraPrior::unknown(FRAME, 0); 4];
        let pairs = [pair(0, 1, [700.0, 900.0], 20.0), pair(1, 2, [900.0, 1100.0], -17.0)];
        let lengths = local_focal_lengths(&priors, &pairs.iter().collect::<Vec<_>>());
        for (length, true_px) in lengths.iter().zip([700.0, 900.0, 1100.0, 1400.0]) {
            assert!((length - true_px).abs() < 1e-3 * true_px, "{lengths:?}");
        }
    }
}
