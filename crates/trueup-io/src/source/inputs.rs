//! From what the user typed to a list of files.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_core::raster::Photograph;

use crate::formats::{names_photograph, readable_formats};

use super::in_memory::InMemory;
use super::pattern;
use super::rejection::Rejection;

/// A file to look into, or an input that already failed.
#[derive(Debug, Clone)]
pub(crate) enum Candidate {
    /// Named itself.
    File(PathBuf),
    /// Found in a folder or by a pattern.
    Found(PathBuf),
    /// No file: its name, and its pixels.
    InMemory(PathBuf, Arc<Photograph>),
    Rejected(PathBuf, Rejection),
}

impl Candidate {
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::File(path) | Self::Found(path) | Self::InMemory(path, _) | Self::Rejected(path, _) => path,
        }
    }
}

/// Expands files, folders and patterns, in the order given; names of photographs in memory come before files.
pub(crate) fn expand(inputs: &[String], in_memory: &InMemory) -> Vec<Candidate> {
    let expanded = |input: &String| match in_memory.get(input) {
        Some(photograph) => vec![Candidate::InMemory(PathBuf::from(input), photograph.clone())],
        None => expand_one(input),
    };
    inputs.iter().flat_map(expanded).collect()
}

pub(super) fn expand_one(input: &str) -> Vec<Candidate> {
    let path = PathBuf::from(input);
    match std::fs::metadata(&path) {
        Ok(metadata) if metadata.is_dir() => expand_folder(path),
        Ok(_) => vec![Candidate::File(path)],
        Err(_) if input.contains(pattern::WILDCARDS) => expand_pattern(input),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let rejection = Rejection::new("file-missing", "there is no such file or folder", "Check the path.");
            vec![Candidate::Rejected(path, rejection)]
        }
        Err(error) => {
            let reason = format!("it cannot be read ({error})");
            let rejection = Rejection::new("file-unreadable", reason, "Check the path and its permissions.");
            vec![Candidate::Rejected(path, rejection)]
        }
    }
}

/// The photographs directly inside a folder. What cannot be used but was clearly meant as a photograph stays in the
/// list, so that it is rejected by name.
fn expand_folder(folder: PathBuf) -> Vec<Candidate> {
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) => {
            let reason = format!("the folder cannot be read ({error})");
            let rejection = Rejection::new("file-unreadable", reason, "Check the folder's permissions.");
            return vec![Candidate::Rejected(folder, rejection)];
        }
    };
    let files = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| !pattern::is_hidden(path));
    let candidates = photographs_in_natural_order(files);
    if candidates.is_empty() {
        let rejection = Rejection::new(
            "folder-without-pictures",
            format!("the folder holds no {} files", readable_formats()),
            "Folders inside it are not searched; give the folder that holds the photographs.",
        );
        return vec![Candidate::Rejected(folder, rejection)];
    }
    candidates
}

fn expand_pattern(pattern: &str) -> Vec<Candidate> {
    let reject = |code, reason, hint: &str| {
        vec![Candidate::Rejected(PathBuf::from(pattern), Rejection::new(code, reason, hint))]
    };
    let matches = match pattern::matches(pattern) {
        Ok(matches) => matches,
        Err(error) => {
            let reason = format!("there is no such file, and as a pattern it is malformed ({error})");
            return reject("pattern-without-match", reason, "Check the path; a literal [ is written [[] in a pattern.");
        }
    };
    let candidates = photographs_in_natural_order(matches.into_iter());
    if candidates.is_empty() {
        let reason = format!("no {} file matches the pattern", readable_formats());
        return reject(
            "pattern-without-match",
            reason,
            "Check the folder and the pattern; upper and lower case differ.",
        );
    }
    candidates
}

/// Keeps what by its name is a photograph, sorted so that "2.jpg" comes before "10.jpg".
fn photographs_in_natural_order(paths: impl Iterator<Item = PathBuf>) -> Vec<Candidate> {
    let mut paths: Vec<PathBuf> = paths.filter(|path| names_photograph(path)).collect();
    paths.sort_by(|a, b| natural_order(a, b));
    paths.into_iter().map(Candidate::Found).collect()
}

/// Natural order without regard to case. Ties fall back to the bytes, so that the order never depends on the file
/// system.
pub fn natural_order(a: &Path, b: &Path) -> Ordering {
    let (a_text, b_text) = (a.to_string_lossy(), b.to_string_lossy());
    natord::compare_ignore_case(&a_text, &b_text).then_with(|| a.cmp(b))
}
