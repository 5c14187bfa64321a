//! One set stitched by the command in a process of its own, so that time and memory are the stitch's alone.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use trueup::{CancelToken, Error, Result};
use wait4::Wait4;

use super::discover::StitchSet;
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

/// How often a running process is looked after.
const POLL: Duration = Duration::from_millis(2);

/// Stitches a set and waits for the process. The panorama is removed again.
///
/// # Errors
/// [`Error::Io`] if the command cannot be started; [`Error::Cancelled`], after the process was ended.
pub(super) fn measure(
    command: &Path,
    set: &StitchSet,
    scratch: &Path,
    index: usize,
    cancel: &CancelToken,
) -> Result<MeasuredStitch> {
    let (panorama, project) = (scratch.join("panorama.jpg"), scratch.join(format!("{index}.json")));
    let complaints = scratch.join("complaints.txt");
    let stderr = File::create(&complaints).map_err(|error| Error::io("writing", &complaints, error))?;
    let start = Instant::now();
    let mut child = Command::new(command)
        .arg("stitch")
        .arg(&set.folder)
        .arg("--output")
        .arg(&panorama)
        .arg("--project")
        .arg(&project)
        .args(["--set", VIEW])
        .arg("--quiet")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(|error| Error::io("starting", command, error))?;
    let ended = loop {
        let looked = child.try_wait4().map_err(|error| Error::io("waiting for", command, error))?;
        if let Some(ended) = looked {
            break ended;
        }
        if cancel.is_cancelled() {
            // It may have got the same Ctrl-C, and be gone already.
            let _ = child.kill();
            let _ = child.wait();
            return Err(Error::Cancelled);
        }
        std::thread::sleep(POLL);
    };
    let seconds = start.elapsed().as_secs_f64();
    let written = ended.status.success() && project.is_file();
    let complaint = fs::read_to_string(&complaints).unwrap_or_default();
    let first = complaint.lines().next().unwrap_or("it ended without a word");
    let _ = fs::remove_file(&panorama);
    Ok(MeasuredStitch {
        project: written.then_some(project),
        complaint: if written { String::new() } else { first.trim_start_matches("trueup: error: ").to_owned() },
        seconds,
        peak_bytes: ended.rusage.maxrss,
    })
}
