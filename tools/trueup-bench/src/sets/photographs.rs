//! Sets of photographs that somebody took, of which nothing is known.

use std::path::{Path, PathBuf};

use trueup::{Error, Result, StageContext};

use super::folders::{folders_in, name_of, photographs_in};
use super::spec::{SetSpec, refuse_known};

/// Sets named `group/FOLDER`: each of `folders` is one if it holds photographs itself, else those inside it are that
/// do.
///
/// # Errors
/// [`Error::Io`] for folders that cannot be read; [`Error::Input`] for one without photographs, or two sets of one
/// name.
pub(super) fn sets(group: &str, folders: &[PathBuf]) -> Result<Vec<SetSpec>> {
    let context = StageContext::default();
    let holds = |folder: &Path| photographs_in(folder, &context).is_ok();
    let mut sets: Vec<SetSpec> = Vec::new();
    for folder in folders {
        let inside: Vec<PathBuf> = match holds(folder) {
            true => vec![folder.clone()],
            false => folders_in(folder)?.into_iter().filter(|path| holds(path)).collect(),
        };
        if inside.is_empty() {
            let hint = "Name folders of photographs, or a folder of such folders.";
            return Err(Error::input(folder.display(), "neither it nor a folder in it holds photographs", hint));
        }
        for path in inside {
            let name = format!("{group}/{}", name_of(&path));
            refuse_known(&sets, &name, &path)?;
            sets.push(SetSpec::photographs(name, path));
        }
    }
    Ok(sets)
}
