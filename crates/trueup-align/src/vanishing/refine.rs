//! Refinement of a triad over SO(3) by iteratively reweighted least squares, and its covariance.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median};

use super::interpretation::InterpretationPlanes;
use super::options::VanishingOptions;

/// Iterations after which the refinement stops in any case.
const MAX_ITERATIONS: usize = 30;
/// Step in radians below which it has converged.
const CONVERGED: f64 = 1e-8;
/// Damping that keeps an axis without any segment where it is.
const DAMPING: f64 = 1e-9;
/// Scale of the robust (Geman-McClure) loss, degrees between a direction and a segment's interpretation plane.
const LOSS_SCALE_DEG: f64 = 1.5;
/// Largest such angle for a segment to be counted in a direction's cluster, degrees.
const CLUSTER_DEG: f64 = 6.0;
/// A triad after refinement.
#[derive(Debug, Clone)]
pub(crate) struct RefinedTriad {
    /// Columns are the directions in the camera frame; a rotation.
    pub triad: Matrix3<f64>,
    /// Sum over segments of w max(0, 1 - (sine / sin tolerance)^2).
    pub score: f64,
    /// Weighted normal matrix at the last step, divided by the mean weight of its segments.
    information: Matrix3<f64>,
    /// Robust standard deviation of the sines.
    residual_sd: f64,
}

impl RefinedTriad {
    /// Refines `start` on all segments.
    ///
    /// # Source
    /// Gauss-Newton for the right perturbation V exp([d]x) of r = n . v_k: dr/dd = e_k x (V^T n); Geman-McClure
    /// weights.
    pub(crate) fn refine(start: &Matrix3<f64>, planes: &InterpretationPlanes, options: &VanishingOptions) -> Self {
        let mut triad = nearest_rotation(start);
        let tolerance = options.tolerance_deg.to_radians().sin();
        let scale = LOSS_SCALE_DEG.to_radians().sin();
        for _ in 0..MAX_ITERATIONS {
            let normal_equations = NormalEquations::at(&triad, planes, tolerance, scale);
            let damped = normal_equations.matrix + Matrix3::identity() * DAMPING;
            let Some(step) = damped.try_inverse().map(|inverse| -inverse * normal_equations.gradient) else { break };
            triad = nearest_rotation(&(triad * exp_rotation(&step)));
            if step.norm() < CONVERGED {
                break;
            }
        }
        let last = NormalEquations::at(&triad, planes, tolerance, scale);
        Self {
            score: score(&triad, planes, tolerance),
            information: last.matrix / last.mean_weight(),
            residual_sd: last.residual_sd(),
            triad,
        }
    }

    /// The covariance in radians squared of d in V exp([d]x); infinite if the segments leave an axis free.
    pub(super) fn covariance(&self) -> Matrix3<f64> {
        let inverse = self.information.try_inverse();
        inverse.map_or(Matrix3::from_diagonal_element(f64::INFINITY), |inverse| {
            inverse * self.residual_sd * self.residual_sd
        })
    }

    /// For each of `line_count` segments the direction it belongs to, and the number of segments of each direction.
    pub(super) fn clusters(&self, planes: &InterpretationPlanes, line_count: usize) -> (Vec<Option<u8>>, [usize; 3]) {
        let limit = CLUSTER_DEG.to_radians().sin();
        let mut clusters = vec![None; line_count];
        let mut counts = [0; 3];
        for (normal, &index) in planes.normals.iter().zip(&planes.indices) {
            let (direction, sine) = nearest_direction(&self.triad, normal);
            if sine.abs() < limit {
                clusters[index] = Some(direction as u8);
                counts[direction] += 1;
            }
        }
        (clusters, counts)
    }
}

/// The direction most nearly in the plane, and the signed sine of the angle between them.
fn nearest_direction(triad: &Matrix3<f64>, normal: &Vector3<f64>) -> (usize, f64) {
    let sines = triad.tr_mul(normal);
    let direction = sines.iamin();
    (direction, sines[direction])
}

fn score(triad: &Matrix3<f64>, planes: &InterpretationPlanes, tolerance: f64) -> f64 {
    let supports = planes.normals.iter().zip(&planes.weights).map(|(normal, weight)| {
        let (_, sine) = nearest_direction(triad, normal);
        weight * (1.0 - (sine / tolerance).powi(2)).max(0.0)
    });
    supports.sum()
}

/// The weighted least-squares system at one triad.
struct NormalEquations {
    matrix: Matrix3<f64>,
    gradient: Vector3<f64>,
    total_weight: f64,
    sines: Vec<f64>,
}

impl NormalEquations {
    fn at(triad: &Matrix3<f64>, planes: &InterpretationPlanes, tolerance: f64, scale: f64) -> Self {
        let (matrix, gradient) = (Matrix3::zeros(), Vector3::zeros());
        let mut system = Self { matrix, gradient, total_weight: 0.0, sines: Vec::with_capacity(planes.len()) };
        for (normal, &line_weight) in planes.normals.iter().zip(&planes.weights) {
            let in_triad = triad.tr_mul(normal);
            let direction = in_triad.iamin();
            let sine = in_triad[direction];
            if sine.abs() >= tolerance {
                continue;
            }
            let jacobian = Vector3::ith(direction, 1.0).cross(&in_triad);
            let weight = line_weight / (1.0 + (sine / scale).powi(2)).powi(2);
            system.matrix += jacobian * jacobian.transpose() * weight;
            system.gradient += jacobian * (weight * sine);
            system.total_weight += weight;
            system.sines.push(sine.abs());
        }
        system
    }

    fn mean_weight(&self) -> f64 {
        if self.sines.is_empty() { 1.0 } else { self.total_weight / self.sines.len() as f64 }
    }

    fn residual_sd(&self) -> f64 {
        median(&mut self.sines.clone()).map_or(f64::INFINITY, |median| SD_PER_MEDIAN_MAGNITUDE * median)
    }
}
