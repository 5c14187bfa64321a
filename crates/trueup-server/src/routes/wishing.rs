//! Wishes, and news of what became of them.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::StatusCode;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::denial::Denial;
use crate::layers::{self, PossibleLayer};
use crate::limits::{MAX_WISHES_BYTES, NEWS_EVERY, NEWS_TIME};
use crate::studio::{Offered, Studio, Task, is_offered, offered};
use crate::told::{Told, told};
use crate::{body, making, work};

/// Which news the page has.
#[derive(Debug, Deserialize)]
pub(crate) struct Known {
    #[serde(default)]
    after: u64,
}

/// What there is, as soon as it is other than what the page knows, or after a while.
pub(crate) async fn news(State(studio): State<Arc<Studio>>, Query(known): Query<Known>) -> Json<Told> {
    let mut news = studio.news();
    if *news.borrow() == known.after {
        // Nothing new in that time is an answer, too.
        drop(tokio::time::timeout(NEWS_TIME, news.changed()).await);
    } else if known.after > 0 {
        tokio::time::sleep(NEWS_EVERY).await;
    }
    let number = *news.borrow();
    Json(told(&studio, number))
}

/// What can be wished for.
#[derive(Debug, Serialize)]
pub(crate) struct Possible {
    options: Vec<Offered>,
    /// The extensions of photographs: ".jpg".
    photographs: Vec<String>,
    /// Of panoramas, in words: ".jpg, .png or .tif".
    extensions: String,
    side_outputs: Vec<PossibleFile>,
    layers: Vec<PossibleLayer>,
}

#[derive(Debug, Serialize)]
struct PossibleFile {
    flag: &'static str,
    meaning: String,
}

/// What can be wished for.
pub(crate) async fn options() -> Json<Possible> {
    let files = trueup::SideOutput::ALL.iter().map(|kind| PossibleFile { flag: kind.flag(), meaning: kind.meaning() });
    Json(Possible {
        options: offered(),
        photographs: trueup::read_extensions(),
        extensions: trueup::written_extensions(),
        side_outputs: files.collect(),
        layers: layers::possible(),
    })
}

/// Other wishes; what is not named stays as it is.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Changes {
    #[serde(default)]
    options: BTreeMap<String, String>,
    /// Photographs by number, and whether they are left out.
    #[serde(default)]
    left_out: BTreeMap<usize, bool>,
}

impl Changes {
    /// The options, all of which the page offers.
    pub(crate) fn options(self) -> Result<Vec<(String, String)>, Denial> {
        match self.options.keys().find(|name| !is_offered(name)) {
            Some(name) => {
                Err(Denial::unacceptable(format!("there is no option \"{name}\" on this page"), "Reload the page."))
            }
            None => Ok(self.options.into_iter().collect()),
        }
    }
}

/// A request's wishes.
pub(crate) async fn wishes_of<T: DeserializeOwned>(body: Body) -> Result<T, Denial> {
    let bytes = body::read(body, MAX_WISHES_BYTES).await?;
    serde_json::from_slice(&bytes)
        .map_err(|error| Denial::unacceptable(format!("not understood: {error}"), "Reload the page."))
}

/// Wishes for something else, to be undone as one step.
pub(crate) async fn wish(State(studio): State<Arc<Studio>>, body: Body) -> Result<StatusCode, Denial> {
    let changes: Changes = wishes_of(body).await?;
    let left_out = changes.left_out.clone();
    let options = changes.options()?;
    work::stop(&studio, Some(Task::Tiles));
    studio.change(|state| {
        let mut wishes = state.history.now().clone();
        wishes.options.extend(options);
        for (number, is_left_out) in left_out.into_iter().filter(|(number, _)| *number < state.photographs.len()) {
            match is_left_out {
                true => wishes.left_out.insert(number),
                false => wishes.left_out.remove(&number),
            };
        }
        wishes.options(&state.base)?;
        state.trouble = None;
        state.history.go_on(wishes);
        Ok::<_, trueup::Error>(())
    })?;
    Ok(StatusCode::NO_CONTENT)
}

/// One step back.
pub(crate) async fn undo(State(studio): State<Arc<Studio>>) -> StatusCode {
    work::stop(&studio, Some(Task::Tiles));
    studio.change(|state| state.history.undo());
    StatusCode::NO_CONTENT
}

/// One step forth.
pub(crate) async fn redo(State(studio): State<Arc<Studio>>) -> StatusCode {
    work::stop(&studio, Some(Task::Tiles));
    studio.change(|state| state.history.redo());
    StatusCode::NO_CONTENT
}

/// Begins to stitch.
pub(crate) async fn stitch(State(studio): State<Arc<Studio>>) -> Result<StatusCode, Denial> {
    work::start(&studio, Task::Stitch, making::stitch)?;
    Ok(StatusCode::ACCEPTED)
}

/// Stops what is being done.
pub(crate) async fn stop(State(studio): State<Arc<Studio>>) -> StatusCode {
    work::stop(&studio, None);
    StatusCode::NO_CONTENT
}
