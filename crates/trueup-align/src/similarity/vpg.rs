//! The vanishing point guided prior: dominant directions, gate, joint refinement, weighted solve.

use nalgebra::{Matrix3, Vector3};
use trueup_core::geometry::{exp_rotation, orthonormal_complement, rows_of};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use super::camera_correction::{corrected_rotations, relative_certainties};
use super::dominant::{Dominant, dominant_frame};
use super::gate::{Agreement, GateEvidence, allowed_divergence, divergence, failed_clause};
use super::held::held_roll;
use super::input::PriorInput;
use super::level::{CameraLevel, LevelSource};
use super::options::{GateMode, SimilarityOptions};
use super::prior::{Guidance, VerticalSpread};
use super::probable_vertical::{ProbableVertical, probable_vertical};
use super::signed_permutation::{match_triad, triad_residual};
use super::turns::{RollEvidence, solve_turns};
use super::upright::Upright;
use super::vertical::{roll_of, vertical_by_reference, vertical_near, vertical_of};
use super::vertical_vote::vertical_peak;
use super::witnesses::{MIN_UPRIGHT_PHOTOGRAPHS, Reconciled, covariance_of_slopes, reconciled};
use crate::vanishing::frame_search::{SEARCH_DEG, search_frames};
use crate::vanishing::jackknife::{covariance_by_photographs, covariance_by_sectors, deviation};
use crate::vanishing::joint::{self, AxisWeights, LineVote, Refinement};
use crate::vanishing::{InterpretationPlanes, RefinedTriad};

/// Fewest photographs whose level lines may be found to lie along a slope: of two, nothing but the few sectors they
/// show tells how upright and level lines scatter. By a model of this on the segments of cut sets, the mean lean of 164
/// pairs is the same either way, that of 145 triples 0.26 degrees with it and 0.30 without.
const MIN_SLOPING_PHOTOGRAPHS: usize = 3;
/// How probable it is that level lines lie along a slope, where they are not heard at all.
const SLOPING: f64 = 0.5;
/// Share of a photograph's best score that its search near the dominant directions must reach to replace its triad.
const REDETECTION_SHARE: f64 = 0.9;
/// Farthest that the joint refinement may move the vertical, in tolerances of a segment's vote.
const MAX_REFINEMENT_TOLERANCES: f64 = 2.0;
/// Root mean square misorientation of the photographs' directions that is detection noise, degrees; beyond, the
/// horizontal directions lose weight in the joint refinement.
const ORDINARY_MISORIENTATION_DEG: f64 = 1.0;
/// Least share of the information on the vertical that makes lines its guide; with less they are one voice among
/// others.
const GUIDING_SHARE: f64 = 0.5;
/// Largest standard deviation of the vertical at which lines guide, degrees: so few photographs have lines beyond that
/// what their scatter says of single cameras is little; and wrong frames that stand out by chance in the pooled search
/// scatter by more. Reasoned.
const MAX_GUIDING_DEVIATION_DEG: f64 = 3.0;
/// Lines whose vertical is farther than this from the one that cameras recorded are not those of what stands upright,
/// degrees, unless both are less certain. Reasoned: no sensor errs by as much, and roofs lean by more.
const MAX_GRAVITY_ANGLE_DEG: f64 = 5.0;
/// The same in deviations of both.
const MAX_GRAVITY_DEVIATIONS: f64 = 4.0;

/// Everything known about the scene's directions.
pub(super) struct SceneDirections<'a> {
    input: &'a PriorInput<'a>,
    options: &'a SimilarityOptions,
    /// What is known of the vertical without lines.
    pub level: &'a CameraLevel<'a>,
    /// Per photograph its directions in the cameras' world.
    pub triads: Vec<Option<Matrix3<f64>>>,
    pub vote: LineVote,
}

/// What came of the lines.
pub(super) struct Guided {
    pub guidance: Guidance,
    /// The prior that lines guide; `None` where they are not believed.
    pub upright: Option<Upright>,
    /// Down in the common frame, by all that tells of it: what lines that do not guide say takes part.
    pub level: Vector3<f64>,
}

/// Finds the vertical and the turns that the lines mean, if they are believed. The gate compares with what
/// straightening finds of the cameras; near their `level` the vertical is sought where the gate refuses.
pub(super) fn guide(
    input: &PriorInput<'_>,
    level: &CameraLevel<'_>,
    options: &SimilarityOptions,
    context: &StageContext<'_>,
) -> Result<Guided> {
    let count = input.cameras.len();
    let mut scene = SceneDirections::new(input, level, options);
    context.check_cancelled()?;
    let mut generator = context.generator(SimilarityOptions::STAGE, 0);
    let cut = if options.as_printed.dominant { f64::INFINITY } else { options.rejection };
    let dominant = dominant_frame(&scene.triads, cut, &mut generator);
    context.check_cancelled()?;
    let about = dominant.as_ref().map_or(level.down, |dominant| scene.searched_about(dominant));
    let pooled = options.pooled_search.then(|| search_frames(&scene.vote, &about)).flatten();
    let significance = pooled.as_ref().map(|pooled| pooled.significance);
    let allowed = allowed_divergence(count, significance, options);
    let mut guidance = Guidance { significance, ..Guidance::none(count, allowed, level.evidence()) };
    guidance.failed_clause = match &dominant {
        Some(dominant) => scene.judge(dominant, &mut guidance),
        None => Some("no photograph has vanishing directions".to_owned()),
    };
    context.check_cancelled()?;
    let mut down = level.down;
    let (before, triads) = (guidance.clone(), scene.triads.clone());
    let is_agreed = dominant.is_some() && guidance.failed_clause.is_none();
    // The published gate knows no other frame than the one that the photographs agree on.
    let pooled = pooled.filter(|_| options.gate == GateMode::Full);
    let rivals = pooled.as_ref().zip(dominant.as_ref()).filter(|_| is_agreed);
    if let Some((guidance, upright)) = rivals.and_then(|(pooled, own)| scene.outvoted(pooled, own, &before)) {
        return Ok(Guided { guidance, upright: Some(upright), level: down });
    }
    if let Some(dominant) = dominant.clone().filter(|_| is_agreed) {
        match scene.solve_dominant(dominant, &mut guidance) {
            Ok(upright) => return Ok(Guided { guidance, upright: Some(upright), level: down }),
            Err(level) => down = level,
        }
    }
    if let Some(pooled) = pooled.and_then(|pooled| scene.standing_out(&pooled)) {
        scene.triads = triads;
        let mut again = Guidance { failed_clause: guidance.failed_clause.clone(), ..before };
        if let Some(dominant) = scene.pooled(&pooled, dominant.as_ref(), &mut again) {
            match scene.solve_dominant(dominant, &mut again) {
                Ok(upright) => return Ok(Guided { guidance: again, upright: Some(upright), level: down }),
                // What refuses it says nothing of directions that photographs agreed on, whose own refusal stands.
                Err(level) if !is_agreed => (guidance, down) = (again, level),
                Err(_) => {}
            }
        }
    }
    let upright = scene.vertical_alone(&mut guidance);
    if upright.is_none() && !guidance.level.iter().any(|told| told.source == LevelSource::Lines) {
        down = scene.probable_vertical(&mut guidance).unwrap_or(down);
    }
    Ok(Guided { guidance, upright, level: down })
}

impl<'a> SceneDirections<'a> {
    fn new(input: &'a PriorInput<'a>, level: &'a CameraLevel<'a>, options: &'a SimilarityOptions) -> Self {
        let rotations = level.rotations;
        let planes = InterpretationPlanes::of_all(input.lines, input.cameras, input.frames);
        let triads = rotations
            .iter()
            .zip(input.triads)
            .map(|(rotation, outcome)| {
                let matrix = outcome.triad()?.matrix();
                matrix.iter().all(|value| value.is_finite()).then(|| rotation.tr_mul(&matrix))
            })
            .collect();
        let vote = LineVote::new(rotations, planes);
        Self { input, options, level, triads, vote }
    }

    /// The vertical among the directions of `frame`.
    pub(super) fn vertical(&self, frame: &Matrix3<f64>) -> Vector3<f64> {
        match self.options.as_printed.vertical {
            true => vertical_by_reference(frame, &self.level.rotations[self.input.reference]),
            false if self.level.has_gravity => vertical_near(frame, &self.level.down),
            false => vertical_of(frame, self.level.viewed),
        }
    }

    /// About which vertical frames are sought of all lines together: the cameras', unless the vertical of `dominant` is
    /// out of reach from there and the cameras know so little that it may be theirs, as of two photographs of which one
    /// lies on its side, or more than very few agree closely.
    fn searched_about(&self, dominant: &Dominant) -> Vector3<f64> {
        let own = self.vertical(&dominant.frame);
        let agreement = match self.agreement(dominant) {
            Agreement::Close => Agreement::Loose,
            other => other,
        };
        let is_theirs = self.level.angle_to(&own).is_some_and(|found| !found.is_too_wide(agreement));
        if self.is_out_of_reach(&own) && is_theirs { own } else { self.level.down }
    }

    /// Whether a search of all lines together about the cameras' vertical cannot find this one.
    pub(super) fn is_out_of_reach(&self, vertical: &Vector3<f64>) -> bool {
        vertical.angle(&self.level.down) > SEARCH_DEG.to_radians()
    }

    /// How the photographs' directions agree on `dominant`.
    fn agreement(&self, dominant: &Dominant) -> Agreement {
        let inliers = self.inliers(dominant);
        Agreement::of(inliers.len(), self.divergence(dominant, &inliers), self.options)
    }

    /// How far the directions of `inliers` diverge from `dominant`.
    fn divergence(&self, dominant: &Dominant, inliers: &[usize]) -> f64 {
        let residuals: Vec<f64> = inliers.iter().filter_map(|&index| dominant.residuals[index]).collect();
        divergence(&residuals, self.level.rotations.len(), self.options.as_printed.divergence)
    }

    /// Photographs whose directions agree with `dominant`.
    pub(super) fn inliers(&self, dominant: &Dominant) -> Vec<usize> {
        let agrees = |index: &usize| dominant.residuals[*index].is_some_and(|r| r <= self.options.rejection);
        (0..self.level.rotations.len()).filter(agrees).collect()
    }

    /// The roll of each agreeing photograph by its own direction that matches the vertical: the paper's alpha_i, of
    /// `cameras` from the common frame.
    ///
    /// # Departures
    /// Eq. 6 is printed with directions already moved to the common frame, the reference camera's, which gives every
    /// photograph about the same roll (`similarity.as_printed`); those of the camera's own frame are meant.
    fn own_rolls(
        &self,
        cameras: &[Matrix3<f64>],
        frame: &Matrix3<f64>,
        down: &Vector3<f64>,
        inliers: &[usize],
    ) -> Vec<Option<f64>> {
        let mut own = vec![None; cameras.len()];
        let in_frame = frame.tr_mul(down);
        let column = in_frame.iamax();
        for &index in inliers {
            if let Some(triad) = &self.triads[index] {
                let matched = match_triad(frame, triad).0.column(column) * in_frame[column].signum();
                let camera = if self.options.as_printed.alpha { self.input.reference } else { index };
                own[index] = roll_of(&(cameras[camera] * matched));
            }
        }
        own
    }

    /// Fills in what the dominant directions came to and returns the gate's failed clause.
    fn judge(&self, dominant: &Dominant, guidance: &mut Guidance) -> Option<String> {
        let inliers = self.inliers(dominant);
        let down = self.vertical(&dominant.frame);
        let rolls = self.own_rolls(self.level.viewed, &dominant.frame, &down, &inliers);
        let mut magnitudes: Vec<f64> = rolls.into_iter().flatten().map(f64::abs).collect();
        magnitudes.sort_by(f64::total_cmp);
        let photographs = self.level.rotations.len();
        let evidence = GateEvidence {
            photographs,
            inliers: inliers.len(),
            divergence: self.divergence(dominant, &inliers),
            from_cameras: self.level.angle_to(&down),
            significance: guidance.significance,
            // Photographs may lie on their sides where gravity says so.
            median_roll: match self.level.has_gravity {
                true => 0.0,
                false => magnitudes.get(magnitudes.len().saturating_sub(1) / 2).copied().unwrap_or(f64::INFINITY),
            },
            rolls: (!self.level.has_gravity).then(|| held_roll(self.level.viewed, &down)),
            by_level_lines: self.by_level_lines(&down),
        };
        guidance.divergence = Some(evidence.divergence).filter(|divergence| divergence.is_finite());
        guidance.inlier_ratio = inliers.len() as f64 / photographs as f64;
        guidance.residuals.clone_from(&dominant.residuals);
        guidance.inliers = inliers;
        failed_clause(&evidence, self.options)
    }

    /// How many deviations of what is known without lines `down` lies from there, where too few photographs show lines
    /// along it; level ones alone may be those of a slope.
    pub(super) fn by_level_lines(&self, down: &Vector3<f64>) -> Option<f64> {
        (self.vote.photographs_along(down) < MIN_UPRIGHT_PHOTOGRAPHS).then(|| self.level.deviations_to(down))
    }

    /// The prior of accepted dominant directions; where they are not sure enough to guide, the vertical that they take
    /// part in.
    pub(super) fn solve_dominant(
        &mut self,
        mut dominant: Dominant,
        guidance: &mut Guidance,
    ) -> std::result::Result<Upright, Vector3<f64>> {
        dominant.frame = in_order(&dominant.frame, &self.level.rotations[self.input.reference]);
        let axis_weights = axis_weights(&dominant.frame, &self.vertical(&dominant.frame), guidance);
        if self.options.guided_redetection {
            self.redetect(&mut dominant);
            guidance.inliers = self.inliers(&dominant);
            guidance.residuals.clone_from(&dominant.residuals);
        }
        let has_lines = self.vote.total_weight() > 0.0;
        let joint = has_lines && self.options.joint_refinement;
        let (mut start, mut axis_weights) = (dominant.frame, axis_weights);
        let reconciled = if joint { self.reconciled(&start, guidance) } else { None };
        let asked = reconciled.filter(|_| self.level.rotations.len() >= MIN_SLOPING_PHOTOGRAPHS);
        if let Some(Reconciled { upright, angle, .. }) = asked.filter(|found| found.sloping > SLOPING) {
            guidance.slope = Some(angle);
            start = turn_between(&start.column(column_near(&start, &upright)).into_owned(), &upright) * start;
            axis_weights = self::axis_weights(&start, &self.vertical(&start), guidance);
        }
        let frame = if joint { self.refined(&start, axis_weights) } else { start };
        let of_frame = self.vertical(&frame);
        let mut down = asked.map_or(of_frame, |found| {
            let told = if found.is_narrow { found.upright } else { found.vertical };
            // It is on the side of the frame's column, which may be up.
            told * told.dot(&of_frame).signum()
        });
        let frame = turn_between(&of_frame, &down) * frame;
        if joint {
            let vertical = column_near(&frame, &down);
            let refinement = Refinement { start: &frame, axes_used: 3, axis_weights };
            let mut covariance = self.covariance(refinement, vertical, asked.as_ref(), guidance.pooled);
            // Where upright lines are not heard beside the level ones, nothing tells whether these slope.
            if reconciled.is_none() && horizontal_agreement(guidance) > 0.0 {
                covariance += covariance_of_slopes(&down);
            }
            down = self.weighed(&down, &covariance, guidance)?;
        }
        guidance.spread = reconciled.map(|found| VerticalSpread::about(&down, &found));
        guidance.dominant = Some(rows_of(&(turn_between(&self.vertical(&frame), &down) * frame)));
        guidance.used = true;
        let rotations = match joint && self.options.camera_correction {
            true => self.corrected(&frame, axis_weights),
            false => self.level.rotations.to_vec(),
        };
        let own = match joint {
            true => common_rolls(&down, &rotations),
            false => self.own_rolls(self.level.rotations, &frame, &down, &guidance.inliers),
        };
        Ok(self.solve(&down, &own, rotations, guidance))
    }

    /// Covariance of the vertical, column `vertical` of a frame that lines refined, rad^2, by asking different
    /// photographs; or without one sector of the scene each, where that is beyond what may guide: then all photographs
    /// know it from one and the same thing. What is `reconciled` knows that already. Of a frame of all lines together
    /// (`pooled`) the larger counts in any case: single photographs agree on nothing.
    fn covariance(
        &self,
        refinement: Refinement<'_>,
        vertical: usize,
        reconciled: Option<&Reconciled>,
        pooled: bool,
    ) -> Matrix3<f64> {
        let by_photographs = covariance_by_photographs(&self.vote, refinement, vertical);
        let by_sectors = match reconciled {
            Some(found) => Some(found.covariance),
            None => covariance_by_sectors(&self.vote, refinement, vertical),
        };
        let photographs = deviation(&by_photographs);
        let counts = |covariance: &Matrix3<f64>| {
            let sectors = deviation(covariance);
            // A deviation that is not a number is no more than another.
            let wider = photographs.is_nan() || sectors > photographs;
            wider && (pooled || sectors > MAX_GUIDING_DEVIATION_DEG.to_radians())
        };
        by_sectors.filter(counts).unwrap_or(by_photographs)
    }

    /// The vertical of lines weighed against what else is known of it; an error with that vertical if lines do not
    /// guide it, with the failed clause. `covariance` is the lines', rad^2, by asking different photographs.
    fn weighed(
        &self,
        lines: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        guidance: &mut Guidance,
    ) -> std::result::Result<Vector3<f64>, Vector3<f64>> {
        let deviation = deviation(covariance);
        guidance.vertical_deviation = Some(deviation).filter(|deviation| deviation.is_finite());
        if self.options.gate == GateMode::Paper {
            return Ok(*lines);
        }
        let degrees = deviation.to_degrees();
        if guidance.pooled && degrees > MAX_GUIDING_DEVIATION_DEG {
            guidance.pooled = false;
            guidance.failed_clause = Some(format!(
                "the lines leave the vertical uncertain by {degrees:.1} degrees ({MAX_GUIDING_DEVIATION_DEG:.1} allowed)"
            ));
            return Err(self.level.down);
        }
        let recorded = self.level.without_horizon();
        let angle = lines.angle(&recorded.down);
        let allowed = MAX_GRAVITY_DEVIATIONS * deviation.hypot(recorded.deviation());
        let allowed = allowed.max(MAX_GRAVITY_ANGLE_DEG.to_radians());
        if self.level.has_gravity && angle > allowed {
            guidance.pooled = false;
            guidance.failed_clause = Some(format!(
                "the lines' vertical is {:.1} degrees from the one that the cameras recorded ({:.1} allowed)",
                angle.to_degrees(),
                allowed.to_degrees()
            ));
            return Err(self.level.down);
        }
        // Also of photographs whose own directions do not agree, lines may.
        let telling = self.vote.photographs_along(lines);
        let believed = self.level.without_contradicted_horizon(lines, deviation);
        let (down, evidence) = believed.with_lines(lines, covariance, telling);
        let outweigh = evidence.first().is_some_and(|lines| lines.share >= GUIDING_SHARE);
        if outweigh && degrees <= MAX_GUIDING_DEVIATION_DEG {
            guidance.level = evidence;
            return Ok(down);
        }
        // A horizon that they contradict counts beside lines that do not guide.
        let (down, evidence) = self.level.with_lines(lines, covariance, telling);
        guidance.level = evidence;
        guidance.pooled = false;
        let limit = match outweigh {
            true => format!("({MAX_GUIDING_DEVIATION_DEG:.1} allowed)"),
            false => format!("and more than what is known without them ({:.1})", self.level.deviation().to_degrees()),
        };
        guidance.failed_clause =
            Some(format!("the lines leave the vertical uncertain by {degrees:.1} degrees {limit}"));
        Err(down)
    }

    /// What upright and level lines near `frame` say together.
    fn reconciled(&self, frame: &Matrix3<f64>, guidance: &Guidance) -> Option<Reconciled> {
        let vertical = column_near(frame, &self.vertical(frame));
        reconciled(&self.vote, frame, vertical, horizontal_agreement(guidance))
    }

    fn corrected(&self, frame: &Matrix3<f64>, axis_weights: AxisWeights) -> Vec<Matrix3<f64>> {
        let certainties = relative_certainties(self.input.cameras, self.input.edges);
        corrected_rotations(self.level.rotations, &certainties, &self.vote, frame, axis_weights)
    }

    /// The frame that all segments vote for, unless it left the neighborhood of the photographs' own.
    fn refined(&self, frame: &Matrix3<f64>, axis_weights: AxisWeights) -> Matrix3<f64> {
        let refined = self.vote.refine_frame(frame, axis_weights);
        let limit = MAX_REFINEMENT_TOLERANCES * joint::TOLERANCE_DEG.to_radians();
        let (before, after) = (self.vertical(frame), self.vertical(&refined));
        // A comparison with NaN is false: a refinement that is not finite is dropped too.
        if before.angle(&after) <= limit { refined } else { *frame }
    }

    /// The prior of a vertical alone, sought near the level of the cameras, if the segments leave no doubt about it.
    fn vertical_alone(&self, guidance: &mut Guidance) -> Option<Upright> {
        if !self.options.vertical_only {
            return None;
        }
        let peak = vertical_peak(&self.vote, &self.level.down)?;
        let total_weight = self.vote.total_weight();
        guidance.vertical_rivalry = Some(peak.rivalry);
        guidance.vertical_share = Some(peak.share(total_weight));
        if !peak.is_clear(total_weight, self.level.rotations.len()) {
            return None;
        }
        let (first, second) = orthonormal_complement(&peak.down);
        let frame = Matrix3::from_columns(&[peak.down, first, second]);
        let refinement =
            Refinement { start: &frame, axes_used: 1, axis_weights: AxisWeights::alike(0).upright_alone() };
        let covariance = self.covariance(refinement, 0, None, false);
        let refused = guidance.clone();
        let Ok(down) = self.weighed(&peak.down, &covariance, guidance) else {
            *guidance = refused;
            return None;
        };
        guidance.used = true;
        guidance.vertical_only = true;
        let own = common_rolls(&down, self.level.rotations);
        Some(self.solve(&down, &own, self.level.rotations.to_vec(), guidance))
    }

    /// The mean vertical of segments that do not guide and of what else is known, if they tell anything of it.
    fn probable_vertical(&self, guidance: &mut Guidance) -> Option<Vector3<f64>> {
        if !self.options.vertical_only {
            return None;
        }
        let ProbableVertical { down, covariance } = probable_vertical(&self.vote, self.level)?;
        // What a single photograph shows, or scattered rocks, is chance as often as not.
        let photographs = self.vote.photographs_along(&down);
        if photographs < MIN_UPRIGHT_PHOTOGRAPHS {
            return None;
        }
        guidance.level = self.level.evidence_beside_lines(&down, &covariance, photographs)?;
        Some(down)
    }

    /// Searches photographs that disagree, or have no triad, again near the dominant directions.
    fn redetect(&mut self, dominant: &mut Dominant) {
        let frame = dominant.frame;
        for index in 0..self.level.rotations.len() {
            if dominant.residuals[index].is_some_and(|residual| residual <= self.options.rejection) {
                continue;
            }
            let planes = self.vote.planes(index);
            if planes.len() < self.input.vanishing.min_lines {
                continue;
            }
            let start = self.level.rotations[index] * frame;
            let near = RefinedTriad::refine(&start, planes, self.input.vanishing);
            let enough = match self.input.triads[index].triad() {
                Some(own) => near.score >= REDETECTION_SHARE * own.quality * planes.total_weight,
                None => near.score >= self.input.vanishing.min_quality * planes.total_weight,
            };
            if enough {
                let triad = self.level.rotations[index].tr_mul(&near.triad);
                dominant.residuals[index] = Some(triad_residual(&frame, &triad));
                self.triads[index] = Some(triad);
            }
        }
    }

    /// The turns that stand every photograph upright as far as the others agree; `rotations` are those that lines
    /// correct.
    fn solve(
        &self,
        down: &Vector3<f64>,
        own: &[Option<f64>],
        rotations: Vec<Matrix3<f64>>,
        guidance: &mut Guidance,
    ) -> Upright {
        let evidence = RollEvidence {
            down,
            own,
            given_rotations: self.level.rotations,
            corrected_rotations: &rotations,
            edges: self.input.edges,
        };
        let solved = solve_turns(&evidence, self.options);
        guidance.weights = solved.weights;
        Upright { down: *down, theta: solved.theta, rotations }
    }
}

/// The directions of a frame in the order and with the signs that bring them closest to the axes of the `reference`
/// camera, so that neither depends on which of many equal hypotheses came first; a rotation.
fn in_order(frame: &Matrix3<f64>, reference: &Matrix3<f64>) -> Matrix3<f64> {
    let (mut ordered, _) = match_triad(&reference.transpose(), frame);
    if ordered.determinant() < 0.0 {
        ordered.column_mut(2).neg_mut();
    }
    ordered
}

/// The smallest rotation that takes the direction `from` to `to`.
fn turn_between(from: &Vector3<f64>, to: &Vector3<f64>) -> Matrix3<f64> {
    let axis = from.cross(to);
    let angle = from.angle(to);
    axis.try_normalize(f64::EPSILON).map_or_else(Matrix3::identity, |axis| exp_rotation(&(axis * angle)))
}

/// Full weight for the vertical; for the horizontals as much as the photographs' directions agree: where buildings
/// stand at several angles, what passes for one horizontal direction would pull the vertical along. None where they lie
/// along a slope. `down` is the frame's vertical.
pub(super) fn axis_weights(frame: &Matrix3<f64>, down: &Vector3<f64>, guidance: &Guidance) -> AxisWeights {
    let horizontal = if guidance.slope.is_some() { 0.0 } else { horizontal_agreement(guidance) };
    AxisWeights::new(column_near(frame, down), 1.0, horizontal)
}

/// How far photographs agree on the horizontal directions, from 0 to 1.
fn horizontal_agreement(guidance: &Guidance) -> f64 {
    // It is known by the lines of all photographs together, the level ones among them, and not by what single
    // photographs say.
    if guidance.pooled {
        return 1.0;
    }
    let residuals = guidance.inliers.iter().filter_map(|&index| guidance.residuals[index]);
    let mean = residuals.sum::<f64>() / guidance.inliers.len().max(1) as f64;
    // r = 4 (1 - cos phi) of the misorientation phi that is ordinary detection noise.
    let ordinary = 4.0 * (1.0 - ORDINARY_MISORIENTATION_DEG.to_radians().cos());
    if mean > ordinary { (ordinary / mean).powi(2) } else { 1.0 }
}

/// The column of `frame` that lies nearest to a direction or its opposite.
pub(super) fn column_near(frame: &Matrix3<f64>, direction: &Vector3<f64>) -> usize {
    frame.tr_mul(direction).iamax()
}

/// Each photograph's roll by the common vertical: after the joint refinement no photograph's own triad knows better.
fn common_rolls(down: &Vector3<f64>, rotations: &[Matrix3<f64>]) -> Vec<Option<f64>> {
    rotations.iter().map(|rotation| roll_of(&(rotation * down))).collect()
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;
    use trueup_core::geometry::random_rotation;

    use super::*;

    #[test]
    fn the_directions_of_a_frame_come_in_one_order() {
        let mut generator = StageContext::default().generator("order", 0);
        for _ in 0..20 {
            let (frame, reference) = (random_rotation(&mut generator), random_rotation(&mut generator));
            let ordered = in_order(&frame, &reference);
            assert!((ordered.determinant() - 1.0).abs() < 1e-12);
            let [x, y, z] = [0, 1, 2].map(|column| frame.column(column).into_owned());
            for other in [[y, z, x], [-y, x, z], [z, -y, x], [-x, -y, z]] {
                assert!((in_order(&Matrix3::from_columns(&other), &reference) - ordered).norm() < 1e-12);
            }
        }
    }
}
