//! `trueup options`, `--set`, `--config`, help.

use crate::pictures::street_desk;
use crate::run::{Desk, FinishedRun, finish, trueup};

fn run(arguments: &[&str]) -> FinishedRun {
    finish(trueup(Desk::new().path(), arguments))
}

#[test]
fn the_list_has_every_option_as_text_and_as_json() {
    let listed = run(&["options"]);
    let json = run(&["options", "--json"]);
    let rows: serde_json::Value = serde_json::from_str(json.expect_success()).expect("valid JSON");
    let rows = rows.as_array().expect("an array");
    assert!(rows.len() > 50, "{}", rows.len());
    for row in rows {
        let field = |name: &str| row[name].as_str().unwrap_or_else(|| panic!("{name} of {row}")).to_owned();
        let line = format!("{} = {}", field("name"), field("default"));
        assert!(listed.expect_success().lines().any(|listed| listed.starts_with(&line)), "{line}");
        assert!(!field("meaning").is_empty() && !field("allowed").is_empty(), "{row}");
    }
}

#[test]
fn one_stage_can_be_listed() {
    let mesh = run(&["options", "mesh"]);
    assert!(mesh.expect_success().lines().any(|line| line.starts_with("mesh.cell_px = ")));
    assert!(!mesh.stdout.contains("canvas."));
    run(&["options", "mash"]).expect_failure(2, &["there is no stage \"mash\"", "The stages are stitch, "]);
}

#[test]
fn every_option_can_be_set_to_its_default_on_the_command_line() {
    let json = run(&["options", "--json"]);
    let rows: serde_json::Value = serde_json::from_str(json.expect_success()).expect("valid JSON");
    let set: Vec<String> = rows
        .as_array()
        .expect("an array")
        .iter()
        .flat_map(|row| {
            let (name, default) = (row["name"].as_str().expect("a name"), row["default"].as_str().expect("a default"));
            ["--set".to_owned(), format!("{name}={default}")]
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
        "[canvas]\nscale = 0.3\n[stitch]\nseed = 3\n[output]\njpeg_quality = 50\n[mesh]\ncell_px = 60\n",
    );
    let arguments = ["stitch", "a.jpg", "b.jpg", "-o", "p.jpg", "--project", "p.json", "--config", "c.toml"];
    let overrules = ["--set", "stitch.seed=4", "--set", "canvas.scale=0.2", "--scale", "0.25"];
    finish(trueup(desk.path(), &[&arguments[..], &overrules].concat())).expect_success();
    let options = desk.json("p.json")["options"].clone();
    assert_eq!(options["canvas"]["scale"], 0.25);
    assert_eq!(options["stitch"]["seed"], 4);
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
            "trueup: hint: List the options with their ranges with `trueup options`.",
        ],
    );
}

#[test]
fn a_configuration_that_cannot_be_used_says_why() {
    let desk = Desk::new();
    for (text, reason) in [
        ("[mesh\n", "c.toml: "),
        ("[mash]\ncell_px = 3\n", "c.toml: there is no stage \"mash\""),
        ("[mesh]\ncell = 3\n", "c.toml: there is no option \"mesh.cell\""),
        ("[mesh]\ncell_px = \"wide\"\n", "c.toml: "),
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
            "p.jpg cannot be the file of both --output and --project",
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
    assert!(run(&["inspect", "--help"]).expect_success().contains("PROJECT.json"));
}
