//! What the page may ask for. Photographs, masks, tiles and exports go by their numbers: no request names a path, but
//! for the folders inside the one opened, which [`Folder::inside`](crate::folder::Folder::inside) looks at.

mod photographs;
mod pictures;
mod wishing;
mod writing;

use std::sync::Arc;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::routing::{get, post, put};

use crate::pages;
use crate::studio::Studio;

/// Every address there is.
pub(crate) fn router(studio: Arc<Studio>) -> Router {
    Router::new()
        .route("/", get(pages::index))
        .route("/page/{name}", get(pages::file))
        .route("/api/news", get(wishing::news))
        .route("/api/options", get(wishing::options))
        .route("/api/wishes", post(wishing::wish))
        .route("/api/undo", post(wishing::undo))
        .route("/api/redo", post(wishing::redo))
        .route("/api/stitch", post(wishing::stitch))
        .route("/api/stop", post(wishing::stop))
        .route("/api/folder", post(photographs::open))
        .route("/api/photographs", put(photographs::drop_one))
        .route("/api/photographs/{number}/thumbnail", get(photographs::thumbnail))
        .route("/api/photographs/{number}/picture", get(photographs::picture))
        .route("/api/photographs/{number}/mask/{kind}", get(photographs::mask).put(photographs::paint))
        .route("/api/preview", post(pictures::preview))
        .route("/api/preview/{number}", get(pictures::drawn))
        .route("/api/preview/{number}/layers/{layer}", get(pictures::layer_of_preview))
        .route("/api/tiles", post(pictures::cut))
        .route("/api/tiles/{number}/panorama.dzi", get(pictures::description))
        .route("/api/tiles/{number}/panorama_files/{level}/{tile}", get(pictures::tile))
        .route("/api/tiles/{number}/layers/{layer}", get(pictures::layer_of_tiles))
        .route("/api/exports", post(writing::export))
        .route("/api/exports/{number}/{file}", get(writing::fetch))
        .route("/api/project", get(writing::project).put(writing::reopen).post(writing::reopen_here))
        // Bodies are read by `body`, which has limits of its own for each.
        .layer(DefaultBodyLimit::disable())
        .with_state(studio)
}
