//! The files that one panorama is written to, and where they may lie.

use std::path::{Path, PathBuf};

use trueup_core::{Error, Result};
use trueup_io::encode;
use trueup_io::scratch::check_scratch;

use crate::by_hand::no_seams;
use crate::options::StitchOptions;

/// The files that one panorama is written to; all but the first if wanted.
#[derive(Debug, Clone)]
pub(crate) struct Outputs {
    pub panorama: PathBuf,
    pub project: Option<PathBuf>,
    pub hugin_project: Option<PathBuf>,
    pub layers: Option<PathBuf>,
    pub seams: Option<PathBuf>,
}

impl Outputs {
    /// Refuses before work starts what could not be written when it is done.
    pub fn check(&self, options: &StitchOptions) -> Result<()> {
        encode::check_writable(&self.panorama, &options.output)?;
        if let Some(layers) = &self.layers {
            encode::check_layers_place(layers)?;
        }
        if let Some(seams) = &self.seams {
            encode::check_labels_place(seams)?;
            if !options.render.blend.has_seams() {
                return Err(no_seams());
            }
        }
        [&self.project, &self.hugin_project].into_iter().flatten().try_for_each(|side| encode::check_place(side))?;
        match options.stitch.scratch.as_str() {
            "" => Ok(()),
            scratch => check_scratch(Path::new(scratch)),
        }
    }

    /// Refuses to write over one of the photographs or masks, which may be the only copies. An older panorama in the folder
    /// of the photographs is met here, too.
    pub fn spare<'a>(
        &self,
        photographs: impl IntoIterator<Item = &'a Path>,
        masks: impl IntoIterator<Item = &'a Path>,
    ) -> Result<()> {
        let existing: Vec<(&Path, PathBuf)> =
            self.files().filter_map(|output| Some((output, output.canonicalize().ok()?))).collect();
        let photographs = photographs.into_iter().map(|path| (path, "photographs to be stitched"));
        let masks = masks.into_iter().map(|path| (path, "masks"));
        // Paths are looked up on the disk: most often there is nothing to look up.
        let mut spared = photographs.chain(masks).filter(|_| !existing.is_empty());
        let found = spared.find_map(|(spared, what)| {
            let spared = spared.canonicalize().ok()?;
            let (output, _) = existing.iter().find(|(_, existing)| *existing == spared)?;
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
        let sides = [&self.project, &self.hugin_project, &self.layers, &self.seams];
        std::iter::once(&self.panorama).chain(sides.into_iter().flatten()).map(PathBuf::as_path)
    }

    /// The files of the panorama with this number, if there are several.
    pub fn numbered(self, number: Option<usize>) -> Self {
        let side = |path: Option<PathBuf>| path.map(|path| numbered(&path, number));
        Self {
            panorama: numbered(&self.panorama, number),
            project: side(self.project),
            hugin_project: side(self.hugin_project),
            layers: side(self.layers),
            seams: side(self.seams),
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
