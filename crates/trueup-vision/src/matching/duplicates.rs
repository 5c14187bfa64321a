//! Pairs of photographs that show the same view.

use trueup_core::StageContext;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::matches::{PairMatches, PointMatch};

/// Mean displacement of the inliers below which two photographs show the same view, in working pixels.
const DUPLICATE_DISPLACEMENT_PX: f64 = 3.0;
/// Share of the matches in the overlap that agree, above which they may be the same view.
const DUPLICATE_AGREEMENT: f64 = 0.95;

/// Reports the pairs that show the same view, as diagnostics with the code `near-duplicate`.
pub fn report_near_duplicates<'a>(pairs: impl IntoIterator<Item = &'a PairMatches>, context: &StageContext<'_>) {
    for pair in pairs.into_iter().filter(|pair| is_near_duplicate(pair)) {
        context.report(near_duplicate(pair));
    }
}

/// Whether a joined pair shows the same view: its inliers hardly move and nearly all agree.
fn is_near_duplicate(pair: &PairMatches) -> bool {
    let displacement = |at: &PointMatch| (at.in_b[0] - at.in_a[0]).hypot(at.in_b[1] - at.in_a[1]);
    let total: f64 = pair.inliers.iter().map(displacement).sum();
    pair.verdict.is_joined()
        && pair.agreeing as f64 > DUPLICATE_AGREEMENT * pair.in_overlap as f64
        && total < DUPLICATE_DISPLACEMENT_PX * pair.inliers.len() as f64
}

fn near_duplicate(pair: &PairMatches) -> Diagnostic {
    Diagnostic::warning(
        "near-duplicate",
        Subject::Pair(pair.a, pair.b),
        format!("the two photographs show the same view: {} of {} matches agree", pair.agreeing, pair.in_overlap),
        "Leave one of them out, unless both are wanted.",
    )
}
