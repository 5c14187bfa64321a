//! What became of a set of photographs, as it is kept beside its panoramas.

use std::io::ErrorKind;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use trueup_core::{Error, Result};
use trueup_io::encode;

/// The record's file in the folder of a set.
const FILE: &str = "record.json";

/// What became of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetRecord {
    /// The set's name, as [`super::PhotographsOfFolder::name`] has it.
    pub set: String,
    /// How many photographs it has.
    pub photographs: usize,
    /// What decides its panoramas: the program, the options that were changed, the photographs. Texts and whole numbers only, so that
    /// what was read is what was written.
    pub made_of: Value,
    /// When it was done, by the clock of the machine that did it: milliseconds since the beginning of the year 1970.
    pub ended_ms: u64,
    /// What came of it.
    pub outcome: SetOutcome,
}

/// What came of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SetOutcome {
    /// The summaries ([`crate::Written::summary`]) of its panoramas, at least one; their files below the folder of the batch.
    Made(Vec<Value>),
    /// There is none.
    Failed {
        /// Why, without a closing full stop.
        error: String,
        /// What to do about it, a whole sentence; empty where that is not known.
        hint: String,
        /// Whether it was for a want of memory or of the disk's, which may have passed when the next run comes.
        may_pass: bool,
    },
    /// It is a single photograph, which makes no panorama.
    Alone,
}

impl SetOutcome {
    /// A set that could not be stitched.
    pub(super) fn failed(error: &Error) -> Self {
        let may_pass = matches!(error, Error::Io { .. } | Error::Limits { .. });
        let hint = hint(error).to_owned();
        // An error's words end with its hint.
        let words = error.to_string();
        let without = words.strip_suffix(&hint).unwrap_or(&words);
        Self::Failed { error: without.trim_end_matches(['.', ' ']).to_owned(), hint, may_pass }
    }
}

/// What an error says can be done about it; empty if it does not.
fn hint(error: &Error) -> &str {
    match error {
        Error::Input { hint, .. }
        | Error::Limits { hint, .. }
        | Error::Unsupported { hint, .. }
        | Error::Unsolvable { hint, .. }
        | Error::NotApplicable { hint, .. } => hint,
        _ => "",
    }
}

impl SetRecord {
    /// Whether the set should have made a panorama and has not.
    pub fn has_failed(&self) -> bool {
        matches!(self.outcome, SetOutcome::Failed { .. })
    }

    /// Whether the set failed for a reason that may have passed.
    pub(super) fn may_pass(&self) -> bool {
        matches!(self.outcome, SetOutcome::Failed { may_pass: true, .. })
    }

    /// The summaries of its panoramas.
    pub fn panoramas(&self) -> &[Value] {
        match &self.outcome {
            SetOutcome::Made(panoramas) => panoramas,
            SetOutcome::Failed { .. } | SetOutcome::Alone => &[],
        }
    }

    /// The record in a set's folder; `None` if there is none, or it is no whole one.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(folder.join(FILE)).ok()?).ok()
    }

    /// Keeps the record: the set is done when it is there.
    ///
    /// # Errors
    /// Those of writing.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let text =
            serde_json::to_vec(self).map_err(|error| Error::input("record", error, "Report this as a defect."))?;
        encode::write_atomically(&folder.join(FILE), &text)
    }

    /// Takes a set's record away, before its panoramas are made anew: it would speak of the old ones.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn forget(folder: &Path) -> Result<()> {
        let path = folder.join(FILE);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io("removing", &path, error)),
            _ => Ok(()),
        }
    }

    /// Whether all panoramas are still there, in the folder of the batch.
    pub(super) fn files_are_there(&self, output: &Path) -> bool {
        let is_there = |one: &Value| one["panorama"].as_str().is_some_and(|path| output.join(path).is_file());
        self.panoramas().iter().all(is_there)
    }
}

/// Milliseconds since the beginning of the year 1970, now; 0 before it.
pub(super) fn now_ms() -> u64 {
    milliseconds(SystemTime::now())
}

/// Milliseconds since the beginning of the year 1970; 0 before it.
pub(super) fn milliseconds(time: SystemTime) -> u64 {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// A panorama's summary with its files as they lie below the folder `output`: that can be moved.
pub(super) fn below(mut panorama: Value, output: &Path) -> Value {
    let shorten = |value: &mut Value| {
        let inside = value.as_str().and_then(|path| Path::new(path).strip_prefix(output).ok());
        if let Some(inside) = inside.map(|path| path.display().to_string()) {
            *value = inside.into();
        }
    };
    shorten(&mut panorama["panorama"]);
    if let Some(beside) = panorama["beside"].as_object_mut() {
        beside.values_mut().for_each(shorten);
    }
    panorama
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_failure_is_parted_into_why_and_what_to_do_and_told_whether_it_may_pass() {
        let damaged = Error::input("a.jpg", "it is a text", "Give a photograph.");
        let expected = SetOutcome::Failed {
            error: "a.jpg: it is a text".to_owned(),
            hint: "Give a photograph.".to_owned(),
            may_pass: false,
        };
        assert_eq!(SetOutcome::failed(&damaged), expected);
        let full = Error::io("writing", Path::new("p.jpg"), std::io::Error::other("no space"));
        let expected =
            SetOutcome::Failed { error: "writing p.jpg: no space".to_owned(), hint: String::new(), may_pass: true };
        assert_eq!(SetOutcome::failed(&full), expected);
    }

    #[test]
    fn what_is_read_is_what_was_written_and_half_of_it_is_nothing() {
        let desk = tempfile::tempdir().expect("a folder");
        let panorama = json!({"panorama": "out/a/p.jpg", "beside": {"project": "out/a/p.json"}, "width": 3});
        let record = SetRecord {
            set: "a".to_owned(),
            photographs: 2,
            made_of: json!({"photographs": [["a.jpg", 5, 1_763_877_641_123_u64]]}),
            ended_ms: 7,
            outcome: SetOutcome::Made(vec![below(panorama, Path::new("out"))]),
        };
        record.write(desk.path()).expect("written");
        assert_eq!(SetRecord::read(desk.path()).as_ref(), Some(&record));
        assert_eq!(record.panoramas()[0]["panorama"], "a/p.jpg");
        assert_eq!(record.panoramas()[0]["beside"]["project"], "a/p.json");
        assert!(!record.files_are_there(desk.path()));
        std::fs::create_dir(desk.path().join("a")).expect("a folder");
        std::fs::write(desk.path().join("a/p.jpg"), "").expect("written");
        assert!(record.files_are_there(desk.path()));
        let text = std::fs::read(desk.path().join(FILE)).expect("readable");
        std::fs::write(desk.path().join(FILE), &text[..text.len() / 2]).expect("written");
        assert_eq!(SetRecord::read(desk.path()), None);
        for _ in 0..2 {
            SetRecord::forget(desk.path()).expect("gone");
        }
        assert!(!desk.path().join(FILE).exists());
    }
}
