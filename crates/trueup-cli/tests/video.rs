//! Videos among the photographs.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use crate::pictures::{noise, put_street};
use crate::run::{Desk, finish, trueup};

/// A clip that shows each photograph of the street for three frames; `None` where ffmpeg is not installed, as `.ci/run`
/// sees to.
fn clip() -> Option<Desk> {
    let desk = Desk::new();
    put_street(&desk);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(desk.path()).args(["-v", "error", "-framerate", "5", "-pattern_type", "glob", "-i", "?.jpg"]);
    ffmpeg.args(["-c:v", "mjpeg", "-q:v", "2", "-r", "15", "--", "clip.avi"]);
    match ffmpeg.status() {
        Ok(status) => assert!(status.success(), "a clip is made"),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound && std::env::var_os("CI").is_none() => return None,
        Err(error) => panic!("ffmpeg: {error}"),
    }
    for photograph in desk.files().iter().filter(|name| name.ends_with(".jpg")) {
        std::fs::remove_file(desk.join(photograph)).expect("removed");
    }
    Some(desk)
}

#[test]
fn the_frames_that_are_needed_are_stitched_and_kept() {
    let Some(desk) = clip() else { return };
    let first = desk.stitch(&["clip.avi", "--project", "pano.json"]);
    first.expect_success();
    let project = desk.json("pano.json");
    let images = project["images"].as_array().expect("images");
    assert!((2..=8).contains(&images.len()), "{} frames of four photographs, three times each", images.len());
    assert!(images.iter().all(|image| image["path"].as_str().expect("a path").starts_with("pano-frames/clip-0000")));
    assert_eq!(frames(&desk, "pano-frames").len(), images.len());
    let said = project["diagnostics"].as_array().expect("findings");
    assert!(said.iter().any(|one| one["code"] == "frames-taken"));

    // Composed again from the frames; and stitched again over them.
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.jpg"])).expect_success();
    let bytes = |name: &str| std::fs::read(desk.join(name)).expect("written");
    assert_eq!(bytes("again.jpg"), bytes("pano.jpg"));
    desk.stitch(&["clip.avi"]).expect_success();
    assert_eq!(bytes("again.jpg"), bytes("pano.jpg"));

    // A run that fails when its frames are taken leaves those that the older project needs, and none of its own.
    let known = frames(&desk, "pano-frames");
    desk.stitch(&["clip.avi", "--reference", "none.jpg"]).expect_failure(1, &["none.jpg"]);
    assert!(frames(&desk, "pano-frames") == known);
    let before = desk.files();
    let other = ["stitch", "clip.avi", "-o", "other.jpg", "--reference", "none.jpg"];
    finish(trueup(desk.path(), &other)).expect_failure(1, &["none.jpg"]);
    assert_eq!(desk.files(), before, "nothing is left behind");
    // By the place where it is to lie, a frame is known before it lies there.
    let reference = images[1]["path"].as_str().expect("a path");
    let all = ["clip.avi", "--reference", reference, "--project", "pano.json"];
    desk.stitch(&all).expect_success();
    assert_eq!(desk.json("pano.json")["reference"], reference);

    // What is read is not replaced, though it was made.
    desk.stitch(&["clip.avi", "pano-frames"]).expect_failure(1, &["it is to be read, and lies in pano-frames"]);
    assert!(frames(&desk, "pano-frames") == known);
    desk.put("pano-frames/letter.txt", "Dear diary");
    desk.stitch(&["clip.avi"])
        .expect_failure(1, &["pano-frames: what is made for the panorama belongs there", "letter.txt"]);
    assert!(desk.join("pano-frames/letter.txt").is_file());
    let mut piped = trueup(desk.path(), &["stitch", "clip.avi", "-o", "-"]);
    piped.env_remove("CI");
    finish(piped).expect_failure(1, &["clip.avi: it is a video, whose frames are kept beside the panorama"]);
}

/// Name and content of every frame in a folder, by name.
fn frames(desk: &Desk, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(desk.join(folder)).expect("a folder").map(|entry| entry.expect("readable").path());
    let frames = entries.filter(|path| path.extension().is_some_and(|extension| extension == "png"));
    let frame = |path: PathBuf| (path.display().to_string(), std::fs::read(&path).expect("readable"));
    frames.map(frame).collect()
}

/// Another program may well have taken the photographs out of a video, and called them as this one does.
#[test]
fn photographs_in_the_folder_of_the_frames_are_not_replaced() {
    let Some(desk) = clip() else { return };
    std::fs::create_dir(desk.join("pano-frames")).expect("made");
    desk.put("pano-frames/frame-000001.png", "my own");
    desk.stitch(&["clip.avi"]).expect_failure(1, &["pano-frames: ", "frame-000001.png"]);
    desk.stitch(&["clip.avi", "pano-frames"]).expect_failure(1, &["pano-frames/frame-000001.png: it is to be read"]);
    assert_eq!(desk.read("pano-frames/frame-000001.png"), b"my own");
    assert_eq!(desk.files(), ["clip.avi", "pano-frames"]);
}

#[test]
fn a_damaged_video_is_left_out_as_a_damaged_photograph_is() {
    let Some(desk) = clip() else { return };
    desk.put("bad.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
    let run = desk.stitch(&["bad.mp4", "clip.avi", "--project", "pano.json"]);
    let said = run.expect_success();
    assert!(said.contains("bad.mp4: it is a video, and ffmpeg cannot take its frames out"), "{said}");
    let project = desk.json("pano.json");
    let images = project["images"].as_array().expect("images");
    let bad = images.iter().find(|image| image["path"] == "bad.mp4").expect("it is listed");
    assert!(bad["status"] == "left_out" && bad["reason"].as_str().expect("a reason").contains("ffmpeg"), "{bad}");
    assert!(project["diagnostics"].as_array().expect("findings").iter().any(|one| one["code"] == "video-unusable"));
    assert!(images.iter().filter(|image| image["status"] == "used").count() >= 2);
    let refused = desk.stitch(&["bad.mp4", "clip.avi", "--require-all"]);
    refused.expect_failure(1, &["all are required", "bad.mp4: it is a video"]);
    desk.stitch(&["bad.mp4"]).expect_failure(1, &["bad.mp4: it is a video, and ffmpeg cannot take its frames out"]);
}

/// A clip whose camera was turned upright on the way, as some telephones write it: its frames would be squeezed, and
/// numbered twice.
#[test]
fn a_video_whose_frames_change_their_size_is_refused() {
    let Some(desk) = clip() else { return };
    let frames = [noise(1, 480, 360), noise(2, 480, 360), noise(3, 360, 480), noise(4, 360, 480)].concat();
    desk.put("frames.mjpeg", frames);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(desk.path()).args([
        "-v",
        "error",
        "-f",
        "mjpeg",
        "-i",
        "frames.mjpeg",
        "-c",
        "copy",
        "turned.mkv",
    ]);
    assert!(ffmpeg.status().expect("ffmpeg runs").success(), "a clip is made");
    let before = desk.files();
    desk.stitch(&["turned.mkv"])
        .expect_failure(1, &["turned.mkv: it is a video whose frames change their size or kind on the way"]);
    assert_eq!(desk.files(), before, "nothing is left behind");
}

#[test]
fn without_ffmpeg_a_video_says_what_is_missing() {
    let desk = Desk::new();
    desk.put("clip.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
    let mut command = trueup(desk.path(), &["stitch", "clip.mp4", "-o", "pano.jpg"]);
    command.env("PATH", desk.path());
    finish(command).expect_failure(
        1,
        &[
            "clip.mp4: it is a video, and ffmpeg, which takes frames out of videos, is not installed",
            "apt install ffmpeg",
        ],
    );
    assert_eq!(desk.files(), ["clip.mp4"], "nothing is left behind");
}
