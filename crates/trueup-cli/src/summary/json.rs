//! The summary for programs.

use serde_json::{Value, json};
use trueup::Written;

/// The summary of panoramas that were written, as JSON: docs/command-line.md says what its fields mean.
pub(crate) fn json(written: &[Written]) -> String {
    let panoramas: Vec<Value> = written.iter().map(Written::summary).collect();
    let mut text = json!({ "format": "trueup-summary", "version": 1, "panoramas": panoramas }).to_string();
    text.push('\n');
    text
}
