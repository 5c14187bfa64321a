//! Photographs: opened, dropped, shown and painted on.

use std::path::PathBuf;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use trueup::{MaskKind, StageContext, StitchOptions, names_photograph, write_thumbnail};

use super::wishing::wishes_of;
use crate::body;
use crate::denial::Denial;
use crate::folder::plain_name;
use crate::limits::{
    MAX_DROPPED_BYTES, MAX_MASK_BYTES, MAX_PHOTOGRAPH_BYTES, MAX_PHOTOGRAPHS, PAINTED_PIXELS, THUMBNAIL_PIXELS,
};
use crate::making::remove_folders;
use crate::studio::{Listed, State as Now, Studio};

/// A folder inside the one that was opened when the program began.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Opened {
    /// Its path from there.
    folder: String,
}

/// Opens a folder inside the one that was opened first. What was dropped is forgotten.
pub(crate) async fn open(State(studio): State<Arc<Studio>>, body: Body) -> Result<StatusCode, Denial> {
    let Opened { folder } = wishes_of(body).await?;
    let none = || Denial::missing("folder");
    let opened = studio.root.as_ref().and_then(|root| root.inside(&folder).ok()).ok_or_else(none)?;
    let photographs = opened.photographs().into_iter().map(|path| Listed { path, dropped: false }).collect();
    let forgotten = studio.change(|state| {
        if state.work.is_some() {
            return Err(Denial::not_now("something is being done", "Wait for it, or stop it."));
        }
        let (last_number, dropped_bytes) = (state.last_number, state.dropped_bytes);
        let opened = Now { folder: Some(opened), photographs, last_number, dropped_bytes, ..Now::default() };
        Ok(std::mem::replace(state, opened))
    })?;
    // Nothing leads to what was made of the other folder any more.
    let tiles = forgotten.tiles.map(|tiles| tiles.folder);
    let exports = forgotten.exports.into_iter().filter_map(|export| export.folder);
    let folders: Vec<PathBuf> = tiles.into_iter().chain(exports).collect();
    tokio::task::spawn_blocking(|| remove_folders(folders)).await.map_err(Denial::failure)?;
    Ok(StatusCode::NO_CONTENT)
}

/// What a dropped photograph is called.
#[derive(Debug, Deserialize)]
pub(crate) struct Named {
    name: String,
}

/// Takes a photograph that was dropped on the page.
pub(crate) async fn drop_one(
    State(studio): State<Arc<Studio>>,
    Query(Named { name }): Query<Named>,
    headers: HeaderMap,
    body: Body,
) -> Result<StatusCode, Denial> {
    let name = plain_name(&name).filter(|name| names_photograph((*name).as_ref()));
    let name = name.ok_or_else(|| {
        Denial::unacceptable("it is not named like a photograph", format!("Give {}.", trueup::readable_formats()))
    })?;
    {
        let state = studio.state();
        check_room(&state, name)?;
        let announced =
            headers.get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
        let room = MAX_PHOTOGRAPH_BYTES.min(MAX_DROPPED_BYTES.saturating_sub(state.dropped_bytes));
        if announced.is_none_or(|length| length > room) {
            return Err(Denial::new(
                StatusCode::PAYLOAD_TOO_LARGE,
                format!("photographs of up to {} MB can be dropped here", room / 1_000_000),
                "Begin with `trueup serve FOLDER`, in the folder that holds it.",
            ));
        }
        drop(state);
    }
    let place = studio.place_of_dropped(name);
    if let Some(folder) = place.parent() {
        tokio::fs::create_dir_all(folder).await.map_err(Denial::failure)?;
    }
    let bytes = body::save(body, MAX_PHOTOGRAPH_BYTES, &place).await?;
    let taken = studio.change(|state| {
        // Another one may have come meanwhile.
        check_room(state, name)?;
        state.dropped_bytes += bytes;
        state.photographs.push(Listed { path: place.clone(), dropped: true });
        Ok(StatusCode::CREATED)
    });
    // If it cannot be removed, it goes with its folder.
    taken.inspect_err(|_| drop(std::fs::remove_file(&place)))
}

/// Whether there is room for one more photograph, of this name.
fn check_room(state: &Now, name: &str) -> Result<(), Denial> {
    if state.photographs.len() >= MAX_PHOTOGRAPHS {
        return Err(Denial::unacceptable(format!("there are {MAX_PHOTOGRAPHS} photographs already"), ""));
    }
    if state.photographs.iter().any(|listed| listed.name() == name) {
        return Err(Denial::not_now("there is a photograph of this name already", "Give it another name."));
    }
    Ok(())
}

/// A photograph as small as in a list.
pub(crate) async fn thumbnail(state: State<Arc<Studio>>, number: Path<usize>) -> Result<Response, Denial> {
    small(state, number, THUMBNAIL_PIXELS).await
}

/// A photograph as large as it is painted on.
pub(crate) async fn picture(state: State<Arc<Studio>>, number: Path<usize>) -> Result<Response, Denial> {
    small(state, number, PAINTED_PIXELS).await
}

/// A photograph made small, with its own size in two headers: masks have that.
async fn small(State(studio): State<Arc<Studio>>, Path(number): Path<usize>, pixels: f64) -> Result<Response, Denial> {
    let listed = studio.photograph(number)?;
    if !studio.may_read(&listed.path) {
        return Err(Denial::missing("photograph"));
    }
    let made = move || {
        // Decoding takes most of the memory there may be: one at a time.
        let _one = studio.drawing.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let name = name_of_small(&listed.path, pixels);
        let place = studio.pictures().join(format!("{name}.jpg"));
        let size = match studio.small_size(&name) {
            Some(size) => size,
            None => {
                let photograph = listed.path.display().to_string();
                let (options, context) = (StitchOptions::default(), StageContext::default());
                let size = studio.pool.install(|| write_thumbnail(&photograph, pixels, &place, &options, &context))?;
                studio.keep_small(name, size);
                size
            }
        };
        let bytes = std::fs::read(&place).map_err(|error| trueup::Error::io("reading", &place, error))?;
        Ok::<_, trueup::Error>((size, bytes))
    };
    let ([width, height], bytes) = tokio::task::spawn_blocking(made).await.map_err(Denial::failure)??;
    let size = [("x-width", width.to_string()), ("x-height", height.to_string())];
    Ok((size, [(header::CONTENT_TYPE, "image/jpeg")], bytes).into_response())
}

/// What a photograph made small is called: by its file as it lies on the disk now, so that it is made once, and anew
/// when that changes.
fn name_of_small(path: &std::path::Path, pixels: f64) -> String {
    let facts = std::fs::metadata(path).ok();
    let stamp = facts.map(|facts| (facts.len(), facts.modified().ok()));
    blake3::hash(format!("{path:?} {stamp:?} {pixels}").as_bytes()).to_hex().to_string()
}

/// Which of its masks.
fn kind_of(name: &str) -> Result<MaskKind, Denial> {
    match name {
        "use" => Ok(MaskKind::Use),
        "keep" => Ok(MaskKind::Keep),
        _ => Err(Denial::missing("mask")),
    }
}

/// A mask that was painted.
pub(crate) async fn mask(
    State(studio): State<Arc<Studio>>,
    Path((number, kind)): Path<(usize, String)>,
) -> Result<Response, Denial> {
    let kind = kind_of(&kind)?;
    let painted = studio.state().history.now().masks.get(&number).cloned().unwrap_or_default();
    let file = painted.of(kind).last().cloned();
    let file = file.filter(|file| studio.may_read(file)).ok_or_else(|| Denial::missing("mask"))?;
    let bytes = tokio::fs::read(&file).await.map_err(Denial::failure)?;
    Ok(([(header::CONTENT_TYPE, "image/png")], bytes).into_response())
}

/// Takes a mask that was painted, a PNG in the size of the photograph; an empty body takes the mask away.
pub(crate) async fn paint(
    State(studio): State<Arc<Studio>>,
    Path((number, kind)): Path<(usize, String)>,
    body: Body,
) -> Result<StatusCode, Denial> {
    let kind = kind_of(&kind)?;
    studio.photograph(number)?;
    let bytes = body::read(body, MAX_MASK_BYTES).await?;
    let file = match bytes.is_empty() {
        true => None,
        false => Some(written(&studio, &bytes).await?),
    };
    studio.change(|state| {
        let mut wishes = state.history.now().clone();
        wishes.masks.entry(number).or_default().paint(kind, file);
        wishes.masks.retain(|_, painted| *painted != Default::default());
        state.history.go_on(wishes);
    });
    Ok(StatusCode::NO_CONTENT)
}

/// The first bytes of every PNG (W3C, "Portable Network Graphics", section 5.2).
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Writes a mask to a file of its own: older ones stay, so that painting can be undone.
async fn written(studio: &Studio, bytes: &[u8]) -> Result<PathBuf, Denial> {
    if !bytes.starts_with(PNG) {
        return Err(Denial::unacceptable("a mask is a PNG", "Reload the page."));
    }
    let number = studio.change(Now::number);
    let place = studio.masks().join(format!("{number}.png"));
    tokio::fs::write(&place, bytes).await.map_err(Denial::failure)?;
    Ok(place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;
    use crate::making::{ExportOrder, cut_tiles, export, stitch};

    /// Folders in a folder.
    fn count(folder: &std::path::Path) -> usize {
        let entries = std::fs::read_dir(folder).expect("readable");
        entries.filter(|entry| entry.as_ref().expect("readable").path().is_dir()).count()
    }

    /// Tiles and files to fetch that nothing leads to any more are removed: when another panorama is stitched, and when
    /// another folder is opened.
    #[test]
    fn what_is_no_longer_shown_is_removed() {
        let desk = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(desk.path().join("inside")).expect("a folder");
        let room = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room"));
        for name in ["00.jpg", "01.jpg"] {
            std::fs::copy(room.join(name), desk.path().join(name)).expect("copied");
        }
        let studio = Arc::new(Studio::new(Some(Folder::open(desk.path()).expect("a folder"))).expect("a studio"));
        studio.change(|state| state.base.set("canvas.scale=0.1").expect("an option"));
        let context = StageContext::default();
        let (pictures, exports) = (studio.pictures(), studio.exports());
        stitch(&studio, &context).expect("stitched");
        cut_tiles(&studio, &context).expect("cut");
        assert_eq!(count(&pictures), 1);
        stitch(&studio, &context).expect("stitched");
        assert_eq!(count(&pictures), 0, "they were of the panorama before");
        cut_tiles(&studio, &context).expect("cut");
        let ordered = ExportOrder { name: "pano.png".to_owned(), beside: Vec::new(), into_folder: false };
        export(&studio, &ordered, &context).expect("written");
        assert_eq!((count(&pictures), count(&exports)), (1, 1));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let opened = open(State(studio.clone()), Body::from(r#"{"folder":"inside"}"#));
        assert!(runtime.block_on(opened).is_ok());
        assert_eq!((count(&pictures), count(&exports)), (0, 0), "they were of the folder before");
    }
}
