//! Writing what was found: Markdown, one HTML page, CSV.

pub(crate) mod charts;
pub(crate) mod csv;
pub(crate) mod document;
pub(crate) mod html;
pub(crate) mod markdown;
pub(crate) mod overview;

use std::path::Path;

use document::{Block, Document};
use trueup::{Error, Result};

/// Writes `report.md`, `report.html` and a CSV file per table into a folder.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written.
pub(crate) fn write(document: &Document, folder: &Path) -> Result<()> {
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| Error::io("writing", &path, error))
    };
    write("report.md", markdown::render(document))?;
    write("report.html", html::render(document))?;
    for section in &document.sections {
        for block in &section.blocks {
            if let Block::Table(table) = block {
                write(&format!("{}.csv", table.id), csv::table_csv(table))?;
            }
        }
    }
    Ok(())
}
