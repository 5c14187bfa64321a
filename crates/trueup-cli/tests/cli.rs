//! What works, and what is said of it.

use crate::pictures::{self, STREET_NAMES, picture_size, put_street, street_desk};
use crate::run::{Desk, finish, trueup};

#[test]
fn photographs_become_a_panorama_and_a_summary() {
    let desk = street_desk();
    let run = desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--project", "pano.json"]);
    let summary = run.expect_success();
    for part in [
        "panorama    pano.jpg  ",
        " px, ",
        "project     pano.json",
        "photographs 4 of 4 used",
        "upright     ",
        "measured    ",
        "points meet within",
        "time        ",
    ] {
        assert!(summary.contains(part), "\"{part}\" is not in\n{summary}");
    }
    assert!(!summary.contains("left out") && !summary.contains("pairs"), "{summary}");
    let project = desk.json("pano.json");
    let width = project["canvas"]["width"].as_u64().expect("a width");
    assert!(width > pictures::WIDTH as u64, "four photographs at half size are wider than one: {width}");
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "pano.jpg", "pano.json"]);

    let inspected = finish(trueup(desk.path(), &["inspect", "pano.json"]));
    let told = |text: &str| -> Vec<String> {
        let of_the_project = |line: &&str| !line.starts_with("panorama") && !line.starts_with("project");
        text.lines().filter(of_the_project).map(str::to_owned).collect()
    };
    let inspected = told(inspected.expect_success());
    for line in told(summary) {
        assert!(inspected.contains(&line), "\"{line}\" is not in\n{}", inspected.join("\n"));
    }
    assert!(inspected.iter().any(|line| line.trim_start().starts_with("a.jpg: ")), "{}", inspected.join("\n"));

    // For programs, what is said of the panorama is what was said when it was made, but for its files.
    let composed = finish(trueup(desk.path(), &["compose", "pano.json", "-o", "again.jpg", "--json"]));
    let mut written: serde_json::Value = serde_json::from_str(composed.expect_success()).expect("JSON");
    let told = finish(trueup(desk.path(), &["inspect", "pano.json", "--json"]));
    let mut told: serde_json::Value = serde_json::from_str(told.expect_success()).expect("JSON");
    assert_eq!((&told["format"], &told["version"]), (&"trueup-summary".into(), &1.into()));
    for one in [&mut written, &mut told] {
        let panorama = one["panoramas"][0].as_object_mut().expect("a panorama");
        panorama.retain(|field, _| !["panorama", "beside", "bytes", "seconds"].contains(&field.as_str()));
    }
    assert_eq!(told, written);
}

#[test]
fn verbose_adds_pairs_and_times_and_quiet_says_nothing() {
    let desk = street_desk();
    let verbose = desk.stitch(&["a.jpg", "b.jpg", "--verbose"]);
    for part in ["a.jpg - b.jpg: joined, ", "1 joined of 1 tried", " s  matching", "focal length"] {
        assert!(verbose.expect_success().contains(part), "\"{part}\" is not in\n{}", verbose.stdout);
    }
    assert_eq!(desk.stitch(&["a.jpg", "b.jpg", "--quiet"]).expect_success(), "");
}

#[test]
fn folders_patterns_and_strange_names_are_photographs_too() {
    let desk = Desk::new();
    std::fs::create_dir(desk.join("süße Bilder")).expect("a folder");
    for (name, bytes) in ["Nr 1.jpg", "Nr 2 – é.jpg", "写真 3.jpg"].iter().zip(pictures::street()) {
        desk.put(&format!("süße Bilder/{name}"), bytes);
    }
    let by_folder = desk.stitch(&["süße Bilder", "--project", "p.json"]);
    assert!(by_folder.expect_success().contains("photographs 3 of 3 used"), "{}", by_folder.stdout);
    assert!(desk.json("p.json")["images"][2]["path"].as_str().expect("a path").ends_with("写真 3.jpg"));
    let by_pattern = desk.stitch(&["süße Bilder/Nr*.jpg"]);
    assert!(by_pattern.expect_success().contains("photographs 2 of 2 used"), "{}", by_pattern.stdout);
}

#[test]
fn the_extension_chooses_the_format() {
    let desk = street_desk();
    let signatures: [(&str, &[u8]); 4] =
        [("p.png", b"\x89PNG"), ("p.tif", b"II"), ("p.webp", b"RIFF"), ("p.JPG", b"\xff\xd8")];
    for (name, signature) in signatures {
        finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "--scale", "0.25", "-o", name])).expect_success();
        assert!(desk.read(name).starts_with(signature), "{name}");
    }
    assert_eq!(picture_size(&desk.join("p.png")), picture_size(&desk.join("p.tif")));
}

#[test]
fn scale_sets_the_size_and_quality_the_bytes() {
    let desk = street_desk();
    let stitch = |name: &str, arguments: &[&str]| {
        let all = [&["stitch", "a.jpg", "b.jpg", "-o", name], arguments].concat();
        finish(trueup(desk.path(), &all)).expect_success();
    };
    // What is kept is chosen by cells, which do not lie alike at every size.
    stitch("full.png", &["--crop", "none"]);
    stitch("half.png", &["--crop", "none", "--scale", "0.5"]);
    let (full, half) = (picture_size(&desk.join("full.png")), picture_size(&desk.join("half.png")));
    let is_half = |half: u32, full: u32| half.abs_diff(full / 2) <= 1;
    assert!(is_half(half.0, full.0) && is_half(half.1, full.1), "{full:?} {half:?}");
    stitch("fine.jpg", &["--quality", "95"]);
    stitch("coarse.jpg", &["--quality", "30"]);
    assert!(desk.read("coarse.jpg").len() * 2 < desk.read("fine.jpg").len());
}

#[test]
fn one_photograph_is_written_as_it_is_with_a_warning() {
    let desk = street_desk();
    let run = finish(trueup(desk.path(), &["stitch", "a.jpg", "-o", "pano.png", "--project", "pano.json"]));
    assert!(run.expect_success().contains("warning     a.jpg: there is only one photograph to use"), "{}", run.stdout);
    assert_eq!(picture_size(&desk.join("pano.png")), (pictures::WIDTH as u32, pictures::HEIGHT as u32));
    let evaluated = finish(trueup(desk.path(), &["evaluate", "pano.json"]));
    assert!(
        evaluated.expect_success().contains("measured    nothing: it takes two photographs"),
        "{}",
        evaluated.stdout
    );
}

#[test]
fn all_writes_a_numbered_panorama_of_every_group() {
    let desk = street_desk();
    for (name, bytes) in ["x.jpg", "y.jpg", "z.jpg"].iter().zip(pictures::room()) {
        desk.put(name, bytes);
    }
    let photographs = ["a.jpg", "x.jpg", "b.jpg", "y.jpg", "c.jpg", "z.jpg", "d.jpg"];
    let all = desk.stitch(&[&photographs[..], &["--all", "--project", "pano.json"]].concat());
    let summary = all.expect_success();
    assert!(summary.contains("panorama    pano-1.jpg") && summary.contains("panorama    pano-2.jpg"), "{summary}");
    assert!(!summary.contains("Use --all"), "{summary}");
    for name in ["pano-1.jpg", "pano-1.json", "pano-2.jpg", "pano-2.json"] {
        assert!(desk.files().contains(&name.to_owned()), "{name}");
    }
    assert!(!desk.files().contains(&"pano.jpg".to_owned()));

    let largest = desk.stitch(&photographs);
    assert!(largest.expect_success().contains("photographs 4 of 7 used"), "{}", largest.stdout);
    let told = "left out  x.jpg, y.jpg, z.jpg: part of another panorama, that of x.jpg and 2 more\n";
    assert!(largest.stdout.contains(told), "{}", largest.stdout);
    assert!(largest.stdout.contains("Use --all"), "{}", largest.stdout);
}

#[test]
fn a_graph_limits_the_pairs_and_a_name_chooses_the_reference() {
    let desk = street_desk();
    desk.put("pairs.txt", "a.jpg -- b.jpg\nb.jpg -- c.jpg\n");
    let run = desk.stitch(&[
        "a.jpg",
        "b.jpg",
        "c.jpg",
        "--graph",
        "pairs.txt",
        "--reference",
        "a.jpg",
        "--project",
        "p.json",
    ]);
    assert!(run.expect_success().contains("the reference is a.jpg"), "{}", run.stdout);
    let pairs = desk.json("p.json")["pairs"].as_array().expect("pairs").len();
    assert_eq!(pairs, 2);
}

#[test]
fn a_lens_is_told_by_a_project_of_other_photographs() {
    let desk = street_desk();
    desk.stitch(&["a.jpg", "b.jpg", "c.jpg", "d.jpg", "--project", "all.json"]).expect_success();
    let told = desk.stitch(&["b.jpg", "c.jpg", "--lens-from", "all.json", "--project", "two.json"]);
    let summary = told.expect_success();
    assert!(summary.contains("lens        told: that of all.json, for 2 of 2 photographs"), "{summary}");
    let (all, two) = (desk.json("all.json"), desk.json("two.json"));
    assert_eq!((&two["lens_from"], &two["images"][0]["lens_told"]), (&"all.json".into(), &true.into()));
    let focal = |project: &serde_json::Value| project["images"][1]["focal_px"].as_f64().expect("a focal length");
    assert!((focal(&two) / focal(&all)).ln().abs() < 1.051_f64.ln(), "{} {}", focal(&two), focal(&all));

    let by_angle = desk.stitch(&["b.jpg", "c.jpg", "--lens", "pinhole", "--lens-fov", "60"]);
    let summary = by_angle.expect_success();
    assert!(summary.contains("lens        told: pinhole; 60 degrees across the longer side"), "{summary}");
    let over_it = desk.stitch(&["b.jpg", "c.jpg", "--lens-from", "all.json", "--project", "all.json"]);
    assert!(over_it.stderr.contains("the project that tells the lens"), "{}", over_it.stderr);
    desk.put("none.json", "{}");
    let none = desk.stitch(&["b.jpg", "c.jpg", "--lens-from", "none.json"]);
    assert!(none.stderr.contains("none.json: its format is not"), "{}", none.stderr);
}

#[test]
fn a_bad_file_among_good_ones_is_left_out_with_its_reason() {
    let desk = street_desk();
    desk.put("broken.jpg", &pictures::street()[0][..4000]);
    desk.put("text.jpg", "no picture");
    desk.put("black.jpg", pictures::plain(480, 360, 0));
    desk.put("empty.jpg", "");
    desk.put("again.jpg", &pictures::street()[1]);
    let mut photographs = STREET_NAMES.to_vec();
    photographs.extend(["broken.jpg", "text.jpg", "missing.jpg", "black.jpg", "empty.jpg", "again.jpg"]);
    let run = desk.stitch(&photographs);
    let summary = run.expect_success();
    for part in [
        "photographs 4 of 10 used",
        "left out  broken.jpg: ",
        "left out  text.jpg: its content is not a JPEG",
        "left out  missing.jpg: there is no such file or folder",
        "left out  black.jpg: no overlap found: nothing in it was recognized elsewhere",
        "left out  empty.jpg: the file is empty (0 bytes)",
        "left out  again.jpg: it has the same bytes as b.jpg, which is used",
    ] {
        assert!(summary.contains(part), "\"{part}\" is not in\n{summary}");
    }
    assert!(!summary.contains("warning"), "a reason is told once:\n{summary}");
}

#[test]
fn impossible_focal_lengths_in_metadata_do_no_harm() {
    let desk = Desk::new();
    let [a, b, c, _] = pictures::street() else { panic!("four photographs") };
    desk.put("zero.jpg", pictures::with_focal_length(a, [0, 0], 0));
    desk.put("huge.jpg", pictures::with_focal_length(b, [u32::MAX, 1], u16::MAX));
    desk.put("tiny.jpg", pictures::with_focal_length(c, [1, u32::MAX], 1));
    let run = desk.stitch(&["zero.jpg", "huge.jpg", "tiny.jpg", "--project", "p.json"]);
    assert!(run.expect_success().contains("photographs 3 of 3 used"), "{}", run.stdout);
    for image in desk.json("p.json")["images"].as_array().expect("images") {
        let focal_px = image["focal_px"].as_f64().expect("a focal length");
        assert!((200.0..1500.0).contains(&focal_px), "{focal_px}");
    }
}

#[test]
fn an_existing_panorama_is_replaced_but_a_photograph_never() {
    let desk = street_desk();
    desk.put("pano.jpg", "old");
    desk.stitch(&["a.jpg", "b.jpg"]).expect_success();
    assert!(desk.read("pano.jpg").starts_with(b"\xff\xd8"));

    let before = desk.read("a.jpg");
    finish(trueup(desk.path(), &["stitch", "a.jpg", "b.jpg", "-o", "./a.jpg"]))
        .expect_failure(1, &["./a.jpg: this file is one of the photographs"]);
    assert_eq!(desk.read("a.jpg"), before);
    // Neither is the panorama of last time, in the folder of the photographs, stitched into itself.
    put_street(&desk);
    let again = desk.stitch(&["."]);
    assert!(again.expect_success().contains("photographs 4 of 5 used"), "{}", again.stdout);
    assert!(again.stdout.contains("left out  pano.jpg: it is a panorama that this program made"), "{}", again.stdout);
}

#[test]
fn gray_deep_and_transparent_photographs_are_photographs() {
    let desk = street_desk();
    let (width, height) = (pictures::WIDTH as u32, pictures::HEIGHT as u32);
    let rgb = image::RgbImage::from_raw(width, height, pictures::street_pixels()[1].clone()).expect("enough pixels");
    let rgb = image::DynamicImage::ImageRgb8(rgb);
    rgb.to_luma8().save(desk.join("gray.png")).expect("written");
    rgb.to_rgba16().save(desk.join("deep.tif")).expect("written");
    for name in ["gray.png", "deep.tif"] {
        let run = desk.stitch(&["a.jpg", name, "c.jpg"]);
        assert!(run.expect_success().contains("photographs 3 of 3 used"), "{name}: {}", run.stdout);
    }
}

#[test]
fn the_example_stands_upright() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
    let run = Desk::new().stitch(&[examples]);
    assert!(run.expect_success().contains("photographs 5 of 5 used"), "{}", run.stdout);
    assert!(run.stdout.contains("upright     guided by vanishing points (divergence "), "{}", run.stdout);
}
