//! Tables of sets against variants, with the paper's rows beside ours.

use crate::report::document::{Table, TableRow, number};
use crate::results::{Results, short_name};
use crate::sets::SetSpec;
use crate::statistics::{mean, summary};

/// More sets than this become rows instead of columns.
const MAX_SET_COLUMNS: usize = 12;

/// One line of figures, a value per set.
#[derive(Debug, Clone)]
pub(super) struct GridRow {
    label: String,
    cells: Vec<String>,
    mean: Option<f64>,
    from_paper: bool,
}

impl GridRow {
    /// The mean of a measure of a variant over the seeds, with its deviation where there are several values.
    pub(super) fn measured(
        results: &Results,
        experiment: &str,
        sets: &[SetSpec],
        variant: &str,
        measure: &str,
    ) -> Self {
        let per_set: Vec<_> =
            sets.iter().map(|set| summary(&results.values(experiment, &set.name, variant, measure))).collect();
        let refused = |set: &SetSpec| !results.values(experiment, &set.name, variant, "refused").is_empty();
        let cells = sets.iter().zip(&per_set).map(|(set, found)| match found {
            None if refused(set) => "n/a".to_owned(),
            Some(found) if found.count > 1 => format!("{:.2} ±{:.2}", found.mean, found.deviation),
            found => number(found.map(|found| found.mean), 2),
        });
        let means: Vec<f64> = per_set.iter().flatten().map(|found| found.mean).collect();
        Self { label: variant.to_owned(), cells: cells.collect(), mean: mean(&means), from_paper: false }
    }

    /// The same row under another name than its variant's.
    pub(super) fn labeled(self, label: &str) -> Self {
        Self { label: label.to_owned(), ..self }
    }

    /// Cells made elsewhere, and their mean.
    pub(super) fn stated(label: &str, cells: Vec<String>, mean: Option<f64>) -> Self {
        Self { label: label.to_owned(), cells, mean, from_paper: false }
    }

    /// The paper's figures for as many sets.
    pub(super) fn paper(label: &str, figures: &[f64]) -> Self {
        Self {
            label: format!("paper: {label}"),
            cells: figures.iter().map(|figure| format!("{figure:.2}")).collect(),
            mean: mean(figures),
            from_paper: true,
        }
    }
}

/// A measure's name as part of a file name.
pub(super) fn id_of(measure: &str) -> String {
    measure.replace('_', "-")
}

/// A table with a column per set and a mean; with many sets, a row per set and a mean below.
pub(super) fn table(id: &str, caption: &str, sets: &[SetSpec], rows: &[GridRow]) -> Table {
    let names = sets.iter().map(|set| short_name(&set.name).to_owned());
    if sets.len() <= MAX_SET_COLUMNS {
        let columns = std::iter::once(String::new()).chain(names).chain(["mean".to_owned()]);
        let mut table = Table::new(id, caption, columns);
        for row in rows {
            // The paper's sets stand below ours only where there are as many; its mean always does.
            let fits = row.cells.len() == sets.len();
            let figures = (0..sets.len()).map(|index| if fits { row.cells[index].clone() } else { String::new() });
            let cells = std::iter::once(row.label.clone()).chain(figures).chain([number(row.mean, 2)]).collect();
            table.rows.push(TableRow { cells, from_paper: row.from_paper });
        }
        return table;
    }
    let labels = rows.iter().map(|row| row.label.clone());
    let mut table = Table::new(id, caption, std::iter::once("set".to_owned()).chain(labels));
    for (index, name) in names.enumerate() {
        let cells = rows.iter().map(|row| row.cells.get(index).cloned().unwrap_or_default());
        table.push(std::iter::once(name).chain(cells));
    }
    table.push(std::iter::once("mean".to_owned()).chain(rows.iter().map(|row| number(row.mean, 2))));
    table
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn sets(count: usize) -> Vec<SetSpec> {
        (1..=count).map(|number| SetSpec::folder(format!("x/{number:02}"), PathBuf::new())).collect()
    }

    fn ours(count: usize) -> GridRow {
        let cells = (0..count).map(|index| index.to_string()).collect();
        GridRow { label: "ours".to_owned(), cells, mean: Some(1.0), from_paper: false }
    }

    #[test]
    fn the_papers_sets_stand_below_as_many_of_ours_or_as_a_mean_alone() {
        let paper = GridRow::paper("VPG", &[1.0, 3.0]);
        let two = table("t", "", &sets(2), &[ours(2), paper.clone()]);
        assert_eq!(two.columns, ["", "01", "02", "mean"]);
        assert_eq!(two.rows[1].cells, ["paper: VPG", "1.00", "3.00", "2.00"]);
        let three = table("t", "", &sets(3), &[ours(3), paper]);
        assert_eq!(three.rows[1].cells, ["paper: VPG", "", "", "", "2.00"]);
    }

    #[test]
    fn many_sets_become_rows() {
        let table = table("t", "", &sets(13), &[ours(13)]);
        assert_eq!(table.columns, ["set", "ours"]);
        assert_eq!((table.rows.len(), table.rows[12].cells[0].as_str()), (14, "13"));
        assert_eq!(table.rows[13].cells, ["mean", "1.00"]);
    }
}
