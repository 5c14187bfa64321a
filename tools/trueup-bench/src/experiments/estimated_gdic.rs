//! GDIC that a panorama's own vertical lines estimate against the true one.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use super::methods_compared;
use crate::methods::{Family, methods_of};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::Results;
use crate::sets::Catalogue;
use crate::statistics::{median, quantile, rank_correlation};
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "estimated-gdic";

/// Spearman's correlation from which the estimate ranks panoramas as the truth does.
const MIN_CORRELATION: f64 = 0.9;

/// Every method with a prior and every warp for wide views on every set with known cameras: the work of the comparison
/// of methods.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    Ok(methods_compared::trials(catalogue)?.into_iter().map(|trial| Trial { experiment: NAME, ..trial }).collect())
}

/// A panorama's GDIC, estimated and true, degrees.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    truth: f64,
    estimated: f64,
}

/// The panoramas of one group of sets by one method, or by all.
fn estimates(results: &Results, group: Option<&str>, method: Option<&str>) -> Vec<Estimate> {
    results
        .of(NAME)
        .filter(|row| group.is_none_or(|group| row.key.set.starts_with(group)))
        .filter(|row| method.is_none_or(|method| row.key.variant == method))
        // The estimate is relative to the stitch's own reference, and so is this one.
        .filter_map(|row| {
            let truth = row.measure("gdic_reference_deg")?;
            Some(Estimate { truth, estimated: row.measure("estimated_gdic_deg")? })
        })
        .collect()
}

fn correlation(found: &[Estimate]) -> Option<f64> {
    let (truth, estimated): (Vec<f64>, Vec<f64>) = found.iter().map(|one| (one.truth, one.estimated)).unzip();
    rank_correlation(&truth, &estimated)
}

/// The estimate ranks panoramas as the truth does.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let found = estimates(results, None, None);
    let correlation = correlation(&found);
    vec![Claim {
        id: "estimated-gdic",
        text: "GDIC estimated from a panorama's own lines ranks panoramas as the true one does.".to_owned(),
        holds: correlation.map(|correlation| correlation >= MIN_CORRELATION),
        evidence: format!(
            "Spearman's correlation over {} panoramas of all methods with known cameras: {} (wanted: {MIN_CORRELATION}).",
            found.len(),
            number(correlation, 3)
        ),
        reason: "",
        brief: format!("estimated GDIC, Spearman {}", number(correlation, 2)),
    }]
}

/// Table and scatter.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "GDIC without the truth");
    section.say(
        "GDIC asks for known cameras, which photographs seldom come with. Its estimate takes each photograph's true direction from \
         the lines of all of them, over the photographs for which these are certain. Both are relative to the \
         reference of the stitch. Panoramas of which fewer than two photographs are certain have no estimate and do not count.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let columns =
        ["panoramas", "count", "Spearman", "difference deg, median", "difference deg, 90 %", "true GDIC deg, median"];
    let mut table = Table::new("estimated-gdic", "Estimated against true GDIC.", columns);
    let mut push = |label: String, found: &[Estimate]| {
        let differences: Vec<f64> = found.iter().map(|one| (one.estimated - one.truth).abs()).collect();
        let truths: Vec<f64> = found.iter().map(|one| one.truth).collect();
        table.push([
            label,
            found.len().to_string(),
            number(correlation(found), 3),
            number(median(&differences), 2),
            number(quantile(&differences, 0.9), 2),
            number(median(&truths), 2),
        ]);
    };
    push("all".to_owned(), &estimates(results, None, None));
    for (group, words) in [("study/", "of rendered sets"), ("given/", "of sets cut from panoramas, or given")] {
        let found = estimates(results, Some(group), None);
        if !found.is_empty() {
            push(words.to_owned(), &found);
        }
    }
    for one in methods_of(Family::Prior).chain(methods_of(Family::WideWarp)) {
        push(format!("by `{}`", one.name), &estimates(results, None, Some(one.name)));
    }
    section.blocks.push(Block::Table(table));
    let of_method = |name: &str| {
        let points = estimates(results, None, Some(name)).into_iter().map(|one| (one.truth, one.estimated));
        Series::plain(name, SeriesMark::Dots, points)
    };
    let series: Vec<Series> = methods_of(Family::Prior).map(|one| of_method(one.name)).collect();
    let chart = Chart::new("true GDIC, degrees", "estimated GDIC, degrees", series);
    section.draw("Estimated against true GDIC, a dot for a panorama.", chart.svg());
    section
}
