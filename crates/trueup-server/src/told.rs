//! What the page is told of what there is.

use std::collections::BTreeMap;

use serde::Serialize;
use trueup::{ImageRecord, ImageStatus, Judgement};

use crate::denial::Trouble;
use crate::folder::Folder;
use crate::making::{Warning, warnings};
use crate::studio::{ExportedFile, Listed, Stage, State, Stitched, Studio, Task, Tiles};

/// All of it.
#[derive(Debug, Serialize)]
pub(crate) struct Told {
    /// Grows with every change.
    pub news: u64,
    folder: Option<ToldFolder>,
    photographs: Vec<ToldPhotograph>,
    work: Option<ToldWork>,
    trouble: Option<Trouble>,
    stitched: Option<ToldPanorama>,
    /// Options that are wished for, by name.
    wishes: BTreeMap<String, String>,
    can_undo: bool,
    can_redo: bool,
    /// The number of the tiles that show the panorama as it is wished now.
    tiles: Option<u64>,
    exports: Vec<ToldExport>,
}

#[derive(Debug, Serialize)]
struct ToldFolder {
    name: String,
    /// Its path from the folder that was opened first, which folders are opened by: empty for that one.
    inside: String,
    folders: Vec<String>,
    projects: Vec<String>,
}

#[derive(Debug, Serialize)]
struct ToldPhotograph {
    number: usize,
    name: String,
    dropped: bool,
    /// Whether the person left it out.
    left_out: bool,
    /// Numbers of painted masks, which change with them.
    used_mask: Option<String>,
    kept_mask: Option<String>,
    verdict: Option<ToldVerdict>,
}

/// What became of a photograph in the panorama.
#[derive(Debug, Serialize)]
struct ToldVerdict {
    used: bool,
    reason: String,
    hint: String,
    /// Those of one number belong together; the first is the panorama.
    group: Option<usize>,
}

#[derive(Debug, Serialize)]
struct ToldWork {
    task: Task,
    stages: Vec<Stage>,
    stopping: bool,
}

#[derive(Debug, Serialize)]
struct ToldPanorama {
    number: u64,
    /// Whether other photographs, masks or options of the geometry are wished by now.
    stale: bool,
    used: usize,
    judgement: Judgement,
    warnings: Vec<Warning>,
}

#[derive(Debug, Serialize)]
struct ToldExport {
    number: u64,
    /// Whether they can be fetched; they lie in the folder that is open otherwise.
    to_fetch: bool,
    files: Vec<ExportedFile>,
}

/// Whether tiles show the panorama as it is wished now.
fn are_shown(tiles: &Tiles, state: &State) -> bool {
    let stitched = state.stitched.as_ref();
    tiles.wishes == *state.history.now() && stitched.is_some_and(|stitched| stitched.number == tiles.stitched)
}

/// What there is now, as number `news`.
pub(crate) fn told(studio: &Studio, news: u64) -> Told {
    let state = studio.state();
    let wishes = state.history.now();
    let shown = |tiles: &&Tiles| are_shown(tiles, &state);
    let exports = state.exports.iter().map(|export| ToldExport {
        number: export.number,
        to_fetch: export.folder.is_some(),
        files: export.files.clone(),
    });
    Told {
        news,
        folder: state.folder.as_ref().map(|folder| told_folder(folder, studio)),
        photographs: told_photographs(&state),
        work: state.work.as_ref().map(|work| ToldWork {
            task: work.task,
            stages: work.stages.clone(),
            stopping: work.cancel.is_cancelled(),
        }),
        trouble: state.trouble.clone(),
        stitched: state.stitched.as_ref().map(|stitched| told_panorama(&state, stitched)),
        wishes: wishes.options.clone(),
        can_undo: state.history.can_undo(),
        can_redo: state.history.can_redo(),
        tiles: state.tiles.as_ref().filter(shown).map(|tiles| tiles.number),
        exports: exports.collect(),
    }
}

fn told_folder(folder: &Folder, studio: &Studio) -> ToldFolder {
    let inside = studio.root.as_ref().map(|root| folder.path_from(root)).unwrap_or_default();
    ToldFolder { name: folder.name(), inside, folders: folder.folders(), projects: folder.projects() }
}

fn told_photographs(state: &State) -> Vec<ToldPhotograph> {
    let wishes = state.history.now();
    let records = state.stitched.iter().flat_map(|stitched| &stitched.alignment.project.images);
    let records: BTreeMap<&str, &ImageRecord> = records.map(|record| (record.path.as_str(), record)).collect();
    let told = state.photographs.iter().enumerate().map(|(number, listed): (usize, &Listed)| {
        let painted = wishes.masks.get(&number);
        let mask = |file: Option<&std::path::PathBuf>| Some(file?.file_stem()?.to_string_lossy().into_owned());
        let record = records.get(listed.path.display().to_string().as_str()).copied();
        ToldPhotograph {
            number,
            name: listed.name(),
            dropped: listed.dropped,
            left_out: wishes.left_out.contains(&number),
            used_mask: mask(painted.and_then(|painted| painted.used.last())),
            kept_mask: mask(painted.and_then(|painted| painted.kept.last())),
            verdict: record.map(|record| ToldVerdict {
                used: record.status == ImageStatus::Used,
                reason: record.reason.clone(),
                hint: record.hint.clone(),
                group: record.component,
            }),
        }
    });
    told.collect()
}

/// Of a panorama that is shown whole in another view, what is measured in that.
fn told_panorama(state: &State, stitched: &Stitched) -> ToldPanorama {
    let project = &stitched.alignment.project;
    let shown = state.tiles.as_ref().filter(|tiles| are_shown(tiles, state)).map(|tiles| tiles.underlay.project());
    let shown = shown.filter(|shown| shown.measures.is_some()).unwrap_or(project);
    let same_geometry = state
        .options()
        .is_ok_and(|options| options.differing_geometry(&stitched.options).is_ok_and(|differing| differing.is_empty()));
    ToldPanorama {
        number: stitched.number,
        stale: !same_geometry || !state.history.now().same_photographs(&stitched.wishes),
        used: project.used(),
        judgement: shown.judgement(),
        warnings: warnings(shown),
    }
}
