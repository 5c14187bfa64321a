//! One person's way through: stitched, turned, undone, saved and opened again, and all of it what the command makes.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use trueup::{
    ComposeJob, Inputs, Outputs, Project, SideOutput, StageContext, StitchJob, StitchOptions, names_photograph,
    write_thumbnail,
};
use trueup_report::drawings::Layer;

use crate::server::Server;

/// A folder with copies of the photographs of the example.
fn room() -> tempfile::TempDir {
    let desk = tempfile::tempdir().expect("a folder");
    let room = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room"));
    for number in 0..5 {
        let name = format!("0{number}.jpg");
        std::fs::copy(room.join(&name), desk.path().join(&name)).expect("copied");
    }
    desk
}

/// A size at which composing takes a moment.
const SMALL: &str = r#"{"options":{"canvas.scale":"0.1"}}"#;

fn stitched(server: &Server) -> Value {
    assert_eq!(server.post("/api/stitch", "").status, 202);
    let told = server.settled();
    assert_eq!((&told["trouble"], &told["stitched"]["used"]), (&Value::Null, &json!(5)), "{told}");
    told
}

/// The project without what differs from run to run, or by where files lie.
fn comparable(text: &[u8]) -> Value {
    let mut project: Value = serde_json::from_slice(text).expect("a project");
    project["seconds"] = Value::Null;
    project
}

#[test]
fn a_panorama_and_its_project_are_those_of_the_command() {
    let (desk, elsewhere) = (room(), tempfile::tempdir().expect("a folder"));
    let server = Server::of(desk.path());
    // Uncropped, for what is cut off is found as a panorama is composed.
    let wishes = json!({ "canvas.crop": "none", "canvas.scale": "0.1" });
    assert_eq!(server.post("/api/wishes", &json!({ "options": wishes }).to_string()).status, 204);
    stitched(&server);
    let order = json!({ "name": "pano.png", "beside": ["project"], "into_folder": false }).to_string();
    assert_eq!(server.post("/api/exports", &order).status, 202);
    let told = server.settled();
    let export = &told["exports"][0];
    let fetch = |file: usize| server.get(&format!("/api/exports/{}/{file}", export["number"]));
    assert_eq!(export["files"].as_array().map(Vec::len), Some(2), "{told}");

    let mut options = StitchOptions::default();
    for choice in ["canvas.scale=0.1", "canvas.crop=none"] {
        options.set(choice).expect("an option");
    }
    let place = |name: &str| -> PathBuf { elsewhere.path().join(name) };
    let outputs = Outputs::new(place("pano.png")).with(SideOutput::Project, place("pano.json"));
    let inputs = Inputs::new([desk.path().display().to_string()]);
    let job = StitchJob { inputs, outputs, cache: None, threads: 0 };
    job.run(&options, &StageContext::default()).expect("stitched");
    let picture = std::fs::read(place("pano.png")).expect("a picture");
    let served = fetch(0);
    assert!(served.head.contains("content-disposition: attachment; filename*=UTF-8''pano.png"), "{}", served.head);
    assert!(unchunked(&served.body) == picture, "the same bytes");
    let project = std::fs::read(place("pano.json")).expect("a project");
    assert_eq!(comparable(&unchunked(&fetch(1).body)), comparable(&project));

    // Opened again by a server that knows nothing of it, the record is the same.
    let other = Server::of(desk.path());
    assert_eq!(other.with_body("PUT", "/api/project", &project).status, 202);
    let told = other.settled();
    assert_eq!((&told["trouble"], &told["wishes"]), (&Value::Null, &wishes));
    let mut reopened = comparable(&other.get("/api/project").body);
    let mut recorded = comparable(&project);
    for one in [&mut reopened, &mut recorded] {
        // What composing tells is told when it composes.
        one["diagnostics"] = Value::Null;
    }
    assert_eq!(reopened, recorded);

    // Recorded from within the folder, photographs and reference are told by their names.
    let folder = format!("{}/", desk.path().display());
    let within = String::from_utf8(project).expect("text").replace(&folder, "./");
    let third = Server::of(desk.path());
    assert_eq!(third.with_body("PUT", "/api/project", within.as_bytes()).status, 202);
    assert_eq!(third.settled()["trouble"], Value::Null);
}

#[test]
fn wishes_are_drawn_kept_and_undone() {
    let desk = room();
    let server = Server::of(desk.path());
    let nothing = server.post("/api/preview", "{}");
    assert_eq!(nothing.status, 422, "there is no panorama yet: {nothing:?}");
    stitched(&server);
    let drawn = |wishes: &str| {
        let answer = server.post("/api/preview", wishes);
        assert_eq!(answer.status, 200, "{answer:?}");
        let told = answer.json();
        let picture = server.get(&format!("/api/preview/{}", told["number"]));
        assert!(picture.body.starts_with(b"\xff\xd8"), "a JPEG");
        let pixels = told["canvas"]["width"].as_f64().zip(told["canvas"]["height"].as_f64());
        assert!(pixels.is_some_and(|(width, height)| width * height <= 500_000.0), "{told}");
        told
    };
    let straight = drawn("{}");
    let turned = drawn(r#"{"options":{"projection.yaw":"10"}}"#);
    let yaw = |told: &Value| told["projection"]["yaw_deg"].as_f64().expect("a view");
    assert!((yaw(&turned) - yaw(&straight) - 10.0).abs() < 1e-6, "{turned}");
    assert_eq!(server.get("/api/news").json()["can_undo"], false, "trying is no wish");

    assert_eq!(
        server.post("/api/wishes", r#"{"options":{"projection.yaw":"10","canvas.crop":"rectangle"}}"#).status,
        204
    );
    assert!((yaw(&drawn("{}")) - yaw(&turned)).abs() < 1e-9);
    assert_eq!(server.post("/api/undo", "").status, 204);
    assert_eq!(drawn("{}")["canvas"], straight["canvas"]);
    assert_eq!(server.post("/api/wishes", r#"{"options":{"stitch.method":"autostitch"}}"#).status, 204);
    assert_eq!(server.get("/api/news").json()["stitched"]["stale"], true, "another geometry is to be stitched");
    server.post("/api/undo", "");
    assert_eq!(server.get("/api/news").json()["stitched"]["stale"], false);

    assert_eq!(server.post("/api/tiles", "").status, 202);
    let told = server.settled();
    let tiles = told["tiles"].as_u64().unwrap_or_else(|| panic!("{told}"));
    assert!(server.get(&format!("/api/tiles/{tiles}/panorama.dzi")).text().contains("TileSize"));
    assert!(server.get(&format!("/api/tiles/{tiles}/panorama_files/0/0_0.jpg")).body.starts_with(b"\xff\xd8"));
    assert_eq!(server.get(&format!("/api/tiles/{tiles}/panorama_files/0/5_0.jpg")).status, 404);
}

#[test]
fn work_is_told_and_stopped() {
    let desk = room();
    let server = Server::of(desk.path());
    assert_eq!(server.post("/api/stitch", "").status, 202);
    assert_eq!(server.post("/api/stitch", "").status, 409, "one at a time");
    assert_eq!(server.post("/api/tiles", "").status, 204, "nobody asked for tiles: they wait");
    let told = server.get("/api/news").json();
    assert_eq!(told["work"]["task"], "stitch", "{told}");
    assert_eq!(server.post("/api/stop", "").status, 204);
    let told = server.settled();
    assert_eq!((&told["stitched"], &told["trouble"]), (&Value::Null, &Value::Null), "{told}");
}

#[test]
fn photographs_are_shown_dropped_left_out_and_painted_on() {
    let desk = room();
    let server = Server::of(desk.path());
    let small = server.get("/api/photographs/2/thumbnail");
    assert!(
        small.status == 200 && small.head.contains("x-width: 1200") && small.head.contains("x-height: 900"),
        "{}",
        small.head
    );
    let mask = std::fs::read(desk.path().join("00.jpg")).expect("a photograph");
    assert_eq!(server.with_body("PUT", "/api/photographs?name=again.jpg", &mask).status, 201);
    assert_eq!(server.post("/api/wishes", r#"{"left_out":{"5":true,"4":true}}"#).status, 204);
    assert_eq!(server.post("/api/wishes", SMALL).status, 204);
    assert_eq!(server.post("/api/stitch", "").status, 202);
    let told = server.settled();
    assert_eq!(told["stitched"]["used"], 4, "{told}");
    let listed = |told: &Value, number: usize| told["photographs"][number].clone();
    assert_eq!((&listed(&told, 4)["left_out"], &listed(&told, 4)["verdict"]), (&json!(true), &Value::Null));
    assert_eq!(listed(&told, 0)["verdict"]["used"], true);

    // Any PNG of another size is told by the library when it is used.
    let png = b"\x89PNG\r\n\x1a\n";
    assert_eq!(server.with_body("PUT", "/api/photographs/0/mask/use", png).status, 204);
    let painted = server.get("/api/news").json();
    assert!(painted["stitched"]["stale"] == true && listed(&painted, 0)["used_mask"].is_string(), "{painted}");
    assert_eq!(server.get("/api/photographs/0/mask/use").body, png);
    assert_eq!(server.post("/api/stitch", "").status, 202);
    assert!(server.settled()["trouble"]["message"].is_string(), "it is no picture");
    assert_eq!(server.with_body("PUT", "/api/photographs/0/mask/use", b"").status, 204);
    assert_eq!(listed(&server.get("/api/news").json(), 0)["used_mask"], Value::Null);
}

/// Folders are opened by their paths from the first one, which the page is told: one of the same name elsewhere is not
/// meant.
#[test]
fn folders_in_folders_are_opened() {
    let desk = tempfile::tempdir().expect("a folder");
    for folder in ["a/b", "b"] {
        std::fs::create_dir_all(desk.path().join(folder)).expect("a folder");
    }
    std::fs::write(desk.path().join("a/b/meant.jpg"), "x").expect("a file");
    let server = Server::of(desk.path());
    let opened = |path: &str| {
        assert_eq!(server.post("/api/folder", &json!({ "folder": path }).to_string()).status, 204, "{path}");
        server.get("/api/news").json()
    };
    assert_eq!(server.get("/api/news").json()["folder"]["inside"], "");
    let told = opened("a");
    assert_eq!((&told["folder"]["inside"], &told["folder"]["folders"]), (&json!("a"), &json!(["b"])));
    let told = opened("a/b");
    assert_eq!((&told["folder"]["inside"], &told["photographs"][0]["name"]), (&json!("a/b"), &json!("meant.jpg")));
    assert_eq!(opened("")["folder"]["inside"], "");
}

/// What was dropped and is forgotten can be dropped again, as what it is by now.
#[test]
fn forgotten_photographs_are_dropped_again() {
    let desk = room();
    std::fs::create_dir(desk.path().join("inside")).expect("a folder");
    let photograph = std::fs::read(desk.path().join("00.jpg")).expect("a photograph");
    let server = Server::of(desk.path());
    let dropped = |bytes: &[u8]| server.with_body("PUT", "/api/photographs?name=new.jpg", bytes).status;
    assert_eq!((dropped(b"none"), dropped(b"none")), (201, 409));
    assert_eq!(server.post("/api/folder", r#"{"folder":"inside"}"#).status, 204);
    assert_eq!(server.get("/api/news").json()["photographs"], json!([]));
    assert_eq!((dropped(&photograph), dropped(&photograph)), (201, 409));
    assert_eq!(server.get("/api/news").json()["photographs"][0]["name"], "new.jpg");
    assert_eq!(server.get("/api/photographs/0/thumbnail").status, 200, "the photograph that was dropped last");
}

#[test]
fn every_format_that_is_read_can_be_chosen() {
    let desk = room();
    let told = Server::of(desk.path()).get("/api/options").json();
    let extensions: Vec<&str> =
        told["photographs"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    for wanted in [".jpg", ".jpeg", ".heic", ".jxl", ".exr", ".hdr", ".tif", ".webp"] {
        assert!(extensions.contains(&wanted), "{wanted} of {extensions:?}");
    }
    assert!(extensions.iter().all(|extension| names_photograph(Path::new(&format!("photograph{extension}")))));
}

#[test]
fn drawings_lie_over_previews_and_tiles_as_the_report_has_them() {
    let desk = room();
    let server = Server::of(desk.path());
    let wishes = json!({ "options": { "canvas.scale": "0.2", "canvas.crop": "none" } }).to_string();
    assert_eq!(server.post("/api/wishes", &wishes).status, 204);
    stitched(&server);
    let possible = server.get("/api/options").json();
    let names: Vec<&str> =
        possible["layers"].as_array().expect("a list").iter().filter_map(|one| one["name"].as_str()).collect();
    assert_eq!(names, Layer::ALL.map(Layer::name));

    // As large as it was stitched: what is drawn is what the record says.
    assert_eq!(server.post("/api/tiles", "").status, 202);
    let tiles = server.settled()["tiles"].as_u64().expect("tiles");
    let project = Project::from_json(&server.get("/api/project").text(), "panorama.json").expect("a project");
    let layer = |over: &str, name: &str| server.get(&format!("/api/{over}/layers/{name}"));
    for one in [Layer::Outlines, Layer::Lines, Layer::Alignment, Layer::Overlaps] {
        let told = layer(&format!("tiles/{tiles}"), one.name()).json();
        let expected = one.drawn(&project, None).expect("drawn");
        assert!(expected.is_some() && told["drawing"].as_str() == expected.as_deref(), "{one:?}");
        assert_eq!(told["legend"].as_array().map(Vec::len), Some(one.legend(&project).len()), "{one:?}");
        assert_eq!(told["is_measured_elsewhere"], false);
    }
    let seams = layer(&format!("tiles/{tiles}"), "seams").json();
    assert!(seams["drawing"].as_str().is_some_and(|svg| svg.contains("Seams between the 5 photographs")), "{seams}");

    // Another view is measured by itself.
    let turned = server.post("/api/preview", r#"{"options":{"projection.yaw":"10"}}"#).json();
    let over = format!("preview/{}", turned["number"]);
    let canvas = format!("viewBox=\"0 0 {} {}\"", turned["canvas"]["width"], turned["canvas"]["height"]);
    for name in ["outlines", "lines", "alignment", "overlaps"] {
        let told = layer(&over, name).json();
        assert!(told["drawing"].as_str().is_some_and(|svg| svg.contains(&canvas)), "{name}: {told}");
        assert_eq!(told["is_measured_elsewhere"], false, "{name}");
    }
    // Where photographs are averaged there are no seams.
    let averaged = server.post("/api/preview", r#"{"options":{"render.blend":"average"}}"#).json();
    assert_eq!(layer(&format!("preview/{}", averaged["number"]), "seams").json()["drawing"], Value::Null);
    for missing in
        [format!("{over}/layers/none"), "preview/999999/layers/seams".into(), "tiles/999999/layers/seams".into()]
    {
        assert_eq!(server.get(&format!("/api/{missing}")).status, 404, "{missing}");
    }

    // A record has no matches to measure another view by: what was measured lies where that shows it, which is said.
    let other = Server::of(desk.path());
    assert_eq!(other.with_body("PUT", "/api/project", server.get("/api/project").text().as_bytes()).status, 202);
    other.settled();
    let turned = other.post("/api/preview", r#"{"options":{"projection.yaw":"10"}}"#).json();
    for one in Layer::ALL {
        let told = other.get(&format!("/api/preview/{}/layers/{}", turned["number"], one.name())).json();
        assert!(told["drawing"].is_string(), "{one:?}: {told}");
        assert_eq!(told["is_measured_elsewhere"], matches!(one, Layer::Lines | Layer::Alignment), "{one:?}");
    }
}

/// A picture in the size of the photographs, to be taken as a mask: what is bright in it is marked.
fn mask(photograph: &Path, desk: &Path) -> Vec<u8> {
    let place = desk.join("mask.png");
    let photograph = photograph.display().to_string();
    let size = write_thumbnail(&photograph, 1e9, &place, &StitchOptions::default(), &StageContext::default());
    assert_eq!(size.expect("written"), [1200, 900]);
    std::fs::read(place).expect("a mask")
}

/// The panorama of the project in this file, as the command composes it.
fn composed(project: &Path, elsewhere: &Path) -> Vec<u8> {
    let text = std::fs::read_to_string(project).expect("a project");
    let project_folder = project.parent().expect("a folder").to_owned();
    let recorded = Project::from_json(&text, "project").expect("a project");
    let options = recorded.options.clone();
    let outputs = Outputs::new(elsewhere.join("composed.png"));
    let job =
        ComposeJob { project: recorded, project_folder, photographs: None, masks: Vec::new(), outputs, threads: 0 };
    job.run(&options, &StageContext::default()).expect("composed");
    std::fs::read(elsewhere.join("composed.png")).expect("a picture")
}

fn export(server: &Server, order: &Value) -> Value {
    assert_eq!(server.post("/api/exports", &order.to_string()).status, 202);
    let told = server.settled();
    assert_eq!(told["trouble"], Value::Null, "{told}");
    told["exports"].as_array().expect("exports").last().expect("an export").clone()
}

fn names(export: &Value) -> Vec<&str> {
    export["files"].as_array().expect("files").iter().filter_map(|file| file["name"].as_str()).collect()
}

/// What was painted outlives the program: a saved project finds it, opened by the command and by the page.
#[test]
fn masks_lie_beside_the_project_that_names_them() {
    let (desk, elsewhere) = (room(), tempfile::tempdir().expect("a folder"));
    let mask = mask(&desk.path().join("02.jpg"), elsewhere.path());
    let server = Server::of(desk.path());
    assert_eq!(server.post("/api/wishes", SMALL).status, 204);
    stitched(&server);
    let plain = export(&server, &json!({ "name": "plain.png", "beside": ["project"], "into_folder": true }));
    assert_eq!(names(&plain), ["plain.png", "plain.json"], "nothing was painted");
    assert_eq!(server.with_body("PUT", "/api/photographs/1/mask/use", &mask).status, 204);
    assert_eq!(server.with_body("PUT", "/api/photographs/3/mask/keep", &mask).status, 204);
    stitched(&server);
    let order = json!({ "name": "pano.png", "beside": ["project"], "into_folder": true });
    let saved = export(&server, &order);
    let masks = ["pano-masks/pano-01.jpg-use.png", "pano-masks/pano-03.jpg-keep.png"];
    assert_eq!(names(&saved), ["pano.png", "pano.json", masks[0], masks[1]]);
    assert!(masks.iter().all(|name| std::fs::read(desk.path().join(name)).is_ok_and(|bytes| bytes == mask)));
    assert_eq!(server.post("/api/exports", &order.to_string()).status, 202);
    assert!(server.settled()["trouble"]["message"].as_str().is_some_and(|text| text.contains("already")));
    drop(server);

    let read = |name: &str| std::fs::read(desk.path().join(name)).expect("a file");
    let picture = read("pano.png");
    assert!(picture != read("plain.png"), "the masks show");
    assert!(composed(&desk.path().join("pano.json"), elsewhere.path()) == picture, "the command makes the same");

    let other = Server::of(desk.path());
    assert_eq!(other.post("/api/project", r#"{"name":"pano.json"}"#).status, 202);
    let told = other.settled();
    assert_eq!(told["trouble"], Value::Null);
    let painted = |number: usize| ["used_mask", "kept_mask"].map(|kind| told["photographs"][number][kind].is_string());
    assert_eq!([1, 2, 3].map(painted), [[true, false], [false, false], [false, true]]);
    let again = export(&other, &json!({ "name": "again.png", "beside": ["project"], "into_folder": true }));
    assert_eq!(names(&again).len(), 4);
    assert!(read("again.png") == picture, "so does the page");
    assert!(composed(&desk.path().join("again.json"), elsewhere.path()) == picture);
    assert_eq!(Server::of(desk.path()).get("/api/news").json()["photographs"].as_array().map(Vec::len), Some(5));
}

/// The same of photographs that were dropped: in a folder they are copied beside the project; of a project that is
/// fetched, they are looked for beside it.
#[test]
fn dropped_photographs_outlive_the_program() {
    let (source, opened, elsewhere) =
        (room(), tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    let photograph = |number: usize| std::fs::read(source.path().join(format!("0{number}.jpg"))).expect("a photograph");
    let mask = mask(&source.path().join("02.jpg"), elsewhere.path());
    let drop_all = |server: &Server| {
        for number in 0..3 {
            let address = format!("/api/photographs?name=0{number}.jpg");
            assert_eq!(server.with_body("PUT", &address, &photograph(number)).status, 201);
        }
    };
    let server = Server::of(opened.path());
    drop_all(&server);
    assert_eq!(server.post("/api/wishes", SMALL).status, 204);
    assert_eq!(server.with_body("PUT", "/api/photographs/1/mask/use", &mask).status, 204);
    assert_eq!(server.post("/api/stitch", "").status, 202);
    assert_eq!(server.settled()["stitched"]["used"], 3);
    let order =
        |name: &str, into_folder: bool| json!({ "name": name, "beside": ["project"], "into_folder": into_folder });
    let saved = export(&server, &order("pano.png", true));
    let copies = ["00.jpg", "01.jpg", "02.jpg"];
    assert!(names(&saved).iter().filter(|name| copies.contains(name)).count() == 3, "{saved}");
    // A second time they are there.
    let second = export(&server, &order("second.png", true));
    assert_eq!(names(&second), ["second.png", "second.json", "second-masks/second-01.jpg-use.png"]);
    let fetched = export(&server, &order("fetched.png", false));
    assert_eq!(names(&fetched), ["fetched.png", "fetched.json", "fetched-01.jpg-use.png"]);
    let fetch = |file: usize| unchunked(&server.get(&format!("/api/exports/{}/{file}", fetched["number"])).body);
    let (picture, project, fetched_mask) = (fetch(0), fetch(1), fetch(2));
    assert!(fetched_mask == mask);
    drop(server);
    for name in ["pano.json", "second.json"] {
        assert!(composed(&opened.path().join(name), elsewhere.path()) == picture, "{name}");
    }

    // What was fetched, side by side with the photographs.
    let beside = tempfile::tempdir().expect("a folder");
    for name in copies {
        std::fs::copy(source.path().join(name), beside.path().join(name)).expect("copied");
    }
    std::fs::write(beside.path().join("fetched.json"), &project).expect("written");
    std::fs::write(beside.path().join("fetched-01.jpg-use.png"), &fetched_mask).expect("written");
    assert!(composed(&beside.path().join("fetched.json"), elsewhere.path()) == picture);

    // Dropped on the page again, the mask before the project that names it: it is no photograph then.
    let empty = tempfile::tempdir().expect("a folder");
    let other = Server::of(empty.path());
    drop_all(&other);
    assert_eq!(other.with_body("PUT", "/api/project", &project).status, 202);
    let told = other.settled();
    assert!(
        told["trouble"]["message"].as_str().is_some_and(|text| text.contains("mask of the project is not here")),
        "{told}"
    );
    assert_eq!(other.with_body("PUT", "/api/photographs?name=fetched-01.jpg-use.png", &mask).status, 201);
    assert_eq!(other.with_body("PUT", "/api/project", &project).status, 202);
    let told = other.settled();
    assert_eq!(told["trouble"], Value::Null, "{told}");
    assert_eq!(told["photographs"].as_array().map(Vec::len), Some(3));
    assert!(told["photographs"][1]["used_mask"].is_string());
    // So it can be dropped again.
    assert_eq!(other.with_body("PUT", "/api/photographs?name=fetched-01.jpg-use.png", &mask).status, 201);
    assert_eq!(other.with_body("PUT", "/api/project", &project).status, 202);
    let told = other.settled();
    assert_eq!((&told["trouble"], told["photographs"].as_array().map(Vec::len)), (&Value::Null, Some(3)), "{told}");
    let again = export(&other, &order("again.png", false));
    assert!(unchunked(&other.get(&format!("/api/exports/{}/0", again["number"])).body) == picture);
}

/// Other exposures of a photograph, as a project records them, which lie on it as they are.
fn exposures(paths: &[&str]) -> Value {
    let same = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    paths.iter().map(|path| json!({ "path": path, "reference_from_member": same })).collect()
}

/// Exposures of brackets are found as the photographs are that they belong to, and go with a project as these do.
#[test]
fn exposures_of_brackets_go_with_their_photographs() {
    let (source, opened) = (room(), tempfile::tempdir().expect("a folder"));
    let maker = Server::of(source.path());
    assert_eq!(maker.post("/api/wishes", SMALL).status, 204);
    stitched(&maker);
    let mut project = maker.get("/api/project").json();
    drop(maker);
    // As it was recorded in another folder.
    project["images"][2]["stack"] = exposures(&["./brighter.jpg"]);
    let project = project.to_string().replace(&format!("{}/", source.path().display()), "./");
    let server = Server::of(opened.path());
    let named: Vec<(String, u8)> = (0..5).map(|number| (format!("0{number}.jpg"), number)).collect();
    for (name, number) in named.iter().cloned().chain([("brighter.jpg".to_owned(), 2)]) {
        let bytes = std::fs::read(source.path().join(format!("0{number}.jpg"))).expect("a photograph");
        assert_eq!(server.with_body("PUT", &format!("/api/photographs?name={name}"), &bytes).status, 201);
    }
    assert_eq!(server.with_body("PUT", "/api/project", project.as_bytes()).status, 202);
    let told = server.settled();
    assert_eq!(told["trouble"], Value::Null, "{told}");
    let saved = export(&server, &json!({ "name": "pano.png", "beside": ["project"], "into_folder": true }));
    assert!(names(&saved).contains(&"brighter.jpg"), "{saved}");
    drop(server);
    let text = std::fs::read_to_string(opened.path().join("pano.json")).expect("a project");
    let recorded = Project::from_json(&text, "pano.json").expect("a project");
    assert_eq!(recorded.images[2].stack[0].path, "brighter.jpg");
    let elsewhere = tempfile::tempdir().expect("a folder");
    let picture = std::fs::read(opened.path().join("pano.png")).expect("a panorama");
    assert!(composed(&opened.path().join("pano.json"), elsewhere.path()) == picture, "nothing is missing");
}

/// Two masks of one kind count together, in whatever is stitched and saved again; of a photograph that is gone, nothing
/// is asked for.
#[test]
fn all_masks_of_a_project_are_kept() {
    let (desk, elsewhere) = (room(), tempfile::tempdir().expect("a folder"));
    let mask = mask(&desk.path().join("02.jpg"), elsewhere.path());
    let server = Server::of(desk.path());
    assert_eq!(server.post("/api/wishes", SMALL).status, 204);
    stitched(&server);
    let mut project = server.get("/api/project").json();
    std::fs::create_dir(desk.path().join("masks")).expect("a folder");
    for name in ["one.png", "other.png"] {
        std::fs::write(desk.path().join("masks").join(name), &mask).expect("written");
    }
    project["images"][1]["masks"] =
        json!([{ "path": "masks/one.png", "kind": "use" }, { "path": "masks/other.png", "kind": "use" }]);
    let mut gone = project["images"][0].clone();
    for (field, value) in [
        ("path", json!("gone.jpg")),
        ("status", json!("left_out")),
        ("masks", json!([{ "path": "gone.png", "kind": "use" }])),
    ] {
        gone[field] = value;
    }
    project["images"].as_array_mut().expect("a list").push(gone);
    assert_eq!(server.with_body("PUT", "/api/project", project.to_string().as_bytes()).status, 202);
    let told = server.settled();
    assert_eq!(told["trouble"], Value::Null, "{told}");
    stitched(&server);
    let masks = server.get("/api/project").json()["images"][1]["masks"].as_array().map(Vec::len);
    assert_eq!(masks, Some(2), "stitched again");
    let saved = export(&server, &json!({ "name": "pano.png", "beside": ["project"], "into_folder": true }));
    let expected = ["pano.png", "pano.json", "pano-masks/pano-01.jpg-use.png", "pano-masks/pano-01.jpg-use-2.png"];
    let mut sorted = names(&saved);
    sorted.sort();
    let mut expected = expected.to_vec();
    expected.sort();
    assert_eq!(sorted, expected);
}

/// A project that names files elsewhere reads none of them.
#[test]
fn a_project_reads_only_what_is_here() {
    let desk = room();
    let server = Server::of(desk.path());
    assert_eq!(server.post("/api/wishes", SMALL).status, 204);
    stitched(&server);
    let project: Value = server.get("/api/project").json();
    let secret = tempfile::tempdir().expect("a folder");
    let secret_file = secret.path().join("secret.jpg");
    std::fs::copy(desk.path().join("02.jpg"), &secret_file).expect("copied");
    let told_of = |change: &dyn Fn(&mut Value)| {
        let mut changed = project.clone();
        change(&mut changed);
        assert_eq!(server.with_body("PUT", "/api/project", changed.to_string().as_bytes()).status, 202);
        server.settled()["trouble"]["message"].as_str().unwrap_or_default().to_owned()
    };
    let elsewhere = secret_file.display().to_string();
    let told = told_of(&|project| project["images"][2]["path"] = json!(elsewhere));
    assert!(told.contains("secret.jpg: this photograph of the project is not here"), "{told}");
    let told = told_of(&|project| project["images"][2]["masks"] = json!([{ "path": elsewhere, "kind": "use" }]));
    assert!(told.contains("this mask of the project is not here"), "{told}");
    let told = told_of(&|project| project["images"][2]["stack"] = exposures(&[&elsewhere]));
    assert!(told.contains("secret.jpg: this photograph of the project is not here"), "{told}");
    // Nor does one that was left out, and is gone with its masks.
    let told = told_of(&|project| {
        let mut gone = project["images"][0].clone();
        gone["path"] = json!("gone.jpg");
        gone["status"] = json!("left_out");
        gone["stack"] = exposures(&[&elsewhere]);
        gone["masks"] = json!([{ "path": elsewhere, "kind": "use" }]);
        project["images"].as_array_mut().expect("a list").push(gone);
    });
    assert_eq!(told, "");
    assert!(!server.get("/api/project").text().contains(&elsewhere), "its paths are not kept");
    let told = told_of(&|project| project["options"]["resources"]["scratch"] = json!(secret.path().join("none")));
    assert_eq!(told, "", "it is not heeded");
    let told = told_of(&|project| project["images"][2]["path"] = json!("/elsewhere/02.jpg"));
    assert_eq!(told, "", "a photograph of this name is here");
    assert!(told_of(&|project| project["format"] = json!("other")).contains("format"));
}

/// An answer's body without the lengths of its pieces (RFC 9112, section 7.1), if it has them.
fn unchunked(body: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    let mut rest = body;
    loop {
        let line = rest.windows(2).position(|two| two == b"\r\n").expect("a length");
        let length = usize::from_str_radix(std::str::from_utf8(&rest[..line]).expect("text"), 16).expect("a length");
        if length == 0 {
            return whole;
        }
        whole.extend_from_slice(&rest[line + 2..line + 2 + length]);
        rest = &rest[line + 4 + length..];
    }
}
