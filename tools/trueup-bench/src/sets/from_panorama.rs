//! Sets cut from panoramas of 360 x 180 degrees.

use std::path::Path;

use trueup::{Error, Result, StageContext};
use trueup_scenes::cut::{LevelOptions, Panorama360, SpecKind, SpecOptions, cut_set, make_spec, measure_level};

/// What is cut from every panorama, and of how many views each consists. Grids and full turns of as many panoramas
/// would take longer than the rest of the report together: who wants them gives them with their truth.
pub(super) const KINDS: [(SpecKind, usize); 2] = [(SpecKind::Row, 9), (SpecKind::Tilt, 6)];

/// How many views a set of this kind has.
pub(super) fn views_of(kind: SpecKind) -> usize {
    KINDS.iter().find(|(known, _)| *known == kind).map_or(0, |(_, views)| *views)
}

/// Stands for the panorama's content and the views.
///
/// # Errors
/// [`Error::Io`] if the panorama cannot be read.
pub(super) fn fingerprint(panorama: &Path, kind: SpecKind) -> Result<String> {
    let bytes = std::fs::read(panorama).map_err(|error| Error::io("reading", panorama, error))?;
    let options = (format!("{:?}", SpecOptions::default()), format!("{:?}", LevelOptions::default()));
    Ok(crate::trial::fingerprint(&(bytes, kind.to_string(), options)))
}

/// Cuts the views; the scene's vertical is measured.
///
/// # Errors
/// Those of reading the panorama and of writing the views.
pub(super) fn cut(panorama: &Path, kind: SpecKind, folder: &Path, context: &StageContext) -> Result<()> {
    let panorama = Panorama360::read(&panorama.display().to_string(), context)?;
    let level = measure_level(&panorama, &LevelOptions::default(), context)?;
    let spec = make_spec(&panorama, kind, &level, &SpecOptions::default())?;
    cut_set(&panorama, &spec, folder, context).map(drop)
}
