//! Sets that lie on disk: photographs and what is true of them.

use std::fs;
use std::path::{Path, PathBuf};

use trueup::{Error, Result, Truth};

use super::folders::folders_in;

/// Name of the file that holds what is true of a set.
pub(crate) const TRUTH_FILE: &str = "truth.json";

/// A set that lies on disk.
#[derive(Debug, Clone)]
pub(crate) struct ReadySet {
    /// Its photographs' paths, in order.
    pub photographs: Vec<String>,
    /// What is true of them, if anybody knows.
    pub truth: Option<Truth>,
    /// Stands for its content.
    pub fingerprint: String,
}

/// The set in a folder.
///
/// # Errors
/// Those of [`read_truth`].
pub(super) fn ready(folder: &Path) -> Result<ReadySet> {
    let (truth, text) = read_truth(folder)?;
    let paths: Vec<PathBuf> = truth.images.iter().map(|image| folder.join(&image.file)).collect();
    Ok(ReadySet { photographs: names(&paths), truth: Some(truth), fingerprint: content(&text, &paths) })
}

/// Photographs of which nothing is known but where they are, and what may be true of them.
pub(super) fn ready_photographs(paths: &[PathBuf], truth: Option<Truth>) -> Result<ReadySet> {
    let text =
        serde_json::to_string(&truth).map_err(|error| Error::input("truth", error, "Report this as a defect."))?;
    Ok(ReadySet { photographs: names(paths), truth, fingerprint: content(&text, paths) })
}

fn names(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| path.display().to_string()).collect()
}

/// Stands for photographs and what is said of them.
fn content(text: &str, paths: &[PathBuf]) -> String {
    let size = |path: &PathBuf| fs::metadata(path).map_or(0, |found| found.len());
    let files: Vec<(Option<&std::ffi::OsStr>, u64)> = paths.iter().map(|path| (path.file_name(), size(path))).collect();
    crate::trial::fingerprint(&(text, files))
}

/// A folder's truth and the text it was read from.
pub(crate) fn read_truth(folder: &Path) -> Result<(Truth, String)> {
    let path = folder.join(TRUTH_FILE);
    let text = fs::read_to_string(&path).map_err(|error| Error::io("reading", &path, error))?;
    let hint = "Give the truth.json that was written together with the photographs.";
    let truth: Truth = serde_json::from_str(&text).map_err(|error| Error::input(path.display(), error, hint))?;
    truth.check(&path.display().to_string())?;
    Ok((truth, text))
}

/// The folders inside `parent` that hold a `truth.json`, by name.
///
/// # Errors
/// [`Error::Io`] if it cannot be read; [`Error::Input`] if none holds one.
pub(crate) fn truth_folders(parent: &Path) -> Result<Vec<PathBuf>> {
    let mut folders = folders_in(parent)?;
    folders.retain(|path| path.join(TRUTH_FILE).is_file());
    if folders.is_empty() {
        let hint = "Name a folder whose folders each hold photographs and their truth.json.";
        return Err(Error::input(parent.display(), "no folder in it holds a truth.json", hint));
    }
    Ok(folders)
}
