//! How well the photographs meet, and which of them overlap.

use serde_json::{Value, json};
use trueup_core::matches::PairVerdict;

use super::Page;
use super::figures::{count, figure};
use crate::drawings;

pub(super) fn values(page: &Page) -> Value {
    let found = page.project.measures.as_ref().and_then(|measures| measures.reprojection.as_ref());
    let field = |name: &str| format!("/measures/reprojection/{name}");
    let figures = found.map(|found| {
        json!({
            "matches": count(&field("matches"), found.matches),
            "mean": figure(&field("mean_px"), found.mean_px, 2),
            "most": figure(&field("percentile_95_px"), found.percentile_95_px, 2),
        })
    });
    let worst = found.and_then(|found| found.worst_pair.as_ref()).map(|worst| {
        json!({
            "a": page.named_by(&worst.a),
            "b": page.named_by(&worst.b),
            "most": figure(&field("worst_pair/percentile_95_px"), worst.percentile_95_px, 2),
        })
    });
    let legend = drawings::alignment_legend(page.project).into_iter();
    let legend = legend.map(|(color, error)| json!({ "color": color, "words": format!("{error:.1} px") }));
    json!({ "figures": figures, "worst": worst, "legend": legend.collect::<Vec<_>>() })
}

/// Every pair that was tried.
pub(super) fn pairs(page: &Page) -> Vec<Value> {
    let measured = page.project.measures.iter().flat_map(|measures| &measures.pairs);
    let measured: Vec<_> = measured.collect();
    let pair = |(index, pair): (usize, &trueup::PairRecord)| {
        let field = |name: &str| format!("/pairs/{index}/{name}");
        let place = measured.binary_search_by(|one| (one.a, one.b).cmp(&(pair.a, pair.b))).ok();
        let apart = place.map(|place| figure(&format!("/measures/pairs/{place}/mean_px"), measured[place].mean_px, 2));
        json!({
            "a": page.named(pair.a),
            "b": page.named(pair.b),
            "matches": count(&field("matches"), pair.matches),
            "inliers": count(&field("inliers"), pair.inliers),
            "needed": count(&field("needed"), pair.needed),
            "apart": apart,
            "outcome": in_words(pair.verdict),
        })
    };
    page.project.pairs.iter().enumerate().map(pair).collect()
}

fn in_words(verdict: PairVerdict) -> &'static str {
    match verdict {
        PairVerdict::Joined => "joined",
        PairVerdict::JoinedByGraph => "joined, as the graph file says",
        PairVerdict::JoinedByLooks => "joined, as all that they lay over each other looks alike",
        PairVerdict::TooFewMatches => "too few details look alike",
        PairVerdict::ImplausibleHomography => "they fit together in no possible way",
        PairVerdict::TooFewInliers => "too few of them agree",
        PairVerdict::LooksDifferent => "what lies between them looks different",
    }
}
