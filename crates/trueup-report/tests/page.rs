//! The page of a stitched panorama: what it says is what the project says, and nothing in it runs.

use std::path::{Path, PathBuf};

use serde_json::Value;
use trueup::{Inputs, Outputs, Project, RunOptions, StageContext, StitchJob, StitchOptions};
use trueup_report::{ReportJob, drawings};

/// A name that would end every element and attribute that it stands in.
const HARMFUL: &str = "\"'><script>alert(1)<!--.jpg";

fn room() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/room")
}

/// Three photographs of the room, one of which has a harmful name, and one that cannot be read, stitched in `folder`.
fn stitched(folder: &Path) -> Project {
    for (from, to) in [("00.jpg", "00.jpg"), ("01.jpg", HARMFUL), ("02.jpg", "02.jpg")] {
        std::fs::copy(room().join(from), folder.join(to)).expect("copied");
    }
    std::fs::write(folder.join("<b>torn.jpg"), "no picture").expect("written");
    let mut options = StitchOptions::default();
    for choice in ["canvas.scale=0.2", "canvas.crop=none", "mesh.cell_px=45"] {
        options.set(choice).expect("an option");
    }
    let inputs =
        Inputs::new(["00.jpg", HARMFUL, "02.jpg", "<b>torn.jpg"].map(|name| folder.join(name).display().to_string()));
    let outputs = Outputs::new(folder.join("pano.png"));
    let job = StitchJob { inputs, outputs, cache: None, threads: 1 };
    job.run(&options, &StageContext::default()).expect("stitched").remove(0).project
}

fn page(name: &str, project: &Project) -> String {
    let job = ReportJob {
        name: name.to_owned(),
        project: project.clone(),
        project_folder: PathBuf::new(),
        photographs: None,
        run: RunOptions::default(),
        threads: 1,
    };
    job.run(&StageContext::default()).expect("a page")
}

/// The places in the record and the values that the page's figures state.
fn figures(page: &str) -> Vec<(String, String)> {
    let attribute = |element: &str, name: &str| {
        let (_, rest) = element.split_once(&format!("{name}=\"")).expect("the attribute");
        rest.split_once('"').expect("its end").0.replace("&#x2f;", "/")
    };
    let elements = page.split("<data ").skip(1);
    elements.map(|element| (attribute(element, "data-field"), attribute(element, " value"))).collect()
}

#[test]
fn the_page_says_what_the_project_says_and_runs_nothing() {
    let desk = tempfile::tempdir().expect("a folder");
    let project = stitched(desk.path());
    assert_eq!(project.used(), 3);
    let page = page(HARMFUL, &project);

    let record: Value = serde_json::from_str(&project.to_json().expect("written")).expect("JSON");
    let figures = figures(&page);
    for (field, value) in &figures {
        let recorded = record.pointer(field).unwrap_or_else(|| panic!("{field} is not in the project"));
        let value: f64 = value.parse().expect("a number");
        assert_eq!(recorded.as_f64(), Some(value), "{field}");
    }
    for field in [
        "/canvas/width",
        "/measures/upright/within_deg",
        "/measures/reprojection/percentile_95_px",
        "/measures/long_lines/lines",
        "/measures/pictures/0/lean_deg",
        "/pairs/0/inliers",
        "/seconds/matching",
    ] {
        assert!(figures.iter().any(|(told, _)| told == field), "{field} is not told");
    }

    assert!(!page.contains("<script") && !page.contains("<b>") && !page.contains("<!--"), "names are escaped");
    assert!(page.contains("&lt;b&gt;torn.jpg"), "what was left out is named");
    let loading = page.split("src=\"").chain(page.split("href=\"")).skip(1);
    for address in loading.filter_map(|rest| rest.split('"').next()).filter(|one| !one.starts_with("<!DOCTYPE")) {
        assert!(address.starts_with("data:image/jpeg;base64,") || address.starts_with('#'), "{address:.60}");
    }
    for told in page.lines().filter(|line| line.starts_with("leans")) {
        assert!(!told.contains(">-"), "sizes have a side instead of a sign: {told}");
    }
    assert!(page.contains("mesh.cell_px") && page.contains("45.0"), "options that differ are listed");
    assert_eq!(page.matches("<img ").count(), 3);
    assert_eq!(
        page.matches("role=\"img\"").count(),
        page.matches("role=\"img\" aria-label=\"").count(),
        "each is told"
    );
}

/// What was recorded of the machine that stitched does not count; what this one is asked to do with does.
#[test]
fn a_page_keeps_to_the_memory_it_is_given() {
    let desk = tempfile::tempdir().expect("a folder");
    let mut project = stitched(desk.path());
    let mut options = StitchOptions::default();
    options.set("resources.memory=1MB").expect("an option");
    let job = |project: &Project, run: RunOptions| ReportJob {
        name: "pano".to_owned(),
        project: project.clone(),
        project_folder: PathBuf::new(),
        photographs: None,
        run,
        threads: 1,
    };
    let refused = job(&project, options.run.clone()).run(&StageContext::default()).expect_err("too little");
    assert!(refused.to_string().contains("memory"), "{refused}");
    project.options.run = options.run;
    job(&project, RunOptions::default()).run(&StageContext::default()).expect("a page");
}

/// The heat map and the lines are those that the figures were taken of.
#[test]
fn what_is_drawn_is_what_was_measured() {
    let desk = tempfile::tempdir().expect("a folder");
    let project = stitched(desk.path());
    let measures = project.measures.as_ref().expect("measured");
    let found = measures.reprojection.as_ref().expect("matches");
    let places: Vec<_> = measures.pairs.iter().flat_map(|pair| &pair.places).collect();
    assert_eq!(places.iter().map(|place| place.matches).sum::<usize>(), found.matches);
    let sum: f64 = places.iter().map(|place| place.mean_px * place.matches as f64).sum();
    assert!((sum / found.matches as f64 - found.mean_px).abs() < 1e-9);
    let widest = measures.pairs.iter().map(|pair| pair.percentile_95_px).fold(0.0, f64::max);
    assert_eq!(Some(widest), found.worst_pair.as_ref().map(|worst| worst.percentile_95_px));

    let heat = drawings::alignment_error(&project).expect("a drawing");
    let drawn: usize = heat
        .split("px, ")
        .skip(1)
        .filter_map(|rest| rest.split_once(" matches</title>")?.0.parse::<usize>().ok())
        .sum();
    // The canvas shows the whole of every photograph.
    assert_eq!(drawn, found.matches);

    let long = measures.long_lines.as_ref().expect("lines");
    let lines: Vec<_> = measures.photographs.iter().flat_map(|one| &one.lines).collect();
    assert_eq!(lines.len(), long.lines);
    assert_eq!(lines.iter().filter(|line| line.straightness().is_bent()).count(), long.bent);
    let vertical = lines.iter().filter(|line| line.direction.is_some()).count();
    assert!(vertical > lines.len() / 2, "the lines of a room point to its directions: {vertical} of {}", lines.len());
    let outlines = drawings::outlines(&project).expect("a drawing");
    assert!(outlines.contains(&format!("viewBox=\"0 0 {} {}\"", project.canvas.width, project.canvas.height)));
}
