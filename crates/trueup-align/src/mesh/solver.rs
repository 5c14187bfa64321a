//! Sparse Cholesky whose factor serves several solves.

use super::factor::{MOST_DOUBLES, VertexFactor};
use super::normal_equations::{AssembledEquations, Border, NormalEquations, PlacedBlock};

/// What [`MeshSolver::solve`] finds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MeshSolution {
    /// x and y of every vertex in turn.
    pub coordinates: Vec<f64>,
    /// The length of a full turn, where equations ask for it.
    pub period: Option<f64>,
    /// |A^T A x - A^T b| / |A^T b|.
    pub relative_gradient: f64,
}

/// Solves normal equations of the same grids again and again.
///
/// The first are factorized. Those after them differ little, so that the factor at hand is a preconditioner with which
/// conjugate gradients come near the same solution in a few steps; where they do not, the equations are factorized
/// anew.
#[derive(Debug)]
pub(super) struct MeshSolver {
    /// The share of the way from the last solution that conjugate gradients may leave undone, where that is more than
    /// [`MET_PX`].
    unmet_share: f64,
    /// How factors are computed.
    factoring: Factoring,
    /// The last factor and the last solution.
    last: Option<(Factor, Bordered)>,
}

/// How a factor and the solution that comes with it are computed.
#[derive(Debug, Clone, Copy)]
struct Factoring {
    /// Real numbers of a factor beyond which it is in single precision.
    most_doubles: usize,
    /// How near conjugate gradients are to come to the solution, where it is in single precision.
    goal: Goal,
}

impl Default for MeshSolver {
    /// For equations whose solution is wanted to rounding.
    fn default() -> Self {
        let factoring = Factoring { most_doubles: MOST_DOUBLES, goal: TO_ROUNDING };
        Self { unmet_share: 0.0, factoring, last: None }
    }
}

impl MeshSolver {
    /// For equations that are made around each other's solutions: what one solution leaves undone, the next one sees.
    pub(super) fn of_rounds() -> Self {
        /// The next round goes a tenth of the way of this one or more. Matches meet, and NCC MSE comes, to the same
        /// within 0.4 % (eight photographed pairs and sets); with 0.05 one pair was 9 % off, with 0.1 three by 2 to 24
        /// %.
        const UNMET_SHARE: f64 = 0.02;
        // The factor is a preconditioner from the second round on at the latest. In single precision it is computed,
        // and goes through memory, in half of the time.
        let factoring = Factoring { most_doubles: 0, goal: Goal { met_px: MET_PX, unmet_share: 0.0 } };
        Self { unmet_share: UNMET_SHARE, factoring, last: None }
    }

    /// The least-squares solution; `None` if the matrix is not positive definite.
    pub(super) fn solve(&mut self, equations: NormalEquations) -> Option<MeshSolution> {
        let AssembledEquations { blocks, right, border } = equations.assembled();
        let border = border.as_ref();
        let system = System { blocks: &blocks, border };
        let right = Bordered { inner: column(&right), last: border.map_or(0.0, |border| border.right) };
        let known = self.last.take().and_then(|(factor, solution)| {
            let goal = Goal { met_px: MET_PX, unmet_share: self.unmet_share };
            let solution = conjugate_gradients(&system, &right, &factor, solution, goal)?;
            Some((factor, solution))
        });
        let (factor, solution) = match known {
            Some(known) => known,
            None => solve_directly(&system, &right, self.factoring)?,
        };
        let residual = system.residual(&right, &solution);
        let found = MeshSolution {
            relative_gradient: residual.norm() / right.norm().max(f64::MIN_POSITIVE),
            coordinates: solution.inner.col_as_slice(0).to_vec(),
            period: border.map(|_| solution.last),
        };
        self.last = Some((factor, solution));
        Some(found)
    }
}

/// The factor of the system and its solution, as near as it is to come where the factor is in single precision, else to
/// rounding.
fn solve_directly(system: &System, right: &Bordered, factoring: Factoring) -> Option<(Factor, Bordered)> {
    let Factoring { most_doubles, goal } = factoring;
    let vertices = right.inner.nrows() / 2;
    let factor = VertexFactor::new(vertices, system.blocks, most_doubles);
    let factor = factor.and_then(|inner| Factor::new(inner, system.border));
    let factor = match factor {
        Some(factor) if factor.inner.is_single() => {
            let zero = Bordered { inner: faer::Mat::zeros(right.inner.nrows(), 1), last: 0.0 };
            if let Some(solution) = conjugate_gradients(system, right, &factor, zero, goal) {
                return Some((factor, solution));
            }
            None
        }
        precise => precise,
    };
    let in_double = || Factor::new(VertexFactor::new(vertices, system.blocks, usize::MAX)?, system.border);
    let factor = factor.or_else(in_double)?;
    let mut solution = factor.solve(right);
    // One step of refinement recovers the digits that the normal equations lose.
    solution.add(1.0, &factor.solve(&system.residual(right, &solution)));
    Some((factor, solution))
}

/// A value for every unknown, and one for the length of a full turn: 0 where there is none.
#[derive(Debug, Clone)]
struct Bordered {
    inner: faer::Mat<f64>,
    last: f64,
}

impl Bordered {
    fn add(&mut self, factor: f64, other: &Self) {
        self.inner += faer::Scale(factor) * &other.inner;
        self.last += factor * other.last;
    }

    /// The largest of the values.
    fn largest(&self) -> f64 {
        self.inner.norm_max().max(self.last.abs())
    }

    fn dot(&self, other: &Self) -> f64 {
        dot(&self.inner, &other.inner) + self.last * other.last
    }

    fn norm(&self) -> f64 {
        self.inner.norm_l2().hypot(self.last)
    }
}

/// The normal matrix with its last row and column.
#[derive(Debug)]
struct System<'a> {
    blocks: &'a [PlacedBlock],
    border: Option<&'a Border>,
}

impl System<'_> {
    fn multiply(&self, x: &Bordered) -> Bordered {
        let mut inner = multiply(self.blocks, &x.inner);
        let Some(border) = self.border else { return Bordered { inner, last: 0.0 } };
        let couplings = column(&border.couplings);
        inner += faer::Scale(x.last) * &couplings;
        Bordered { inner, last: dot(&couplings, &x.inner) + border.own * x.last }
    }

    fn residual(&self, right: &Bordered, x: &Bordered) -> Bordered {
        let mut residual = right.clone();
        residual.add(-1.0, &self.multiply(x));
        residual
    }
}

/// The Cholesky factor of a normal matrix. Its last row and column are eliminated by blocks, so that the matrix without
/// them keeps its order and its factor.
#[derive(Debug)]
struct Factor {
    inner: VertexFactor,
    border: Option<BorderFactor>,
}

#[derive(Debug)]
struct BorderFactor {
    couplings: faer::Mat<f64>,
    /// The inner matrix's solution for the couplings.
    along: faer::Mat<f64>,
    /// What is left of the last unknown's coupling with itself.
    stiffness: f64,
}

impl Factor {
    /// `None` if the matrix is not positive definite.
    fn new(inner: VertexFactor, border: Option<&Border>) -> Option<Self> {
        let Some(border) = border else { return Some(Self { inner, border: None }) };
        let couplings = column(&border.couplings);
        let along = inner.solve(&couplings);
        let stiffness = border.own - dot(&couplings, &along);
        (stiffness.is_finite() && stiffness > 0.0)
            .then_some(Self { inner, border: Some(BorderFactor { couplings, along, stiffness }) })
    }

    fn solve(&self, right: &Bordered) -> Bordered {
        let mut inner = self.inner.solve(&right.inner);
        let Some(BorderFactor { couplings, along, stiffness }) = &self.border else {
            return Bordered { inner, last: 0.0 };
        };
        let last = (right.last - dot(couplings, &inner)) / stiffness;
        inner -= faer::Scale(last) * along;
        Bordered { inner, last }
    }
}

/// What conjugate gradients leave undone: steps that would move no vertex by more than this, panorama units. Matches
/// are known to a few tenths of a unit, and the next round starts from better equations.
const MET_PX: f64 = 1e-3;

/// How near conjugate gradients are to come to the solution.
#[derive(Debug, Clone, Copy)]
struct Goal {
    /// A step that moves no vertex by more than this is the last, panorama units.
    met_px: f64,
    /// Nor one that is no larger than this share of the first.
    unmet_share: f64,
}

/// As near as a factor in double precision comes: steps of a hundred-millionth of a pixel, which on panoramas of a
/// million units are in the last digits.
const TO_ROUNDING: Goal = Goal { met_px: 1e-8, unmet_share: 0.0 };

/// The solution of `system` by conjugate gradients from `start`, preconditioned with the factor of a matrix like its
/// own, but for what the `goal` leaves undone; `None` if that takes longer than a factorization.
///
/// The preconditioned residual is what the factor's own matrix would still have to be moved by: it says in the unit of
/// the unknowns how far the solution is.
///
/// # Source
/// M. R. Hestenes and E. Stiefel, "Methods of conjugate gradients for solving linear systems" (1952), with a
/// preconditioner.
fn conjugate_gradients(
    system: &System,
    right: &Bordered,
    factor: &Factor,
    start: Bordered,
    goal: Goal,
) -> Option<Bordered> {
    /// Steps after which the pace says whether the others will do; the first may lead away.
    const TRIED: usize = 6;
    if factor.inner.unknowns() != right.inner.nrows() || factor.border.is_some() != system.border.is_some() {
        return None;
    }
    let most_steps = most_steps(factor.inner.mean_column());
    let mut solution = start;
    let mut residual = system.residual(right, &solution);
    let mut next = factor.solve(&residual);
    let first = next.largest();
    let met = goal.met_px.max(goal.unmet_share * first);
    let mut direction = next.clone();
    let mut slope = residual.dot(&next);
    for step in 0..=most_steps {
        let far = next.largest();
        if far <= met {
            solution.add(1.0, &next);
            return Some(solution);
        }
        let pace = (far / first).powf(1.0 / step.max(1) as f64);
        let reached = far * pace.powi((most_steps - step) as i32);
        if far.is_nan() || (step >= TRIED && reached > met) {
            return None;
        }
        let along = system.multiply(&direction);
        let length = slope / direction.dot(&along);
        solution.add(length, &direction);
        residual.add(-length, &along);
        next = factor.solve(&residual);
        let next_slope = residual.dot(&next);
        let before = std::mem::replace(&mut direction, next.clone());
        direction.add(next_slope / slope, &before);
        slope = next_slope;
    }
    None
}

/// Steps of conjugate gradients that take about half as long as a factorization, or less, whose columns have so many
/// entries in the mean: a step goes twice through the entries, while computing them takes as many products for each as
/// its column has.
fn most_steps(mean_column: f64) -> usize {
    /// Entries of a column beyond which a factorization takes as long as two more steps. Of five photographs, whose
    /// columns have 410, it takes as long as 25 steps; of 72, whose columns have 1430, as 170, because large products
    /// leave what is slow, memory, alone.
    const COLUMN_OF_A_STEP: f64 = 40.0;
    const FEWEST: f64 = 16.0;
    (mean_column / COLUMN_OF_A_STEP).max(FEWEST) as usize
}

fn column(values: &[f64]) -> faer::Mat<f64> {
    faer::Mat::from_fn(values.len(), 1, |row, _| values[row])
}

fn dot(one: &faer::Mat<f64>, other: &faer::Mat<f64>) -> f64 {
    (0..one.nrows()).map(|row| one[(row, 0)] * other[(row, 0)]).sum()
}

/// The product of the symmetric matrix, given by the blocks of its lower triangle, with a column.
fn multiply(lower: &[PlacedBlock], x: &faer::Mat<f64>) -> faer::Mat<f64> {
    let mut product = faer::Mat::<f64>::zeros(x.nrows(), 1);
    let (x, sums) = (x.col_as_slice(0), product.col_as_slice_mut(0));
    for &(row, column, [a, b, c, d]) in lower {
        let (row, column) = (2 * row as usize, 2 * column as usize);
        sums[row] += a * x[column] + b * x[column + 1];
        sums[row + 1] += c * x[column] + d * x[column + 1];
        if row != column {
            sums[column] += a * x[row] + c * x[row + 1];
            sums[column + 1] += b * x[row] + d * x[row + 1];
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use trueup_core::mesh::GridMesh;

    use super::super::normal_equations::GridSum;
    use super::*;

    /// Vertices that are held with a weight of their own each, neighbors that turn together, and, if asked for, a
    /// period between the first column of one grid and the last of the other.
    fn equations(weight: impl Fn(usize) -> f64, with_period: bool) -> NormalEquations {
        let grids = vec![GridMesh::regular(400.0, 300.0, 50.0); 2];
        let mut equations = NormalEquations::new(&grids);
        for (photograph, grid) in grids.iter().enumerate() {
            for vertex in 0..grid.len() {
                let value = Vector2::new((vertex % 7) as f64, (vertex % 5) as f64 - photograph as f64);
                equations.add_inside(photograph, &[(vertex, Vector2::new(weight(vertex), 0.0))], value);
                if (vertex + 1) % grid.columns != 0 {
                    let edge = [(vertex, Vector2::new(1.0, 0.2)), (vertex + 1, Vector2::new(-0.9, 0.1))];
                    equations.add_inside(photograph, &edge, Vector2::zeros());
                }
            }
        }
        if with_period {
            for row in 0..grids[0].rows {
                let (left, right) = (row * grids[0].columns, (row + 1) * grids[0].columns - 1);
                let sums = [
                    GridSum { photograph: 1, members: &[(right, 1.0)] },
                    GridSum { photograph: 0, members: &[(left, -1.0)] },
                ];
                equations.add_between(&sums, Vector2::new(0.5, 0.0), 1.0);
                equations.add_period(&sums, 1.0, 0.5, 1.0);
            }
        }
        equations
    }

    fn farthest(one: &MeshSolution, other: &MeshSolution) -> f64 {
        let period = [(one.period, other.period)].into_iter().filter_map(|(one, other)| one.zip(other));
        let pairs = one.coordinates.iter().copied().zip(other.coordinates.iter().copied());
        pairs.chain(period).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn equations_like_those_before_have_the_solution_that_a_factorization_finds() {
        for with_period in [false, true] {
            let mut solver = MeshSolver::default();
            solver.solve(equations(|_| 0.5, with_period)).expect("solvable");
            let changed = equations(|vertex| 0.5 + 0.02 * (vertex % 3) as f64, with_period);
            let again = solver.solve(changed.clone()).expect("solvable");
            let anew = MeshSolver::default().solve(changed).expect("solvable");
            assert!(farthest(&again, &anew) < MET_PX, "{}", farthest(&again, &anew));
            assert!(again.relative_gradient < 1e-5 && anew.relative_gradient < 1e-11);
            assert_eq!(again.period.is_some(), with_period);
        }
    }

    #[test]
    fn large_factors_are_worth_more_steps() {
        assert_eq!([0.0, 410.0, 640.0, 1430.0].map(most_steps), [16, 16, 16, 35]);
    }

    /// What the large factors of many photographs are in: the solution does not depend on it.
    #[test]
    fn a_factor_in_single_precision_leads_to_the_same_solution() {
        for with_period in [false, true] {
            let equations = equations(|vertex| 0.05 + 0.02 * (vertex % 3) as f64, with_period);
            let AssembledEquations { blocks, right, border } = equations.assembled();
            let system = System { blocks: &blocks, border: border.as_ref() };
            let right = Bordered { inner: column(&right), last: border.as_ref().map_or(0.0, |border| border.right) };
            let (vertices, zero) = (right.inner.nrows() / 2, faer::Mat::zeros(right.inner.nrows(), 1));
            let single = VertexFactor::new(vertices, &blocks, 0).expect("positive definite");
            let factor = Factor::new(single, border.as_ref()).expect("positive definite");
            let start = Bordered { inner: zero, last: 0.0 };
            let found = conjugate_gradients(&system, &right, &factor, start, TO_ROUNDING).expect("solved");
            let factoring = MeshSolver::default().factoring;
            let (_, mut apart) = solve_directly(&system, &right, factoring).expect("solved");
            apart.add(-1.0, &found);
            assert!(apart.largest() < 1e-7, "{}", apart.largest());
        }
    }

    #[test]
    fn rounds_come_as_near_to_the_solution_as_they_are_to() {
        for with_period in [false, true] {
            let mut rounds = MeshSolver::of_rounds();
            for weight in [0.5, 0.52] {
                let equations = equations(|vertex| weight + 0.02 * (vertex % 3) as f64, with_period);
                let found = rounds.solve(equations.clone()).expect("solvable");
                let exact = MeshSolver::default().solve(equations).expect("solvable");
                assert!(farthest(&found, &exact) < MET_PX, "{}", farthest(&found, &exact));
            }
            assert!(rounds.last.is_some_and(|(factor, _)| factor.inner.is_single()));
        }
    }

    #[test]
    fn a_preconditioner_that_is_far_off_is_given_up() {
        let (near, far) = (equations(|_| 0.5, false), equations(|vertex| 10.0_f64.powi((vertex % 5) as i32), false));
        let (near_blocks, far_blocks) = (near.blocks(), far.blocks());
        let mut solver = MeshSolver::default();
        solver.solve(near.clone()).expect("solvable");
        let (factor, start) = solver.last.take().expect("solved");
        let right = Bordered { inner: column(&far.right), last: 0.0 };
        let goal = Goal { met_px: MET_PX, unmet_share: 0.0 };
        let system = System { blocks: &far_blocks, border: None };
        assert!(conjugate_gradients(&system, &right, &factor, start.clone(), goal).is_none());
        // With its own matrix one step is enough.
        let system = System { blocks: &near_blocks, border: None };
        let right = Bordered { inner: column(&near.right), last: 0.0 };
        let zero = Bordered { inner: column(&vec![0.0; near.unknowns()]), last: 0.0 };
        let found = conjugate_gradients(&system, &right, &factor, zero, goal).expect("solved");
        let apart: f64 = (0..near.unknowns()).map(|row| (found.inner[(row, 0)] - start.inner[(row, 0)]).abs()).sum();
        assert!(apart < 1e-9, "{apart}");
        // The solver then factorizes.
        solver.last = Some((factor, start));
        let (again, anew) =
            (solver.solve(far.clone()).expect("solvable"), MeshSolver::default().solve(far).expect("solvable"));
        assert!(farthest(&again, &anew) < 1e-9, "{}", farthest(&again, &anew));
    }
}
