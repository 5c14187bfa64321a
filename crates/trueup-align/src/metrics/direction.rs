//! Global direction inconsistency (GDIC): how differently the photographs are turned from what their cameras say.

use geo::{ConvexHull, MultiPoint};
use nalgebra::Vector2;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;

/// Clockwise rotation of the similarity that maps a grid best onto its target, radians.
pub fn best_rotation(mesh: &GridMesh) -> f64 {
    let defined: Vec<usize> = (0..mesh.len()).filter(|&vertex| mesh.is_defined(vertex)).collect();
    let count = defined.len() as f64;
    let source: Vec<Vector2<f64>> = defined.iter().map(|&vertex| mesh.source(vertex)).collect();
    let target: Vec<Vector2<f64>> = defined.iter().map(|&vertex| Vector2::from(mesh.target[vertex])).collect();
    let (source_mean, target_mean) =
        (source.iter().sum::<Vector2<f64>>() / count, target.iter().sum::<Vector2<f64>>() / count);
    let (mut cross, mut dot) = (0.0, 0.0);
    for (from, to) in source.iter().zip(&target) {
        cross += (from - source_mean).perp(&(to - target_mean));
        dot += (from - source_mean).dot(&(to - target_mean));
    }
    cross.atan2(dot)
}

/// kappa_i: rotation of the smallest rectangle around a deformed photograph, radians.
///
/// # Departures
/// A rectangle's rotation is defined up to quarter turns; the one nearest to [`best_rotation`] is meant.
pub fn rectangle_rotation(mesh: &GridMesh) -> f64 {
    use std::f64::consts::FRAC_PI_2;
    let defined = mesh.target.iter().filter(|place| place.iter().all(|coordinate| coordinate.is_finite()));
    let points: MultiPoint<f64> = defined.map(|&[x, y]| (x, y)).collect::<Vec<_>>().into();
    let hull: Vec<Vector2<f64>> =
        points.convex_hull().exterior().points().map(|point| Vector2::new(point.x(), point.y())).collect();
    let mut smallest = (f64::INFINITY, 0.0);
    for edge in hull.windows(2) {
        let Some(along) = (edge[1] - edge[0]).try_normalize(f64::MIN_POSITIVE) else { continue };
        let across = Vector2::new(-along.y, along.x);
        let extent = |axis: Vector2<f64>| {
            let (low, high) = hull.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
                (low.min(point.dot(&axis)), high.max(point.dot(&axis)))
            });
            high - low
        };
        let area = extent(along) * extent(across);
        if area < smallest.0 {
            smallest = (area, along.y.atan2(along.x));
        }
    }
    let expected = best_rotation(mesh);
    smallest.1 + FRAC_PI_2 * ((expected - smallest.1) / FRAC_PI_2).round()
}

/// By how much each photograph is turned differently from `reference` than its true angle says, radians in [-pi, pi):
/// (rotation_i - rotation_r) - (gamma_i - gamma_r). `None` with fewer than two photographs or without the reference.
///
/// With [`rectangle_rotation`]s these are the terms of the paper's GDIC, with [`best_rotation`]s those of its variant
/// without the rectangle, and with the prior's own angles the error of the prior before the mesh. `gammas` are the true
/// angles gamma_i in the photographs between their downward axes and the world's vertical, radians: the clockwise turns
/// that stand them upright.
pub fn relative_turns(rotations: &[f64], gammas: &[f64], reference: usize) -> Option<Vec<f64>> {
    if rotations.len() < 2 || rotations.len() != gammas.len() || reference >= rotations.len() {
        return None;
    }
    let deviation = |k: usize| rotations[k] - gammas[k];
    Some((0..rotations.len()).map(|k| wrap_angle(deviation(k) - deviation(reference))).collect())
}

/// The paper's GDIC, of [`rectangle_rotation`]s: mean of |[`relative_turns`]| over the photographs but `reference`,
/// radians; `None` where those are.
///
/// # Source
/// VPG equation 14.
pub fn mean_relative_turn(rotations: &[f64], gammas: &[f64], reference: usize) -> Option<f64> {
    let turns = relative_turns(rotations, gammas, reference)?;
    let sum: f64 = turns.iter().map(|turn| turn.abs()).sum();
    Some(sum / (turns.len() - 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turned(angle: f64) -> GridMesh {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        let (sine, cosine) = angle.sin_cos();
        mesh.target = (0..mesh.len())
            .map(|vertex| mesh.source(vertex))
            .map(|p| [cosine * p.x - sine * p.y, sine * p.x + cosine * p.y])
            .collect();
        mesh
    }

    fn global_direction_inconsistency(meshes: &[GridMesh], gammas: &[f64], reference: usize) -> Option<f64> {
        let rotations: Vec<f64> = meshes.iter().map(rectangle_rotation).collect();
        mean_relative_turn(&rotations, gammas, reference)
    }

    #[test]
    fn too_few_photographs_have_no_figure() {
        assert!(global_direction_inconsistency(&[turned(0.1)], &[0.1], 0).is_none());
        assert!(global_direction_inconsistency(&[turned(0.1), turned(0.2)], &[0.1], 0).is_none());
    }

    #[test]
    fn one_photograph_off_by_two_degrees_shows() {
        let off = 2.0_f64.to_radians();
        let meshes = [turned(0.1), turned(0.3 + off), turned(-0.2)];
        let figure = global_direction_inconsistency(&meshes, &[0.1, 0.3, -0.2], 0).expect("three photographs");
        assert!((figure - off / 2.0).abs() < 1e-9);
    }

    proptest! {
        /// A6: photographs turned by their true angles have no inconsistency.
        #[test]
        fn true_turns_have_none(a in -3.1..3.1_f64, b in -3.1..3.1_f64) {
            let figure = global_direction_inconsistency(&[turned(a), turned(b)], &[a, b], 1).expect("two photographs");
            prop_assert!(figure < 1e-9);
        }
    }
}
