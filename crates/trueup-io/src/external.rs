//! Programs that are started to read what trueup does not: with nothing but the file, and ended when the work is
//! cancelled.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use trueup_core::{Error, Result, StageContext};

/// Bytes of what a program says that are kept; the last line is told.
const SAID_BYTES: u64 = 1 << 16;

/// How often it is looked whether a program has ended.
const LOOK: std::time::Duration = std::time::Duration::from_millis(20);

/// A program at work; ended when this is dropped.
pub(crate) struct Running {
    subject: PathBuf,
    child: Child,
    /// What it writes, where that was asked for as a pipe.
    pub(crate) output: Option<ChildStdout>,
    /// What it says of what is wrong.
    said: Option<JoinHandle<String>>,
}

impl Running {
    /// Starts `command` over the file `subject`; without a terminal, and with its complaints kept.
    ///
    /// # Errors
    /// That of `not_installed` where there is no such program; [`Error::Io`].
    pub(crate) fn start(subject: &Path, mut command: Command, not_installed: impl FnOnce() -> Error) -> Result<Self> {
        let name = command.get_program().to_string_lossy().into_owned();
        command.stdin(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => not_installed(),
            _ => Error::input(
                subject.display(),
                format!("{name} cannot be started for it ({error})"),
                format!("Install {name} anew."),
            ),
        })?;
        let (output, said) = (child.stdout.take(), child.stderr.take());
        let mut running = Self { subject: subject.to_owned(), child, output, said: None };
        if let Some(mut stderr) = said {
            // Read beside the output: who writes more than a pipe holds waits until it is read.
            let read = move || {
                let mut text = Vec::new();
                let _ = stderr.by_ref().take(SAID_BYTES).read_to_end(&mut text);
                let _ = std::io::copy(&mut stderr, &mut std::io::sink());
                String::from_utf8_lossy(&text).into_owned()
            };
            let reader = thread::Builder::new().spawn(read).map_err(|error| Error::io("reading", subject, error))?;
            running.said = Some(reader);
        }
        Ok(running)
    }

    /// Waits for its end, or for that of the work.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::Io`].
    pub(crate) fn wait_unless_cancelled(&mut self, context: &StageContext) -> Result<()> {
        let io = |error| Error::io("reading", &self.subject, error);
        while self.child.try_wait().map_err(io)?.is_none() {
            context.check_cancelled()?;
            thread::sleep(LOOK);
        }
        Ok(())
    }

    /// Waits for its end; whether that was a good one.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn wait(&mut self) -> Result<bool> {
        let status = self.child.wait().map_err(|error| Error::io("reading", &self.subject, error))?;
        Ok(status.success())
    }

    /// The last line that it said, when it has ended.
    pub(crate) fn last_words(&mut self) -> Option<String> {
        self.lines_said().pop()
    }

    /// What it said, when it has ended, without empty lines; nothing the second time.
    pub(crate) fn lines_said(&mut self) -> Vec<String> {
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        said.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
