//! Files: the panorama in any format, what is wanted beside it, and projects.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use trueup::SideOutput;

use super::wishing::wishes_of;
use crate::denial::Denial;
use crate::folder::plain_name;
use crate::limits::MAX_PROJECT_BYTES;
use crate::making::{self, ExportOrder};
use crate::reopening::reopen as reopen_text;
use crate::studio::{Studio, Task};
use crate::{body, work};

/// Files that are asked for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Asked {
    /// The name of the panorama's file, whose extension chooses the format.
    name: String,
    /// What is wanted beside it, by the command's flags.
    #[serde(default)]
    beside: Vec<String>,
    /// Whether they are to be put into the folder that is open.
    #[serde(default)]
    into_folder: bool,
}

impl Asked {
    fn order(self) -> Result<ExportOrder, Denial> {
        let hint = "Give it a name without slashes and the like, which ends in the format: panorama.jpg.";
        let stem = plain_name(&self.name).and_then(|name| name.rsplit_once('.')).map(|(stem, _)| stem.to_owned());
        let stem = stem.ok_or_else(|| Denial::unacceptable("that is no name for a file", hint))?;
        let beside = self.beside.iter().map(|flag| {
            let kind = SideOutput::ALL.iter().find(|kind| kind.flag() == flag);
            let kind = *kind.ok_or_else(|| Denial::missing("kind of file"))?;
            let (_, extension) = kind.value_name().rsplit_once('.').unwrap_or_default();
            // What it is called beside a panorama: pano.json, but pano-seams.png.
            let name = match kind {
                SideOutput::Project | SideOutput::HuginProject => format!("{stem}.{extension}"),
                _ => format!("{stem}-{}.{extension}", kind.flag()),
            };
            Ok((kind, name))
        });
        let beside = beside.collect::<Result<_, Denial>>()?;
        Ok(ExportOrder { name: self.name, beside, into_folder: self.into_folder })
    }
}

/// Begins to write files.
pub(crate) async fn export(State(studio): State<Arc<Studio>>, body: Body) -> Result<StatusCode, Denial> {
    let asked: Asked = wishes_of(body).await?;
    let order = asked.order()?;
    if order.into_folder && studio.state().folder.is_none() {
        return Err(Denial::unacceptable("no folder is open", "Fetch the files instead."));
    }
    work::start(&studio, Task::Export, move |studio, context| making::export(studio, &order, context))?;
    Ok(StatusCode::ACCEPTED)
}

/// A file that was written to be fetched.
pub(crate) async fn fetch(
    State(studio): State<Arc<Studio>>,
    Path((number, file)): Path<(u64, usize)>,
) -> Result<Response, Denial> {
    let missing = || Denial::missing("file");
    let found = {
        let state = studio.state();
        let export = state.exports.iter().find(|export| export.number == number);
        export.and_then(|export| Some((export.folder.clone()?, export.files.get(file)?.name.clone())))
    };
    let (folder, name) = found.ok_or_else(missing)?;
    let opened = tokio::fs::File::open(folder.join(&name)).await.map_err(|_| missing())?;
    Ok((attachment(&name), Body::new(body::FileBody::new(opened))).into_response())
}

/// What tells a browser to save a file, and under which name.
fn attachment(name: &str) -> [(header::HeaderName, String); 2] {
    // As in RFC 8187: what is not a plain letter is written in hexadecimal.
    let coded: String = name
        .bytes()
        .map(|byte| match byte {
            b'0'..=b'9' | b'A'..=b'Z' | b'a'..=b'z' | b'.' | b'-' | b'_' => char::from(byte).to_string(),
            other => format!("%{other:02X}"),
        })
        .collect();
    [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename*=UTF-8''{coded}")),
    ]
}

/// The record of the panorama as is wished now.
pub(crate) async fn project(State(studio): State<Arc<Studio>>) -> Result<Response, Denial> {
    let made = tokio::task::spawn_blocking(move || making::record(&studio));
    let text = made.await.map_err(Denial::failure)??;
    Ok((attachment("panorama.json"), text).into_response())
}

/// Begins to open a project that was dropped on the page.
pub(crate) async fn reopen(State(studio): State<Arc<Studio>>, body: Body) -> Result<StatusCode, Denial> {
    let bytes = body::read(body, MAX_PROJECT_BYTES).await?;
    begin(&studio, bytes, "the project".to_owned())
}

/// A project in the folder that is open.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Here {
    name: String,
}

/// Begins to open a project of the folder that is open.
pub(crate) async fn reopen_here(State(studio): State<Arc<Studio>>, body: Body) -> Result<StatusCode, Denial> {
    let Here { name } = wishes_of(body).await?;
    let missing = || Denial::missing("project");
    let folder =
        studio.state().folder.clone().filter(|folder| folder.projects().contains(&name)).ok_or_else(missing)?;
    let path = folder.path().join(&name);
    if !folder.holds(&path) {
        return Err(missing());
    }
    let bytes = tokio::fs::read(path).await.map_err(Denial::failure)?;
    begin(&studio, bytes, name)
}

fn begin(studio: &Arc<Studio>, bytes: Vec<u8>, name: String) -> Result<StatusCode, Denial> {
    let text =
        String::from_utf8(bytes).map_err(|_| Denial::unacceptable("it is no project file", "Give another file."))?;
    work::start(studio, Task::Reopen, move |studio, context| reopen_text(studio, &text, &name, context))?;
    Ok(StatusCode::ACCEPTED)
}
