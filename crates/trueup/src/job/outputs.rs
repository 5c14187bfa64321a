//! The files that one panorama is written to, and where they may lie.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup_core::{Error, Result};
use trueup_io::encode;
use trueup_io::scratch::check_scratch;

use super::side_outputs::SideOutput;
use crate::options::StitchOptions;

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
        encode::check_writable(&self.panorama, &options.compose.output)?;
        self.beside.iter().try_for_each(|(kind, path)| kind.check(path, options))?;
        match options.run.resources.scratch.as_str() {
            "" => Ok(()),
            scratch => check_scratch(Path::new(scratch)),
        }
    }

    /// Refuses to write over one of the photographs or masks, which may be the only copies. An older panorama in the folder
    /// of the photographs is met here, too.
    pub(crate) fn refuse_inputs<'a>(
        &self,
        photographs: impl IntoIterator<Item = &'a Path>,
        masks: impl IntoIterator<Item = &'a Path>,
    ) -> Result<()> {
        let existing: Vec<(&Path, PathBuf)> =
            self.files().filter_map(|output| Some((output, output.canonicalize().ok()?))).collect();
        let photographs = photographs.into_iter().map(|path| (path, "photographs to be stitched"));
        let masks = masks.into_iter().map(|path| (path, "masks"));
        // Paths are looked up on the disk: most often there is nothing to look up.
        let mut inputs = photographs.chain(masks).filter(|_| !existing.is_empty());
        let found = inputs.find_map(|(input, what)| {
            let input = input.canonicalize().ok()?;
            let (output, _) = existing.iter().find(|(_, existing)| *existing == input)?;
            Some((output.display().to_string(), what))
        });
        match found {
            None => Ok(()),
            Some((output, what)) => Err(Error::input(
                output,
                format!("this file is one of the {what}"),
                "Give the panorama another name or folder, or move an older panorama away from the photographs.",
            )),
        }
    }

    fn files(&self) -> impl Iterator<Item = &Path> {
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
