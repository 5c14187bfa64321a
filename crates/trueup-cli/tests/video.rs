//! Videos among the photographs.

use std::process::Command;

use crate::pictures::put_street;
use crate::run::{Desk, finish, trueup};

/// A clip that shows each photograph of the street for three frames; `None` where ffmpeg is not installed, as `.ci/run` sees to.
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
    assert_eq!(std::fs::read_dir(desk.join("pano-frames")).expect("a folder").count(), images.len());
    let said = project["diagnostics"].as_array().expect("findings");
    assert!(said.iter().any(|one| one["code"] == "frames-taken"));

    // Composed again from the frames; and stitched again over them.
    finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.jpg"])).expect_success();
    let bytes = |name: &str| std::fs::read(desk.join(name)).expect("written");
    assert_eq!(bytes("again.jpg"), bytes("pano.jpg"));
    desk.stitch(&["clip.avi"]).expect_success();
    assert_eq!(bytes("again.jpg"), bytes("pano.jpg"));

    desk.put("pano-frames/letter.txt", "Dear diary");
    desk.stitch(&["clip.avi"])
        .expect_failure(1, &["pano-frames: what is made for the panorama belongs there", "letter.txt"]);
    assert!(desk.join("pano-frames/letter.txt").is_file());
    let mut piped = trueup(desk.path(), &["stitch", "clip.avi", "-o", "-"]);
    piped.env_remove("CI");
    finish(piped).expect_failure(1, &["clip.avi: it is a video, whose frames are kept beside the panorama"]);
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
