//! Frames of videos, which the program `ffmpeg` takes out of them.
//!
//! It is started with nothing but the file, reads no other and no network, and is ended when the work is cancelled.

use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use trueup_core::{Error, Result, StageContext};

use crate::external::Running;
use crate::formats::{VIDEO, read_start, recognize};

/// What `ffmpeg` is called.
const PROGRAM: &str = "ffmpeg";

/// The stage under which progress is told.
const STAGE: &str = "video";

/// Width of the frames that are looked through, pixels: enough to see blur, and soon read.
const SMALL_WIDTH: usize = 480;

/// Highest frame of that width, pixels: a video is no strip.
const MAX_HEIGHT: usize = 10 * SMALL_WIDTH;

/// Most frames of a video: ten minutes of it, which no panorama needs.
const MAX_FRAMES: usize = 20_000;

/// Any constant rate: frames are numbered in their order, and so none is left out or shown twice to keep time.
const RATE: &str = "25";

/// What the numbers of frames are called in the filters.
const RENUMBERED: &str = "setpts=N/25/TB";

/// A second output, which tells on standard error of each time that the filters begin: once, unless frames of another
/// size or kind follow. Frames would be numbered anew from there.
const BEGINNINGS: [&str; 9] = [
    "-map",
    "0:v:0",
    "-vf",
    "select='eq(n\\,0)',scale=16:16,format=gray",
    "-c:v",
    "rawvideo",
    "-f",
    "framecrc",
    "pipe:2",
];

/// How the lines of that output begin: those of its head, and those of frames.
const HEAD: &str = "#";
const BEGINNING: &str = "0,";

/// Whether a file is a video, by its first bytes.
pub fn is_video(path: &Path) -> bool {
    // Opening a named pipe would wait for its writer.
    let open = || if path.is_file() { File::open(path).ok() } else { None };
    let is_picture = || matches!(open().map(|file| recognize(&mut BufReader::new(file))), Some(Ok(Some(_))));
    let start = open().and_then(|mut file| read_start(&mut file).ok());
    start.is_some_and(|start| (VIDEO.has_signature)(&start)) && !is_picture()
}

/// A frame made small, for looking through.
#[derive(Debug)]
pub struct SmallFrame {
    /// Width in pixels, at most 480.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Gray levels, row by row.
    pub gray: Vec<u8>,
}

/// Hands every frame of a video to `each`, in their order, made small.
///
/// # Errors
/// [`Error::Input`] if `ffmpeg` is not installed, or finds no frames, or there are more than 20,000, or they change
/// their size; [`Error::Cancelled`].
pub fn look_through(video: &Path, context: &StageContext, mut each: impl FnMut(&SmallFrame)) -> Result<()> {
    let filters = format!("{RENUMBERED},scale='min({SMALL_WIDTH},iw)':-2,format=gray");
    let output: Vec<OsString> =
        ["-f", "image2pipe", "-c:v", "pgm", "-"].into_iter().chain(BEGINNINGS).map(OsString::from).collect();
    let mut running = start(video, &filters, &output, None)?;
    let mut pictures = BufReader::new(running.output.take().ok_or_else(|| failed(video, "it writes nothing"))?);
    context.progress().begin(STAGE, 0);
    let mut count = 0;
    while let Some(frame) = read_gray(&mut pictures).map_err(|reason| failed(video, &reason))? {
        context.check_cancelled()?;
        count += 1;
        if count > MAX_FRAMES {
            return Err(Error::input(
                video.display(),
                format!("it has more than {MAX_FRAMES} frames"),
                "Cut out the part that is to be stitched, for example with `ffmpeg -ss 10 -t 30 -i clip.mp4 part.mp4`.",
            ));
        }
        each(&frame);
        context.progress().advance(STAGE, 1);
    }
    context.progress().finish(STAGE);
    end(running, video, count)
}

/// Writes frames of a video, by their numbers in ascending order, as PNG files into a folder, each under the name that
/// `name` gives.
///
/// # Errors
/// Those of [`look_through`]; [`Error::Io`] if a file cannot have its name.
pub fn take(
    video: &Path,
    frames: &[usize],
    folder: &Path,
    name: impl Fn(usize) -> String,
    context: &StageContext,
) -> Result<Vec<PathBuf>> {
    /// What `ffmpeg` calls them: a pattern of its own, with no folder in it, which might hold a percent sign.
    const NUMBERED: &str = "%06d.png";
    let wanted: Vec<String> = frames.iter().map(|frame| format!("eq(n\\,{frame})")).collect();
    let filters = format!("select='{}',{RENUMBERED}", wanted.join("+"));
    let output = ["-f", "image2", "-start_number", "0", NUMBERED].map(OsString::from);
    let mut running = start(video, &filters, &output, Some(folder))?;
    running.wait_unless_cancelled(context)?;
    end(running, video, frames.len())?;
    let named = |(number, &frame): (usize, &usize)| {
        let path = folder.join(name(frame));
        let written = folder.join(format!("{number:06}.png"));
        std::fs::rename(&written, &path).map(|()| path).map_err(|error| Error::io("writing", &written, error))
    };
    frames.iter().enumerate().map(named).collect()
}

/// Starts `ffmpeg` over a video; in `folder`, if it writes files.
fn start(video: &Path, filters: &str, output: &[OsString], folder: Option<&Path>) -> Result<Running> {
    let path = video.canonicalize().map_err(|error| Error::io("reading", video, error))?;
    // Its name is no option and no address.
    let mut input = OsString::from("file:");
    input.push(path);
    let mut command = Command::new(PROGRAM);
    command.args(["-nostdin", "-v", "error", "-protocol_whitelist", "file,pipe", "-i"]).arg(input);
    command.args(["-map", "0:v:0", "-vf", filters, "-r", RATE]).args(output);
    command.stdout(Stdio::piped());
    if let Some(folder) = folder {
        command.current_dir(folder);
    }
    Running::start(video, command, || {
        Error::input(
            video.display(),
            "it is a video, and ffmpeg, which takes frames out of videos, is not installed",
            "Install it (`apt install ffmpeg`, `brew install ffmpeg`), or take frames out by another program and give these.",
        )
    })
}

/// Waits for the end of `ffmpeg`, which is a good one if it had no complaint and there were frames.
fn end(mut running: Running, video: &Path, frames: usize) -> Result<()> {
    let is_good = running.wait()?;
    let (told, complaints): (Vec<String>, Vec<String>) =
        running.lines_said().into_iter().partition(|line| line.starts_with(HEAD) || line.starts_with(BEGINNING));
    if told.iter().filter(|line| line.starts_with(BEGINNING)).count() > 1 {
        return Err(Error::input(
            video.display(),
            "it is a video whose frames change their size or kind on the way",
            "Cut out a part where they are alike, for example with `ffmpeg -ss 10 -t 30 -i clip.mp4 part.mp4`.",
        ));
    }
    // A video that is cut off has a complaint at its end, and frames that are good.
    if frames > 0 && (is_good || running.output.is_none()) {
        return Ok(());
    }
    let last = complaints.last();
    // It begins with the address of the file, which is named already.
    let why = |line: &str| {
        line.strip_prefix("file:")
            .and_then(|line| line.split_once(": "))
            .map_or(line.to_owned(), |(_, why)| why.to_owned())
    };
    let reason = last.map(|line| why(line));
    Err(failed(video, reason.as_deref().unwrap_or("it says nothing of why")))
}

fn failed(video: &Path, reason: &str) -> Error {
    Error::input(
        video.display(),
        format!("it is a video, and ffmpeg cannot take its frames out ({})", reason.escape_debug()),
        "Play it to see whether it is whole, or take frames out by another program and give these.",
    )
}

/// The next picture of a stream of binary portable graymaps; `None` at its end.
///
/// # Source
/// Netpbm's description of the format: `P5`, width, height and greatest level in decimal digits, each followed by white
/// space, then the levels.
fn read_gray(stream: &mut impl BufRead) -> std::result::Result<Option<SmallFrame>, String> {
    let unreadable = |error: std::io::Error| format!("its frames cannot be read: {error}");
    if stream.fill_buf().map_err(unreadable)?.is_empty() {
        return Ok(None);
    }
    let mut word = || {
        /// Digits of a number that can be meant.
        const LONGEST: usize = 9;
        let mut word = String::new();
        let mut byte = [0];
        while word.len() <= LONGEST {
            stream.read_exact(&mut byte).map_err(unreadable)?;
            match byte[0].is_ascii_whitespace() {
                false => word.push(char::from(byte[0])),
                true if !word.is_empty() => break,
                true => {}
            }
        }
        Ok::<String, String>(word)
    };
    let (kind, width, height, levels) = (word()?, word()?, word()?, word()?);
    let size = [&width, &height].map(|length| length.parse::<usize>().unwrap_or(0));
    let [width, height] = size;
    if kind != "P5" || levels != "255" || !(1..=SMALL_WIDTH).contains(&width) || !(1..=MAX_HEIGHT).contains(&height) {
        return Err("it writes frames of another kind than it was asked for".to_owned());
    }
    let mut gray = vec![0; width * height];
    stream.read_exact(&mut gray).map_err(unreadable)?;
    Ok(Some(SmallFrame { width, height, gray }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graymaps_are_read_one_after_the_other() {
        let mut stream: &[u8] = b"P5\n3 2\n255\nabcdefP5 1 1 255\n!";
        let first = read_gray(&mut stream).expect("readable").expect("a frame");
        assert_eq!((first.width, first.height, first.gray.as_slice()), (3, 2, &b"abcdef"[..]));
        assert_eq!(read_gray(&mut stream).expect("readable").expect("a frame").gray, b"!");
        assert!(read_gray(&mut stream).expect("readable").is_none());
        for wrong in [
            &b"P6\n1 1\n255\nabc"[..],
            b"P5\n1 1\n65535\nab",
            b"P5\n4 4\n255\nab",
            b"P5\n9999999999999 1\n255\n",
            b"P5",
        ] {
            assert!(read_gray(&mut &*wrong).is_err());
        }
    }

    #[test]
    fn pictures_and_texts_are_no_videos() {
        let desk = tempfile::tempdir().expect("a folder");
        for (name, start, expected) in [
            ("a.mp4", &b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2"[..], true),
            ("b.mkv", b"\x1a\x45\xdf\xa3\x01\0\0\0", true),
            ("c.avi", b"RIFF\x10\0\0\0AVI LIST", true),
            ("d.webp", b"RIFF\x10\0\0\0WEBPVP8 ", false),
            ("e.heic", b"\0\0\0\x18ftypheic\0\0\0\0", false),
            ("f.mp4", b"to be or not to be", false),
        ] {
            let path = desk.path().join(name);
            std::fs::write(&path, start).expect("written");
            assert_eq!(is_video(&path), expected, "{name}");
        }
        assert!(!is_video(desk.path()) && !is_video(&desk.path().join("none")));
    }
}
