//! A document as one HTML page that needs nothing else.

use std::fmt::Write;

use trueup_report::escape;

use super::document::{Block, Document, Table};
use super::markdown::verdict;

/// The page's looks.
const STYLE: &str = include_str!("page.css");

/// The whole page.
pub(crate) fn render(document: &Document) -> String {
    let title = escape(&document.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n<nav><ol>\n"
    );
    for section in &document.sections {
        let _ = writeln!(page, "<li><a href=\"#{}\">{}</a></li>", section.id, escape(&section.title));
    }
    page.push_str("</ol></nav>\n");
    for section in &document.sections {
        let _ = writeln!(page, "<section id=\"{}\">\n<h2>{}</h2>", section.id, escape(&section.title));
        for block in &section.blocks {
            page.push_str(&block_text(block));
        }
        page.push_str("</section>\n");
    }
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

fn block_text(block: &Block) -> String {
    match block {
        Block::Paragraph(words) => format!("<p>{}</p>\n", inline(words)),
        Block::List(points) => {
            let points: String = points.iter().map(|point| format!("<li>{}</li>\n", inline(point))).collect();
            format!("<ul>\n{points}</ul>\n")
        }
        Block::Table(table) => table_text(table),
        Block::Drawing(drawing) => {
            format!("<figure>\n{}\n<figcaption>{}</figcaption>\n</figure>\n", drawing.svg, inline(&drawing.caption))
        }
        Block::Claim(claim) => {
            let class = match claim.holds {
                Some(true) => "holds",
                Some(false) => "fails",
                None => "untried",
            };
            format!(
                "<p class=\"claim {class}\"><strong>{}</strong> {} <span class=\"evidence\">{}</span></p>\n",
                verdict(claim),
                inline(&claim.text),
                inline(&claim.grounds())
            )
        }
        Block::Pictures(row) => {
            let each = row.pictures.iter().map(|picture| {
                let (file, words) = (escape(&picture.file), inline(&picture.words));
                format!("<figure><img src=\"{file}\" alt=\"{words}\"><figcaption>{words}</figcaption></figure>\n")
            });
            let each: String = each.collect();
            format!("<p class=\"caption\">{}</p>\n<div class=\"pictures\">\n{each}</div>\n", inline(&row.caption))
        }
        Block::Skipped(reason) => format!("<p class=\"skipped\">Skipped: {}</p>\n", inline(reason)),
    }
}

fn table_text(table: &Table) -> String {
    let mut text = String::from("<div class=\"table\">\n");
    if !table.caption.is_empty() {
        let _ = writeln!(text, "<p class=\"caption\">{}</p>", inline(&table.caption));
    }
    text.push_str("<table>\n");
    // A heading stands where the figures or words below it stand.
    let numeric = |index: usize| table.rows.iter().any(|row| row.cells.get(index).is_some_and(|cell| is_number(cell)));
    let headings: String = table
        .columns
        .iter()
        .enumerate()
        .map(|(index, name)| format!("<th{}>{}</th>", if numeric(index) { NUMBER } else { "" }, inline(name)))
        .collect();
    let _ = writeln!(text, "<thead><tr>{headings}</tr></thead>\n<tbody>");
    for row in &table.rows {
        let class = if row.from_paper { " class=\"paper\"" } else { "" };
        let cells: String = row.cells.iter().map(|cell| cell_text(cell)).collect();
        let _ = writeln!(text, "<tr{class}>{cells}</tr>");
    }
    text.push_str("</tbody></table></div>\n");
    text
}

/// Numbers stand at the right, words at the left.
fn cell_text(cell: &str) -> String {
    let class = if cell == "-" || is_number(cell) { NUMBER } else { "" };
    format!("<td{class}>{}</td>", inline(cell))
}

/// The attribute of cells at the right.
const NUMBER: &str = " class=\"number\"";

/// Whether a cell begins with a number.
fn is_number(cell: &str) -> bool {
    cell.trim_start_matches(['-', '+', '<']).starts_with(|first: char| first.is_ascii_digit())
}

/// Escaped text with `words` in backticks as code and **words** between double stars in bold.
fn inline(text: &str) -> String {
    let bold = between(&escape(text), "**", "strong");
    between(&bold, "`", "code")
}

/// Puts what stands between two marks into an element; a mark without a partner stays as it is.
fn between(text: &str, mark: &str, element: &str) -> String {
    let parts: Vec<&str> = text.split(mark).collect();
    let lonely = parts.len().is_multiple_of(2);
    let mut html = String::new();
    for (index, part) in parts.iter().enumerate() {
        let _ = match (index % 2 == 1, lonely && index + 1 == parts.len()) {
            (true, false) => write!(html, "<{element}>{part}</{element}>"),
            (true, true) => write!(html, "{mark}{part}"),
            (false, _) => write!(html, "{part}"),
        };
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::{Claim, ReportPicture, ReportPictures, Section};

    #[test]
    fn words_of_tables_are_escaped_and_code_is_marked() {
        assert_eq!(inline("a < b & `x=\"1\"`"), "a &lt; b &amp; <code>x=&quot;1&quot;</code>");
        assert_eq!(inline("one ` alone"), "one ` alone");
    }

    #[test]
    fn every_block_has_its_mark_up() {
        let mut section = Section::new("one", "One & all");
        let mut table = Table::new("t", "", ["set", "LD"]);
        table.push_paper(["01", "0.82"]);
        section.blocks = vec![
            Block::List(vec!["point".to_owned()]),
            Block::Table(table),
            Block::Pictures(ReportPictures {
                caption: "Side by side.".to_owned(),
                pictures: vec![ReportPicture { file: "figures/a.jpg".to_owned(), words: "a < b".to_owned() }],
            }),
            Block::Claim(Claim {
                id: "so",
                text: "It is so.".to_owned(),
                holds: Some(false),
                evidence: "1 > 2".to_owned(),
                reason: "It cannot.",
                brief: String::new(),
            }),
            Block::Skipped("no data".to_owned()),
        ];
        let page = render(&Document { title: "T".to_owned(), sections: vec![section] });
        for part in [
            "<a href=\"#one\">One &amp; all</a>",
            "<ul>\n<li>point</li>",
            "<tr class=\"paper\"><td class=\"number\">01</td><td class=\"number\">0.82</td></tr>",
            "<p class=\"claim fails\"><strong>Does not hold:</strong> It is so. <span class=\"evidence\">1 &gt; 2 It cannot.",
            "<figure><img src=\"figures/a.jpg\" alt=\"a &lt; b\">",
            "Skipped: no data",
        ] {
            assert!(page.contains(part), "{part} is not in {page}");
        }
    }
}
