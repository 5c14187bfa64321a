//! The page itself: built from the sources in the folder `page`, and part of this program.

use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::denial::Denial;

/// A file of the page.
struct File {
    name: &'static str,
    media_type: &'static str,
    bytes: &'static [u8],
}

macro_rules! file {
    ($name:literal, $media_type:literal) => {
        File { name: $name, media_type: $media_type, bytes: include_bytes!(concat!("../page/built/", $name)) }
    };
}

const INDEX: &str = "index.html";
const SCRIPT: &str = "text/javascript; charset=utf-8";

const FILES: &[File] = &[
    file!("index.html", "text/html; charset=utf-8"),
    file!("page.css", "text/css; charset=utf-8"),
    File { media_type: SCRIPT, ..file!("page.js", "") },
    File { media_type: SCRIPT, ..file!("openseadragon.js", "") },
    File { media_type: SCRIPT, ..file!("pannellum.js", "") },
    file!("pannellum.css", "text/css; charset=utf-8"),
    file!("icon.svg", "image/svg+xml"),
    file!("licenses.txt", "text/plain; charset=utf-8"),
];

/// The page.
pub(crate) async fn index() -> Response {
    named(INDEX)
}

/// A file of it.
pub(crate) async fn file(Path(name): Path<String>) -> Response {
    named(&name)
}

fn named(name: &str) -> Response {
    match FILES.iter().find(|file| file.name == name) {
        Some(file) => (StatusCode::OK, [(header::CONTENT_TYPE, file.media_type)], file.bytes).into_response(),
        None => Denial::missing("file").into_response(),
    }
}
