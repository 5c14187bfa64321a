//! A project opened again: its photographs and masks must be among those that this session may read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup::{
    Error, ImageRecord, ImageStatus, MaskRecord, Project, RecordedPanorama, Result, RunOptions, StageContext,
    StitchOptions, Stitcher,
};

use crate::making::{Kept, keep};
use crate::studio::{History, Listed, PaintedMasks, Studio, Wishes, is_offered};

/// Opens the project in `text`, of a file called `name`, in the folder that is open if there is one. What was dropped
/// and is a mask of the project is no photograph from then on.
///
/// # Errors
/// [`Error::Input`] if it is none, or names photographs that are neither in the folder opened nor dropped; those of
/// [`Stitcher::reopen`].
pub(crate) fn reopen(studio: &Studio, text: &str, name: &str, context: &StageContext) -> Result<()> {
    let mut project = Project::from_json(text, name)?;
    // What a file of somebody else says of this machine is not heeded: where scratch files lie, how much memory is
    // taken.
    project.options.run = RunOptions::default();
    let (listed, folder) = {
        let state = studio.state();
        (state.photographs.clone(), state.folder.as_ref().map(|folder| folder.path().to_owned()))
    };
    let (dropped_masks, listed) = masks_among(listed, &project);
    let places = Places { studio, folder: folder.as_deref(), dropped: &dropped_masks };
    let (mut masks, mut moved, mut names) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for image in &mut project.images {
        let number = place(&image.path, image.file_name(), &listed);
        for (path, name) in image.files() {
            match place(path, name, &listed) {
                Some(number) => moved.insert(path.clone(), listed[number].path.display().to_string()),
                None if image.status == ImageStatus::Used => return Err(not_there(name)),
                // Left out then, and not here now: only its name is told.
                None => names.insert(path.clone(), name.to_owned()),
            };
        }
        let Some(number) = number else {
            // They go with the photograph: what they name is read and copied by nobody.
            image.masks.clear();
            continue;
        };
        let mut painted = PaintedMasks::default();
        for record in &image.masks {
            let path = places.mask(record)?;
            moved.insert(record.path.clone(), path.display().to_string());
            painted.add(record.kind, path);
        }
        if !image.masks.is_empty() {
            masks.insert(number, painted);
        }
    }
    // What is read goes by where it was found, whatever else is recorded of its path.
    names.extend(moved);
    project.rename_files(&names);
    let options = project.options.clone();
    let stitcher = Stitcher::new(&options, context);
    let nowhere = studio.desk.path().join("none");
    let recorded = RecordedPanorama { project: &project, project_folder: &nowhere, photographs: None, masks: &[] };
    let alignment = stitcher.reopen(&recorded)?;
    let wishes = Wishes { options: differing(&options)?, masks, ..Wishes::default() };
    // What the page offers is a wish, all else is laid below.
    studio.change(|state| {
        state.photographs.retain(|one| !dropped_masks.contains(one));
        state.base = options.clone();
        state.history = History::beginning_with(wishes.clone());
    });
    keep(studio, context, Kept { alignment, options, wishes })
}

/// The photograph of the session that a record means: the file it names, or the only one of that `name`.
fn place(recorded: &str, name: &str, listed: &[Listed]) -> Option<usize> {
    let recorded = Path::new(recorded);
    let same = listed.iter().position(|one| one.path == recorded);
    same.or_else(|| {
        let mut named = (0..listed.len()).filter(|&number| listed[number].name() == name);
        named.next().filter(|_| named.next().is_none())
    })
}

fn not_there(name: &str) -> Error {
    let hint = "Begin in the folder that holds its photographs, or drop them on the page first.";
    Error::input(name, "this photograph of the project is not here", hint)
}

/// The dropped pictures that the project names as masks and not as photographs, and all else.
fn masks_among(listed: Vec<Listed>, project: &Project) -> (Vec<Listed>, Vec<Listed>) {
    let is_mask = |one: &Listed| {
        let name = one.name();
        let masks = project.images.iter().flat_map(|image| &image.masks);
        one.dropped
            && masks.into_iter().any(|mask| mask.file_name() == name)
            && project.images.iter().flat_map(ImageRecord::files).all(|(_, photograph)| photograph != name)
    };
    listed.into_iter().partition(is_mask)
}

/// Where masks are looked for.
struct Places<'a> {
    studio: &'a Studio,
    folder: Option<&'a Path>,
    dropped: &'a [Listed],
}

impl Places<'_> {
    /// The file of a mask: beside the project as recorded, as recorded, beside the project by its name alone, as the
    /// command looks for it, or among what was dropped.
    fn mask(&self, record: &MaskRecord) -> Result<PathBuf> {
        let beside = |name: &str| Some(self.folder?.join(name));
        let places = [beside(&record.path), Some(PathBuf::from(&record.path)), beside(record.file_name())];
        let dropped = self.dropped.iter().filter(|one| one.name() == record.file_name()).map(|one| one.path.clone());
        let mut places = places.into_iter().flatten().chain(dropped);
        places.find(|path| path.is_file() && self.studio.may_read(path)).ok_or_else(|| {
            let hint = "Put it beside the project in the folder that was opened, or drop it on the page first.";
            Error::input(&record.path, "this mask of the project is not here", hint)
        })
    }
}

/// The options offered on the page that are not as usual, as one writes them.
fn differing(options: &StitchOptions) -> Result<BTreeMap<String, String>> {
    let offered = options.changed()?.into_iter().filter(|option| is_offered(&option.description.name));
    Ok(offered.map(|option| (option.description.name, option.value)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_are_not_as_usual_are_wishes() {
        let mut options = StitchOptions::default();
        for assignment in ["projection.kind=panini", "projection.yaw=7.5", "exposure.enabled=false", "mesh.cell_px=30"]
        {
            options.set(assignment).expect("an option");
        }
        let wishes = differing(&options).expect("written");
        let expected = [("exposure.enabled", "false"), ("projection.kind", "panini"), ("projection.yaw", "7.5")];
        assert_eq!(wishes, expected.map(|(name, value)| (name.to_owned(), value.to_owned())).into());
    }
}
