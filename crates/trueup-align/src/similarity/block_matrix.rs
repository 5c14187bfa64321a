//! Symmetric matrices of which each photograph has a block, sparse: its unknowns meet those of the photographs that
//! overlap it.

use std::collections::BTreeMap;

use faer::Side;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use nalgebra::SMatrix;

/// A symmetric matrix of `SIZE` unknowns a photograph.
#[derive(Debug, Clone)]
pub(super) struct BlockMatrix<const SIZE: usize> {
    diagonal: Vec<SMatrix<f64, SIZE, SIZE>>,
    /// By row and column, the row after the column.
    below: BTreeMap<(usize, usize), SMatrix<f64, SIZE, SIZE>>,
}

impl<const SIZE: usize> BlockMatrix<SIZE> {
    /// Zero, of so many photographs.
    pub(super) fn zeros(photographs: usize) -> Self {
        Self { diagonal: vec![SMatrix::zeros(); photographs], below: BTreeMap::new() }
    }

    /// Adds to the block of two photographs; of two different ones, the transposed block to that beyond the diagonal.
    pub(super) fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, SIZE, SIZE>) {
        match row.cmp(&column) {
            std::cmp::Ordering::Equal => self.diagonal[row] += block,
            std::cmp::Ordering::Greater => *self.below.entry((row, column)).or_insert_with(SMatrix::zeros) += block,
            std::cmp::Ordering::Less => self.add(column, row, &block.transpose()),
        }
    }

    /// The Cholesky factor; `None` if the matrix is not positive definite, or the factor does not fit into memory.
    pub(super) fn factor(&self) -> Option<Llt<usize, f64>> {
        let entries = |row: usize, column: usize, block: &SMatrix<f64, SIZE, SIZE>| {
            let block = *block;
            let places = (0..SIZE).flat_map(|i| (0..SIZE).map(move |j| (i, j)));
            let triplets = places.map(move |(i, j)| Triplet::new(SIZE * row + i, SIZE * column + j, block[(i, j)]));
            triplets.filter(|entry| entry.row >= entry.col)
        };
        let diagonal = self.diagonal.iter().enumerate().flat_map(|(k, block)| entries(k, k, block));
        let below = self.below.iter().flat_map(|(&(row, column), block)| entries(row, column, block));
        let lower: Vec<Triplet<usize, usize, f64>> = diagonal.chain(below).collect();
        let unknowns = SIZE * self.diagonal.len();
        let lower = SparseColMat::try_new_from_triplets(unknowns, unknowns, &lower).ok()?;
        lower.sp_cholesky(Side::Lower).ok()
    }
}

#[cfg(test)]
mod tests {
    use faer::linalg::solvers::Solve;
    use nalgebra::Matrix2;

    use super::*;

    /// [[4, 1, 0, 2], [1, 5, 0, 0], [0, 0, 3, 0], [2, 0, 0, 6]] times (1, 2, 3, 4) is (14, 11, 9, 26), by hand; the
    /// coupling given once from above the diagonal.
    #[test]
    fn blocks_solve_what_their_matrix_says() {
        let mut matrix = BlockMatrix::<2>::zeros(2);
        matrix.add(0, 0, &Matrix2::new(4.0, 1.0, 1.0, 5.0));
        matrix.add(1, 1, &Matrix2::new(3.0, 0.0, 0.0, 6.0));
        matrix.add(0, 1, &Matrix2::new(0.0, 2.0, 0.0, 0.0));
        let right = faer::mat![[14.0], [11.0], [9.0], [26.0]];
        let solution = matrix.factor().expect("positive definite").solve(&right);
        for (k, expected) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            assert!((solution[(k, 0)] - expected).abs() < 1e-12, "{solution:?}");
        }
        matrix.add(0, 0, &Matrix2::new(-9.0, 0.0, 0.0, 0.0));
        assert!(matrix.factor().is_none());
    }
}
