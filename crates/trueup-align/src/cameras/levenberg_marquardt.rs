//! Levenberg-Marquardt on sparse normal equations.
//!
//! # Source
//! Marquardt, "An algorithm for least-squares estimation of nonlinear parameters" (1963): the diagonal is what is damped.

use faer::linalg::solvers::Solve;
use trueup_core::{Result, StageContext};

use super::equations::NormalEquations;

/// Most iterations; a problem settles long before, unless the data contradict themselves.
const MAX_ITERATIONS: usize = 100;
/// Damping at the start, relative to the diagonal of the normal matrix.
const FIRST_DAMPING: f64 = 1e-4;
/// Damping beyond which no step is tried any more.
const LARGEST_DAMPING: f64 = 1e12;
/// Relative decrease of the cost below which a problem has settled.
const SETTLED: f64 = 1e-8;

/// A sum of squares over a state.
pub(super) trait LeastSquares {
    /// What is refined.
    type State: Clone;

    /// The sum of squares.
    fn cost(&self, state: &Self::State) -> f64;

    /// Its quadratic model; `None` if memory does not suffice.
    fn equations(&self, state: &Self::State) -> Option<NormalEquations>;

    /// The state after a step of the unknowns.
    fn moved(&self, state: &Self::State, step: &faer::Mat<f64>) -> Self::State;
}

/// Refines `state` until its cost settles: until a step hardly decreases it, or fails and would hardly by its model.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn minimize<P: LeastSquares>(problem: &P, mut state: P::State, context: &StageContext) -> Result<P::State> {
    let mut cost = problem.cost(&state);
    let mut damping = FIRST_DAMPING;
    for _ in 0..MAX_ITERATIONS {
        context.check_cancelled()?;
        let Some(equations) = problem.equations(&state) else { break };
        let mut decrease = 0.0;
        while damping < LARGEST_DAMPING {
            let Some(step) = solve_damped(&equations, damping) else {
                damping *= 10.0;
                continue;
            };
            let moved = problem.moved(&state, &step);
            let moved_cost = problem.cost(&moved);
            if moved_cost < cost {
                decrease = (cost - moved_cost) / cost;
                (state, cost) = (moved, moved_cost);
                damping = (damping * 0.1).max(f64::EPSILON);
                break;
            }
            // More damping promises less still.
            if promised(&equations, &step) < SETTLED * cost {
                break;
            }
            damping *= 10.0;
        }
        if decrease < SETTLED {
            break;
        }
    }
    Ok(state)
}

/// The most by which the model says that a damped step decreases the cost: -2 g s - s N s is no more than -2 g s.
fn promised(equations: &NormalEquations, step: &faer::Mat<f64>) -> f64 {
    -2.0 * (0..step.nrows()).map(|k| equations.gradient[(k, 0)] * step[(k, 0)]).sum::<f64>()
}

/// Solves (N + damping diag N) step = -gradient; unknowns without any data stay where they are. `None` if not positive
/// definite or not finite.
fn solve_damped(equations: &NormalEquations, damping: f64) -> Option<faer::Mat<f64>> {
    let step = equations.factor(damping)?.solve(-&equations.gradient);
    (0..step.nrows()).all(|k| step[(k, 0)].is_finite()).then_some(step)
}
