//! Camera raw, which programs develop that are installed: each maker codes it in ways of his own.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use trueup_core::{Error, Result, StageContext};

use crate::external::Running;
use crate::formats;

/// A program that develops camera raw.
#[derive(Debug)]
pub struct Developer {
    program: &'static str,
    /// What makes it write, to standard output, a TIFF of 16 bits in sRGB, upright, with gray as the camera took it to
    /// be, and as bright as the numbers say: photographs of one exposure stay alike.
    arguments: &'static [&'static str],
}

/// The programs, the one that knows newer cameras first. Both take what they are told in the same words: white balance
/// of the camera, no brightening of their own, 16 bits, TIFF, and the power and slope of sRGB's curve.
///
/// # Source
/// The usage that they print: LibRaw's sample 0.20 (`-Z -` is standard output), dcraw 9.28 (`-c` is).
static DEVELOPERS: [Developer; 2] = [
    Developer { program: "dcraw_emu", arguments: &["-w", "-W", "-6", "-T", "-g", "2.4", "12.92", "-Z", "-"] },
    Developer { program: "dcraw", arguments: &["-w", "-W", "-6", "-T", "-g", "2.4", "12.92", "-c"] },
];

impl Developer {
    /// The first of the known programs that is installed.
    pub fn installed() -> Option<&'static Self> {
        let path = std::env::var_os("PATH")?;
        let is_there = |developer: &&Self| {
            let name = format!("{}{}", developer.program, std::env::consts::EXE_SUFFIX);
            std::env::split_paths(&path).any(|folder| folder.join(&name).is_file())
        };
        DEVELOPERS.iter().find(is_there)
    }

    /// What the program is called.
    pub fn name(&self) -> &'static str {
        self.program
    }

    /// Develops the camera raw `raw` into a new file `developed`, a TIFF.
    ///
    /// # Errors
    /// [`Error::Input`] with the program's words if it cannot; [`Error::Io`] if there can be no such file;
    /// [`Error::Cancelled`].
    pub fn develop(&self, raw: &Path, developed: &Path, context: &StageContext) -> Result<()> {
        let io = |error| Error::io("writing", developed, error);
        // A path from the root on is no option.
        let path = raw.canonicalize().map_err(|error| Error::io("reading", raw, error))?;
        let mut command = Command::new(self.program);
        command.args(self.arguments).arg(path).stdout(Stdio::from(File::create_new(developed).map_err(io)?));
        let failed = |reason: &str| {
            Error::input(
                raw.display(),
                format!(
                    "it is a camera raw photograph, and {} cannot develop it ({})",
                    self.program,
                    reason.escape_debug()
                ),
                "Develop it by another program and give what that makes.",
            )
        };
        let mut running = Running::start(raw, command, || failed("it is not installed"))?;
        running.wait_unless_cancelled(context)?;
        let is_good = running.wait()?;
        let words = running.last_words();
        // Its status tells nothing of files that it could not read.
        let recognized = File::open(developed).and_then(|mut file| formats::recognize(&mut file)).map_err(io)?;
        match recognized {
            Some(_) if is_good => Ok(()),
            _ => Err(failed(words.as_deref().unwrap_or("it says nothing of why"))),
        }
    }
}
