//! Places that cannot be written to, or must not be.

use crate::pictures::{put_street, room, street_desk};
use crate::run::{Desk, finish, trueup};

#[test]
fn outputs_that_cannot_be_written() {
    let desk = street_desk();
    std::fs::create_dir(desk.join("folder.jpg")).expect("a folder");
    let to = |output: &str| finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "-o", output]));
    to("none/pano.jpg").expect_failure(1, &["none/pano.jpg: the folder none does not exist", "Create it"]);
    to("folder.jpg").expect_failure(1, &["folder.jpg: it is a folder"]);
    to("./").expect_failure(1, &["./: it is a folder"]);
    to("pano.gif").expect_failure(2, &["writing pano.gif as .gif is not supported", ".jpg, .jpeg, .png"]);
    to("pano").expect_failure(2, &["writing pano without an extension is not supported"]);
    let project = desk.stitch(&["a.jpg", "b.jpg", "--project", "none/p.json"]);
    project.expect_failure(1, &["none/p.json: the folder none does not exist"]);
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "folder.jpg"]);
}

/// A file system that takes no files, not even from root.
#[cfg(target_os = "linux")]
#[test]
fn folders_that_take_no_files() {
    let desk = street_desk();
    finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "-o", "/proc/pano.jpg"])).expect_failure(
        1,
        &["/proc: nothing can be written into this folder (No such file or directory (os error 2))\n", "Check its"],
    );
    desk.stitch(&["a.jpg", "b.jpg", "--scratch", "/proc"])
        .expect_failure(1, &["/proc: nothing can be written into this folder ("]);
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg"]);
}

/// Stitches with a limit on the size of files, which stops the writing half way, as a full disk does: that fails as
/// `said`, and leaves the old panorama as it was and nothing behind.
#[cfg(target_os = "linux")]
fn fails_on_a_full_disk(arguments: &str, said: &str) {
    let desk = street_desk();
    desk.put("pano.jpg", "the old panorama");
    let mut command = std::process::Command::new("sh");
    let script = format!("trap '' XFSZ; ulimit -f 8; exec \"$0\" stitch {arguments} -o pano.jpg");
    command.current_dir(desk.path()).args(["-c", &script, env!("CARGO_BIN_EXE_trueup")]);
    finish(command).expect_failure(1, &[said]);
    assert_eq!(desk.read("pano.jpg"), b"the old panorama");
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "pano.jpg"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_panorama_as_it_was() {
    fails_on_a_full_disk("a.jpg b.jpg", "pano.jpg: File too large");
}

/// The same for the scratch file of a canvas that does not fit in memory.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_without_room_for_the_scratch_file_leaves_nothing_behind() {
    let arguments = "a.jpg b.jpg c.jpg d.jpg --scale 6 --memory 230MB";
    fails_on_a_full_disk(arguments, "writing the scratch file in .: File too large");
}

/// The scratch folder is needed late, if at all, and looked at first.
#[test]
fn scratch_folders_that_are_none() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "--scratch", "none"])
        .expect_failure(1, &["none: there is no such folder for scratch files", "--scratch"]);
}

/// Files that were given to be read are not written over, whatever is to be written.
#[test]
fn photographs_and_masks_are_spared_before_any_work() {
    let desk = street_desk();
    desk.put("mask.png", "no picture: it is not looked into");
    let photographs = ["a.jpg", "b.jpg", "--mask", "b.jpg=mask.png"];
    for (flag, file, what) in [
        ("--project", "a.jpg", "photographs to be stitched"),
        ("--pto", "b.jpg", "photographs to be stitched"),
        ("--seams", "mask.png", "masks"),
    ] {
        let before = desk.read(file);
        let run = desk.stitch(&[&photographs[..], &[flag, file]].concat());
        run.expect_failure(1, &[&format!("{file}: this file is one of the {what}")]);
        assert_eq!(desk.read(file), before);
    }
}

/// Two groups make two panoramas; how many there are is known late.
#[test]
fn a_place_for_the_last_panorama_is_wanted_before_the_first_is_made() {
    let desk = Desk::new();
    put_street(&desk);
    for (name, bytes) in ["r1.jpg", "r2.jpg", "r3.jpg"].iter().zip(room()) {
        desk.put(name, bytes);
    }
    std::fs::create_dir(desk.join("pano-2.jpg")).expect("a folder");
    let files = desk.files();
    let photographs = ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "r1.jpg", "r2.jpg", "r3.jpg", "--all"];
    desk.stitch(&photographs).expect_failure(1, &["pano-2.jpg: it is a folder"]);
    assert_eq!(desk.files(), files);
}

/// The same place is the same place however it is spelled; what is read is not written over.
#[test]
fn one_place_is_not_taken_twice_whatever_its_spelling() {
    let desk = street_desk();
    desk.put("m.toml", "[canvas]\nscale = 0.5\n");
    desk.put("graph.txt", "a.jpg -- b.jpg\n");
    let stitch = |arguments: &[&str]| finish(trueup(desk.path(), &[&["stitch", "a.jpg", "b.jpg"], arguments].concat()));
    let twice = "it cannot be the file of both --output and --seams";
    stitch(&["-o", "x.png", "--seams", "./x.png"]).expect_failure(2, &[twice]);
    stitch(&["-o", "-", "--project", "-"]).expect_failure(2, &["both --output and --project"]);
    stitch(&["-o", "x.png", "--config", "m.toml", "--project", "./m.toml"])
        .expect_failure(1, &["./m.toml: this file is the configuration"]);
    stitch(&["-o", "x.png", "--graph", "graph.txt", "--pto", "./graph.txt"])
        .expect_failure(1, &["./graph.txt: this file is the graph"]);
    #[cfg(unix)]
    {
        // A link to a file that is not there yet: what is written second would be written over what was written first.
        std::os::unix::fs::symlink("x.png", desk.join("early.png")).expect("linked");
        stitch(&["-o", "x.png", "--seams", "early.png"]).expect_failure(2, &[twice]);
        finish(trueup(desk.path(), &["stitch", "a.jpg", "-o", "early.png", "--scale", "0.2", "--quiet"]));
        assert!(desk.join("early.png").is_symlink() && desk.join("x.png").is_file(), "{:?}", desk.files());
    }
    assert_eq!(desk.read("m.toml"), b"[canvas]\nscale = 0.5\n");
    assert_eq!(desk.read("graph.txt"), b"a.jpg -- b.jpg\n");
}

/// What leads to standard output is written there, and the summary elsewhere.
#[test]
fn a_dash_is_standard_output() {
    let desk = street_desk();
    let run = desk.stitch(&["a.jpg", "b.jpg", "--project", "-"]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    let project: serde_json::Value = serde_json::from_str(&run.stdout).expect("a project and nothing else");
    assert_eq!(project["format"], "trueup-project");
    assert!(run.stderr.contains("photographs 2 of 2 used"), "{}", run.stderr);
    let arguments = ["stitch", "a.jpg", "b.jpg", "--scale", "0.2", "--quiet", "-o", "-"];
    let output = trueup(desk.path(), &arguments).output().expect("the command starts");
    assert!(output.status.success() && output.stdout.starts_with(b"\x89PNG\r\n") && output.stderr.is_empty());
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "pano.jpg"]);
}

/// A file is not put in place of a pipe: who waits for it gets what was written.
#[cfg(unix)]
#[test]
fn pipes_are_written_through() {
    use std::os::unix::fs::FileTypeExt;
    let desk = street_desk();
    let pipe = desk.join("pipe.json");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read(pipe).expect("readable")
    });
    let run = desk.stitch(&["a.jpg", "b.jpg", "--project", "pipe.json"]);
    assert!(pipe.metadata().expect("still there").file_type().is_fifo());
    run.expect_success();
    let read: serde_json::Value = serde_json::from_slice(&reader.join().expect("read")).expect("a project");
    assert_eq!(read["format"], "trueup-project");
}

/// Each of an earlier run's pictures is called what it is.
#[test]
fn what_an_earlier_run_wrote_beside_its_panorama_is_left_out_by_what_it_is() {
    let desk = street_desk();
    let beside = ["--layers", "layers.tif", "--seams", "seams.png"];
    let stitch = |photographs: &str| desk.stitch(&[&[photographs][..], &beside].concat());
    stitch("*.jpg").expect_success();
    let before = ["pano.jpg", "layers.tif", "seams.png"].map(|name| desk.read(name));
    let run = stitch(".");
    let said = run.expect_success();
    for what in [
        "pano.jpg: it is a panorama that this program made",
        "layers.tif: it holds the layers of a panorama that this program made",
        "seams.png: it shows the seams of a panorama that this program made",
    ] {
        assert!(said.contains(what), "{said}");
    }
    assert!(["pano.jpg", "layers.tif", "seams.png"].map(|name| desk.read(name)) == before);
}

/// The panorama of an earlier run lies among the photographs, and is made again.
#[test]
fn an_older_panorama_in_the_folder_is_left_out_and_written_again() {
    let desk = street_desk();
    for arguments in [&["."][..], &["*.jpg"], &[".", "--require-all"]] {
        let before = desk.join("pano.jpg").exists().then(|| desk.read("pano.jpg"));
        let run = desk.stitch(arguments);
        let said = run.expect_success();
        assert!(said.contains("4 of "), "{said}");
        if let Some(before) = before {
            assert!(said.contains("pano.jpg: it is a panorama that this program made"), "{said}");
            assert!(desk.read("pano.jpg") == before, "the same photographs, the same panorama");
        }
    }
    // Named itself, it is a photograph, and not written over.
    desk.stitch(&["a.jpg", "b.jpg", "pano.jpg"]).expect_failure(1, &["pano.jpg: this file is one of the photographs"]);
    // A photograph of that name that bears no mark is not written over either.
    std::fs::rename(desk.join("a.jpg"), desk.join("pano.jpg")).expect("renamed");
    desk.stitch(&["."]).expect_failure(1, &["pano.jpg: this file is one of the photographs"]);
}
