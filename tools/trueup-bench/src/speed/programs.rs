//! The stitchers that are timed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use trueup::{CancelToken, Result};

use crate::child::{self, EndedChild};

/// A stitcher.
#[derive(Debug, Clone)]
pub(super) enum Program {
    /// This project's command.
    Trueup(PathBuf),
    /// OpenCV's `Stitcher`, in this Python.
    OpenCv(PathBuf),
    /// Hugin's programs, one after the other as its own assistant runs them.
    Hugin,
}

/// What one stitch took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Taken {
    /// Seconds of the clock.
    pub seconds: f64,
    /// Seconds of all processors together.
    pub cpu_seconds: f64,
    /// The largest resident set of a process, bytes.
    pub peak_bytes: u64,
    /// Whether there was a panorama.
    pub stitched: bool,
}

/// OpenCV's stitcher as its documentation uses it: the panorama's place, then the photographs.
const BY_OPENCV: &str = "\
import sys, cv2
status, panorama = cv2.Stitcher_create().stitch([cv2.imread(path) for path in sys.argv[2:]])
if status != cv2.Stitcher_OK:
    sys.exit(f'status {status}')
cv2.imwrite(sys.argv[1], panorama)
";

impl Program {
    /// What it is called in the table.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Trueup(_) => "trueup",
            Self::OpenCv(_) => "OpenCV",
            Self::Hugin => "Hugin",
        }
    }

    /// Whether it can be run.
    pub(super) fn is_installed(&self, scratch: &Path, cancel: &CancelToken) -> bool {
        let mut asked = match self {
            Self::Trueup(command) => Command::new(command),
            Self::OpenCv(python) => Command::new(python),
            Self::Hugin => Command::new("hugin_executor"),
        };
        match self {
            Self::OpenCv(_) => asked.args(["-c", "import cv2; cv2.Stitcher_create()"]),
            Self::Trueup(_) | Self::Hugin => asked.arg("--help"),
        };
        child::run(&mut asked, scratch, cancel).is_ok_and(|ended| ended.success)
    }

    /// Stitches photographs to a JPEG file, which is removed again.
    ///
    /// # Errors
    /// Those of [`child::run`].
    pub(super) fn stitch(&self, photographs: &[PathBuf], scratch: &Path, cancel: &CancelToken) -> Result<Taken> {
        let panorama = scratch.join("panorama.jpg");
        let mut taken = Taken { seconds: 0.0, cpu_seconds: 0.0, peak_bytes: 0, stitched: true };
        for mut step in self.steps(photographs, &panorama, scratch) {
            let EndedChild { success, seconds, cpu_seconds, peak_bytes, .. } = child::run(&mut step, scratch, cancel)?;
            taken.seconds += seconds;
            taken.cpu_seconds += cpu_seconds;
            taken.peak_bytes = taken.peak_bytes.max(peak_bytes);
            taken.stitched &= success;
            if !success {
                break;
            }
        }
        // A program may say that all went well, and have written nothing.
        taken.stitched &= fs::remove_file(&panorama).is_ok();
        Ok(taken)
    }

    /// The commands it takes.
    fn steps(&self, photographs: &[PathBuf], panorama: &Path, scratch: &Path) -> Vec<Command> {
        match self {
            Self::Trueup(trueup) => {
                let mut stitch = Command::new(trueup);
                stitch.arg("stitch").args(photographs).arg("--output").arg(panorama).arg("--quiet");
                vec![stitch]
            }
            Self::OpenCv(python) => {
                let mut stitch = Command::new(python);
                stitch.args(["-c", BY_OPENCV]).arg(panorama).args(photographs);
                vec![stitch]
            }
            Self::Hugin => {
                let project = scratch.join("project.pto");
                let mut new = Command::new("pto_gen");
                new.arg("-o").arg(&project).args(photographs);
                let mut assistant = Command::new("hugin_executor");
                assistant.arg("--assistant").arg(&project);
                let mut format = Command::new("pano_modify");
                format.args(["--ldr-file=JPG", "-o"]).arg(&project).arg(&project);
                let mut stitch = Command::new("hugin_executor");
                stitch.arg("--stitching").arg("--prefix").arg(panorama.with_extension("")).arg(&project);
                vec![new, assistant, format, stitch]
            }
        }
    }
}
