//! The vanishing point guided prior: dominant directions, gate, joint refinement, weighted solve.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::{rows_of, wrap_angle};
use trueup_core::{Result, StageContext};

use super::camera_correction::{corrected_rotations, relative_certainties};
use super::dominant::{Dominant, dominant_frame};
use super::frame_search::{PooledFrame, search_frame};
use super::gate::{GateEvidence, allowed_divergence, divergence, failed_clause};
use super::joint::LineVote;
use super::path_voting::PathVote;
use super::signed_permutation::{match_triad, triad_residual};
use super::straighten::Straightened;
use super::vertical::{roll_of, vertical_of};
use super::vertical_vote::{VerticalPeak, vertical_peak};
use super::weighted_solve::{DataTerm, TurnTerm, solve_unit_vectors};
use super::{BetaMode, GateMode, Guidance, PriorInput, STAGE, SimilarityOptions, Upright, rolls};
use crate::vanishing::{InterpretationPlanes, RefinedTriad};

/// Share of a picture's best score that its search near the dominant directions must reach to replace its triad.
const REDETECTION_SHARE: f64 = 0.9;
/// Farthest that the joint refinement may move the vertical, in tolerances of a segment's vote.
const MAX_REFINEMENT_TOLERANCES: f64 = 2.0;
/// Length of a solved vector below which its terms contradict each other.
const CONTRADICTED: f64 = 0.1;

/// A prior that no line takes part in.
pub(super) fn unguided(count: usize, options: &SimilarityOptions) -> Guidance {
    Guidance {
        used: false,
        pooled: false,
        significance: None,
        vertical_deviation: None,
        vertical_only: false,
        divergence: None,
        threshold: allowed_divergence(count, options),
        inlier_ratio: 0.0,
        failed_clause: None,
        dominant: None,
        inliers: Vec::new(),
        residuals: vec![None; count],
        weights: vec![0.0; count],
        vertical_rivalry: None,
        vertical_share: None,
    }
}

/// Everything known about the scene's directions.
struct Scene<'a> {
    input: &'a PriorInput<'a>,
    options: &'a SimilarityOptions,
    rotations: &'a [Matrix3<f64>],
    /// Per picture its directions in the cameras' world.
    triads: Vec<Option<Matrix3<f64>>>,
    vote: LineVote,
}

/// Finds the vertical and the turns that the lines mean, if they are believed. `straightened` is what the gate compares
/// with; near `level` the vertical is sought where the gate refuses.
pub(super) fn guide(
    input: &PriorInput<'_>,
    rotations: &[Matrix3<f64>],
    straightened: &Straightened,
    level: &Vector3<f64>,
    options: &SimilarityOptions,
    context: &StageContext<'_>,
) -> Result<(Guidance, Option<Upright>)> {
    let count = input.cameras.len();
    let planes = interpretation_planes(input);
    let focals: Vec<f64> = input.cameras.iter().map(|camera| camera.focal_px).collect();
    let triads = rotations
        .iter()
        .zip(input.triads)
        .map(|(rotation, outcome)| {
            let matrix = outcome.triad()?.matrix();
            matrix.iter().all(|value| value.is_finite()).then(|| rotation.tr_mul(&matrix))
        })
        .collect();
    let mut scene = Scene { input, options, rotations, triads, vote: LineVote::new(rotations, &focals, planes) };
    context.check_cancelled()?;
    let mut guidance = unguided(count, options);
    let dominant =
        dominant_frame(&scene.triads, options.rejection, options.max_cross_pairs, &mut context.generator(STAGE, 0));
    context.check_cancelled()?;
    let pooled = options.pooled_search.then(|| search_frame(&scene.vote, level, options)).flatten();
    guidance.significance = pooled.map(|pooled| pooled.significance);
    guidance.failed_clause = match &dominant {
        Some(dominant) => scene.judge(dominant, straightened, &mut guidance),
        None => Some("no picture has vanishing directions".to_owned()),
    };
    context.check_cancelled()?;
    let accepted = match guidance.failed_clause {
        None => dominant,
        // The published gate knows no other frame than the one that the pictures agree on.
        Some(_) if options.gate == GateMode::Paper => None,
        Some(_) => pooled.and_then(|pooled| scene.pooled(&pooled, straightened, &mut guidance)),
    };
    if let Some(dominant) = accepted {
        let upright = scene.solve_dominant(dominant, &mut guidance);
        if upright.is_some() {
            return Ok((guidance, upright));
        }
    }
    let peak = vertical_peak(&scene.vote, level, options).filter(|_| options.vertical_only);
    if let Some(peak) = &peak {
        guidance.vertical_rivalry = Some(peak.rivalry);
        guidance.vertical_share = Some(peak.support.score / scene.vote.total_weight());
    }
    let upright =
        peak.filter(|peak| clear(peak, &scene)).and_then(|peak| scene.solve_vertical(&peak.down, &mut guidance));
    Ok((guidance, upright))
}

/// Whether the segments leave no doubt about the vertical.
fn clear(peak: &VerticalPeak, scene: &Scene<'_>) -> bool {
    let share = peak.support.score / scene.vote.total_weight();
    let pictures = scene.options.min_vertical_pictures * scene.rotations.len() as f64;
    peak.rivalry <= scene.options.max_vertical_rivalry
        && share >= scene.options.min_vertical_share
        && peak.support.pictures as f64 >= pictures.max(2.0)
}

fn interpretation_planes(input: &PriorInput<'_>) -> Vec<InterpretationPlanes> {
    (0..input.cameras.len())
        .into_par_iter()
        .map(|index| {
            let focal_px = input.cameras[index].focal_px;
            InterpretationPlanes::new(&input.lines[index], focal_px, &input.frames[index], input.vanishing)
        })
        .collect()
}

impl Scene<'_> {
    /// Pictures whose directions agree with `dominant`.
    fn inliers(&self, dominant: &Dominant) -> Vec<usize> {
        let agrees = |index: &usize| dominant.residuals[*index].is_some_and(|r| r <= self.options.rejection);
        (0..self.rotations.len()).filter(agrees).collect()
    }

    /// The roll of each agreeing picture by its own direction that matches the vertical: the paper's alpha_i.
    ///
    /// # Departures
    /// Eq. 6 is printed with directions already moved to the common frame, which would give every picture about the
    /// same roll; those of the camera's own frame are meant.
    fn own_rolls(&self, frame: &Matrix3<f64>, down: &Vector3<f64>, inliers: &[usize]) -> Vec<Option<f64>> {
        let mut own = vec![None; self.rotations.len()];
        let in_frame = frame.tr_mul(down);
        let column = in_frame.iamax();
        for &index in inliers {
            if let Some(triad) = &self.triads[index] {
                let matched = match_triad(frame, triad).0.column(column) * in_frame[column].signum();
                own[index] = roll_of(&(self.rotations[index] * matched));
            }
        }
        own
    }

    /// Fills in what the dominant directions came to and returns the gate's failed clause.
    fn judge(&self, dominant: &Dominant, straightened: &Straightened, guidance: &mut Guidance) -> Option<String> {
        let inliers = self.inliers(dominant);
        let down = vertical_of(&dominant.frame, self.rotations);
        let mut magnitudes: Vec<f64> =
            self.own_rolls(&dominant.frame, &down, &inliers).into_iter().flatten().map(f64::abs).collect();
        magnitudes.sort_by(f64::total_cmp);
        let residuals: Vec<f64> = inliers.iter().filter_map(|&index| dominant.residuals[index]).collect();
        let pictures = self.rotations.len();
        let evidence = GateEvidence {
            pictures,
            inliers: inliers.len(),
            divergence: divergence(&residuals, pictures),
            straightening_angle: straightened.conditioned.then(|| down.angle(&straightened.down)),
            significance: guidance.significance,
            median_roll: magnitudes.get(magnitudes.len() / 2).copied().unwrap_or(f64::INFINITY),
        };
        guidance.divergence = Some(evidence.divergence).filter(|divergence| divergence.is_finite());
        guidance.inlier_ratio = inliers.len() as f64 / pictures as f64;
        guidance.residuals.clone_from(&dominant.residuals);
        guidance.inliers = inliers;
        failed_clause(&evidence, self.options)
    }

    /// The frame of the pooled search in place of one that the pictures agree on, if it stands out far enough.
    fn pooled(&self, pooled: &PooledFrame, straightened: &Straightened, guidance: &mut Guidance) -> Option<Dominant> {
        let down = vertical_of(&pooled.frame, self.rotations);
        let limit = self.options.max_straightening_angle_deg.to_radians();
        let stands_out = pooled.significance >= self.options.pooled_significance;
        if !stands_out || (straightened.conditioned && down.angle(&straightened.down) > limit) {
            return None;
        }
        let residuals =
            self.triads.iter().map(|triad| triad.map(|triad| triad_residual(&pooled.frame, &triad))).collect();
        let dominant = Dominant { frame: pooled.frame, residuals };
        guidance.pooled = true;
        guidance.inliers = self.inliers(&dominant);
        guidance.residuals.clone_from(&dominant.residuals);
        Some(dominant)
    }

    /// The prior of accepted dominant directions.
    fn solve_dominant(&mut self, mut dominant: Dominant, guidance: &mut Guidance) -> Option<Upright> {
        let axis_weights = self.axis_weights(&dominant.frame, guidance);
        if self.options.guided_redetection {
            self.redetect(&mut dominant);
            guidance.inliers = self.inliers(&dominant);
            guidance.residuals.clone_from(&dominant.residuals);
        }
        let has_lines = self.vote.total_weight() > 0.0;
        let joint = has_lines && self.options.joint_refinement;
        let frame = if joint { self.refined(&dominant.frame, &axis_weights) } else { dominant.frame };
        let down = vertical_of(&frame, self.rotations);
        if joint {
            let deviation = self.vote.axis_deviations(&frame, &axis_weights, self.options)[frame.tr_mul(&down).iamax()];
            guidance.vertical_deviation = Some(deviation).filter(|deviation| deviation.is_finite());
            let allowed = match guidance.pooled {
                true => self.options.max_pooled_deviation_deg,
                false if self.options.gate == GateMode::Paper => f64::INFINITY,
                false => self.options.max_vertical_deviation_deg,
            };
            if deviation.to_degrees() > allowed {
                guidance.pooled = false;
                guidance.failed_clause = Some(format!(
                    "the lines leave the vertical uncertain by {:.1} degrees ({allowed:.1} allowed)",
                    deviation.to_degrees()
                ));
                return None;
            }
        }
        guidance.dominant = Some(rows_of(&frame));
        guidance.used = true;
        let rotations = match joint && self.options.camera_correction {
            true => self.corrected(&frame, &axis_weights),
            false => self.rotations.to_vec(),
        };
        let own =
            if joint { common_rolls(&down, &rotations) } else { self.own_rolls(&frame, &down, &guidance.inliers) };
        self.solve(&down, &own, &rotations, guidance)
    }

    fn corrected(&self, frame: &Matrix3<f64>, axis_weights: &[f64; 3]) -> Vec<Matrix3<f64>> {
        let certainties = relative_certainties(self.input.cameras, self.input.edges, self.options);
        corrected_rotations(self.rotations, &certainties, &self.vote, frame, axis_weights, self.options)
    }

    /// Full weight for the vertical; for the horizontals as much as the pictures' directions agree: where buildings
    /// stand at several angles, what passes for one horizontal direction would pull the vertical along.
    fn axis_weights(&self, frame: &Matrix3<f64>, guidance: &Guidance) -> [f64; 3] {
        let residuals = guidance.inliers.iter().filter_map(|&index| guidance.residuals[index]);
        let mean = residuals.sum::<f64>() / guidance.inliers.len().max(1) as f64;
        // r = 4 (1 - cos phi) of the misorientation phi that is ordinary detection noise.
        let ordinary = 4.0 * (1.0 - self.options.ordinary_misorientation_deg.to_radians().cos());
        let horizontal = if mean > ordinary { (ordinary / mean).powi(2) } else { 1.0 };
        let down = vertical_of(frame, self.rotations);
        let vertical = frame.tr_mul(&down).iamax();
        std::array::from_fn(|axis| if axis == vertical { 1.0 } else { horizontal })
    }

    /// The frame that all segments vote for, unless it left the neighborhood of the pictures' own.
    fn refined(&self, frame: &Matrix3<f64>, axis_weights: &[f64; 3]) -> Matrix3<f64> {
        let refined = self.vote.refine_frame(frame, axis_weights, self.options);
        let limit = MAX_REFINEMENT_TOLERANCES * self.options.joint_tolerance_deg.to_radians();
        let (before, after) = (vertical_of(frame, self.rotations), vertical_of(&refined, self.rotations));
        // A comparison with NaN is false: a refinement that is not finite is dropped too.
        if before.angle(&after) <= limit { refined } else { *frame }
    }

    /// The prior of a vertical alone.
    fn solve_vertical(&self, down: &Vector3<f64>, guidance: &mut Guidance) -> Option<Upright> {
        guidance.used = true;
        guidance.vertical_only = true;
        let own = common_rolls(down, self.rotations);
        self.solve(down, &own, self.rotations, guidance)
    }

    /// Searches pictures that disagree, or have no triad, again near the dominant directions.
    fn redetect(&mut self, dominant: &mut Dominant) {
        let frame = dominant.frame;
        for index in 0..self.rotations.len() {
            if dominant.residuals[index].is_some_and(|residual| residual <= self.options.rejection) {
                continue;
            }
            let planes = self.vote.planes(index);
            if planes.len() < self.input.vanishing.min_lines {
                continue;
            }
            let start = self.rotations[index] * frame;
            let near = RefinedTriad::refine(&start, planes, self.input.vanishing);
            let enough = match self.input.triads[index].triad() {
                Some(own) => near.score >= REDETECTION_SHARE * own.quality * planes.total_weight,
                None => near.score >= self.input.vanishing.min_quality * planes.total_weight,
            };
            if enough {
                let triad = self.rotations[index].tr_mul(&near.triad);
                dominant.residuals[index] = Some(triad_residual(&frame, &triad));
                self.triads[index] = Some(triad);
            }
        }
    }

    /// The paper's weighted least squares: own rolls against relative rolls.
    fn solve(
        &self,
        down: &Vector3<f64>,
        own: &[Option<f64>],
        rotations: &[Matrix3<f64>],
        guidance: &mut Guidance,
    ) -> Option<Upright> {
        let predicted = rolls(down, rotations);
        let turns: Vec<(usize, usize, f64)> =
            self.input.edges.iter().map(|edge| self.turn(edge.a, edge.b, &predicted)).collect();
        let mut neighbors = vec![Vec::new(); own.len()];
        for &(i, j, beta) in &turns {
            neighbors[i].push((j, beta));
            neighbors[j].push((i, -beta));
        }
        let vote = PathVote {
            max_edges: self.options.max_path_edges,
            tolerance: self.options.path_tolerance_deg.to_radians(),
            max_paths: self.options.max_paths,
        };
        guidance.weights = match self.options.path_voting {
            true => vote.weights(own, &neighbors),
            false => own.iter().map(|roll| f64::from(u8::from(roll.is_some()))).collect(),
        };
        let data: Vec<DataTerm> = own
            .iter()
            .zip(&guidance.weights)
            .enumerate()
            .filter_map(|(index, (roll, &weight))| roll.map(|angle| DataTerm { index, angle, weight }))
            .collect();
        let weight = self.options.relative_weight;
        let turns: Vec<TurnTerm> = turns.into_iter().map(|(i, j, turn)| TurnTerm { i, j, turn, weight }).collect();
        let vectors = solve_unit_vectors(own.len(), &data, &turns);
        let theta = match vectors {
            Some(vectors) => vectors.iter().zip(&predicted).map(|(vector, &roll)| angle_of(vector, roll)).collect(),
            // Some picture has neither a roll of its own nor a neighbor.
            None => predicted,
        };
        Some(Upright { down: *down, theta, rotations: rotations.to_vec() })
    }

    /// (i, j, beta_ij) of an edge, beta_ij predicting theta_j - theta_i.
    ///
    /// # Departures
    /// The published decomposition of R_j R_i^-1 has the opposite sign, and is the difference of upright rolls only for
    /// level cameras: two level cameras at pitch p that pan by y twist by about y sin p.
    fn turn(&self, i: usize, j: usize, predicted: &[f64]) -> (usize, usize, f64) {
        let beta = match self.options.beta_mode {
            BetaMode::World => wrap_angle(predicted[j] - predicted[i]),
            BetaMode::Relative => {
                let relative = self.rotations[j] * self.rotations[i].transpose();
                -(relative[(1, 0)] - relative[(0, 1)]).atan2(relative[(0, 0)] + relative[(1, 1)])
            }
        };
        (i, j, beta)
    }
}

/// Each picture's roll by the common vertical: after the joint refinement no picture's own triad knows better.
fn common_rolls(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> Vec<Option<f64>> {
    rotations.iter().map(|rotation| roll_of(&(rotation * down))).collect()
}

fn angle_of(vector: &[f64; 2], otherwise: f64) -> f64 {
    let [u, v] = *vector;
    if u.hypot(v) < CONTRADICTED { otherwise } else { v.atan2(u) }
}
