//! The same photographs give the same files: in every run, for any number of threads, and nearly so in any order.

use std::collections::BTreeMap;

use serde_json::Value;
use trueup_align::warps::WarpModel;

use crate::pictures::street_desk;
use crate::run::{Desk, finish, trueup};

/// The panorama's bytes and the project without its timings.
fn stitch(desk: &Desk, arguments: &[&str]) -> (Vec<u8>, Value) {
    desk.stitch(&[arguments, &["--project", "pano.json"]].concat()).expect_success();
    (desk.read("pano.jpg"), without_seconds(desk.json("pano.json")))
}

fn without_seconds(mut project: Value) -> Value {
    project.as_object_mut().expect("an object").remove("seconds").expect("seconds");
    project
}

#[test]
fn threads_and_runs_change_no_byte() {
    let desk = street_desk();
    let photographs = ["a.jpg", "b.jpg", "c.jpg", "d.jpg"];
    let one_thread = stitch(&desk, &[&photographs[..], &["--threads", "1"]].concat());
    for threads in ["2", "2", "0"] {
        let again = stitch(&desk, &[&photographs[..], &["--threads", threads]].concat());
        assert!(again.0 == one_thread.0, "the panoramas differ at {threads} threads");
        assert_eq!(again.1, one_thread.1, "the projects differ at {threads} threads");
    }
}

/// Enlarged so far that the canvas is put into a scratch file, as `failures` proves.
#[test]
fn memory_changes_no_byte() {
    let desk = street_desk();
    let within = |memory: &str| {
        let arguments = ["stitch", "a.jpg", "b.jpg", "c.jpg", "d.jpg", "-o", "pano.jpg", "--scale", "6"];
        finish(trueup(desk.path(), &[&arguments[..], &["--memory", memory]].concat())).expect_success();
        desk.read("pano.jpg")
    };
    assert!(within("8GB") == within("230MB"), "the panoramas differ");
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "pano.jpg"]);
}

#[test]
fn the_order_of_the_photographs_hardly_matters() {
    let desk = street_desk();
    let rotations = |order: &[&str]| -> BTreeMap<String, f64> {
        let (_, project) = stitch(&desk, &[order, &["--reference", "b.jpg"]].concat());
        let images = project["images"].as_array().expect("images").clone();
        let entry = |image: &Value| Some((image["path"].as_str()?.to_owned(), image["theta_deg"].as_f64()?));
        images.iter().map(|image| entry(image).expect("a used photograph")).collect()
    };
    let in_order = rotations(&["a.jpg", "b.jpg", "c.jpg", "d.jpg"]);
    for order in [["d.jpg", "c.jpg", "b.jpg", "a.jpg"], ["c.jpg", "a.jpg", "d.jpg", "b.jpg"]] {
        let rotations = rotations(&order);
        assert_eq!(rotations.len(), order.len());
        for (path, theta_deg) in rotations {
            let change = (theta_deg - in_order[&path]).abs();
            assert!(change < 0.2, "{path} turns by {change} degrees more in the order {order:?}");
        }
    }
}

/// Compared, so that photographs are measured and matched twice and not twice a method.
#[test]
fn threads_change_no_byte_of_any_warp_model() {
    let desk = street_desk();
    let panoramas = |threads: &str| -> Vec<(Vec<u8>, Value)> {
        let methods = WarpModel::NAMES.join(",");
        let arguments =
            ["compare", "a.jpg", "b.jpg", "c.jpg", "-o", "out", "--methods", &methods, "--threads", threads];
        finish(trueup(desk.path(), &[&arguments[..], &["--scale", "0.5"]].concat())).expect_success();
        let made = WarpModel::NAMES.iter().map(|method| {
            let project = without_seconds(desk.json(&format!("out/{method}.json")));
            (desk.read(&format!("out/{method}.jpg")), project)
        });
        made.collect()
    };
    let (one_thread, three) = (panoramas("1"), panoramas("3"));
    for (method, (one_thread, three)) in WarpModel::NAMES.iter().zip(one_thread.iter().zip(&three)) {
        assert!(one_thread.0 == three.0, "the panoramas differ by {method}");
        assert_eq!(one_thread.1, three.1, "the projects differ by {method}");
        assert_eq!(one_thread.1["method"], *method);
        assert_eq!(one_thread.1["manhattan"]["accepted"], false, "{method} asks no vanishing points");
        assert!(one_thread.1["measures"]["reprojection"].is_object(), "{method} is measured");
        let project = format!("out/{method}.json");
        let summary = finish(trueup(desk.path(), &["inspect", &project, "--verbose"]));
        let asked = format!("the method {method} does not ask them");
        assert!(summary.expect_success().contains(&asked), "{}", summary.stdout);
        finish(trueup(desk.path(), &["evaluate", &project])).expect_success();
    }
}
