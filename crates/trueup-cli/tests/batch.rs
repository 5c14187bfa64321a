//! `trueup batch`: a tree of folders, stopped and gone on with.

#[cfg(unix)]
use std::process::Child;
use std::process::Command;
#[cfg(unix)]
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::pictures::street;
use crate::run::{Desk, finish, trueup};

/// Folders of a street each, one of noise, one with a single photograph.
fn tree(streets: usize) -> Desk {
    let desk = Desk::new();
    let folder = |name: &str| std::fs::create_dir_all(desk.join(name)).expect("a folder");
    for number in 1..=streets {
        folder(&format!("in/street {number}"));
        for (name, bytes) in ["a.jpg", "b.jpg", "c.jpg"].iter().zip(street()) {
            desk.put(&format!("in/street {number}/{name}"), bytes);
        }
    }
    folder("in/bad");
    desk.put("in/bad/x.jpg", "no picture");
    desk.put("in/bad/y.jpg", "none either");
    folder("in/lonely");
    desk.put("in/lonely/a.jpg", &street()[0]);
    desk
}

const QUICK: [&str; 4] = ["--set", "canvas.scale=0.5", "--threads", "1"];

fn batch(desk: &Desk, more: &[&str]) -> Command {
    trueup(desk.path(), &[&["batch", "in", "-o", "out"], &QUICK[..], more].concat())
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
}

fn statuses(lines: &[Value]) -> Vec<(String, String)> {
    let text = |line: &Value, field: &str| line[field].as_str().expect("a text").to_owned();
    lines.iter().map(|line| (text(line, "set"), text(line, "status"))).collect()
}

#[test]
fn every_set_is_stitched_once_and_a_bad_one_stops_nothing() {
    let desk = tree(2);
    let plan = finish(batch(&desk, &["--dry-run"]));
    assert_eq!(
        plan.expect_success(),
        "bad: 2 photographs\nlonely: 1 photograph, which makes no panorama\nstreet 1: 3 photographs\nstreet 2: 3 photographs\n"
    );
    assert!(!desk.join("out").exists(), "a dry run writes nothing");

    let first = finish(batch(&desk, &["--json"]));
    assert_eq!(first.status, 3, "{}", first.stderr);
    assert!(first.stderr.contains("1 set made no panorama"), "{}", first.stderr);
    let told = lines(&first.stdout);
    let expected = [("bad", "failed"), ("lonely", "alone"), ("street 1", "made"), ("street 2", "made")];
    assert_eq!(statuses(&told), expected.map(|(set, status)| (set.to_owned(), status.to_owned())));
    assert!(told[0]["error"].as_str().is_some_and(|error| !error.is_empty()));
    let made = &told[2];
    assert_eq!((&made["format"], &made["version"]), (&"trueup-batch".into(), &1.into()));
    assert_eq!(made["panorama"], "street 1/panorama.jpg");
    assert_eq!(made["used"].as_array().map(Vec::len), Some(3));
    assert_eq!(desk.read("out/batch.jsonl"), first.stdout.as_bytes());
    let page = String::from_utf8(desk.read("out/index.html")).expect("UTF-8");
    assert!(page.contains("street%201&#x2f;thumbnail.jpg") || page.contains("./street%201/thumbnail.jpg"), "{page}");
    let table = String::from_utf8(desk.read("out/batch.csv")).expect("UTF-8");
    assert_eq!(table.lines().count(), 5, "{table}");
    assert!(table.contains("\"street 2\",\"made\",\"3\",\"3\",\"street 2/panorama.jpg\""), "{table}");
    assert!(desk.join("out/street 1/thumbnail.jpg").is_file() && desk.join("out/street 1/panorama.json").is_file());

    // Nothing is made again: not even the failed one.
    let again = finish(batch(&desk, &["--json"]));
    assert_eq!((again.status, again.stdout.as_str()), (3, ""), "{}", again.stderr);
    // But what is gone, and what was asked for.
    std::fs::remove_file(desk.join("out/street 2/panorama.jpg")).expect("removed");
    let again = finish(batch(&desk, &["--json", "--retry", "--jobs", "2"]));
    let mut remade = statuses(&lines(&again.stdout));
    remade.sort();
    assert_eq!(remade.iter().map(|(set, _)| set.as_str()).collect::<Vec<_>>(), ["bad", "street 2"]);
    assert_eq!(desk.read("out/street 1/panorama.jpg"), desk.read("out/street 2/panorama.jpg"), "the same photographs");
    // A set that was mended is tried without being asked.
    for (name, bytes) in ["x.jpg", "y.jpg"].iter().zip(street()) {
        desk.put(&format!("in/bad/{name}"), bytes);
    }
    let mended = finish(batch(&desk, &[]));
    let told = mended.expect_success();
    assert!(told.starts_with("bad: bad/panorama.jpg  "), "{told}");
    assert!(told.ends_with("3 panoramas of 4 sets, 1 is a single photograph: out/index.html\n"), "{told}");
}

/// A folder of photographs that is called like a file of the batch, and one whose set can be given no folder: both fail
/// with what to do about it, the others are made, and the files of all sets tell so.
#[test]
fn a_set_that_can_have_no_folder_stops_nothing() {
    let desk = tree(1);
    std::fs::remove_dir_all(desk.join("in/bad")).expect("removed");
    std::fs::create_dir(desk.join("in/batch.csv")).expect("a folder");
    for (name, bytes) in ["a.jpg", "b.jpg"].iter().zip(street()) {
        desk.put(&format!("in/batch.csv/{name}"), bytes);
    }
    std::fs::create_dir(desk.join("out")).expect("a folder");
    desk.put("out/lonely", "a file");
    for _ in 0..2 {
        let ended = finish(batch(&desk, &["--quiet"]));
        assert_eq!(ended.status, 3, "{}", ended.stderr);
        let all = lines(&String::from_utf8(desk.read("out/batch.jsonl")).expect("UTF-8"));
        let expected = [("batch.csv", "failed"), ("lonely", "failed"), ("street 1", "made")];
        assert_eq!(statuses(&all), expected.map(|(set, status)| (set.to_owned(), status.to_owned())));
        assert_eq!(all[0]["hint"], "Rename the folder of its photographs.");
        assert!(all[1]["hint"].as_str().is_some_and(|hint| hint.contains("permissions")), "{}", all[1]);
    }
    let table = String::from_utf8(desk.read("out/batch.csv")).expect("UTF-8");
    assert!(table.contains("\"batch.csv\",\"failed\""), "{table}");
}

/// A site in the folder for the panoramas, a table, lines of another program: nothing is written beside them, either.
#[test]
fn files_of_all_sets_that_no_batch_has_written_are_never_replaced() {
    let desk = tree(0);
    std::fs::create_dir(desk.join("out")).expect("a folder");
    for name in ["index.html", "batch.csv", "batch.jsonl"] {
        let file = format!("out/{name}");
        desk.put(&file, "<html>mine");
        let said = format!("{file}: a file of this name is there that no batch has written");
        finish(batch(&desk, &[])).expect_failure(1, &[&said, "Move it away, or choose another folder"]);
        assert_eq!(desk.read(&file), b"<html>mine");
        assert_eq!(files(&desk.join("out")), [name], "nothing beside it");
        std::fs::remove_file(desk.join(&file)).expect("removed");
    }
    // Its own are known again, and what is empty has nothing to lose.
    for _ in 0..2 {
        desk.put("out/batch.csv", "");
        assert_eq!(finish(batch(&desk, &[])).status, 3, "the bad set");
    }
    assert!(desk.read("out/batch.csv").starts_with(b"\"set\""));
}

#[test]
fn a_folder_for_panoramas_that_cannot_be_is_refused_with_what_to_do() {
    let desk = tree(1);
    desk.put("a.jpg", "a file");
    let refused = finish(trueup(desk.path(), &["batch", "in", "-o", "a.jpg"]));
    assert_eq!(refused.status, 1);
    assert_eq!(
        refused.stderr,
        "trueup: error: a.jpg: it is no folder, but a file\ntrueup: hint: Choose another folder for the panoramas.\n"
    );
    // All photographs lie where the panoramas are to be, which is said beside that there are none.
    std::fs::create_dir(desk.join("tree")).expect("a folder");
    std::fs::rename(desk.join("in"), desk.join("tree/day")).expect("moved");
    let none = finish(trueup(desk.path(), &["batch", "tree", "-o", "tree/day"]));
    assert_eq!(none.status, 1);
    assert!(none.stderr.starts_with("trueup: warning: tree/day: the photographs in it ("), "{}", none.stderr);
    assert!(none.stderr.contains("there are no photographs in it"), "{}", none.stderr);
}

#[test]
fn shards_share_the_work_and_the_last_one_sums_all_up() {
    let desk = tree(3);
    for shard in ["1/2", "2/2"] {
        finish(batch(&desk, &["--shard", shard]));
    }
    let all = lines(&String::from_utf8(desk.read("out/batch.jsonl")).expect("UTF-8"));
    let sets: Vec<String> = statuses(&all).into_iter().map(|(set, _)| set).collect();
    assert_eq!(sets, ["bad", "lonely", "street 1", "street 2", "street 3"]);
}

/// Waits until sets have records, and says which: the streets of a tree by their numbers.
#[cfg(unix)]
fn streets_done(desk: &Desk, at_least: usize) -> Vec<usize> {
    let patience = Instant::now() + Duration::from_secs(300);
    loop {
        let is_done = |number: &usize| desk.join(&format!("out/street {number}/record.json")).is_file();
        let done: Vec<usize> = (1..=5).filter(is_done).collect();
        if done.len() >= at_least || Instant::now() > patience {
            return done;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(unix)]
fn end(mut running: Child, signal: &str) -> Option<i32> {
    let sent = Command::new("sh").args(["-c", &format!("kill -{signal} {}", running.id())]).status();
    assert!(sent.expect("sh runs").success(), "it was still at work");
    running.wait().expect("it ends").code()
}

/// Killed and stopped again and again, as early as a set is done, then shared by two runs of which one is killed: all
/// is made, nothing twice, and as if nothing had happened.
#[cfg(unix)]
#[test]
fn a_batch_that_is_killed_goes_on_where_it_was_and_two_share_it() {
    let desk = tree(5);
    let start = || batch(&desk, &["--quiet"]).spawn().expect("started");
    let modified = |number: usize| {
        let file = desk.join(&format!("out/street {number}/panorama.jpg"));
        std::fs::metadata(file).and_then(|file| file.modified()).expect("a panorama")
    };
    let mut times: Vec<_> = Vec::new();
    let mut check_none_is_made_again = |done: Vec<usize>| {
        for &(number, before) in &times {
            assert_eq!(modified(number), before, "street {number} is not made again");
        }
        times = done.into_iter().map(|number| (number, modified(number))).collect();
    };
    for (signal, kill) in [("KILL", 1), ("INT", 2), ("KILL", 3)] {
        let running = start();
        streets_done(&desk, kill);
        let status = end(running, signal);
        assert_eq!(status, if signal == "INT" { Some(130) } else { None });
        let done = streets_done(&desk, kill);
        assert!(done.len() >= kill && done.len() < 5, "{done:?}");
        check_none_is_made_again(done);
    }
    let (first, second) = (start(), start());
    streets_done(&desk, 4);
    end(first, "KILL");
    let status = second.wait_with_output().expect("it ends").status.code();
    assert_eq!(status, Some(3), "all but the bad set are made");
    check_none_is_made_again(streets_done(&desk, 5));

    let whole = desk.read("out/street 1/panorama.jpg");
    for number in 2..=5 {
        assert!(desk.read(&format!("out/street {number}/panorama.jpg")) == whole, "street {number} has other bytes");
    }
    let alone = finish(trueup(desk.path(), &[&["stitch", "in/street 1", "-o", "alone.jpg"], &QUICK[..]].concat()));
    alone.expect_success();
    assert!(desk.read("alone.jpg") == whole, "a batch's panorama is that of its photographs");
    sweep_later(&desk);
    let known =
        ["batch.csv", "batch.jsonl", "index.html", "panorama.jpg", "panorama.json", "record.json", "thumbnail.jpg"];
    let left: Vec<String> =
        files(&desk.join("out")).into_iter().filter(|name| !known.contains(&name.as_str())).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Runs a batch again as if a minute had passed: what a killed program was about to write into the folder of the whole
/// batch, where others may be about to write as well, is stale by then.
#[cfg(unix)]
fn sweep_later(desk: &Desk) {
    let later = std::time::SystemTime::now() - Duration::from_secs(120);
    for entry in std::fs::read_dir(desk.join("out")).expect("readable") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|extension| extension == "part") {
            let part = std::fs::File::options().write(true).open(&path).expect("writable");
            part.set_modified(later).expect("its time can be set");
        }
    }
    drop(finish(batch(desk, &["--quiet"])));
}

/// Names of all files in a folder and in those within.
#[cfg(unix)]
fn files(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable").path());
    entries
        .flat_map(|path| match path.is_dir() {
            true => files(&path),
            false => vec![path.file_name().expect("a name").to_string_lossy().into_owned()],
        })
        .collect()
}
