//! Linear least squares over unit vectors (u_i, v_i) = (cos theta_i, sin theta_i): data terms and turns along edges.

use faer::linalg::solvers::Solve;
use nalgebra::{Matrix2, Rotation2};

use super::block_matrix::BlockMatrix;

/// A data term: weight (psi_i) and angle (alpha_i) of photograph `index`.
#[derive(Debug, Clone, Copy)]
pub(super) struct DataTerm {
    pub index: usize,
    pub angle: f64,
    pub weight: f64,
}

/// A turn term: weight * |Rot(turn) (u_i, v_i) - (u_j, v_j)|^2.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurnTerm {
    pub i: usize,
    pub j: usize,
    /// The expected theta_j - theta_i in radians.
    pub turn: f64,
    pub weight: f64,
}

/// The vectors (u_i, v_i) of least energy; `None` if the terms leave some undetermined.
///
/// Vectors are not normalized: a short one means that its terms contradict each other. Sparse Cholesky of a 2N x 2N
/// matrix.
///
/// # Source
/// The paper's eq. 7 and 9.
pub(super) fn solve_unit_vectors(count: usize, data: &[DataTerm], turns: &[TurnTerm]) -> Option<Vec<[f64; 2]>> {
    let mut matrix = BlockMatrix::<2>::zeros(count);
    let mut right = faer::Mat::<f64>::zeros(2 * count, 1);
    for term in data {
        let (sine, cosine) = term.angle.sin_cos();
        matrix.add(term.index, term.index, &(Matrix2::identity() * term.weight));
        right[(2 * term.index, 0)] += term.weight * cosine;
        right[(2 * term.index + 1, 0)] += term.weight * sine;
    }
    for term in turns {
        add_turn(&mut matrix, term);
    }
    let solution = matrix.factor()?.solve(&right);
    let vectors: Vec<[f64; 2]> =
        (0..count).map(|index| [solution[(2 * index, 0)], solution[(2 * index + 1, 0)]]).collect();
    vectors.iter().flatten().all(|value| value.is_finite()).then_some(vectors)
}

/// Adds w |A x_i - x_j|^2, A = Rot(turn): since A is orthogonal the diagonal blocks are w I and the others -w A.
fn add_turn(matrix: &mut BlockMatrix<2>, term: &TurnTerm) {
    let whole = Matrix2::identity() * term.weight;
    matrix.add(term.i, term.i, &whole);
    matrix.add(term.j, term.j, &whole);
    matrix.add(term.j, term.i, &(Rotation2::new(term.turn).matrix() * -term.weight));
}
