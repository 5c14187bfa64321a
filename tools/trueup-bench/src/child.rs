//! A program run in a process of its own, so that time and memory are its alone.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use trueup::{CancelToken, Error, Result};
use wait4::Wait4;

/// How a process ended, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EndedChild {
    /// Whether its exit status was 0.
    pub success: bool,
    /// What it wrote to standard error.
    pub complaints: String,
    /// Wall seconds from its start to its end.
    pub seconds: f64,
    /// Seconds of all its processors together, its own and the system's for it.
    pub cpu_seconds: f64,
    /// Its largest resident set, bytes.
    pub peak_bytes: u64,
}

/// How often a running process is looked after.
const POLL: Duration = Duration::from_millis(2);

/// Runs a program and waits for its end. It reads nothing; what it prints is dropped, what it complains of goes by way
/// of a file in the folder `scratch`.
///
/// # Errors
/// [`Error::Io`] if it cannot be started; [`Error::Cancelled`], after it was ended.
pub(crate) fn run(command: &mut Command, scratch: &Path, cancel: &CancelToken) -> Result<EndedChild> {
    let complaints = scratch.join("complaints.txt");
    let stderr = File::create(&complaints).map_err(|error| Error::io("writing", &complaints, error))?;
    let program = Path::new(command.get_program()).to_owned();
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(|error| Error::io("starting", &program, error))?;
    let ended = loop {
        let looked = child.try_wait4().map_err(|error| Error::io("waiting for", &program, error))?;
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
    Ok(EndedChild {
        success: ended.status.success(),
        complaints: fs::read_to_string(&complaints).unwrap_or_default(),
        seconds: start.elapsed().as_secs_f64(),
        cpu_seconds: (ended.rusage.utime + ended.rusage.stime).as_secs_f64(),
        peak_bytes: ended.rusage.maxrss,
    })
}

/// The `trueup` command that is given, or the one beside this program.
///
/// # Errors
/// [`Error::Input`] if there is none.
pub(crate) fn find_trueup(given: Option<&Path>) -> Result<PathBuf> {
    let hint = "Build it with `cargo build --release`, or name it with --trueup.";
    let path = match given {
        Some(path) => path.to_owned(),
        None => {
            let own =
                std::env::current_exe().map_err(|error| Error::io("finding", Path::new("trueup-bench"), error))?;
            own.with_file_name(format!("trueup{}", std::env::consts::EXE_SUFFIX))
        }
    };
    if path.is_file() { Ok(path) } else { Err(Error::input(path.display(), "there is no such program", hint)) }
}

/// A folder for what programs write, removed in the end.
pub(crate) struct ScratchFolder(PathBuf);

impl ScratchFolder {
    /// A new one among the system's temporary files.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("trueup-bench-{}", std::process::id()));
        fs::create_dir_all(&path).map_err(|error| Error::io("making the folder", &path, error))?;
        Ok(Self(path))
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        // Nothing depends on it, and the system clears its folder of temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_process_is_measured_by_itself() {
        let scratch = ScratchFolder::new().expect("a folder");
        let cancel = CancelToken::default();
        let busy = "i=0; while [ $i -lt 20000 ]; do i=$((i+1)); done; echo tired >&2; exit 3";
        let ended = run(Command::new("sh").args(["-c", busy]), scratch.path(), &cancel).expect("a shell");
        assert!(!ended.success && ended.complaints == "tired\n");
        assert!(ended.cpu_seconds > 0.0 && ended.peak_bytes > 0);
        cancel.cancel();
        let slept = run(Command::new("sleep").arg("60"), scratch.path(), &cancel);
        assert!(matches!(slept, Err(Error::Cancelled)));
        let nothing = run(&mut Command::new("/no/such/program"), scratch.path(), &CancelToken::default());
        assert!(matches!(nothing, Err(Error::Io { .. })));
    }
}
