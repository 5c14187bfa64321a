//! What is expected of focal lengths, where overlaps are not sure of them.
//!
//! A rotating camera's focal length is seen in how an overlap is stretched from one photograph to the other. A step
//! aside stretches it as well, as another focal length would: before a wall that is seen head on, one that is twice as
//! long. What remains is how badly matches meet, and that grows little over a wide range of focal lengths. So where
//! they do not meet to the error of a feature, the directions of lines ([`super::directions`]) and metadata, or what is
//! usual, have their say.
//!
//! So it is where a lens bends: how much it does trades for the focal length, and is refined anew at each.
//!
//! # Source
//! The focal length that is most probable by Bayes' theorem. Errors of unknown size are integrated out (Gelman and
//! others, "Bayesian Data Analysis", section 3.2): the likelihood of n of them falls as their mean square to the power
//! of n / 2. Witnesses that may be wrong altogether have the tails of Student's t (the same, chapter 17): where two
//! agree, a third that contradicts both is left.

use nalgebra::Matrix3;
use trueup_core::camera::Camera;
use trueup_core::geometry::{exp_rotation, log_rotation};
use trueup_core::lines::LineSegment;
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};

use super::bundle::{BundleAdjustment, FINE_HUBER_PX, Parameters};
use super::directions::{FocalByLines, peak};
use super::intrinsics::IntrinsicsModel;
use super::options::CameraOptions;
use super::prior::{CameraPrior, USUAL_FOCAL_SD};

/// Root mean square distance of matches, working pixels, that features leave by themselves, each its own way.
const FEATURE_ERROR_PX: f64 = 0.5;
/// So many matches of an overlap are independent where the photographer moved: whole parts of an overlap move alike.
const INDEPENDENT_PARTS: f64 = 4.0;
/// More overlaps tell focal lengths without help.
const MOST_OVERLAPS: usize = 30;
/// Distance from what is expected, in its standard deviations, up to which it is not asked: it would hardly move
/// anything.
const AS_EXPECTED: f64 = 0.5;
/// Step of the search, as the logarithm of a factor. Reasoned: the standard deviation of what is looked for is 0.06 at
/// the least, so that a parabola through three steps follows its peak; a fourth of it moves what comes out by less than
/// a thousandth.
const STEP: f64 = 0.08;
/// Most steps from what matches say to what is expected; they are longer where it is farther.
const MOST_STEPS: f64 = 30.0;
/// Relative decrease of the cost below which the cameras of one step have settled: what that makes improbable falls by
/// so much, a few hundred times.
const SETTLED: f64 = 1e-4;
/// How far the search goes beyond what matches say and what is expected, in the same terms, where lines are asked.
const BEYOND: f64 = 0.4;
/// Of how many errors' worth what matches, and metadata, say is as a whole: who walks along a facade stretches all
/// overlaps alike, and a picture that was cut out of another keeps its metadata. Reasoned: with four it has the tails
/// of Student's t with three degrees of freedom, the fewest that have a variance.
const ERRORS_OF_WITNESS: f64 = 4.0;
/// How improbable the focal lengths one step aside are by matches that are so sure of theirs, twice as sure as lines,
/// that these are not asked.
const SURE: f64 = 7.0;

/// Cameras with focal lengths in which what is expected of them takes part.
pub(super) struct ExpectedFocal {
    pub parameters: Parameters,
    pub opened: OpenFocal,
}

/// What else than matches came to of focal lengths that these leave open.
#[derive(Debug, Clone, Copy)]
pub(super) struct OpenFocal {
    /// By which factor the focal lengths are those of the matches.
    pub factor: f64,
    /// Whether lines took part, beside what is expected.
    pub by_lines: bool,
}

/// Cameras whose focal lengths are longer than those of the matches by a factor.
struct Candidate {
    log_factor: f64,
    parameters: Parameters,
    /// Minus twice the logarithm of its probability by matches and edges, but for a constant, were these right about
    /// all but chance.
    improbable: f64,
}

/// Candidates by the distance of their focal lengths from the matches' own.
struct Sides {
    shorter: Vec<Candidate>,
    longer: Vec<Candidate>,
}

/// The cameras of `found`, whose unknowns are those of `model`, with the focal lengths that are most probable; `None`
/// where matches are sure of theirs, or tell what is expected, and `lines` say nothing else.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn expected(
    problem: &BundleAdjustment<'_>,
    found: &Parameters,
    model: &IntrinsicsModel,
    lines: &[Vec<LineSegment>],
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Option<ExpectedFocal>> {
    let expectation = Expectation::of(problem.priors, found, options);
    let Some(search) = FocalSearch::new(problem, found, model, &expectation, context) else { return Ok(None) };
    let step = search.step;
    let own = Candidate { log_factor: 0.0, parameters: found.clone(), improbable: 0.0 };
    let mut sides = Sides { shorter: Vec::new(), longer: Vec::new() };
    search.extend_both(&mut sides, &own, [step; 2])?;
    let is_sure =
        [&sides.shorter, &sides.longer].iter().filter_map(|side| side.last()).all(|one| one.improbable > SURE);
    // What is less sure would move nothing, and a parabola through steps tells less exactly where it is.
    if is_sure && expectation.sd > STEP {
        return Ok(None);
    }
    let is_told = problem.priors.iter().any(|prior| prior.focal_told);
    let asks_lines = !is_told && !is_sure && lines.iter().filter(|lines| !lines.is_empty()).count() > 1;
    let is_as_expected = expectation.off.abs() <= AS_EXPECTED * expectation.sd;
    if !asks_lines && is_as_expected {
        return Ok(None);
    }
    let beyond = if asks_lines { BEYOND } else { step };
    search.extend_both(&mut sides, &own, [expectation.off, -expectation.off].map(|off| off.max(0.0) + beyond))?;
    let Sides { shorter, longer } = sides;
    let candidates: Vec<Candidate> = shorter.into_iter().rev().chain([own]).chain(longer).collect();
    let by_lines = if asks_lines { told_by_lines(problem.priors, &candidates, step, lines) } else { None };
    if by_lines.is_none() && is_as_expected {
        return Ok(None);
    }
    let least = candidates.iter().map(|one| one.improbable).fold(f64::INFINITY, f64::min);
    let probable = candidates.iter().map(|one| {
        let lines = by_lines.map_or(0.0, |told| told.improbable(one.log_factor));
        let matches = tailed(one.improbable - least);
        -(matches + expectation.improbable(one.log_factor) + lines)
    });
    let Some(best) = peak(&probable.collect::<Vec<f64>>()) else { return Ok(None) };
    let nearest = &candidates[best.round() as usize];
    let log_factor = nearest.log_factor + step * (best - best.round());
    let start = search.stretched(&nearest.parameters, log_factor);
    let parameters = problem.minimize(start, &search.model, FINE_HUBER_PX, context)?;
    let opened = OpenFocal { factor: log_factor.exp(), by_lines: by_lines.is_some() };
    Ok(Some(ExpectedFocal { parameters, opened }))
}

/// A search along focal lengths that are longer, or shorter, than those of the matches by one factor.
struct FocalSearch<'a> {
    problem: &'a BundleAdjustment<'a>,
    found: &'a Parameters,
    /// What is refined at each focal length.
    model: IntrinsicsModel,
    /// What matches and edges cost by `found`.
    costs: [f64; 2],
    /// How many of their distances are independent.
    independent: [f64; 2],
    /// The logarithm of the factor from one to the next.
    step: f64,
    context: &'a StageContext<'a>,
}

impl<'a> FocalSearch<'a> {
    /// `None` where matches meet to the error of features, or there are more overlaps than leave anything open.
    fn new(
        problem: &'a BundleAdjustment<'a>,
        found: &'a Parameters,
        model: &IntrinsicsModel,
        expectation: &Expectation,
        context: &'a StageContext<'a>,
    ) -> Option<Self> {
        let overlaps = problem.observations.pairs.len();
        let matches: usize = problem.observations.pairs.iter().map(|pair| pair.matches.len()).sum();
        let costs = problem.fine_costs(found);
        // Of both directions of every match.
        let mean_square = costs[0] / (2 * matches).max(1) as f64;
        if overlaps > MOST_OVERLAPS || mean_square.sqrt() <= FEATURE_ERROR_PX {
            return None;
        }
        // What features err by is independent; its share in the errors falls with their square.
        let own = (FEATURE_ERROR_PX.powi(2) / mean_square).powi(2);
        let independent = INDEPENDENT_PARTS * overlaps as f64 + own * matches as f64;
        // Edges in one part of a photograph are bent together; pinholes bend none.
        let curves = if model.has_lens() { problem.curves.clusters.len() as f64 } else { 0.0 };
        let step = STEP.max(expectation.off.abs() / MOST_STEPS);
        Some(Self {
            problem,
            found,
            model: model.with_focal_held(),
            costs,
            independent: [independent, curves],
            step,
            context,
        })
    }

    /// The one at a factor of this logarithm, its rotations and lenses refined from those of one nearby.
    fn candidate(&self, log_factor: f64, nearby: &Parameters) -> Result<Candidate> {
        self.context.check_cancelled()?;
        let start = self.stretched(nearby, log_factor);
        let parameters = self.problem.minimize_until(SETTLED, start, &self.model, FINE_HUBER_PX, self.context)?;
        let costs = self.problem.fine_costs(&parameters);
        let told = (0..costs.len()).filter(|&by| self.costs[by] > 0.0);
        let improbable = told.map(|by| self.independent[by] * (costs[by] / self.costs[by]).ln()).sum();
        Ok(Candidate { log_factor, parameters, improbable })
    }

    /// Where refinement starts from at a factor of this logarithm: with longer focal lengths than `nearby` photographs
    /// are turned less far apart.
    fn stretched(&self, nearby: &Parameters, log_factor: f64) -> Parameters {
        let focal_px: Vec<f64> = self.found.focal_px.iter().map(|focal_px| focal_px * log_factor.exp()).collect();
        let by: Vec<f64> = focal_px.iter().zip(&nearby.focal_px).map(|(to, from)| to / from).collect();
        let anchor = nearby.rotations[self.problem.reference];
        let turned = |(rotation, by): (&Matrix3<f64>, &f64)| {
            exp_rotation(&(log_rotation(&(rotation * anchor.transpose())) / *by)) * anchor
        };
        let rotations = nearby.rotations.iter().zip(&by).map(turned).collect();
        Parameters { focal_px, rotations, lenses: nearby.lenses.clone() }
    }

    /// Goes on to the sizes of `ends`, of the shorter side and the longer.
    fn extend_both(&self, sides: &mut Sides, own: &Candidate, ends: [f64; 2]) -> Result<()> {
        let Sides { shorter, longer } = sides;
        let (shorter, longer) =
            rayon::join(|| self.extend(shorter, own, -ends[0]), || self.extend(longer, own, ends[1]));
        shorter.and(longer)
    }

    /// Goes on to `end` or a little beyond, in steps, on the side of `own`, the matches' own, that `side` holds.
    fn extend(&self, side: &mut Vec<Candidate>, own: &Candidate, end: f64) -> Result<()> {
        loop {
            let last = side.last().unwrap_or(own);
            if last.log_factor.abs() >= end.abs() {
                return Ok(());
            }
            let log_factor = (self.step * (side.len() + 1) as f64).copysign(end);
            side.push(self.candidate(log_factor, &last.parameters)?);
        }
    }
}

/// What this many standard deviations squared make improbable of a witness that may be wrong altogether: as a bell does
/// where they are few.
fn tailed(square: f64) -> f64 {
    ERRORS_OF_WITNESS * (square / ERRORS_OF_WITNESS).ln_1p()
}

/// What lines tell through the cameras of `candidates`, ordered by their focal lengths.
fn told_by_lines(
    priors: &[CameraPrior],
    candidates: &[Candidate],
    step: f64,
    lines: &[Vec<LineSegment>],
) -> Option<FocalByLines> {
    let cameras: Vec<Vec<Camera>> = candidates.iter().map(|one| one.parameters.cameras(priors)).collect();
    let frames: Vec<WorkingFrame> = priors.iter().map(|prior| prior.frame).collect();
    FocalByLines::told(&cameras, candidates.first()?.log_factor, step, lines, &frames)
}

/// What is expected of focal lengths as a whole.
#[derive(Debug, Clone, Copy)]
struct Expectation {
    /// Logarithm of the factor by which those found are longer than expected.
    off: f64,
    /// Its standard deviation.
    sd: f64,
    /// Whether it is what metadata say, which may be those of another picture.
    is_recorded: bool,
}

impl Expectation {
    /// Of what is known of each photograph: of those that the user told alone where there are any, else of those with
    /// metadata. All are longer or shorter than expected by one factor: what is best known of some says it of the
    /// others.
    fn of(priors: &[CameraPrior], found: &Parameters, options: &CameraOptions) -> Self {
        let told = priors.iter().any(|prior| prior.focal_told);
        let known = priors.iter().any(|prior| prior.focal_px.is_some());
        let is_asked = |prior: &CameraPrior| if told { prior.focal_told } else { prior.focal_px.is_some() == known };
        let asked = priors.iter().zip(&found.focal_px).filter(|(prior, _)| is_asked(prior));
        let off = |(prior, &focal_px): (&CameraPrior, &f64)| (focal_px / prior.expected_focal_px()).ln();
        let (sum, count) = asked.clone().map(off).fold((0.0, 0_usize), |(sum, count), one| (sum + one, count + 1));
        let sds = asked.map(|(prior, _)| if known { prior.focal_sd(options) } else { USUAL_FOCAL_SD });
        Self { off: sum / count.max(1) as f64, sd: sds.fold(0.0, f64::max), is_recorded: known && !told }
    }

    /// Minus twice the logarithm of its probability when the focal lengths are longer by a factor of this logarithm.
    fn improbable(&self, log_factor: f64) -> f64 {
        let square = ((self.off + log_factor) / self.sd).powi(2);
        if self.is_recorded { tailed(square) } else { square }
    }
}

#[cfg(test)]
#[path = "expected_focal_tests.rs"]
mod tests;
