//! `trueup inspect`: the summary of a project file.

use std::path::Path;

use trueup::{Error, Project};

use crate::arguments::InspectArgs;
use crate::failure::Failure;
use crate::output;
use crate::summary;

pub(crate) fn run(args: &InspectArgs) -> Result<(), Failure> {
    let project = read(&args.project)?;
    output::print(&summary::text(&project, None, args.verbose))
}

/// Reads a project file.
pub(crate) fn read(path: &Path) -> Result<Project, Error> {
    if path.is_dir() {
        return Err(Error::input(
            path.display(),
            "it is a folder",
            "Give a file that `trueup stitch --project` wrote.",
        ));
    }
    let bytes = std::fs::read(path).map_err(|source| Error::Io { action: "reading", path: path.to_owned(), source })?;
    // What is no text is no JSON either; the project's own reader says so.
    let text = String::from_utf8_lossy(&bytes);
    Project::from_json(&text, &path.display().to_string())
}

/// Reads a project file that something is to be made of: options that cannot be are the file's fault.
pub(crate) fn read_to_use(path: &Path) -> Result<Project, Error> {
    let project = read(path)?;
    match project.options.validate() {
        Err(Error::Options(invalid)) => Err(Error::input(
            path.display(),
            format!(
                "an option in it cannot be: {}",
                invalid.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
            ),
            "Give a project file as `trueup stitch --project` wrote it.",
        )),
        checked => checked.map(|()| project),
    }
}
