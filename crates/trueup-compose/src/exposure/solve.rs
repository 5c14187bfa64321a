//! The robust least-squares problem over all overlaps: its repetitions, and what comes of them.

use trueup_core::color::TransferCurve;
use trueup_core::{Result, StageContext};

use super::equations::LightEquations;
use super::level::LevelInput;
use super::measured::Thumbnail;
use super::options::{ExposureModel, ExposureOptions, GainAnchor};
use super::overlap::Observed;
use super::robust::LEAST_DEVIATION;
use super::solution::Solution;
use crate::light::{Correction, Corrections, Response};
use crate::render_options::Look;

/// Repetitions of the weighted solution; the weights of real overlaps stand still after six.
const REPETITIONS: usize = 8;

/// What the overlaps say, and of whom.
#[derive(Clone, Copy)]
pub(super) struct SolveInput<'a> {
    /// The camera of each photograph.
    pub(super) cameras: &'a [usize],
    pub(super) observed: &'a [Observed],
    /// The photographs.
    pub(super) thumbnails: &'a [Thumbnail<'a>],
    /// Position of the reference.
    pub(super) reference: usize,
    /// How the panorama shows differences of exposure.
    pub(super) look: Look,
    /// The curve beside which a response is estimated; `None` for none.
    pub(super) profile: Option<&'a TransferCurve>,
}

/// The corrections of all photographs.
pub(super) fn solve(input: &SolveInput<'_>, options: &ExposureOptions, context: &StageContext) -> Result<Corrections> {
    let &SolveInput { cameras, observed, profile, .. } = input;
    let count = cameras.len();
    let problem = LightEquations::new(cameras, observed, options);
    let mut weights: Vec<Vec<f64>> = observed.iter().map(|one| vec![1.0; one.samples.len()]).collect();
    problem.weigh_by_medians(&mut weights);
    let mut solution = Solution::new(problem.unknowns, count, observed);
    for repetition in 0..REPETITIONS {
        context.check_cancelled()?;
        if repetition > 0 {
            if let Some(profile) = profile
                && problem.predict(&mut solution, profile).is_err()
            {
                return without_response(input, options, context);
            }
            problem.weigh(&solution, &mut weights);
        }
        let found = match profile {
            // Where the exposures differ is only known from the first solution.
            Some(profile) if repetition > 0 => problem.with_response(&weights, &mut solution, profile),
            _ => problem.brightness(&weights, &mut solution),
        };
        if found.is_none() {
            return Ok(Corrections::plain(count));
        }
        if options.model == ExposureModel::Full {
            solution.casts = problem.casts(&weights, &solution);
        }
    }
    if !solution.response.is_plain() && problem.effect(&weights, &solution) < LEAST_DEVIATION {
        solution.response = Response::default();
        if problem.brightness(&weights, &mut solution).is_none() {
            return Ok(Corrections::plain(count));
        }
        solution.casts = problem.casts(&weights, &solution);
    }
    // Gains grow with a response that stretches the light. At their limit photographs do not fit any longer, which is
    // worse than what a response is good for.
    let (corrections, limited) = problem.corrections(&solution, input);
    let makes_curve = profile.is_none_or(|profile| corrections.response.curve(profile).is_ok());
    if !makes_curve || (!corrections.response.is_plain() && limited) {
        return without_response(input, options, context);
    }
    let shoulder = input.thumbnails.first().map(|one| problem.shoulder(&weights, &solution, one.curve));
    Ok(match shoulder {
        Some(shoulder) => corrections.with_shoulder(shoulder),
        None => corrections,
    })
}

/// The same with the profile's curve as it is: what falls back on where a response that was found is of no use.
fn without_response(
    input: &SolveInput<'_>,
    options: &ExposureOptions,
    context: &StageContext<'_>,
) -> Result<Corrections> {
    solve(&SolveInput { profile: None, ..*input }, options, context)
}

impl LightEquations<'_> {
    /// Gains relative to the anchor, the vignetting of each photograph's lens, and the response; and whether gains had
    /// to be limited.
    fn corrections(&self, solution: &Solution, input: &SolveInput<'_>) -> (Corrections, bool) {
        let &SolveInput { thumbnails, reference, look, .. } = input;
        let mut compared = vec![false; self.count];
        for one in self.observed {
            compared[one.pair.first] = true;
            compared[one.pair.second] = true;
        }
        let corrections = self.relative_to(self.anchor(solution, &compared, reference), solution, &compared);
        let (corrections, limited) = corrections.limited(&compared, self.options.max_gain);
        // What is kept of all light needs no level at which least is lost.
        let keeps_light = thumbnails.iter().any(|thumbnail| thumbnail.curve.light_range().is_some());
        let log_factor = match self.options.anchor {
            _ if keeps_light => 0.0,
            GainAnchor::Scene => {
                LevelInput { thumbnails, corrections: &corrections, compared: &compared, look }.log_factor()
            }
            GainAnchor::Reference | GainAnchor::Mean => 0.0,
        };
        (corrections.at_level(log_factor, &compared), limited)
    }

    /// Logarithms of the gains that become 1.
    fn anchor(&self, solution: &Solution, compared: &[bool], reference: usize) -> [f64; 3] {
        let taking_part = compared.iter().filter(|&&compared| compared).count().max(1);
        std::array::from_fn(|channel| match self.options.anchor {
            GainAnchor::Reference | GainAnchor::Scene => self.log_gain(solution, reference, channel),
            GainAnchor::Mean => {
                let all = (0..self.count).filter(|&index| compared[index]);
                all.map(|index| self.log_gain(solution, index, channel)).sum::<f64>() / taking_part as f64
            }
        })
    }

    fn log_gain(&self, solution: &Solution, index: usize, channel: usize) -> f64 {
        solution.brightness[index] + solution.casts[channel][index]
    }

    /// The corrections without limits; gains whose logarithms are `anchor` become 1, and those of what was not compared
    /// are.
    fn relative_to(&self, anchor: [f64; 3], solution: &Solution, compared: &[bool]) -> Corrections {
        let correction = |index: usize| {
            let lens = self.count + self.lens_of[index] * self.terms;
            let mut correction = Correction::default();
            for term in 0..self.terms {
                correction.vignetting[term] = solution.brightness[lens + term];
            }
            if compared[index] {
                correction.gain =
                    std::array::from_fn(|channel| (self.log_gain(solution, index, channel) - anchor[channel]).exp());
            }
            correction
        };
        Corrections { response: solution.response, photographs: (0..self.count).map(correction).collect() }
    }
}
