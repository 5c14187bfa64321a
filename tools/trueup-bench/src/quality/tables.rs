//! The tables of the page.

use super::discover::Part;
use super::row::QualityRow;
use crate::report::document::{Table, number};
use crate::report::markdown::table_text;
use crate::statistics::median;

/// A figure of a row, with its heading and how many decimals it is shown with.
struct Column {
    heading: &'static str,
    decimals: usize,
    figure: fn(&QualityRow) -> Option<f64>,
}

const UPRIGHT: Column = Column { heading: "upright deg", decimals: 2, figure: |row| row.upright_deg };
const WORST: Column = Column { heading: "worst deg", decimals: 2, figure: |row| row.upright_max_deg };
const LD: Column = Column { heading: "LD x 1e-2", decimals: 2, figure: |row| row.ld };
const GDIC: Column = Column { heading: "GDIC deg", decimals: 2, figure: |row| row.gdic_deg };
const ALIGN: Column = Column { heading: "align px", decimals: 2, figure: |row| row.align_px };
const DIVERGENCE: Column = Column { heading: "divergence", decimals: 4, figure: |row| row.divergence };
const SECONDS: Column = Column { heading: "s", decimals: 1, figure: |row| row.seconds };
const PEAK: Column = Column { heading: "MB", decimals: 0, figure: |row| row.peak_mb };

fn columns(part: Part) -> &'static [Column] {
    match part {
        Part::Known => &[DIVERGENCE, UPRIGHT, WORST, LD, GDIC, ALIGN, SECONDS, PEAK],
        Part::Photographs => &[DIVERGENCE, UPRIGHT, LD, GDIC, ALIGN, SECONDS, PEAK],
    }
}

/// Medians per kind, in the order in which the kinds appear; the previous ones in brackets where they read otherwise.
pub(super) fn medians(part: Part, rows: &[QualityRow], previous: &[QualityRow]) -> String {
    let columns = columns(part);
    let heads = ["kind", "sets", "used/given", "guided"].into_iter().chain(columns.iter().map(|column| column.heading));
    let mut table = Table::new("", "", heads);
    let mut kinds: Vec<&str> = Vec::new();
    for row in rows {
        if !kinds.contains(&row.kind.as_str()) {
            kinds.push(&row.kind);
        }
    }
    for kind in kinds {
        let (new, old) = (of_kind(rows, kind), of_kind(previous, kind));
        let guided =
            new.iter().filter(|row| ["yes", "all lines", "vertical only"].contains(&row.guided.as_str())).count();
        let totals = format!(
            "{}/{}",
            new.iter().map(|row| row.used).sum::<usize>(),
            new.iter().map(|row| row.given).sum::<usize>()
        );
        let mut cells = vec![named(kind).to_owned(), new.len().to_string(), totals, guided.to_string()];
        for column in columns {
            let middle =
                |rows: &[&QualityRow]| median(&rows.iter().filter_map(|row| (column.figure)(row)).collect::<Vec<_>>());
            cells.push(compared(middle(&new), middle(&old), column.decimals));
        }
        table.push(cells);
    }
    table_text(&table)
}

/// A row per set; previous figures in brackets where they read otherwise.
pub(super) fn every_set(part: Part, rows: &[QualityRow], previous: &[QualityRow]) -> String {
    let columns = columns(part);
    let heads = ["set", "kind", "used/given", "guided"].into_iter().chain(columns.iter().map(|column| column.heading));
    let mut table = Table::new("", "", heads.chain(["panorama"]));
    for row in rows {
        let old = previous.iter().find(|old| old.set == row.set && old.kind == row.kind);
        let words = |new: String, old: Option<String>| match old {
            Some(old) if old != new => format!("{new} ({old})"),
            _ => new,
        };
        let used = |row: &QualityRow| format!("{}/{}", row.used, row.given);
        let mut cells = vec![
            row.set.clone(),
            named(&row.kind).to_owned(),
            words(used(row), old.map(used)),
            words(row.guided.clone(), old.map(|old| old.guided.clone())),
        ];
        for column in columns {
            cells.push(compared((column.figure)(row), old.and_then(column.figure), column.decimals));
        }
        cells.push(if row.note.is_empty() { row.size.clone() } else { row.note.clone() });
        table.push(cells);
    }
    table_text(&table)
}

fn of_kind<'a>(rows: &'a [QualityRow], kind: &str) -> Vec<&'a QualityRow> {
    rows.iter().filter(|row| row.kind == kind).collect()
}

fn named(kind: &str) -> &str {
    if kind.is_empty() { "-" } else { kind }
}

/// "0.04 (0.05)": the figure and, if it reads otherwise, the previous one.
fn compared(new: Option<f64>, old: Option<f64>, decimals: usize) -> String {
    let new = number(new, decimals);
    match old {
        Some(old) if number(Some(old), decimals) != new => format!("{new} ({})", number(Some(old), decimals)),
        _ => new,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(set: &str, upright: f64) -> QualityRow {
        QualityRow {
            used: 9,
            given: 9,
            guided: "yes".to_owned(),
            upright_deg: Some(upright),
            seconds: Some(1.0),
            peak_mb: Some(100.0),
            size: "10 x 5".to_owned(),
            ..QualityRow::empty(Part::Known, set, "row")
        }
    }

    #[test]
    fn previous_figures_stand_in_brackets_where_they_differ() {
        assert_eq!(compared(Some(0.041), Some(0.049), 2), "0.04 (0.05)");
        assert_eq!(compared(Some(0.041), Some(0.042), 2), "0.04");
        assert_eq!(compared(None, Some(0.1), 2), "- (0.10)");
        assert_eq!(compared(Some(1.0), None, 1), "1.0");
    }

    #[test]
    fn a_kind_has_the_median_of_its_sets() {
        let text = medians(Part::Known, &[row("a", 0.1), row("b", 0.3), row("c", 0.2)], &[row("a", 0.5)]);
        let line = text.lines().last().expect("a row");
        assert_eq!(line, "| row | 3 | 27/27 | 3 | - | 0.20 (0.50) | - | - | - | - | 1.0 | 100 |");
    }

    #[test]
    fn a_set_that_failed_says_why() {
        let failed =
            QualityRow { note: "no overlap".to_owned(), given: 2, ..QualityRow::empty(Part::Photographs, "a", "pair") };
        let text = every_set(Part::Photographs, &[failed], &[row("a", 0.1)]);
        assert!(text.ends_with("| a | pair | 0/2 | - | - | - | - | - | - | - | - | no overlap |\n"), "{text}");
    }
}
