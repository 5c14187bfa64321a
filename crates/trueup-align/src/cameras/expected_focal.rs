//! What is expected of focal lengths, where overlaps are not sure of them.
//!
//! A rotating camera's focal length is seen in how an overlap is stretched from one photograph to the other. A step aside
//! stretches it as well, as another focal length would: before a wall that is seen head on, one that is twice as long. What
//! remains is how badly matches meet, and that grows little over a wide range of focal lengths. So where they do not meet to the error of a feature,
//! metadata, or what is usual, have their say.
//!
//! # Source
//! The focal length that is most probable by Bayes' theorem. Errors of unknown size are integrated out (Gelman and others, "Bayesian Data
//! Analysis", section 3.2): the likelihood of n of them falls as their mean square to the power of n / 2.

use trueup_core::{Result, StageContext};

use super::bundle::{BundleAdjustment, FINE_HUBER_PX, Parameters};
use super::intrinsics::IntrinsicsModel;
use super::options::CameraOptions;
use super::prior::{CameraPrior, USUAL_FOCAL_SD};

/// Root mean square distance of matches, working pixels, that features leave by themselves, each its own way.
const FEATURE_ERROR_PX: f64 = 0.5;
/// So many matches of an overlap are independent where the photographer moved: whole parts of an overlap move alike.
const INDEPENDENT_PARTS: f64 = 4.0;
/// More overlaps tell focal lengths without help.
const MOST_OVERLAPS: usize = 30;
/// Distance from what is expected, in its standard deviations, up to which nothing is asked: it would hardly move anything.
const AS_EXPECTED: f64 = 0.5;
/// Steps of the search between what matches say and what is expected.
const STEPS: usize = 12;

/// Cameras with focal lengths in which what is expected of them takes part.
pub(super) struct ExpectedFocal {
    pub parameters: Parameters,
    /// By which factor the focal lengths are those of the matches.
    pub factor: f64,
}

/// The cameras of `found`, refined without lenses, with the focal lengths that are most probable; `None` where matches are sure of theirs, or
/// tell what is expected.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn expected(
    problem: &BundleAdjustment<'_>,
    found: &Parameters,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Option<ExpectedFocal>> {
    let overlaps = problem.observations.pairs.len();
    let matches: usize = problem.observations.pairs.iter().map(|pair| pair.matches.len()).sum();
    let expectation = Expectation::of(problem.priors, found, options);
    // Both directions of every match.
    let mean_square = |at: &Parameters| problem.matches_cost(at, FINE_HUBER_PX) / (2 * matches).max(1) as f64;
    let by_matches = mean_square(found);
    let is_sure = by_matches.sqrt() <= FEATURE_ERROR_PX;
    if is_sure || overlaps > MOST_OVERLAPS || expectation.off.abs() <= AS_EXPECTED * expectation.sd {
        return Ok(None);
    }
    // What features err by is independent; its share in the errors falls with their square.
    let own = (FEATURE_ERROR_PX.powi(2) / by_matches).powi(2);
    let independent = INDEPENDENT_PARTS * overlaps as f64 + own * matches as f64;
    let fixed = IntrinsicsModel::fixed(problem.priors.len());
    let mut best: Option<(f64, ExpectedFocal)> = None;
    let mut at = found.clone();
    for step in 0..=STEPS {
        context.check_cancelled()?;
        let factor = (-expectation.off * step as f64 / STEPS as f64).exp();
        at.focal_px = found.focal_px.iter().map(|focal_px| focal_px * factor).collect();
        at = problem.minimize(at, &fixed, FINE_HUBER_PX, context)?;
        let improbable = independent * (mean_square(&at) / by_matches).ln() + expectation.improbable(factor);
        if best.as_ref().is_none_or(|(least, _)| improbable < *least) {
            best = Some((improbable, ExpectedFocal { parameters: at.clone(), factor }));
        }
    }
    Ok(best.map(|(_, best)| best).filter(|best| best.factor != 1.0))
}

/// What is expected of focal lengths as a whole.
#[derive(Debug, Clone, Copy)]
struct Expectation {
    /// Logarithm of the factor by which those found are longer than expected.
    off: f64,
    /// Its standard deviation.
    sd: f64,
}

impl Expectation {
    /// Of what is known of each photograph: of those that the user told alone where there are any, else of those with metadata. All are longer
    /// or shorter than expected by one factor: what is best known of some says it of the others.
    fn of(priors: &[CameraPrior], found: &Parameters, options: &CameraOptions) -> Self {
        let told = priors.iter().any(|prior| prior.focal_told);
        let known = priors.iter().any(|prior| prior.focal_px.is_some());
        let is_asked = |prior: &CameraPrior| if told { prior.focal_told } else { prior.focal_px.is_some() == known };
        let asked = priors.iter().zip(&found.focal_px).filter(|(prior, _)| is_asked(prior));
        let off = |(prior, &focal_px): (&CameraPrior, &f64)| (focal_px / prior.expected_focal_px()).ln();
        let (sum, count) = asked.clone().map(off).fold((0.0, 0_usize), |(sum, count), one| (sum + one, count + 1));
        let sds = asked.map(|(prior, _)| if known { prior.focal_sd(options) } else { USUAL_FOCAL_SD });
        Self { off: sum / count.max(1) as f64, sd: sds.fold(0.0, f64::max) }
    }

    /// Minus twice the logarithm of its probability when the focal lengths are longer by a factor.
    fn improbable(&self, factor: f64) -> f64 {
        ((self.off + factor.ln()) / self.sd).powi(2)
    }
}

#[cfg(test)]
#[path = "expected_focal_tests.rs"]
mod tests;
