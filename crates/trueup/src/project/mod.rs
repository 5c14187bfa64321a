//! The record of a stitch: what it holds, how it is filled, read again, and what else is made from it.

mod check;
pub(crate) mod fill;
pub(crate) mod hugin;
pub(crate) mod level;
pub(crate) mod paths;
pub(crate) mod projection;
pub(crate) mod provenance;
pub(crate) mod read;
pub(crate) mod record;
pub(crate) mod replace;

use std::path::Path;

pub use hugin::{HuginImage, HuginProject, hugin_project};
pub use level::{LevelRecord, LineGuide, ManhattanRecord};
pub use projection::ProjectionRecord;
pub use record::{
    Canvas, CropRecord, FlatSceneRecord, ImageRecord, ImageStatus, MaskKind, MaskRecord, MeshRecord, PROJECT_FORMAT,
    PROJECT_VERSION, PairRecord, Project, StackMemberRecord,
};
use trueup_core::{Error, Result, StageContext};

/// The panorama that a file describes: a project as a stitch wrote it, or one of Hugin's (`.pto`), whose photographs
/// are looked for as [`HuginProject::project`] says.
///
/// # Errors
/// [`Error::Io`] if it cannot be read; [`Error::Input`] if it is neither, or damaged; those of
/// [`HuginProject::project`].
pub fn read_project(path: &Path, context: &StageContext) -> Result<Project> {
    let file = path.display().to_string();
    if path.is_dir() {
        return Err(Error::input(file, "it is a folder", "Give a file that `trueup stitch --project` wrote."));
    }
    let bytes = trueup_io::text::read(path).map_err(|error| Error::io("reading", path, error))?;
    // What is no text is no project either; the readers say so.
    let text = String::from_utf8_lossy(&bytes);
    if !HuginProject::is_one(&text, path) {
        return Project::from_json(&text, &file);
    }
    HuginProject::parse(&text, &file)?.project(path.parent().unwrap_or(Path::new("")), context)
}
