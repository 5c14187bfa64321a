//! What the arguments that several commands have make of what was typed.

use std::path::Path;

use trueup::{Error, MaskFile, MaskKind, Outputs, ReadFile, Reference, StitchOptions};

use crate::arguments::{FileArgs, MaskArgs, TuningArgs, TypedOptions};
use crate::failure::Failure;

/// The word that leaves the choice of the reference to the program.
const AUTO: &str = "auto";

/// The options given first, overruled by the configuration file, by `--set`, by the flags of their own, in this order.
/// Every value that cannot be is listed.
pub(crate) fn options(
    mut options: StitchOptions,
    tuning: &TuningArgs,
    typed: &TypedOptions,
) -> Result<StitchOptions, Failure> {
    if let Some(path) = &tuning.config {
        read_config(&mut options, path)?;
    }
    let mut wrong = Vec::new();
    let mut set = |typed: String, assignment: &str| {
        if let Err(error) = options.set(assignment) {
            wrong.push(format!("{typed}: {}", reason(error)));
        }
    };
    for assignment in &tuning.set {
        set(format!("--set {assignment}"), assignment);
    }
    for one in typed.iter() {
        set(one.typed(), &format!("{}={}", one.flag.option, one.value));
    }
    // A projection that was not understood is not there.
    if wrong.is_empty() {
        wrong.extend(views_of_the_mesh(typed, &options));
    }
    wrong.extend(options.invalid().iter().map(ToString::to_string));
    if wrong.is_empty() { Ok(options) } else { Err(Failure::options(wrong)) }
}

/// The flags that turn or bound a view where there is none.
fn views_of_the_mesh(typed: &TypedOptions, options: &StitchOptions) -> impl Iterator<Item = String> {
    let idle = typed.iter().filter(|one| one.flag.lacks_a_view(&one.value, options));
    idle.map(|one| {
        format!("{}: the panorama is drawn on the mesh, which has no view; take another --projection", one.typed())
    })
}

fn read_config(options: &mut StitchOptions, path: &Path) -> Result<(), Failure> {
    let shown = path.display();
    let text = trueup::text::read_to_string(path).map_err(|error| {
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

/// The files that were asked for.
pub(crate) fn outputs(args: FileArgs) -> Outputs {
    Outputs { panorama: args.output, beside: args.beside.0 }
}

/// The masks that were typed.
pub(crate) fn masks(args: &MaskArgs) -> Result<Vec<MaskFile>, Failure> {
    let ignoring = args.mask.iter().map(|typed| mask("--mask", typed, MaskKind::Use));
    let keeping = args.keep.iter().map(|typed| mask("--keep", typed, MaskKind::Keep));
    ignoring.chain(keeping).collect()
}

fn mask(flag: &str, typed: &str, kind: MaskKind) -> Result<MaskFile, Failure> {
    let splits = || {
        let all = typed.match_indices('=').map(|(at, mark)| (&typed[..at], &typed[at + mark.len()..]));
        all.filter(|(photograph, file)| !photograph.is_empty() && !file.is_empty())
    };
    // Names may have the mark in them as well: it parts the two where a file lies behind it.
    match splits().find(|(_, file)| Path::new(file).is_file()).or_else(|| splits().next()) {
        Some((photograph, file)) => Ok(MaskFile { photograph: photograph.to_owned(), file: file.into(), kind }),
        None => {
            let message = format!("{flag} {typed}: it is not of the form NAME=FILE");
            Err(Failure::usage(message, "Write the photograph's name, \"=\", and the file of its mask."))
        }
    }
}

/// Refuses one place for two files, or for one of the files that is read; `read` names those the library knows nothing
/// of.
pub(crate) fn check_files<'a>(
    outputs: &Outputs,
    read: impl IntoIterator<Item = (&'a Path, ReadFile)>,
) -> Result<(), Failure> {
    outputs.refuse_one_place_for_two().map_err(|error| match error {
        Error::Input { subject, reason, hint } => Failure::usage(format!("{subject}: {reason}"), hint),
        other => other.into(),
    })?;
    Ok(outputs.refuse_over(read)?)
}

/// The configuration as a file that is read, if there is one.
pub(crate) fn configuration(tuning: &TuningArgs) -> impl Iterator<Item = (&Path, ReadFile)> {
    tuning.config.iter().map(|path| (path.as_path(), ReadFile::Configuration))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_photographs_and_masks_may_have_the_mark_between_them() {
        let desk = tempfile::tempdir().expect("a folder");
        let place = |name: &str| desk.path().join(name).display().to_string();
        for name in ["plain.png", "x=1.png"] {
            std::fs::write(place(name), "").expect("written");
        }
        let parted = |typed: &str| {
            let mask = mask("--mask", typed, MaskKind::Use).ok()?;
            Some((mask.photograph, mask.file.display().to_string()))
        };
        for photograph in ["a.jpg", "a=b.jpg", "a=b=c.jpg"] {
            for file in ["plain.png", "x=1.png"].map(place) {
                assert_eq!(parted(&format!("{photograph}={file}")), Some((photograph.to_owned(), file)));
            }
        }
        // What is not there is told as it was typed first.
        assert_eq!(parted("a.jpg=b=c.png"), Some(("a.jpg".to_owned(), "b=c.png".to_owned())));
        assert!(["a.jpg", "a.jpg=", "=b.png", "=", ""].iter().all(|typed| parted(typed).is_none()));
    }
}
