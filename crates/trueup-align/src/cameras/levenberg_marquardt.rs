//! Levenberg-Marquardt on sparse normal equations.
//!
//! # Source
//! Marquardt, "An algorithm for least-squares estimation of nonlinear parameters" (1963): the diagonal is what is
//! damped.

use faer::linalg::solvers::Solve;
use trueup_core::{Result, StageContext};

use super::equations::NormalEquations;

/// Most iterations; a problem settles long before, unless the data contradict themselves.
const MAX_ITERATIONS: usize = 100;
/// Damping at the start, relative to the diagonal of the normal matrix.
const FIRST_DAMPING: f64 = 1e-4;
/// Damping beyond which no step is tried any more.
const LARGEST_DAMPING: f64 = 1e12;
/// Relative decrease of the cost below which a problem has settled to what comes of it in the end.
pub(super) const SETTLED: f64 = 1e-8;

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

/// Refines `state` until its cost settles: until a step decreases it by less than `settled` of it, or fails and would
/// by its model.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn minimize<P: LeastSquares>(
    problem: &P,
    mut state: P::State,
    settled: f64,
    context: &StageContext,
) -> Result<P::State> {
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
            if promised(&equations, &step) < settled * cost {
                break;
            }
            damping *= 10.0;
        }
        if decrease < settled {
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

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use nalgebra::{SMatrix, SVector};

    use super::super::equations::NormalPattern;
    use super::super::pair_cost::PairTerm;
    use super::*;

    /// The cost 1 + (x - least)^2, of which the equations say that it is `curvature` times as curved and has a slope
    /// that is off by `slope_error`.
    struct Parabola {
        least: f64,
        curvature: f64,
        slope_error: f64,
        costs: Cell<usize>,
    }

    impl LeastSquares for Parabola {
        type State = f64;

        fn cost(&self, state: &f64) -> f64 {
            self.costs.set(self.costs.get() + 1);
            1.0 + (state - self.least).powi(2)
        }

        fn equations(&self, state: &f64) -> Option<NormalEquations> {
            let normal = SMatrix::<f64, 1, 1>::new(self.curvature);
            let gradient = SVector::<f64, 1>::new(state - self.least + self.slope_error);
            let pattern = NormalPattern::new(1, vec![[Some(0)]]).ok()?;
            pattern.equations(&[PairTerm { normal, gradient }], &[])
        }

        fn moved(&self, state: &f64, step: &faer::Mat<f64>) -> f64 {
            state + step[(0, 0)]
        }
    }

    fn minimized(problem: &Parabola) -> f64 {
        minimize(problem, 0.0, SETTLED, &StageContext::default()).expect("not cancelled")
    }

    /// At the minimum, by a slope of 1e-6 in place of 0: a step of 1e-6 that promises 2e-12 of 1. It is tried once, not
    /// with seventeen dampings.
    #[test]
    fn where_no_step_promises_anything_none_is_tried_again() {
        let problem = Parabola { least: 0.0, curvature: 1.0, slope_error: 1e-6, costs: Cell::new(0) };
        assert_eq!(minimized(&problem), 0.0);
        assert_eq!(problem.costs.get(), 2);
    }

    /// A curvature of a hundredth makes steps a hundred times too long, which only damping shortens.
    #[test]
    fn steps_that_promise_much_and_fail_are_damped() {
        let problem = Parabola { least: 1.0, curvature: 0.01, slope_error: 0.0, costs: Cell::new(0) };
        let found = minimized(&problem);
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }
}
