//! `trueup stitch`: from arguments to a checked job, from the job's result to the summary.

use trueup::{Inputs, StitchJob, StitchOptions};

use crate::arguments::StitchArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::outcome;
use crate::progress;
use crate::report::ReportBeside;
use crate::summary::Measured;

pub(crate) fn run(args: StitchArgs) -> Result<(), Failure> {
    let messages = args.messages.clone();
    let CheckedStitch { job, options, report } = CheckedStitch::new(args)?;
    let takes_output = job.outputs.take_standard_output();
    let written = progress::shown(messages.quiet, |context| {
        let written = job.run(&options, context)?;
        report.write(&written, context).map(|()| written)
    })?;
    outcome::tell(&written, &messages, takes_output, Measured::Shown)
}

/// Arguments that make sense: what the library needs.
struct CheckedStitch {
    job: StitchJob,
    options: StitchOptions,
    report: ReportBeside,
}

impl CheckedStitch {
    fn new(args: StitchArgs) -> Result<Self, Failure> {
        let StitchArgs { photographs, files, geometry, .. } = args;
        let options = chosen::options(StitchOptions::default(), &args.tuning, &args.typed)?;
        let report = ReportBeside { file: files.report.clone(), threads: chosen::threads(&args.tuning) };
        let outputs = chosen::outputs(files);
        chosen::check_files(&outputs, chosen::configuration(&args.tuning))?;
        report.check(&outputs)?;
        let inputs = Inputs {
            photographs,
            reference: chosen::reference(geometry.reference),
            graph: geometry.graph,
            lens_from: geometry.lens_from,
            all: args.all,
            masks: chosen::masks(&args.masks)?,
            require_all: geometry.require_all,
            ..Inputs::default()
        };
        let job = StitchJob { inputs, outputs, cache: geometry.cache, threads: chosen::threads(&args.tuning) };
        Ok(Self { job, options, report })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::{CommandLine, Task};

    fn checked(arguments: &[&str]) -> Result<CheckedStitch, Failure> {
        let all = ["trueup", "stitch", "a.jpg", "-o", "p.jpg"].iter().chain(arguments);
        match CommandLine::try_parse_from(all).expect("arguments of the right form").task {
            Task::Stitch(args) => CheckedStitch::new(*args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn flags_overrule_set_and_set_overrules_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("c.toml");
        std::fs::write(&file, "[canvas]\nscale = 0.5\n[random]\nseed = 3\n[output]\njpeg_quality = 70\n")
            .expect("written");
        let config = file.to_str().expect("UTF-8");
        let given = ["--config", config, "--scale", "2", "--set", "canvas.scale=0.25", "--set", "random.seed=4"];
        let options = checked(&given).map(|checked| checked.options).expect("valid");
        assert_eq!(
            (options.arrange.canvas.scale, options.matching.random.seed, options.compose.output.jpeg_quality),
            (2.0, 4, 70)
        );
    }

    #[test]
    fn without_flags_every_option_has_its_default() {
        let CheckedStitch { job, options, .. } = checked(&["--reference", "auto"]).expect("valid");
        assert_eq!(options, StitchOptions::default());
        assert_eq!(job.inputs, Inputs::new(["a.jpg"]));
        assert_eq!(job.threads, 0);
    }

    #[test]
    fn every_wrong_value_is_listed() {
        let failure = checked(&["--scale", "-1", "--seed", "x", "--set", "mesh.cell=3"]).err().expect("three mistakes");
        let text = failure.to_string();
        for part in ["3 options", "canvas.scale = -1 (allowed: ", "--seed x: ", "no option \"mesh.cell\""] {
            assert!(text.contains(part), "{text}");
        }
    }
}
