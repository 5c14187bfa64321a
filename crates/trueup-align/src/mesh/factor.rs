//! The Cholesky factor of the vertices' normal matrix.
//!
//! Energies that turn and scale alike in all directions couple vertices as complex numbers: x + i y of one with a
//! factor of x + i y of the other. Where all do, as in a mesh that lines and pixels have not refined, the factor is
//! complex: half of the entries of a real one, and half of the multiplications.
//!
//! A factor that is very large, or serves rounds of refinement, is in single precision: half of the memory and of the
//! time. It then is a preconditioner, with which the solver comes to the same solution.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::{Perm, PermRef};
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::traits::ComplexField;
use faer::{Conj, c32, c64};

use super::normal_equations::PlacedBlock;

/// Real numbers of a factor beyond which it is in single precision where its solution is wanted to rounding: 134 MB of
/// double ones. Meshes of some eighty photographs of the working size have so many.
pub(super) const MOST_DOUBLES: usize = 1 << 24;

/// A lower triangle L with L L^H = A, as nearly as its numbers are precise.
#[derive(Debug)]
pub(super) enum VertexFactor {
    /// Of x + i y of the vertices.
    Complex(Triangle<c64>),
    /// Of x and y of the vertices in turn.
    Real(Triangle<f64>),
    /// As `Complex`, in single precision.
    SingleComplex(Triangle<c32>),
    /// As `Real`, in single precision.
    SingleReal(Triangle<f32>),
}

/// A factor's pattern and its entries.
#[derive(Debug)]
pub(super) struct Triangle<T> {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<T>,
}

impl VertexFactor {
    /// The factor of the matrix of so many `vertices`, given its `blocks`, of which every vertex has one with itself,
    /// in single precision if it has more than `most_doubles` real numbers; `None` if that is not positive definite, or
    /// its factor does not fit into memory.
    pub(super) fn new(vertices: usize, blocks: &[PlacedBlock], most_doubles: usize) -> Option<Self> {
        let order = elimination_order(vertices, blocks)?;
        if blocks.iter().all(|(_, _, block)| turns_and_scales(block)) {
            let (pattern, entries) = (complex_pattern(vertices, blocks)?, || complex_entries(blocks));
            let symbolic = symbolic_factor(&pattern, order.as_ref())?;
            if 2 * symbolic.len_val() > most_doubles {
                let single = |(cosine, sine): (f64, f64)| c32::new(cosine as f32, sine as f32);
                return Triangle::new(&pattern, entries().map(single).collect(), symbolic).map(Self::SingleComplex);
            }
            let double = |(cosine, sine)| c64::new(cosine, sine);
            return Triangle::new(&pattern, entries().map(double).collect(), symbolic).map(Self::Complex);
        }
        let (forward, inverse) = order.arrays();
        let both = |order: &[usize]| -> Box<[usize]> { order.iter().flat_map(|k| [2 * k, 2 * k + 1]).collect() };
        let order = Perm::new_checked(both(forward), both(inverse), 2 * vertices);
        let (pattern, entries) = (real_pattern(vertices, blocks)?, || real_entries(blocks));
        let symbolic = symbolic_factor(&pattern, order.as_ref())?;
        if symbolic.len_val() > most_doubles {
            let single = |entry: f64| entry as f32;
            return Triangle::new(&pattern, entries().map(single).collect(), symbolic).map(Self::SingleReal);
        }
        Triangle::new(&pattern, entries().collect(), symbolic).map(Self::Real)
    }

    /// Number of real unknowns.
    pub(super) fn unknowns(&self) -> usize {
        match self {
            Self::Complex(triangle) => 2 * triangle.symbolic.nrows(),
            Self::Real(triangle) => triangle.symbolic.nrows(),
            Self::SingleComplex(triangle) => 2 * triangle.symbolic.nrows(),
            Self::SingleReal(triangle) => triangle.symbolic.nrows(),
        }
    }

    /// Entries of a column, in the mean.
    pub(super) fn mean_column(&self) -> f64 {
        let (entries, columns) = match self {
            Self::Complex(triangle) => triangle.size(),
            Self::Real(triangle) => triangle.size(),
            Self::SingleComplex(triangle) => triangle.size(),
            Self::SingleReal(triangle) => triangle.size(),
        };
        entries as f64 / columns.max(1) as f64
    }

    /// Whether it is in single precision, and so no more than a preconditioner.
    pub(super) fn is_single(&self) -> bool {
        matches!(self, Self::SingleComplex(_) | Self::SingleReal(_))
    }

    /// Solves A x = `right`, x and y of the vertices in turn.
    pub(super) fn solve(&self, right: &faer::Mat<f64>) -> faer::Mat<f64> {
        match self {
            Self::Complex(triangle) => triangle.solve_places(right, c64::new, |place| [place.re, place.im]),
            Self::Real(triangle) => triangle.solve(right.clone()),
            Self::SingleComplex(triangle) => triangle.solve_places(
                right,
                |x, y| c32::new(x as f32, y as f32),
                |place| [place.re, place.im].map(f64::from),
            ),
            Self::SingleReal(triangle) => {
                let single = |row, column| right[(row, column)] as f32;
                let solution = triangle.solve(faer::Mat::from_fn(right.nrows(), right.ncols(), single));
                faer::Mat::from_fn(right.nrows(), right.ncols(), |row, column| f64::from(solution[(row, column)]))
            }
        }
    }
}

/// Whether a block acts on x and y as a complex number does on x + i y.
fn turns_and_scales(&[a, b, c, d]: &[f64; 4]) -> bool {
    a == d && b == -c
}

/// Where the lower triangle has entries, x and y of the vertices in turn; `None` if a vertex has no block with itself.
fn real_pattern(vertices: usize, blocks: &[PlacedBlock]) -> Option<SymbolicSparseColMat<usize>> {
    let mut column_starts = Vec::with_capacity(2 * vertices + 1);
    let mut rows = Vec::with_capacity(4 * blocks.len());
    column_starts.push(0);
    for group in blocks.chunk_by(|one, other| one.1 == other.1) {
        for side in 0..2 {
            for &(row, column, _) in group {
                if row != column || side == 0 {
                    rows.push(2 * row as usize);
                }
                rows.push(2 * row as usize + 1);
            }
            column_starts.push(rows.len());
        }
    }
    (column_starts.len() == 2 * vertices + 1)
        .then(|| SymbolicSparseColMat::new_checked(2 * vertices, 2 * vertices, column_starts, None, rows))
}

/// The entries at the places of [`real_pattern`].
fn real_entries(blocks: &[PlacedBlock]) -> impl Iterator<Item = f64> + '_ {
    blocks.chunk_by(|one, other| one.1 == other.1).flat_map(|group| {
        (0..2).flat_map(move |side| {
            group.iter().flat_map(move |&(row, column, block)| {
                let upper = (row != column || side == 0).then_some(block[side]);
                upper.into_iter().chain(std::iter::once(block[2 + side]))
            })
        })
    })
}

/// Where the lower triangle has entries in x + i y of the vertices; `None` if a vertex has no block with itself.
fn complex_pattern(vertices: usize, blocks: &[PlacedBlock]) -> Option<SymbolicSparseColMat<usize>> {
    let mut column_starts = Vec::with_capacity(vertices + 1);
    column_starts.push(0);
    let groups = blocks.chunk_by(|one, other| one.1 == other.1);
    column_starts.extend(groups.scan(0, |end, group| {
        *end += group.len();
        Some(*end)
    }));
    let rows = blocks.iter().map(|&(row, _, _)| row as usize).collect();
    (column_starts.len() == vertices + 1)
        .then(|| SymbolicSparseColMat::new_checked(vertices, vertices, column_starts, None, rows))
}

/// The entries at the places of [`complex_pattern`], real and imaginary part.
fn complex_entries(blocks: &[PlacedBlock]) -> impl Iterator<Item = (f64, f64)> + '_ {
    blocks.iter().map(|&(_, _, [cosine, _, sine, _])| (cosine, sine))
}

/// Where the factor of a matrix of such a lower triangle has entries.
fn symbolic_factor(lower: &SymbolicSparseColMat<usize>, order: PermRef<'_, usize>) -> Option<SymbolicCholesky<usize>> {
    let order = SymmetricOrdering::Custom(order);
    factorize_symbolic_cholesky(lower.as_ref(), faer::Side::Lower, order, Default::default()).ok()
}

impl<T: ComplexField> Triangle<T> {
    /// Numbers of entries and of columns.
    fn size(&self) -> (usize, usize) {
        (self.symbolic.len_val(), self.symbolic.nrows())
    }

    /// The factor of the matrix that has these entries at the places `lower` of its lower triangle.
    fn new(lower: &SymbolicSparseColMat<usize>, entries: Vec<T>, symbolic: SymbolicCholesky<usize>) -> Option<Self> {
        let (side, par) = (faer::Side::Lower, faer::Par::Seq);
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), faer::traits::math_utils::zero());
        let mut memory = scratch(symbolic.factorize_numeric_llt_scratch::<T>(par, Default::default()))?;
        let stack = MemStack::new(&mut memory);
        let lower = SparseColMatRef::new(lower.as_ref(), &entries);
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

    /// Solves A x = `right` for x and y of the vertices in turn, of which this type holds both.
    fn solve_places(
        &self,
        right: &faer::Mat<f64>,
        joined: impl Fn(f64, f64) -> T,
        parts: impl Fn(&T) -> [f64; 2],
    ) -> faer::Mat<f64> {
        let right = faer::Mat::from_fn(right.nrows() / 2, right.ncols(), |vertex, column| {
            joined(right[(2 * vertex, column)], right[(2 * vertex + 1, column)])
        });
        let solution = self.solve(right);
        faer::Mat::from_fn(2 * solution.nrows(), solution.ncols(), |row, column| {
            parts(&solution[(row / 2, column)])[row % 2]
        })
    }
}

/// The order in which the vertices are eliminated so that few couplings come about; both coordinates of each couple
/// with the same others.
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
    use super::super::normal_equations::{NormalEquations, WeightedVertex};
    use super::*;

    /// Against the equations themselves, in real numbers: once all turn and scale, once a vertex is held in one
    /// direction alone; in both precisions.
    #[test]
    fn the_factor_solves_its_own_matrix() {
        for most_doubles in [usize::MAX, 0] {
            solves_its_own_matrix(false, most_doubles);
            solves_its_own_matrix(true, most_doubles);
        }
    }

    fn solves_its_own_matrix(held_along: bool, most_doubles: usize) {
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
        let wanted: Vec<f64> = (0..equations.unknowns()).map(|k| (k as f64 * 0.7).sin()).collect();
        let mut right = faer::Mat::zeros(wanted.len(), 1);
        for &(row, column, block) in &blocks {
            let (row, column) = (2 * row as usize, 2 * column as usize);
            for (k, entry) in block.into_iter().enumerate() {
                let (row, column) = (row + k / 2, column + k % 2);
                right[(row, 0)] += entry * wanted[column];
                if row / 2 != column / 2 {
                    right[(column, 0)] += entry * wanted[row];
                }
            }
        }
        let factor = VertexFactor::new(grid.len(), &blocks, most_doubles).expect("positive definite");
        let found = factor.solve(&right);
        let is_real = matches!(factor, VertexFactor::Real(_) | VertexFactor::SingleReal(_));
        assert_eq!((factor.unknowns(), is_real, factor.is_single()), (wanted.len(), held_along, most_doubles == 0));
        let precision = if most_doubles == 0 { 1e-2 } else { 1e-10 };
        let farthest = (0..wanted.len()).map(|k| (found[(k, 0)] - wanted[k]).abs()).fold(0.0, f64::max);
        assert!(farthest < precision, "{farthest}");
    }
}
