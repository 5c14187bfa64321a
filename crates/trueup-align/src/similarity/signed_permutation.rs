//! Which of a triad's directions belongs to which of another's, and with which sign.

use nalgebra::Matrix3;

/// The six orders of three directions.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The columns of `triad` in the order and with the signs that bring them closest to those of `frame`, and the sum of
/// squared distances r = 6 - 2 max_p sum_k |d_k . v_p(k)|, at least 0.
///
/// For orthonormal triads r = 4 (1 - cos of the misorientation). Determinants do not matter: signs are chosen per
/// column.
pub(super) fn match_triad(frame: &Matrix3<f64>, triad: &Matrix3<f64>) -> (Matrix3<f64>, f64) {
    let cosines = frame.tr_mul(triad);
    let (order, agreement) = best_order(&cosines);
    let columns: [_; 3] = std::array::from_fn(|k| {
        let sign = if cosines[(k, order[k])] >= 0.0 { 1.0 } else { -1.0 };
        triad.column(order[k]) * sign
    });
    (Matrix3::from_columns(&columns), (6.0 - 2.0 * agreement).max(0.0))
}

/// The residual of [`match_triad`] alone.
pub(super) fn triad_residual(frame: &Matrix3<f64>, triad: &Matrix3<f64>) -> f64 {
    (6.0 - 2.0 * best_order(&frame.tr_mul(triad)).1).max(0.0)
}

fn best_order(cosines: &Matrix3<f64>) -> ([usize; 3], f64) {
    let mut best = (ORDERS[0], f64::NEG_INFINITY);
    for order in ORDERS {
        let agreement = (0..3).map(|k| cosines[(k, order[k])].abs()).sum();
        if agreement > best.1 {
            best = (order, agreement);
        }
    }
    best
}
