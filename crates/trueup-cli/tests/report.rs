//! `trueup report`, and `--report` beside a panorama.

use crate::pictures::street_desk;
use crate::run::{Desk, finish, trueup};

fn page(desk: &Desk, name: &str) -> String {
    String::from_utf8(desk.read(name)).expect("UTF-8")
}

#[test]
fn a_panorama_and_its_project_have_the_same_page() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "--project", "pano.json", "--report", "beside.html"]).expect_success();
    let report = finish(trueup(desk.path(), &["report", "pano.json", "-o", "pano.html"]));
    assert!(report.expect_success().starts_with("report      pano.html  "), "{}", report.stdout);
    assert_eq!(page(&desk, "beside.html"), page(&desk, "pano.html"));
    let told = finish(trueup(desk.path(), &["report", "pano.json", "-o", "pano.html", "--json"]));
    let told: serde_json::Value = serde_json::from_str(told.expect_success()).expect("JSON");
    assert_eq!((&told["report"], &told["bytes"]), (&"pano.html".into(), &page(&desk, "pano.html").len().into()));
    assert!(page(&desk, "pano.html").contains("<title>How pano came about</title>"));
    // The photographs may have moved.
    std::fs::create_dir(desk.join("moved")).expect("a folder");
    for name in ["a.jpg", "b.jpg", "c.jpg"] {
        std::fs::rename(desk.join(name), desk.join("moved").join(name)).expect("moved");
    }
    let gone = finish(trueup(desk.path(), &["report", "pano.json", "-o", "pano.html"]));
    gone.expect_failure(1, &["photograph not found"]);
    let moved = finish(trueup(desk.path(), &["report", "pano.json", "-o", "moved.html", "--photos", "moved", "-q"]));
    assert_eq!(moved.expect_success(), "");
    assert!(page(&desk, "moved.html").contains("data:image/jpeg"));
}

#[test]
fn a_page_takes_nobodys_place() {
    let desk = street_desk();
    let stitch =
        |more: &[&str]| finish(trueup(desk.path(), &[&["stitch", "a.jpg", "b.jpg", "-o", "pano.jpg"], more].concat()));
    stitch(&["--report", "a.jpg"]).expect_failure(2, &["the report is a page in HTML", ".html"]);
    stitch(&["--report", "none/pano.html"]).expect_failure(1, &["none"]);
    stitch(&["--report", "x.html", "--project", "./x.html"]).expect_failure(2, &["--report and another output"]);
    desk.put("x.html", "{}");
    finish(trueup(desk.path(), &["report", "x.html", "-o", "x.html"])).expect_failure(1, &["x.html"]);
    assert_eq!(page(&desk, "x.html"), "{}");
    assert!(!desk.join("pano.jpg").exists());
}
