//! Hypotheses: a first direction from two segments, the other two by a turn about it.

use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt};
use trueup_core::geometry::orthonormal_complement;

use super::interpretation::InterpretationPlanes;
use super::options::VanishingOptions;

/// Sine of the angle between two interpretation planes below which they do not determine a direction.
const PARALLEL_PLANES: f64 = 1e-4;

/// Step of the second direction about the first, degrees.
const STEP_DEG: f64 = 2.0;
/// Segments, longest first, that hypotheses are scored on before the best are refined on all.
const SCORED_SEGMENTS: usize = 200;
/// Hypotheses that are refined.
const REFINED_HYPOTHESES: usize = 5;

/// The best-scored triads (columns are directions in the camera frame), best first; ties keep the order of the draws.
pub(super) fn best_hypotheses(
    planes: &InterpretationPlanes,
    options: &VanishingOptions,
    generator: &mut impl Rng,
) -> Vec<Matrix3<f64>> {
    let cumulative = cumulative_weights(&planes.weights);
    let mut scorer = Scorer::new(planes, options);
    let mut best: Vec<(f64, Matrix3<f64>)> = Vec::with_capacity(REFINED_HYPOTHESES + 1);
    for _ in 0..options.draws {
        let (a, b) = (draw(&cumulative, generator), draw(&cumulative, generator));
        let cross = planes.normals[a].cross(&planes.normals[b]);
        let norm = cross.norm();
        if norm < PARALLEL_PLANES {
            continue;
        }
        // One entry per first direction: its other turns lead to the same refined triad.
        let (score, triad) = scorer.best_turn(&(cross / norm));
        let place = best.partition_point(|entry| entry.0 >= score);
        best.insert(place, (score, triad));
        best.truncate(REFINED_HYPOTHESES);
    }
    best.into_iter().map(|(_, triad)| triad).collect()
}

pub(super) fn cumulative_weights(weights: &[f64]) -> Vec<f64> {
    weights
        .iter()
        .scan(0.0, |sum, weight| {
            *sum += weight;
            Some(*sum)
        })
        .collect()
}

/// An index drawn with probability proportional to its weight.
pub(super) fn draw(cumulative: &[f64], generator: &mut impl Rng) -> usize {
    let total = cumulative.last().copied().unwrap_or(0.0);
    let place = total * generator.random::<f64>();
    cumulative.partition_point(|&sum| sum <= place).min(cumulative.len().saturating_sub(1))
}

/// Scores the turns of a triad about its first direction: sum over segments of w max(0, 1 - (sine / sin tolerance)^2),
/// sine the smallest over the directions.
struct Scorer<'a> {
    planes: &'a InterpretationPlanes,
    count: usize,
    turns: Vec<(f64, f64)>,
    inverse_tolerance_squared: f64,
    /// Per segment: squared sine to the first direction, and components of the normal along the two complements.
    components: Vec<[f64; 3]>,
}

impl<'a> Scorer<'a> {
    fn new(planes: &'a InterpretationPlanes, options: &VanishingOptions) -> Self {
        let count = planes.len().min(SCORED_SEGMENTS);
        // A quarter turn suffices: the next quarter swaps the second and third direction.
        let steps = (90.0 / STEP_DEG).ceil().max(1.0) as usize;
        let turns = (0..steps).map(|k| (STEP_DEG * k as f64).to_radians().sin_cos()).collect();
        let sine = options.tolerance_deg.to_radians().sin();
        Self { planes, count, turns, inverse_tolerance_squared: 1.0 / (sine * sine), components: vec![[0.0; 3]; count] }
    }

    /// The best turn's score and triad.
    fn best_turn(&mut self, axis: &Vector3<f64>) -> (f64, Matrix3<f64>) {
        let (first, second) = orthonormal_complement(axis);
        for (component, normal) in self.components.iter_mut().zip(&self.planes.normals) {
            let along = normal.dot(axis);
            *component = [along * along, normal.dot(&first), normal.dot(&second)];
        }
        let mut best = (f64::NEG_INFINITY, (0.0, 1.0));
        for &(sine, cosine) in &self.turns {
            let mut score = 0.0;
            for (&[along, u, v], &weight) in self.components.iter().zip(&self.planes.weights[..self.count]) {
                let (x, y) = (cosine * u + sine * v, cosine * v - sine * u);
                let smallest = along.min(x * x).min(y * y);
                score += weight * (1.0 - smallest * self.inverse_tolerance_squared).max(0.0);
            }
            if score > best.0 {
                best = (score, (sine, cosine));
            }
        }
        let (sine, cosine) = best.1;
        let v2 = first * cosine + second * sine;
        (best.0, Matrix3::from_columns(&[*axis, v2, axis.cross(&v2)]))
    }
}
