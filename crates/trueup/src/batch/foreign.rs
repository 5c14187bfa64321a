//! Files that lie where a batch would write its own, and that no batch has written: they are never replaced.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use trueup_core::{Error, Result};

use super::names;
use super::record::SetRecord;
use crate::project::PROJECT_FORMAT;

/// How the text of a record begins.
const RECORD_START: &[u8] = br#"{"set":"#;

/// Bytes by which a file of a batch is known.
const START_BYTES: u64 = 1024;

/// What says of a file that it is a project.
#[derive(Deserialize)]
struct ProjectMark {
    format: String,
}

/// Why a batch does not write where such a file lies.
pub(super) fn refusal(path: &Path) -> Error {
    let reason = "a file of this name is there that no batch has written";
    Error::input(path.display(), reason, "Move it away, or choose another folder for the panoramas.")
}

/// Refuses a file at `path` that is not empty, and which `is_own` does not know by its first bytes.
///
/// # Errors
/// [`Error::Input`] for such a file, [`Error::Io`] if it cannot be read.
pub(super) fn refuse_over(path: &Path, is_own: impl FnOnce(&[u8]) -> bool) -> Result<()> {
    if !path.is_file() {
        return Ok(());
    }
    let mut start = Vec::new();
    match File::open(path).and_then(|file| file.take(START_BYTES).read_to_end(&mut start)) {
        Err(error) => Err(Error::io("reading", path, error)),
        Ok(_) if start.is_empty() || is_own(&start) => Ok(()),
        Ok(_) => Err(refusal(path)),
    }
}

/// A file in the `folder` of a set, below the folder `output` of the batch, that is none of its own and may be written
/// over by panoramas of this `extension`; `None` where there is none, and where the folder cannot be read. Only for a
/// folder at which no work was begun without an end: nothing tells what of it that left.
pub(super) fn in_set(folder: &Path, output: &Path, extension: &str) -> Option<PathBuf> {
    let known = SetRecord::read(folder);
    let of_record = folder.join(names::RECORD);
    if known.is_none() && of_record.exists() && !begins_as_record(&of_record) {
        return Some(of_record);
    }
    let entries = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let name = |path: &Path| path.file_name().and_then(|name| name.to_str()).map(str::to_owned).unwrap_or_default();
    let is_ours = |name: &str| names::is_of_set(name) && name != names::CLAIM && name != names::RECORD;
    let mut there: Vec<PathBuf> = entries.filter(|path| is_ours(&name(path)) && path.is_file()).collect();
    there.sort();
    match known {
        // What lay there when the record was written is in it.
        Some(known) => {
            let listed = |path: &Path| known.lists(&path.strip_prefix(output).unwrap_or(path).display().to_string());
            let is_written = |path: &Path| {
                names::is_panorama(&name(path).to_lowercase())
                    && path.extension().is_some_and(|other| other.eq_ignore_ascii_case(extension))
            };
            there.into_iter().find(|path| is_written(path) && !listed(path))
        }
        // A record that was taken away, to have the set made again, leaves projects.
        None if of_record.exists() || there.iter().any(|path| is_project(path)) => None,
        None => there.into_iter().next(),
    }
}

/// Whether a file is a record, whole or cut off.
fn begins_as_record(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(RECORD_START.len() as u64).read_to_end(&mut start));
    read.is_ok() && RECORD_START.starts_with(&start)
}

fn is_project(path: &Path) -> bool {
    let is_json = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"));
    let mark = || serde_json::from_slice::<ProjectMark>(&std::fs::read(path).ok()?).ok();
    is_json && mark().is_some_and(|mark| mark.format == PROJECT_FORMAT)
}
