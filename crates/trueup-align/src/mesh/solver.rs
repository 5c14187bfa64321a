//! Sparse Cholesky that keeps its elimination order over several solves.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};

use super::normal_equations::NormalEquations;

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

/// Solves normal equations of the same grids again and again: the symbolic factorization is made anew only when
/// vertices couple that never coupled before.
#[derive(Debug, Default)]
pub(super) struct MeshSolver {
    order: Option<EliminationOrder>,
}

/// All couplings met so far and the order in which they are eliminated.
#[derive(Debug)]
struct EliminationOrder {
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLlt<usize>,
}

impl MeshSolver {
    /// The least-squares solution; `None` if the matrix is not positive definite.
    pub(super) fn solve(&mut self, equations: &NormalEquations) -> Option<MeshSolution> {
        let matrix = self.in_known_pattern(equations.matrix()?)?;
        let order = self.order.as_ref()?;
        let factor = Llt::try_new_with_symbolic(order.symbolic.clone(), matrix.as_ref(), faer::Side::Lower).ok()?;
        let column = |values: &[f64]| faer::Mat::from_fn(values.len(), 1, |row, _| values[row]);
        let right = column(&equations.right);
        let Some(border) = &equations.border else {
            let mut solution = factor.solve(&right);
            // One step of refinement recovers the digits that the normal equations lose.
            let residual = &right - multiply(&matrix, &solution);
            solution += factor.solve(&residual);
            let gradient = &right - multiply(&matrix, &solution);
            return Some(MeshSolution {
                relative_gradient: gradient.norm_l2() / right.norm_l2().max(f64::MIN_POSITIVE),
                coordinates: (0..equations.unknowns()).map(|row| solution[(row, 0)]).collect(),
                period: None,
            });
        };
        // Block elimination: the matrix without its last row and column keeps its order and its factor.
        let couplings = column(&border.couplings);
        let along = factor.solve(&couplings);
        let stiffness = border.own - dot(&couplings, &along);
        if !(stiffness.is_finite() && stiffness > 0.0) {
            return None;
        }
        let solve = |right: &faer::Mat<f64>, last: f64| {
            let plain = factor.solve(right);
            let period = (last - dot(&couplings, &plain)) / stiffness;
            (plain - faer::Scale(period) * &along, period)
        };
        let residual = |solution: &faer::Mat<f64>, period: f64| {
            let rest = &right - multiply(&matrix, solution) - faer::Scale(period) * &couplings;
            (rest, border.right - dot(&couplings, solution) - border.own * period)
        };
        let (mut solution, mut period) = solve(&right, border.right);
        let (rest, last) = residual(&solution, period);
        let (correction, correction_of_period) = solve(&rest, last);
        solution += correction;
        period += correction_of_period;
        let (rest, last) = residual(&solution, period);
        Some(MeshSolution {
            relative_gradient: rest.norm_l2().hypot(last) / right.norm_l2().hypot(border.right).max(f64::MIN_POSITIVE),
            coordinates: (0..equations.unknowns()).map(|row| solution[(row, 0)]).collect(),
            period: Some(period),
        })
    }

    /// The matrix with explicit zeros where earlier ones had couplings; new couplings are remembered.
    fn in_known_pattern(&mut self, matrix: SparseColMat<usize, f64>) -> Option<SparseColMat<usize, f64>> {
        let matrix = match &self.order {
            Some(known) if known.pattern.ncols() == matrix.ncols() => widened(&matrix, &known.pattern),
            _ => matrix,
        };
        let pattern = matrix.symbolic();
        let is_known = self.order.as_ref().is_some_and(|known| known.pattern.row_idx() == pattern.row_idx());
        if !is_known {
            let symbolic = SymbolicLlt::try_new(pattern, faer::Side::Lower).ok()?;
            self.order = Some(EliminationOrder { pattern: pattern.to_owned().ok()?, symbolic });
        }
        Some(matrix)
    }
}

/// The matrix over the union of its own pattern and another of the same size, rows ascending in every column of both.
fn widened(matrix: &SparseColMat<usize, f64>, pattern: &SymbolicSparseColMat<usize>) -> SparseColMat<usize, f64> {
    let columns = matrix.ncols();
    let capacity = pattern.row_idx().len().max(matrix.row_idx().len());
    let (mut starts, mut rows, mut values) =
        (Vec::with_capacity(columns + 1), Vec::with_capacity(capacity), Vec::with_capacity(capacity));
    starts.push(0);
    for column in 0..columns {
        let mut known = pattern.row_idx_of_col(column).peekable();
        for (row, &value) in matrix.row_idx_of_col(column).zip(matrix.val_of_col(column)) {
            while let Some(zero) = known.next_if(|&zero| zero < row) {
                rows.push(zero);
                values.push(0.0);
            }
            known.next_if_eq(&row);
            rows.push(row);
            values.push(value);
        }
        for zero in known {
            rows.push(zero);
            values.push(0.0);
        }
        starts.push(rows.len());
    }
    SparseColMat::new(SymbolicSparseColMat::new_checked(columns, columns, starts, None, rows), values)
}

fn dot(one: &faer::Mat<f64>, other: &faer::Mat<f64>) -> f64 {
    (0..one.nrows()).map(|row| one[(row, 0)] * other[(row, 0)]).sum()
}

/// The product of the symmetric matrix, given by its lower triangle, with a column.
fn multiply(lower: &SparseColMat<usize, f64>, x: &faer::Mat<f64>) -> faer::Mat<f64> {
    let mut product = faer::Mat::<f64>::zeros(lower.ncols(), 1);
    for column in 0..lower.ncols() {
        for (row, value) in lower.row_idx_of_col(column).zip(lower.val_of_col(column)) {
            product[(row, 0)] += value * x[(column, 0)];
            if row != column {
                product[(column, 0)] += value * x[(row, 0)];
            }
        }
    }
    product
}
