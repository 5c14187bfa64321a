//! What is told of cameras beside them.

use trueup_core::StageContext;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::matches::PairMatches;

use super::believed::{MUCH_AGAINST, support};
use super::expected_focal::OpenFocal;
use super::prior::CameraPrior;
use super::solution::Solution;

/// Doubt about the corners of photographs, working pixels, one standard deviation, that is worth a word: a lens that
/// moves them by five times as much, a hundredth of a photograph, would not be noticed.
const DOUBTFUL_LENS_PX: f64 = 2.0;

/// Change of a focal length, relative, that is worth a word.
const NOTABLE_CHANGE: f64 = 0.005;

/// Says what of focal lengths and lenses the matches of so many overlaps leave open.
pub(super) fn report_doubts(solution: &Solution, priors: &[CameraPrior], overlaps: usize, context: &StageContext) {
    if solution.focal_failed {
        context.report(Diagnostic::warning(
            "focal-uncertain",
            Subject::stage("cameras"),
            "the focal length cannot be told from these photographs; the one that they record, or a usual one, was used",
            "Keep the camera's metadata in the files, or overlap the photographs more.",
        ));
    }
    if let Some(found) = solution.opened.as_ref().filter(|found| (found.factor - 1.0).abs() >= NOTABLE_CHANGE) {
        let is_recorded = priors.iter().any(|prior| prior.focal_px.is_some());
        context.report(focal_expected(found, is_recorded));
    }
    if let Some(doubt_px) = solution.lens_doubt_px.filter(|doubt_px| *doubt_px > DOUBTFUL_LENS_PX) {
        context.report(lens_uncertain(overlaps, doubt_px));
    }
}

/// Says that lines, or what is expected of focal lengths, took part in them; `is_recorded`: by metadata.
fn focal_expected(found: &OpenFocal, is_recorded: bool) -> Diagnostic {
    let factor = found.factor;
    let (change, longer) = (100.0 * (factor - 1.0).abs(), if factor > 1.0 { "longer" } else { "shorter" });
    let by = match (found.by_lines, is_recorded) {
        (true, true) => "the right angles of lines and what the photographs record",
        (true, false) => "the right angles of lines and what is usual",
        (false, true) => "what the photographs record",
        (false, false) => "what is usual",
    };
    Diagnostic::note(
        "focal-expected",
        Subject::stage("cameras"),
        format!(
            "things at several distances, seen from several places, leave the focal length open; with {by} it is \
             {change:.0} % {longer} than matches alone say"
        ),
        "Tell the field of view (--lens-fov), or take the photographs from one place.",
    )
}

/// Says that a lens is taken for a pinhole because nothing tells.
fn lens_uncertain(overlaps: usize, doubt_px: f64) -> Diagnostic {
    let overlaps = if overlaps == 1 { "one overlap".to_owned() } else { format!("{overlaps} overlaps") };
    let edges = match doubt_px.is_finite() {
        true => format!("straight edges leave its corners open by {doubt_px:.0} px"),
        false => "there are too few straight edges".to_owned(),
    };
    Diagnostic::note(
        "lens-uncertain",
        Subject::stage("cameras"),
        format!("whether the lens bends cannot be told by {overlaps}, and {edges}; it is taken for a pinhole"),
        "Overlap more photographs, or tell the lens (--lens-from, --lens).",
    )
}

/// Names the overlaps that take no part in the cameras, with their residuals.
pub(super) fn report_strained(pairs: &[PairMatches], positions: &[usize], rms_px: &[f64], context: &StageContext) {
    for &position in positions {
        let pair = &pairs[position];
        context.report(Diagnostic::note(
            "pair-strained",
            Subject::Pair(pair.a, pair.b),
            format!(
                "this overlap contradicts the others by {:.1} px, as things at several distances do; the cameras are found without it",
                rms_px[position]
            ),
            "",
        ));
    }
}

/// Names the pairs that are set aside, with their residuals when they were.
pub(super) fn report_contradicting(pairs: &[PairMatches], positions: &[usize], rms_px: &[f64], context: &StageContext) {
    for &position in positions {
        context.report(contradicts(&pairs[position], rms_px[position]));
    }
    let [all, against] = [support(pairs, 0..pairs.len()), support(pairs, positions.iter().copied())];
    let strongest = positions.iter().map(|&position| &pairs[position]).max_by_key(|pair| pair.agreeing);
    if let Some(strongest) = strongest.filter(|_| against as f64 > MUCH_AGAINST * all as f64) {
        let percent = 100.0 * against as f64 / all as f64;
        context.report(Diagnostic::warning(
            "overlaps-contradict",
            Subject::Pair(strongest.a, strongest.b),
            format!(
                "{} of {} overlaps, this one above all, contradict the others and are not used: {percent:.0} % of what matches",
                positions.len(),
                pairs.len()
            ),
            "Things that are alike, or near, may be the reason. If what these show is wrong in the panorama, join the right ones in a --graph file.",
        ));
    }
}

fn contradicts(pair: &PairMatches, rms_px: f64) -> Diagnostic {
    Diagnostic::note(
        "pair-contradicts",
        Subject::Pair(pair.a, pair.b),
        format!("this overlap contradicts the others by {rms_px:.1} px and is not used"),
        "",
    )
}
