//! Where the files are whose paths a project records.

use std::path::{Path, PathBuf};

/// The name of the file that a recorded path ends in, whatever system wrote it.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Where the file of a recorded path is: beside the project file as recorded, from the current folder, or beside the
/// project file by its name alone; `None` if it is at none of these places.
pub(crate) fn place_of(recorded: &str, project_folder: &Path) -> Option<PathBuf> {
    let path = Path::new(recorded);
    let places = [project_folder.join(path), path.to_owned(), project_folder.join(file_name(recorded))];
    places.into_iter().find(|path| path.is_file())
}
