//! `trueup compose`: a recorded panorama once more.

use std::path::Path;

use trueup::{ComposeJob, StitchOptions};

use crate::arguments::ComposeArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::inspect;
use crate::output;
use crate::progress;
use crate::summary;

pub(crate) fn run(args: ComposeArgs) -> Result<(), Failure> {
    let (quiet, verbose) = (args.messages.quiet, args.messages.verbose);
    let (job, options) = checked(args)?;
    let written = progress::shown(quiet, options.stitch.seed, |context| job.run(&options, context))?;
    if quiet { Ok(()) } else { output::print(&summary::of_written(&[written], verbose)) }
}

/// Arguments that make sense: what the library needs.
fn checked(args: ComposeArgs) -> Result<(ComposeJob, StitchOptions), Failure> {
    chosen::check_files(&args.files)?;
    let project = inspect::read(&args.recorded)?;
    project.options.validate()?;
    let options = chosen::options(project.options.clone(), &args.tuning, &args.typed)?;
    let project_folder = args.recorded.parent().unwrap_or(Path::new("")).to_owned();
    let job = ComposeJob {
        project,
        project_folder,
        photographs: args.photos,
        masks: chosen::masks(&args.masks)?,
        output: args.files.output,
        new_project: args.files.project,
        hugin_project: args.files.pto,
        layers: args.files.layers,
        seams: args.files.seams,
        threads: chosen::threads(&args.tuning),
    };
    Ok((job, options))
}
