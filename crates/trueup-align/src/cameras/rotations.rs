//! Start values for rotations: pairwise fits, then averaging over the graph.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{exp_rotation, log_rotation, nearest_rotation};
use trueup_core::matches::{PairMatches, PointMatch};

use super::intrinsics::InitialIntrinsics;
use super::observations::Observations;
use super::prior::CameraPrior;
use crate::stitch_graph::StitchGraph;

/// The rotation from camera a's frame to camera b's that fits the matched bearings best (Wahba's problem, solved by the
/// polar factor of the correlation matrix).
///
/// # Departures
/// The specification fits a DLT matrix first; fitting the rotation itself needs two matches instead of four and cannot
/// flip.
pub(super) fn fit_rotation(a: &Camera, b: &Camera, matches: &[PointMatch]) -> Matrix3<f64> {
    let correlation = matches.iter().fold(Matrix3::zeros(), |sum, one| {
        let from = a.bearing(Vector2::from(one.in_a)).normalize();
        let to = b.bearing(Vector2::from(one.in_b)).normalize();
        sum + to * from.transpose()
    });
    nearest_rotation(&correlation)
}

/// Rotation of camera j seen from camera i: `R_j R_i^T`.
pub(super) fn relative_rotation(first: &Matrix3<f64>, second: &Matrix3<f64>) -> Matrix3<f64> {
    second * first.transpose()
}

/// `R_b R_a^T` of every pair.
pub(super) fn relative_rotations(
    priors: &[CameraPrior],
    pairs: &[&PairMatches],
    observations: &Observations,
    intrinsics: &InitialIntrinsics,
) -> Vec<Matrix3<f64>> {
    let InitialIntrinsics { focal_px, lenses } = intrinsics;
    pairs
        .iter()
        .zip(&observations.pairs)
        .map(|(pair, observed)| {
            let a = lenses[pair.a].on(priors[pair.a].unturned_camera(focal_px[pair.a]));
            let b = lenses[pair.b].on(priors[pair.b].unturned_camera(focal_px[pair.b]));
            fit_rotation(&a, &b, &observed.matches)
        })
        .collect()
}

/// Rotations that agree with all relative ones as well as possible: the spanning tree gives a start, then every
/// rotation moves to the robust mean of what its neighbors predict until nothing moves.
///
/// # Source
/// Hartley, Aftab and Trumpf, "L1 rotation averaging using the Weiszfeld algorithm" (2011); the weights 1/(sd + error)
/// keep the L1 mean's robustness.
pub(super) fn average(
    graph: &StitchGraph,
    pairs: &[&PairMatches],
    relative: &[Matrix3<f64>],
    reference: usize,
) -> Vec<Matrix3<f64>> {
    const SWEEPS: usize = 60;
    const SETTLED: f64 = 1e-6;
    /// Errors below this (radians) are noise and are averaged plainly.
    const NOISE: f64 = 2e-3;
    let count = graph.photographs;
    let mut neighbors: Vec<Vec<(usize, Matrix3<f64>, f64)>> = vec![Vec::new(); count];
    for (pair, rotation) in pairs.iter().zip(relative) {
        let weight = pair.agreeing as f64;
        neighbors[pair.b].push((pair.a, *rotation, weight));
        neighbors[pair.a].push((pair.b, rotation.transpose(), weight));
    }
    let mut rotations = vec![Matrix3::identity(); count];
    for component in &graph.components {
        let root = if component.contains(&reference) { reference } else { component[0] };
        for step in graph.spanning_tree(component, root) {
            if let Some((_, turn, _)) = neighbors[step.child].iter().find(|(other, ..)| *other == step.parent) {
                rotations[step.child] = turn * rotations[step.parent];
            }
        }
    }
    for _ in 0..SWEEPS {
        let mut largest: f64 = 0.0;
        for k in 0..count {
            let (mut step, mut total) = (Vector3::zeros(), 0.0);
            for (other, turn, weight) in &neighbors[k] {
                let error = log_rotation(&relative_rotation(&rotations[k], &(turn * rotations[*other])));
                let weight = weight / (NOISE + error.norm());
                step += error * weight;
                total += weight;
            }
            if total > 0.0 {
                step /= total;
                rotations[k] = nearest_rotation(&(exp_rotation(&step) * rotations[k]));
                largest = largest.max(step.norm());
            }
        }
        if largest < SETTLED {
            break;
        }
    }
    let back = rotations[reference].transpose();
    rotations.iter().map(|rotation| rotation * back).collect()
}
