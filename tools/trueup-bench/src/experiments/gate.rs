//! T5: divergence of Manhattan scenes against others, and what threshold our own sets support.

use trueup::{Result, StitchOptions};

use super::paper_figures::{MANHATTAN_DIVERGENCES, OTHER_DIVERGENCES, THRESHOLD};
use crate::published_forms::DIVERGENCE_GATE;
use crate::report::charts::{Chart, Series, SeriesMark};
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

/// The larger sets, which the gate is tried on as well.
fn families(catalogue: &Catalogue) -> Vec<(&'static str, &[SetSpec])> {
    let all = [
        ("the study's sets", &catalogue.study[..]),
        ("their twins without dominant directions", &catalogue.twins),
        ("one vertical, horizontals at free angles", &catalogue.mixed),
        ("given sets", &catalogue.given),
    ];
    all.into_iter().filter(|(_, sets)| !sets.is_empty()).collect()
}

/// Both gates on every set of the gate experiment, the default one on the larger sets.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let variants: [(&str, &[&str]); 2] = [(FULL, &[]), (PAPER, &DIVERGENCE_GATE)];
    let each = |set: &SetSpec| variants.map(|(name, overrides)| Trial::new(NAME, &set.name, name, overrides));
    let families = families(catalogue).into_iter().flat_map(|(_, sets)| sets);
    let default = families.map(|set| Trial::new(NAME, &set.name, FULL, &[]));
    Ok(catalogue.gate.iter().flat_map(each).chain(default).collect())
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
        "The divergence says how badly the photographs' vanishing points fit one Manhattan world. The paper believes them up to 0.10 \
         and shows 65 Manhattan scenes and 65 others. Ours are small rendered sets. The full gate asks further: how many photographs \
         agree, and whether the vertical is where straightened cameras put it. Where it refuses, the vertical alone may still guide.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let (manhattan, other) = (class(results, true, PAPER), class(results, false, PAPER));
    section.blocks.extend([counts(results), divergences(results), larger_sets(results)].map(Block::Table));
    section.draw(
        "Divergence of every set; the last bin holds sets whose photographs show no vanishing points at all.",
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
    let default = StitchOptions::default().align.similarity.max_divergence;
    table.push(["full gate (default)".to_owned(), number(Some(default), 3), yes, wrongly]);
    section.blocks.push(Block::Table(table));
    section.say(format!(
        "Area under the curve: {}. Our sets support a threshold of {} (it maximizes the difference of the two shares and lies half \
         way to the next set).",
        number(Some(roc::area(&curve)), 3),
        number(best.map(|best| best.threshold), 3)
    ));
    section
}

/// How many sets of each class are believed.
fn counts(results: &Results) -> Table {
    let columns = [
        "class",
        "stitched/sets",
        "full gate accepts",
        "vertical alone guides",
        "divergence alone accepts",
        "upright deg where accepted",
        "upright deg elsewhere",
    ];
    let caption = "Sets that vanishing points guide, by class of scenes; medians of the deviation from upright.";
    let mut table = Table::new("t5-counts", caption, columns);
    for (manhattan, name) in CLASSES {
        let (full, paper) = (class(results, manhattan, FULL), class(results, manhattan, PAPER));
        table.push([
            name.to_owned(),
            format!("{}/{}", full.stitched, full.stitched + full.failed),
            full.accepted.to_string(),
            full.vertical_only.to_string(),
            paper.accepted.to_string(),
            number(median(&upright(results, manhattan, true)), 2),
            number(median(&upright(results, manhattan, false)), 2),
        ]);
    }
    table
}

const CLASSES: [(bool, &str); 2] = [(true, "Manhattan"), (false, "others")];

/// Where the divergences of each class lie.
fn divergences(results: &Results) -> Table {
    let columns = ["class", "sets", "least", "10 %", "median", "90 %", "largest"];
    let mut table = Table::new("t5-divergence", "Divergence by class of scenes.", columns);
    let cells = |name: String, figures: &[f64]| {
        let shares = [0.0, 0.1, 0.5, 0.9, 1.0].map(|share| number(quantile(figures, share), 4));
        [name, figures.len().to_string()].into_iter().chain(shares).collect::<Vec<String>>()
    };
    for (manhattan, name) in CLASSES {
        table.push(cells(name.to_owned(), &class(results, manhattan, PAPER).divergences));
    }
    for (name, figures) in [("Manhattan", &MANHATTAN_DIVERGENCES[..]), ("others", &OTHER_DIVERGENCES)] {
        table.push_paper(cells(format!("paper: {name}, gallery"), figures));
    }
    table
}

/// What the default makes of the larger sets.
fn larger_sets(results: &Results) -> Table {
    let columns = [
        "sets",
        "stitched/sets",
        "full gate accepts",
        "vertical alone guides",
        "upright deg, median",
        "upright deg, worst set",
    ];
    let mut table = Table::new("t5-larger", "The default on the larger sets.", columns);
    for (name, sets) in families(results.catalogue) {
        let of = |measure| results.values_of_all(NAME, sets, FULL, measure);
        let (accepted, guided, upright) = (of("accepted"), of("guided"), of("upright_deg"));
        let count = |flags: &[f64]| flags.iter().filter(|flag| **flag > 0.0).count();
        table.push([
            name.to_owned(),
            format!("{}/{}", accepted.len(), sets.len()),
            count(&accepted).to_string(),
            (count(&guided) - count(&accepted)).to_string(),
            number(median(&upright), 2),
            number(upright.iter().copied().max_by(f64::total_cmp), 2),
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
        Series::plain(
            name,
            SeriesMark::Bars,
            counts.into_iter().enumerate().map(|(bin, count)| (bin as f64, count as f64)),
        )
    });
    let mut chart = Chart::new("divergence, from", "sets", series.into()).with_categories(names);
    chart.rules.push((THRESHOLD / BIN - 0.5, "paper's threshold".to_owned()));
    chart.svg()
}

fn roc_chart(results: &Results, curve: &[RocPoint]) -> String {
    let line = Series::plain(
        "divergence alone, every threshold",
        SeriesMark::Curve,
        curve.iter().map(|point| (100.0 * point.false_rate, 100.0 * point.true_rate)),
    );
    let rates = class(results, false, FULL).rate().zip(class(results, true, FULL).rate());
    let gate = rates.map(|(wrongly, yes)| (100.0 * wrongly, 100.0 * yes));
    let mut chart = Chart::new(
        "others accepted, %",
        "Manhattan accepted, %",
        vec![line, Series::plain("full gate (default)", SeriesMark::Dots, gate)],
    );
    (chart.x_range, chart.y_max) = (Some((-2.0, 100.0)), Some(100.0));
    chart.svg()
}
