//! `trueup options`, `--set`, `--config`, help.

use serde_json::Value;

use crate::pictures::street_desk;
use crate::run::{Desk, FinishedRun, finish, trueup};

fn run(arguments: &[&str]) -> FinishedRun {
    finish(trueup(Desk::new().path(), arguments))
}

/// The rows of `trueup options --json` with these arguments.
fn rows(arguments: &[&str]) -> Vec<Value> {
    let json = run(&[&["options", "--json"], arguments].concat());
    serde_json::from_str(json.expect_success()).expect("a JSON array")
}

fn field<'a>(row: &'a Value, name: &str) -> &'a str {
    row[name].as_str().unwrap_or_else(|| panic!("{name} of {row}"))
}

#[test]
fn the_experts_list_has_every_option_as_text_and_as_json() {
    let listed = run(&["options", "--expert"]);
    let lines: Vec<&str> = listed.expect_success().lines().collect();
    let rows = rows(&["--expert"]);
    assert!(rows.len() > 50, "{}", rows.len());
    for row in &rows {
        let line = format!("{} = {}", field(row, "name"), field(row, "default"));
        assert!(lines.iter().any(|listed| listed.starts_with(&line)), "{line}");
        assert!(!field(row, "meaning").is_empty() && !field(row, "allowed").is_empty(), "{row}");
    }
    assert!(!listed.stdout.contains("--expert"), "nothing is left out");
}

#[test]
fn the_list_has_the_basic_options_and_counts_the_others() {
    let (all, basic) = (rows(&["--expert"]), rows(&[]));
    let expected: Vec<&Value> = all.iter().filter(|row| field(row, "tier") == "basic").collect();
    assert_eq!(basic.iter().collect::<Vec<_>>(), expected);
    let listed = run(&["options"]);
    let lines: Vec<&str> = listed.expect_success().lines().collect();
    let named = |row: &Value| lines.iter().any(|line| line.starts_with(&format!("{} = ", field(row, "name"))));
    for row in &all {
        assert_eq!(named(row), field(row, "tier") == "basic", "{row}");
    }
    let last = format!("{} more options are for experts: add --expert.", all.len() - basic.len());
    assert_eq!(lines.last(), Some(&last.as_str()));
}

#[test]
fn one_stage_can_be_listed() {
    let mesh = run(&["options", "mesh", "--expert"]);
    assert!(mesh.expect_success().lines().any(|line| line.starts_with("mesh.cell_px = ")));
    assert!(!mesh.stdout.contains("canvas."));
    let names: Vec<Value> = rows(&["mesh", "--expert"]);
    assert!(!names.is_empty() && names.iter().all(|row| field(row, "name").starts_with("mesh.")), "{names:?}");
    run(&["options", "mash"]).expect_failure(2, &["there is no table \"mash\"", "The tables are "]);
}

#[test]
fn every_option_can_be_set_to_its_default_on_the_command_line() {
    let rows = rows(&["--expert"]);
    let set: Vec<String> = rows
        .iter()
        .flat_map(|row| {
            let assignment = format!("{}={}", field(row, "name"), field(row, "default"));
            ["--set".to_owned(), assignment]
        })
        .collect();
    let mut arguments = vec!["stitch", "missing.jpg", "-o", "p.jpg"];
    arguments.extend(set.iter().map(String::as_str));
    // The options are fine, so that the run gets as far as the missing photograph.
    run(&arguments).expect_failure(1, &["missing.jpg: there is no such file or folder"]);
}

#[test]
fn the_file_the_set_and_the_flags_overrule_each_other_in_this_order() {
    let desk = street_desk();
    desk.put(
        "c.toml",
        "[canvas]\nscale = 0.3\n[random]\nseed = 3\n[output]\njpeg_quality = 50\n[mesh]\ncell_px = 60\n",
    );
    let arguments = ["stitch", "a.jpg", "b.jpg", "-o", "p.jpg", "--project", "p.json", "--config", "c.toml"];
    let overrules = ["--set", "random.seed=4", "--set", "canvas.scale=0.2", "--scale", "0.25"];
    finish(trueup(desk.path(), &[&arguments[..], &overrules].concat())).expect_success();
    let options = desk.json("p.json")["options"].clone();
    assert_eq!(options["canvas"]["scale"], 0.25);
    assert_eq!(options["random"]["seed"], 4);
    assert_eq!(options["output"]["jpeg_quality"], 50);
    assert_eq!(options["mesh"]["cell_px"], 60.0);
}

#[test]
fn wrong_options_are_all_listed_with_what_is_allowed() {
    let wrong = [
        ["--scale", "-1"],
        ["--quality", "300"],
        ["--seed", "soon"],
        ["--method", "magic"],
        ["--set", "mesh.cell_px=nan"],
        ["--set", "mesh.cell=3"],
        ["--set", "mash.cell_px=3"],
        ["--set", "mesh.cell_px"],
    ];
    let arguments = [&["stitch", "a.jpg", "-o", "p.jpg"], &wrong.concat()[..]].concat();
    run(&arguments).expect_failure(
        2,
        &[
            "trueup: error: 8 options cannot be used:",
            "invalid canvas.scale = -1 (allowed: 0.0001 to 16)",
            "--quality 300: \"300\" cannot be (allowed: 1 to 100)",
            "--seed soon: \"soon\" is not a whole number (allowed: 0 to 9007199254740992)",
            "--method magic: \"magic\" cannot be (allowed: vpg",
            "invalid mesh.cell_px = NaN (allowed: ",
            "--set mesh.cell=3: there is no option \"mesh.cell\"",
            "--set mash.cell_px=3: there is no option \"mash.cell_px\"",
            "--set mesh.cell_px: there is no \"=\" in it",
            "trueup: hint: List all options with their ranges with `trueup options --expert`.",
        ],
    );
}

#[test]
fn a_configuration_that_cannot_be_used_says_why() {
    let desk = Desk::new();
    for (text, reason) in [
        ("[mesh\n", "c.toml: line 1: "),
        ("[mash]\ncell_px = 3\n", "c.toml: line 1: there is no table \"mash\""),
        ("[mesh]\ncell = 3\n", "c.toml: line 2: there is no option \"mesh.cell\""),
        ("[mesh]\ncell_px = \"wide\"\n", "c.toml: line 2: "),
        ("[mesh]\ncell_px = -3.0\n", "invalid mesh.cell_px = -3 (allowed: "),
    ] {
        desk.put("c.toml", text);
        desk.stitch(&["a.jpg", "--config", "c.toml"]).expect_failure(2, &[reason]);
    }
    desk.stitch(&["a.jpg", "--config", "none.toml"])
        .expect_failure(2, &["none.toml: the configuration cannot be read (No such file or directory"]);
}

#[test]
fn wrong_usage_ends_with_two() {
    for (arguments, message) in [
        (&["stitch", "a.jpg"][..], "--output <FILE>"),
        (&["stitch", "-o", "p.jpg"], "<PHOTOS>..."),
        (&["stitch", "a.jpg", "-o", "p.jpg", "--threads", "many"], "'many'"),
        (&["stitch", "a.jpg", "-o", "p.jpg", "--threads", "-2"], "'-2'"),
        (&["stitch", "a.jpg", "-o", "p.jpg", "--quiet", "--verbose"], "cannot be used with"),
        (&["stitch", "a.jpg", "-o", "p.jpg", "--sclae", "1"], "'--scale'"),
        (&["stich"], "'stitch'"),
        (&[], "Usage: trueup"),
        (
            &["stitch", "a.jpg", "-o", "p.jpg", "--project", "p.jpg"],
            "p.jpg: it cannot be the file of both --output and --project",
        ),
    ] {
        run(arguments).expect_failure(2, &[message]);
    }
}

#[test]
fn help_and_version_are_given() {
    assert_eq!(run(&["--version"]).expect_success(), format!("trueup {}\n", env!("CARGO_PKG_VERSION")));
    for arguments in [&["--help"][..], &["stitch", "--help"]] {
        assert!(run(arguments).expect_success().contains("Examples:\n  trueup stitch "));
    }
    // What an option declares is the help of its flag: the first sentence with -h, all of it with --help.
    let (short, long) = (run(&["stitch", "-h"]), run(&["stitch", "--help"]));
    let rows = rows(&["--expert"]);
    let mut choices = rows.iter().filter_map(|row| row["choices"].as_array());
    let choices = choices.find(|choices| choices.iter().any(|one| one["name"] == "autostitch")).expect("methods");
    let first = field(&choices[0], "meaning").split(' ').next().expect("a word");
    assert!(short.expect_success().contains("--method <METHOD>") && !short.stdout.contains(first), "{}", short.stdout);
    assert!(long.expect_success().contains(first), "{}", long.stdout);
    for choice in choices {
        let name = field(choice, "name");
        assert!(short.stdout.contains(name) && long.stdout.contains(&format!("- {name}:")), "{name}");
    }
    assert!(run(&["inspect", "--help"]).expect_success().contains("PROJECT.json"));
}
