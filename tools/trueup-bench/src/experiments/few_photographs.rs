//! Two to six photographs: how often vanishing points are believed, and how upright the panorama is.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use crate::published_forms::DIVERGENCE_GATE;
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::sets::Catalogue;
use crate::statistics::{mean, median};
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "few-photographs";

const COUNTS: std::ops::RangeInclusive<usize> = 2..=6;
/// Scenes of each class: the first of the gate's.
const SCENES: usize = 24;

const VARIANTS: [(&str, &[&str]); 2] = [("full gate", &[]), ("divergence alone", &DIVERGENCE_GATE)];

/// The first two to six photographs of the gate's sets.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for manhattan in [true, false] {
        let sets = catalogue.gate.iter().filter(|set| set.manhattan == Some(manhattan)).take(SCENES);
        for set in sets {
            for count in COUNTS {
                for (name, overrides) in VARIANTS {
                    let trial = Trial::new(NAME, &set.name, name, overrides);
                    trials.push(Trial { photograph_count: Some(count), ..trial });
                }
            }
        }
    }
    Ok(trials)
}

/// Rows of one class, count and gate in which every photograph was used.
fn rows<'a>(results: &'a Results, manhattan: bool, count: usize, variant: &str) -> Vec<&'a Row> {
    let of_class = |row: &&Row| {
        let set = results.catalogue.gate.iter().find(|set| set.name == row.key.set);
        set.is_some_and(|set| set.manhattan == Some(manhattan))
    };
    results
        .of(NAME)
        .filter(|row| row.key.photograph_count == Some(count) && row.key.variant == variant)
        .filter(of_class)
        .filter(|row| row.measure("used") == Some(count as f64))
        .collect()
}

fn figures(rows: &[&Row], measure: &str) -> Vec<f64> {
    rows.iter().filter_map(|row| row.measure(measure)).collect()
}

fn fallback_percent(rows: &[&Row]) -> Option<f64> {
    mean(&figures(rows, "accepted")).map(|accepted| 100.0 * (1.0 - accepted))
}

/// Table and lines.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Few photographs");
    section.say(
        "A single photograph always fits its own vanishing points, and two fit each other once in a while: with few photographs the \
         divergence alone proves little. The first two to six photographs of rendered scenes, as far as they hang together. \
         Fallback means that cameras were levelled without vanishing points: wrong for a Manhattan scene, right for another.",
    );
    let columns = [
        "photographs",
        "gate",
        "Manhattan sets",
        "fallback %",
        "upright deg, median",
        "upright deg, worst",
        "other sets",
        "fallback %, others",
        "upright deg, others, median",
    ];
    let mut table = Table::new("few-photographs", "Fallback by number of photographs.", columns);
    for count in COUNTS {
        for (variant, _) in VARIANTS {
            let (yes, other) = (rows(results, true, count, variant), rows(results, false, count, variant));
            let upright = figures(&yes, "upright_deg");
            table.push([
                count.to_string(),
                variant.to_owned(),
                yes.len().to_string(),
                number(fallback_percent(&yes), 0),
                number(median(&upright), 2),
                number(upright.iter().copied().max_by(f64::total_cmp), 2),
                other.len().to_string(),
                number(fallback_percent(&other), 0),
                number(median(&figures(&other, "upright_deg")), 2),
            ]);
        }
    }
    section.blocks.push(Block::Table(table));
    let mut series = Vec::new();
    for (manhattan, class) in [(true, "Manhattan"), (false, "others")] {
        for (variant, _) in VARIANTS {
            let points = COUNTS
                .filter_map(|count| Some((count as f64, fallback_percent(&rows(results, manhattan, count, variant))?)));
            series.push(Series::plain(&format!("{class}, {variant}"), SeriesMark::Line, points));
        }
    }
    let mut chart = Chart::new("photographs", "fallback, %", series);
    chart.y_max = Some(100.0);
    section.draw("Share of the sets that fall back, by number of photographs.", chart.svg());
    section
}
