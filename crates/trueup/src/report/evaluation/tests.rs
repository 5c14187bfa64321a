use trueup_core::color::LightRange;
use trueup_core::raster::Photograph;
use trueup_core::source::PhotographSource;

use super::*;
use crate::project::record::MeshRecord;

/// Two photographs of 40 x 30 px whose middles are turned by these angles in degrees, on grids of one cell.
fn project(turns: [f64; 2]) -> Project {
    let image = |name: &str, turn: f64| {
        let (sine, cosine) = turn.to_radians().sin_cos();
        let source = [[0.0, 0.0], [40.0, 0.0], [0.0, 30.0], [40.0, 30.0]];
        let target = source.map(|[x, y]: [f64; 2]| [cosine * x - sine * y, sine * x + cosine * y]);
        serde_json::json!({
            "path": format!("some/where\\{name}"), "width": 40, "height": 30, "status": "used", "reason": "", "hint": "",
            "component": 0, "focal_px": 40.0, "rotation": null, "theta_deg": turn + 0.5, "scale": 1.0, "gain": 1.0,
            "vanishing_points": null, "mesh": {"rows": 2, "cols": 2, "source": source, "target": target}
        })
    };
    let value = serde_json::json!({
        "format": "trueup-project", "version": 1, "method": "vpg", "options": {}, "reference": "some/where\\b.jpg",
        "images": [image("b.jpg", turns[1]), image("a.jpg", turns[0])], "pairs": [],
        "manhattan": {"divergence": null, "threshold": 0.1, "accepted": false, "failed_clause": null, "dominant": null,
                      "inliers": []},
        "canvas": {"width": 70, "height": 31}, "seconds": {}, "diagnostics": []
    });
    Project::from_json(&value.to_string(), "test").expect("a valid project")
}

fn truth(gammas: [f64; 2]) -> Truth {
    let image = |name: &str, gamma_deg: f64| ImageTruth {
        file: name.to_owned(),
        width: 40,
        height: 30,
        focal_px: 40.0,
        lens: None,
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        gamma_deg,
        center: None,
        depth: None,
    };
    Truth {
        source: "test set".to_owned(),
        images: vec![image("a.jpg", gammas[0]), image("b.jpg", gammas[1])],
        level: None,
    }
}

/// Turned by 3 and -1 degrees where 2 and 1 stand upright: off by 1 and -2, so 1.5 on average and 3 between them.
#[test]
fn known_turns_have_known_figures() {
    let evaluation = evaluate(&project([3.0, -1.0]), &truth([2.0, 1.0])).expect("two photographs");
    let near = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-9, "{value} {expected}");
    assert_eq!((evaluation.used, evaluation.given, evaluation.folds), (2, 2, 0));
    near(evaluation.upright_deg, 1.5);
    near(evaluation.upright_max_deg, 2.0);
    near(evaluation.spread_deg, 1.5);
    near(evaluation.gdic_deg, 3.0);
    near(evaluation.gdic_similarity_deg, 3.0);
    near(evaluation.gdic_reference_deg.expect("b.jpg is known"), 3.0);
    near(evaluation.theta_error_deg.expect("rotations"), 3.0);
    near(evaluation.theta_error_max_deg.expect("rotations"), 3.0);
    assert_eq!(evaluation.photographs[0].file, "a.jpg");
    near(evaluation.photographs[1].upright_deg.expect("shown"), -2.0);
    near(evaluation.photographs[1].theta_error_deg.expect("rotations"), -3.0);
}

/// What is not known is written as nothing, and read so again.
#[test]
fn an_evaluation_without_a_middle_is_read_as_it_was_written() {
    let mut torn = project([3.0, -1.0]);
    let even = GridMesh::regular(40.0, 30.0, 8.0);
    let mut target = even.target.clone();
    let is_middle = |vertex: &[f64; 2]| (vertex[0] - 20.0).abs() < 5.0;
    target.iter_mut().filter(|vertex| is_middle(vertex)).for_each(|vertex| *vertex = [f64::NAN; 2]);
    let source = even.target.clone();
    torn.images[1].mesh = Some(MeshRecord { rows: even.rows, cols: even.columns, source, target });
    let evaluation = evaluate(&torn, &truth([2.0, 1.0])).expect("two photographs");
    assert_eq!(evaluation.photographs[0].upright_deg, None);
    assert!((evaluation.upright_deg - 2.0).abs() < 1e-9, "the other's: {}", evaluation.upright_deg);
    let text = serde_json::to_string(&evaluation).expect("written");
    let read: Evaluation = serde_json::from_str(&text).expect("read again");
    assert_eq!(read.photographs, evaluation.photographs);
}

/// The first photograph's vertical is stated 0.3 degrees off, and that it leans by 7 where its lines are: compared are
/// the verticals in its middle. The second states none.
#[test]
fn stated_verticals_are_compared_in_the_middle() {
    let mut stitched = project([3.0, -1.0]);
    let measured = |path: &str, lean: Option<f64>| {
        serde_json::json!({"path": path, "vertical_lines": 4, "lean_deg": lean, "standard_error_deg": lean.map(|_| 0.1),
            "within_deg": lean.map(|_| 0.2), "gamma_deg": 2.3, "certain": lean.is_some(), "lines": []})
    };
    let pictures = [measured("some/where\\b.jpg", None), measured("some/where\\a.jpg", Some(7.0))];
    let measures = serde_json::json!({"upright": null, "estimated_gdic_deg": null, "reprojection": null, "long_lines": null, "ld": 0.0,
        "ld_mean": 0.0, "folds": 0, "pictures": pictures});
    stitched.measures = Some(serde_json::from_value(measures).expect("measures"));
    let evaluation = evaluate(&stitched, &truth([2.0, 1.0])).expect("two photographs");
    let error = evaluation.photographs[0].lean_error_deg.expect("stated");
    assert!((error + 0.3).abs() < 1e-9, "{error}");
    assert_eq!(evaluation.photographs[1].lean_error_deg, None);
    let stated = evaluation.stated.expect("measures");
    assert_eq!((stated.intervals, stated.holding), (1, 0));
}

fn complaint(project: &Project, truth: &Truth) -> String {
    evaluate(project, truth).expect_err("it does not fit").to_string()
}

#[test]
fn a_truth_that_does_not_fit_is_refused_by_name() {
    let whole = project([0.0, 0.0]);
    let mut other = truth([0.0, 0.0]);
    other.images[1].width = 80;
    assert!(complaint(&whole, &other).contains("b.jpg: the project has it at 40 x 30 px, the truth at 80 x 30 px"));
    other.images[1].file = "c.jpg".to_owned();
    assert!(complaint(&whole, &other).contains("it takes two to compare"));
    other.images[0].file = "d.jpg".to_owned();
    assert!(complaint(&whole, &other).contains("the truth of test set: it names none of the 2 photographs"));
    let mut twice = whole.clone();
    twice.images[0].path = "else/a.jpg".to_owned();
    assert!(complaint(&twice, &truth([0.0, 0.0])).contains("two photographs of this name"));
}

#[test]
fn damaged_grids_are_refused_by_name() {
    let mut broken = project([0.0, 0.0]);
    broken.images[0].mesh.as_mut().expect("a grid").target.pop();
    assert!(complaint(&broken, &truth([0.0, 0.0])).contains("b.jpg: its grid of 2 x 2 with 3 vertices"));
    broken.images[0].mesh = None;
    assert!(complaint(&broken, &truth([0.0, 0.0])).contains("no grid of it"));
}

#[test]
fn photographs_from_different_places_have_no_alignment() {
    let mut moved = truth([0.0, 0.0]);
    assert!(evaluate(&project([0.0, 0.0]), &moved).expect("fits").align_px.is_some());
    moved.images[0].center = Some([0.0, 0.0, 1.0]);
    assert_eq!(evaluate(&project([0.0, 0.0]), &moved).expect("fits").align_px, None);
}

/// What is brighter than white is measured as it was stitched, not clipped.
#[test]
fn photographs_are_read_again_in_the_recorded_light() {
    let desk = tempfile::tempdir().expect("a folder");
    // Radiance: mantissas of red, green and blue, and an exponent (2^(130 - 128) = 4 for a mantissa of 256).
    let [bright, brighter] = [[64, 64, 64, 130], [128, 128, 128, 132]];
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30 +X 40\n";
    let pixels = [bright.repeat(600), brighter.repeat(600)].concat();
    for name in ["a.hdr", "b.hdr"] {
        std::fs::write(desk.path().join(name), [header.as_bytes(), &pixels].concat()).expect("written");
    }
    let mut stitched = project([0.0, 0.0]);
    for image in &mut stitched.images {
        image.path = image.path.replace("jpg", "hdr");
    }
    stitched.light = Some(LightRange { white: 1.0, peak: 16.0 });
    let records: Vec<&ImageRecord> = stitched.used_images().collect();
    let levels = |project: &Project| {
        let files = photographs(project, &records, desk.path(), &StageContext::default()).expect("there");
        assert_eq!(files.light(), project.light);
        let Photograph::Sixteen(raster) = files.photograph(0).expect("decoded") else { return None };
        Some([raster.pixel(20, 5)[0], raster.pixel(20, 25)[0]])
    };
    let [one, other] = levels(&stitched).expect("light");
    assert!(one < other, "{one} {other}: one and eight times white");
}
