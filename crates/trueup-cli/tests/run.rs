//! Runs the built command.

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// What a run of the command left behind.
pub(crate) struct FinishedRun {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl FinishedRun {
    /// Fails the test unless the run ended with `status` and standard error holds every one of `parts`.
    #[track_caller]
    pub(crate) fn expect_failure(&self, status: i32, parts: &[&str]) {
        assert_eq!(self.status, status, "stdout:\n{}stderr:\n{}", self.stdout, self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "\"{part}\" is not in\n{}", self.stderr);
        }
        assert_eq!(self.stdout, "", "a failure prints nothing on standard output");
        if status == 1 {
            assert_eq!(self.stderr.matches("trueup: error: ").count(), 1, "an error is told once:\n{}", self.stderr);
        }
    }

    /// Fails the test unless the run succeeded without a word on standard error; returns standard output.
    #[track_caller]
    pub(crate) fn expect_success(&self) -> &str {
        assert_eq!((self.status, self.stderr.as_str()), (0, ""), "stdout:\n{}", self.stdout);
        &self.stdout
    }
}

/// The command, to be run in `folder` with these arguments.
pub(crate) fn trueup(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueup"));
    command.current_dir(folder).args(arguments);
    command
}

/// Runs a command to its end.
#[track_caller]
pub(crate) fn finish(mut command: Command) -> FinishedRun {
    let output = command.output().expect("the command starts");
    FinishedRun {
        status: output.status.code().expect("the command ends by itself"),
        stdout: String::from_utf8(output.stdout).expect("UTF-8"),
        stderr: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

/// A folder to run the command in; removed with everything in it.
pub(crate) struct Desk(TempDir);

impl Desk {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder for the test"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn join(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.join(name), bytes).expect("written");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).expect("valid JSON")
    }

    /// Names of all files in the folder, sorted.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path()).expect("readable");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// `trueup stitch ARGUMENTS -o pano.jpg`, at a small scale that keeps tests quick.
    #[track_caller]
    pub(crate) fn stitch(&self, arguments: &[&str]) -> FinishedRun {
        let all = [&["stitch", "-o", "pano.jpg", "--scale", "0.5"], arguments].concat();
        finish(trueup(self.path(), &all))
    }
}
