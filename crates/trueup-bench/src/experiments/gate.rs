//! T5: divergence of Manhattan scenes against others, and what threshold our own sets support.

use trueup::{Result, StitchOptions};

use super::paper_figures::{MANHATTAN_DIVERGENCES, OTHER_DIVERGENCES, THRESHOLD};
use crate::report::charts::{Chart, Mark, Series};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::Results;
use crate::roc::{self, RocPoint};
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::{median, quantile};
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "gate";

const FULL: &str = "full gate";
const PAPER: &str = "divergence alone";

/// The rates must differ by this much for the classes to count as separated.
const SEPARATED: f64 = 0.8;

/// Both gates on every set of the gate experiment.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let variants: [(&str, &[&str]); 2] = [(FULL, &[]), (PAPER, &["similarity.gate=paper"])];
    let each = |set: &SetSpec| variants.map(|(name, overrides)| Trial::new(NAME, &set.name, name, overrides));
    Ok(catalogue.gate.iter().flat_map(each).collect())
}

/// One class of scenes under one gate.
#[derive(Debug, Clone, PartialEq)]
struct Class {
    /// Divergence per set that was stitched; infinite where no directions were found.
    divergences: Vec<f64>,
    /// Sets whose dominant directions guide.
    accepted: usize,
    /// Sets that the vertical alone guides.
    vertical_only: usize,
    stitched: usize,
    /// Sets that could not be stitched at all.
    failed: usize,
}

fn class(results: &Results, manhattan: bool, variant: &str) -> Class {
    let mut class = Class { divergences: Vec::new(), accepted: 0, vertical_only: 0, stitched: 0, failed: 0 };
    for set in results.catalogue.gate.iter().filter(|set| set.manhattan == Some(manhattan)) {
        for row in results.of(NAME).filter(|row| row.key.set == set.name && row.key.variant == variant) {
            match row.measure("accepted") {
                None => class.failed += 1,
                Some(accepted) => {
                    class.stitched += 1;
                    class.accepted += usize::from(accepted > 0.0);
                    class.vertical_only += usize::from(accepted == 0.0 && row.measure("guided") == Some(1.0));
                    class.divergences.push(row.measure("divergence").unwrap_or(f64::INFINITY));
                }
            }
        }
    }
    class
}

impl Class {
    fn rate(&self) -> Option<f64> {
        (self.stitched > 0).then(|| self.accepted as f64 / self.stitched as f64)
    }
}

/// The gate tells the two classes apart.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let (manhattan, other) = (class(results, true, FULL), class(results, false, FULL));
    let rates = manhattan.rate().zip(other.rate());
    let counts = format!("{}/{} from {}/{}", manhattan.accepted, manhattan.stitched, other.accepted, other.stitched);
    vec![Claim {
        text: "The gate accepts Manhattan scenes and refuses others.".to_owned(),
        holds: rates.map(|(accepted, wrongly)| accepted - wrongly >= SEPARATED),
        evidence: format!(
            "Vanishing points guide {} of {} Manhattan sets and {} of {} others (separated: the shares differ by {SEPARATED} or more).",
            manhattan.accepted, manhattan.stitched, other.accepted, other.stitched
        ),
        brief: format!("gate separates {counts}"),
    }]
}

/// Histogram, curve, threshold.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T5: the gate");
    section.say(
        "The divergence says how badly the pictures' vanishing points fit one Manhattan world. The paper believes them up to 0.10 \
         and shows 65 Manhattan scenes and 65 others. Ours are as many small rendered sets. The full gate asks further: how many \
         pictures agree, and whether the vertical is where straightened cameras put it.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let (manhattan, other) = (class(results, true, PAPER), class(results, false, PAPER));
    section.blocks.push(Block::Table(counts(results)));
    section.draw(
        "Divergence of every set; the last bin holds sets whose pictures show no vanishing points at all.",
        histogram(&manhattan, &other),
    );
    let Some(curve) = roc::curve(&manhattan.divergences, &other.divergences) else {
        section.blocks.push(Block::Skipped("both classes are needed for a curve".to_owned()));
        return section;
    };
    let best = roc::best_threshold(&curve);
    section.draw(
        "Share of Manhattan sets accepted against share of others accepted, for every threshold of the divergence alone, and the \
         full gate's place.",
        roc_chart(results, &curve),
    );
    let at = |threshold: f64| curve.iter().rev().find(|point| point.threshold <= threshold).copied();
    let mut table = Table::new(
        "t5-thresholds",
        "Thresholds on the divergence alone, and the full gate.",
        ["rule", "threshold", "Manhattan accepted", "others accepted"],
    );
    let percent = |rate: Option<f64>| rate.map_or("-".to_owned(), |rate| format!("{:.1} %", 100.0 * rate));
    let mut rule = |name: &str, threshold: Option<f64>, point: Option<RocPoint>| {
        let rates = [point.map(|point| point.true_rate), point.map(|point| point.false_rate)].map(percent);
        let [yes, wrongly] = rates;
        table.push([name.to_owned(), number(threshold, 3), yes, wrongly]);
    };
    rule("the paper's", Some(THRESHOLD), at(THRESHOLD));
    rule("best on our sets", best.map(|best| best.threshold), best);
    let [yes, wrongly] = [true, false].map(|kind| percent(class(results, kind, FULL).rate()));
    let default = StitchOptions::default().similarity.max_divergence;
    table.push(["full gate (default)".to_owned(), number(Some(default), 3), yes, wrongly]);
    section.blocks.push(Block::Table(table));
    section.say(format!(
        "Area under the curve: {}. Our sets support a threshold of {} (it maximises the difference of the two shares and lies half \
         way to the next set).",
        number(Some(roc::area(&curve)), 3),
        number(best.map(|best| best.threshold), 3)
    ));
    section
}

fn counts(results: &Results) -> Table {
    let columns = [
        "class",
        "sets stitched",
        "full gate accepts",
        "vertical alone",
        "divergence alone accepts",
        "median divergence",
        "10 %",
        "90 %",
        "upright deg, accepted",
        "upright deg, others",
        "not stitched",
    ];
    let mut table = Table::new("t5-counts", "Divergence by class of scenes.", columns);
    for (manhattan, name) in [(true, "Manhattan"), (false, "others")] {
        let (full, paper) = (class(results, manhattan, FULL), class(results, manhattan, PAPER));
        let share = |share| number(quantile(&paper.divergences, share), 4);
        table.push([
            name.to_owned(),
            full.stitched.to_string(),
            full.accepted.to_string(),
            full.vertical_only.to_string(),
            paper.accepted.to_string(),
            share(0.5),
            share(0.1),
            share(0.9),
            number(median(&upright(results, manhattan, true)), 2),
            number(median(&upright(results, manhattan, false)), 2),
            full.failed.to_string(),
        ]);
    }
    for (name, figures) in [("Manhattan, gallery", &MANHATTAN_DIVERGENCES[..]), ("others, gallery", &OTHER_DIVERGENCES)]
    {
        let lowest = figures.iter().copied().min_by(f64::total_cmp);
        let highest = figures.iter().copied().max_by(f64::total_cmp);
        let accepted = figures.iter().filter(|figure| **figure <= THRESHOLD).count();
        table.push_paper([
            format!("paper: {name}"),
            figures.len().to_string(),
            String::new(),
            String::new(),
            accepted.to_string(),
            number(median(figures), 4),
            format!("{} (least)", number(lowest, 4)),
            format!("{} (most)", number(highest, 4)),
            String::new(),
            String::new(),
            String::new(),
        ]);
    }
    table
}

/// Deviations from upright of the sets whose dominant directions the full gate accepted, or of the others.
fn upright(results: &Results, manhattan: bool, accepted: bool) -> Vec<f64> {
    let class = |row: &&Row| {
        let set = results.catalogue.gate.iter().find(|set| set.name == row.key.set);
        set.is_some_and(|set| set.manhattan == Some(manhattan))
    };
    results
        .of(NAME)
        .filter(|row| row.key.variant == FULL && row.measure("accepted") == Some(f64::from(u8::from(accepted))))
        .filter(class)
        .filter_map(|row| row.measure("upright_deg"))
        .collect()
}

/// Sets per bin of divergence, the classes side by side.
fn histogram(manhattan: &Class, other: &Class) -> String {
    const BIN: f64 = 0.02;
    const BINS: usize = 15;
    let mut names: Vec<String> = (0..BINS).map(|bin| format!("{:.2}", bin as f64 * BIN)).collect();
    names.push("more".to_owned());
    names.push("none".to_owned());
    let series = [("Manhattan", manhattan), ("others", other)].map(|(name, class)| {
        let mut counts = vec![0_usize; BINS + 2];
        for divergence in &class.divergences {
            let bin = match divergence {
                infinite if infinite.is_infinite() => BINS + 1,
                finite => ((finite / BIN) as usize).min(BINS),
            };
            counts[bin] += 1;
        }
        Series::plain(name, Mark::Bars, counts.into_iter().enumerate().map(|(bin, count)| (bin as f64, count as f64)))
    });
    let mut chart = Chart::new("divergence, from", "sets", series.into()).with_categories(names);
    chart.rules.push((THRESHOLD / BIN - 0.5, "paper's threshold".to_owned()));
    chart.svg()
}

fn roc_chart(results: &Results, curve: &[RocPoint]) -> String {
    let line = Series::plain(
        "divergence alone, every threshold",
        Mark::Curve,
        curve.iter().map(|point| (100.0 * point.false_rate, 100.0 * point.true_rate)),
    );
    let rates = class(results, false, FULL).rate().zip(class(results, true, FULL).rate());
    let gate = rates.map(|(wrongly, yes)| (100.0 * wrongly, 100.0 * yes));
    let mut chart = Chart::new(
        "others accepted, %",
        "Manhattan accepted, %",
        vec![line, Series::plain("full gate (default)", Mark::Dots, gate)],
    );
    (chart.x_range, chart.y_max) = (Some((-2.0, 100.0)), Some(100.0));
    chart.svg()
}
