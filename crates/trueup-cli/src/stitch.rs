//! `trueup stitch`: from arguments to a checked job, from the job's result to the summary.

use std::path::{Path, PathBuf};

use trueup::{Error, Inputs, MaskFile, MaskKind, Reference, StageContext, StitchJob, StitchOptions, Written};

use crate::arguments::{BudgetArgs, PictureArgs, StitchArgs};
use crate::failure::Failure;
use crate::output;
use crate::progress::Bars;
use crate::summary::{self, PanoramaFile};

/// The word that leaves the choice of the reference to the program.
const AUTO: &str = "auto";

pub(crate) fn run(args: StitchArgs) -> Result<(), Failure> {
    let (quiet, verbose) = (args.quiet, args.verbose);
    let CheckedStitch { job, options } = CheckedStitch::new(args)?;
    let cancel = crate::cancel_token();
    let bars = Bars::new(quiet);
    let context = StageContext::new(&bars, &cancel, options.stitch.seed);
    let written = job.run(&options, &context);
    bars.clear();
    let written = written?;
    if quiet { Ok(()) } else { output::print(&summaries(&written, verbose)) }
}

/// A blank line between panoramas.
pub(crate) fn summaries(written: &[Written], verbose: bool) -> String {
    let one = |written: &Written| {
        let file =
            PanoramaFile { panorama: &written.output, bytes: written.bytes, project: written.project_file.as_deref() };
        summary::text(&written.project, Some(&file), verbose)
    };
    written.iter().map(one).collect::<Vec<_>>().join("\n")
}

/// Arguments that make sense: what the library needs.
struct CheckedStitch {
    job: StitchJob,
    options: StitchOptions,
}

impl CheckedStitch {
    fn new(args: StitchArgs) -> Result<Self, Failure> {
        let mut flags = picture_flags(&args.picture, &args.budget);
        flags.extend([
            ("--method", "stitch.method", &args.method),
            ("--align", "stitch.align", &args.align),
            ("--structure", "stitch.structure", &args.structure),
            ("--seed", "stitch.seed", &args.seed),
        ]);
        let options = chosen_options(StitchOptions::default(), args.config.as_deref(), &args.set, &flags)?;
        check_files(&args.output, args.project.as_ref(), &args.picture)?;
        let reference = chosen_reference(args.reference);
        let inputs = Inputs {
            photographs: args.photographs,
            reference,
            graph: args.graph,
            all: args.all,
            masks: chosen_masks(&args.mask, &args.keep)?,
            require_all: args.require_all,
        };
        // The library reads 0 as one thread per core.
        let threads = args.threads.map_or(0, usize::from);
        let job = StitchJob {
            inputs,
            output: args.output,
            project: args.project,
            hugin_project: args.picture.pto,
            layers: args.picture.layers,
            seams: args.picture.seams,
            cache: args.cache,
            threads,
        };
        Ok(Self { job, options })
    }
}

/// The options that flags of `trueup stitch` and `trueup compose` set.
pub(crate) fn picture_flags<'a>(picture: &'a PictureArgs, budget: &'a BudgetArgs) -> Vec<OptionFlag<'a>> {
    vec![
        ("--projection", "projection.kind", &picture.projection),
        ("--yaw", "projection.yaw", &picture.yaw),
        ("--pitch", "projection.pitch", &picture.pitch),
        ("--roll", "projection.roll", &picture.roll),
        ("--fov", "projection.fov", &picture.fov),
        ("--crop", "canvas.crop", &picture.crop),
        ("--fill", "canvas.fill", &picture.fill),
        ("--background", "output.background", &picture.background),
        ("--scale", "canvas.scale", &picture.scale),
        ("--quality", "output.jpeg_quality", &picture.quality),
        ("--depth", "output.depth", &picture.depth),
        ("--memory", "stitch.memory", &budget.memory),
        ("--scratch", "stitch.scratch", &budget.scratch),
    ]
}

/// Refuses one name for two files.
pub(crate) fn check_files(output: &PathBuf, project: Option<&PathBuf>, picture: &PictureArgs) -> Result<(), Failure> {
    let files = [
        ("--output", Some(output)),
        ("--project", project),
        ("--pto", picture.pto.as_ref()),
        ("--layers", picture.layers.as_ref()),
        ("--seams", picture.seams.as_ref()),
    ];
    let given: Vec<(&str, &PathBuf)> = files.iter().filter_map(|(flag, path)| Some((*flag, (*path)?))).collect();
    for (index, (flag, path)) in given.iter().enumerate() {
        if let Some((other, _)) = given[..index].iter().find(|(_, other)| other == path) {
            let message = format!("{} cannot be the file of both {other} and {flag}", path.display());
            return Err(Failure::usage(message, format!("Give {other} and {flag} different names.")));
        }
    }
    Ok(())
}

/// The masks that were typed.
pub(crate) fn chosen_masks(ignoring: &[String], keeping: &[String]) -> Result<Vec<MaskFile>, Failure> {
    let typed = ignoring.iter().map(|typed| ("--mask", typed, MaskKind::Use));
    let mask = |(flag, typed, kind): (&str, &String, MaskKind)| match typed.split_once('=') {
        Some((photograph, file)) if !photograph.is_empty() && !file.is_empty() => {
            Ok(MaskFile { photograph: photograph.to_owned(), file: file.into(), kind })
        }
        _ => {
            let message = format!("{flag} {typed}: it is not of the form NAME=FILE");
            Err(Failure::usage(message, "Write the photograph's name, \"=\", and the file of its mask."))
        }
    };
    typed.chain(keeping.iter().map(|typed| ("--keep", typed, MaskKind::Keep))).map(mask).collect()
}

/// The reference that was typed, if any.
pub(crate) fn chosen_reference(typed: Option<String>) -> Reference {
    match typed {
        Some(name) if name != AUTO => Reference::Named(name),
        _ => Reference::Auto,
    }
}

/// A flag of its own, the option it sets, and what was typed after it.
pub(crate) type OptionFlag<'a> = (&'a str, &'a str, &'a Option<String>);

/// The options given first, overruled by the configuration file, by `--set`, by the flags of their own, in this order. Every value that
/// cannot be is listed.
pub(crate) fn chosen_options(
    mut options: StitchOptions,
    config: Option<&Path>,
    set: &[String],
    flags: &[OptionFlag],
) -> Result<StitchOptions, Failure> {
    if let Some(path) = config {
        read_config(&mut options, path)?;
    }
    let set = set.iter().map(|assignment| (format!("--set {assignment}"), assignment.clone()));
    let flags = flags.iter().filter_map(|(flag, option, value)| {
        let value = value.as_ref()?;
        Some((format!("{flag} {value}"), format!("{option}={value}")))
    });
    let mut wrong = Vec::new();
    for (typed, assignment) in set.chain(flags) {
        if let Err(error) = options.set(&assignment) {
            wrong.push(format!("{typed}: {}", reason(error)));
        }
    }
    wrong.extend(options.all_invalid().iter().map(ToString::to_string));
    if wrong.is_empty() { Ok(options) } else { Err(Failure::options(wrong)) }
}

fn read_config(options: &mut StitchOptions, path: &Path) -> Result<(), Failure> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).map_err(|error| {
        Failure::usage(format!("{shown}: the configuration cannot be read ({error})"), "Check the path after --config.")
    })?;
    options
        .merge_toml(&text, &shown.to_string())
        .map_err(|error| Failure::options(vec![format!("{shown}: {}", reason(error))]))
}

/// Why an option was refused, without the subject and the hint, which the command has in its own words.
pub(crate) fn reason(error: Error) -> String {
    match error {
        Error::Input { reason, .. } => reason,
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::{Command, LowArgs};

    fn checked(arguments: &[&str]) -> Result<CheckedStitch, Failure> {
        let all = ["trueup", "stitch", "a.jpg", "-o", "p.jpg"].iter().chain(arguments);
        match LowArgs::try_parse_from(all).expect("arguments of the right form").command {
            Command::Stitch(args) => CheckedStitch::new(*args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn flags_overrule_set_and_set_overrules_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("c.toml");
        std::fs::write(&file, "[canvas]\nscale = 0.5\n[stitch]\nseed = 3\n[output]\njpeg_quality = 70\n")
            .expect("written");
        let config = file.to_str().expect("UTF-8");
        let given = ["--config", config, "--scale", "2", "--set", "canvas.scale=0.25", "--set", "stitch.seed=4"];
        let options = checked(&given).map(|checked| checked.options).expect("valid");
        assert_eq!((options.canvas.scale, options.stitch.seed, options.output.jpeg_quality), (2.0, 4, 70));
    }

    #[test]
    fn without_flags_every_option_has_its_default() {
        let CheckedStitch { job, options } = checked(&["--reference", "auto"]).expect("valid");
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
