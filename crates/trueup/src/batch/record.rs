//! What became of a set of photographs, as it is kept beside its panoramas.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use trueup_core::{Error, Result};
use trueup_io::encode;

use super::names;

/// The field of [`SetRecord::made_of`] that lists the photographs.
pub(super) const PHOTOGRAPHS: &str = "photographs";
/// The field of a photograph in it that could not be read; others do not have it.
pub(super) const UNREADABLE: &str = "unreadable";

/// What became of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetRecord {
    /// The set's name, as [`super::PhotographsOfFolder::name`] has it.
    pub set: String,
    /// How many photographs it has.
    pub photographs: usize,
    /// What decides its panoramas: the program, the options that were changed, the photographs. Texts and whole numbers
    /// only, so that what was read is what was written.
    pub made_of: Value,
    /// When it was done, by the clock of the machine that did it: milliseconds since the beginning of the year 1970.
    pub ended_ms: u64,
    /// What came of it.
    pub outcome: SetOutcome,
    /// Panoramas that lie in the set's folder and did not come of it now, below the folder of the batch: an earlier
    /// attempt made them, of other photographs or with other options.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outdated: Vec<String>,
}

/// What came of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SetOutcome {
    /// The summaries ([`crate::Written::summary`]) of its panoramas, at least one; their files below the folder of the
    /// batch.
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

    /// Whether a panorama is one of the set's, of now or of an earlier attempt; `file` is its path below the folder of
    /// the batch.
    pub(super) fn lists(&self, file: &str) -> bool {
        self.panoramas().iter().any(|one| one["panorama"] == file) || self.outdated.iter().any(|one| one == file)
    }

    /// The record in a set's folder; `None` if there is none, or it is no whole one.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(folder.join(names::RECORD)).ok()?).ok()
    }

    /// Keeps the record: the set is done when it is there.
    ///
    /// # Errors
    /// Those of writing.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let text =
            serde_json::to_vec(self).map_err(|error| Error::input("record", error, "Report this as a defect."))?;
        encode::write_atomically(&folder.join(names::RECORD), &text)
    }

    /// Takes a set's record away, before its panoramas are made anew: it would speak of the old ones.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn forget(folder: &Path) -> Result<()> {
        let path = folder.join(names::RECORD);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io("removing", &path, error)),
            _ => Ok(()),
        }
    }

    /// Whether all panoramas are still there with what lies beside them, in the folder of the batch, and none was cut
    /// short. A panorama that has grown counts as whole: somebody wrote something into it, as a caption, which is not
    /// to be lost.
    pub(super) fn files_are_whole(&self, output: &Path) -> bool {
        let is_whole =
            |file: &Value, bytes: u64| file.as_str().is_some_and(|path| has_bytes(&output.join(path), bytes));
        let all_are = |one: &Value| {
            let besides = one["beside"].as_object().into_iter().flat_map(|beside| beside.values());
            is_whole(&one["panorama"], one["bytes"].as_u64().unwrap_or(1))
                && besides.into_iter().all(|file| is_whole(file, 1))
        };
        self.panoramas().iter().all(all_are)
    }

    /// Whether the photograph at this position of the set could not be read then.
    pub(super) fn was_unreadable(&self, position: usize) -> bool {
        self.made_of[PHOTOGRAPHS].get(position).is_some_and(|photograph| photograph.get(UNREADABLE).is_some())
    }

    /// Whether what is `made_of` now would come to nothing else than the record's. A photograph that could be read then
    /// and cannot now would only be missing; one that could not be read then and can now is made use of.
    pub(super) fn is_of(&self, made_of: &Value) -> bool {
        let mut now = made_of.clone();
        let before = self.made_of[PHOTOGRAPHS].as_array().map_or(&[][..], Vec::as_slice);
        let photographs = now[PHOTOGRAPHS].as_array_mut().map_or(&mut [][..], Vec::as_mut_slice);
        for (now, before) in photographs.iter_mut().zip(before) {
            if let Some(now) = now.as_object_mut().filter(|_| before.get(UNREADABLE).is_none()) {
                now.remove(UNREADABLE);
            }
        }
        now == self.made_of
    }
}

/// Whether a file is there that has so many bytes at least. Of a panorama of tiles, the bytes are those of all tiles,
/// which are not counted here: their folder must be there.
fn has_bytes(path: &Path, bytes: u64) -> bool {
    let tiles = names::tiles(path);
    let at_least = if tiles.is_some() { 1 } else { bytes.max(1) };
    path.metadata().is_ok_and(|file| file.is_file() && file.len() >= at_least)
        && tiles.is_none_or(|folder| folder.is_dir())
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
    // As the summary has it: what is not UTF-8 in its name is replaced there.
    let output = PathBuf::from(output.display().to_string());
    let shorten = |value: &mut Value| {
        let inside = value.as_str().and_then(|path| Path::new(path).strip_prefix(&output).ok());
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
            outdated: Vec::new(),
        };
        record.write(desk.path()).expect("written");
        assert_eq!(SetRecord::read(desk.path()).as_ref(), Some(&record));
        assert_eq!(record.panoramas()[0]["panorama"], "a/p.jpg");
        assert_eq!(record.panoramas()[0]["beside"]["project"], "a/p.json");
        let text = std::fs::read(desk.path().join(names::RECORD)).expect("readable");
        std::fs::write(desk.path().join(names::RECORD), &text[..text.len() / 2]).expect("written");
        assert_eq!(SetRecord::read(desk.path()), None);
        for _ in 0..2 {
            SetRecord::forget(desk.path()).expect("gone");
        }
        assert!(!desk.path().join(names::RECORD).exists());
    }

    fn made(made_of: Value, panorama: Value) -> SetRecord {
        let outcome = SetOutcome::Made(vec![panorama]);
        SetRecord { set: "a".to_owned(), photographs: 2, made_of, ended_ms: 7, outcome, outdated: Vec::new() }
    }

    #[test]
    fn a_panorama_that_is_cut_short_or_alone_is_not_whole() {
        let desk = tempfile::tempdir().expect("a folder");
        let put = |name: &str, text: &str| std::fs::write(desk.path().join(name), text).expect("written");
        let record = made(Value::Null, json!({"panorama": "p.jpg", "bytes": 4, "beside": {"project": "p.json"}}));
        let is_whole = || record.files_are_whole(desk.path());
        assert!(!is_whole(), "nothing is there");
        put("p.jpg", "four");
        assert!(!is_whole(), "the project is not there");
        put("p.json", "{}");
        assert!(is_whole());
        for (text, whole) in [("", false), ("fou", false), ("four and a caption", true)] {
            put("p.jpg", text);
            assert_eq!(is_whole(), whole, "{text}");
        }
        put("p.json", "");
        assert!(!is_whole(), "the project is empty");
        let tiled = made(Value::Null, json!({"panorama": "p.dzi", "bytes": 4000}));
        put("p.dzi", "xml");
        assert!(!tiled.files_are_whole(desk.path()), "its tiles are gone");
        std::fs::create_dir(desk.path().join("p_files")).expect("a folder");
        assert!(tiled.files_are_whole(desk.path()));
    }

    #[test]
    fn a_photograph_that_can_be_read_by_now_is_made_use_of() {
        let photograph = |bytes: u64, is_unreadable: bool| match is_unreadable {
            true => json!({"path": "x.jpg", "bytes": bytes, UNREADABLE: true}),
            false => json!({"path": "x.jpg", "bytes": bytes}),
        };
        let made_of = |one: Value| json!({"options": ["a=1"], PHOTOGRAPHS: [one]});
        let before = made(made_of(photograph(5, true)), Value::Null);
        assert_eq!([0, 1].map(|position| before.was_unreadable(position)), [true, false]);
        let is_same = |before: Value, now: Value| made(made_of(before), Value::Null).is_of(&made_of(now));
        assert!(is_same(photograph(5, false), photograph(5, false)));
        assert!(!is_same(photograph(5, false), photograph(6, false)));
        assert!(!is_same(photograph(5, true), photograph(5, false)), "it can be read by now");
        assert!(is_same(photograph(5, true), photograph(5, true)));
        assert!(is_same(photograph(5, false), photograph(5, true)), "it would only be missing");
        let other = json!({"options": [], PHOTOGRAPHS: [photograph(5, false)]});
        assert!(!made(made_of(photograph(5, false)), Value::Null).is_of(&other));
    }
}
