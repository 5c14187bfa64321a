//! Photographs that go all the way round: where they are cut, and what closes them.

use trueup_align::full_turn::FullTurnCut;
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::Closure;
use trueup_core::StageContext;
use trueup_core::diagnostics::{Diagnostic, Subject};

use super::component::Component;

/// The overlaps of a full turn, by whether they lie across its cut.
pub(super) struct Turn {
    pub within: Vec<OverlapWarp>,
    across: Vec<OverlapWarp>,
    /// For each of those across, see [`Closure::turns`].
    turns: Vec<f64>,
}

impl Turn {
    pub(super) fn new(cut: &FullTurnCut, warps: &[OverlapWarp]) -> Self {
        let is_within =
            |warp: &&OverlapWarp| cut.severed.binary_search(&(warp.from.min(warp.to), warp.from.max(warp.to))).is_err();
        let across = warps.iter().filter_map(|warp| Some((warp.clone(), cut.turns(warp.from, warp.to)?)));
        let (across, turns) = across.unzip();
        Self { within: warps.iter().filter(is_within).cloned().collect(), across, turns }
    }

    /// What closes the turn, whose length is `expected` by the cameras.
    pub(super) fn closure(&self, expected: f64) -> Option<Closure<'_>> {
        (!self.across.is_empty()).then(|| Closure { warps: &self.across, turns: &self.turns, expected })
    }
}

/// Says between which photographs the turn is cut, and whether its ends meet.
pub(super) fn report_cut(cut: &FullTurnCut, closed: bool, component: &Component, context: &StageContext) {
    let name = |k: usize| &component.images[k].name;
    let pairs: Vec<String> = cut.severed.iter().map(|&(a, b)| format!("{} - {}", name(a), name(b))).collect();
    let pairs = pairs.join(", ");
    let message = match closed {
        true => format!("a full turn: the ends meet, between {pairs}"),
        false => format!("the photographs go all the way round; the panorama is cut between {pairs}"),
    };
    context.report(Diagnostic::note("full-turn", Subject::stage("mesh"), message, ""));
}
