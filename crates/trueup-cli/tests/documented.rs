//! The table of bad inputs in docs/command-line.md holds what is really printed.

use crate::full_turn::photographs;
use crate::pictures::{
    HEIGHT, WIDTH, claiming, digital_negative, noise, plain, put_street, street, street_pixels, street_truth,
};
use crate::run::{Desk, finish, trueup};

const PAGE: &str = include_str!("../../../docs/command-line.md");

/// What in a row of the page stands for anything: for what depends on counts of matches, and for lists that grow with
/// what there is.
const LEFT_OPEN: &str = " ...";

/// A way to go wrong.
struct Mistake {
    what: &'static str,
    arguments: &'static [&'static str],
}

const fn mistake(what: &'static str, arguments: &'static [&'static str]) -> Mistake {
    Mistake { what, arguments }
}

const MISTAKES: &[Mistake] = &[
    mistake("no such file", &["stitch", "none.jpg", "-o", "pano.jpg"]),
    mistake("pattern without match", &["stitch", "none*.jpg", "-o", "pano.jpg"]),
    mistake("folder without photographs", &["stitch", "notes", "-o", "pano.jpg"]),
    mistake("text file named .jpg", &["stitch", "text.jpg", "-o", "pano.jpg"]),
    mistake("another format", &["stitch", "movie.gif", "-o", "pano.jpg"]),
    mistake("camera raw", &["stitch", "raw.dng", "-o", "pano.jpg"]),
    mistake("damaged HEIC", &["stitch", "phone.heic", "-o", "pano.jpg"]),
    mistake("damaged AVIF", &["stitch", "phone.avif", "-o", "pano.jpg"]),
    mistake("truncated JPEG XL", &["stitch", "photo.jxl", "-o", "pano.jpg"]),
    mistake("video without frames", &["stitch", "clip.mp4", "-o", "pano.jpg"]),
    mistake("empty file", &["stitch", "empty.jpg", "-o", "pano.jpg"]),
    mistake("truncated JPEG", &["stitch", "cut.jpg", "-o", "pano.jpg"]),
    mistake("JPEG whose data were replaced", &["stitch", "holed.jpg", "-o", "pano.jpg"]),
    mistake("header that claims 60000 x 60000", &["stitch", "giant.jpg", "-o", "pano.jpg"]),
    mistake("8 x 8 pixels", &["stitch", "dot.jpg", "-o", "pano.jpg"]),
    mistake("several files, none usable", &["stitch", "text.jpg", "empty.jpg", "-o", "pano.jpg"]),
    mistake("too little memory", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--memory", "100MB"]),
    mistake("black photographs", &["stitch", "black.jpg", "white.jpg", "-o", "pano.jpg"]),
    mistake("photograph and its small copy", &["stitch", "b.jpg", "small.png", "-o", "pano.jpg"]),
    mistake("unrelated photographs", &["stitch", "noise1.jpg", "noise2.jpg", "noise3.jpg", "-o", "pano.jpg"]),
    mistake(
        "a method that cannot place them",
        &["stitch", "turn0.jpg", "turn1.jpg", "turn2.jpg", "turn3.jpg", "-o", "pano.jpg", "--method", "homography"],
    ),
    mistake(
        "`--require-all`, one unrelated",
        &["stitch", "a.jpg", "b.jpg", "noise1.jpg", "-o", "pano.jpg", "--require-all"],
    ),
    mistake("`--graph` with an unknown name", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--graph", "graph.txt"]),
    mistake("`--graph` without a file", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--graph", "none.txt"]),
    mistake("unknown `--reference`", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--reference", "q.jpg"]),
    mistake("output folder does not exist", &["stitch", "a.jpg", "b.jpg", "-o", "none/pano.jpg"]),
    mistake("output is a folder", &["stitch", "a.jpg", "b.jpg", "-o", "notes.jpg"]),
    mistake("output is a photograph", &["stitch", "a.jpg", "b.jpg", "-o", "a.jpg"]),
    mistake("one place for two files", &["stitch", "a.jpg", "-o", "pano.png", "--seams", "./pano.png"]),
    mistake(
        "output is the configuration",
        &["stitch", "a.jpg", "-o", "pano.jpg", "--config", "half.toml", "--project", "half.toml"],
    ),
    mistake(
        "output is the graph",
        &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--graph", "graph.txt", "--pto", "graph.txt"],
    ),
    mistake("output is the project composed", &["compose", "pano.json", "-o", "pano.jpg", "--pto", "./pano.json"]),
    mistake("scratch folder does not exist", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--scratch", "none"]),
    mistake(
        "transparent background in JPEG",
        &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--background", "transparent"],
    ),
    mistake("output format unknown", &["stitch", "a.jpg", "b.jpg", "-o", "pano.gif"]),
    mistake("option out of range", &["stitch", "a.jpg", "-o", "pano.jpg", "--scale", "-1"]),
    mistake("viewer turned on the mesh", &["stitch", "a.jpg", "-o", "pano.jpg", "--projection", "mesh", "--yaw", "30"]),
    mistake("option of the wrong kind", &["stitch", "a.jpg", "-o", "pano.jpg", "--seed", "soon"]),
    mistake("unknown option", &["stitch", "a.jpg", "-o", "pano.jpg", "--set", "mesh.cell=3"]),
    mistake("no configuration file", &["stitch", "a.jpg", "-o", "pano.jpg", "--config", "none.toml"]),
    mistake("unknown table in it", &["stitch", "a.jpg", "-o", "pano.jpg", "--config", "mine.toml"]),
    mistake("unknown method to compare", &["compare", "a.jpg", "b.jpg", "-o", "out", "--methods", "magic"]),
    mistake("entry without a name", &["compare", "a.jpg", "b.jpg", "-o", "out", "--entry", "mesh.cell_px=20"]),
    mistake(
        "entry that departs in matching",
        &["compare", "a.jpg", "b.jpg", "-o", "out", "--entry", "x: matching.max_distance_ratio=0.5"],
    ),
    mistake(
        "ranking of what is not compared",
        &["compare", "a.jpg", "b.jpg", "-o", "out", "--methods", "vpg", "--rank", "vpg,magic"],
    ),
    mistake("comparison over other files", &["compare", "a.jpg", "b.jpg", "-o", "notes"]),
    mistake("comparison over a file", &["compare", "b.jpg", "c.jpg", "-o", "a.jpg"]),
    mistake("tally of other files", &["compare", "--tally", "other.json"]),
    mistake("mask of another size", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--mask", "b.jpg=dot.jpg"]),
    mistake(
        "name of several photographs",
        &["stitch", "d1/x.jpg", "d2/x.jpg", "-o", "pano.jpg", "--mask", "x.jpg=dot.jpg"],
    ),
    mistake("mask of no photograph", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--mask", "q.jpg=dot.jpg"]),
    mistake("mask without a name", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--mask", "dot.jpg"]),
    mistake("cache over a file", &["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg", "--cache", "dot.jpg"]),
    mistake("another geometry to compose", &["compose", "pano.json", "-o", "pano.jpg", "--set", "mesh.cell_px=30"]),
    mistake("project edited to nonsense", &["compose", "nonsense.json", "-o", "pano.jpg"]),
    mistake("project with a lens that cannot be", &["compose", "lens.json", "-o", "pano.jpg"]),
    mistake("project with a focal length below zero", &["compose", "minus.json", "-o", "pano.jpg"]),
    mistake("project with an option out of range", &["evaluate", "range.json"]),
    mistake("photograph that is gone", &["compose", "gone.json", "-o", "pano.jpg"]),
    mistake("no project file", &["inspect", "none.json"]),
    mistake("not a project file", &["inspect", "other.json"]),
    mistake("project of a later version", &["inspect", "later.json"]),
    mistake("no truth file", &["evaluate", "pano.json", "--truth", "none.json"]),
    mistake("not a truth file", &["evaluate", "pano.json", "--truth", "other.json"]),
    mistake("truth with a rotation that is none", &["evaluate", "pano.json", "--truth", "bent.json"]),
    mistake("truth of other photographs", &["evaluate", "pano.json", "--truth", "strange.json"]),
    mistake("truth of photographs of another size", &["evaluate", "pano.json", "--truth", "small.json"]),
    mistake("truth that knows one photograph", &["evaluate", "pano.json", "--truth", "one.json"]),
];

fn desk() -> Desk {
    let desk = Desk::new();
    put_street(&desk);
    for folder in ["notes", "notes.jpg"] {
        std::fs::create_dir(desk.join(folder)).expect("a folder");
    }
    let whole = &street()[0];
    desk.put("notes/diary.txt", "Dear diary");
    desk.put("text.jpg", "Dear diary");
    desk.put("movie.gif", "GIF89a....");
    desk.put("raw.dng", digital_negative());
    desk.put("phone.heic", b"\0\0\0\x18ftypheic\0\0\0\0");
    desk.put("phone.avif", b"\0\0\0\x18ftypavif\0\0\0\0");
    desk.put("photo.jxl", b"\xff\x0a\xfa\x1f\x01\x90\x01\0");
    desk.put("clip.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
    desk.put("empty.jpg", "");
    desk.put("cut.jpg", &whole[..whole.len() / 2]);
    let mut holed = whole.clone();
    let (from, length) = (whole.len() / 4, 1024);
    holed[from..from + length].fill(0);
    desk.put("holed.jpg", holed);
    for (folder, bytes) in ["d1", "d2"].iter().zip(street()) {
        std::fs::create_dir(desk.join(folder)).expect("a folder");
        desk.put(&format!("{folder}/x.jpg"), bytes);
    }
    let (width, height) = (WIDTH as u32, HEIGHT as u32);
    let second = image::RgbImage::from_raw(width, height, street_pixels()[1].clone()).expect("its size");
    image::imageops::thumbnail(&second, width / 2, height / 2).save(desk.join("small.png")).expect("written");
    desk.put("giant.jpg", claiming(whole, 60_000, 60_000));
    desk.put("dot.jpg", plain(8, 8, 90));
    desk.put("black.jpg", plain(320, 240, 0));
    desk.put("white.jpg", plain(320, 240, 255));
    for seed in 1..4 {
        desk.put(&format!("noise{seed}.jpg"), noise(seed, 320, 240));
    }
    for (number, bytes) in photographs().iter().take(4).enumerate() {
        desk.put(&format!("turn{number}.jpg"), bytes);
    }
    desk.put("graph.txt", "a.jpg -- q.jpg\n");
    desk.put("half.toml", "[canvas]\nscale = 0.5\n");
    desk.put("mine.toml", "[mash]\ncell_px = 30\n");
    desk.put("other.json", "{}");
    desk.stitch(&["a.jpg", "b.jpg", "--project", "pano.json"]).expect_success();
    std::fs::remove_file(desk.join("pano.jpg")).expect("removed");
    let project = String::from_utf8(desk.read("pano.json")).expect("UTF-8");
    desk.put("nonsense.json", project.replacen("\"gain\":[", "\"gain\":[-", 1));
    let changed = |place: &str, value: f64| {
        let mut changed = desk.json("pano.json");
        *changed.pointer_mut(place).expect("such a place") = value.into();
        changed.to_string()
    };
    desk.put("lens.json", changed("/images/0/focal_px", 3e8));
    desk.put("minus.json", changed("/images/0/focal_px", -1.0));
    desk.put("range.json", changed("/options/canvas/scale", -1.0));
    desk.put("gone.json", project.replace("a.jpg", "gone.jpg"));
    let truth = street_truth();
    desk.put("bent.json", truth.replacen("\"R\":[[", "\"R\":[[7", 1));
    desk.put("strange.json", truth.replace(".jpg", ".png"));
    desk.put("small.json", truth.replace("\"width\":480", "\"width\":240"));
    desk.put("one.json", truth.replace("b.jpg", "b.png"));
    desk.put("later.json", "{\"format\": \"trueup-project\", \"version\": 99}");
    desk
}

/// Whether a row of the page says what is printed.
fn says(row: &str, printed: &str) -> bool {
    let Some((start, rest)) = row.split_once(LEFT_OPEN) else { return row == printed };
    let Some(mut printed) = printed.strip_prefix(start) else { return false };
    let mut parts: Vec<&str> = rest.split(LEFT_OPEN).collect();
    let end = parts.pop().unwrap_or_default();
    for part in parts {
        let Some((_, after)) = printed.split_once(part) else { return false };
        printed = after;
    }
    printed.ends_with(end)
}

#[test]
fn the_table_of_bad_inputs_is_what_is_printed() {
    let desk = desk();
    let files = desk.files();
    let mut missing = Vec::new();
    for Mistake { what, arguments } in MISTAKES {
        let run = finish(trueup(desk.path(), arguments));
        assert_eq!(run.stdout, "", "{what}");
        let mut lines = run.stderr.lines();
        let message = lines.next().and_then(|line| line.strip_prefix("trueup: error: ")).expect("an error");
        let hint = lines.next().map_or("", |line| line.strip_prefix("trueup: hint: ").expect("a hint"));
        assert_eq!(lines.next(), None, "{what}: {}", run.stderr);
        let row = format!("| {what} | {message} | {hint} | {} |", run.status);
        if !PAGE.lines().any(|line| says(line, &row)) {
            missing.push(row);
        }
    }
    assert!(missing.is_empty(), "docs/command-line.md lacks these rows:\n{}", missing.join("\n"));
    assert_eq!(desk.files(), files, "nothing is left behind");
}

/// Rows of the page that other tests show: what takes a signal, a full disk or a file system of its own, and usage,
/// which is told on several lines.
const SHOWN_ELSEWHERE: [&str; 9] = [
    "unreadable file",
    "socket, pipe or device",
    "no files named",
    "`-o` missing",
    "target takes no files",
    "disk full",
    "damaged project file",
    "Ctrl-C",
    "`kill`",
];

/// Fewest kinds of bad input of the page.
const KINDS: usize = 60;

#[test]
fn every_row_of_the_table_of_bad_inputs_is_shown_by_a_test() {
    let table = PAGE.split_once("| Input | `trueup: error: ` |").expect("the table").1;
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let kinds: Vec<&str> = rows.map(|row| row.trim_start_matches('|').split('|').next().unwrap_or("").trim()).collect();
    let is_shown = |kind: &&str| SHOWN_ELSEWHERE.contains(kind) || MISTAKES.iter().any(|mistake| mistake.what == *kind);
    let others: Vec<&&str> = kinds.iter().filter(|kind| !is_shown(kind)).collect();
    assert!(others.is_empty(), "{others:?}");
    assert!(kinds.len() >= KINDS, "{} kinds", kinds.len());
    assert!(SHOWN_ELSEWHERE.iter().all(|kind| kinds.contains(kind)), "{kinds:?}");
}
