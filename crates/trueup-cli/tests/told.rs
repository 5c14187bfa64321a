//! What is said of what was left out, of what is not as it should be, and to whom.

use crate::pictures::{self, noise, put_street, street, street_desk};
use crate::run::{Desk, finish, trueup};

#[test]
fn quiet_says_what_was_left_out() {
    let desk = street_desk();
    desk.put("noise.jpg", noise(1, 320, 240));
    desk.put("text.jpg", "Dear diary");
    let run = desk.stitch(&["a.jpg", "b.jpg", "noise.jpg", "text.jpg", "--quiet"]);
    assert_eq!((run.status, run.stdout.as_str()), (0, ""), "{}", run.stderr);
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert!(lines[0].starts_with("trueup: warning: 2 of 4 left out: noise.jpg: no overlap found"), "{}", run.stderr);
    assert!(lines[0].contains("; text.jpg: its content is not a "), "{}", run.stderr);
    assert!(lines[1..].iter().all(|line| line.starts_with("trueup: warning: ")), "{}", run.stderr);
}

#[test]
fn photographs_outside_of_the_graph_have_their_own_reason() {
    let desk = street_desk();
    desk.put("graph.txt", "a.jpg -- b.jpg\n");
    let run = desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--graph", "graph.txt", "--project", "p.json"]);
    assert!(run.expect_success().contains("left out  c.jpg, d.jpg: the graph has no pair with it\n"), "{}", run.stdout);
    let findings = desk.json("p.json")["diagnostics"].as_array().expect("a list").clone();
    assert_eq!(findings.iter().filter(|one| one["code"] == "not-in-graph").count(), 2);
}

#[cfg(unix)]
#[test]
fn control_characters_of_names_never_reach_the_terminal() {
    let desk = Desk::new();
    let harmful = "a\u{1b}]0;title\u{7}\u{1b}[2J\n\u{9b}.jpg";
    desk.put(harmful, &street()[0]);
    desk.put("b.jpg", &street()[1]);
    desk.put("\u{1b}[31mtext.jpg", "Dear diary");
    for arguments in [&["."][..], &[".", "--verbose"], &[".", "--quiet"], &["\u{1b}[31mtext.jpg"]] {
        let run = desk.stitch(arguments);
        for text in [&run.stdout, &run.stderr] {
            assert!(!text.contains(['\u{1b}', '\u{7}', '\u{9b}']), "{text:?}");
        }
        let all = run.stdout + &run.stderr;
        assert!(all.contains("\\u{1b}[31mtext.jpg"), "{all}");
    }
}

#[test]
fn all_says_everything_once_and_names_what_is_stale() {
    let desk = street_desk();
    for (name, bytes) in ["x.jpg", "y.jpg", "z.jpg"].iter().zip(pictures::room()) {
        desk.put(name, bytes);
    }
    let both = ["a.jpg", "x.jpg", "b.jpg", "y.jpg", "c.jpg", "z.jpg", "d.jpg", "--all"];
    let run = desk.stitch(&both);
    let summary = run.expect_success();
    assert!(summary.contains("  left out  a.jpg, b.jpg, c.jpg, d.jpg: it is in panorama 1 of 2\n"), "{summary}");
    assert!(!summary.contains("earlier run"), "{summary}");
    // Fewer panoramas now: those of last time are named, and nothing of anybody's is deleted.
    let stale = "pano-2.jpg: it is a panorama of an earlier run; this one made 1 panorama";
    let one = desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--all"]);
    assert!(one.expect_success().contains(stale), "{}", one.stdout);
    assert!(desk.join("pano-1.jpg").exists() && desk.join("pano-2.jpg").exists());
}

#[test]
fn warnings_and_errors_of_alignment_can_be_failures() {
    let desk = Desk::new();
    put_street(&desk);
    desk.put("text.jpg", "Dear diary");
    let warned = desk.stitch(&["a.jpg", "b.jpg", "text.jpg", "--fail-on", "warning"]);
    assert_eq!(warned.status, 3, "{}", warned.stderr);
    assert!(
        warned.stderr.contains("a warning is a failure here (--fail-on): text.jpg: its content is not"),
        "{}",
        warned.stderr
    );
    assert!(warned.stdout.contains("photographs 2 of 3 used") && desk.join("pano.jpg").exists());
    let apart = desk.stitch(&["a.jpg", "b.jpg", "--max-error", "0.001"]);
    assert_eq!(apart.status, 3, "{}", apart.stderr);
    assert!(apart.stderr.contains(" px, 0.001 px are allowed (--max-error)"), "{}", apart.stderr);
    let fine = desk.stitch(&["a.jpg", "b.jpg", "--max-error", "50", "--fail-on", "warning"]);
    assert!(fine.expect_success().contains("judged      "), "{}", fine.stdout);
    // One photograph alone meets nothing.
    let alone = desk.stitch(&["a.jpg", "--max-error", "50"]);
    assert_eq!(alone.status, 3, "{}", alone.stderr);
    assert!(alone.stderr.contains("was not measured, so that --max-error cannot tell"), "{}", alone.stderr);
    desk.stitch(&["a.jpg", "b.jpg", "--max-error", "-1"]).expect_failure(2, &["a number of pixels, 0 or more"]);
}

#[test]
fn the_summary_is_json_for_programs() {
    let desk = street_desk();
    desk.put("text.jpg", "Dear diary");
    let run = desk.stitch(&["a.jpg", "b.jpg", "text.jpg", "--json", "--project", "p.json"]);
    assert_eq!((run.status, run.stderr.as_str()), (0, ""));
    let summary: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON and nothing else");
    assert_eq!((&summary["format"], &summary["version"]), (&"trueup-summary".into(), &1.into()));
    let panorama = &summary["panoramas"][0];
    assert_eq!((&panorama["panorama"], &panorama["beside"]["project"]), (&"pano.jpg".into(), &"p.json".into()));
    assert_eq!(panorama["used"], serde_json::json!(["a.jpg", "b.jpg"]));
    assert_eq!(panorama["left_out"][0]["path"], "text.jpg");
    // The figures, without the places that they were measured at.
    let mut measures = desk.json("p.json")["measures"].clone();
    assert!(measures.as_object_mut().expect("an object").remove("pairs").is_some());
    for one in measures["pictures"].as_array_mut().expect("an array") {
        assert!(one.as_object_mut().expect("an object").remove("lines").is_some());
    }
    assert_eq!(panorama["measures"], measures);
    assert!(panorama["judgement"]["alignment"].is_string(), "{panorama}");
    assert_eq!(panorama["warnings"][0]["code"], "not-a-picture");
}

/// A limit of the shell is heeded: the budget is within it, and what does not fit is an error and no abort.
#[cfg(target_os = "linux")]
#[test]
fn the_limits_of_the_shell_are_heeded() {
    let desk = street_desk();
    let limited = |kibibytes: u32| {
        let script = format!(
            "ulimit -v {kibibytes}; exec {} stitch a.jpg b.jpg -o pano.jpg --scale 0.5 --threads 1",
            env!("CARGO_BIN_EXE_trueup")
        );
        let mut shell = std::process::Command::new("sh");
        shell.current_dir(desk.path()).args(["-c", &script]);
        finish(shell)
    };
    limited(1_000_000).expect_success();
    limited(250_000)
        .expect_failure(1, &["measuring ", " of memory needed, ", "Raise the limit of the shell (ulimit -v"]);
}

/// Camera raw is told with the command that develops it, alone and among photographs.
#[test]
fn raw_files_are_never_stitched_from_their_thumbnails() {
    let desk = street_desk();
    for name in ["one.dng", "two.dng"] {
        desk.put(name, pictures::digital_negative());
    }
    let raw = "one.dng: it is a Digital Negative (DNG) without a picture of the sensor";
    finish(trueup(desk.path(), &["stitch", "one.dng", "-o", "pano.jpg"])).expect_failure(1, &[raw, "darktable-cli"]);
    let run = desk.stitch(&["."]);
    assert!(run.expect_success().contains("photographs 4 of 6 used"), "{}", run.stdout);
}
