//! Bundle adjustment: rotations and focal lengths that bring all matches together, by Levenberg-Marquardt on sparse
//! normal equations.
//!
//! # Source
//! Brown and Lowe (2007), equations 14 to 18: both directions of every match, Huber loss.
//!
//! # Departures
//! The unknown of a focal length is its logarithm, so that steps are relative and the sign is safe.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::statistics::median;
use trueup_core::{Result, StageContext};

use super::equations::{NormalEquations, NormalPattern, Pull};
use super::intrinsics::{FOCAL, IntrinsicsModel, LensState, standard_deviation};
use super::levenberg_marquardt::{self, LeastSquares, SETTLED};
use super::observations::{Observations, PairObservations};
use super::pair_cost::{Columns, LENS_LOCAL, PINHOLE_LOCAL, PairTerm, pair_cost, pair_distances};
use super::prior::CameraPrior;
use super::straightness::{CurveObservations, CurveTerm, curve_cost};

/// Distance in working pixels beyond which the influence of a match grows only linearly, in the first pass: the start
/// values are that far off.
pub(super) const COARSE_HUBER_PX: f64 = 20.0;
/// The same in the final pass, working pixels: a few times the error of a match.
pub(super) const FINE_HUBER_PX: f64 = 2.0;
/// Smallest limit of the sharp pass, working pixels: features are hardly found more exactly, and below it the loss has
/// corners that steps stumble over.
const LEAST_SHARP_HUBER_PX: f64 = 0.15;
/// A focal length within this factor of the shortest believed one was stopped there.
const STOPPED_SHORT: f64 = 1.001;

/// The state being refined.
#[derive(Debug, Clone)]
pub(super) struct Parameters {
    pub focal_px: Vec<f64>,
    pub rotations: Vec<Matrix3<f64>>,
    pub lenses: Vec<LensState>,
}

impl Parameters {
    /// The cameras of this state.
    pub(super) fn cameras(&self, priors: &[CameraPrior]) -> Vec<Camera> {
        (0..priors.len()).map(|k| self.lenses[k].on(priors[k].camera(self.focal_px[k], &self.rotations[k]))).collect()
    }

    /// Whether any lens bends, or is off center.
    pub(super) fn has_lens(&self) -> bool {
        self.lenses.iter().any(|lens| !lens.is_pinhole())
    }

    /// The same with focal lengths that are one common multiple of those `from` which they came, in the geometric mean
    /// of the photographs of each label.
    pub(super) fn with_common_focal(mut self, from: &[f64], labels: &[usize]) -> Self {
        let factor = |k: usize| (self.focal_px[k] / from[k]).ln();
        let mean_of = |label: usize| {
            let members = || (0..labels.len()).filter(|&k| labels[k] == label);
            (members().map(factor).sum::<f64>() / members().count() as f64).exp()
        };
        self.focal_px = from.iter().zip(labels).map(|(from, &label)| from * mean_of(label)).collect();
        self
    }
}

/// The sum of squares that is minimized over [`Parameters`].
pub(super) struct BundleAdjustment<'a> {
    pub priors: &'a [CameraPrior],
    pub observations: &'a Observations,
    /// Edges that are to be straight; they take part where there are lenses, since pinholes keep them as they are.
    pub curves: &'a CurveObservations,
    /// What the focal lengths are drawn towards, working pixels.
    pub start_focal_px: Vec<f64>,
    /// The photograph whose rotation is fixed.
    pub reference: usize,
    /// How strongly: their standard deviations, relative.
    pub focal_sd: Vec<f64>,
}

impl BundleAdjustment<'_> {
    /// Refines `parameters` until the cost settles; `huber_px` bounds the influence of a single match.
    ///
    /// # Errors
    /// [`trueup_core::Error::Unsolvable`] if memory does not suffice; [`trueup_core::Error::Cancelled`].
    pub(super) fn minimize(
        &self,
        parameters: Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
        context: &StageContext,
    ) -> Result<Parameters> {
        self.minimize_until(SETTLED, parameters, model, huber_px, context)
    }

    /// [`Self::minimize`] where matches are far off at first, and then by those that are near.
    ///
    /// # Errors
    /// As of [`Self::minimize`].
    pub(super) fn coarse_to_fine(
        &self,
        parameters: Parameters,
        model: &IntrinsicsModel,
        context: &StageContext,
    ) -> Result<Parameters> {
        let coarse = self.minimize(parameters, model, COARSE_HUBER_PX, context)?;
        self.minimize(coarse, model, FINE_HUBER_PX, context)
    }

    /// [`Self::minimize`] until a step decreases the cost by less than `settled` of it.
    pub(super) fn minimize_until(
        &self,
        settled: f64,
        parameters: Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
        context: &StageContext,
    ) -> Result<Parameters> {
        match parameters.has_lens() || model.has_lens() {
            false => self.minimize_by::<PINHOLE_LOCAL>(settled, parameters, model, huber_px, context),
            true => self.minimize_by::<LENS_LOCAL>(settled, parameters, model, huber_px, context),
        }
    }

    fn minimize_by<const LOCAL: usize>(
        &self,
        settled: f64,
        parameters: Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
        context: &StageContext,
    ) -> Result<Parameters> {
        let pattern = self.pattern::<LOCAL>(model)?;
        levenberg_marquardt::minimize(&Pass { problem: self, model, huber_px, pattern }, parameters, settled, context)
    }

    /// Refines settled `parameters` once more, with the limit that suits the matches: their median distance, where most
    /// of them are that near. Errors of matches have long tails, since features differ in size: where most are off by a
    /// quarter of a pixel, those that are off by two would count 64 times as much as these.
    ///
    /// # Errors
    /// [`trueup_core::Error::Cancelled`].
    ///
    /// # Source
    /// Huber, "Robust estimation of a location parameter" (1964): the limit is a multiple of the scale of the errors.
    pub(super) fn sharpened(
        &self,
        parameters: Parameters,
        model: &IntrinsicsModel,
        context: &StageContext,
    ) -> Result<Parameters> {
        let limit_px = self.median_distance_px(&parameters).max(LEAST_SHARP_HUBER_PX);
        if limit_px >= FINE_HUBER_PX {
            return Ok(parameters);
        }
        let sharp = self.minimize(parameters.clone(), model, limit_px, context)?;
        Ok(if self.is_sound(&sharp) { sharp } else { parameters })
    }

    /// Median distance of the matches from where the cameras put them, both ways; infinite without any.
    fn median_distance_px(&self, parameters: &Parameters) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let of_pairs: Vec<Vec<f64>> =
            self.observations.pairs.par_iter().map(|pair| pair_distances(&cameras, pair)).collect();
        median(&mut of_pairs.concat()).unwrap_or(f64::INFINITY)
    }

    /// Whether the solution can be used: finite, and no focal length at the short end of its range. (At the long end
    /// the photographs are merely close to affine, which is harmless.)
    pub(super) fn is_sound(&self, parameters: &Parameters) -> bool {
        parameters.rotations.iter().all(|rotation| rotation.iter().all(|entry| entry.is_finite()))
            && parameters
                .focal_px
                .iter()
                .zip(self.priors)
                .all(|(&focal_px, prior)| focal_px.is_finite() && focal_px > STOPPED_SHORT * prior.shortest_focal_px())
    }

    pub(super) fn unknowns(&self, model: &IntrinsicsModel) -> usize {
        3 * self.priors.len() + model.parameters
    }

    /// Columns of a pair's local unknowns in the global system; `None` is held fixed. The reference photograph's
    /// rotation is fixed: it is the gauge.
    pub(super) fn columns<const LOCAL: usize>(
        &self,
        pair: &PairObservations,
        model: &IntrinsicsModel,
    ) -> Columns<LOCAL> {
        let rotation = |photograph: usize, axis: usize| (photograph != self.reference).then_some(3 * photograph + axis);
        let of_each = (LOCAL - 6) / 2;
        std::array::from_fn(|local| match local {
            0..3 => rotation(pair.a, local),
            3..6 => rotation(pair.b, local - 3),
            _ if local < 6 + of_each => self.column(model, pair.a, local - 6),
            _ => self.column(model, pair.b, local - 6 - of_each),
        })
    }

    /// Column of a photograph's intrinsic unknown; `None` is held fixed.
    pub(super) fn column(&self, model: &IntrinsicsModel, photograph: usize, intrinsic: usize) -> Option<usize> {
        model.parameters_of[photograph][intrinsic].map(|parameter| 3 * self.priors.len() + parameter)
    }

    /// Pull of the focal lengths towards their start values, (ln f - ln f0) / sd, and of lens terms towards 0, one per
    /// photograph with a free one.
    pub(super) fn pulls(&self, parameters: &Parameters, model: &IntrinsicsModel) -> Vec<Pull> {
        let of_photograph = |k: usize| {
            let stretch = (parameters.focal_px[k] / self.start_focal_px[k]).ln();
            let focal = self.column(model, k, FOCAL).map(|column| Pull::new(column, stretch, self.focal_sd[k]));
            let lens = (FOCAL + 1..INTRINSICS).filter_map(move |intrinsic| {
                let sd = standard_deviation(intrinsic, &self.priors[k].frame);
                Some(Pull::new(self.column(model, k, intrinsic)?, parameters.lenses[k].term(intrinsic), sd))
            });
            focal.into_iter().chain(lens)
        };
        (0..self.priors.len()).flat_map(of_photograph).collect()
    }

    /// Columns of what [`Self::terms`] says: the pairs, then, with lenses, the clusters of edges, whose photograph
    /// stands for the first of a pair.
    pub(super) fn all_columns<const LOCAL: usize>(&self, model: &IntrinsicsModel) -> Vec<Columns<LOCAL>> {
        let of_pairs = self.observations.pairs.iter().map(|pair| self.columns(pair, model));
        let of_curves = self.curves.clusters.iter().map(|cluster| {
            std::array::from_fn(|local| match local {
                6.. if local < 6 + INTRINSICS => self.column(model, cluster.photograph, local - 6),
                _ => None,
            })
        });
        of_pairs.chain(of_curves.filter(|_| LOCAL == LENS_LOCAL)).collect()
    }

    /// The quadratic model of every pair in the unknowns that `model` leaves free, and with lenses of every cluster of
    /// edges.
    fn terms<const LOCAL: usize>(
        &self,
        cameras: &[Camera],
        model: &IntrinsicsModel,
        huber_px: f64,
    ) -> Vec<PairTerm<LOCAL>> {
        let by_matches = || self.match_terms(cameras, model, huber_px);
        if LOCAL != LENS_LOCAL {
            return by_matches();
        }
        let (mut terms, of_curves) = rayon::join(by_matches, || self.curve_terms(cameras, huber_px));
        terms.extend(of_curves);
        terms
    }

    /// The quadratic model of every pair in the unknowns that `model` leaves free.
    pub(super) fn match_terms<const LOCAL: usize>(
        &self,
        cameras: &[Camera],
        model: &IntrinsicsModel,
        huber_px: f64,
    ) -> Vec<PairTerm<LOCAL>> {
        let of_pair = |pair| PairTerm::new(cameras, pair, &self.columns(pair, model), huber_px);
        self.observations.pairs.par_iter().map(of_pair).collect()
    }

    /// The quadratic model of every cluster of edges, whose photograph stands for the first of a pair with lenses.
    pub(super) fn curve_terms<const LOCAL: usize>(&self, cameras: &[Camera], huber_px: f64) -> Vec<PairTerm<LOCAL>> {
        let of_cluster = |cluster| {
            let CurveTerm { normal, gradient } = CurveTerm::new(cameras, cluster, huber_px);
            let mut term = PairTerm::<LOCAL>::zero();
            term.normal.view_mut((6, 6), (INTRINSICS, INTRINSICS)).copy_from(&normal);
            term.gradient.rows_mut(6, INTRINSICS).copy_from(&gradient);
            term
        };
        self.curves.clusters.par_iter().map(of_cluster).collect()
    }

    /// What the matches cost.
    fn matches_cost(&self, parameters: &Parameters, huber_px: f64) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let costs: Vec<f64> =
            self.observations.pairs.par_iter().map(|pair| pair_cost(&cameras, pair, huber_px)).collect();
        costs.iter().sum()
    }

    /// What the edges cost.
    fn curves_cost(&self, parameters: &Parameters, huber_px: f64) -> f64 {
        let cameras = parameters.cameras(self.priors);
        let costs: Vec<f64> =
            self.curves.clusters.par_iter().map(|cluster| curve_cost(&cameras, cluster, huber_px)).collect();
        costs.iter().sum()
    }

    /// What matches and edges cost.
    fn costs(&self, parameters: &Parameters, huber_px: f64) -> [f64; 2] {
        rayon::join(|| self.matches_cost(parameters, huber_px), || self.curves_cost(parameters, huber_px)).into()
    }

    /// What matches and edges cost in the final pass, without what holds single unknowns.
    pub(super) fn fine_costs(&self, parameters: &Parameters) -> [f64; 2] {
        self.costs(parameters, FINE_HUBER_PX)
    }

    /// The sum of squares that is minimized.
    fn cost<const LOCAL: usize>(&self, parameters: &Parameters, model: &IntrinsicsModel, huber_px: f64) -> f64 {
        let prior: f64 = self.pulls(parameters, model).iter().map(|pull| pull.residual * pull.residual).sum();
        if LOCAL != LENS_LOCAL {
            return self.matches_cost(parameters, huber_px) + prior;
        }
        let [matches, curves] = self.costs(parameters, huber_px);
        matches + curves + prior
    }

    /// Which unknowns meet.
    ///
    /// # Errors
    /// [`trueup_core::Error::Unsolvable`] if memory does not suffice.
    pub(super) fn pattern<const LOCAL: usize>(&self, model: &IntrinsicsModel) -> Result<NormalPattern<LOCAL>> {
        NormalPattern::new(self.unknowns(model), self.all_columns(model))
    }

    fn normal_equations<const LOCAL: usize>(
        &self,
        parameters: &Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
        pattern: &NormalPattern<LOCAL>,
    ) -> Option<NormalEquations> {
        let terms = self.terms(&parameters.cameras(self.priors), model, huber_px);
        pattern.equations(&terms, &self.pulls(parameters, model))
    }

    fn moved(&self, parameters: &Parameters, model: &IntrinsicsModel, step: &faer::Mat<f64>) -> Parameters {
        let mut moved = parameters.clone();
        for k in 0..self.priors.len() {
            let turn = Vector3::new(step[(3 * k, 0)], step[(3 * k + 1, 0)], step[(3 * k + 2, 0)]);
            moved.rotations[k] = nearest_rotation(&(exp_rotation(&turn) * parameters.rotations[k]));
            if let Some(column) = self.column(model, k, FOCAL) {
                let stretched = parameters.focal_px[k] * step[(column, 0)].exp();
                moved.focal_px[k] = self.priors[k].believable_focal_px(stretched);
            }
            for intrinsic in FOCAL + 1..INTRINSICS {
                if let Some(column) = self.column(model, k, intrinsic) {
                    moved.lenses[k].add(intrinsic, step[(column, 0)]);
                }
            }
        }
        moved
    }
}

/// One pass of minimization.
struct Pass<'a, const LOCAL: usize> {
    problem: &'a BundleAdjustment<'a>,
    model: &'a IntrinsicsModel,
    huber_px: f64,
    pattern: NormalPattern<LOCAL>,
}

impl<const LOCAL: usize> LeastSquares for Pass<'_, LOCAL> {
    type State = Parameters;

    fn cost(&self, parameters: &Parameters) -> f64 {
        self.problem.cost::<LOCAL>(parameters, self.model, self.huber_px)
    }

    fn equations(&self, parameters: &Parameters) -> Option<NormalEquations> {
        self.problem.normal_equations(parameters, self.model, self.huber_px, &self.pattern)
    }

    fn moved(&self, parameters: &Parameters, step: &faer::Mat<f64>) -> Parameters {
        self.problem.moved(parameters, self.model, step)
    }
}

#[cfg(test)]
#[path = "bundle_tests.rs"]
mod tests;
