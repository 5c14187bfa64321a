//! Sets of photographs that somebody took, of which nothing is known.

use std::fs;
use std::path::{Path, PathBuf};

use trueup::{Error, Result, StageContext};
use trueup_core::source::SourceImage;
use trueup_io::source::scan;

use super::spec::SetSpec;

/// The photographs in a folder, in the order of their names.
///
/// # Errors
/// [`Error::Input`] if there is none; those of looking for them.
pub(super) fn found(folder: &Path, context: &StageContext) -> Result<Vec<SourceImage>> {
    let mut images = scan(&[folder.display().to_string()], &Default::default(), context)?.photographs;
    images.sort_by(|one, other| one.path.cmp(&other.path));
    match images.is_empty() {
        true => Err(Error::input(folder.display(), "there is no photograph in it", "Name a folder of photographs.")),
        false => Ok(images),
    }
}

/// Sets named `group/FOLDER`: each of `folders` is one if it holds photographs itself, else those inside it are that do.
///
/// # Errors
/// [`Error::Io`] for folders that cannot be read; [`Error::Input`] for one without photographs, or two sets of one name.
pub(super) fn sets(group: &str, folders: &[PathBuf]) -> Result<Vec<SetSpec>> {
    let context = StageContext::default();
    let holds = |folder: &Path| found(folder, &context).is_ok();
    let mut sets: Vec<SetSpec> = Vec::new();
    for folder in folders {
        let inside = if holds(folder) { vec![folder.clone()] } else { folders_in(folder)? };
        let inside: Vec<PathBuf> = inside.into_iter().filter(|path| holds(path)).collect();
        if inside.is_empty() {
            let hint = "Name folders of photographs, or a folder of such folders.";
            return Err(Error::input(folder.display(), "neither it nor a folder in it holds photographs", hint));
        }
        for path in inside {
            let name = format!("{group}/{}", path.file_name().unwrap_or_default().to_string_lossy());
            if sets.iter().any(|known| known.name == name) {
                let hint = "Give the folders of sets names of their own.";
                return Err(Error::input(path.display(), "there are two sets of this name", hint));
            }
            sets.push(SetSpec::photographs(name, path));
        }
    }
    Ok(sets)
}

/// The folders inside one, by name.
fn folders_in(parent: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(parent).map_err(|error| Error::io("reading the folder", parent, error))?;
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect();
    folders.sort();
    Ok(folders)
}
