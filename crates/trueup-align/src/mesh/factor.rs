//! The Cholesky factor of the vertices' normal matrix.

use faer::Conj;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::Perm;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};

use super::normal_equations::{NormalEquations, PlacedBlock};

/// A lower triangle L with L L^T = A.
#[derive(Debug)]
pub(super) struct VertexFactor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
}

impl VertexFactor {
    /// The factor of the matrix of `equations`, given its `blocks`; `None` if that is not positive definite, or its factor
    /// does not fit into memory.
    pub(super) fn new(equations: &NormalEquations, blocks: &[PlacedBlock]) -> Option<Self> {
        let (side, par) = (faer::Side::Lower, faer::Par::Seq);
        let matrix = equations.matrix(blocks)?;
        let order = elimination_order(equations.unknowns() / 2, blocks)?;
        let order = SymmetricOrdering::Custom(order.as_ref());
        let symbolic = factorize_symbolic_cholesky(matrix.symbolic(), side, order, Default::default()).ok()?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), 0.0);
        let mut memory = scratch(symbolic.factorize_numeric_llt_scratch::<f64>(par, Default::default()))?;
        let (stack, matrix) = (MemStack::new(&mut memory), matrix.as_ref());
        symbolic
            .factorize_numeric_llt(&mut values, matrix, side, Default::default(), par, stack, Default::default())
            .ok()?;
        Some(Self { symbolic, values })
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Solves A x = `right`.
    pub(super) fn solve(&self, right: &faer::Mat<f64>) -> faer::Mat<f64> {
        let par = faer::Par::Seq;
        let mut solution = right.clone();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(right.ncols(), par));
        let factor = LltRef::new(&self.symbolic, &self.values);
        factor.solve_in_place_with_conj(Conj::No, solution.as_mut(), par, MemStack::new(&mut memory));
        solution
    }
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
}
