//! Bundle adjustment: rotations and focal lengths that bring all matches together, by Levenberg-Marquardt on block
//! normal equations.
//!
//! # Source
//! Brown and Lowe (2007), equations 14 to 18: both directions of every match, Huber loss.
//!
//! # Departures
//! The unknown of a focal length is its logarithm, so that steps are relative and the sign is safe.

use faer::linalg::solvers::Solve;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::{Result, StageContext};

use super::observations::{Observations, PairObservations};
use super::pair_cost::{LOCAL, PairTerm, pair_cost};
use super::prior::CameraPrior;

/// Most iterations of one pass; it settles long before, unless the data contradict themselves.
const MAX_ITERATIONS: usize = 100;
/// Damping at the start of a pass, relative to the diagonal of the normal matrix.
const FIRST_DAMPING: f64 = 1e-4;
/// Damping beyond which no step is tried any more.
const LARGEST_DAMPING: f64 = 1e12;
/// Relative decrease of the cost below which a pass has settled.
const SETTLED: f64 = 1e-8;
/// Standard deviation of an estimated start value of the focal length, relative: it only keeps a focal length that the
/// matches leave open from running away.
const ESTIMATED_FOCAL_SD: f64 = 0.3;
/// A focal length within this factor of the shortest believed one was stopped there.
const STOPPED_SHORT: f64 = 1.001;

/// The state being refined.
#[derive(Debug, Clone)]
pub(super) struct Parameters {
    pub focal_px: Vec<f64>,
    pub rotations: Vec<Matrix3<f64>>,
}

impl Parameters {
    /// The cameras of this state.
    pub(super) fn cameras(&self, priors: &[CameraPrior]) -> Vec<Camera> {
        (0..priors.len()).map(|k| priors[k].camera(self.focal_px[k], &self.rotations[k])).collect()
    }
}

/// Which unknown scales which photograph's focal length; `None` holds it fixed.
pub(super) struct FocalModel {
    pub parameter_of: Vec<Option<usize>>,
    pub parameters: usize,
}

impl FocalModel {
    /// One unknown per camera group.
    pub(super) fn shared(priors: &[CameraPrior]) -> Self {
        let mut groups: Vec<usize> = priors.iter().map(|prior| prior.camera_group).collect();
        groups.sort_unstable();
        groups.dedup();
        let parameter_of = priors.iter().map(|prior| groups.binary_search(&prior.camera_group).ok()).collect();
        Self { parameter_of, parameters: groups.len() }
    }

    /// One unknown per photograph.
    pub(super) fn per_photograph(photographs: usize) -> Self {
        Self { parameter_of: (0..photographs).map(Some).collect(), parameters: photographs }
    }

    /// No unknowns: focal lengths stay as they are.
    pub(super) fn fixed(photographs: usize) -> Self {
        Self { parameter_of: vec![None; photographs], parameters: 0 }
    }
}

/// The sum of squares that is minimized over [`Parameters`].
pub(super) struct BundleAdjustment<'a> {
    pub priors: &'a [CameraPrior],
    pub observations: &'a Observations,
    /// What the focal lengths are drawn towards, working pixels.
    pub start_focal_px: Vec<f64>,
    /// The photograph whose rotation is fixed.
    pub reference: usize,
    /// Standard deviation, relative, of a start focal length that comes from metadata.
    pub known_focal_sd: f64,
}

impl BundleAdjustment<'_> {
    /// Refines `parameters` until the cost settles; `huber_px` bounds the influence of a single match.
    pub(super) fn minimize(
        &self,
        mut parameters: Parameters,
        model: &FocalModel,
        huber_px: f64,
        context: &StageContext,
    ) -> Result<Parameters> {
        let mut cost = self.cost(&parameters, model, huber_px);
        let mut damping = FIRST_DAMPING;
        for _ in 0..MAX_ITERATIONS {
            context.check_cancelled()?;
            let (normal, gradient) = self.normal_equations(&parameters, model, huber_px);
            let mut decrease = 0.0;
            while damping < LARGEST_DAMPING {
                let Some(step) = solve_damped(&normal, &gradient, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let moved = self.moved(&parameters, model, &step);
                let moved_cost = self.cost(&moved, model, huber_px);
                if moved_cost < cost {
                    decrease = (cost - moved_cost) / cost;
                    (parameters, cost) = (moved, moved_cost);
                    damping = (damping * 0.1).max(f64::EPSILON);
                    break;
                }
                damping *= 10.0;
            }
            if decrease < SETTLED {
                break;
            }
        }
        Ok(parameters)
    }

    /// Whether the solution can be used: finite, and no focal length at the short end of its range. (At the long end
    /// the photographs are merely close to affine, which is harmless.)
    pub(super) fn is_sound(&self, parameters: &Parameters) -> bool {
        parameters.rotations.iter().all(|rotation| rotation.iter().all(|entry| entry.is_finite()))
            && parameters.focal_px.iter().zip(self.priors).all(|(&focal_px, prior)| {
                focal_px.is_finite() && focal_px > STOPPED_SHORT * prior.believable_focal_px(0.0)
            })
    }

    fn unknowns(&self, model: &FocalModel) -> usize {
        3 * self.priors.len() + model.parameters
    }

    /// Columns of a pair's local unknowns in the global system; `None` is held fixed. The reference photograph's
    /// rotation is fixed: it is the gauge.
    fn columns(&self, pair: &PairObservations, model: &FocalModel) -> [Option<usize>; LOCAL] {
        let rotation = |photograph: usize, axis: usize| (photograph != self.reference).then_some(3 * photograph + axis);
        let focal = |photograph: usize| model.parameter_of[photograph].map(|k| 3 * self.priors.len() + k);
        std::array::from_fn(|local| match local {
            0..3 => rotation(pair.a, local),
            3..6 => rotation(pair.b, local - 3),
            6 => focal(pair.a),
            _ => focal(pair.b),
        })
    }

    /// Pull of the focal lengths towards their start values: (ln f - ln f0) / sd, one per photograph with a free one.
    fn focal_prior(&self, parameters: &Parameters, model: &FocalModel) -> Vec<(usize, f64, f64)> {
        (0..self.priors.len())
            .filter_map(|k| {
                let column = 3 * self.priors.len() + model.parameter_of[k]?;
                let known = self.priors[k].focal_px.is_some();
                let sd = if known { self.known_focal_sd } else { ESTIMATED_FOCAL_SD };
                Some((column, (parameters.focal_px[k] / self.start_focal_px[k]).ln() / sd, 1.0 / sd))
            })
            .collect()
    }

    fn cost(&self, parameters: &Parameters, model: &FocalModel, huber_px: f64) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let costs: Vec<f64> =
            self.observations.pairs.par_iter().map(|pair| pair_cost(&cameras, pair, huber_px)).collect();
        let prior: f64 = self.focal_prior(parameters, model).iter().map(|(_, residual, _)| residual * residual).sum();
        costs.iter().sum::<f64>() + prior
    }

    fn normal_equations(
        &self,
        parameters: &Parameters,
        model: &FocalModel,
        huber_px: f64,
    ) -> (faer::Mat<f64>, faer::Mat<f64>) {
        let cameras = parameters.cameras(self.priors);
        let unknowns = self.unknowns(model);
        let mut normal = faer::Mat::<f64>::zeros(unknowns, unknowns);
        let mut gradient = faer::Mat::<f64>::zeros(unknowns, 1);
        let terms: Vec<PairTerm> =
            self.observations.pairs.par_iter().map(|pair| PairTerm::new(&cameras, pair, huber_px)).collect();
        for (pair, term) in self.observations.pairs.iter().zip(&terms) {
            let columns = self.columns(pair, model);
            for (local_row, row) in columns.iter().enumerate() {
                let Some(row) = *row else { continue };
                gradient[(row, 0)] += term.gradient[local_row];
                for (local_column, column) in columns.iter().enumerate() {
                    if let Some(column) = *column {
                        normal[(row, column)] += term.normal[(local_row, local_column)];
                    }
                }
            }
        }
        for (column, residual, slope) in self.focal_prior(parameters, model) {
            normal[(column, column)] += slope * slope;
            gradient[(column, 0)] += slope * residual;
        }
        (normal, gradient)
    }

    fn moved(&self, parameters: &Parameters, model: &FocalModel, step: &faer::Mat<f64>) -> Parameters {
        let mut moved = parameters.clone();
        for k in 0..self.priors.len() {
            let turn = Vector3::new(step[(3 * k, 0)], step[(3 * k + 1, 0)], step[(3 * k + 2, 0)]);
            moved.rotations[k] = nearest_rotation(&(exp_rotation(&turn) * parameters.rotations[k]));
            if let Some(parameter) = model.parameter_of[k] {
                let stretched = parameters.focal_px[k] * step[(3 * self.priors.len() + parameter, 0)].exp();
                moved.focal_px[k] = self.priors[k].believable_focal_px(stretched);
            }
        }
        moved
    }
}

/// Solves (N + damping diag N) step = -gradient; unknowns without any data stay where they are. `None` if not positive
/// definite or not finite.
fn solve_damped(normal: &faer::Mat<f64>, gradient: &faer::Mat<f64>, damping: f64) -> Option<faer::Mat<f64>> {
    let mut damped = normal.clone();
    for k in 0..damped.nrows() {
        let diagonal = damped[(k, k)];
        damped[(k, k)] = if diagonal > 0.0 { diagonal * (1.0 + damping) } else { 1.0 };
    }
    let factor = damped.llt(faer::Side::Lower).ok()?;
    let step = factor.solve(-gradient);
    (0..step.nrows()).all(|k| step[(k, 0)].is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::PointMatch;
    use trueup_core::source::WorkingFrame;

    use super::*;

    /// The analytic gradient of the quadratic cost must be that of finite differences.
    #[test]
    fn gradient_matches_finite_differences() {
        let frame = WorkingFrame { width: 640.0, height: 480.0, working_from_full: 1.0 };
        let priors: Vec<CameraPrior> =
            [0, 1].map(|group| CameraPrior { frame, focal_px: None, camera_group: group }).to_vec();
        let matches = vec![
            PointMatch { in_a: [400.0, 200.0], in_b: [180.0, 260.0] },
            PointMatch { in_a: [520.0, 410.0], in_b: [300.0, 440.0] },
        ];
        let observations = Observations { pairs: vec![PairObservations { a: 0, b: 1, matches }] };
        let problem = BundleAdjustment {
            priors: &priors,
            observations: &observations,
            start_focal_px: vec![500.0, 520.0],
            reference: 0,
            known_focal_sd: 0.1,
        };
        let model = FocalModel::per_photograph(2);
        let at = Parameters {
            focal_px: vec![510.0, 505.0],
            rotations: vec![Matrix3::identity(), exp_rotation(&Vector3::new(0.05, -0.35, 0.1))],
        };
        let huge = 1e9;
        let (_, gradient) = problem.normal_equations(&at, &model, huge);
        for unknown in 3..problem.unknowns(&model) {
            let shifted = |amount: f64| {
                let mut step = faer::Mat::<f64>::zeros(problem.unknowns(&model), 1);
                step[(unknown, 0)] = amount;
                problem.cost(&problem.moved(&at, &model, &step), &model, huge)
            };
            let step = 1e-6;
            let numeric = (shifted(step) - shifted(-step)) / (2.0 * step);
            // The cost is the sum of squares; its gradient is twice J^T r.
            let analytic = 2.0 * gradient[(unknown, 0)];
            assert!((numeric - analytic).abs() < 1e-4 * (1.0 + analytic.abs()), "{unknown}: {numeric} {analytic}");
        }
    }
}
