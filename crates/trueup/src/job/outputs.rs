//! The files that one panorama is written to, and where they may lie.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup_core::{Error, Result};
use trueup_io::scratch::check_scratch;
use trueup_io::{encode, source};

use super::side_outputs::SideOutput;
use crate::options::StitchOptions;

/// What a file is read for that must not be written over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadFile {
    /// A photograph to be stitched.
    Photograph,
    /// A mask of one.
    Mask,
    /// The pairs to be matched.
    Graph,
    /// The project that tells the lens.
    Lens,
    /// The options.
    Configuration,
    /// The record of the panorama that is composed again.
    Project,
}

impl ReadFile {
    fn words(self) -> &'static str {
        match self {
            Self::Photograph => "one of the photographs to be stitched",
            Self::Mask => "one of the masks",
            Self::Graph => "the graph of the photographs",
            Self::Lens => "the project that tells the lens",
            Self::Configuration => "the configuration",
            Self::Project => "the project to be composed",
        }
    }

    fn advice(self) -> &'static str {
        match self {
            Self::Photograph => {
                "Give the panorama another name or folder, or move an older panorama away from the photographs."
            }
            _ => "Give what is written another name or folder.",
        }
    }
}

/// The files that one panorama is written to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outputs {
    /// The panorama's file; its extension chooses the format.
    pub panorama: PathBuf,
    /// What is wanted beside it.
    pub beside: BTreeMap<SideOutput, PathBuf>,
}

impl Outputs {
    /// A panorama's file and nothing beside it.
    pub fn new(panorama: impl Into<PathBuf>) -> Self {
        Self { panorama: panorama.into(), beside: BTreeMap::new() }
    }

    /// The same with another file beside it.
    #[must_use]
    pub fn with(mut self, kind: SideOutput, path: impl Into<PathBuf>) -> Self {
        self.beside.insert(kind, path.into());
        self
    }

    /// Refuses before work starts what could not be written when it is done.
    ///
    /// # Errors
    /// [`Error::Input`], [`Error::Unsupported`] or [`Error::Io`] that names the file.
    pub fn check(&self, options: &StitchOptions) -> Result<()> {
        self.refuse_one_place_for_two()?;
        encode::check_writable(&self.panorama, &options.compose.output)?;
        self.beside.iter().try_for_each(|(kind, path)| kind.check(path, options))?;
        match options.run.resources.scratch.as_str() {
            "" => Ok(()),
            scratch => check_scratch(Path::new(scratch)),
        }
    }

    /// Refuses one place for two of the files, however it is spelled.
    ///
    /// # Errors
    /// [`Error::Input`] that names the place and both flags.
    pub fn refuse_one_place_for_two(&self) -> Result<()> {
        let beside = self.beside.iter().map(|(kind, path)| (kind.flag(), path));
        let wanted: Vec<(&str, &PathBuf)> = std::iter::once(("output", &self.panorama)).chain(beside).collect();
        for (index, (flag, path)) in wanted.iter().enumerate() {
            if let Some((other, _)) = wanted[..index].iter().find(|(_, other)| encode::same_place(other, path)) {
                let reason = format!("it cannot be the file of both --{other} and --{flag}");
                let hint = format!("Give --{other} and --{flag} different names.");
                return Err(Error::input(path.display(), reason, hint));
            }
        }
        Ok(())
    }

    /// Refuses to write over a file that the work reads, which may be the only copy, however it is spelled.
    ///
    /// # Errors
    /// [`Error::Input`] that names the file and what it is.
    pub fn refuse_over<'a>(&self, read: impl IntoIterator<Item = (&'a Path, ReadFile)>) -> Result<()> {
        let existing: Vec<(&Path, PathBuf)> =
            self.files().filter_map(|output| Some((output, output.canonicalize().ok()?))).collect();
        // Paths are looked up on the disk: most often there is nothing to look up.
        let mut read = read.into_iter().filter(|_| !existing.is_empty());
        let found = read.find_map(|(path, what)| {
            let path = path.canonicalize().ok()?;
            let (output, _) = existing.iter().find(|(_, existing)| *existing == path)?;
            Some((output.display().to_string(), what))
        });
        match found {
            None => Ok(()),
            Some((output, what)) => Err(Error::input(output, format!("this file is {}", what.words()), what.advice())),
        }
    }

    /// Whether one of the files is standard output, where nothing else is to be printed then.
    pub fn take_standard_output(&self) -> bool {
        self.files().any(encode::is_standard_output)
    }

    /// Refuses what holds one panorama where there are `count`: a pipe or a device has no second name.
    ///
    /// # Errors
    /// [`Error::Input`] that names it.
    pub(crate) fn refuse_several(&self, count: usize) -> Result<()> {
        match self.files().find(|path| encode::passes_through(path)) {
            Some(path) if count > 1 => Err(Error::input(
                path.display(),
                format!("it takes the files of one panorama, and there are {count}"),
                "Give the name of a file, which is numbered then, or leave --all out.",
            )),
            _ => Ok(()),
        }
    }

    /// Panoramas of an earlier run that stand in the row of numbered ones and that this run, of `count` panoramas, has
    /// not written: `pano-3.jpg` where there are two now. Files that are not by this program end the row.
    pub(crate) fn stale(&self, count: usize) -> Vec<PathBuf> {
        let first = if count > 1 { count + 1 } else { 1 };
        let numbered = (first..).map(|number| self.numbered(Some(number)).panorama);
        numbered.take_while(|path| source::is_own_output(path)).collect()
    }

    /// The panorama's file and those beside it.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.panorama).chain(self.beside.values()).map(PathBuf::as_path)
    }

    /// The files of the panorama with this number, if there are several: `pano-1.jpg`, `pano-2.jpg`.
    #[must_use]
    pub fn numbered(&self, number: Option<usize>) -> Self {
        Self {
            panorama: numbered(&self.panorama, number),
            beside: self.beside.iter().map(|(&kind, path)| (kind, numbered(path, number))).collect(),
        }
    }
}

/// `pano.jpg` becomes `pano-2.jpg`.
fn numbered(path: &Path, number: Option<usize>) -> PathBuf {
    let Some(number) = number else { return path.to_owned() };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{number}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_panoramas_are_numbered_before_the_extension() {
        assert_eq!(numbered(Path::new("out/pano.jpg"), Some(2)), Path::new("out/pano-2.jpg"));
        assert_eq!(numbered(Path::new("pano"), Some(1)), Path::new("pano-1"));
        assert_eq!(numbered(Path::new("pano.jpg"), None), Path::new("pano.jpg"));
    }
}
