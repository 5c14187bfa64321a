//! Camera raw among the photographs: what an installed program develops takes its place.

use std::collections::BTreeSet;
use std::path::PathBuf;

use rayon::prelude::*;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::developing::Developer;
use trueup_io::{encode, source};

use super::made::{MadeFolder, WithMade};
use super::outputs::Outputs;
use crate::inputs::Inputs;

/// The code of camera raw photographs that were developed.
pub const RAW_DEVELOPED: &str = "raw-developed";

/// The stage under which progress is told.
const STAGE: &str = "developing";

/// Programs at work at once: each takes some twenty bytes for a pixel.
const AT_ONCE: usize = 4;

/// How the name of the folder of developed photographs ends.
const DEVELOPED: &str = "-developed";

/// How the names of developed photographs end, behind the whole name of the raw one.
const DEVELOPED_END: &str = ".tif";

/// Has the camera raw that `inputs` name developed, into a folder that is to lie beside the panorama; `None` if there
/// is none, no program is installed that develops it, or the panorama has no place on the disk: then it is left out
/// with the command that converts it.
///
/// # Errors
/// Those of [`MadeFolder::begin`]; [`Error::Io`]; [`Error::Cancelled`].
pub(super) fn with_developed(inputs: &Inputs, outputs: &Outputs, context: &StageContext) -> Result<Option<WithMade>> {
    let developer = Developer::installed().filter(|_| !encode::passes_through(&outputs.panorama));
    let Some(developer) = developer else { return Ok(None) };
    let raw_of =
        |name: &String| if inputs.in_memory.get(name).is_none() { source::raw_files(name) } else { Vec::new() };
    let raw: Vec<Vec<PathBuf>> = inputs.photographs.iter().map(raw_of).collect();
    let all: BTreeSet<&PathBuf> = raw.iter().flatten().collect();
    if all.is_empty() {
        return Ok(None);
    }
    let folder = MadeFolder::begin(outputs, DEVELOPED, inputs)?;
    let all = named(all);
    context.progress().begin(STAGE, all.len() as u64);
    let mut told = Vec::new();
    let mut developed = Vec::new();
    for some in all.chunks(AT_ONCE) {
        let develop = |(path, name): &(&PathBuf, String)| developer.develop(path, &folder.path().join(name), context);
        let made: Vec<Result<()>> = some.par_iter().map(develop).collect();
        for ((path, name), made) in some.iter().zip(made) {
            match made {
                Ok(()) => developed.push((*path, folder.path().join(name))),
                Err(Error::Input { reason, hint, .. }) => {
                    let _ = std::fs::remove_file(folder.path().join(name));
                    told.push(Diagnostic::warning("raw-not-developed", Subject::file(path.display()), reason, hint));
                }
                Err(other) => return Err(other),
            }
            context.progress().advance(STAGE, 1);
        }
    }
    context.progress().finish(STAGE);
    if developed.is_empty() {
        return Ok(Some(WithMade { inputs: inputs.clone(), told, made: None }));
    }
    told.push(Diagnostic::note(
        RAW_DEVELOPED,
        Subject::file(folder.folder().display()),
        format!("{} camera raw photographs were developed by {} into this folder", developed.len(), developer.name()),
        "Keep that folder as long as the panorama may be composed again.",
    ));
    let place_of =
        |path: &PathBuf| developed.iter().find(|(raw, _)| *raw == path).map(|(_, place)| place.display().to_string());
    let photographs = inputs.photographs.iter().zip(&raw);
    let photographs =
        photographs.flat_map(|(name, raw)| std::iter::once(name.clone()).chain(raw.iter().filter_map(place_of)));
    let inputs = Inputs {
        photographs: photographs.collect(),
        stood_for: developed.iter().map(|(raw, _)| (*raw).clone()).collect(),
        ..inputs.clone()
    };
    let inputs = folder.named_in(inputs);
    Ok(Some(WithMade { inputs, told, made: Some(folder) }))
}

/// The names of developed photographs: two of one name may come from two folders.
fn named(raw: BTreeSet<&PathBuf>) -> Vec<(&PathBuf, String)> {
    let mut taken = BTreeSet::new();
    let mut name = |(number, path): (usize, &PathBuf)| {
        let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (mut name, mut prefix) = (own.clone(), number + 1);
        // Names that differ by their case alone are one on some disks; what one gets in place of its own may be
        // another's.
        while !taken.insert(name.to_lowercase()) {
            name = format!("{prefix}-{own}");
            prefix += 1;
        }
        format!("{name}{DEVELOPED_END}")
    };
    raw.into_iter().enumerate().map(|one| (one.1, name(one))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_of_one_name_get_two_names() {
        let raw = ["a/1.nef", "b/1.NEF", "b/2.nef"].map(PathBuf::from);
        let names: Vec<String> = named(raw.iter().collect()).into_iter().map(|(_, name)| name).collect();
        assert_eq!(names, ["1.nef.tif", "2-1.NEF.tif", "2.nef.tif"]);
    }

    #[test]
    fn a_name_that_was_given_is_nobody_elses() {
        let raw = ["a/1.nef", "b/1.nef", "c/2-1.nef"].map(PathBuf::from);
        let names: Vec<String> = named(raw.iter().collect()).into_iter().map(|(_, name)| name).collect();
        assert_eq!(names, ["1.nef.tif", "2-1.nef.tif", "3-2-1.nef.tif"]);
    }
}
