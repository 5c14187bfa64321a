//! Bundle adjustment from coarse to fine, with the focal lengths that the options and the data ask for.

use trueup_core::lines::LineSegment;
use trueup_core::{Result, StageContext};

use super::bundle::{BundleAdjustment, COARSE_HUBER_PX, Parameters};
use super::expected_focal::{self, ExpectedFocal, OpenFocal};
use super::intrinsics::IntrinsicsModel;
use super::lenses::{FoundLenses, LensSearch};
use super::observations::Observations;
use super::options::{CameraOptions, FocalSharing};
use super::prior::CameraPrior;
use super::straightness::CurveObservations;
use super::zoom;

/// What to refine: the photographs, what was observed of them and which of them the others turn about.
#[derive(Clone, Copy)]
pub(super) struct RefinementInput<'a> {
    pub priors: &'a [CameraPrior],
    pub observations: &'a Observations,
    /// More of the same matches, from which lenses are told.
    pub for_lenses: &'a Observations,
    /// What tells of lenses beside them.
    pub curves: &'a CurveObservations,
    /// Line segments of each photograph.
    pub lines: &'a [Vec<LineSegment>],
    /// The photograph whose rotation stays.
    pub anchor: usize,
}

/// Refined cameras and what became of their focal lengths.
pub(super) struct Refined {
    pub parameters: Parameters,
    /// Whether photographs of a camera have focal lengths of their own, all or those that differ.
    pub per_picture_focal: bool,
    /// Whether no focal length could be found, and those expected were taken.
    pub focal_failed: bool,
    /// How far lenses may move corners unnoticed, working pixels, one standard deviation; `None` where few overlaps had
    /// not to tell of them alone, or a lens was found or told.
    pub lens_doubt_px: Option<f64>,
    /// The cameras as the matches alone have them, where what lines tell, or is expected, of focal lengths took part.
    pub by_matches: Option<ByMatches>,
}

/// Cameras without what lines tell and what is expected of focal lengths.
pub(super) struct ByMatches {
    pub parameters: Parameters,
    pub opened: OpenFocal,
}

impl Refined {
    /// Of which nothing is to be said.
    fn of(parameters: Parameters, per_picture_focal: bool) -> Self {
        Self { parameters, per_picture_focal, focal_failed: false, lens_doubt_px: None, by_matches: None }
    }
}

/// Fewest overlaps whose matches alone tell of a lens.
const OVERLAPS_FOR_LENSES: usize = 3;

/// Refines `start`.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn refine(
    input: RefinementInput<'_>,
    start: &Parameters,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Refined> {
    let priors = input.priors;
    let problem_of = |observations| BundleAdjustment {
        priors,
        observations,
        curves: input.curves,
        start_focal_px: start.focal_px.clone(),
        reference: input.anchor,
        focal_sd: priors.iter().map(|prior| prior.focal_sd(options)).collect(),
    };
    let (problem, for_lenses) = (problem_of(input.observations), problem_of(input.for_lenses));
    // Start values that already differ (metadata of a zoom) keep their ratios inside a shared model.
    let shared = IntrinsicsModel::shared(priors);
    let own = IntrinsicsModel::per_photograph(priors.len());
    let mut per_picture_focal = options.focal_sharing == FocalSharing::PerPicture;
    let mut model = if per_picture_focal { own.clone() } else { shared.clone() };

    let mut fine = problem.coarse_to_fine(start.clone(), &model, context)?;
    let search = LensSearch { problem: &problem, precise: &for_lenses, kind: options.kind_of_lens(), context };
    let find_lens = || match per_picture_focal {
        false => search.find(&fine, &CameraPrior::lens_groups(priors)),
        true => Ok(None),
    };
    let find_free = || {
        let is_asked = options.focal_sharing == FocalSharing::Auto && priors.len() > 1;
        is_asked.then(|| problem.minimize(fine.clone(), &own, COARSE_HUBER_PX, context)).transpose()
    };
    let (with_lens, free) = rayon::join(find_lens, find_free);
    let (with_lens, free) = (with_lens?, free?);
    let mut unshared = None;
    if let Some(free) = free {
        let zoomed = if problem.is_sound(&free) { zoom::found(&problem, &model, &fine, &free) } else { None };
        if let Some(zoomed) = zoomed {
            fine = problem.coarse_to_fine(zoomed.start, &zoomed.model, context)?;
            unshared = Some(free);
            model = zoomed.model;
            per_picture_focal = true;
        }
    }
    // A lens that bends may make focal lengths seem to differ; a zoom is seen beside it, too.
    let cost = |at: &Parameters| problem.fine_costs(at).iter().sum::<f64>();
    let explains_more = |lens: &FoundLenses| {
        let is_zoomed =
            || unshared.as_ref().is_some_and(|own| zoom::fits_far_better(&problem, &shared, &lens.parameters, own));
        !per_picture_focal || cost(&lens.parameters) < cost(&fine) && !is_zoomed()
    };
    let end = End { search: &search, lines: input.lines, options, context };
    if let Some(FoundLenses { parameters, model }) = with_lens.filter(explains_more) {
        return end.refined(Found { parameters, model, per_picture_focal: false });
    }
    if per_picture_focal && problem.is_sound(&fine) {
        let settings = zoom::settings(&fine, priors);
        let mut start = fine.clone();
        if options.focal_sharing != FocalSharing::PerPicture {
            // What shares a factor keeps its ratios, which each photograph found for itself here.
            start = start.with_common_focal(&problem.start_focal_px, &settings);
            start = problem.coarse_to_fine(start, &IntrinsicsModel::common(&settings), context)?;
        }
        if let Some(FoundLenses { parameters, model }) = search.find(&start, &settings)? {
            return end.refined(Found { parameters, model, per_picture_focal });
        }
    }
    if problem.is_sound(&fine) {
        let refined = end.refined(Found { parameters: fine.clone(), model, per_picture_focal })?;
        let few = input.observations.pairs.len() < OVERLAPS_FOR_LENSES && !refined.parameters.has_lens();
        let lens_doubt_px = if few { search.doubt_px(&fine, &CameraPrior::lens_groups(priors)) } else { None };
        return Ok(Refined { lens_doubt_px, ..refined });
    }
    let parameters = with_expected_focal(&problem, start, context)?;
    Ok(Refined { focal_failed: true, ..Refined::of(parameters, false) })
}

/// Cameras that matches and edges tell, with what was free.
struct Found {
    parameters: Parameters,
    model: IntrinsicsModel,
    per_picture_focal: bool,
}

/// What the cameras that were found are refined by in the end.
struct End<'a> {
    search: &'a LensSearch<'a>,
    /// Line segments of each photograph.
    lines: &'a [Vec<LineSegment>],
    options: &'a CameraOptions,
    context: &'a StageContext<'a>,
}

impl End<'_> {
    /// What was found, with the focal lengths that are most probable where matches leave them open.
    fn refined(&self, found: Found) -> Result<Refined> {
        let Found { mut parameters, mut model, mut per_picture_focal } = found;
        let problem = self.search.problem;
        let may_differ = self.options.focal_sharing == FocalSharing::Auto && parameters.focal_px.len() > 1;
        if may_differ
            && model.shares_focal()
            && let Some(own) = self.search.refocused(&model, &parameters)?
        {
            (parameters, model) = own;
            per_picture_focal = true;
        }
        let is_lens_told = parameters.has_lens() && !model.has_lens();
        // Of photographs that parallax gives focal lengths of their own, no common factor makes angles right.
        let lines = if per_picture_focal { &[] } else { self.lines };
        let expected = match is_lens_told {
            true => None,
            false => expected_focal::expected(problem, &parameters, &model, lines, self.options, self.context)?,
        };
        let precise = if model.has_lens() { self.search.precise } else { problem };
        let Some(ExpectedFocal { parameters: expected, opened }) = expected else {
            return Ok(Refined::of(precise.sharpened(parameters, &model, self.context)?, per_picture_focal));
        };
        let sharp = precise.sharpened(expected, &model.with_focal_held(), self.context)?;
        let by_matches = Some(ByMatches { parameters, opened });
        Ok(Refined { by_matches, ..Refined::of(sharp, per_picture_focal) })
    }
}

/// The rotations refined from `start` with all focal lengths fixed to those that are expected.
fn with_expected_focal(
    problem: &BundleAdjustment<'_>,
    start: &Parameters,
    context: &StageContext,
) -> Result<Parameters> {
    let focal_px: Vec<f64> = problem.priors.iter().map(CameraPrior::expected_focal_px).collect();
    let model = IntrinsicsModel::fixed(focal_px.len());
    let fixed = Parameters { focal_px, ..start.clone() };
    problem.coarse_to_fine(fixed, &model, context)
}
