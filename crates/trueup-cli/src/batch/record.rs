//! What became of a set of photographs, as it is kept beside its panoramas.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use trueup::PhotographsOfFolder;

use crate::failure::Failure;

/// The `format` field of every line.
pub(super) const FORMAT: &str = "trueup-batch";
/// The `version` field: raised when a field changes its meaning or goes away.
pub(super) const VERSION: u32 = 1;
/// The record's file in the folder of a set.
const FILE: &str = "record.json";

/// What became of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct SetRecord {
    /// The set's name.
    pub set: String,
    /// How many photographs it has.
    pub photographs: usize,
    /// What decides its panoramas.
    pub made_of: Value,
    /// What came of it.
    pub outcome: SetOutcome,
}

/// What came of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SetOutcome {
    /// The summaries of its panoramas, at least one.
    Made(Vec<Value>),
    /// Why there is none, and what to do about it.
    Failed { error: String, hint: String },
    /// It is a single photograph.
    Alone,
}

impl SetRecord {
    /// A set that nothing became of yet.
    pub(super) fn of(set: &PhotographsOfFolder, made_of: Value) -> Self {
        Self { set: set.name.clone(), photographs: set.photographs.len(), made_of, outcome: SetOutcome::Alone }
    }

    pub(super) fn alone(self) -> Self {
        Self { outcome: SetOutcome::Alone, ..self }
    }

    pub(super) fn made(self, panoramas: Vec<Value>) -> Self {
        Self { outcome: SetOutcome::Made(panoramas), ..self }
    }

    pub(super) fn failed(self, failure: &Failure) -> Self {
        let (error, hint) = (failure.message().to_owned(), failure.hint().to_owned());
        Self { outcome: SetOutcome::Failed { error, hint }, ..self }
    }

    pub(super) fn has_failed(&self) -> bool {
        matches!(self.outcome, SetOutcome::Failed { .. })
    }

    /// The record in a set's folder; `None` if there is none, or it is no whole one.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(folder.join(FILE)).ok()?).ok()
    }

    /// Keeps the record: the set is done when it is there.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Failure> {
        let made = std::fs::create_dir_all(folder);
        made.map_err(|source| trueup::Error::Io { action: "making", path: folder.to_owned(), source })?;
        let text = serde_json::to_string(self)
            .map_err(|error| trueup::Error::input("record", error, "Report this as a defect."))?;
        Ok(trueup::write_atomically(&folder.join(FILE), text.as_bytes())?)
    }

    /// Whether all panoramas are still there.
    pub(super) fn files_are_there(&self, out: &Path) -> bool {
        let SetOutcome::Made(panoramas) = &self.outcome else { return true };
        panoramas.iter().all(|one| one["panorama"].as_str().is_some_and(|path| out.join(path).is_file()))
    }

    /// A line of JSON for every panorama, or one that says why there is none.
    pub(super) fn lines(&self) -> String {
        let line = |status: &str, more: Value| {
            let mut line = json!({
                "format": FORMAT, "version": VERSION, "set": self.set, "status": status, "photographs": self.photographs
            });
            if let (Some(line), Value::Object(more)) = (line.as_object_mut(), more) {
                line.extend(more);
            }
            format!("{line}\n")
        };
        match &self.outcome {
            SetOutcome::Made(panoramas) => panoramas.iter().map(|one| line("made", one.clone())).collect(),
            SetOutcome::Failed { error, hint } => line("failed", json!({ "error": error, "hint": hint })),
            SetOutcome::Alone => line("alone", json!({})),
        }
    }

    /// The same for people.
    pub(super) fn in_words(&self) -> String {
        match &self.outcome {
            SetOutcome::Made(panoramas) => {
                let one = |one: &Value| {
                    let used = one["used"].as_array().map_or(0, Vec::len);
                    let file = one["panorama"].as_str().unwrap_or_default();
                    format!("{}: {file}  {} x {} px, {used} photographs\n", self.set, one["width"], one["height"])
                };
                panoramas.iter().map(one).collect()
            }
            SetOutcome::Failed { error, .. } => format!("{}: no panorama: {error}\n", self.set),
            SetOutcome::Alone => format!("{}: 1 photograph, which makes no panorama\n", self.set),
        }
    }
}
