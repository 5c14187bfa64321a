//! What a set is made from, and making it when it is first needed.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;
use trueup::{Error, Result, StageContext};
use trueup_core::geometry::rotation_about_z;
use trueup_scenes::cut::SpecKind;
use trueup_scenes::{
    LitScene, Quality, RECIPE, RigOptions, SceneKind, SceneOptions, SetKind, SetOutput, SetRequest, rig, write_set,
};

use super::folders::photographs_in;
use super::ready::{ReadySet, read_truth, ready, ready_photographs};
use super::{focal_claim, from_panorama, vpg_data};

/// A set of photographs and where it comes from.
#[derive(Debug, Clone)]
pub(crate) struct SetSpec {
    /// Its name, which is also its place in the data folder, with `/` between folders.
    pub name: String,
    /// What it shows, in a few words.
    pub content: String,
    /// Whether its scene has dominant directions; `None` if nobody has said.
    pub manhattan: Option<bool>,
    /// Whether it was kept aside when constants were chosen, to judge them by.
    pub held_out: bool,
    /// Where it comes from.
    pub source: SetSource,
}

/// Where a set comes from.
#[derive(Debug, Clone)]
pub(crate) enum SetSource {
    /// It is one of the catalogue of `trueup-scenes`, whose command `study` writes to the same places.
    Catalogue(SetRequest),
    /// It is rendered.
    Rendered(Box<Recipe>),
    /// It is cut from a panorama.
    Cut(PathBuf, SpecKind),
    /// It lies in a folder with its `truth.json`.
    Folder(PathBuf),
    /// Photographs in a folder, with the cameras of the data set of the paper's authors if they are there.
    Photographs(PathBuf),
    /// Another set, whose metadata claim a focal length that is wrong by this factor.
    FocalClaimed(Box<SetSpec>, f64),
}

/// How a set is rendered.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    /// What is photographed.
    pub scene: SceneOptions,
    /// How it is photographed.
    pub rig: RigOptions,
    /// How carefully it is drawn.
    pub quality: Quality,
    /// By how much the second camera is turned about its axis, clockwise, beyond what the rig says; degrees.
    pub second_roll_deg: f64,
}

impl SetSpec {
    /// A set to be rendered.
    pub(crate) fn rendered(name: String, manhattan: Option<bool>, recipe: Recipe) -> Self {
        let content = describe(&recipe.scene, &recipe.rig);
        Self { name, content, manhattan, held_out: false, source: SetSource::Rendered(Box::new(recipe)) }
    }

    /// A set of the catalogue, in a folder below `parent`.
    pub(crate) fn catalogue(kind: SetKind, number: usize, parent: &str, manhattan: Option<bool>) -> Option<Self> {
        let (scene, rig) = kind.set(number)?;
        let content = describe(&scene, &rig);
        let source = SetSource::Catalogue(SetRequest { kind, number, preview: false, depth: false });
        Some(Self { name: format!("{parent}/{number:02}"), content, manhattan, held_out: false, source })
    }

    /// A set in a folder.
    pub(crate) fn folder(name: String, folder: PathBuf) -> Self {
        let content = "given with its truth.json".to_owned();
        Self { name, content, manhattan: None, held_out: false, source: SetSource::Folder(folder) }
    }

    /// Photographs in a folder.
    pub(crate) fn photographs(name: String, folder: PathBuf) -> Self {
        let content = "photographs".to_owned();
        Self { name, content, manhattan: None, held_out: false, source: SetSource::Photographs(folder) }
    }

    /// The same set with metadata that claim `factor` times its focal lengths.
    pub(crate) fn with_focal_claim(&self, factor: f64) -> Self {
        Self {
            name: format!("{}-focal-{:03.0}", self.name, 100.0 * factor),
            content: format!("{}, metadata claim {factor:.2} of the focal length", self.content),
            manhattan: self.manhattan,
            held_out: self.held_out,
            source: SetSource::FocalClaimed(Box::new(self.clone()), factor),
        }
    }

    /// How many photographs it has.
    ///
    /// # Errors
    /// Those of reading a folder's truth.
    pub(crate) fn photograph_count(&self) -> Result<usize> {
        match &self.source {
            SetSource::Catalogue(request) => Ok(request.kind.set(request.number).map_or(0, |(_, rig)| rig.pictures)),
            SetSource::Rendered(recipe) => Ok(recipe.rig.pictures),
            SetSource::Cut(_, kind) => Ok(from_panorama::views_of(*kind)),
            SetSource::Folder(folder) => Ok(read_truth(folder)?.0.images.len()),
            SetSource::Photographs(folder) => Ok(photographs_in(folder, &StageContext::default())?.len()),
            SetSource::FocalClaimed(original, _) => original.photograph_count(),
        }
    }

    /// Makes the set if it is not there yet. `data` is the folder that holds the made ones.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read or written, [`Error::Input`] for truth that cannot be,
    /// [`Error::Cancelled`].
    pub(crate) fn prepare(&self, data: &Path, context: &StageContext) -> Result<ReadySet> {
        let folder = self.name.split('/').fold(data.to_owned(), |path, part| path.join(part));
        match &self.source {
            SetSource::Folder(folder) => ready(folder),
            SetSource::Photographs(folder) => {
                let images = photographs_in(folder, context)?;
                let truth = vpg_data::truth(folder, &images)?;
                let paths: Vec<PathBuf> = images.into_iter().map(|image| image.path).collect();
                ready_photographs(&paths, truth)
            }
            SetSource::Catalogue(request) => {
                let parent = folder.parent().unwrap_or(data);
                request.write(parent, context)?;
                ready(&request.folder(parent))
            }
            SetSource::Rendered(recipe) => {
                made(&folder, &recipe.fingerprint(), || recipe.render(&folder, &self.name, context))
            }
            SetSource::Cut(panorama, kind) => made(&folder, &from_panorama::fingerprint(panorama, *kind)?, || {
                from_panorama::cut(panorama, *kind, &folder, context)
            }),
            SetSource::FocalClaimed(original, factor) => {
                let original = original.prepare(data, context)?;
                let claim = crate::trial::fingerprint(&(&original.fingerprint, factor.to_bits()));
                made(&folder, &claim, || focal_claim::write(&original, *factor, &folder))
            }
        }
    }
}

impl Recipe {
    fn render(&self, folder: &Path, name: &str, context: &StageContext) -> Result<()> {
        let scene = LitScene::new(&self.scene)?;
        let mut cameras = rig(&self.rig, &scene.viewpoint())?;
        if let Some(second) = cameras.get_mut(1).filter(|_| self.second_roll_deg != 0.0) {
            let turned_from_camera = rotation_about_z(self.second_roll_deg.to_radians()).transpose();
            let turned = turned_from_camera * second.camera.rotation();
            second.camera.set_rotation(&turned);
        }
        let output = SetOutput { quality: self.quality, depth: false };
        write_set(folder, name, &scene, &cameras, output, context).map(drop)
    }

    fn fingerprint(&self) -> String {
        let recipe = json!({
            "recipe": RECIPE, "scene": self.scene, "rig": self.rig, "quality": self.quality,
            "second_roll_deg": self.second_roll_deg,
        });
        crate::trial::fingerprint(&recipe.to_string())
    }
}

/// Refuses a set in `folder` whose name one of `sets` has.
///
/// # Errors
/// [`Error::Input`].
pub(super) fn refuse_known(sets: &[SetSpec], name: &str, folder: &Path) -> Result<()> {
    if sets.iter().all(|known| known.name != name) {
        return Ok(());
    }
    let hint = "Give the folders of sets names of their own.";
    Err(Error::input(folder.display(), "there are two sets of this name", hint))
}

/// "room (office), 5 of 1024 x 768 px, ..."
fn describe(scene: &SceneOptions, rig: &RigOptions) -> String {
    use trueup_core::options::OptionValue;
    let indoors = matches!(scene.kind, SceneKind::Room | SceneKind::TurnedRoom);
    let style = if indoors { format!(" ({})", scene.style.display()) } else { String::new() };
    let mut parts =
        vec![format!("{}{style}, {} of {} x {} px", scene.kind.display(), rig.pictures, rig.width, rig.height)];
    if rig.rows > 1 {
        parts.push(format!("{} rows", rig.rows));
    }
    parts.push(format!("pitch {:.0} deg", rig.pitch_deg));
    parts.push(format!("roll sd {:.0} deg", rig.roll_sd_deg));
    if rig.second_hfov_deg > 0.0 {
        parts.push("two focal lengths".to_owned());
    }
    parts.push(match rig.translation_fraction {
        0.0 => "no parallax".to_owned(),
        share => format!("wandering {:.1} % of the depth", 100.0 * share),
    });
    parts.join(", ")
}

/// Makes a folder's content unless it was made completely from the same recipe; the recipe is written last.
fn made(folder: &Path, recipe: &str, make: impl FnOnce() -> Result<()>) -> Result<ReadySet> {
    let marker = folder.join("made-from.txt");
    if fs::read_to_string(&marker).is_ok_and(|found| found == recipe) {
        return ready(folder);
    }
    // Photographs of another recipe must not stay among the new ones.
    if folder.exists() {
        if !marker.exists() && fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
            let unfinished = folder.join(UNFINISHED);
            if !unfinished.exists() {
                return Err(Error::input(
                    folder.display(),
                    "this folder holds something that was not rendered by this program",
                    "Name another folder with --data.",
                ));
            }
        }
        fs::remove_dir_all(folder).map_err(|error| Error::io("clearing", folder, error))?;
    }
    fs::create_dir_all(folder).map_err(|error| Error::io("making the folder", folder, error))?;
    let unfinished = folder.join(UNFINISHED);
    fs::write(&unfinished, "").map_err(|error| Error::io("writing", &unfinished, error))?;
    make()?;
    fs::remove_file(&unfinished).map_err(|error| Error::io("removing", &unfinished, error))?;
    fs::write(&marker, recipe).map_err(|error| Error::io("writing", &marker, error))?;
    ready(folder)
}

/// Lies in a folder while its set is being made.
const UNFINISHED: &str = "unfinished.txt";
