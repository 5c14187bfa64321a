//! Linear least squares over unit vectors (u_i, v_i) = (cos theta_i, sin theta_i): data terms and turns along edges.

use nalgebra::{DMatrix, DVector};

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
/// Vectors are not normalized: a short one means that its terms contradict each other. Dense Cholesky of a 2N x 2N
/// matrix.
///
/// # Source
/// The paper's eq. 7 and 9.
pub(super) fn solve_unit_vectors(count: usize, data: &[DataTerm], turns: &[TurnTerm]) -> Option<Vec<[f64; 2]>> {
    let mut matrix = DMatrix::<f64>::zeros(2 * count, 2 * count);
    let mut right = DVector::<f64>::zeros(2 * count);
    for term in data {
        let (sine, cosine) = term.angle.sin_cos();
        for (offset, value) in [(0, cosine), (1, sine)] {
            matrix[(2 * term.index + offset, 2 * term.index + offset)] += term.weight;
            right[2 * term.index + offset] += term.weight * value;
        }
    }
    for term in turns {
        add_turn(&mut matrix, term);
    }
    let solution = matrix.cholesky()?.solve(&right);
    let vectors: Vec<[f64; 2]> = (0..count).map(|index| [solution[2 * index], solution[2 * index + 1]]).collect();
    vectors.iter().flatten().all(|value| value.is_finite()).then_some(vectors)
}

/// Adds w |A x_i - x_j|^2, A = Rot(turn): since A is orthogonal the diagonal blocks are w I and the others -w A.
fn add_turn(matrix: &mut DMatrix<f64>, term: &TurnTerm) {
    let (sine, cosine) = term.turn.sin_cos();
    let rotation = [[cosine, -sine], [sine, cosine]];
    for row in 0..2 {
        for index in [term.i, term.j] {
            matrix[(2 * index + row, 2 * index + row)] += term.weight;
        }
        for column in 0..2 {
            let entry = term.weight * rotation[row][column];
            matrix[(2 * term.j + row, 2 * term.i + column)] -= entry;
            matrix[(2 * term.i + column, 2 * term.j + row)] -= entry;
        }
    }
}
