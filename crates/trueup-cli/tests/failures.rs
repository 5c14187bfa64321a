//! Bad input: what is said, with which exit status, and that nothing is left behind.

use crate::full_turn::photographs;
use crate::pictures::{STREET_NAMES, claiming, noise, plain, street, street_desk};
use crate::run::{Desk, FinishedRun, finish, trueup};

/// Stitches one file of the given content beside nothing else.
fn stitch_alone(name: &str, bytes: impl AsRef<[u8]>) -> FinishedRun {
    let desk = Desk::new();
    desk.put(name, bytes);
    let run = desk.stitch(&[name]);
    assert_eq!(desk.files(), [name], "nothing is left behind");
    run
}

#[test]
fn a_text_in_disguise() {
    stitch_alone("text.jpg", "Dear diary").expect_failure(
        1,
        &[
            "trueup: error: text.jpg: its content is not a JPEG, ",
            " picture, whatever its name says\n",
            "trueup: hint: Give photographs in JPEG, ",
        ],
    );
}

#[test]
fn a_truncated_photograph() {
    let whole = &street()[0];
    stitch_alone("cut.jpg", &whole[..whole.len() / 2]).expect_failure(1, &["cut.jpg: "]);
}

#[test]
fn a_header_that_claims_a_giant() {
    stitch_alone("giant.jpg", claiming(&street()[0], 60_000, 60_000)).expect_failure(
        1,
        &["giant.jpg: 60000 x 60000 px are 3600 megapixels, at most 300 are accepted", "source.max_megapixels"],
    );
}

#[test]
fn an_empty_file() {
    stitch_alone("empty.jpg", "").expect_failure(1, &["empty.jpg: the file is empty (0 bytes)"]);
}

#[test]
fn a_photograph_of_eight_pixels() {
    stitch_alone("dot.jpg", plain(8, 8, 90))
        .expect_failure(1, &["dot.jpg: 8 x 8 px are too few to stitch, each side needs 16"]);
}

/// A folder of photographs, one of whose names is none of text, is stitched; composed again, that one is found in its
/// folder.
#[cfg(target_os = "linux")]
#[test]
fn a_project_of_a_name_that_is_not_utf8_says_what_to_do() {
    use std::os::unix::ffi::OsStrExt;
    let desk = street_desk();
    let folder = desk.join("in");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::rename(desk.join("a.jpg"), folder.join(std::ffi::OsStr::from_bytes(b"a\xff.jpg"))).expect("moved");
    std::fs::rename(desk.join("b.jpg"), folder.join("b.jpg")).expect("moved");
    let stitch = ["stitch", "in", "-o", "p.jpg", "--project", "p.json", "--set", "canvas.scale=0.3"];
    finish(trueup(desk.path(), &stitch)).expect_success();
    let compose = ["compose", "p.json", "-o", "again.jpg"];
    let said = "in/a\u{fffd}.jpg: photograph not found: its name is no UTF-8";
    finish(trueup(desk.path(), &compose)).expect_failure(1, &[said, "after --photos"]);
    finish(trueup(desk.path(), &[&compose[..], &["--photos", "in"]].concat())).expect_success();
}

/// Beside the program's own photographs lies one whose name is none of text: a pattern and its folder find the others;
/// named, it is named in the answer.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let desk = street_desk();
    let name = std::ffi::OsStr::from_bytes(b"n\xff.txt");
    std::fs::write(desk.path().join(name), "no picture").expect("written");
    desk.stitch(&["*.jpg"]).expect_success();
    let mut named = trueup(desk.path(), &["stitch", "-o", "z.jpg"]);
    named.arg(name);
    finish(named).expect_failure(2, &["the name \"n\u{fffd}.txt\" is not UTF-8; rename it"]);
}

#[test]
fn missing_files_folders_and_patterns() {
    let desk = Desk::new();
    std::fs::create_dir(desk.join("empty")).expect("a folder");
    desk.put("empty/notes.txt", "no picture");
    desk.stitch(&[""]).expect_failure(2, &["a value is required for '<PHOTOS>...'"]);
    desk.stitch(&["none.jpg"]).expect_failure(1, &["none.jpg: there is no such file or folder"]);
    desk.stitch(&["empty"]).expect_failure(1, &["empty: the folder holds no JPEG, ", " files\n"]);
    desk.stitch(&["none*.jpg"]).expect_failure(1, &["none*.jpg: no JPEG, ", " file matches the pattern\n"]);
    let both = desk.stitch(&["none.jpg", "empty"]);
    both.expect_failure(1, &["none.jpg: there is no such file", "empty: the folder holds no"]);
}

#[cfg(unix)]
#[test]
fn files_that_cannot_be_opened_by_anybody() {
    let desk = Desk::new();
    let _socket = std::os::unix::net::UnixListener::bind(desk.join("socket.jpg")).expect("a socket");
    desk.stitch(&["socket.jpg"]).expect_failure(1, &["socket.jpg: it is not a regular file"]);
    std::os::unix::fs::symlink("loop.jpg", desk.join("loop.jpg")).expect("a link to itself");
    desk.stitch(&["loop.jpg"]).expect_failure(1, &["loop.jpg: it cannot be read (Too many levels of symbolic links"]);
    desk.put("file", "no folder");
    desk.stitch(&["file/a.jpg"]).expect_failure(1, &["a.jpg: it cannot be read (Not a directory"]);
}

/// Root may read every file: then the command runs as nobody.
#[cfg(unix)]
#[test]
fn a_file_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65_534;

    let desk = Desk::new();
    desk.put("secret.jpg", &street()[0]);
    let allow = |name: &str, mode: u32| {
        std::fs::set_permissions(desk.join(name), std::fs::Permissions::from_mode(mode)).expect("own file");
    };
    allow("secret.jpg", 0o000);
    allow("", 0o777);
    let arguments = ["stitch", "secret.jpg", "-o", "pano.jpg"];
    let mut command = trueup(desk.path(), &arguments);
    if std::fs::File::open(desk.join("secret.jpg")).is_ok() {
        // Nobody may not look into every folder that a program lies in, but into this one.
        let program = desk.join("trueup");
        std::fs::copy(env!("CARGO_BIN_EXE_trueup"), &program).expect("copied");
        command = std::process::Command::new(program);
        command.current_dir(desk.path()).args(arguments).uid(NOBODY).gid(NOBODY);
    }
    finish(command).expect_failure(1, &["secret.jpg: it cannot be read (Permission denied"]);
}

#[test]
fn two_identical_files_are_one_photograph() {
    let desk = Desk::new();
    desk.put("one.jpg", &street()[0]);
    desk.put("two.jpg", &street()[0]);
    let run = desk.stitch(&["one.jpg", "two.jpg"]);
    for part in
        ["photographs 1 of 2 used", "two.jpg: it has the same bytes as one.jpg, which is used", "only one photograph"]
    {
        assert!(run.expect_success().contains(part), "\"{part}\" is not in\n{}", run.stdout);
    }
}

#[test]
fn photographs_that_do_not_overlap() {
    let desk = Desk::new();
    for seed in 1..4 {
        desk.put(&format!("{seed}.jpg"), noise(seed, 320, 240));
    }
    let run = desk.stitch(&["1.jpg", "2.jpg", "3.jpg"]);
    run.expect_failure(
        1,
        &["no overlapping photographs found; the best pair is ", "trueup: hint: Photographs must share"],
    );
    assert!(run.stderr.contains(" matches agree (") || run.stderr.contains(" matching points"), "{}", run.stderr);
    assert_eq!(desk.files(), ["1.jpg", "2.jpg", "3.jpg"]);
}

#[test]
fn black_photographs() {
    let desk = Desk::new();
    desk.put("black.jpg", plain(320, 240, 0));
    desk.put("white.jpg", plain(320, 240, 255));
    desk.stitch(&["black.jpg", "white.jpg"]).expect_failure(1, &["no overlapping photographs found"]);
    // A reference that was not given is found before the photographs are measured.
    desk.stitch(&["black.jpg", "white.jpg", "--reference", "q.jpg"])
        .expect_failure(1, &["q.jpg: no photograph of this name was given, so it cannot be the reference"]);
}

#[test]
fn a_method_that_cannot_place_the_photographs() {
    let desk = Desk::new();
    // Of four photographs 36 degrees apart one is at least two steps from the reference: with half its own width, 32
    // degrees, it reaches beyond 90.
    let names = ["0.jpg", "1.jpg", "2.jpg", "3.jpg"];
    for (name, bytes) in names.iter().zip(photographs()) {
        desk.put(name, bytes);
    }
    let run = desk.stitch(&[&names[..], &["--method", "homography"]].concat());
    run.expect_failure(
        1,
        &[
            "trueup: error: the method homography is not applicable: ",
            " does not lie in front of the panorama's plane; it reaches ",
            " degrees from the axis of ",
            "trueup: hint: Use the method vpg or autostitch, or stitch fewer photographs.",
        ],
    );
    assert_eq!(desk.files(), names, "nothing is left behind");
}

#[test]
fn all_required_but_one_bad() {
    let desk = street_desk();
    desk.put("text.jpg", "no picture");
    desk.put("noise.jpg", noise(5, 320, 240));
    let photographs = [&STREET_NAMES[..], &["text.jpg", "noise.jpg", "--require-all"]].concat();
    desk.stitch(&photographs).expect_failure(
        1,
        &[
            "2 of 6 photographs: they cannot be used although all are required",
            "text.jpg: its content",
            "noise.jpg: no overlap",
        ],
    );
    assert!(!desk.files().contains(&"pano.jpg".to_owned()));
    assert!(desk.stitch(&[&STREET_NAMES[..], &["--require-all"]].concat()).expect_success().contains("4 of 4 used"));
}

#[test]
fn graphs_and_references_that_fit_no_photograph() {
    let desk = street_desk();
    desk.put("graph.txt", "# who overlaps whom\na.jpg -- b.jpg\nb.jpg -- q.jpg\n");
    desk.stitch(&["a.jpg", "b.jpg", "--graph", "graph.txt"])
        .expect_failure(1, &["graph.txt, line 3: \"q.jpg\" is none of the 2 photographs given"]);
    desk.stitch(&["a.jpg", "b.jpg", "--graph", "none.txt"])
        .expect_failure(1, &["reading none.txt: No such file or directory"]);
    desk.stitch(&["a.jpg", "b.jpg", "--reference", "q.jpg"])
        .expect_failure(1, &["q.jpg: no photograph of this name was given, so it cannot be the reference"]);
}

#[test]
fn too_little_memory_is_refused_before_the_work() {
    let desk = street_desk();
    desk.put("pano.jpg", "the old panorama");
    desk.stitch(&["a.jpg", "b.jpg", "--memory", "200MB"])
        .expect_failure(1, &["measuring ", "at least ", " MB of memory needed, 200 MB allowed", "Raise --memory"]);
    assert_eq!(desk.read("pano.jpg"), b"the old panorama");
    desk.stitch(&["a.jpg", "b.jpg", "--memory", "2"]).expect_failure(2, &["--memory 2: ", "auto | 2GB | 512MB"]);
}

#[test]
fn a_failure_leaves_the_old_panorama_as_it_was() {
    let desk = Desk::new();
    desk.put("pano.jpg", "the old panorama");
    desk.put("text.jpg", "no picture");
    desk.stitch(&["text.jpg"]).expect_failure(1, &["text.jpg"]);
    assert_eq!(desk.read("pano.jpg"), b"the old panorama");
}

#[test]
fn project_files_that_are_none() {
    let desk = Desk::new();
    desk.put("noise.json", [0xff, 0x00, 0x80]);
    desk.put("other.json", "{\"format\": \"something\"}");
    desk.put("later.json", "{\"format\": \"trueup-project\", \"version\": 99}");
    desk.put("damaged.json", "{\"format\": \"trueup-project\", \"version\": 1, \"images\": 3}");
    let inspect = |name: &str| finish(trueup(desk.path(), &["inspect", name]));
    inspect("noise.json")
        .expect_failure(1, &["noise.json: not a project file", "that `trueup stitch --project` wrote"]);
    inspect("other.json").expect_failure(1, &["other.json: its format is not \"trueup-project\""]);
    inspect("later.json")
        .expect_failure(1, &["later.json: its version is 99, this program reads versions 1 to 2", "or a later one"]);
    inspect("damaged.json").expect_failure(1, &["damaged.json: the project is damaged ("]);
    inspect("none.json").expect_failure(1, &["reading none.json: No such file or directory"]);
    inspect(".").expect_failure(1, &[".: it is a folder", "that `trueup stitch --project` wrote"]);
}

#[test]
fn a_project_cut_short_is_refused() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "--project", "p.json"]).expect_success();
    let whole = desk.read("p.json");
    desk.put("cut.json", &whole[..whole.len() / 2]);
    finish(trueup(desk.path(), &["inspect", "cut.json"])).expect_failure(1, &["cut.json: not a project file ("]);
}

/// The canvas is known long before the panorama is.
#[test]
fn a_panorama_larger_than_its_format_is_refused_before_it_is_composed() {
    let desk = street_desk();
    let large = ["-o", "pano.webp", "--scale", "16", "--crop", "none", "--set", "canvas.max_pixels=1e9"];
    let arguments = [&["stitch"], &STREET_NAMES[..], &large, &["--set", "canvas.max_growth=1000"]].concat();
    finish(trueup(desk.path(), &arguments))
        .expect_failure(1, &["pano.webp: ", " px needed, 16383 px per side allowed", "trueup: hint: "]);
    assert!(!desk.join("pano.webp").exists());
    let long = format!("{}.jpg", "p".repeat(251));
    let command = |name: &str| finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "--all", "-o", name]));
    command(&long).expect_failure(1, &["its name is too long"]);
    // Of several, it would have a number.
    command(&long[1..]).expect_failure(1, &["its name is too long"]);
}

/// Names of files may hold line ends.
#[cfg(unix)]
#[test]
fn an_error_is_a_line_whatever_is_named() {
    let desk = Desk::new();
    desk.put("a\ntrueup: hint: Believe me.\n.jpg", "no picture");
    let run = desk.stitch(&["-q", "a\ntrueup: hint: Believe me.\n.jpg"]);
    run.expect_failure(1, &["a\\ntrueup: hint: Believe me.\\n.jpg: its content is not"]);
    assert_eq!(run.stderr.lines().filter(|line| line.starts_with("trueup: hint: ")).count(), 1, "{}", run.stderr);
}
