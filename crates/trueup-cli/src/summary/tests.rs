use super::*;

/// A project file by hand: two photographs used, one left out, one note.
fn project() -> Project {
    let image = |path: &str, rest: &str| {
        format!(
            r#"{{"path": "{path}", "width": 40, "height": 30, {rest}, "focal_px": null, "rotation": null,
            "theta_deg": 1.5, "scale": null, "gain": null, "vanishing_points": null, "mesh": null}}"#
        )
    };
    let used = r#""status": "used", "reason": "", "hint": "", "component": 0"#;
    let left_out = r#""status": "left_out", "reason": "no overlap found", "hint": "Shoot one.", "component": 1"#;
    let text = format!(
        r#"{{"format": "trueup-project", "version": 1, "method": "vpg", "options": {{}}, "reference": "x/b.jpg",
        "images": [{}, {}, {}],
        "pairs": [{{"a": 0, "b": 1, "matches": 50, "inliers": 40, "needed": 15, "verdict": "joined"}}],
        "manhattan": {{"divergence": 0.0031, "threshold": 0.1, "accepted": true, "failed_clause": null,
                       "dominant": null, "inliers": ["x/a.jpg"]}},
        "canvas": {{"width": 70, "height": 31}},
        "seconds": {{"features": 0.5, "render": 2.0, "mesh": 0.01}},
        "diagnostics": [
            {{"code": "no-overlap", "severity": "warning", "subject": {{"photograph": 2}}, "message": "no overlap found", "hint": "Shoot one."}},
            {{"code": "full-turn", "severity": "note", "subject": {{"stage": "mesh"}}, "message": "all the way round", "hint": ""}}]}}"#,
        image("x/a.jpg", used),
        image("x/b.jpg", used),
        image("x/c.jpg", left_out)
    );
    Project::from_json(&text, "test").expect("a valid project")
}

#[test]
fn the_short_summary_says_what_was_made_of_what_and_why() {
    let file = PanoramaFile {
        panorama: Path::new("p.jpg"),
        bytes: 4_200_000,
        project: Some(Path::new("p.json")),
        measured: Measured::Shown,
    };
    let expected = "\
panorama    p.jpg  70 x 31 px, 4.2 MB
project     p.json
photographs 2 of 3 used; the reference is b.jpg
  left out  c.jpg: no overlap found
            Shoot one.
upright     guided by vanishing points (divergence 0.003, up to 0.1 is trusted; 1 of 2 photographs agree)
time        2.5 s: render 2.0, features 0.5
";
    assert_eq!(text(&project(), Some(&file), false), expected);
}

#[test]
fn a_full_turn_is_said_beside_the_size() {
    let mut project = project();
    // Files that do not say so are of panoramas with two ends.
    assert!(!project.canvas.full_turn);
    project.canvas.full_turn = true;
    assert!(text(&project, None, false).starts_with("panorama    70 x 31 px, a full turn: the ends meet\n"));
}

#[test]
fn the_long_summary_adds_photographs_pairs_notes_and_stages() {
    let long = text(&project(), None, true);
    for part in [
        "panorama    70 x 31 px\n",
        "used      a.jpg: 40 x 30 px, turned by 1.50 degrees\n",
        "pairs       1 joined of 1 tried\n",
        "a.jpg - b.jpg: joined, 40 of 50 matches agree (15 needed)\n",
        "note        mesh: all the way round\n",
        "0.010 s  mesh\n",
    ] {
        assert!(long.contains(part), "{part} is not in\n{long}");
    }
}

#[test]
fn guidance_by_all_lines_together_says_how_certain_it_is() {
    let mut project = project();
    project.manhattan.pooled = true;
    project.manhattan.vertical_deviation_deg = Some(0.34);
    assert_eq!(upright(&project), "guided by the lines of all photographs together, certain to 0.3 degrees");
    project.manhattan.slope_deg = Some(2.64);
    assert!(upright(&project).ends_with("0.3 degrees; lines along a slope of 2.6 degrees do not count"));
}

/// Directions that were refused are no reason of what guided in their place.
#[test]
fn guidance_by_upright_lines_alone_names_no_divergence() {
    let mut project = project();
    project.manhattan.failed_clause = Some("the vanishing directions diverge by 0.069 (0.020 allowed)".to_owned());
    project.manhattan.vertical_deviation_deg = Some(0.85);
    assert_eq!(upright(&project), "guided by upright lines alone, certain to 0.8 degrees");
}

#[test]
fn refused_guidance_is_explained_by_its_reason_alone() {
    let mut project = project();
    project.manhattan.accepted = false;
    project.manhattan.failed_clause = Some("2 of 9 photographs agree".to_owned());
    assert_eq!(upright(&project), "not guided by vanishing points: 2 of 9 photographs agree");
}

#[test]
fn photographs_of_the_same_name_are_told_apart_by_their_paths() {
    let mut project = project();
    project.images[1].path = "y/a.jpg".to_owned();
    assert_eq!(names(&project.images), ["x/a.jpg", "y/a.jpg", "c.jpg"]);
}

fn measured(upright: serde_json::Value, photographs: serde_json::Value, longest_bent: serde_json::Value) -> Project {
    let mut project = project();
    let measures = serde_json::json!({
        "upright": upright, "estimated_gdic_deg": 0.5, "ld": 0.8, "ld_mean": 0.7, "folds": 0, "pictures": photographs,
        "reprojection": {"matches": 40, "mean_px": 0.36, "rms_px": 0.5, "percentile_95_px": 1.24},
        "long_lines": {"lines": 12, "mean_bend": 0.001, "bent": 3, "longest_bent": longest_bent}
    });
    project.measures = serde_json::from_value(measures).expect("measures");
    project
}

#[test]
fn measures_take_two_lines_and_uncertain_photographs_are_named() {
    let photograph = |path: &str, lines: usize, certain: bool| {
        serde_json::json!({"path": path, "vertical_lines": lines, "lean_deg": 0.61, "standard_error_deg": 0.04,
                           "within_deg": 0.09, "gamma_deg": 1.0, "certain": certain})
    };
    let bent = serde_json::json!({"path": "x/a.jpg", "length_px": 412.3, "off_px": 1.94});
    let upright = serde_json::json!({"mean_deg": 0.31, "max_deg": 0.61, "within_deg": 0.7, "measured": 2});
    let project =
        measured(upright, serde_json::json!([photograph("x/a.jpg", 34, true), photograph("x/b.jpg", 5, false)]), bent);
    let file = PanoramaFile { panorama: Path::new("p.jpg"), bytes: 1, project: None, measured: Measured::Shown };
    let short = "\
measured    upright within 0.7 degrees at 95 %, 0.3 expected on average (2 photographs measured, 1 uncertain: b.jpg)
            points meet within 0.4 px on average, 95 of 100 within 1.2; longest bent line: 412 px, 1.9 px off, in a.jpg
judged      upright good, alignment good, lines fair
time ";
    let printed = text(&project, Some(&file), false);
    assert!(printed.contains(short), "{printed}");
    let long = text(&project, None, false);
    assert!(long.contains("a.jpg: leans to the right by 0.61 +- 0.09 degrees at 95 % (34 vertical lines)"), "{long}");
    assert!(long.contains("b.jpg: uncertain: leans to the right by"), "{long}");
}

/// Who composes a project reads what was measured of the photographs that were stitched as just that, without advice to
/// stitch them otherwise.
#[test]
fn figures_of_an_earlier_stitch_are_called_so() {
    let mut project = measured(serde_json::Value::Null, serde_json::json!([]), serde_json::Value::Null);
    let found = Diagnostic::warning("misaligned", Subject::Pair(0, 1), "points lie apart", "Leave one out.");
    project.diagnostics.push(found);
    let told = |measured: Measured| {
        let file = PanoramaFile { panorama: Path::new("p.jpg"), bytes: 1, project: None, measured };
        text(&project, Some(&file), false)
    };
    let (own, earlier) = (told(Measured::Shown), told(Measured::Stitched));
    assert!(own.contains("b.jpg: points lie apart\n            Leave one out.\n"), "{own}");
    assert!(earlier.contains("measured    when stitched, not anew: upright"), "{earlier}");
    assert!(earlier.contains("b.jpg: when stitched, points lie apart\n"), "{earlier}");
    assert!(!earlier.contains("Leave one out"), "{earlier}");
}

#[test]
fn a_lean_has_a_side_instead_of_a_sign() {
    let photograph = |path: &str, lean: f64| {
        serde_json::json!({"path": path, "vertical_lines": 1, "lean_deg": lean, "standard_error_deg": 0.04,
                           "within_deg": 0.09, "gamma_deg": 1.0, "certain": true})
    };
    let photographs = serde_json::json!([photograph("x/a.jpg", -0.02), photograph("x/b.jpg", -0.004)]);
    let long = text(&measured(serde_json::Value::Null, photographs, serde_json::Value::Null), None, false);
    assert!(long.contains("a.jpg: leans to the left by 0.02 +- 0.09 degrees at 95 % (1 vertical line)"), "{long}");
    assert!(long.contains("b.jpg: leans by 0.00 +- 0.09 degrees at 95 % (1 vertical line)"), "{long}");
}

#[test]
fn a_lean_that_is_next_to_nothing_is_not_told_as_nothing() {
    let upright = serde_json::json!({"mean_deg": 0.04, "max_deg": 0.05, "within_deg": 0.12, "measured": 2});
    let printed = text(&measured(upright, serde_json::json!([]), serde_json::Value::Null), None, false);
    assert!(printed.contains("upright within 0.1 degrees at 95 %, less than 0.1 expected on average ("), "{printed}");
}

#[test]
fn without_vertical_lines_the_summary_says_so() {
    let photograph = serde_json::json!({"path": "x/a.jpg", "vertical_lines": 9, "lean_deg": 0.6, "standard_error_deg": 0.04,
                                        "within_deg": 0.09, "gamma_deg": 1.0, "certain": true});
    let photographs = serde_json::json!([photograph]);
    let printed = text(&measured(serde_json::Value::Null, photographs, serde_json::Value::Null), None, false);
    let told = "measured    upright not measured: vertical lines tell it of 1 of 1 photograph (2 needed)\n";
    assert!(printed.contains(told), "{printed}");
    assert!(printed.contains("; none of 12 long lines is bent\n"), "{printed}");
}

/// What may lay a panorama on its side is told to everybody; what the view cuts off, to who asks for all.
#[test]
fn notes_on_what_was_decided_for_the_user_are_told() {
    let mut project = project();
    let note = |code: &str, message: &str| Diagnostic::note(code, Subject::Photograph(0), message, "Set something.");
    let tag = note(ORIENTATION_TAG_STALE, "the tag was not applied");
    // The same of another is told with it.
    project.diagnostics.push(tag.clone());
    project.diagnostics.push(Diagnostic { subject: Subject::Photograph(1), ..tag });
    project.diagnostics.push(note(PROJECTION_CUT, "12 % of it lies outside of the view"));
    let told = text(&project, None, false);
    assert!(told.contains("note        a.jpg, b.jpg: the tag was not applied\n            Set something.\n"), "{told}");
    assert!(!told.contains("outside of the view"), "{told}");
    project.options.arrange.canvas.crop = Crop::None;
    let told = text(&project, None, false);
    assert!(told.contains("note        a.jpg: 12 % of it lies outside of the view\n"), "{told}");
}
