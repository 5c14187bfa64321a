//! What is shown of the gate: counts, divergences, curve, thresholds.

use trueup::StitchOptions;
use trueup_report::charts::{Chart, Series, SeriesMark};

use super::classes::{Class, FULL, NAME, PAPER, Part, claims, class, families, fitted_threshold};
use crate::experiments::paper_figures::{MANHATTAN_DIVERGENCES, OTHER_DIVERGENCES, THRESHOLD};
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::roc::{self, RocPoint};
use crate::statistics::{median, quantile};
use crate::trial::Row;

/// Histogram, curve, threshold.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T5: the gate");
    section.say(
        "The divergence says how badly the photographs' vanishing points fit one Manhattan world. The paper believes them up to 0.10 \
         and shows 65 Manhattan scenes and 65 others. Ours are as many small rendered sets: one half of each class is among those \
         that the gate's constants were chosen by, the other half new to it. The full gate asks further: how many photographs \
         agree, and whether the vertical is where straightened cameras put it. Where it refuses, the vertical alone may still guide.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let (manhattan, other) = (class(results, true, PAPER, Part::All), class(results, false, PAPER, Part::All));
    section.blocks.extend([counts(results), divergences(results), larger_sets(results)].map(Block::Table));
    section.draw(
        "Divergence of every set; the last bin holds sets whose photographs show no vanishing points at all.",
        histogram(&manhattan, &other),
    );
    let Some(curve) = roc::curve(&manhattan.divergences, &other.divergences) else {
        section.blocks.push(Block::Skipped("both classes are needed for a curve".to_owned()));
        return section;
    };
    section.draw(
        "Share of Manhattan sets accepted against share of others accepted, for every threshold of the divergence alone, and the \
         full gate's place.",
        roc_chart(results, &curve),
    );
    section.blocks.push(Block::Table(thresholds(results)));
    section.say(format!(
        "Area under the curve: {}. The threshold that is chosen maximizes the difference of the two shares and lies half way to \
         the next set.",
        number(Some(roc::area(&curve)), 3)
    ));
    section
}

/// What each rule lets through, of the sets that constants are chosen by and of the others.
fn thresholds(results: &Results) -> Table {
    let columns = ["rule", "threshold", "half of the sets", "Manhattan accepted", "others accepted"];
    let mut table = Table::new("t5-thresholds", "Thresholds on the divergence alone, and the full gate.", columns);
    let percent = |count: usize, of: usize| match of {
        0 => "-".to_owned(),
        of => format!("{:.1} %", 100.0 * count as f64 / of as f64),
    };
    let default = StitchOptions::default().align.similarity.max_divergence;
    for (part, half) in [(Part::Seen, "chosen by"), (Part::HeldOut, "held out")] {
        let alone = [true, false].map(|kind| class(results, kind, PAPER, part));
        for (rule, threshold) in
            [("the paper's", Some(THRESHOLD)), ("best on the first half", fitted_threshold(results))]
        {
            let rates = alone.each_ref().map(|class| {
                threshold.map_or("-".to_owned(), |threshold| percent(class.below(threshold), class.stitched))
            });
            let [yes, wrongly] = rates;
            table.push([rule.to_owned(), number(threshold, 4), half.to_owned(), yes, wrongly]);
        }
        let full = [true, false].map(|kind| class(results, kind, FULL, part));
        let [yes, wrongly] = full.map(|class| percent(class.accepted, class.stitched));
        table.push(["full gate (default)".to_owned(), number(Some(default), 4), half.to_owned(), yes, wrongly]);
    }
    table
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
        let (full, paper) = (class(results, manhattan, FULL, Part::All), class(results, manhattan, PAPER, Part::All));
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
        table.push(cells(name.to_owned(), &class(results, manhattan, PAPER, Part::All).divergences));
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
    let rates = class(results, false, FULL, Part::All).rate().zip(class(results, true, FULL, Part::All).rate());
    let gate = rates.map(|(wrongly, yes)| (100.0 * wrongly, 100.0 * yes));
    let mut chart = Chart::new(
        "others accepted, %",
        "Manhattan accepted, %",
        vec![line, Series::plain("full gate (default)", SeriesMark::Dots, gate)],
    );
    (chart.x_range, chart.y_max) = (Some((-2.0, 100.0)), Some(100.0));
    chart.svg()
}
