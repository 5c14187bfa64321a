//! Turns of single cameras whose mean is zero: what segments and overlaps ask of them, and what these leave open.
//!
//! Minimizes sum_i w_i^T N_i w_i - 2 r_i^T w_i plus sum over overlaps of (w_i - w_j)^T information (w_i - w_j), subject
//! to sum_i c_i w_i = 0: in this mean those cameras count of which segments tell something, so that the others need not
//! turn against them to even out what they are asked. The overlaps tie each photograph to a few others, the condition
//! all to one another: with its multipliers it is eliminated by blocks, and so is the first photograph, without which
//! the others cannot turn together unseen.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use rayon::prelude::*;

use super::block_matrix::BlockMatrix;

/// Information, 1 / rad^2, that keeps turns where neither segments nor overlaps say anything: far less than either
/// says.
const HOLD: f64 = 1.0;
/// What segments tell of a photograph's turn for it to count in the mean of all turns, as a share of what they tell of
/// one in the mean. Counted by what they tell, ten rendered streets with parallax lean by 0.145 degrees in the mean
/// instead of 0.130.
const ENOUGH: f64 = 0.05;
/// Photographs whose columns of the inverse are found at once. A number of its own, so that the sums are the same for
/// any number of threads.
const AT_ONCE: usize = 16;

/// How sure an overlap is of the relative rotation of two cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RelativeCertainty {
    pub i: usize,
    pub j: usize,
    /// Inverse covariance of the relative rotation in the common frame, 1 / rad^2.
    pub information: Matrix3<f64>,
}

/// The equations' factor.
pub(super) struct TurnEquations {
    /// Of all photographs but the first.
    others: Llt<usize, f64>,
    /// What `others` solves the columns for that couple these with the first photograph and with the multipliers: three
    /// unknowns each, in three rows a photograph.
    along: Vec<SMatrix<f64, 3, 6>>,
    /// The inverse of what is left for the first photograph and the multipliers.
    last: Matrix6<f64>,
}

impl TurnEquations {
    /// The factor of the equations with `normals`, N_i of every photograph, and `overlaps`; `None` if they leave
    /// something undetermined or do not fit into memory.
    pub(super) fn new(normals: &[Matrix3<f64>], overlaps: &[RelativeCertainty]) -> Option<Self> {
        let count = normals.len().checked_sub(1).filter(|&others| others > 0)?;
        let shares = shares(normals);
        let mut others = BlockMatrix::<3>::zeros(count);
        let mut first = Matrix3::identity() * HOLD + normals[0];
        // Columns of the first photograph's three unknowns, then of the three multipliers.
        let mut border = vec![SMatrix::<f64, 3, 6>::zeros(); count];
        for (k, normal) in normals.iter().enumerate().skip(1) {
            others.add(k - 1, k - 1, &(normal + Matrix3::identity() * HOLD));
            border[k - 1].fixed_columns_mut::<3>(3).copy_from(&(Matrix3::identity() * shares[k]));
        }
        for &RelativeCertainty { i, j, information } in overlaps {
            for photograph in [i, j] {
                match photograph.checked_sub(1) {
                    Some(other) => others.add(other, other, &information),
                    None => first += information,
                }
            }
            match (i.min(j).checked_sub(1), i.max(j) - 1) {
                (Some(one), two) => others.add(two, one, &-information),
                (None, two) => {
                    let mut column = border[two].fixed_columns_mut::<3>(0);
                    column -= information;
                }
            }
        }
        let others = others.factor()?;
        let columns = faer::Mat::from_fn(3 * count, 6, |row, column| border[row / 3][(row % 3, column)]);
        let solved = others.solve(&columns);
        let along: Vec<SMatrix<f64, 3, 6>> =
            (0..count).map(|k| SMatrix::from_fn(|row, column| solved[(3 * k + row, column)])).collect();
        let mut last = Matrix6::zeros();
        last.fixed_view_mut::<3, 3>(0, 0).copy_from(&first);
        last.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * shares[0]));
        last.fixed_view_mut::<3, 3>(3, 0).copy_from(&(Matrix3::identity() * shares[0]));
        for (border, along) in border.iter().zip(&along) {
            last -= border.transpose() * along;
        }
        Some(Self { others, along, last: last.try_inverse()? })
    }

    /// The turns of least energy for the right sides r_i.
    pub(super) fn solve(&self, right: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let (first, others) = (right[0], &right[1..]);
        let column = faer::Mat::from_fn(3 * others.len(), 1, |row, _| others[row / 3][row % 3]);
        let alone = self.others.solve(&column);
        let mut left = Vector6::zeros();
        left.fixed_rows_mut::<3>(0).copy_from(&first);
        for (along, right) in self.along.iter().zip(others) {
            left -= along.tr_mul(right);
        }
        let last = self.last * left;
        let of_others = self.along.iter().enumerate().map(|(k, along)| {
            let alone = Vector3::from_fn(|row, _| alone[(3 * k + row, 0)]);
            alone - along * last
        });
        std::iter::once(last.fixed_rows::<3>(0).into_owned()).chain(of_others).collect()
    }

    /// The covariance of every turn, as far as N_i and the overlaps are inverse covariances.
    pub(super) fn covariances(&self) -> Vec<Matrix3<f64>> {
        let count = self.along.len();
        let starts: Vec<usize> = (0..count).step_by(AT_ONCE).collect();
        let of_some = |&start: &usize| -> Vec<Matrix3<f64>> {
            let some = start..(start + AT_ONCE).min(count);
            let unit = |row: usize, column: usize| f64::from(u8::from(row == 3 * start + column));
            let alone = self.others.solve(&faer::Mat::from_fn(3 * count, 3 * some.len(), unit));
            let of_one = |k: usize| {
                let own = Matrix3::from_fn(|row, column| alone[(3 * k + row, 3 * (k - start) + column)]);
                own + self.along[k] * self.last * self.along[k].transpose()
            };
            some.map(of_one).collect()
        };
        let others: Vec<Vec<Matrix3<f64>>> = starts.par_iter().map(of_some).collect();
        std::iter::once(self.last.fixed_view::<3, 3>(0, 0).into_owned()).chain(others.into_iter().flatten()).collect()
    }
}

/// What each photograph counts in the mean of all turns, c_i: 1 if the trace of N_i is at least [`ENOUGH`] of the mean
/// trace, else 0.
fn shares(normals: &[Matrix3<f64>]) -> Vec<f64> {
    let enough = ENOUGH * normals.iter().map(Matrix3::trace).sum::<f64>() / normals.len() as f64;
    normals.iter().map(|normal| if normal.trace() >= enough { 1.0 } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Overlaps of a ring of photographs, and one across.
    fn overlaps(count: usize) -> Vec<RelativeCertainty> {
        let pairs = (0..count).map(|k| (k, (k + 1) % count)).chain([(count / 2, 1)]);
        let information = |k: usize| {
            let slant = Vector3::new(1.0, 0.3 * k as f64, -0.5);
            Matrix3::from_diagonal(&Vector3::new(3e6, 2e6, 1e6)) + slant * slant.transpose() * 1e5
        };
        pairs.enumerate().map(|(k, (i, j))| RelativeCertainty { i, j, information: information(k) }).collect()
    }

    /// The whole matrix with the condition's multipliers, dense.
    fn dense(normals: &[Matrix3<f64>], overlaps: &[RelativeCertainty]) -> DMatrix<f64> {
        let turns = 3 * normals.len();
        let shares = shares(normals);
        let mut matrix = DMatrix::zeros(turns + 3, turns + 3);
        for (k, normal) in normals.iter().enumerate() {
            let mut block = matrix.fixed_view_mut::<3, 3>(3 * k, 3 * k);
            block += normal + Matrix3::identity();
            matrix.fixed_view_mut::<3, 3>(3 * k, turns).copy_from(&(Matrix3::identity() * shares[k]));
            matrix.fixed_view_mut::<3, 3>(turns, 3 * k).copy_from(&(Matrix3::identity() * shares[k]));
        }
        for one in overlaps {
            for (row, column, sign) in
                [(one.i, one.i, 1.0), (one.j, one.j, 1.0), (one.i, one.j, -1.0), (one.j, one.i, -1.0)]
            {
                let mut block = matrix.fixed_view_mut::<3, 3>(3 * row, 3 * column);
                block += one.information * sign;
            }
        }
        matrix
    }

    /// Against a dense inverse; once with segments in every photograph, once in a few, about the vertical alone.
    #[test]
    fn turns_and_covariances_are_those_of_the_whole_matrix() {
        const COUNT: usize = 40;
        for about_all in [true, false] {
            let normal = |k: usize| match (about_all, k % 7) {
                (true, _) => Matrix3::from_diagonal(&Vector3::new(4e5, 1e4 * (1 + k) as f64, 2e5)),
                (false, 3) => Matrix3::from_diagonal(&Vector3::new(4e5, 0.0, 2e5)),
                _ => Matrix3::zeros(),
            };
            let normals: Vec<Matrix3<f64>> = (0..COUNT).map(normal).collect();
            let right: Vec<Vector3<f64>> =
                (0..COUNT).map(|k| Vector3::from_fn(|row, _| 1e3 * ((3 * k + row) as f64).sin())).collect();
            let overlaps = overlaps(COUNT);
            let equations = TurnEquations::new(&normals, &overlaps).expect("determined");
            let inverse = dense(&normals, &overlaps).try_inverse().expect("determined");
            let all = DVector::from_iterator(
                3 * COUNT + 3,
                right.iter().flat_map(|right| right.iter().copied()).chain([0.0; 3]),
            );
            let expected = &inverse * all;
            let turns = equations.solve(&right);
            let mean: Vector3<f64> = turns.iter().zip(shares(&normals)).map(|(turn, share)| turn * share).sum();
            assert!(mean.norm() < 1e-10, "{mean}");
            for (k, (turn, covariance)) in turns.iter().zip(equations.covariances()).enumerate() {
                let off = (turn - expected.fixed_rows::<3>(3 * k)).norm() / expected.norm();
                assert!(off < 1e-8, "{k}: {off}");
                let expected = inverse.fixed_view::<3, 3>(3 * k, 3 * k).into_owned();
                let off = (covariance - expected).norm() / expected.norm();
                assert!(off < 1e-7, "{k}: {off}");
            }
        }
    }

    /// Of traces of 600, 14, 13 and 441, the mean is 267, of which a twentieth is 13.35; where segments tell nothing,
    /// all count.
    #[test]
    fn photographs_count_from_a_twentieth_of_the_mean_on() {
        let of = |traces: [f64; 4]| shares(&traces.map(|trace| Matrix3::from_diagonal(&Vector3::new(trace, 0.0, 0.0))));
        assert_eq!(of([600.0, 14.0, 13.0, 441.0]), [1.0, 1.0, 0.0, 1.0]);
        assert_eq!(of([0.0; 4]), [1.0; 4]);
    }

    /// By hand: three photographs in a row, of which the first two show segments that ask for turns of 0.02 and 0.01;
    /// the mean of both is taken off, and the third follows the second. With turns that sum to zero the third would be
    /// turned by 0.03 to the other side.
    #[test]
    fn a_camera_without_segments_follows_those_that_it_overlaps() {
        let normals = [Matrix3::identity() * 1e8, Matrix3::identity() * 1e8, Matrix3::zeros()];
        let right = [0.02, 0.01, 0.0].map(|turn| Vector3::new(turn * 1e8, 0.0, 0.0));
        let overlap = |i, j| RelativeCertainty { i, j, information: Matrix3::identity() * 1e4 };
        let turns = TurnEquations::new(&normals, &[overlap(0, 1), overlap(1, 2)]).expect("determined").solve(&right);
        for (turn, expected) in turns.iter().zip([0.005, -0.005, -0.005]) {
            assert!((turn.x - expected).abs() < 1e-4, "{turn} instead of {expected}");
        }
    }

    #[test]
    fn one_photograph_alone_does_not_turn() {
        assert!(TurnEquations::new(&[Matrix3::identity()], &[]).is_none());
        assert!(TurnEquations::new(&[], &[]).is_none());
    }
}
