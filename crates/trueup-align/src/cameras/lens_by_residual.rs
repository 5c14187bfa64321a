//! Lenses of few overlaps, and an automatic focus, told by what they leave: nothing but noise.
//!
//! Noise differs from match to match. Photographs from one place, through the right lens, leave nothing that
//! neighboring matches err by alike. Parallax moves alike what is near together, and hardly ever as a lens does, so
//! that some of that stays whichever lens is tried. Where this tells, the spread of the overlaps need not
//! ([`super::lens_evidence`]), of which one or two have none.

use nalgebra::{Matrix2, Vector2};
use trueup_core::Result;
use trueup_core::matches::PointMatch;
use trueup_core::statistics::median;

use super::bundle::{BundleAdjustment, COARSE_HUBER_PX, FINE_HUBER_PX, Parameters};
use super::intrinsics::{CENTER, FreeTerms, IntrinsicsModel, RADIAL, set_free, standard_deviation};
use super::lenses::LensSearch;
use super::levenberg_marquardt::SETTLED;
use super::observations::PairObservations;
use super::options::LensKind;
use super::prior::CameraPrior;
use super::transfer::CameraTransfer;
use super::zoom;
use crate::evidence::{CommonSquare, OverlapGap};

/// The terms that are asked for together, the fewest first. A lens that is off center leaves as much as one that bends
/// in wide photographs, and of both neither alone explains anything.
const TOGETHER: [&[usize]; 4] =
    [&[RADIAL], &[RADIAL, RADIAL + 1], &[RADIAL, CENTER, CENTER + 1], &[RADIAL, RADIAL + 1, CENTER, CENTER + 1]];
/// Most overlaps that are asked so. The spread of seven and more tells as well, in less time.
const FEW_OVERLAPS: usize = 6;
/// Share of the square of what neighboring matches err by alike that terms may leave to be believed for it. Measured on
/// pairs and triples: less of two thirds of 83 cut through lenses (of most others the lens moves matches by hardly more
/// than their noise) and of five photographed ones, whose lenses are those of the whole of their sets; 0.088 and more
/// of some 160 photographed ones with parallax, above 1 of pinholes.
const MOST_LEFT: f64 = 1.0 / 16.0;
/// The same of terms beside those of a lens that is believed already: surely less than is left without them. Chosen on
/// 66 pairs, triples and fours cut through lenses, of which none meets worse for it with shares from 0.25 to 0.9; parts
/// of photographed sets agree in the centers that they are so told.
const MOST_LEFT_BESIDE: f64 = 0.8;
/// Standard deviations from the middle of the photograph beyond which a principal point is none, but what parallax
/// makes of one. Of 235 pairs and triples of photographed sets ten are told one within, and focal lengths that are then
/// off by 2.0 percent in the mean against those of the whole of their sets (7.6 without). Beyond lie four, at 3.7 to 23
/// percent of the diagonal.
const MOST_OFF_CENTER: f64 = 2.5;
/// [`MOST_LEFT`] of a first look at some of the matches, whose noise blurs it.
const PROMISING: f64 = 0.25;
/// When the cameras of that look are near enough: a step that saves less than this share of the cost is the last.
const NEARLY_SETTLED: f64 = 1e-4;
/// The same for a first look from cameras that have settled already: what explains anything does so in few steps.
const HARDLY_SETTLED: f64 = 1e-2;
/// A match that is farther off than so many times the median counts as if it were so far off: false ones have large
/// errors, which nothing explains.
const FARTHEST_IN_MEDIANS: f64 = 4.0;

/// Square of what neighboring matches err by alike, per axis, working pixels, from which on focal lengths of their own
/// are asked for: ideal cameras leave less.
const LEAST_COMMON: f64 = 0.1 * 0.1;
/// Share of that square that focal lengths of their own, and a lens beside them, may leave to be believed. Of 30 sets
/// cut through lenses with focal lengths that differ by 0.7 percent they leave 0.034 at most, of 29 less than this; of
/// 280 photographed sets, pairs and triples 0.051 at least, but of six parts of one (UW-rainier), which agree in the
/// lens, and in focal lengths that grow from one end to the other.
const MOST_LEFT_BY_FOCUS: f64 = 1.0 / 32.0;

impl LensSearch<'_> {
    /// Whether terms of all groups `of` that are asked, the first of [`TOGETHER`] that do, leave next to nothing that
    /// neighboring matches err by alike: then `parameters` are refined with them, and `free` has them. Never of many
    /// overlaps.
    pub(super) fn is_explained_together(
        &self,
        of: &[bool],
        parameters: &mut Parameters,
        group_of: &[usize],
        free: &mut [FreeTerms],
    ) -> Result<bool> {
        let model = |free: &[FreeTerms]| IntrinsicsModel::grouped(group_of, free);
        let mut all = free.to_vec();
        TOGETHER.iter().for_each(|terms| set_free(&mut all, terms, of));
        // Where all of them leave more than is promising, fewer do, too.
        if self.has_many_overlaps()
            || self.looked(Matches::Some, parameters, parameters, [&model(free), &model(&all)])?.share > PROMISING
        {
            return Ok(false);
        }
        for terms in TOGETHER {
            if self.is_explained_by(terms, of, parameters, group_of, free)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The same of these `terms`. Never of terms that are free already or not in [`TOGETHER`].
    pub(super) fn is_explained_by(
        &self,
        terms: &[usize],
        of: &[bool],
        parameters: &mut Parameters,
        group_of: &[usize],
        free: &mut [FreeTerms],
    ) -> Result<bool> {
        let mut wished = free.to_vec();
        set_free(&mut wished, terms, of);
        let is_asked =
            terms.iter().all(|term| TOGETHER.iter().any(|together| together.contains(term))) && wished != *free;
        if !is_asked || self.has_many_overlaps() {
            return Ok(false);
        }
        let [without, with] = [&*free, &wished].map(|free| IntrinsicsModel::grouped(group_of, free));
        let mut found = parameters.clone();
        let [promising, most_left] = if without.has_lens() { [MOST_LEFT_BESIDE; 2] } else { [PROMISING, MOST_LEFT] };
        for (matches, most_left) in [(Matches::Some, promising), (Matches::Enough, most_left)] {
            let looked = self.looked(matches, parameters, &found, [&without, &with])?;
            found = looked.parameters;
            let is_visible = (0..of.len()).any(|group| of[group] && self.is_visible(&found, group_of, group));
            if !(is_visible && self.is_expected(&found) && looked.share <= most_left) {
                return Ok(false);
            }
        }
        free.clone_from_slice(&wished);
        *parameters = found;
        Ok(true)
    }

    /// The cameras with a focal length for each photograph, and their model, where these leave next to nothing of what
    /// neighboring matches err by alike with `shared` ones: an automatic focus changes them by up to a percent or two
    /// from photograph to photograph. What differs by more was zoomed ([`zoom::found`]). A lens and a focus hide each
    /// other, so that terms of [`TOGETHER`] are asked for beside, the fewest that do.
    pub(super) fn refocused(
        &self,
        model: &IntrinsicsModel,
        shared: &Parameters,
    ) -> Result<Option<(Parameters, IntrinsicsModel)>> {
        let problem = self.problem;
        if CommonSquare::of_overlaps(&gaps(problem, shared)).sure() < LEAST_COMMON {
            return Ok(None);
        }
        // A lens bends otherwise at another of its settings.
        let lens_of = zoom::settings(shared, problem.priors);
        let is_asked = |prior: &CameraPrior| self.kind != LensKind::Pinhole && prior.lens.is_none();
        let asked: Vec<bool> = problem.priors.iter().map(is_asked).collect();
        let own = model.with_own_focal();
        let with = |terms: &[usize]| own.with_terms(terms, &asked, &lens_of);
        let all = with(&TOGETHER.concat());
        let first = problem.minimize_until(HARDLY_SETTLED, shared.clone(), &all, FINE_HUBER_PX, self.context)?;
        if share_left(problem, shared, &first) > PROMISING {
            return Ok(None);
        }
        let precise = self.precise;
        let settled = precise.minimize(shared.clone(), model, FINE_HUBER_PX, self.context)?;
        let mut tried = Vec::new();
        for terms in std::iter::once(&[][..]).chain(TOGETHER) {
            let wished = with(terms);
            // Of terms that are free already fewer are left, which may be those of a set before.
            if tried.contains(&wished.parameters) {
                continue;
            }
            tried.push(wished.parameters);
            let found = precise.coarse_to_fine(settled.clone(), &wished, self.context)?;
            let is_focus = !zoom::differing(model, &settled, &found).contains(&true);
            if is_focus && self.is_expected(&found) && share_left(precise, &settled, &found) <= MOST_LEFT_BY_FOCUS {
                return Ok(Some((found, wished)));
            }
        }
        Ok(None)
    }

    fn has_many_overlaps(&self) -> bool {
        self.problem.observations.pairs.len() > FEW_OVERLAPS
    }

    /// The cameras refined by these matches from `start` on with the second model, and what they leave of what
    /// `parameters` refined with the first leave.
    fn looked(
        &self,
        matches: Matches,
        parameters: &Parameters,
        start: &Parameters,
        [without, with]: [&IntrinsicsModel; 2],
    ) -> Result<Looked> {
        let (problem, settled) = match matches {
            Matches::Some => (self.problem, NEARLY_SETTLED),
            Matches::Enough => (self.precise, SETTLED),
        };
        let refined = |start: &Parameters, model: &IntrinsicsModel, huber_px: f64| {
            problem.minimize_until(settled, start.clone(), model, huber_px, self.context)
        };
        let before = refined(parameters, without, FINE_HUBER_PX)?;
        let found = refined(&refined(start, with, COARSE_HUBER_PX)?, with, FINE_HUBER_PX)?;
        let share = share_left(problem, &before, &found);
        Ok(Looked { parameters: found, share })
    }

    /// Whether no principal point is farther off than lenses have it.
    fn is_expected(&self, found: &Parameters) -> bool {
        found.lenses.iter().zip(self.problem.priors).all(|(lens, prior)| {
            let [x, y] = lens.center_px;
            x.hypot(y) <= MOST_OFF_CENTER * standard_deviation(CENTER, &prior.frame)
        })
    }
}

/// Which matches are looked at.
#[derive(Debug, Clone, Copy)]
enum Matches {
    /// Some, by cameras that are nearly settled: they show that most lenses are not worth a closer look.
    Some,
    /// Those that tell how large terms are.
    Enough,
}

/// What a look at a lens shows.
struct Looked {
    parameters: Parameters,
    /// [`share_left`] of it.
    share: f64,
}

/// Of what neighboring matches err by alike with the cameras `before`, the share (of its square) that is hardly
/// exceeded with those `after`. Infinite where nothing was in common before.
pub(super) fn share_left(problem: &BundleAdjustment<'_>, before: &Parameters, after: &Parameters) -> f64 {
    let (before, after) = (gaps(problem, before), gaps(problem, after));
    let mut distances: Vec<f64> = after.iter().flatten().map(|one| one.gap.norm()).collect();
    let Some(median) = median(&mut distances) else { return f64::INFINITY };
    let common = |overlaps: &[Vec<OverlapGap>]| {
        let limited: Vec<Vec<OverlapGap>> = overlaps
            .iter()
            .map(|gaps| gaps.iter().map(|one| limited(one, FARTHEST_IN_MEDIANS * median)).collect())
            .collect();
        CommonSquare::of_overlaps(&limited)
    };
    let (left, was) = (common(&after).at_most(), common(&before).mean());
    if was > 0.0 { left / was } else { f64::INFINITY }
}

/// The matches of every overlap as these cameras have them, where they see them.
pub(super) fn gaps(problem: &BundleAdjustment<'_>, parameters: &Parameters) -> Vec<Vec<OverlapGap>> {
    let cameras = parameters.cameras(problem.priors);
    let of_pair = |pair: &PairObservations| {
        let transfer = CameraTransfer::Rotating(&cameras[pair.a], &cameras[pair.b]);
        let gap = |one: &PointMatch| {
            let place = Vector2::from(one.in_a);
            let gap = Vector2::from(one.in_b) - transfer.at(place)?;
            Some(OverlapGap { place, gap, known: Matrix2::identity() })
        };
        pair.matches.iter().filter_map(gap).collect()
    };
    problem.observations.pairs.iter().map(of_pair).collect()
}

fn limited(one: &OverlapGap, limit_px: f64) -> OverlapGap {
    let excess = one.gap.norm() / limit_px;
    if excess > 1.0 { OverlapGap { gap: one.gap / excess, ..*one } } else { *one }
}

#[cfg(test)]
mod tests {
    use trueup_core::lens::LensTerms;

    use super::super::intrinsics::LensState;
    use super::super::observations::Observations;
    use super::super::prior::CameraPrior;
    use super::super::straightness::CurveObservations;
    use super::super::tests::{ROLLS, bent, frame, matched, row};
    use super::*;

    /// With the true cameras the noise of some 230 matches is left; seen from them, cameras without their lens have
    /// everything in common.
    #[test]
    fn the_right_cameras_leave_nothing_in_common() {
        let radial = [-0.04, 0.0, 0.0, 0.0];
        let truth = bent(row(ROLLS)[..2].to_vec(), radial, [0.0; 2]);
        let pairs = matched(&truth, 0.3, 0.0);
        let priors = [CameraPrior::unknown(frame(), 0), CameraPrior::unknown(frame(), 0)];
        let observations = Observations::choose(&priors, &pairs.iter().collect::<Vec<_>>(), 1000);
        let curves = CurveObservations::default();
        let problem = BundleAdjustment {
            priors: &priors,
            observations: &observations,
            curves: &curves,
            start_focal_px: vec![650.0; 2],
            reference: 0,
            focal_sd: vec![1.0; 2],
        };
        let of = |terms: LensTerms| Parameters {
            focal_px: vec![650.0; 2],
            rotations: truth.iter().map(|camera| camera.rotation()).collect(),
            lenses: vec![LensState { terms, ..LensState::default() }; 2],
        };
        let (right, wrong) = (of(LensTerms { radial, ..LensTerms::default() }), of(LensTerms::default()));
        let left = share_left(&problem, &wrong, &right);
        assert!((0.0..0.05).contains(&left), "{left}");
        assert!(share_left(&problem, &right, &wrong) > 1.0);
        // What is noise already is no better for a lens.
        assert!(share_left(&problem, &right, &right) > 1.0);
    }

    #[test]
    fn far_matches_count_as_if_they_were_nearer() {
        let one = OverlapGap { place: Vector2::zeros(), gap: Vector2::new(3.0, -4.0), known: Matrix2::identity() };
        assert_eq!(limited(&one, 2.5).gap, Vector2::new(1.5, -2.0));
        assert_eq!(limited(&one, 5.5).gap, one.gap);
        // Where most matches meet exactly.
        assert_eq!(limited(&OverlapGap { gap: Vector2::zeros(), ..one }, 0.0).gap, Vector2::zeros());
    }
}
