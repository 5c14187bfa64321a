//! Writing the sets of the study: each in its folder, once.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use trueup_core::options::OptionValue;
use trueup_core::{Error, Result, StageContext};

use crate::render::Quality;
use crate::rig::{RigOptions, rig};
use crate::scene::{LightQuality, Scene, SceneOptions};
use crate::set::{SetOutput, write_set};
use crate::study::SetKind;

/// Raised whenever the same options make other pictures than before.
const RECIPE: u32 = 1;

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
        // An outdated truth must not stand beside new pictures should the work be broken off.
        match fs::remove_file(&truth) {
            Err(error) if !matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                return Err(Error::io("removing", &truth, error));
            }
            _ => {}
        }
        let scene = Scene::new(&record.scene)?;
        let cameras = rig(&record.rig, &scene.viewpoint())?;
        let source =
            format!("{} {}: {} {}", self.kind.display(), self.number, record.scene.kind.display(), record.scene.seed);
        fs::create_dir_all(&folder).map_err(|error| Error::io("making the folder", &folder, error))?;
        let text = serde_json::to_string_pretty(&record)
            .map_err(|error| Error::io("writing", &note, std::io::Error::other(error)))?;
        fs::write(&note, text + "\n").map_err(|error| Error::io("writing", &note, error))?;
        let output = SetOutput { quality: record.quality, depth: self.depth };
        write_set(&folder, &source, &scene, &cameras, output, context)?;
        Ok(SetOutcome::Rendered)
    }
}

fn read_record(path: &Path) -> Option<SetRecord> {
    serde_json::from_str(&fs::read_to_string(path).ok()?).ok()
}
