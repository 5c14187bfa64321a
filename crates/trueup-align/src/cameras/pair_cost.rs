//! The cost of one pair in bundle adjustment, and its quadratic model.

use nalgebra::{Matrix2x3, Matrix3, SMatrix, SVector, Vector2, Vector3};
use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::geometry::cross_matrix;
use trueup_core::matches::PointMatch;

use super::observations::PairObservations;

/// Unknowns of one pair of pinholes: rotation of a, rotation of b, log focal length of a, of b.
pub(super) const PINHOLE_LOCAL: usize = 8;
/// Unknowns of one pair with lenses: rotation of a, rotation of b, all intrinsics of a, of b.
pub(super) const LENS_LOCAL: usize = 6 + 2 * INTRINSICS;

/// Columns of a pair's local unknowns in the global system; `None` is held fixed.
pub(super) type Columns<const LOCAL: usize> = [Option<usize>; LOCAL];

/// The quadratic model of one pair's cost.
pub(super) struct PairTerm<const LOCAL: usize> {
    /// Weighted J^T J.
    pub normal: SMatrix<f64, LOCAL, LOCAL>,
    /// Weighted J^T r.
    pub gradient: SVector<f64, LOCAL>,
}

/// Huber's loss, quadratic up to the limit: rho and the weight rho'(e)/(2 e).
pub(super) fn huber(error: f64, limit: f64) -> (f64, f64) {
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

/// How far a pair's matches lie from where the cameras put them, working pixels, both directions; those behind a camera
/// infinitely far.
pub(super) fn pair_distances(cameras: &[Camera], pair: &PairObservations) -> Vec<f64> {
    let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
    let distance = |from: &Camera, to: &Camera, source: [f64; 2], target: [f64; 2]| {
        from.transfer(to, Vector2::from(source)).map_or(f64::INFINITY, |place| (Vector2::from(target) - place).norm())
    };
    let both = |m: &PointMatch| [distance(a, b, m.in_a, m.in_b), distance(b, a, m.in_b, m.in_a)];
    pair.matches.iter().flat_map(both).collect()
}

impl<const LOCAL: usize> PairTerm<LOCAL> {
    /// The model of a cost that says nothing.
    pub(super) fn zero() -> Self {
        Self { normal: SMatrix::zeros(), gradient: SVector::zeros() }
    }

    /// Both directions of every match, linearized at these cameras; of unknowns that are held fixed, those without a
    /// column, nothing is said.
    pub(super) fn new(cameras: &[Camera], pair: &PairObservations, columns: &Columns<LOCAL>, huber_px: f64) -> Self {
        let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
        let b_from_a = b.rotation() * a.rotation().transpose();
        let a_from_b = b_from_a.transpose();
        let mut sums = FreeSums::new(columns);
        let second = 6 + (LOCAL - 6) / 2;
        let there = Transfer {
            from: a,
            to: b,
            to_from_from: &b_from_a,
            columns: TransferColumns { from_rotation: 0, to_rotation: 3, from_intrinsics: 6, to_intrinsics: second },
        };
        let back = Transfer {
            from: b,
            to: a,
            to_from_from: &a_from_b,
            columns: TransferColumns { from_rotation: 3, to_rotation: 0, from_intrinsics: second, to_intrinsics: 6 },
        };
        for one in &pair.matches {
            there.accumulate(&mut sums, one.in_a, one.in_b, huber_px);
            back.accumulate(&mut sums, one.in_b, one.in_a, huber_px);
        }
        sums.term()
    }
}

/// The sums of a term over the unknowns that are free, which lie beside each other: often a third of all.
struct FreeSums<const LOCAL: usize> {
    /// The free unknowns, those of the first `count` places.
    free: [usize; LOCAL],
    count: usize,
    /// Weighted J^T J, its lower triangle row by row; nothing beyond `count`.
    normal: [[f64; LOCAL]; LOCAL],
    /// Weighted J^T r.
    gradient: [f64; LOCAL],
}

impl<const LOCAL: usize> FreeSums<LOCAL> {
    fn new(columns: &Columns<LOCAL>) -> Self {
        let mut sums = Self { free: [0; LOCAL], count: 0, normal: [[0.0; LOCAL]; LOCAL], gradient: [0.0; LOCAL] };
        for (local, _) in columns.iter().enumerate().filter(|(_, column)| column.is_some()) {
            sums.free[sums.count] = local;
            sums.count += 1;
        }
        sums
    }

    fn add(&mut self, jacobian: &SMatrix<f64, 2, LOCAL>, residual: Vector2<f64>, weight: f64) {
        let mut rows = [[0.0; LOCAL]; 2];
        for (place, &local) in self.free[..self.count].iter().enumerate() {
            [rows[0][place], rows[1][place]] = [jacobian[(0, local)], jacobian[(1, local)]];
        }
        for place in 0..self.count {
            let [x, y] = [rows[0][place] * weight, rows[1][place] * weight];
            let others = rows[0][..=place].iter().zip(&rows[1][..=place]);
            for (sum, (other_x, other_y)) in self.normal[place][..=place].iter_mut().zip(others) {
                *sum += x * other_x + y * other_y;
            }
            self.gradient[place] += x * residual.x + y * residual.y;
        }
    }

    fn term(&self) -> PairTerm<LOCAL> {
        let mut term = PairTerm::zero();
        let free = &self.free[..self.count];
        for (place, &row) in free.iter().enumerate() {
            for (&column, &sum) in free.iter().zip(&self.normal[place][..=place]) {
                term.normal[(row, column)] = sum;
                term.normal[(column, row)] = sum;
            }
            term.gradient[row] = self.gradient[place];
        }
        term
    }
}

/// Where a transfer's unknowns start among those of its pair; rotations take three columns, intrinsics one or all.
struct TransferColumns {
    from_rotation: usize,
    to_rotation: usize,
    from_intrinsics: usize,
    to_intrinsics: usize,
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
    fn accumulate<const LOCAL: usize>(
        &self,
        sums: &mut FreeSums<LOCAL>,
        source: [f64; 2],
        target: [f64; 2],
        huber_px: f64,
    ) {
        let bearing = self.from.bearing(Vector2::from(source));
        let arrived = *self.to_from_from * bearing;
        let placed: Option<(Vector2<f64>, SMatrix<f64, 2, LOCAL>)> = match LOCAL {
            PINHOLE_LOCAL => {
                self.to.project(arrived).map(|place| (place, self.pinhole_jacobian(bearing, arrived, place)))
            }
            _ => self.by_lenses(bearing, arrived),
        };
        if let Some((place, jacobian)) = placed {
            let residual = Vector2::from(target) - place;
            sums.add(&jacobian, residual, huber(residual.norm(), huber_px).1);
        }
    }

    /// How the residual of two pinholes changes with the rotations and the focal lengths.
    fn pinhole_jacobian<const LOCAL: usize>(
        &self,
        bearing: Vector3<f64>,
        arrived: Vector3<f64>,
        place: Vector2<f64>,
    ) -> SMatrix<f64, 2, LOCAL> {
        let Self { to, to_from_from, columns, .. } = self;
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
        jacobian.column_mut(columns.from_intrinsics).copy_from(&by_from_focal);
        jacobian.column_mut(columns.to_intrinsics).copy_from(&by_to_focal);
        jacobian
    }

    /// The place, and how the residual changes with the rotations and all intrinsics. `None` where a lens does not
    /// tell.
    ///
    /// A pixel of `from` stays where it is: its bearing moves so as to undo what the intrinsics do to the pixel.
    fn by_lenses<const LOCAL: usize>(
        &self,
        bearing: Vector3<f64>,
        arrived: Vector3<f64>,
    ) -> Option<(Vector2<f64>, SMatrix<f64, 2, LOCAL>)> {
        let Self { from, to, to_from_from, columns } = self;
        let (leaving, arriving) = (from.projection_derivatives(bearing)?, to.projection_derivatives(arrived)?);
        let projection = arriving.by_bearing;
        let by_bearing = projection * *to_from_from;
        let by_from_intrinsics = by_bearing * leaving.bearing_by_pixel()? * leaving.by_intrinsics;

        let mut jacobian = SMatrix::<f64, 2, LOCAL>::zeros();
        jacobian.fixed_columns_mut::<3>(columns.from_rotation).copy_from(&-(by_bearing * cross_matrix(&bearing)));
        jacobian.fixed_columns_mut::<3>(columns.to_rotation).copy_from(&(projection * cross_matrix(&arrived)));
        jacobian.fixed_columns_mut::<INTRINSICS>(columns.from_intrinsics).copy_from(&by_from_intrinsics);
        jacobian.fixed_columns_mut::<INTRINSICS>(columns.to_intrinsics).copy_from(&-arriving.by_intrinsics);
        Some((arriving.pixel, jacobian))
    }
}
