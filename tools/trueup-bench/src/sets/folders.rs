//! What lies in the folders that a user names.

use std::fs;
use std::path::{Path, PathBuf};

use trueup::{Error, Result, StageContext};
use trueup_core::source::SourceImage;
use trueup_io::source::scan;

/// The photographs in a folder, in the order of their names.
///
/// # Errors
/// [`Error::Input`] if there is none; those of looking for them.
pub(crate) fn photographs_in(folder: &Path, context: &StageContext) -> Result<Vec<SourceImage>> {
    let mut images = scan(&[folder.display().to_string()], &Default::default(), context)?.photographs;
    images.sort_by(|one, other| one.path.cmp(&other.path));
    match images.is_empty() {
        true => Err(Error::input(folder.display(), "there is no photograph in it", "Name a folder of photographs.")),
        false => Ok(images),
    }
}

/// The folders inside one, by name.
///
/// # Errors
/// [`Error::Io`] if it cannot be read.
pub(super) fn folders_in(parent: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(parent).map_err(|error| Error::io("reading the folder", parent, error))?;
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect();
    folders.sort();
    Ok(folders)
}

/// The last part of a path.
pub(crate) fn name_of(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
