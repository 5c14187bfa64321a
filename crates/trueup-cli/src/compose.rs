//! `trueup compose`: a recorded panorama once more.

use std::path::Path;

use trueup::{ComposeJob, StageContext, StitchOptions};

use crate::arguments::ComposeArgs;
use crate::failure::Failure;
use crate::inspect;
use crate::output;
use crate::progress::Bars;
use crate::stitch::{check_files, chosen_masks, chosen_options, picture_flags, summaries};

pub(crate) fn run(args: ComposeArgs) -> Result<(), Failure> {
    let (quiet, verbose) = (args.quiet, args.verbose);
    let (job, options) = checked(args)?;
    let cancel = crate::cancel_token();
    let bars = Bars::new(quiet);
    let context = StageContext::new(&bars, &cancel, options.stitch.seed);
    let written = job.run(&options, &context);
    bars.clear();
    let written = written?;
    if quiet { Ok(()) } else { output::print(&summaries(&[written], verbose)) }
}

/// Arguments that make sense: what the library needs.
fn checked(args: ComposeArgs) -> Result<(ComposeJob, StitchOptions), Failure> {
    check_files(&args.output, args.project.as_ref(), &args.picture)?;
    let project = inspect::read(&args.recorded)?;
    project.options.validate()?;
    let flags = picture_flags(&args.picture, &args.budget);
    let options = chosen_options(project.options.clone(), args.config.as_deref(), &args.set, &flags)?;
    let project_folder = args.recorded.parent().unwrap_or(Path::new("")).to_owned();
    let job = ComposeJob {
        project,
        project_folder,
        photographs: args.photos,
        masks: chosen_masks(&args.mask, &args.keep)?,
        output: args.output,
        new_project: args.project,
        hugin_project: args.picture.pto,
        layers: args.picture.layers,
        seams: args.picture.seams,
        threads: args.threads.map_or(0, usize::from),
    };
    Ok((job, options))
}
