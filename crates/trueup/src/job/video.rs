//! Videos among the photographs: the frames that are needed take their place.

use std::path::{Path, PathBuf};

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode::{self, PendingFolder};
use trueup_io::video;
use trueup_vision::frames::FrameChooser;

use super::inputs::Inputs;

/// Inputs in which files that were made stand for what cannot be read itself, and what is said of them.
pub(super) struct WithFrames {
    /// What was made is files like other photographs.
    pub(super) inputs: Inputs,
    /// Notes and warnings.
    pub(super) told: Vec<Diagnostic>,
}

/// Takes the frames that are needed out of the videos that `inputs` name themselves, into a folder beside `panorama`, which is replaced if it
/// holds frames of an earlier run; `None` if there is no video.
///
/// # Errors
/// Those of [`video::look_through`] and [`video::take`]; [`Error::Input`] if the folder holds other files, or the panorama has no place on the
/// disk.
pub(super) fn with_frames(inputs: &Inputs, panorama: &Path, context: &StageContext) -> Result<Option<WithFrames>> {
    let is_video = |name: &String| inputs.in_memory.get(name).is_none() && video::is_video(Path::new(name));
    let videos: Vec<&String> = inputs.photographs.iter().filter(|name| is_video(name)).collect();
    let Some(first) = videos.first() else { return Ok(None) };
    if encode::passes_through(panorama) {
        return Err(Error::input(
            first,
            "it is a video, whose frames are kept beside the panorama, and that is no file",
            "Write the panorama to a file.",
        ));
    }
    let folder = folder_beside(panorama, FRAMES);
    refuse_other_files(&folder, is_frame)?;
    let pending = PendingFolder::create(&folder)?;
    let mut told = Vec::new();
    let mut photographs = Vec::new();
    for name in &inputs.photographs {
        if !videos.contains(&name) {
            photographs.push(name.clone());
            continue;
        }
        let path = Path::new(name);
        let mut chooser: Option<FrameChooser> = None;
        video::look_through(path, context, |frame| {
            chooser.get_or_insert_with(|| FrameChooser::new(frame.width, frame.height)).push(&frame.gray);
        })?;
        let chooser = chooser.unwrap_or_else(|| FrameChooser::new(0, 0));
        let needed = chooser.needed();
        // Two videos may have one name in two folders.
        let number = told.len() + 1;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stem = if videos.len() > 1 { format!("{number}-{stem}") } else { stem };
        let frame_name = |frame: usize| format!("{stem}-{frame:06}{FRAME_END}");
        video::take(path, &needed, pending.path(), frame_name, context)?;
        photographs.extend(needed.iter().map(|&frame| folder.join(frame_name(frame)).display().to_string()));
        told.push(Diagnostic::note(
            "frames-taken",
            Subject::file(path.display()),
            format!(
                "{} of its {} frames are used as photographs, from {}",
                needed.len(),
                chooser.len(),
                folder.display()
            ),
            "Keep that folder as long as the panorama may be composed again.",
        ));
    }
    pending.commit()?;
    Ok(Some(WithFrames { inputs: Inputs { photographs, ..inputs.clone() }, told }))
}

/// How the names of frames end.
const FRAME_END: &str = ".png";

/// How the name of the folder of frames ends.
const FRAMES: &str = "-frames";

/// Where what was made for a panorama is kept.
pub(super) fn folder_beside(panorama: &Path, end: &str) -> PathBuf {
    let mut name = panorama.file_stem().unwrap_or_default().to_owned();
    name.push(end);
    panorama.with_file_name(name)
}

/// Whether a file of this name is a frame that was taken out of a video.
fn is_frame(name: &str) -> bool {
    let number = name.strip_suffix(FRAME_END).and_then(|name| name.rsplit_once('-')).map(|(_, number)| number);
    number.is_some_and(|number| number.len() >= 6 && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// A folder with anything but what is made there is somebody's own.
pub(super) fn refuse_other_files(folder: &Path, is_made: impl Fn(&str) -> bool) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let mut names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    match names.find(|name| !is_made(name)) {
        None => Ok(()),
        Some(other) => Err(Error::input(
            folder.display(),
            format!("what is made for the panorama belongs there, and it holds other files ({other})"),
            "Give the panorama another name, or the folder.",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_lie_beside_the_panorama_and_nothing_else_is_replaced() {
        assert_eq!(folder_beside(Path::new("out/pano.jpg"), FRAMES), Path::new("out/pano-frames"));
        let desk = tempfile::tempdir().expect("a folder");
        let folder = desk.path().join("pano-frames");
        refuse_other_files(&folder, is_frame).expect("not there");
        std::fs::create_dir(&folder).expect("made");
        std::fs::write(folder.join("my-clip-000123.png"), "").expect("written");
        refuse_other_files(&folder, is_frame).expect("frames");
        std::fs::write(folder.join("letter.png"), "").expect("written");
        let refused = refuse_other_files(&folder, is_frame).expect_err("a letter").to_string();
        assert!(refused.contains("letter.png"), "{refused}");
    }
}
