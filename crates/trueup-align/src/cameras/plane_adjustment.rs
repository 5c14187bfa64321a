//! Bundle adjustment of cameras that move before a plane: focal lengths, rotations and places that bring all matches
//! together on it.
//!
//! A match's point in one photograph is carried to the plane, and from there into the other, both ways, as for rotating
//! cameras ([`super::bundle`]).
//!
//! # Departures
//! A camera's place is where its optical axis meets the plane, and the logarithm of its distance in focal lengths: of
//! photographs taken straight on, which leave the focal length open, none of these changes with it.

use faer::linalg::solvers::Solve;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::{cross_matrix, exp_rotation, nearest_rotation, rotation_about_z};
use trueup_core::{Result, StageContext};

use super::equations::{NormalEquations, NormalPattern, Pull};
use super::intrinsics::{FOCAL, IntrinsicsModel, LensState, RADIAL, standard_deviation};
use super::levenberg_marquardt::{self, LeastSquares, SETTLED};
use super::observations::{Observations, PairObservations};
use super::pair_cost::{Columns, PairTerm, huber};
use super::plane_camera::PlaneCamera;
use super::prior::CameraPrior;

/// Unknowns of one photograph: rotation about the plane's axes (3), the axis's point (2), the logarithm of the distance
/// in focal lengths, that of the focal length, and the lens's first radial term.
const OF_EACH: usize = 8;
/// Those of a photograph that no other shares.
const OWN: usize = 6;
const LOCAL: usize = 2 * OF_EACH;
/// First of the axis point's two.
const AXIS_POINT: usize = 3;
/// The logarithm of the distance.
const LN_DISTANCE: usize = 5;
/// The intrinsic unknowns that follow a photograph's own, among those of a camera.
const INTRINSIC: [usize; 2] = [FOCAL, RADIAL];

/// Standard deviation of a camera's tilt from the plane's normal, radians: people face what is flat. What all
/// photographs are tilted by alike is not told by photographs taken from afar; of others every match says more.
const TILT_SD: f64 = 0.17;

/// The state being refined, one entry a photograph. The plane's unit is a pixel of the anchor at its axis.
#[derive(Debug, Clone)]
pub(super) struct PlaneParameters {
    pub focal_px: Vec<f64>,
    pub lenses: Vec<LensState>,
    /// From the plane's frame to the camera.
    pub rotations: Vec<Matrix3<f64>>,
    pub axis_points: Vec<Vector2<f64>>,
    /// Of the distance in focal lengths.
    pub ln_distances: Vec<f64>,
}

impl PlaneParameters {
    pub(super) fn cameras(&self, priors: &[CameraPrior]) -> Vec<PlaneCamera> {
        let camera = |k: usize| PlaneCamera {
            camera: self.lenses[k].on(priors[k].camera(self.focal_px[k], &self.rotations[k])),
            axis_point: self.axis_points[k].into(),
            distance: self.focal_px[k] * self.ln_distances[k].exp(),
        };
        (0..priors.len()).map(camera).collect()
    }
}

/// The sum of squares that is minimized over [`PlaneParameters`].
pub(super) struct PlaneAdjustment<'a> {
    pub priors: &'a [CameraPrior],
    pub observations: &'a Observations,
    /// What the focal lengths are drawn towards, working pixels.
    pub start_focal_px: Vec<f64>,
    /// How strongly: their standard deviations, relative.
    pub focal_sd: Vec<f64>,
    /// The photograph that stays where it is: the gauge.
    pub anchor: usize,
    /// Whether cameras may look at the plane from aside; otherwise all look at it straight on, as a scanner does.
    pub may_tilt: bool,
}

impl PlaneAdjustment<'_> {
    /// Photographs taken straight on, each turned, scaled and moved so that the matches meet best; `None` if the
    /// overlaps leave one open. Linear in what is unknown.
    pub(super) fn straight_on(&self, lenses: Vec<LensState>) -> Option<PlaneParameters> {
        /// Of each of two photographs scale and turn as a complex number, and the place of its middle.
        const SIMILARITIES: usize = 8;
        let count = self.priors.len();
        let middle = |k: usize| Vector2::new(self.priors[k].frame.width / 2.0, self.priors[k].frame.height / 2.0);
        let of_pair = |pair: &PairObservations| -> Columns<SIMILARITIES> {
            std::array::from_fn(|local| {
                let photograph = if local < 4 { pair.a } else { pair.b };
                (photograph != self.anchor).then_some(4 * photograph + local % 4)
            })
        };
        let term = |pair: &PairObservations| {
            let mut term = PairTerm::<SIMILARITIES> { normal: SMatrix::zeros(), gradient: SVector::zeros() };
            for one in &pair.matches {
                let a = Vector2::from(one.in_a) - middle(pair.a);
                let b = Vector2::from(one.in_b) - middle(pair.b);
                let jacobian = SMatrix::<f64, 2, SIMILARITIES>::from_row_slice(&[
                    a.x, -a.y, 1.0, 0.0, -b.x, b.y, -1.0, 0.0, //
                    a.y, a.x, 0.0, 1.0, -b.y, -b.x, 0.0, -1.0,
                ]);
                // All start at 0 but the anchor, which is as it is.
                let of_anchor = |photograph: usize, point: Vector2<f64>| match photograph == self.anchor {
                    true => point,
                    false => Vector2::zeros(),
                };
                let residual = of_anchor(pair.a, a) - of_anchor(pair.b, b);
                term.normal += jacobian.transpose() * jacobian;
                term.gradient += jacobian.transpose() * residual;
            }
            term
        };
        let pattern = NormalPattern::new(4 * count, self.observations.pairs.iter().map(of_pair).collect()).ok()?;
        let terms: Vec<_> = self.observations.pairs.iter().map(term).collect();
        let equations = pattern.equations(&terms, &[])?;
        let solved = equations.factor(0.0)?.solve(-&equations.gradient);
        let entry = |photograph: usize, which: usize| match (photograph == self.anchor, which) {
            (true, 0) => 1.0,
            (true, _) => 0.0,
            (false, which) => solved[(4 * photograph + which, 0)],
        };
        let factors: Vec<Vector2<f64>> = (0..count).map(|k| Vector2::new(entry(k, 0), entry(k, 1))).collect();
        let ln_distances: Vec<f64> = factors.iter().map(|factor| factor.norm().ln()).collect();
        ln_distances.iter().all(|one| one.is_finite()).then(|| PlaneParameters {
            focal_px: self.start_focal_px.clone(),
            lenses,
            rotations: factors.iter().map(|factor| rotation_about_z(-factor.y.atan2(factor.x))).collect(),
            axis_points: (0..count).map(|k| Vector2::new(entry(k, 2), entry(k, 3))).collect(),
            ln_distances,
        })
    }

    /// Refines `parameters` until the cost settles; `huber_px` bounds the influence of a single match.
    ///
    /// # Errors
    /// [`trueup_core::Error::Unsolvable`] if memory does not suffice; [`trueup_core::Error::Cancelled`].
    pub(super) fn minimize(
        &self,
        parameters: PlaneParameters,
        model: &IntrinsicsModel,
        huber_px: f64,
        context: &StageContext,
    ) -> Result<PlaneParameters> {
        let columns = self.observations.pairs.iter().map(|pair| self.columns(pair, model)).collect();
        let pattern = NormalPattern::new(OWN * self.priors.len() + model.parameters, columns)?;
        levenberg_marquardt::minimize(&Pass { problem: self, model, huber_px, pattern }, parameters, SETTLED, context)
    }

    /// The sum of squares that is minimized.
    pub(super) fn cost(&self, parameters: &PlaneParameters, model: &IntrinsicsModel, huber_px: f64) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let costs: Vec<f64> =
            self.observations.pairs.par_iter().map(|pair| pair_cost(&cameras, pair, huber_px)).collect();
        let pulls: f64 = self.pulls(parameters, model).iter().map(|pull| pull.residual * pull.residual).sum();
        costs.iter().sum::<f64>() + pulls
    }

    /// Columns of a pair's local unknowns in the global system; `None` is held fixed.
    fn columns(&self, pair: &PairObservations, model: &IntrinsicsModel) -> Columns<LOCAL> {
        std::array::from_fn(|local| {
            let photograph = if local < OF_EACH { pair.a } else { pair.b };
            self.column(photograph, local % OF_EACH, model)
        })
    }

    /// The anchor may tilt; its turn in the plane, its axis's point and its distance are the gauge.
    fn column(&self, photograph: usize, unknown: usize, model: &IntrinsicsModel) -> Option<usize> {
        match unknown {
            0 | 1 => self.may_tilt.then_some(OWN * photograph + unknown),
            2..OWN => (photograph != self.anchor).then_some(OWN * photograph + unknown),
            _ => model.parameters_of[photograph][INTRINSIC[unknown - OWN]]
                .map(|parameter| OWN * self.priors.len() + parameter),
        }
    }

    /// Pulls of the focal lengths towards their start values, of lens terms towards 0, and of the axes towards the
    /// normal.
    fn pulls(&self, parameters: &PlaneParameters, model: &IntrinsicsModel) -> Vec<Pull> {
        let of_photograph = |k: usize| {
            let stretch = (parameters.focal_px[k] / self.start_focal_px[k]).ln();
            let radial_sd = standard_deviation(RADIAL, &self.priors[k].frame);
            let focal = self.column(k, OWN, model).map(|column| Pull::new(column, stretch, self.focal_sd[k]));
            let lens = self
                .column(k, OWN + 1, model)
                .map(|column| Pull::new(column, parameters.lenses[k].term(RADIAL), radial_sd));
            // A small turn about the plane's own axes moves the optical axis across: about x down, about y to the left.
            let axis = parameters.rotations[k].row(2).transpose();
            let tilt = |about: usize, aside: f64, slope: f64| {
                let column = self.column(k, about, model);
                column.map(|column| Pull { column, residual: aside / TILT_SD, slope: slope / TILT_SD })
            };
            [focal, lens, tilt(0, axis.y, axis.z), tilt(1, axis.x, -axis.z)].into_iter().flatten()
        };
        (0..self.priors.len()).flat_map(of_photograph).collect()
    }

    fn moved(&self, parameters: &PlaneParameters, model: &IntrinsicsModel, step: &faer::Mat<f64>) -> PlaneParameters {
        let mut moved = parameters.clone();
        for k in 0..self.priors.len() {
            let by = |unknown: usize| self.column(k, unknown, model).map_or(0.0, |column| step[(column, 0)]);
            let turn = exp_rotation(&Vector3::new(by(0), by(1), by(2)));
            moved.rotations[k] = nearest_rotation(&(parameters.rotations[k] * turn));
            moved.axis_points[k] += Vector2::new(by(AXIS_POINT), by(AXIS_POINT + 1));
            moved.ln_distances[k] += by(LN_DISTANCE);
            moved.focal_px[k] = self.priors[k].believable_focal_px(parameters.focal_px[k] * by(OWN).exp());
            moved.lenses[k].add(RADIAL, by(OWN + 1));
        }
        moved
    }
}

/// One pass of minimization.
struct Pass<'a> {
    problem: &'a PlaneAdjustment<'a>,
    model: &'a IntrinsicsModel,
    huber_px: f64,
    pattern: NormalPattern<LOCAL>,
}

impl LeastSquares for Pass<'_> {
    type State = PlaneParameters;

    fn cost(&self, parameters: &PlaneParameters) -> f64 {
        self.problem.cost(parameters, self.model, self.huber_px)
    }

    fn equations(&self, parameters: &PlaneParameters) -> Option<NormalEquations> {
        let cameras = parameters.cameras(self.problem.priors);
        let pairs = &self.problem.observations.pairs;
        let terms: Vec<PairTerm<LOCAL>> =
            pairs.par_iter().map(|pair| pair_term(&cameras, pair, self.huber_px)).collect();
        self.pattern.equations(&terms, &self.problem.pulls(parameters, self.model))
    }

    fn moved(&self, parameters: &PlaneParameters, step: &faer::Mat<f64>) -> PlaneParameters {
        self.problem.moved(parameters, self.model, step)
    }
}

/// The cost of a pair: both directions of every match.
fn pair_cost(cameras: &[PlaneCamera], pair: &PairObservations, huber_px: f64) -> f64 {
    let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
    // What looks past the plane costs as much as a match a photograph away: it must not look free.
    let past = huber(2.0 * Vector2::from(b.camera.principal_point).norm(), huber_px).0;
    let one_way = |from: &PlaneCamera, to: &PlaneCamera, source: [f64; 2], target: [f64; 2]| {
        from.transfer(to, Vector2::from(source))
            .map_or(past, |place| huber((Vector2::from(target) - place).norm(), huber_px).0)
    };
    pair.matches.iter().map(|m| one_way(a, b, m.in_a, m.in_b) + one_way(b, a, m.in_b, m.in_a)).sum()
}

/// Both directions of every match of a pair, linearized at these cameras.
fn pair_term(cameras: &[PlaneCamera], pair: &PairObservations, huber_px: f64) -> PairTerm<LOCAL> {
    let (a, b) = (&cameras[pair.a], &cameras[pair.b]);
    let mut term = PairTerm { normal: SMatrix::zeros(), gradient: SVector::zeros() };
    for one in &pair.matches {
        let there = linearized(a, b, one.in_a, one.in_b).map(|(residual, from, to)| (residual, [from, to]));
        let back = linearized(b, a, one.in_b, one.in_a).map(|(residual, from, to)| (residual, [to, from]));
        for (residual, [by_a, by_b]) in there.into_iter().chain(back) {
            let mut jacobian = SMatrix::<f64, 2, LOCAL>::zeros();
            jacobian.fixed_columns_mut::<OF_EACH>(0).copy_from(&by_a);
            jacobian.fixed_columns_mut::<OF_EACH>(OF_EACH).copy_from(&by_b);
            let weight = huber(residual.norm(), huber_px).1;
            term.normal += jacobian.transpose() * jacobian * weight;
            term.gradient += jacobian.transpose() * residual * weight;
        }
    }
    term
}

type ByUnknowns = SMatrix<f64, 2, OF_EACH>;

/// The distance of `target` in `to` from where the plane has the pixel `source` of `from`, and how it moves with the
/// unknowns of both.
///
/// A pixel of `from` stays where it is: its place on the plane moves so as to undo what the unknowns do to the pixel.
fn linearized(
    from: &PlaneCamera,
    to: &PlaneCamera,
    source: [f64; 2],
    target: [f64; 2],
) -> Option<(Vector2<f64>, ByUnknowns, ByUnknowns)> {
    let place = from.place(Vector2::from(source))?;
    let leaving = PixelDerivatives::at(from, place)?;
    let arriving = PixelDerivatives::at(to, place)?;
    let carried = arriving.by_place * leaving.by_place.try_inverse()?;
    Some((Vector2::from(target) - arriving.pixel, carried * leaving.by_unknowns, -arriving.by_unknowns))
}

/// How the pixel of a place on the plane moves.
struct PixelDerivatives {
    pixel: Vector2<f64>,
    by_place: Matrix2<f64>,
    by_unknowns: ByUnknowns,
}

impl PixelDerivatives {
    fn at(camera: &PlaneCamera, place: Vector2<f64>) -> Option<Self> {
        let derivatives = camera.camera.projection_derivatives(camera.seen(place))?;
        let rotation = camera.camera.rotation();
        let by_bearing = derivatives.by_bearing;
        let from_axis = (place - Vector2::from(camera.axis_point)).push(0.0);
        let by_place = camera.pixel_by_place(&by_bearing);
        // The distance is a number of focal lengths, and grows with these.
        let by_distance = by_bearing.column(2) * camera.distance;
        let mut by_unknowns = ByUnknowns::zeros();
        by_unknowns.fixed_columns_mut::<3>(0).copy_from(&-(by_bearing * rotation * cross_matrix(&from_axis)));
        by_unknowns.fixed_columns_mut::<2>(AXIS_POINT).copy_from(&-by_place);
        by_unknowns.set_column(LN_DISTANCE, &by_distance);
        by_unknowns.set_column(OWN, &(derivatives.by_intrinsics.column(FOCAL) + by_distance));
        by_unknowns.set_column(OWN + 1, &derivatives.by_intrinsics.column(RADIAL));
        Some(Self { pixel: derivatives.pixel, by_place, by_unknowns })
    }
}

#[cfg(test)]
#[path = "plane_adjustment_tests.rs"]
mod tests;
