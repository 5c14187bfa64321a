//! Writing the sets of the study: each in its folder, once.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use trueup_core::options::OptionValue;
use trueup_core::{Error, Result, StageContext};

use crate::render::Quality;
use crate::rig::{RigOptions, rig};
use crate::scene::{LightQuality, LitScene, SceneOptions};
use crate::set::{SetOutput, write_set};
use crate::study::SetKind;

/// Raised whenever the same options make other pictures than before.
pub const RECIPE: u32 = 1;

/// Name of the record of how a set was made.
const RECORD: &str = "set.json";

/// What a set is made from; a folder whose record says the same need not be made again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SetRecord {
    recipe: u32,
    scene: SceneOptions,
    rig: RigOptions,
    quality: Quality,
    depth: bool,
}

/// What became of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetOutcome {
    /// It was rendered.
    Rendered,
    /// It was there already, made from the same options.
    Kept,
}

/// One set of the catalogue and the care taken over it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetRequest {
    /// Its family.
    pub kind: SetKind,
    /// Its number, from 1.
    pub number: usize,
    /// Small, rough and fast: 320 pixels wide, one sample a pixel.
    pub preview: bool,
    /// Whether depth maps are written too.
    pub depth: bool,
}

impl SetRequest {
    /// The folder of the set below `out`: the number with two digits.
    pub fn folder(&self, out: &Path) -> PathBuf {
        out.join(format!("{:02}", self.number))
    }

    fn record(&self) -> Result<SetRecord> {
        /// Width of a preview, pixels.
        const PREVIEW_WIDTH: usize = 320;
        let (mut scene, mut rig) = self.kind.set(self.number).ok_or_else(|| {
            Error::input(
                format!("set {} of {}", self.number, self.kind.display()),
                "there is no such set",
                format!("Choose from 1 to {}.", self.kind.count()),
            )
        })?;
        let mut quality = match self.kind {
            SetKind::GateManhattan | SetKind::GateRandom => Quality::Draft,
            _ => Quality::Standard,
        };
        if self.preview {
            rig.height = rig.height * PREVIEW_WIDTH / rig.width;
            rig.width = PREVIEW_WIDTH;
            (scene.light, quality) = (LightQuality::Fast, Quality::Preview);
        }
        Ok(SetRecord { recipe: RECIPE, scene, rig, quality, depth: self.depth })
    }

    /// Renders the set into its folder below `out`, unless it is there complete and made from the same options.
    /// `truth.json` is written last: where it is missing, the set is not complete.
    ///
    /// # Errors
    /// [`Error::Input`] for a number that does not exist, and as [`write_set`].
    pub fn write(&self, out: &Path, context: &StageContext) -> Result<SetOutcome> {
        let (record, folder) = (self.record()?, self.folder(out));
        let (truth, note) = (folder.join("truth.json"), folder.join(RECORD));
        if truth.is_file() && read_record(&note).is_some_and(|found| found == record) {
            return Ok(SetOutcome::Kept);
        }
        make_folder(out)?;
        make_folder(&folder)?;
        // An outdated truth must not stand beside new pictures should the work be broken off.
        match fs::remove_file(&truth) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::io("removing", &truth, error));
            }
            _ => {}
        }
        let scene = LitScene::new(&record.scene)?;
        let cameras = rig(&record.rig, &scene.viewpoint())?;
        let source =
            format!("{} {}: {} {}", self.kind.display(), self.number, record.scene.kind.display(), record.scene.seed);
        let text = serde_json::to_string_pretty(&record)
            .map_err(|error| Error::io("writing", &note, std::io::Error::other(error)))?;
        fs::write(&note, text + "\n").map_err(|error| Error::io("writing", &note, error))?;
        let output = SetOutput { quality: record.quality, depth: self.depth };
        write_set(&folder, &source, &scene, &cameras, output, context)?;
        Ok(SetOutcome::Rendered)
    }
}

fn make_folder(folder: &Path) -> Result<()> {
    if folder.exists() && !folder.is_dir() {
        let hint = "Remove it, or choose another folder with --out.";
        return Err(Error::input(folder.display(), "there is a file where a folder is wanted", hint));
    }
    fs::create_dir_all(folder).map_err(|error| Error::io("making the folder", folder, error))
}

fn read_record(path: &Path) -> Option<SetRecord> {
    serde_json::from_str(&fs::read_to_string(path).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::unlit::UnlitScene;
    use crate::study::GATE_SETS;

    const ALL: [SetKind; 5] =
        [SetKind::Manhattan, SetKind::Twins, SetKind::Mixed, SetKind::GateManhattan, SetKind::GateRandom];

    fn small(kind: SetKind) -> SetRequest {
        SetRequest { kind, number: 1, preview: true, depth: false }
    }

    /// All sets of the study and a share of those for statistics: every camera is at least half a metre from
    /// everything, so that no picture is of one wall or of the inside of a cupboard.
    #[test]
    fn no_camera_stands_in_furniture_or_close_to_a_wall() {
        const LEAST_M: f64 = 0.5;
        for kind in ALL {
            let share = if kind.count() == GATE_SETS { 16 } else { 1 };
            for number in (1..=kind.count()).step_by(share) {
                let (scene, options) = kind.set(number).expect("a set");
                let scene = UnlitScene::new(&scene).expect("valid options");
                let cameras = rig(&options, &scene.viewpoint).expect("valid options");
                assert_eq!(cameras.len(), options.pictures, "{kind:?} {number}");
                let nearest = cameras.iter().map(|posed| scene.clearance(posed.center)).fold(f64::INFINITY, f64::min);
                assert!(nearest >= LEAST_M, "{kind:?} {number}: {nearest} m");
            }
        }
    }

    #[test]
    fn a_set_is_made_once_and_again_when_incomplete_or_different() {
        let out = tempfile::tempdir().expect("a folder");
        let (request, context) = (small(SetKind::GateRandom), StageContext::default());
        assert_eq!(request.write(out.path(), &context).expect("written"), SetOutcome::Rendered);
        assert_eq!(request.write(out.path(), &context).expect("there"), SetOutcome::Kept);
        let truth = request.folder(out.path()).join("truth.json");
        let before = fs::read(&truth).expect("there");
        fs::remove_file(&truth).expect("there");
        assert_eq!(request.write(out.path(), &context).expect("written"), SetOutcome::Rendered);
        assert_eq!(fs::read(&truth).expect("there"), before);
        let deep = SetRequest { depth: true, ..request };
        assert_eq!(deep.write(out.path(), &context).expect("written"), SetOutcome::Rendered);
        let map = fs::read(request.folder(out.path()).join("00.pfm")).expect("there");
        assert!(map.starts_with(b"Pf\n320 240\n-1.0\n") && map.len() == 16 + 4 * 320 * 240, "{}", map.len());
        let text = fs::read_to_string(&truth).expect("there");
        let truth: trueup_core::truth::Truth = serde_json::from_str(&text).expect("parses");
        assert_eq!(truth.images[0].depth.as_deref(), Some("00.pfm"));
    }

    #[test]
    fn wrong_numbers_and_files_in_the_way_are_named() {
        let out = tempfile::tempdir().expect("a folder");
        let context = StageContext::default();
        let unknown = SetRequest { number: 13, ..small(SetKind::Twins) };
        let error = unknown.write(out.path(), &context).expect_err("no such set").to_string();
        assert!(error.contains("set 13 of twins") && error.contains("1 to 12"), "{error}");
        fs::write(out.path().join("01"), "a file").expect("written");
        let error = small(SetKind::Manhattan).write(out.path(), &context).expect_err("in the way").to_string();
        assert!(error.contains("01") && error.contains("folder"), "{error}");
    }

    #[test]
    fn every_set_has_valid_options_and_4_to_72_pictures() {
        for kind in ALL {
            assert!(kind.count() >= 4, "{kind:?}");
            assert!(kind.set(0).is_none() && kind.set(kind.count() + 1).is_none());
            for number in 1..=kind.count() {
                let (scene, options) = kind.set(number).expect("a set");
                use trueup_core::options::StageOptions;
                assert!(scene.check().is_ok() && options.check().is_ok(), "{kind:?} {number}");
                assert!((4..=72).contains(&options.pictures));
            }
        }
    }
}
