//! `trueup compose`: a recorded panorama once more.

use std::path::Path;

use trueup::{ComposeJob, Outputs, ReadFile, SideOutput, StitchOptions};

use crate::arguments::ComposeArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::inspect;
use crate::outcome;
use crate::progress;
use crate::report::ReportBeside;
use crate::summary::Measured;

pub(crate) fn run(args: ComposeArgs) -> Result<(), Failure> {
    let messages = args.messages.clone();
    let report = ReportBeside { file: args.files.report.clone(), threads: chosen::threads(&args.tuning) };
    let (job, options) = checked(args)?;
    report.check(&job.outputs)?;
    let takes_output = job.outputs.take_standard_output();
    let written = progress::shown(messages.quiet, |context| {
        let written = [job.run(&options, context)?];
        report.write(&written, context).map(|()| written)
    })?;
    outcome::tell(&written, &messages, takes_output, Measured::Stitched)
}

/// Arguments that make sense: what the library needs.
fn checked(args: ComposeArgs) -> Result<(ComposeJob, StitchOptions), Failure> {
    let outputs = chosen::outputs(args.files);
    chosen::check_files(&outputs, chosen::configuration(&args.tuning))?;
    refuse_over_project(&outputs, &args.recorded)?;
    let mut project = inspect::read_to_use(&args.recorded)?;
    if args.relight {
        project.forget_light();
    }
    let options = chosen::options(project.options.clone(), &args.tuning, &args.typed)?;
    let project_folder = args.recorded.parent().unwrap_or(Path::new("")).to_owned();
    let job = ComposeJob {
        project,
        project_folder,
        photographs: args.photos,
        masks: chosen::masks(&args.masks)?,
        outputs,
        threads: chosen::threads(&args.tuning),
    };
    Ok((job, options))
}

/// Refuses to write over the project that is composed anything but a project, which is the new panorama's record.
fn refuse_over_project(outputs: &Outputs, recorded: &Path) -> Result<(), Failure> {
    let mut others = outputs.clone();
    others.beside.remove(&SideOutput::Project);
    Ok(others.refuse_over([(recorded, ReadFile::Project)])?)
}
