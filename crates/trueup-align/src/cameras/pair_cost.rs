//! The cost of one pair in bundle adjustment, and its quadratic model.

use nalgebra::{Matrix2x3, Matrix3, SMatrix, SVector, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::cross_matrix;

use super::observations::PairObservations;

/// Unknowns of one pair: rotation of a, rotation of b, log focal length of a, of b.
pub(super) const LOCAL: usize = 8;
type LocalMatrix = SMatrix<f64, LOCAL, LOCAL>;
type LocalVector = SVector<f64, LOCAL>;

/// The quadratic model of one pair's cost.
pub(super) struct PairTerm {
    /// Weighted J^T J.
    pub normal: LocalMatrix,
    /// Weighted J^T r.
    pub gradient: LocalVector,
}

/// Huber's loss, quadratic up to the limit: rho and the weight rho'(e)/(2 e).
fn huber(error: f64, limit: f64) -> (f64, f64) {
    if error <= limit { (error * error, 1.0) } else { (limit * (2.0 * error - limit), limit / error) }
}

/// The cost of a pair: both directions of every match.
pub(super) fn pair_cost(cameras: &[Camera], pair: &PairObservations, huber_px: f64) -> f64 {
    let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
    let b_from_a = b.rotation() * a.rotation().transpose();
    let a_from_b = b_from_a.transpose();
    // A match behind a camera costs as much as one a photograph away: it must not look free.
    let behind = huber(b.principal_point[0].hypot(b.principal_point[1]) * 2.0, huber_px).0;
    let one_way = |from: &Camera, to: &Camera, turn: &Matrix3<f64>, source: [f64; 2], target: [f64; 2]| {
        to.project(turn * from.bearing(Vector2::from(source)))
            .map_or(behind, |place| huber((Vector2::from(target) - place).norm(), huber_px).0)
    };
    pair.matches
        .iter()
        .map(|m| one_way(a, b, &b_from_a, m.in_a, m.in_b) + one_way(b, a, &a_from_b, m.in_b, m.in_a))
        .sum()
}

impl PairTerm {
    /// Both directions of every match, linearized at these cameras.
    pub(super) fn new(cameras: &[Camera], pair: &PairObservations, huber_px: f64) -> Self {
        let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
        let b_from_a = b.rotation() * a.rotation().transpose();
        let a_from_b = b_from_a.transpose();
        let mut term = Self { normal: LocalMatrix::zeros(), gradient: LocalVector::zeros() };
        let there = Transfer {
            from: a,
            to: b,
            to_from_from: &b_from_a,
            columns: TransferColumns { from_rotation: 0, to_rotation: 3, from_focal: 6, to_focal: 7 },
        };
        let back = Transfer {
            from: b,
            to: a,
            to_from_from: &a_from_b,
            columns: TransferColumns { from_rotation: 3, to_rotation: 0, from_focal: 7, to_focal: 6 },
        };
        for one in &pair.matches {
            there.accumulate(&mut term, one.in_a, one.in_b, huber_px);
            back.accumulate(&mut term, one.in_b, one.in_a, huber_px);
        }
        term
    }
}

/// Where a transfer's unknowns are among the eight of its pair; rotations take three columns.
struct TransferColumns {
    from_rotation: usize,
    to_rotation: usize,
    from_focal: usize,
    to_focal: usize,
}

/// One direction of a pair: points of `from` are carried into `to`.
struct Transfer<'a> {
    from: &'a Camera,
    to: &'a Camera,
    /// Rotation from the frame of `from` to that of `to`.
    to_from_from: &'a Matrix3<f64>,
    columns: TransferColumns,
}

impl Transfer<'_> {
    /// Adds the linearized residual of a match of `source` with `target`.
    fn accumulate(&self, term: &mut PairTerm, source: [f64; 2], target: [f64; 2], huber_px: f64) {
        let Self { from, to, to_from_from, columns } = self;
        let bearing = from.bearing(Vector2::from(source));
        let arrived = *to_from_from * bearing;
        let Some(place) = to.project(arrived) else { return };
        let residual = Vector2::from(target) - place;
        let weight = huber(residual.norm(), huber_px).1;

        let (inverse_depth, focal_px) = (1.0 / arrived.z, to.focal_px);
        let projection = Matrix2x3::new(1.0, 0.0, -arrived.x * inverse_depth, 0.0, 1.0, -arrived.y * inverse_depth)
            * (focal_px * inverse_depth);
        // residual = target - projection(arrived), hence the minus signs.
        let by_to_rotation = projection * cross_matrix(&arrived);
        let by_from_rotation = -(projection * *to_from_from * cross_matrix(&bearing));
        let by_from_focal = projection * *to_from_from * Vector3::new(bearing.x, bearing.y, 0.0);
        let by_to_focal = -(place - Vector2::from(to.principal_point));

        let mut jacobian = SMatrix::<f64, 2, LOCAL>::zeros();
        jacobian.fixed_columns_mut::<3>(columns.from_rotation).copy_from(&by_from_rotation);
        jacobian.fixed_columns_mut::<3>(columns.to_rotation).copy_from(&by_to_rotation);
        jacobian.column_mut(columns.from_focal).copy_from(&by_from_focal);
        jacobian.column_mut(columns.to_focal).copy_from(&by_to_focal);
        term.normal += jacobian.transpose() * jacobian * weight;
        term.gradient += jacobian.transpose() * residual * weight;
    }
}
