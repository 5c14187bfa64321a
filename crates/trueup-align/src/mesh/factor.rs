//! The Cholesky factor of the vertices' normal matrix.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::Perm;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};

use super::normal_equations::{NormalEquations, PlacedBlock};

/// A lower triangle L with L L^T = A, whose columns of like pattern are stored together: supernodes.
#[derive(Debug)]
pub(super) struct VertexFactor {
    /// The unknowns in the order of elimination.
    order: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
}

/// Columns of like pattern that follow each other.
struct Supernode<'a> {
    /// The first of them.
    start: usize,
    /// Their entries, column by column: a lower triangle, of which the upper half is not to be read, over a rectangle.
    values: &'a [f64],
    /// How many columns, and how many entries in each.
    columns: usize,
    rows: usize,
    /// The rows of the rectangle.
    pattern: &'a [usize],
}

impl VertexFactor {
    /// The factor of the matrix of `equations`, given its `blocks`; `None` if that is not positive definite, or its factor
    /// does not fit into memory.
    pub(super) fn new(equations: &NormalEquations, blocks: &[PlacedBlock]) -> Option<Self> {
        let (side, par) = (faer::Side::Lower, faer::Par::Seq);
        let matrix = equations.matrix(blocks)?;
        let order = elimination_order(equations.unknowns() / 2, blocks)?;
        let order = SymmetricOrdering::Custom(order.as_ref());
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(matrix.symbolic(), side, order, params).ok()?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), 0.0);
        let mut memory = scratch(symbolic.factorize_numeric_llt_scratch::<f64>(par, Default::default()))?;
        let (stack, matrix) = (MemStack::new(&mut memory), matrix.as_ref());
        symbolic
            .factorize_numeric_llt(&mut values, matrix, side, Default::default(), par, stack, Default::default())
            .ok()?;
        let order = symbolic.perm()?.arrays().0.to_vec();
        Some(Self { order, symbolic, values })
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.order.len()
    }

    /// Solves A x = `right`.
    ///
    /// A few columns at a time of a right side that is one column itself are too little for kernels of matrices: these took
    /// several times as long.
    pub(super) fn solve(&self, right: &faer::Mat<f64>) -> faer::Mat<f64> {
        let right = right.col_as_slice(0);
        let mut x: Vec<f64> = self.order.iter().map(|&unknown| right[unknown]).collect();
        let mut below = Vec::new();
        for supernode in self.supernodes() {
            supernode.solve_lower(&mut x, &mut below);
        }
        for supernode in self.supernodes().rev() {
            supernode.solve_upper(&mut x, &mut below);
        }
        let mut solution = faer::Mat::zeros(x.len(), 1);
        let placed = solution.col_as_slice_mut(0);
        self.order.iter().zip(&x).for_each(|(&unknown, &value)| placed[unknown] = value);
        solution
    }

    fn supernodes(&self) -> impl DoubleEndedIterator<Item = Supernode<'_>> {
        let pattern: Option<&SymbolicSupernodalCholesky<usize>> = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(pattern) => Some(pattern),
            // Never: supernodes were asked for.
            SymbolicCholeskyRaw::Simplicial(_) => None,
        };
        pattern.into_iter().flat_map(move |pattern| {
            (0..pattern.n_supernodes()).map(move |k| {
                let [from, to] = [k, k + 1].map(|k| pattern.col_ptr_for_val()[k]);
                let (start, values) = (pattern.supernode_begin()[k], &self.values[from..to]);
                let columns = pattern.supernode_end()[k] - start;
                Supernode {
                    start,
                    values,
                    columns,
                    rows: values.len() / columns,
                    pattern: pattern.supernode(k).pattern(),
                }
            })
        })
    }
}

impl Supernode<'_> {
    /// A column's entries: in the triangle from its diagonal on, and in the rectangle.
    fn column(&self, column: usize) -> (&[f64], &[f64]) {
        let values = &self.values[column * self.rows..][..self.rows];
        (&values[column..self.columns], &values[self.columns..])
    }

    /// These columns' part of solving L y = x; `below` is room for what they change of the rest.
    fn solve_lower(&self, x: &mut [f64], below: &mut Vec<f64>) {
        below.clear();
        below.resize(self.pattern.len(), 0.0);
        let own = &mut x[self.start..][..self.columns];
        for column in 0..self.columns {
            let (triangle, rectangle) = self.column(column);
            let value = own[column] / triangle[0];
            own[column] = value;
            add_scaled(&mut own[column + 1..], -value, &triangle[1..]);
            add_scaled(below, value, rectangle);
        }
        self.pattern.iter().zip(below).for_each(|(&row, change)| x[row] -= *change);
    }

    /// These columns' part of solving L^T y = x; `below` is room for what they take of the rest.
    fn solve_upper(&self, x: &mut [f64], below: &mut Vec<f64>) {
        below.clear();
        below.extend(self.pattern.iter().map(|&row| x[row]));
        let own = &mut x[self.start..][..self.columns];
        for column in (0..self.columns).rev() {
            let (triangle, rectangle) = self.column(column);
            let known = dot(&triangle[1..], &own[column + 1..]) + dot(rectangle, below);
            own[column] = (own[column] - known) / triangle[0];
        }
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, values: &[f64]) {
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
}

/// The sum of products, in several sums beside each other: vector instructions may not order them anew.
fn dot(one: &[f64], other: &[f64]) -> f64 {
    const SUMS: usize = 8;
    let (ones, others) = (one.chunks_exact(SUMS), other.chunks_exact(SUMS));
    let rest: f64 = ones.remainder().iter().zip(others.remainder()).map(|(one, other)| one * other).sum();
    let mut sums = [0.0; SUMS];
    for (one, other) in ones.zip(others) {
        for k in 0..SUMS {
            sums[k] += one[k] * other[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// The order in which the unknowns are eliminated so that few couplings come about: that of the vertices, of each of
/// which both coordinates couple with the same others.
///
/// # Source
/// P. R. Amestoy, T. A. Davis and I. S. Duff, "An approximate minimum degree ordering algorithm" (1996).
fn elimination_order(vertices: usize, blocks: &[PlacedBlock]) -> Option<Perm<usize>> {
    let mut starts = vec![0; vertices + 1];
    blocks.iter().for_each(|block| starts[block.1 as usize + 1] += 1);
    (0..vertices).for_each(|vertex| starts[vertex + 1] += starts[vertex]);
    let rows: Vec<usize> = blocks.iter().map(|block| block.0 as usize).collect();
    let pattern = SymbolicSparseColMat::new_checked(vertices, vertices, starts, None, rows);
    let (mut forward, mut inverse) = (vec![0; vertices], vec![0; vertices]);
    let mut memory = scratch(amd::order_scratch::<usize>(vertices, blocks.len()))?;
    let stack = MemStack::new(&mut memory);
    amd::order(&mut forward, &mut inverse, pattern.as_ref(), amd::Control::default(), stack).ok()?;
    let both = |order: Vec<usize>| -> Box<[usize]> { order.iter().flat_map(|k| [2 * k, 2 * k + 1]).collect() };
    Some(Perm::new_checked(both(forward), both(inverse), 2 * vertices))
}

fn scratch(request: StackReq) -> Option<MemBuffer> {
    MemBuffer::try_new(request).ok()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use trueup_core::mesh::GridMesh;

    use super::*;

    /// Against the residual of the equations themselves.
    #[test]
    fn the_factor_solves_its_own_matrix() {
        let grid = GridMesh::regular(400.0, 300.0, 20.0);
        let mut equations = NormalEquations::new(std::slice::from_ref(&grid));
        for vertex in 0..grid.len() {
            equations.add_inside(0, &[(vertex, Vector2::new(0.3 + 0.1 * (vertex % 4) as f64, 0.0))], Vector2::zeros());
            for other in [vertex + 1, vertex + grid.columns].into_iter().filter(|&other| other < grid.len()) {
                let edge = [(vertex, Vector2::new(1.0, 0.2)), (other, Vector2::new(-0.9, 0.1))];
                equations.add_inside(0, &edge, Vector2::zeros());
            }
        }
        let blocks = equations.blocks();
        let matrix = equations.matrix(&blocks).expect("every vertex has its own block");
        let wanted: Vec<f64> = (0..equations.unknowns()).map(|k| (k as f64 * 0.7).sin()).collect();
        let mut right = faer::Mat::zeros(wanted.len(), 1);
        for column in 0..wanted.len() {
            for (row, value) in matrix.row_idx_of_col(column).zip(matrix.val_of_col(column)) {
                right[(row, 0)] += value * wanted[column];
                if row != column {
                    right[(column, 0)] += value * wanted[row];
                }
            }
        }
        let factor = VertexFactor::new(&equations, &blocks).expect("positive definite");
        let found = factor.solve(&right);
        assert_eq!(factor.unknowns(), wanted.len());
        assert!((0..wanted.len()).all(|k| (found[(k, 0)] - wanted[k]).abs() < 1e-10));
    }

    #[test]
    fn the_sum_of_products_takes_in_what_fills_no_vector() {
        let one: Vec<f64> = (1..=19).map(f64::from).collect();
        // 1 + 4 + ... + 361.
        assert_eq!(dot(&one, &one), 2470.0);
    }
}
