//! Sets cut from panoramas of 360 x 180 degrees.

use std::path::Path;

use trueup::{Error, Result, StageContext};
use trueup_scenes::cut::{
    LevelOptions, Panorama360, SpecKind, SpecOptions, cut_set, find_panoramas, make_spec, measure_level,
};

use super::{SetSource, SetSpec};

/// What is cut from every panorama, and of how many views each consists.
const KINDS: [(SpecKind, usize); 5] =
    [(SpecKind::Row, 9), (SpecKind::Tilt, 6), (SpecKind::Grid, 21), (SpecKind::Full, 16), (SpecKind::Few, 3)];

/// The sets of a folder's panoramas.
///
/// # Errors
/// Those of [`find_panoramas`].
pub(super) fn sets(folder: &Path) -> Result<Vec<SetSpec>> {
    let found = find_panoramas(&[folder.display().to_string()], &StageContext::default())?;
    let each = |path: &Path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let source = path.to_owned();
        KINDS.map(|(kind, _)| SetSpec {
            name: format!("given/{stem}-{kind}"),
            content: format!("{kind} cut from {stem}"),
            manhattan: None,
            source: SetSource::Cut(source.clone(), kind),
        })
    };
    Ok(found.iter().flat_map(|image| each(&image.path)).collect())
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_counted_as_they_are_cut_and_are_not_cut_again() {
        let folder = tempfile::tempdir().expect("folder");
        let panorama = folder.path().join("panoramas").join("gray.png");
        std::fs::create_dir(folder.path().join("panoramas")).expect("folder");
        image::RgbImage::from_pixel(256, 128, image::Rgb([128; 3])).save(&panorama).expect("picture");
        let data = folder.path().join("data");
        for set in sets(&folder.path().join("panoramas")).expect("panoramas") {
            let ready = set.prepare(&data, &StageContext::default()).expect("cut");
            assert_eq!(ready.photographs.len(), set.pictures().expect("count"), "{}", set.name);
            // What is there is taken as it is.
            std::fs::remove_file(&ready.photographs[0]).expect("removed");
            let again = set.prepare(&data, &StageContext::default()).expect("there");
            assert_eq!(again.truth, ready.truth);
            assert_ne!(again.fingerprint, ready.fingerprint);
            assert!(!Path::new(&ready.photographs[0]).exists());
        }
    }
}
