//! How sure the matches are of intrinsic unknowns.
//!
//! # Source
//! The cluster-robust (sandwich) covariance of an estimating equation (Liang and Zeger, "Longitudinal data analysis
//! using generalized linear models", 1986): a pair of photographs is a cluster, whose matches err together where there
//! is parallax, and so are the edges in one part of a photograph, which are bent together where they are of one thing.

use faer::linalg::solvers::Solve;
use nalgebra::{DMatrix, DVector, SVector};

use super::bundle::{BundleAdjustment, Parameters};
use super::intrinsics::{FOCAL, IntrinsicsModel, LensState};
use super::pair_cost::{LENS_LOCAL, PairTerm};

/// Who is asked. The two are asked apart: parallax bends what matches say, and what is round in the scene what edges
/// say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Witness {
    /// The matches of the pairs.
    Matches,
    /// The edges that are to be straight. They tell of nothing but lenses: focal lengths are to be held.
    Edges,
}

/// So many clusters, or fewer, have no spread to speak of.
const FEWEST_CLUSTERS: usize = 2;

/// Where one step of Gauss and Newton puts the intrinsic unknowns, and how far that may be off.
pub(super) struct LensEvidence {
    /// One for each parameter of the model.
    estimate: DVector<f64>,
    covariance: DMatrix<f64>,
    /// For each parameter, the clusters whose photographs it moves.
    clusters: Vec<usize>,
}

impl LensEvidence {
    /// What `witness` says at `parameters`, with the unknowns of `model`; `None` where an unknown is left open.
    pub(super) fn at(
        witness: Witness,
        problem: &BundleAdjustment<'_>,
        parameters: &Parameters,
        model: &IntrinsicsModel,
        huber_px: f64,
    ) -> Option<Self> {
        let photographs = problem.priors.len();
        let cameras = parameters.cameras(problem.priors);
        let (pairs, clusters) = (problem.observations.pairs.len(), problem.curves.clusters.len());
        let silent = |count: usize| std::iter::repeat_with(PairTerm::<LENS_LOCAL>::zero).take(count);
        let (terms, asked): (Vec<_>, _) = match witness {
            Witness::Matches => {
                let told = problem.match_terms(&cameras, model, huber_px);
                (told.into_iter().chain(silent(clusters)).collect(), 0..pairs)
            }
            Witness::Edges => {
                let told = problem.curve_terms(&cameras, huber_px);
                (silent(pairs).chain(told).collect(), pairs..pairs + clusters)
            }
        };
        let pattern = problem.pattern(model).ok()?;
        let equations = pattern.equations(&terms, &problem.pulls(parameters, model))?;
        let factor = equations.factor(0.0)?;
        let step = factor.solve(-&equations.gradient);
        let selection = faer::Mat::from_fn(problem.unknowns(model), model.parameters, |row, column| {
            f64::from(u8::from(row == 3 * photographs + column))
        });
        let influence = factor.solve(&selection);
        let mut covariance = DMatrix::zeros(model.parameters, model.parameters);
        let mut clusters = vec![0; model.parameters];
        let all_columns = problem.all_columns::<LENS_LOCAL>(model);
        for (columns, term) in all_columns[asked.clone()].iter().zip(&terms[asked]) {
            let moved = term.normal
                * SVector::<f64, LENS_LOCAL>::from_fn(|local, _| {
                    columns[local].map_or(0.0, |column| step[(column, 0)])
                });
            let score = term.gradient + moved;
            let pull = DVector::from_fn(model.parameters, |parameter, _| {
                (0..LENS_LOCAL)
                    .filter_map(|local| Some(influence[(columns[local]?, parameter)] * score[local]))
                    .sum::<f64>()
            });
            covariance += &pull * pull.transpose();
            for (parameter, clusters) in clusters.iter_mut().enumerate() {
                *clusters += usize::from(columns.contains(&Some(3 * photographs + parameter)));
            }
        }
        let estimate = DVector::from_fn(model.parameters, |parameter, _| {
            value(parameters, model, parameter) + step[(3 * photographs + parameter, 0)]
        });
        estimate.iter().chain(covariance.iter()).all(|one| one.is_finite()).then_some(Self {
            estimate,
            covariance,
            clusters,
        })
    }

    /// Where the step puts a parameter.
    pub(super) fn estimate(&self, parameter: usize) -> f64 {
        self.estimate[parameter]
    }

    /// Standard deviation of a parameter; `None` where too few clusters tell of it to have one.
    pub(super) fn deviation(&self, parameter: usize) -> Option<f64> {
        let deviation = self.covariance[(parameter, parameter)].sqrt();
        (self.clusters[parameter] > FEWEST_CLUSTERS && deviation > 0.0).then_some(deviation)
    }

    /// How far `parameters` together are from 0: their squared distance in standard deviations, by dimension, after
    /// Hotelling's correction for few clusters; 0 where there are too few to tell.
    pub(super) fn significance(&self, parameters: &[usize]) -> f64 {
        let dimension = parameters.len();
        let clusters = parameters.iter().map(|&parameter| self.clusters[parameter]).min().unwrap_or(0);
        if clusters <= dimension + 1 {
            return 0.0;
        }
        let estimate = DVector::from_fn(dimension, |k, _| self.estimate[parameters[k]]);
        let covariance = DMatrix::from_fn(dimension, dimension, |j, k| self.covariance[(parameters[j], parameters[k])]);
        let squared = covariance.cholesky().map_or(0.0, |factor| estimate.dot(&factor.solve(&estimate)));
        let freedom = (clusters - dimension) as f64 / (clusters as f64 * dimension as f64);
        squared * freedom
    }
}

/// The present value of a parameter: of a focal length's logarithm 0.
fn value(parameters: &Parameters, model: &IntrinsicsModel, parameter: usize) -> f64 {
    let of_photograph = |(lens, columns): (&LensState, &[Option<usize>; trueup_core::camera::INTRINSICS])| {
        let intrinsic = columns.iter().position(|&column| column == Some(parameter))?;
        Some(if intrinsic == FOCAL { 0.0 } else { lens.term(intrinsic) })
    };
    parameters.lenses.iter().zip(&model.parameters_of).find_map(of_photograph).unwrap_or(0.0)
}
