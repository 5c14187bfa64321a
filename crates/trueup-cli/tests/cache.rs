//! Results kept between runs: the same panoramas, whatever is found in the folder.

use crate::pictures::{STREET_NAMES, street_desk};
use crate::run::Desk;

/// The panorama and the project without its timings.
fn stitch(desk: &Desk, photographs: &[&str], more: &[&str]) -> (Vec<u8>, serde_json::Value) {
    desk.stitch(&[photographs, &["--project", "pano.json"], more].concat()).expect_success();
    let mut project = desk.json("pano.json");
    project.as_object_mut().expect("an object").remove("seconds");
    (desk.read("pano.jpg"), project)
}

/// Names of the entries of a kind.
fn entries(desk: &Desk, kind: &str) -> Vec<String> {
    let files = std::fs::read_dir(desk.join("kept")).expect("a folder");
    let names = files.map(|file| file.expect("readable").file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with(&format!("{kind}-"))).collect()
}

#[test]
fn results_are_the_same_with_and_without() {
    let desk = street_desk();
    let without = stitch(&desk, &STREET_NAMES, &[]);
    let cache = ["--cache", "kept"];
    for round in 0..2 {
        assert!(stitch(&desk, &STREET_NAMES, &cache) == without, "round {round} differs");
    }
    assert_eq!(["measured", "pair", "geometry"].map(|kind| entries(&desk, kind).len()), [4, 6, 1]);
    // Other refinements share the measurements.
    let refined = stitch(&desk, &STREET_NAMES, &["--align", "lines"]);
    assert!(stitch(&desk, &STREET_NAMES, &["--align", "lines", "--cache", "kept"]) == refined);
    assert_eq!(["measured", "pair", "geometry"].map(|kind| entries(&desk, kind).len()), [4, 6, 2]);
}

#[test]
fn one_more_photograph_costs_its_own_pairs_only() {
    let desk = street_desk();
    let cache = ["--cache", "kept", "--set", "pairing.exhaustive_up_to=2"];
    // All are joined: what is left over would be looked at once more.
    stitch(&desk, &STREET_NAMES[1..], &cache[..2]);
    let pairs = entries(&desk, "pair");
    assert_eq!(pairs.len(), 3);
    // In front, so that all others get new numbers.
    let with = stitch(&desk, &STREET_NAMES, &cache[..2]);
    let more = entries(&desk, "pair");
    assert_eq!((more.len(), entries(&desk, "measured").len()), (6, 4));
    assert!(pairs.iter().all(|pair| more.contains(pair)));
    assert!(stitch(&desk, &STREET_NAMES, &[]) == with);
    // The same where pairs are proposed.
    let proposed = stitch(&desk, &STREET_NAMES, &cache[2..]);
    for _ in 0..2 {
        assert!(stitch(&desk, &STREET_NAMES, &cache) == proposed);
    }
    assert_eq!(entries(&desk, "likeness").len(), 1);
}

#[test]
fn damaged_entries_are_made_again() {
    let desk = street_desk();
    let whole = stitch(&desk, &STREET_NAMES, &["--cache", "kept"]);
    for name in ["measured", "pair", "geometry"].iter().flat_map(|kind| entries(&desk, kind)) {
        let path = format!("kept/{name}");
        let mut bytes = desk.read(&path);
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x40;
        desk.put(&path, bytes);
    }
    let run = desk.stitch(&[&STREET_NAMES[..], &["--cache", "kept", "--verbose"]].concat());
    assert!(run.expect_success().contains("an entry of the cache was damaged; it was made again"), "{}", run.stdout);
    assert!(desk.read("pano.jpg") == whole.0);
    let run = desk.stitch(&[&STREET_NAMES[..], &["--cache", "kept", "--verbose"]].concat());
    assert!(!run.expect_success().contains("damaged"), "{}", run.stdout);
}

#[test]
fn folders_that_cannot_be_written_are_refused_before_work_starts() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "--cache", "a.jpg"]).expect_failure(1, &["making the folder a.jpg: "]);
    desk.stitch(&["a.jpg", "b.jpg", "--cache", "a.jpg/kept"]).expect_failure(1, &["making the folder a.jpg/kept: "]);
    assert_eq!(desk.files(), STREET_NAMES);
}
