//! `trueup inspect`: the summary of a project file.

use std::path::Path;

use trueup::{Error, Project, StageContext};

use crate::arguments::InspectArgs;
use crate::failure::Failure;
use crate::output;
use crate::summary;

pub(crate) fn run(args: &InspectArgs) -> Result<(), Failure> {
    let project = read(&args.project)?;
    match args.json {
        true => output::print(&summary::json_of_project(&project)),
        false => output::print(&summary::text(&project, None, args.verbose)),
    }
}

/// Reads a project file.
pub(crate) fn read(path: &Path) -> Result<Project, Error> {
    trueup::read_project(path, &StageContext::default())
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
