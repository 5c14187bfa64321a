//! One set stitched by the command in a process of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use trueup::{CancelToken, Result};

use super::discover::StitchSet;
use crate::child;
use crate::methods::VIEW;

/// What became of a set's process.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MeasuredStitch {
    /// The record it wrote; `None` if it failed.
    pub project: Option<PathBuf>,
    /// The first line of its complaint, if it failed.
    pub complaint: String,
    /// Wall seconds from its start to its end.
    pub seconds: f64,
    /// Its largest resident set, bytes.
    pub peak_bytes: u64,
}

/// Stitches a set and waits for the process. The panorama is removed again.
///
/// # Errors
/// Those of [`child::run`].
pub(super) fn measure(
    command: &Path,
    set: &StitchSet,
    scratch: &Path,
    index: usize,
    cancel: &CancelToken,
) -> Result<MeasuredStitch> {
    let (panorama, project) = (scratch.join("panorama.jpg"), scratch.join(format!("{index}.json")));
    let mut stitch = Command::new(command);
    stitch.arg("stitch").arg(&set.folder).arg("--output").arg(&panorama).arg("--project").arg(&project);
    let ended = child::run(stitch.args(["--set", VIEW]).arg("--quiet"), scratch, cancel)?;
    let written = ended.success && project.is_file();
    let first = ended.complaints.lines().next().unwrap_or("it ended without a word");
    let _ = fs::remove_file(&panorama);
    Ok(MeasuredStitch {
        project: written.then_some(project),
        complaint: if written { String::new() } else { first.trim_start_matches("trueup: error: ").to_owned() },
        seconds: ended.seconds,
        peak_bytes: ended.peak_bytes,
    })
}
