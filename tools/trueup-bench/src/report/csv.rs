//! Tables as comma-separated values (RFC 4180).

use super::document::Table;

/// A table; a last column says whether a row's figures are ours or the paper's.
pub(crate) fn table_csv(table: &Table) -> String {
    let headings = table.columns.iter().map(String::as_str).chain(["source"]);
    let mut text = line(headings);
    for row in &table.rows {
        let source = if row.from_paper { "paper" } else { "measured" };
        text.push_str(&line(row.cells.iter().map(String::as_str).chain([source])));
    }
    text
}

/// One line of cells, quoted where they need it.
pub(crate) fn line<'a>(cells: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = cells
        .into_iter()
        .map(|cell| match cell.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell.to_owned(),
        })
        .collect();
    quoted.join(",") + "\n"
}

/// The cells of one line that [`line()`] wrote.
pub(crate) fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut characters = line.trim_end_matches(['\r', '\n']).chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    cells.push(cell);
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_back_as_they_were() {
        let row = ["plain", "with, comma", "with \"quotes\"", ""];
        assert_eq!(line(row), "plain,\"with, comma\",\"with \"\"quotes\"\"\",\n");
        assert_eq!(cells(&line(row)), row);
    }
}
