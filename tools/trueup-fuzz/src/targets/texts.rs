//! Projects, graphs and configurations.

use std::path::Path;

use trueup::{HuginProject, Project, StitchOptions, hugin_project};
use trueup_align::stitch_graph::parse_graph_file;

use super::work::Work;

/// A project by hand: two photographs with cameras and grids, one left out.
pub(super) fn projects() -> Vec<Vec<u8>> {
    let corners = [[0.0, 0.0], [640.0, 0.0], [0.0, 480.0], [640.0, 480.0]];
    let image = |path: &str, status: &str| {
        serde_json::json!({
            "path": path, "width": 640, "height": 480, "orientation": 1, "status": status, "reason": "", "hint": "",
            "component": 0, "focal_px": 500.0, "rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "theta_deg": 0.5, "scale": 1.0, "gain": 1.0, "vanishing_points": null,
            "mesh": {"rows": 2, "cols": 2, "source": corners, "target": corners}
        })
    };
    let project = serde_json::json!({
        "format": "trueup-project", "version": 1, "method": "vpg", "options": {}, "reference": "b.jpg",
        "images": [image("a.jpg", "used"), image("b.jpg", "used"), image("c.jpg", "left_out")],
        "pairs": [{"a": 0, "b": 1, "matches": 50, "inliers": 40, "needed": 15, "verdict": "joined"}],
        "manhattan": {"divergence": 0.0031, "threshold": 0.1, "accepted": true, "failed_clause": null, "dominant": null,
            "inliers": ["a.jpg"]},
        "measures": {"upright": {"mean_deg": 0.1, "max_deg": 0.2, "within_deg": 0.3, "measured": 2},
            "estimated_gdic_deg": 0.1, "long_lines": {"lines": 2, "mean_bend": 0.001, "bent": 1,
            "longest_bent": {"path": "a.jpg", "length_px": 100.0, "off_px": 1.0}},
            "reprojection": {"matches": 40, "mean_px": 0.36, "rms_px": 0.5, "percentile_95_px": 1.24},
            "ld": 1.0, "ld_mean": 0.5, "folds": 0, "pictures": []},
        "canvas": {"width": 1280, "height": 480}, "seconds": {"features": 0.5},
        "diagnostics": [{"code": "full-turn", "severity": "note", "subject": {"stage": "mesh"}, "message": "round",
            "hint": ""}]
    });
    vec![project.to_string().into_bytes()]
}

pub(super) fn read_project(_: &Work, input: &[u8]) {
    let Ok(project) = Project::from_json(&String::from_utf8_lossy(input), "project.json") else { return };
    project.judgement();
    project.photograph_names();
    let _ = project.options.validate();
    let _ = hugin_project(&project);
    let written = project.to_json();
    assert!(written.is_ok_and(|text| Project::from_json(&text, "again").is_ok()), "what is written can be read again");
}

/// Two lenses, links, a mask and a crop.
pub(super) fn hugin_projects() -> Vec<Vec<u8>> {
    let text = "# hugin project file\np f2 w3000 h1500 v360 E12.5 R0 n\"TIFF_m c:LZW r:CROP\"\nm i0\n\
        i w800 h600 f0 v50.5 Ra0 Rb0 Eev12 Er1 Eb1 r-1.5 p2 y-10 TrX0 TrY0 TrZ0 a0.01 b-0.02 c0 d1 e-2 g0 t0 Vm5 n\"a 1.jpg\"\n\
        i w800 h600 f0 v=0 r0 p1e1 y10 a=0 b=0 c=0 d=0 e=0 S0,800,0,600 n\"b.jpg\"\n\
        i w800 h600 f3 v170 r90 p0 y120 a0 b-0.02 c0 d0 e0 n\"c.jpg\"\nk i1 t0 p\"1 2 3 4 5 6\"\nv v0 y1 r1\nc n0 N1 x1 y2 X3 Y4 t0\n";
    vec![text.as_bytes().to_vec()]
}

pub(super) fn read_hugin_project(_: &Work, input: &[u8]) {
    let Ok(project) = HuginProject::parse(&String::from_utf8_lossy(input), "project.pto") else { return };
    assert!(!project.images.is_empty() && project.images.iter().all(|image| image.focal_px.is_finite()));
}

pub(super) fn graphs() -> Vec<Vec<u8>> {
    let texts = [
        "\u{feff}# pairs\r\na 1.jpg -- b.jpg\r\nb.jpg -- c.jpg # and so on\r\n",
        "{center_image_index | 1}\n{center_image_rotation_angle | -3.5}\n{matching_graph_image_edges-0 | 1 2}\n",
    ];
    texts.map(|text| text.as_bytes().to_vec()).into()
}

pub(super) fn read_graph(_: &Work, input: &[u8]) {
    let photographs = ["a 1.jpg", "b.jpg", "to/c.jpg"].map(Path::new);
    if let Ok(graph) = parse_graph_file(&String::from_utf8_lossy(input), &photographs, "graph.txt") {
        let is_known = |photograph: usize| photograph < photographs.len();
        assert!(graph.edges.iter().all(|&(a, b)| is_known(a) && is_known(b) && a != b));
        assert!(graph.reference.is_none_or(is_known));
    }
}

pub(super) fn configurations() -> Vec<Vec<u8>> {
    let texts = [
        "[mesh]\ncell_px = 30.0\n\n[canvas]\nscale = 0.5\ncrop = \"auto\"\n",
        "[resources]\nmemory = \"2GB\"\n[output]\njpeg_quality = 90\n[exposure]\nenabled = false\n",
    ];
    texts.map(|text| text.as_bytes().to_vec()).into()
}

pub(super) fn read_configuration(_: &Work, input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let mut options = StitchOptions::default();
    if options.merge_toml(&text, "mine.toml").is_ok() {
        let _ = options.validate();
    }
    for line in text.lines() {
        let _ = options.set(line);
    }
}

/// Answers to a comparison of two methods.
pub(super) fn rankings() -> Vec<Vec<u8>> {
    let text = r#"{"format": "trueup-ranking", "version": 1, "comparison": "ab", "answers": [
        {"id": "1", "participant": "one", "finished": "2026-01-01", "shown": ["vpg", "apap"], "ranking": ["apap", "vpg"]},
        {"id": "2", "ranking": ["vpg", "apap"]}]}"#;
    vec![text.as_bytes().to_vec()]
}

pub(super) fn read_rankings(work: &Work, input: &[u8]) {
    if let Ok(results) = trueup_compare::read_rankings(&work.file("rankings.json", input)) {
        let _ = trueup_compare::tally(&[results.clone(), results]);
    }
}

/// Two known cameras and a level.
pub(super) fn truths() -> Vec<Vec<u8>> {
    let image = |file: &str| {
        serde_json::json!({"file": file, "width": 640, "height": 480, "focal_px": 500.0, "gamma_deg": 0.0,
            "R": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "center": [0.0, 0.0, 0.0]})
    };
    let text = serde_json::json!({"source": "scene", "images": [image("a.jpg"), image("b.jpg")],
        "level": {"origin": "measured", "down": [0.0, 1.0, 0.0]}})
    .to_string();
    vec![text.into_bytes()]
}

pub(super) fn read_truth(work: &Work, input: &[u8]) {
    let _ = trueup::read_truth(&work.file("truth.json", input));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seed that is refused at once leads nowhere behind that.
    #[test]
    fn the_seeds_are_read() {
        for seed in hugin_projects() {
            HuginProject::parse(&String::from_utf8_lossy(&seed), "seed.pto").expect("a Hugin project");
        }
        for seed in projects() {
            let text = String::from_utf8(seed).expect("text");
            assert_eq!(Project::from_json(&text, "seed").expect("a project").used(), 2);
        }
        let work = Work::new().expect("a folder");
        for seed in truths() {
            trueup::read_truth(&work.file("truth.json", &seed)).expect("a truth");
        }
        for seed in rankings() {
            trueup_compare::read_rankings(&work.file("rankings.json", &seed)).expect("rankings");
        }
        for seed in configurations() {
            let text = String::from_utf8(seed).expect("text");
            StitchOptions::default().merge_toml(&text, "seed").expect("a configuration");
        }
    }
}
