//! The form of a summary.

use std::fmt::Write;

use crate::words::one_line;

/// Lines of a label and a text; texts stand below each other.
#[derive(Debug, Default)]
pub(crate) struct LabeledLines(String);

impl LabeledLines {
    pub(crate) fn into_text(self) -> String {
        self.0
    }

    pub(crate) fn entry(&mut self, label: &str, text: &str) {
        let _ = writeln!(self.0, "{label:<11} {}", one_line(text));
    }

    /// A line that belongs to the entry above, with its own label.
    pub(crate) fn item(&mut self, label: &str, text: &str) {
        let _ = writeln!(self.0, "  {label:<9} {}", one_line(text));
    }
}
