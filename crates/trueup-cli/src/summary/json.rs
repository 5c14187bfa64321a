//! The summary for programs.

use serde_json::{Value, json};
use trueup::{Project, Written};

/// The summary of panoramas that were written, as JSON: docs/command-line.md says what its fields mean.
pub(crate) fn json(written: &[Written]) -> String {
    of_panoramas(written.iter().map(Written::summary).collect())
}

/// That of a project: what it says of its panorama, whose file it does not know.
pub(crate) fn json_of_project(project: &Project) -> String {
    of_panoramas(vec![project.summary()])
}

fn of_panoramas(panoramas: Vec<Value>) -> String {
    let mut text = json!({ "format": "trueup-summary", "version": 1, "panoramas": panoramas }).to_string();
    text.push('\n');
    text
}
