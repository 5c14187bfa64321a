//! A project opened again: its photographs and masks must be among those that this session may read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup::{
    Error, ImageRecord, ImageStatus, MaskKind, Project, RecordedPanorama, Result, RunOptions, StageContext,
    StitchOptions, Stitcher,
};

use crate::making::{Kept, keep};
use crate::studio::{History, Listed, PaintedMasks, Studio, Wishes, is_offered};

/// Opens the project in `text`, of a file called `name`.
///
/// # Errors
/// [`Error::Input`] if it is none, or names photographs that are neither in the folder opened nor dropped; those of
/// [`Stitcher::reopen`].
pub(crate) fn reopen(studio: &Studio, text: &str, name: &str, context: &StageContext) -> Result<()> {
    let mut project = Project::from_json(text, name)?;
    // What a file of somebody else says of this machine is not heeded: where scratch files lie, how much memory is taken.
    project.options.run = RunOptions::default();
    let listed = studio.state().photographs.clone();
    let reference = project.images.iter().position(|image| image.path == project.reference);
    let mut masks = BTreeMap::new();
    for image in &mut project.images {
        let number = place(image, &listed);
        match number {
            Some(number) => image.path = listed[number].path.display().to_string(),
            None if image.status == ImageStatus::Used => return Err(not_there(image)),
            // Left out then, and not here now: only its name is told.
            None => image.path = image.file_name().to_owned(),
        }
        if let Some(painted) = painted(studio, image)? {
            masks.extend(number.map(|number| (number, painted)));
        }
    }
    // It is named by its path.
    if let Some(reference) = reference {
        project.reference = project.images[reference].path.clone();
    }
    let options = project.options.clone();
    let stitcher = Stitcher::new(&options, context);
    let nowhere = studio.desk.path().join("none");
    let recorded = RecordedPanorama { project: &project, project_folder: &nowhere, photographs: None, masks: &[] };
    let alignment = stitcher.reopen(&recorded)?;
    let wishes = Wishes { options: differing(&options)?, masks, ..Wishes::default() };
    // What the page offers is a wish, all else is laid below.
    studio.change(|state| {
        state.base = options.clone();
        state.history = History::beginning_with(wishes.clone());
    });
    keep(studio, context, Kept { alignment, options, wishes })
}

/// The photograph of the session that a record means: the file it names, or the only one of its name.
fn place(image: &ImageRecord, listed: &[Listed]) -> Option<usize> {
    let recorded = Path::new(&image.path);
    let same = listed.iter().position(|one| one.path == recorded);
    same.or_else(|| {
        let mut named = (0..listed.len()).filter(|&number| listed[number].name() == image.file_name());
        named.next().filter(|_| named.next().is_none())
    })
}

fn not_there(image: &ImageRecord) -> Error {
    let hint = "Begin in the folder that holds its photographs, or drop them on the page first.";
    Error::input(image.file_name(), "this photograph of the project is not here", hint)
}

/// The masks that a record names.
fn painted(studio: &Studio, image: &ImageRecord) -> Result<Option<PaintedMasks>> {
    let mut painted = PaintedMasks::default();
    for record in &image.masks {
        let path = PathBuf::from(&record.path);
        if !studio.may_read(&path) {
            let hint = "Put it into the folder that was opened, and let the project name it there.";
            return Err(Error::input(&record.path, "this mask of the project is not here", hint));
        }
        match record.kind {
            MaskKind::Use => painted.used = Some(path),
            MaskKind::Keep => painted.kept = Some(path),
        }
    }
    Ok((!image.masks.is_empty()).then_some(painted))
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
