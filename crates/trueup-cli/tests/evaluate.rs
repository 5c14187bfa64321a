//! `trueup evaluate`: all measures of a panorama.

use serde_json::Value;

use crate::pictures::{street_desk, street_truth};
use crate::run::{Desk, FinishedRun, finish, trueup};

/// A street stitched, with its truth beside it.
fn stitched() -> Desk {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--project", "pano.json"]).expect_success();
    desk.put("truth.json", street_truth());
    desk
}

fn evaluate(desk: &Desk, arguments: &[&str]) -> FinishedRun {
    finish(trueup(desk.path(), &[&["evaluate", "pano.json"], arguments].concat()))
}

#[test]
fn all_measures_are_printed() {
    let desk = stitched();
    let run = evaluate(&desk, &["--truth", "truth.json"]);
    let parts = [
        "measured    upright within ",
        "truth       4 of 4 photographs measured",
        "  GDIC-P    ",
        "  alignment ",
        "  stated    ",
        "c.jpg: leans ",
        " degrees off upright, theta ",
        "pixels      ",
        "  NCC       RMSE ",
        " dB, SSIM ",
    ];
    for part in parts {
        assert!(run.expect_success().contains(part), "\"{part}\" is not in\n{}", run.stdout);
    }
    let short = evaluate(&desk, &["--no-pixels"]);
    assert!(!short.expect_success().contains("pixels") && !short.stdout.contains("truth"), "{}", short.stdout);
}

/// A rendered street is upright to a fraction of a degree, and its photographs look alike where they overlap.
#[test]
fn json_holds_the_same_figures_and_they_are_those_of_a_good_panorama() {
    let desk = stitched();
    let run = evaluate(&desk, &["--truth", "truth.json", "--json"]);
    let whole: Value = serde_json::from_str(run.expect_success()).expect("JSON");
    let below = |path: &str, limit: f64| {
        let value = whole.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {whole:#}"));
        assert!((0.0..limit).contains(&value), "{path} is {value}");
    };
    below("/truth/upright_deg", 1.0);
    below("/truth/gdic_deg", 3.0);
    below("/truth/theta_error_deg", 1.0);
    below("/truth/ld", 10.0);
    below("/measures/upright/mean_deg", 1.0);
    below("/measures/reprojection/mean_px", 3.0);
    below("/pixels/ncc_rmse", 1.0);
    assert!(whole.pointer("/pixels/ssim").and_then(Value::as_f64).is_some_and(|ssim| ssim > 0.5), "{whole:#}");
    assert_eq!(whole["pixels_skipped"], Value::Null);
    assert_eq!(whole.pointer("/truth/pictures/3/file"), Some(&Value::from("d.jpg")));
}

#[test]
fn photographs_are_found_beside_the_project_and_missing_ones_are_told_of() {
    let desk = stitched();
    std::fs::create_dir(desk.join("away")).expect("a folder");
    for name in ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "pano.json"] {
        std::fs::rename(desk.join(name), desk.join("away").join(name)).expect("moved");
    }
    let moved = finish(trueup(desk.path(), &["evaluate", "away/pano.json"]));
    assert!(moved.expect_success().contains("NCC       RMSE"), "{}", moved.stdout);
    std::fs::remove_file(desk.join("away/c.jpg")).expect("removed");
    let without = finish(trueup(desk.path(), &["evaluate", "away/pano.json"]));
    let expected = "pixels      skipped: photograph not found, neither here nor beside the project file: c.jpg";
    assert!(without.expect_success().contains(expected), "{}", without.stdout);
}

#[test]
fn a_project_without_measures_still_reads() {
    let desk = stitched();
    let mut project = desk.json("pano.json");
    project.as_object_mut().expect("an object").remove("measures");
    project["options"].as_object_mut().expect("an object").remove("measures");
    desk.put("pano.json", project.to_string());
    let run = evaluate(&desk, &["--no-pixels"]);
    assert!(run.expect_success().contains("the project file holds no measures"), "{}", run.stdout);
    let inspected = finish(trueup(desk.path(), &["inspect", "pano.json"]));
    assert!(!inspected.expect_success().contains("measured"), "{}", inspected.stdout);
}
