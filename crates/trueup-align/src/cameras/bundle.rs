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
use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::{Result, StageContext};

use super::intrinsics::{FOCAL, IntrinsicsModel, LensState, standard_deviation};
use super::observations::{Observations, PairObservations};
use super::pair_cost::{LENS_LOCAL, PINHOLE_LOCAL, PairTerm, pair_cost};
use super::prior::CameraPrior;

/// Distance in working pixels beyond which the influence of a match grows only linearly, in the first pass: the start
/// values are that far off.
pub(super) const COARSE_HUBER_PX: f64 = 20.0;
/// The same in the final pass, working pixels: a few times the error of a match.
pub(super) const FINE_HUBER_PX: f64 = 2.0;
/// Most iterations of one pass; it settles long before, unless the data contradict themselves.
const MAX_ITERATIONS: usize = 100;
/// Damping at the start of a pass, relative to the diagonal of the normal matrix.
const FIRST_DAMPING: f64 = 1e-4;
/// Damping beyond which no step is tried any more.
const LARGEST_DAMPING: f64 = 1e12;
/// Relative decrease of the cost below which a pass has settled.
const SETTLED: f64 = 1e-8;
/// A focal length within this factor of the shortest believed one was stopped there.
const STOPPED_SHORT: f64 = 1.001;

/// The state being refined.
#[derive(Debug, Clone)]
pub(super) struct Parameters {
    pub focal_px: Vec<f64>,
    pub rotations: Vec<Matrix3<f64>>,
    pub lenses: Vec<LensState>,
}

impl Parameters {
    /// The cameras of this state.
    pub(super) fn cameras(&self, priors: &[CameraPrior]) -> Vec<Camera> {
        (0..priors.len()).map(|k| self.lenses[k].on(priors[k].camera(self.focal_px[k], &self.rotations[k]))).collect()
    }

    fn has_lens(&self) -> bool {
        self.lenses.iter().any(|lens| !lens.is_pinhole())
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
    /// How strongly: their standard deviations, relative.
    pub focal_sd: Vec<f64>,
}

impl BundleAdjustment<'_> {
    /// Refines `parameters` until the cost settles; `huber_px` bounds the influence of a single match.
    pub(super) fn minimize(
        &self,
        mut parameters: Parameters,
        model: &IntrinsicsModel,
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
            && parameters
                .focal_px
                .iter()
                .zip(self.priors)
                .all(|(&focal_px, prior)| focal_px.is_finite() && focal_px > STOPPED_SHORT * prior.shortest_focal_px())
    }

    pub(super) fn unknowns(&self, model: &IntrinsicsModel) -> usize {
        3 * self.priors.len() + model.parameters
    }

    /// Columns of a pair's local unknowns in the global system; `None` is held fixed. The reference photograph's
    /// rotation is fixed: it is the gauge.
    pub(super) fn columns<const LOCAL: usize>(
        &self,
        pair: &PairObservations,
        model: &IntrinsicsModel,
    ) -> [Option<usize>; LOCAL] {
        let rotation = |photograph: usize, axis: usize| (photograph != self.reference).then_some(3 * photograph + axis);
        let of_each = (LOCAL - 6) / 2;
        std::array::from_fn(|local| match local {
            0..3 => rotation(pair.a, local),
            3..6 => rotation(pair.b, local - 3),
            _ if local < 6 + of_each => self.column(model, pair.a, local - 6),
            _ => self.column(model, pair.b, local - 6 - of_each),
        })
    }

    /// Column of a photograph's intrinsic unknown; `None` is held fixed.
    pub(super) fn column(&self, model: &IntrinsicsModel, photograph: usize, intrinsic: usize) -> Option<usize> {
        model.parameters_of[photograph][intrinsic].map(|parameter| 3 * self.priors.len() + parameter)
    }

    /// Pull of the focal lengths towards their start values, (ln f - ln f0) / sd, and of lens terms towards 0, one per
    /// photograph with a free one.
    fn pulls(&self, parameters: &Parameters, model: &IntrinsicsModel) -> Vec<Pull> {
        let of_photograph = |k: usize| {
            let stretch = (parameters.focal_px[k] / self.start_focal_px[k]).ln();
            let focal = self.column(model, k, FOCAL).map(|column| Pull::new(column, stretch, self.focal_sd[k]));
            let lens = (FOCAL + 1..INTRINSICS).filter_map(move |intrinsic| {
                let sd = standard_deviation(intrinsic, &self.priors[k].frame);
                Some(Pull::new(self.column(model, k, intrinsic)?, parameters.lenses[k].term(intrinsic), sd))
            });
            focal.into_iter().chain(lens)
        };
        (0..self.priors.len()).flat_map(of_photograph).collect()
    }

    /// The quadratic model of every pair.
    pub(super) fn pair_terms<const LOCAL: usize>(&self, cameras: &[Camera], huber_px: f64) -> Vec<PairTerm<LOCAL>> {
        self.observations.pairs.par_iter().map(|pair| PairTerm::new(cameras, pair, huber_px)).collect()
    }

    /// The sum of squares that is minimized.
    pub(super) fn cost(&self, parameters: &Parameters, model: &IntrinsicsModel, huber_px: f64) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let costs: Vec<f64> =
            self.observations.pairs.par_iter().map(|pair| pair_cost(&cameras, pair, huber_px)).collect();
        let prior: f64 = self.pulls(parameters, model).iter().map(|pull| pull.residual * pull.residual).sum();
        costs.iter().sum::<f64>() + prior
    }

    /// Those of the data and the pulls.
    fn normal_equations(
        &self,
        parameters: &Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
    ) -> (faer::Mat<f64>, faer::Mat<f64>) {
        match parameters.has_lens() || model.has_lens() {
            false => self.equations::<PINHOLE_LOCAL>(parameters, model, huber_px),
            true => self.equations::<LENS_LOCAL>(parameters, model, huber_px),
        }
    }

    fn equations<const LOCAL: usize>(
        &self,
        parameters: &Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
    ) -> (faer::Mat<f64>, faer::Mat<f64>) {
        let terms: Vec<PairTerm<LOCAL>> = self.pair_terms(&parameters.cameras(self.priors), huber_px);
        self.assembled(&terms, parameters, model)
    }

    /// The normal equations of the pairs' `terms` and of the pulls at `parameters`.
    pub(super) fn assembled<const LOCAL: usize>(
        &self,
        terms: &[PairTerm<LOCAL>],
        parameters: &Parameters,
        model: &IntrinsicsModel,
    ) -> (faer::Mat<f64>, faer::Mat<f64>) {
        let unknowns = self.unknowns(model);
        let mut normal = faer::Mat::<f64>::zeros(unknowns, unknowns);
        let mut gradient = faer::Mat::<f64>::zeros(unknowns, 1);
        for (pair, term) in self.observations.pairs.iter().zip(terms) {
            let columns: [Option<usize>; LOCAL] = self.columns(pair, model);
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
        for Pull { column, residual, slope } in self.pulls(parameters, model) {
            normal[(column, column)] += slope * slope;
            gradient[(column, 0)] += slope * residual;
        }
        (normal, gradient)
    }

    fn moved(&self, parameters: &Parameters, model: &IntrinsicsModel, step: &faer::Mat<f64>) -> Parameters {
        let mut moved = parameters.clone();
        for k in 0..self.priors.len() {
            let turn = Vector3::new(step[(3 * k, 0)], step[(3 * k + 1, 0)], step[(3 * k + 2, 0)]);
            moved.rotations[k] = nearest_rotation(&(exp_rotation(&turn) * parameters.rotations[k]));
            if let Some(column) = self.column(model, k, FOCAL) {
                let stretched = parameters.focal_px[k] * step[(column, 0)].exp();
                moved.focal_px[k] = self.priors[k].believable_focal_px(stretched);
            }
            for intrinsic in FOCAL + 1..INTRINSICS {
                if let Some(column) = self.column(model, k, intrinsic) {
                    moved.lenses[k].add(intrinsic, step[(column, 0)]);
                }
            }
        }
        moved
    }
}

/// A residual that holds one unknown near where it is expected.
struct Pull {
    column: usize,
    residual: f64,
    /// Its derivative by the unknown.
    slope: f64,
}

impl Pull {
    fn new(column: usize, distance: f64, sd: f64) -> Self {
        Self { column, residual: distance / sd, slope: 1.0 / sd }
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
#[path = "bundle_tests.rs"]
mod tests;
