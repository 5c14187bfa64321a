//! Videos among the photographs: the frames that are needed take their place.

use std::path::Path;

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::source::RejectedSource;
use trueup_io::{encode, video};
use trueup_vision::frames::FrameChooser;

use super::made::{MadeFolder, WithMade};
use super::outputs::Outputs;
use crate::inputs::Inputs;

/// The code of videos whose frames are used as photographs.
pub const FRAMES_TAKEN: &str = "frames-taken";

/// How the names of frames end.
const FRAME_END: &str = ".png";

/// How the name of the folder of frames ends.
const FRAMES: &str = "-frames";

/// The folder in that of the frames where those of one video are, until all of them are there.
const UNDER_WAY: &str = "under-way";

/// Takes the frames that are needed out of the videos that `inputs` name themselves, into a folder that is to lie
/// beside the panorama; `None` if there is no video. A video that no frames can be taken out of is told in
/// [`Inputs::unusable`].
///
/// # Errors
/// Those of [`MadeFolder::begin`]; [`Error::Input`] if the panorama has no place on the disk; [`Error::Io`];
/// [`Error::Cancelled`].
pub(super) fn with_frames(inputs: &Inputs, outputs: &Outputs, context: &StageContext) -> Result<Option<WithMade>> {
    let is_video = |name: &String| inputs.in_memory.get(name).is_none() && video::is_video(Path::new(name));
    let videos: Vec<&String> = inputs.photographs.iter().filter(|name| is_video(name)).collect();
    let Some(first) = videos.first() else { return Ok(None) };
    if encode::passes_through(&outputs.panorama) {
        return Err(Error::input(
            first,
            "it is a video, whose frames are kept beside the panorama, and that is no file",
            "Write the panorama to a file.",
        ));
    }
    let made = MadeFolder::begin(outputs, FRAMES, inputs)?;
    let (mut told, mut unusable, mut photographs) = (Vec::new(), inputs.unusable.clone(), Vec::new());
    let mut number = 0;
    for name in &inputs.photographs {
        if !videos.contains(&name) {
            photographs.push(name.clone());
            continue;
        }
        number += 1;
        let video = Path::new(name);
        // Two videos may have one name in two folders.
        let stem = video.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stem = if videos.len() > 1 { format!("{number}-{stem}") } else { stem };
        match take_frames(video, &stem, &made, context) {
            Ok(taken) => {
                told.push(taken.told(video, made.folder()));
                photographs.extend(taken.names.iter().map(|name| made.path().join(name).display().to_string()));
            }
            // It stays among the photographs, where it is left out as an unreadable one is.
            Err(Error::Input { reason, hint, .. }) => {
                photographs.push(name.clone());
                let code = "video-unusable".to_owned();
                unusable.push(RejectedSource { path: video.to_owned(), name: name.clone(), code, reason, hint });
            }
            Err(other) => return Err(other),
        }
    }
    let inputs = made.named_in(Inputs { photographs, unusable, ..inputs.clone() });
    let made = if told.is_empty() { None } else { Some(made) };
    Ok(Some(WithMade { inputs, told, made }))
}

/// Frames that were taken out of a video.
struct TakenFrames {
    /// The names of their files.
    names: Vec<String>,
    /// How many frames the video has.
    of: usize,
}

impl TakenFrames {
    fn told(&self, video: &Path, folder: &Path) -> Diagnostic {
        Diagnostic::note(
            FRAMES_TAKEN,
            Subject::file(video.display()),
            format!(
                "{} of its {} frames are used as photographs, from {}",
                self.names.len(),
                self.of,
                folder.display()
            ),
            "Keep that folder as long as the panorama may be composed again.",
        )
    }
}

/// Takes the frames that are needed out of one video, called by `stem` and their numbers; none of them stays where not
/// all can be taken.
///
/// # Errors
/// Those of [`video::look_through`] and [`video::take`].
fn take_frames(video: &Path, stem: &str, made: &MadeFolder, context: &StageContext) -> Result<TakenFrames> {
    let mut chooser: Option<FrameChooser> = None;
    video::look_through(video, context, |frame| {
        chooser.get_or_insert_with(|| FrameChooser::new(frame.width, frame.height)).push(&frame.gray);
    })?;
    let chooser = chooser.unwrap_or_else(|| FrameChooser::new(0, 0));
    let needed = chooser.needed();
    let name_of = |frame: usize| format!("{stem}-{frame:06}{FRAME_END}");
    let names: Vec<String> = needed.iter().map(|&frame| name_of(frame)).collect();
    let under_way = made.path().join(UNDER_WAY);
    std::fs::create_dir(&under_way).map_err(|error| Error::io("writing", &under_way, error))?;
    let taken = video::take(video, &needed, &under_way, name_of, context);
    let moved = taken.and_then(|_| {
        names.iter().try_for_each(|name| {
            let place = made.path().join(name);
            std::fs::rename(under_way.join(name), &place).map_err(|error| Error::io("writing", &place, error))
        })
    });
    let gone = std::fs::remove_dir_all(&under_way).map_err(|error| Error::io("removing", &under_way, error));
    moved.and(gone).map(|()| TakenFrames { names, of: chooser.len() })
}
