//! What the arguments that several commands have make of what was typed.

use std::path::{Path, PathBuf};

use trueup::{Error, MaskFile, MaskKind, Projection, ProjectionOptions, Reference, StitchOptions};

use crate::arguments::{BudgetArgs, FileArgs, MaskArgs, PictureArgs, TuningArgs};
use crate::failure::Failure;

/// The word that leaves the choice of the reference to the program.
const AUTO: &str = "auto";

/// A flag of its own, the option it sets, and what was typed after it.
pub(crate) type OptionFlag<'a> = (&'a str, &'a str, &'a Option<String>);

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

/// The options given first, overruled by the configuration file, by `--set`, by the flags of their own, in this order.
/// Every value that cannot be is listed.
pub(crate) fn options(
    mut options: StitchOptions,
    tuning: &TuningArgs,
    flags: &[OptionFlag],
) -> Result<StitchOptions, Failure> {
    if let Some(path) = &tuning.config {
        read_config(&mut options, path)?;
    }
    let set = tuning.set.iter().map(|assignment| (format!("--set {assignment}"), assignment.clone()));
    let typed = flags.iter().filter_map(|(flag, option, value)| {
        let value = value.as_ref()?;
        Some((format!("{flag} {value}"), format!("{option}={value}")))
    });
    let mut wrong = Vec::new();
    for (typed, assignment) in set.chain(typed) {
        if let Err(error) = options.set(&assignment) {
            wrong.push(format!("{typed}: {}", reason(error)));
        }
    }
    // A projection that was not understood is not there.
    if wrong.is_empty() {
        wrong.extend(views_of_the_mesh(&options, flags));
    }
    wrong.extend(options.all_invalid().iter().map(ToString::to_string));
    if wrong.is_empty() { Ok(options) } else { Err(Failure::options(wrong)) }
}

/// The flags that turn or bound a view where there is none: a mesh is drawn as it lies.
fn views_of_the_mesh(options: &StitchOptions, flags: &[OptionFlag]) -> Vec<String> {
    let ProjectionOptions { kind, yaw, pitch, roll, fov, .. } = options.projection;
    let idle = [("--yaw", yaw), ("--pitch", pitch), ("--roll", roll), ("--fov", fov)];
    let is_idle =
        |flag: &str| kind == Projection::Mesh && idle.iter().any(|(name, value)| *name == flag && *value != 0.0);
    let told = |(flag, _, value): &OptionFlag| {
        let value = value.as_ref().filter(|_| is_idle(flag))?;
        Some(format!("{flag} {value}: the panorama is drawn on the mesh, which has no view; add a --projection"))
    };
    flags.iter().filter_map(told).collect()
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

/// The number of threads; the library reads 0 as one per core.
pub(crate) fn threads(tuning: &TuningArgs) -> usize {
    tuning.threads.map_or(0, usize::from)
}

/// The reference that was typed, if any.
pub(crate) fn reference(typed: Option<String>) -> Reference {
    match typed {
        Some(name) if name != AUTO => Reference::Named(name),
        _ => Reference::Auto,
    }
}

/// The masks that were typed.
pub(crate) fn masks(args: &MaskArgs) -> Result<Vec<MaskFile>, Failure> {
    let ignoring = args.mask.iter().map(|typed| ("--mask", typed, MaskKind::Use));
    let mask = |(flag, typed, kind): (&str, &String, MaskKind)| match typed.split_once('=') {
        Some((photograph, file)) if !photograph.is_empty() && !file.is_empty() => {
            Ok(MaskFile { photograph: photograph.to_owned(), file: file.into(), kind })
        }
        _ => {
            let message = format!("{flag} {typed}: it is not of the form NAME=FILE");
            Err(Failure::usage(message, "Write the photograph's name, \"=\", and the file of its mask."))
        }
    };
    let keeping = args.keep.iter().map(|typed| ("--keep", typed, MaskKind::Keep));
    ignoring.chain(keeping).map(mask).collect()
}

/// Refuses one name for two files.
pub(crate) fn check_files(args: &FileArgs) -> Result<(), Failure> {
    let files = [
        ("--output", Some(&args.output)),
        ("--project", args.project.as_ref()),
        ("--pto", args.pto.as_ref()),
        ("--layers", args.layers.as_ref()),
        ("--seams", args.seams.as_ref()),
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
