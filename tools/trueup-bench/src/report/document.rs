//! What a report says, before it is written as Markdown, HTML or CSV.

/// A whole report.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Document {
    /// Its title.
    pub title: String,
    /// Its sections, in order.
    pub sections: Vec<Section>,
}

/// A part with a heading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Section {
    /// Name for links, lower case without blanks.
    pub id: &'static str,
    /// Its heading.
    pub title: String,
    /// What it says.
    pub blocks: Vec<Block>,
}

/// A piece of a section. In texts, `words` in backticks are code.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Block {
    /// Plain text.
    Paragraph(String),
    /// A list of points.
    List(Vec<String>),
    /// Figures.
    Table(Table),
    /// A drawing; Markdown shows its caption alone, for the same figures stand in a table.
    Drawing(ReportDrawing),
    /// A claim and whether it holds.
    Claim(Claim),
    /// Pictures beside each other, in files beside the report.
    Pictures(ReportPictures),
    /// Something that was not run, and why.
    Skipped(String),
}

/// A table; the first column names the rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    /// Name of its CSV file, without the extension.
    pub id: String,
    /// What it shows.
    pub caption: String,
    /// Headings.
    pub columns: Vec<String>,
    /// As many cells as headings, each.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TableRow {
    /// The cells' texts.
    pub cells: Vec<String>,
    /// Whether its figures are the paper's, not ours.
    pub from_paper: bool,
}

/// A drawing with its words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReportDrawing {
    /// What it shows.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// Pictures with their words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReportPictures {
    /// What they show.
    pub caption: String,
    /// The pictures, in order.
    pub pictures: Vec<ReportPicture>,
}

/// A picture in a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReportPicture {
    /// The file, seen from the report's folder, with `/` between folders.
    pub file: String,
    /// What it shows, in a few words.
    pub words: String,
}

/// A claim about the method and whether our figures bear it out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Claim {
    /// Its name in the list of those that a quick run expects to hold.
    pub id: &'static str,
    /// What is claimed, a whole sentence.
    pub text: String,
    /// Whether it holds; `None` if it was not tried.
    pub holds: Option<bool>,
    /// The figures that say so.
    pub evidence: String,
    /// Why it does not hold, where it does not: what was found out, or nothing.
    pub reason: &'static str,
    /// The same in a few words, for a summing-up line.
    pub brief: String,
}

impl Table {
    /// A table without rows.
    pub(crate) fn new(id: &str, caption: &str, columns: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self {
            id: id.to_owned(),
            caption: caption.to_owned(),
            columns: columns.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row of our own figures.
    pub(crate) fn push(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(TableRow { cells: cells.into_iter().map(Into::into).collect(), from_paper: false });
    }

    /// Adds a row of the paper's figures.
    pub(crate) fn push_paper(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(TableRow { cells: cells.into_iter().map(Into::into).collect(), from_paper: true });
    }
}

impl Section {
    /// A section without content.
    pub(crate) fn new(id: &'static str, title: &str) -> Self {
        Self { id, title: title.to_owned(), blocks: Vec::new() }
    }

    /// Adds a paragraph.
    pub(crate) fn say(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Paragraph(text.into()));
    }

    /// Adds a drawing.
    pub(crate) fn draw(&mut self, caption: &str, svg: String) {
        self.blocks.push(Block::Drawing(ReportDrawing { caption: caption.to_owned(), svg }));
    }
}

impl Claim {
    /// The figures that say whether it holds, and why not where it does not.
    pub(crate) fn grounds(&self) -> String {
        match (self.holds, self.reason) {
            (Some(false), reason) if !reason.is_empty() => format!("{} {reason}", self.evidence),
            _ => self.evidence.clone(),
        }
    }
}

/// A figure with `decimals` digits behind the point; a dash for none.
pub(crate) fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) if value.is_finite() => format!("{value:.decimals$}"),
        _ => "-".to_owned(),
    }
}
