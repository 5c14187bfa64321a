//! The panorama: drawn small as is wished, and whole in tiles.

use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use super::wishing::{Changes, wishes_of};
use crate::denial::Denial;
use crate::layers::{ToldLayer, Underlay, layer_named};
use crate::making::{self, Preview};
use crate::studio::{Drawn, Studio, Task};
use crate::work;

/// A preview, to be fetched by its number.
#[derive(Debug, Serialize)]
pub(crate) struct ToldPreview {
    number: u64,
    #[serde(flatten)]
    preview: Preview,
}

/// Draws the panorama small, as is wished but for the changes in the body, which are not kept.
pub(crate) async fn preview(State(studio): State<Arc<Studio>>, body: Body) -> Result<Json<ToldPreview>, Denial> {
    let changes: Changes = wishes_of(body).await?;
    let options = changes.options()?;
    let told = tokio::task::spawn_blocking(move || {
        let mut preview = making::preview(&studio, &options)?;
        let drawn = Drawn {
            bytes: std::mem::take(&mut preview.bytes),
            media_type: preview.media_type,
            underlay: preview.underlay.clone(),
        };
        let number = studio.keep_drawn(drawn);
        Ok::<_, trueup::Error>(ToldPreview { number, preview })
    });
    Ok(Json(told.await.map_err(Denial::failure)??))
}

/// A preview that was drawn.
pub(crate) async fn drawn(State(studio): State<Arc<Studio>>, Path(number): Path<u64>) -> Result<Response, Denial> {
    let Drawn { bytes, media_type, .. } = studio.drawn(number).ok_or_else(|| Denial::missing("preview"))?;
    Ok(([(header::CONTENT_TYPE, media_type)], bytes).into_response())
}

/// A drawing over a preview.
pub(crate) async fn layer_of_preview(
    State(studio): State<Arc<Studio>>,
    Path((number, layer)): Path<(u64, String)>,
) -> Result<Json<ToldLayer>, Denial> {
    draw(studio.drawn(number).map(|drawn| drawn.underlay), &layer).await
}

/// A drawing over the tiles.
pub(crate) async fn layer_of_tiles(
    State(studio): State<Arc<Studio>>,
    Path((number, layer)): Path<(u64, String)>,
) -> Result<Json<ToldLayer>, Denial> {
    let underlay =
        studio.state().tiles.as_ref().filter(|tiles| tiles.number == number).map(|tiles| tiles.underlay.clone());
    draw(underlay, &layer).await
}

async fn draw(underlay: Option<Arc<Underlay>>, layer: &str) -> Result<Json<ToldLayer>, Denial> {
    let missing = || Denial::missing("drawing");
    let (underlay, layer) = (underlay.ok_or_else(missing)?, layer_named(layer).ok_or_else(missing)?);
    let told = tokio::task::spawn_blocking(move || underlay.draw(layer));
    Ok(Json(told.await.map_err(Denial::failure)??))
}

/// Begins to cut the whole panorama into tiles, or leaves it (no content) while anything else is being done: the page
/// asks for tiles by itself, and cannot know what a person begins at the same moment, so that this is no mistake of
/// anybody's.
pub(crate) async fn cut(State(studio): State<Arc<Studio>>) -> StatusCode {
    match work::start(&studio, Task::Tiles, making::cut_tiles) {
        Ok(()) => StatusCode::ACCEPTED,
        Err(_busy) => StatusCode::NO_CONTENT,
    }
}

/// What describes the tiles.
pub(crate) async fn description(
    State(studio): State<Arc<Studio>>,
    Path(number): Path<u64>,
) -> Result<Response, Denial> {
    file_of(&studio, number, "panorama.dzi", "application/xml").await
}

/// A tile: its name is two numbers and an extension.
pub(crate) async fn tile(
    State(studio): State<Arc<Studio>>,
    Path((number, level, tile)): Path<(u64, u32, String)>,
) -> Result<Response, Denial> {
    let missing = || Denial::missing("tile");
    let (place, extension) = tile.split_once('.').ok_or_else(missing)?;
    let (column, row) = place.split_once('_').ok_or_else(missing)?;
    let media_type = match extension {
        "jpg" => "image/jpeg",
        "png" => "image/png",
        _ => return Err(missing()),
    };
    let numbers: (u32, u32) = column.parse().ok().zip(row.parse().ok()).ok_or_else(missing)?;
    let name = format!("panorama_files/{level}/{}_{}.{extension}", numbers.0, numbers.1);
    file_of(&studio, number, &name, media_type).await
}

async fn file_of(studio: &Studio, number: u64, name: &str, media_type: &'static str) -> Result<Response, Denial> {
    let missing = || Denial::missing("tile");
    let folder = studio.state().tiles.as_ref().filter(|tiles| tiles.number == number).map(|tiles| tiles.folder.clone());
    let bytes = tokio::fs::read(folder.ok_or_else(missing)?.join(name)).await.map_err(|_| missing())?;
    Ok(([(header::CONTENT_TYPE, media_type)], bytes).into_response())
}
