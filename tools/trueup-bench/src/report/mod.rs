//! Writing what was found: Markdown, one HTML page, CSV.

pub(crate) mod csv;
pub(crate) mod document;
pub(crate) mod html;
pub(crate) mod markdown;
pub(crate) mod overview;

use std::path::Path;

use document::{Block, Document};
use trueup::{Result, check_place, write_atomically};

/// The report's files.
const MARKDOWN: &str = "report.md";
const HTML: &str = "report.html";

/// Checks that a report could be written into a folder, before the long work that it tells of.
///
/// # Errors
/// As [`write()`].
pub(crate) fn check(folder: &Path) -> Result<()> {
    [MARKDOWN, HTML].into_iter().try_for_each(|name| check_place(&folder.join(name)))
}

/// Writes `report.md`, `report.html` and a CSV file per table into a folder.
///
/// # Errors
/// [`trueup::Error::Input`] and [`trueup::Error::Io`] if a file cannot be written.
pub(crate) fn write(document: &Document, folder: &Path) -> Result<()> {
    let write = |name: &str, text: String| write_atomically(&folder.join(name), text.as_bytes());
    write(MARKDOWN, markdown::render(document))?;
    write(HTML, html::render(document))?;
    for section in &document.sections {
        for block in &section.blocks {
            if let Block::Table(table) = block {
                write(&format!("{}.csv", table.id), csv::table_csv(table))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_that_take_no_report_are_refused_before_the_work() {
        let folder = tempfile::tempdir().expect("folder");
        check(folder.path()).expect("a place for a report");
        std::fs::create_dir(folder.path().join(HTML)).expect("folder");
        let said = check(folder.path()).expect_err("the page's name is taken").to_string();
        assert!(said.contains("report.html: it is a folder"), "{said}");
    }
}
