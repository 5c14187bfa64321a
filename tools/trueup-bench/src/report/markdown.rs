//! A document as Markdown.

use std::fmt::Write;

use super::document::{Block, Claim, Document, Table};

/// The whole document.
pub(crate) fn render(document: &Document) -> String {
    let mut text = format!("# {}\n", document.title);
    for section in &document.sections {
        let _ = write!(text, "\n## {}\n", section.title);
        for block in &section.blocks {
            text.push('\n');
            text.push_str(&block_text(block));
        }
    }
    text
}

fn block_text(block: &Block) -> String {
    match block {
        Block::Paragraph(words) => format!("{words}\n"),
        Block::List(points) => points.iter().map(|point| format!("- {point}\n")).collect(),
        Block::Table(table) => table_text(table),
        Block::Drawing(drawing) => format!("*{}* (drawn in report.html)\n", drawing.caption),
        Block::Claim(claim) => format!("> **{}** {} {}\n", verdict(claim), claim.text, claim.grounds()),
        Block::Pictures(row) => {
            let each = row.pictures.iter().map(|picture| format!("![{0}]({1})\n{0}\n", picture.words, picture.file));
            format!("{}\n\n{}", row.caption, each.collect::<Vec<_>>().join("\n"))
        }
        Block::Skipped(reason) => format!("*skipped: {reason}*\n"),
    }
}

/// A claim's outcome in words.
pub(crate) fn verdict(claim: &Claim) -> &'static str {
    match claim.holds {
        Some(true) => "Holds:",
        Some(false) => "Does not hold:",
        None => "Not tried:",
    }
}

/// A table with its caption above; the paper's rows are in italics.
pub(crate) fn table_text(table: &Table) -> String {
    let mut text = String::new();
    if !table.caption.is_empty() {
        let _ = write!(text, "{}\n\n", table.caption);
    }
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    text.push_str(&line(&table.columns));
    let _ = writeln!(text, "|{}", "---|".repeat(table.columns.len()));
    for row in &table.rows {
        let cells: Vec<String> = row
            .cells
            .iter()
            .map(|cell| cell.replace('|', "\\|"))
            .map(|cell| if row.from_paper && !cell.is_empty() { format!("*{cell}*") } else { cell })
            .collect();
        text.push_str(&line(&cells));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::Section;

    #[test]
    fn tables_keep_their_columns_and_mark_the_papers_rows() {
        let mut table = Table::new("t", "What it shows.", ["method", "LD"]);
        table.push(["a|b", "1.0"]);
        table.push_paper(["VPG", "0.8"]);
        assert_eq!(
            table_text(&table),
            "What it shows.\n\n| method | LD |\n|---|---|\n| a\\|b | 1.0 |\n| *VPG* | *0.8* |\n"
        );
    }

    #[test]
    fn a_document_is_headings_and_blocks_apart() {
        let mut section = Section::new("one", "One");
        section.say("Words.");
        section.blocks.push(Block::Skipped("no data given".to_owned()));
        let document = Document { title: "T".to_owned(), sections: vec![section] };
        assert_eq!(render(&document), "# T\n\n## One\n\nWords.\n\n*skipped: no data given*\n");
    }
}
