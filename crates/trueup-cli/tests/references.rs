//! Panoramas by every method, projection and blend mode, against pictures in the folder `reference`.
//!
//! `TRUEUP_RENEW_REFERENCES=1 cargo test --release -p trueup-cli references` makes these pictures anew.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use trueup::StitchOptions;

use crate::likeness::{Likeness, side_by_side, write_small};
use crate::run::{Desk, finish, trueup};

/// Set to anything, the pictures are made anew instead of compared.
const RENEW: &str = "TRUEUP_RENEW_REFERENCES";
const REFERENCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference");
/// Where failures are shown.
const DIFFERENCES: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/references");
/// Three overlapping photographs of a room, rendered for the examples.
const PHOTOGRAPHS: [&str; 3] = ["01.jpg", "02.jpg", "03.jpg"];
/// Small enough that a picture takes 64 kB, large enough to see a photograph move by half a pixel of its own.
const SCALE: &str = "0.088";
/// Limits on what is committed, in bytes.
const LARGEST_FILE: u64 = 64_000;
const LARGEST_SUM: u64 = 1_250_000;

/// The photographs, as they are given to the command.
fn photographs() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/room");
    PHOTOGRAPHS.iter().map(|name| folder.join(name).display().to_string()).collect()
}

/// An option that is a choice.
struct Choice {
    /// `table.option`.
    option: String,
    alternatives: Vec<&'static str>,
}

impl Choice {
    /// The option, told by one of its alternatives, whatever it is called.
    fn with(alternative: &str) -> Self {
        let named = |row: &trueup::OptionDescription| row.choices.iter().any(|choice| choice.name == alternative);
        let mut rows: Vec<_> = StitchOptions::describe().into_iter().filter(named).collect();
        assert_eq!(rows.len(), 1, "one option can be {alternative}");
        let row = rows.remove(0);
        Self { option: row.name, alternatives: row.choices.iter().map(|choice| choice.name).collect() }
    }

    fn methods() -> Self {
        Self::with("autostitch")
    }

    fn projections() -> Self {
        Self::with("equirectangular")
    }

    fn blends() -> Self {
        Self::with("multiband")
    }

    /// The names of the pictures, without extension, one for each alternative.
    fn names(&self, kind: &str) -> Vec<String> {
        assert!(self.alternatives.len() > 1, "{} is no choice", self.option);
        self.alternatives.iter().map(|alternative| format!("{kind}-{alternative}")).collect()
    }
}

/// Compares `panorama.png` of every alternative, which `make` makes, with its reference.
fn compare_all(kind: &str, choice: &Choice, desk: &Desk, make: impl Fn(&str)) {
    let mut unlike = Vec::new();
    for (name, alternative) in choice.names(kind).iter().zip(&choice.alternatives) {
        make(&format!("{}={alternative}", choice.option));
        if let Err(why) = compare(name, &desk.join("panorama.png")) {
            unlike.push(why);
        }
        std::fs::remove_file(desk.join("panorama.png")).expect("removed");
    }
    let renew = format!("If they are to be as they are now, make them anew: {RENEW}=1, see CONTRIBUTING.md.");
    assert!(
        unlike.is_empty(),
        "{} pictures are not like their references:\n{}\n{renew}",
        unlike.len(),
        unlike.join("\n")
    );
}

/// Compares a picture with its reference, or makes the reference anew.
fn compare(name: &str, actual: &Path) -> Result<(), String> {
    let reference = Path::new(REFERENCES).join(format!("{name}.png"));
    let actual = image::open(actual).expect("a panorama").to_rgba8();
    let expected = image::open(&reference).ok().map(|expected| expected.to_rgba8());
    if std::env::var_os(RENEW).is_some() {
        // The same pixels stay the same bytes, whatever packed them.
        if expected.as_ref() != Some(&actual) {
            write_small(&actual, &reference);
        }
        return Ok(());
    }
    let Some(expected) = expected else {
        return Err(format!("{name}: there is no {}", reference.display()));
    };
    let likeness = Likeness::of(&expected, &actual);
    if likeness.is_close() {
        return Ok(());
    }
    std::fs::create_dir_all(DIFFERENCES).expect("a folder");
    let shown = PathBuf::from(DIFFERENCES).join(format!("{name}.png"));
    side_by_side(&expected, &actual).save(&shown).expect("written");
    Err(format!("{name}: {likeness}; expected, actual and eight times their difference: {}", shown.display()))
}

#[test]
fn methods_make_what_their_references_show() {
    let desk = Desk::new();
    let photographs = photographs();
    compare_all("method", &Choice::methods(), &desk, |set| {
        let mut arguments =
            vec!["stitch", "-o", "panorama.png", "--scale", SCALE, "--cache", "cache", "--crop", "none", "--set", set];
        arguments.extend(photographs.iter().map(String::as_str));
        finish(trueup(desk.path(), &arguments)).expect_success();
    });
}

/// A folder with the project of a panorama.
fn stitched() -> Desk {
    let desk = Desk::new();
    let photographs = photographs();
    // Shapes are shown, with all their borders.
    let mut arguments =
        vec!["stitch", "-o", "small.jpg", "--scale", SCALE, "--crop", "none", "--project", "project.json"];
    arguments.extend(photographs.iter().map(String::as_str));
    finish(trueup(desk.path(), &arguments)).expect_success();
    desk
}

fn compose_all(kind: &str, choice: &Choice) {
    let desk = stitched();
    compare_all(kind, choice, &desk, |set| {
        let arguments = ["compose", "project.json", "-o", "panorama.png", "--set", set];
        finish(trueup(desk.path(), &arguments)).expect_success();
    });
}

#[test]
fn projections_show_what_their_references_show() {
    compose_all("projection", &Choice::projections());
}

#[test]
fn blends_show_what_their_references_show() {
    compose_all("blend", &Choice::blends());
}

/// What is committed is what is compared, and small.
#[test]
fn there_is_no_reference_too_many_or_too_large() {
    let kinds = [("method", Choice::methods()), ("projection", Choice::projections()), ("blend", Choice::blends())];
    let expected: BTreeSet<String> = kinds.iter().flat_map(|(kind, choice)| choice.names(kind)).collect();
    let mut sum = 0;
    for file in std::fs::read_dir(REFERENCES).expect("a folder").map(|file| file.expect("readable")) {
        let name = file.file_name().to_string_lossy().into_owned();
        assert!(
            name.strip_suffix(".png").is_some_and(|name| expected.contains(name)),
            "{name} is compared with nothing"
        );
        let bytes = file.metadata().expect("readable").len();
        assert!(bytes < LARGEST_FILE, "{name} has {bytes} bytes");
        sum += bytes;
    }
    assert!((1..LARGEST_SUM).contains(&sum), "{sum} bytes");
}
