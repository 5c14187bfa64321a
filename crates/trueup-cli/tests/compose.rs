//! Panoramas composed again from their projects.

use serde_json::{Value, json};

use crate::pictures::{HEIGHT, STREET_NAMES, WIDTH, jpeg, noise, plain, street, street_desk, street_pixels};
use crate::run::{Desk, FinishedRun, finish, trueup};

/// A folder with the street's photographs, their panorama `pano.jpg` and its project `pano.json`.
fn stitched() -> Desk {
    let desk = street_desk();
    desk.stitch(&[&STREET_NAMES[..], &["--project", "pano.json"]].concat()).expect_success();
    desk
}

fn compose(desk: &Desk, arguments: &[&str]) -> FinishedRun {
    finish(trueup(desk.path(), &[&["compose", "pano.json", "-o", "again.jpg"], arguments].concat()))
}

#[test]
fn the_same_options_give_the_same_bytes() {
    let desk = stitched();
    let stdout = compose(&desk, &["--project", "again.json"]).expect_success().to_owned();
    assert!(stdout.contains("photographs 4 of 4 used"), "{stdout}");
    assert!(desk.read("pano.jpg") == desk.read("again.jpg"), "the panoramas differ");
    let without_seconds = |name: &str| {
        let mut project = desk.json(name);
        project.as_object_mut().expect("an object").remove("seconds");
        project
    };
    assert_eq!(without_seconds("pano.json"), without_seconds("again.json"));
}

/// A panorama that was not cropped, because no rectangle keeps enough of it, has empty corners when it is composed
/// again, too.
#[test]
fn what_was_kept_whole_stays_as_it_was() {
    let desk = street_desk();
    let view = ["--projection", "mesh", "--set", "canvas.min_kept=1", "--project", "pano.json"];
    let stdout = desk.stitch(&[&STREET_NAMES[..], &view].concat()).expect_success().to_owned();
    assert!(stdout.contains("it was not cropped"), "{stdout}");
    compose(&desk, &["--project", "again.json"]).expect_success();
    assert!(desk.read("pano.jpg") == desk.read("again.jpg"), "the panoramas differ");
    assert_eq!(desk.json("pano.json")["diagnostics"], desk.json("again.json")["diagnostics"]);
}

/// Photographs of several exposures by a camera that presses highlights together: the response that was found is
/// recorded, and gives the same panorama again.
#[test]
fn a_response_is_recorded() {
    let desk = Desk::new();
    for ((name, pixels), exposure) in STREET_NAMES.iter().zip(street_pixels()).zip([1.0, 0.45, 1.5, 0.6]) {
        let pressed = |level: u8| {
            let light = exposure * (f64::from(level) / 255.0).powf(2.2);
            let shown = (1.0 - (-2.0 * light).exp()) / (1.0 - f64::exp(-2.0));
            (255.0 * shown.min(1.0).powf(1.0 / 2.2)).round() as u8
        };
        let pixels: Vec<u8> = pixels.iter().copied().map(pressed).collect();
        desk.put(name, jpeg(&pixels, WIDTH, HEIGHT));
    }
    desk.stitch(&[&STREET_NAMES[..], &["--project", "pano.json"]].concat()).expect_success();
    let response = desk.json("pano.json")["response"].clone();
    let response: Vec<f64> = serde_json::from_value(response).expect("numbers");
    assert!(response.len() == 4 && response.iter().any(|&one| one.abs() > 0.1), "{response:?}");
    compose(&desk, &["--project", "again.json"]).expect_success();
    assert!(desk.read("pano.jpg") == desk.read("again.jpg"), "the panoramas differ");
    assert_eq!(desk.json("again.json")["response"], json!(response));
    compose(&desk, &["--set", "exposure.response=false", "--project", "again.json"]).expect_success();
    assert!(desk.read("pano.jpg") != desk.read("again.jpg"));
    assert_eq!(desk.json("again.json")["response"], json!([0.0, 0.0, 0.0, 0.0]));
}

/// Another shot of the same cameras, half as bright but for one photograph: with the recorded light it would be
/// stripes.
#[test]
fn another_shot_of_a_rig_is_lit_anew() {
    let desk = stitched();
    std::fs::create_dir(desk.join("shot")).expect("a folder");
    for (k, (name, pixels)) in STREET_NAMES.iter().zip(street_pixels()).enumerate() {
        let exposure = if k == 1 { 1.0 } else { 0.5 };
        let darker = |level: &u8| (f64::from(*level) * exposure) as u8;
        desk.put(&format!("shot/{name}"), jpeg(&pixels.iter().map(darker).collect::<Vec<u8>>(), WIDTH, HEIGHT));
    }
    let brightest = |arguments: &[&str]| {
        compose(&desk, &[&["--photos", "shot", "--project", "again.json"], arguments].concat()).expect_success();
        let project = desk.json("again.json");
        let gains =
            project["images"].as_array().expect("photographs").iter().map(|one| one["gain"].as_f64().expect("a gain"));
        gains.clone().fold(0.0, f64::max) / gains.fold(f64::INFINITY, f64::min)
    };
    let (recorded, anew) = (brightest(&[]), brightest(&["--relight"]));
    assert!(recorded < 1.3 && anew > 2.0, "{recorded} {anew}");
}

/// What `--pto` writes can be composed: the same cameras draw the same view, a little otherwise than the mesh did.
#[test]
fn a_hugin_project_is_composed() {
    let desk = stitched();
    compose(&desk, &["--pto", "pano.pto"]).expect_success();
    let composed = |arguments: &[&str]| {
        let all = [&["compose", "pano.pto", "-o", "again.png", "--project", "again.json"], arguments].concat();
        finish(trueup(desk.path(), &all))
    };
    let run = composed(&[]);
    assert!(run.expect_success().contains("photographs 4 of 4 used"), "{}", run.stdout);
    let (project, again) = (desk.json("pano.json"), desk.json("again.json"));
    // The sphere that the file describes, at the pixel scale of the photographs' middles.
    assert_eq!(again["projection"]["kind"], "equirectangular");
    for k in 0..4 {
        let of = |project: &Value| {
            let image = &project["images"][k];
            let rotation = image.get("upright_rotation").filter(|one| one.is_array()).unwrap_or(&image["rotation"]);
            let numbers: Vec<Vec<f64>> = serde_json::from_value(rotation.clone()).expect("a rotation");
            (image["focal_px"].as_f64().expect("a focal length"), numbers.concat())
        };
        let ((focal, rotation), (focal_again, rotation_again)) = (of(&project), of(&again));
        assert!((focal / focal_again - 1.0).abs() < 1e-5, "{focal} {focal_again}");
        let apart = rotation.iter().zip(&rotation_again).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{apart}");
    }
    composed(&["--projection", "perspective"]).expect_success();

    let told = desk.stitch(&[&STREET_NAMES[..2], &["--lens-from", "pano.pto"]].concat());
    assert!(
        told.expect_success().contains("lens        told: that of pano.pto, for 2 of 2 photographs"),
        "{}",
        told.stdout
    );
    let text = String::from_utf8(desk.read("pano.pto")).expect("text");
    desk.put("masked.pto", format!("{text}k i1 t0 p\"1 1 9 1 9 9\"\n"));
    let masked = finish(trueup(desk.path(), &["compose", "masked.pto", "-o", "again.png"]));
    assert!(masked.expect_success().contains("masks parts of it"), "{}", masked.stdout);
    desk.put("moved.pto", text.replace("TrX0", "TrX0.5"));
    finish(trueup(desk.path(), &["compose", "moved.pto", "-o", "again.png"]))
        .expect_failure(1, &["moved.pto", "its camera moved"]);
    desk.put("a.jpg", plain(WIDTH / 2, HEIGHT, 0));
    composed(&[]).expect_failure(1, &["the Hugin project has it at"]);
}

/// Photographs left out of the panorama keep their numbers: a finding names the one that it is about.
#[test]
fn findings_of_composing_name_the_photographs_they_are_about() {
    let desk = street_desk();
    desk.put("0.jpg", noise(1, 320, 240));
    desk.stitch(&[&["0.jpg"][..], &STREET_NAMES, &["--project", "pano.json"]].concat()).expect_success();
    compose(&desk, &["--projection", "perspective", "--fov", "5", "--project", "again.json"]).expect_success();
    let project = desk.json("again.json");
    let of_view = |finding: &&Value| finding["code"] == "projection-left-out";
    let findings: Vec<&Value> = project["diagnostics"].as_array().expect("findings").iter().filter(of_view).collect();
    assert!(!findings.is_empty(), "nothing lies outside of five degrees: {}", project["diagnostics"]);
    for finding in findings {
        let photograph = finding["subject"]["photograph"].as_u64().expect("a number");
        assert_eq!(project["images"][photograph as usize]["status"], "used", "{finding}");
    }
    assert_eq!(project["images"][0]["status"], "left_out");
}

/// Composing with a view gives what stitching with it does, from projects of the same view, of none, and cropped.
#[test]
fn views_and_what_lies_beside_a_panorama_come_out_as_stitched() {
    let desk = stitched();
    let view =
        ["--projection", "equirectangular", "--yaw", "5", "--crop", "rectangle", "--fill", "0.1", "--depth", "8"];
    let stitched =
        [&["stitch", "-o", "view.jpg", "--scale", "0.5", "--project", "view.json"], &STREET_NAMES[..], &view];
    finish(trueup(desk.path(), &stitched.concat())).expect_success();
    let beside = ["--layers", "layers.tif", "--seams", "seams.png", "--pto", "again.pto"];
    compose(&desk, &[&view[..], &beside].concat()).expect_success();
    assert!(desk.read("view.jpg") == desk.read("again.jpg"), "from the mesh's project");
    assert!(beside.chunks(2).all(|flag| desk.join(flag[1]).is_file()));
    finish(trueup(desk.path(), &["compose", "view.json", "-o", "again.jpg"])).expect_success();
    assert!(desk.read("view.jpg") == desk.read("again.jpg"), "from its own project");

    compose(&desk, &["--crop", "rectangle", "--project", "cropped.json"]).expect_success();
    assert!(desk.read("pano.jpg") != desk.read("again.jpg"));
    finish(trueup(desk.path(), &["compose", "cropped.json", "-o", "third.jpg"])).expect_success();
    assert!(desk.read("again.jpg") == desk.read("third.jpg"), "from the cropped project");
}

/// A panorama that is cropped shows what the whole one shows there, and of the same photographs: seams, light and
/// geometry are found before. Its record is that of the part, and holds the whole.
#[test]
fn a_crop_changes_nothing_but_the_frame() {
    let desk = stitched();
    for projection in ["auto", "mesh"] {
        let composed = |crop: &str| {
            let seams = format!("{crop}-seams.png");
            let arguments = ["--crop", crop, "--projection", projection, "--seams", &seams, "--depth", "8"];
            let project = format!("{crop}.json");
            let all = [&["compose", "pano.json", "-o", &format!("{crop}.png"), "--project", &project], &arguments[..]];
            finish(trueup(desk.path(), &all.concat())).expect_success();
            let open = |name: &str| image::open(desk.join(name)).expect("a picture");
            (open(&format!("{crop}.png")).to_rgba8(), open(&seams).to_luma16(), desk.json(&project))
        };
        let (whole, whole_seams, whole_project) = composed("none");
        assert!(whole_project.get("crop").is_none() && whole.pixels().any(|pixel| pixel.0[3] < 255));
        for crop in ["auto", "rectangle"] {
            let (part, seams, project) = composed(crop);
            let [left, top] = ["left", "top"].map(|side| project["crop"][side].as_u64().expect("a place") as u32);
            assert!(
                project["crop"]["lost"].as_f64().is_some_and(|lost| lost > 0.0 && lost < 0.5),
                "{}",
                project["crop"]
            );
            assert_eq!(project["crop"]["canvas_width"], whole_project["canvas"]["width"]);
            for (x, y, pixel) in part.enumerate_pixels() {
                let there = whole.get_pixel(left + x, top + y);
                assert_eq!(pixel.0[3], 255, "{crop}: ({x}, {y}) is empty");
                // What is filled begins in pixels that are covered in part, which may be so much that it rounds to all.
                let is_filled = || {
                    let around = (0..9).map(|k| [left + x + k % 3, top + y + k / 3].map(|at| at.saturating_sub(1)));
                    let mut known = around.filter_map(|[x, y]| whole.get_pixel_checked(x, y));
                    let is_close = pixel.0.iter().zip(there.0).all(|(own, there)| own.abs_diff(there) <= 1);
                    is_close && known.any(|pixel| pixel.0[3] < 255)
                };
                assert!(there == pixel || there.0[3] < 255 || is_filled(), "{crop}: ({x}, {y})");
                assert_eq!(seams.get_pixel(x, y), whole_seams.get_pixel(left + x, top + y), "{crop}: ({x}, {y})");
            }
            let (grids, _) = recorded_grids(&project);
            let (all, _) = recorded_grids(&whole_project);
            let places = grids.iter().flatten().flatten().zip(all.iter().flatten().flatten());
            for (place, there) in places {
                let off = [place[0] + f64::from(left) - there[0], place[1] + f64::from(top) - there[1]];
                assert!(off.iter().all(|off| off.abs() < 1e-9), "{crop}: {off:?}");
            }
            assert!(project["images"][1]["solved_mesh"].is_object());
        }
        let from_a_part = ["compose", "auto.json", "-o", "again.png", "--crop", "none", "--depth", "8"];
        finish(trueup(desk.path(), &from_a_part)).expect_success();
        assert!(desk.read("again.png") == desk.read("none.png"), "from the cropped project");
    }
}

/// Rows of vertices.
type RecordedGrid = Vec<Vec<[f64; 2]>>;

/// The recorded grids, row after row, and the size of the panorama.
fn recorded_grids(project: &Value) -> (Vec<RecordedGrid>, [f64; 2]) {
    let grid = |image: &Value| {
        let columns = image["mesh"]["cols"].as_u64().expect("a number") as usize;
        let target: Vec<[f64; 2]> = serde_json::from_value(image["mesh"]["target"].clone()).expect("places");
        target.chunks(columns).map(<[_]>::to_vec).collect()
    };
    let grids = project["images"].as_array().expect("photographs").iter().map(grid).collect();
    (grids, ["width", "height"].map(|side| project["canvas"][side].as_f64().expect("a size")))
}

/// Recorded grids lie where the panorama shows the photographs: on the perspective projection, on which the edge of a
/// photograph is a straight line, their rows are straight; and on a cylinder, which shows all, they reach from end to
/// end.
#[test]
fn recorded_grids_are_those_of_the_panorama() {
    let desk = stitched();
    let composed = |projection: &str| {
        compose(&desk, &["--projection", projection, "--crop", "none", "--project", "again.json"]).expect_success();
        desk.json("again.json")
    };
    let (grids, _) = recorded_grids(&composed("perspective"));
    for row in grids.iter().flatten() {
        let [from, to] = [row[0], row[row.len() - 1]];
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        let aside = |at: &[f64; 2]| (along[0] * (at[1] - from[1]) - along[1] * (at[0] - from[0])).abs() / length;
        assert!(row.iter().map(aside).fold(0.0, f64::max) < 0.01 * length, "{from:?} to {to:?}");
    }
    let cylinder = composed("cylindrical");
    let (grids, size) = recorded_grids(&cylinder);
    for (axis, size) in size.into_iter().enumerate() {
        let along = || grids.iter().flatten().flatten().map(|place| place[axis]);
        let (low, high) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        assert!(low.abs() < 1.5 && (high - size).abs() < 1.5, "from {low} to {high} of {size}");
    }
    let mesh = composed("mesh");
    assert_ne!(cylinder["images"][0]["mesh"], mesh["images"][0]["mesh"]);
    assert_eq!(cylinder["images"][0]["solved_mesh"], mesh["images"][0]["mesh"]);
    assert!(mesh["images"][0].get("solved_mesh").is_none());
}

#[test]
fn other_options_of_composing_are_heeded_and_others_refused() {
    let desk = stitched();
    let canvas = desk.json("pano.json")["crop"]["canvas_width"].as_u64().expect("a width");
    compose(&desk, &["--scale", "0.25", "--set", "render.blend=feather", "--project", "small.json"]).expect_success();
    let small = desk.json("small.json");
    let width = small["crop"]["canvas_width"].as_u64().expect("a width");
    assert!(width.abs_diff(canvas / 2) <= 1, "{width} is not half of {canvas}");
    assert_eq!((&small["measures"], &small["options"]["canvas"]["scale"]), (&Value::Null, &json!(0.25)));
    // What was written can be composed, too.
    let again = finish(trueup(desk.path(), &["compose", "small.json", "-o", "third.jpg"]));
    again.expect_success();
    assert!(desk.read("again.jpg") == desk.read("third.jpg"));
    compose(&desk, &["--set", "mesh.cell_px=30", "--set", "random.seed=5"]).expect_failure(
        2,
        &[
            "composing a recorded panorama with another random.seed, mesh.cell_px is not supported",
            "stitch the photographs",
        ],
    );
    compose(&desk, &["--set", "exposure.enabled=false"]).expect_success();
    assert!(desk.read("again.jpg") != desk.read("pano.jpg"));
}

#[test]
fn photographs_are_found_where_they_moved_and_others_shown_in_their_place() {
    let desk = stitched();
    let folder = desk.join("moved");
    std::fs::create_dir(&folder).expect("a folder");
    for name in STREET_NAMES {
        std::fs::rename(desk.join(name), folder.join(name)).expect("moved");
    }
    compose(&desk, &[]).expect_failure(1, &["4 of 4 photographs: a.jpg: photograph not found", "d.jpg: ", "--photos"]);
    compose(&desk, &["--photos", "moved"]).expect_success();
    assert!(desk.read("pano.jpg") == desk.read("again.jpg"), "the panoramas differ");
    // Beside the project, wherever the command is run.
    std::fs::copy(desk.join("pano.json"), folder.join("pano.json")).expect("copied");
    finish(trueup(desk.path(), &["compose", "moved/pano.json", "-o", "third.jpg"])).expect_success();
    assert!(desk.read("pano.jpg") == desk.read("third.jpg"), "the panoramas differ");
    // Plain photographs of the same names and size.
    std::fs::create_dir(desk.join("gray")).expect("a folder");
    for (name, level) in [("a.jpg", 90), ("b.jpeg", 91), ("c.jpg", 92), ("d.jpg", 93)] {
        desk.put(&format!("gray/{name}"), plain(480, 360, level));
    }
    let verbose = compose(&desk, &["--photos", "gray", "--verbose"]);
    assert!(verbose.stdout.contains("measured    when stitched, not anew: upright"), "{}", verbose.stdout);
    assert!(verbose.expect_success().contains("b.jpeg: it is shown in place of b.jpg"), "{}", verbose.stdout);
    desk.put("gray/d.jpg", plain(481, 360, 93));
    std::fs::remove_file(desk.join("gray/a.jpg")).expect("removed");
    compose(&desk, &["--photos", "gray"]).expect_failure(
        1,
        &["2 of 4 photographs: a.jpg: no file in gray has its name; gray/d.jpg: it is 481 x 360 px, the project has it at 480 x 360 px"],
    );
    // Other names: the order counts.
    std::fs::create_dir(desk.join("order")).expect("a folder");
    for (position, name) in STREET_NAMES.iter().enumerate() {
        std::fs::copy(folder.join(name), desk.join(&format!("order/{}.jpg", position + 8))).expect("copied");
    }
    compose(&desk, &["--photos", "order"]).expect_success();
    assert!(desk.read("pano.jpg") == desk.read("again.jpg"), "the panoramas differ");
}

/// Changes of a project that no stitch could have written, with a part of what is said of each.
#[test]
fn projects_edited_to_nonsense_are_refused() {
    let desk = stitched();
    compose(&desk, &["--projection", "mesh", "--crop", "none", "--project", "mesh.json"]).expect_success();
    let project = desk.json("mesh.json");
    let target = "/images/0/mesh/target";
    let mistakes = [
        ("/images/0/width", json!(0), "is damaged"),
        ("/images/1/mesh", Value::Null, "the project holds no grid of it"),
        ("/images/0/mesh/rows", json!(1), "is damaged"),
        ("/images/0/mesh/cols", json!(u64::MAX), "is damaged"),
        (target, json!([]), "is damaged"),
        ("/images/0/mesh/target/0", json!([1e300, 0.0]), "is damaged"),
        ("/images/0/mesh/target/0/0", Value::Null, "is damaged"),
        ("/images/0/mesh/target/0", json!([null, null]), "vertices of its grid are missing"),
        ("/images/0/mesh/source/1", json!([3.0, 3.0]), "is damaged"),
        (
            "/images/0/correction/gain/1",
            json!(-0.5),
            "edited.json: images[0] (a.jpg): correction.gain is -0.5, allowed are 0.000001 to 1000000",
        ),
        ("/images/0/correction/vignetting/2", json!(1e5), "no positive factors on light"),
        ("/images/0/gain", json!(1e30), "edited.json: images[0] (a.jpg): gain is "),
        (
            "/images/0/upright_rotation",
            json!([[0, 0, 0], [0, 0, 0], [0, 0, 0]]),
            "images[0] (a.jpg): upright_rotation is no rotation",
        ),
        ("/images/0/status", json!("lost"), "the project is damaged"),
        ("/canvas/width", json!(0), "does not belong to the grids"),
        ("/canvas/height", json!(1_000_000_000_u64), "does not belong to the grids"),
        ("/canvas/width", json!(20), "does not belong to the grids"),
        ("/reference", json!("nobody.jpg"), "none of the photographs used"),
        ("/options/mesh", json!({"cell": 3}), "the project is damaged"),
        ("/options/canvas/scale", json!(-2.0), "invalid canvas.scale = -2"),
        ("/images", json!([]), "uses no photographs"),
        ("/images/2/path", json!(""), "photograph"),
        ("/images/2/height", json!(361), "is damaged"),
    ];
    let files = desk.files();
    for (pointer, value, part) in mistakes {
        let mut edited = project.clone();
        *edited.pointer_mut(pointer).expect("a field") = value;
        desk.put("edited.json", edited.to_string());
        let run = finish(trueup(desk.path(), &["compose", "edited.json", "-o", "again.jpg"]));
        assert!(matches!(run.status, 1 | 2) && run.stderr.contains(part), "{pointer}: {}", run.stderr);
        std::fs::remove_file(desk.join("edited.json")).expect("removed");
        assert_eq!(desk.files(), files, "{pointer}: nothing is left behind");
    }
}

/// Whatever is shown instead, what a panorama was stitched of is nobody's to write over.
#[test]
fn what_is_recorded_is_not_written_over() {
    let desk = street_desk();
    let mask = image::GrayImage::from_pixel(WIDTH as u32, HEIGHT as u32, image::Luma([255]));
    mask.save(desk.join("m.png")).expect("written");
    let masked = ["--mask", "b.jpg=m.png", "--project", "pano.json"];
    desk.stitch(&[&STREET_NAMES[..], &masked].concat()).expect_success();
    std::fs::create_dir(desk.join("shot")).expect("a folder");
    for name in STREET_NAMES {
        desk.put(&format!("shot/{name}"), desk.read(name));
    }
    let refused = |output: &str, more: &[&str], what: &str| {
        let before = desk.read(output);
        finish(trueup(desk.path(), &[&["compose", "pano.json", "-o", output], more].concat()))
            .expect_failure(1, &[&format!("{output}: this file is one of the {what}")]);
        assert!(desk.read(output) == before);
    };
    refused("m.png", &[], "masks");
    refused("a.jpg", &[], "photographs");
    refused("a.jpg", &["--photos", "shot"], "photographs");
    refused("shot/a.jpg", &["--photos", "shot"], "photographs");
}

/// By their names alone nobody can tell photographs of one name in two folders apart.
#[test]
fn one_file_is_not_shown_in_two_places() {
    let desk = Desk::new();
    for (folder, photograph) in ["a", "b", "f", "moved"].iter().zip(street()) {
        std::fs::create_dir(desk.join(folder)).expect("a folder");
        desk.put(&format!("{folder}/1.jpg"), photograph);
    }
    desk.stitch(&["a", "b", "--project", "pano.json"]).expect_success();
    let told = "1.jpg: it would stand for two photographs of the panorama, a/1.jpg and b/1.jpg";
    compose(&desk, &["--photos", "f"]).expect_failure(1, &[told, "f/1.jpg", "one photograph for each one"]);
    desk.put("moved/pano.json", desk.read("pano.json"));
    let moved = ["compose", "pano.json", "-o", "again.jpg"];
    finish(trueup(&desk.join("moved"), &moved)).expect_failure(1, &[told, "back into their folders"]);
    assert!(!desk.join("again.jpg").exists() && !desk.join("moved/again.jpg").exists());
}
