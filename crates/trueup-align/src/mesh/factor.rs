//! The Cholesky factor of the vertices' normal matrix.
//!
//! Energies that turn and scale alike in all directions couple vertices as complex numbers: x + i y of one with a factor of x + i y of the
//! other. Where all do, as in a mesh that lines and pixels have not refined, the factor is complex: half of the entries of a real one, and half
//! of the multiplications.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::{Perm, PermRef};
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::traits::ComplexField;
use faer::{Conj, c64};

use super::normal_equations::{NormalEquations, PlacedBlock};

/// A lower triangle L with L L^H = A.
#[derive(Debug)]
pub(super) enum VertexFactor {
    /// Of x + i y of the vertices.
    Complex(Triangle<c64>),
    /// Of x and y of the vertices in turn.
    Real(Triangle<f64>),
}

/// A factor's pattern and its entries.
#[derive(Debug)]
pub(super) struct Triangle<T> {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<T>,
}

impl VertexFactor {
    /// The factor of the matrix of `equations`, given its `blocks`; `None` if that is not positive definite, or its factor
    /// does not fit into memory.
    pub(super) fn new(equations: &NormalEquations, blocks: &[PlacedBlock]) -> Option<Self> {
        let vertices = equations.unknowns() / 2;
        let order = elimination_order(vertices, blocks)?;
        if blocks.iter().all(|(_, _, block)| turns_and_scales(block)) {
            let matrix = equations.complex_matrix(blocks)?;
            return Triangle::new(matrix.as_ref(), order.as_ref()).map(Self::Complex);
        }
        let (forward, inverse) = order.arrays();
        let both = |order: &[usize]| -> Box<[usize]> { order.iter().flat_map(|k| [2 * k, 2 * k + 1]).collect() };
        let order = Perm::new_checked(both(forward), both(inverse), 2 * vertices);
        Triangle::new(equations.matrix(blocks)?.as_ref(), order.as_ref()).map(Self::Real)
    }

    /// Number of real unknowns.
    pub(super) fn unknowns(&self) -> usize {
        match self {
            Self::Complex(triangle) => 2 * triangle.symbolic.nrows(),
            Self::Real(triangle) => triangle.symbolic.nrows(),
        }
    }

    /// Solves A x = `right`, x and y of the vertices in turn.
    pub(super) fn solve(&self, right: &faer::Mat<f64>) -> faer::Mat<f64> {
        match self {
            Self::Complex(triangle) => {
                let right = faer::Mat::from_fn(right.nrows() / 2, right.ncols(), |vertex, column| {
                    c64::new(right[(2 * vertex, column)], right[(2 * vertex + 1, column)])
                });
                let solution = triangle.solve(right);
                faer::Mat::from_fn(2 * solution.nrows(), solution.ncols(), |row, column| {
                    let place = solution[(row / 2, column)];
                    if row % 2 == 0 { place.re } else { place.im }
                })
            }
            Self::Real(triangle) => triangle.solve(right.clone()),
        }
    }
}

/// Whether a block acts on x and y as a complex number does on x + i y.
fn turns_and_scales(&[a, b, c, d]: &[f64; 4]) -> bool {
    a == d && b == -c
}

impl<T: ComplexField> Triangle<T> {
    /// The factor of the matrix with this lower triangle.
    fn new(lower: SparseColMatRef<'_, usize, T>, order: PermRef<'_, usize>) -> Option<Self> {
        let (side, par) = (faer::Side::Lower, faer::Par::Seq);
        let order = SymmetricOrdering::Custom(order);
        let symbolic = factorize_symbolic_cholesky(lower.symbolic(), side, order, Default::default()).ok()?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), faer::traits::math_utils::zero());
        let mut memory = scratch(symbolic.factorize_numeric_llt_scratch::<T>(par, Default::default()))?;
        let stack = MemStack::new(&mut memory);
        symbolic
            .factorize_numeric_llt(&mut values, lower, side, Default::default(), par, stack, Default::default())
            .ok()?;
        Some(Self { symbolic, values })
    }

    /// Solves A x = `right` in its place.
    fn solve(&self, mut right: faer::Mat<T>) -> faer::Mat<T> {
        let par = faer::Par::Seq;
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<T>(right.ncols(), par));
        let factor = LltRef::new(&self.symbolic, &self.values);
        factor.solve_in_place_with_conj(Conj::No, right.as_mut(), par, MemStack::new(&mut memory));
        right
    }
}

/// The order in which the vertices are eliminated so that few couplings come about; both coordinates of each couple with the same others.
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
    Some(Perm::new_checked(forward.into(), inverse.into(), vertices))
}

fn scratch(request: StackReq) -> Option<MemBuffer> {
    MemBuffer::try_new(request).ok()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use trueup_core::mesh::GridMesh;

    use super::super::metric::Metric;
    use super::super::normal_equations::WeightedVertex;
    use super::*;

    /// Against the equations themselves, in real numbers: once all turn and scale, once a vertex is held in one direction alone.
    #[test]
    fn the_factor_solves_its_own_matrix() {
        solves_its_own_matrix(false);
        solves_its_own_matrix(true);
    }

    fn solves_its_own_matrix(held_along: bool) {
        let grid = GridMesh::regular(400.0, 300.0, 20.0);
        let mut equations = NormalEquations::new(std::slice::from_ref(&grid));
        for vertex in 0..grid.len() {
            equations.add_inside(0, &[(vertex, Vector2::new(0.3 + 0.1 * (vertex % 4) as f64, 0.0))], Vector2::zeros());
            for other in [vertex + 1, vertex + grid.columns].into_iter().filter(|&other| other < grid.len()) {
                let edge = [(vertex, Vector2::new(1.0, 0.2)), (other, Vector2::new(-0.9, 0.1))];
                equations.add_inside(0, &edge, Vector2::zeros());
            }
        }
        if held_along {
            let metric = Metric::along(Vector2::new(0.6, 0.8), 0.5);
            let held = WeightedVertex { photograph: 0, vertex: 7, weight: 1.0 };
            equations.add_sum(&[held], metric, Vector2::new(0.1, 0.2));
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
        assert_eq!((factor.unknowns(), matches!(factor, VertexFactor::Real(_))), (wanted.len(), held_along));
        assert!((0..wanted.len()).all(|k| (found[(k, 0)] - wanted[k]).abs() < 1e-10));
    }
}
