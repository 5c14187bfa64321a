//! `trueup batch`: a tree of folders, stopped and gone on with.

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

fn batch(desk: &Desk, more: &[&str]) -> std::process::Command {
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
    assert!(page.contains("src=\"./street%201/thumbnail.jpg\"") || page.contains("street%201"), "{page}");
    assert!(desk.join("out/street 1/thumbnail.jpg").is_file() && desk.join("out/street 1/panorama.json").is_file());

    // Nothing is made again: not even the failed one.
    let again = finish(batch(&desk, &["--json"]));
    assert_eq!((again.status, again.stdout.as_str()), (3, ""), "{}", again.stderr);
    // But what is gone, and what was asked for.
    std::fs::remove_file(desk.join("out/street 2/panorama.jpg")).expect("removed");
    let again = finish(batch(&desk, &["--json", "--retry"]));
    let remade = statuses(&lines(&again.stdout));
    assert_eq!(remade.iter().map(|(set, _)| set.as_str()).collect::<Vec<_>>(), ["bad", "street 2"]);
    assert_eq!(desk.read("out/street 1/panorama.jpg"), desk.read("out/street 2/panorama.jpg"), "the same photographs");
    // A set that was mended is tried without being asked.
    for (name, bytes) in ["x.jpg", "y.jpg"].iter().zip(street()) {
        desk.put(&format!("in/bad/{name}"), bytes);
    }
    let mended = finish(batch(&desk, &["--json"]));
    assert_eq!(mended.status, 0, "{}", mended.stderr);
    assert_eq!(statuses(&lines(&mended.stdout)), [("bad".to_owned(), "made".to_owned())]);
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

/// Killed again and again, as early as a set is done: all is made, nothing twice, and as if nothing had happened.
#[cfg(unix)]
#[test]
fn a_batch_that_is_killed_goes_on_where_it_was() {
    let desk = tree(4);
    let done = || {
        let records = (1..=4).filter(|number| desk.join(&format!("out/street {number}/record.json")).is_file());
        records.collect::<Vec<_>>()
    };
    let modified = |number: usize| {
        let file = desk.join(&format!("out/street {number}/panorama.jpg"));
        std::fs::metadata(file).and_then(|file| file.modified()).expect("a panorama")
    };
    let mut times = Vec::new();
    for kill in 1..=3 {
        let mut running = batch(&desk, &["--quiet"]).spawn().expect("started");
        let patience = Instant::now() + Duration::from_secs(300);
        while done().len() < kill && Instant::now() < patience {
            std::thread::sleep(Duration::from_millis(5));
        }
        running.kill().expect("killed");
        running.wait().expect("ended");
        for &(number, before) in &times {
            assert_eq!(modified(number), before, "street {number} is not made again");
        }
        times = done().into_iter().map(|number| (number, modified(number))).collect();
        assert!(times.len() >= kill);
    }
    let last = finish(batch(&desk, &["--quiet"]));
    assert_eq!(last.status, 3, "{}", last.stderr);
    for &(number, before) in &times {
        assert_eq!(modified(number), before, "street {number} is not made again");
    }
    let whole = desk.read("out/street 1/panorama.jpg");
    for number in 2..=4 {
        assert_eq!(desk.read(&format!("out/street {number}/panorama.jpg")), whole, "street {number}");
    }
    let known = ["batch.jsonl", "index.html", "panorama.jpg", "panorama.json", "record.json", "thumbnail.jpg"];
    let left: Vec<String> =
        files(&desk.join("out")).into_iter().filter(|name| !known.contains(&name.as_str())).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Names of all files in a folder and in those within.
#[cfg(unix)]
fn files(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable").path());
    entries
        .flat_map(|path| {
            if path.is_dir() {
                files(&path)
            } else {
                vec![path.file_name().expect("a name").to_string_lossy().into_owned()]
            }
        })
        .collect()
}
