//! `trueup compare`: the folder it writes, what it refuses, and the sums of rankings.

use serde_json::{Value, json};

use crate::pictures::{noise, street, street_desk, street_truth};
use crate::run::{Desk, FinishedRun, finish, trueup};

/// Two entries that are made quickly.
const QUICK: [&str; 6] = ["--methods", "vpg", "--entry", "levelled: stitch.method=straightening", "--scale", "0.3"];

fn compare(desk: &Desk, arguments: &[&str]) -> FinishedRun {
    finish(trueup(desk.path(), &[&["compare", "a.jpg", "b.jpg", "c.jpg", "-o", "out"], arguments].concat()))
}

/// The data in a page.
fn data_of(page: &str) -> Value {
    let (_, rest) = page.split_once("<script type=\"application/json\" id=\"data\">").expect("data");
    let (text, _) = rest.split_once("</script>").expect("the end of the data");
    serde_json::from_str(text).expect("JSON in the page")
}

fn text(desk: &Desk, name: &str) -> String {
    String::from_utf8(desk.read(name)).expect("UTF-8")
}

/// Names of all files in a folder of the desk, sorted.
fn files_in(desk: &Desk, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(desk.join(folder)).expect("readable");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Of one photograph all methods make the same, which says nothing of them; nor does one beside a file that is none.
#[test]
fn a_single_photograph_is_refused_with_what_to_do() {
    let desk = street_desk();
    desk.put("text.jpg", "no picture");
    for photographs in [&["a.jpg"][..], &["a.jpg", "text.jpg"]] {
        let run = finish(trueup(desk.path(), &[&["compare", "-o", "out"], photographs].concat()));
        run.expect_failure(1, &["a.jpg: there is only one photograph to use", "at least two overlapping photographs"]);
        assert!(!desk.join("out").exists());
    }
}

#[test]
fn every_method_is_made_or_says_why_not() {
    let desk = street_desk();
    desk.put("truth.json", street_truth());
    let before = desk.files();
    let options = finish(trueup(desk.path(), &["options", "--expert", "--json"]));
    let options: Vec<Value> = serde_json::from_str(options.expect_success()).expect("JSON");
    let run = compare(&desk, &["--truth", "truth.json", "--scale", "0.3"]);
    let printed = run.expect_success();
    assert!(printed.contains("page        out/index.html") && printed.contains("photographs 3 of 3 used"), "{printed}");
    let mut expected = before;
    expected.insert(4, "out".to_owned());
    assert_eq!(desk.files(), expected);

    let record = desk.json("out/compare.json");
    assert_eq!((&record["format"], &record["version"]), (&json!("trueup-comparison"), &json!(1)));
    assert_eq!(json!(files_in(&desk, "out")), record["files"], "the record names every file");
    let entries = record["entries"].as_array().expect("entries");
    // Names and meanings are those of the option, in its order.
    let mut choices = options.iter().filter_map(|row| row["choices"].as_array());
    let methods = choices.find(|choices| choices.iter().any(|one| one["name"] == "autostitch")).expect("methods");
    let told =
        |list: &[Value]| list.iter().map(|one| (one["name"].clone(), one["meaning"].clone())).collect::<Vec<_>>();
    assert_eq!(told(entries), told(methods));
    for entry in entries {
        let name = entry["name"].as_str().expect("a name");
        assert!(printed.contains(name), "{name} is not in\n{printed}");
        let Some(panorama) = entry["panorama"].as_object() else {
            assert!(entry["refusal"]["reason"].as_str().is_some_and(|reason| !reason.is_empty()), "{entry:#}");
            continue;
        };
        assert_eq!(entry["refusal"], Value::Null);
        let project = desk.json(&format!("out/{}", panorama["project"].as_str().expect("a file")));
        assert_eq!(project["canvas"]["width"], panorama["width"]);
        for figure in ["ld", "folds", "reprojection_px", "gdic_deg", "true_upright_deg", "seconds"] {
            assert!(entry["figures"][figure].is_number(), "{name} has no {figure}");
        }
    }
    assert!(entries.iter().filter(|entry| !entry["panorama"].is_null()).count() >= 2, "{printed}");
    assert!(entries.iter().any(|entry| entry["best"].as_array().is_some_and(|best| !best.is_empty())));

    let shown = data_of(&text(&desk, "out/index.html"));
    assert_eq!(shown["comparison"]["entries"], record["entries"]);
    assert_eq!(shown["drawings"].as_array().map(Vec::len), Some(entries.len()));
    let vertical = shown["drawings"][0]["vertical"].as_str().expect("a path");
    assert!(vertical.starts_with('M') && vertical.contains('L'), "{vertical}");
}

#[test]
fn panoramas_are_the_same_in_every_run_and_replace_older_ones() {
    let desk = street_desk();
    let run = |arguments: &[&str]| {
        compare(&desk, &[&QUICK[..], arguments].concat()).expect_success();
        let names = ["vpg.jpg", "levelled.jpg", "ranking-1.jpg", "ranking-2.jpg"];
        names.map(|name| desk.read(&format!("out/{name}")))
    };
    let first = run(&["--threads", "1"]);
    let files = files_in(&desk, "out");
    assert!(run(&["--threads", "3"]) == first, "the panoramas differ");
    assert_eq!(files_in(&desk, "out"), files);
    assert!(first[2..].iter().all(|copy| first[..2].contains(copy)) && first[2] != first[3], "ranked are copies");
    // Another comparison in the same place leaves nothing of the older one. It prints its record where that is asked
    // for.
    let again = compare(&desk, &["--methods", "vpg", "--format", "png", "--scale", "0.2", "--json"]);
    let record = |text: &str| -> Value { serde_json::from_str(text).expect("JSON") };
    assert_eq!(record(again.expect_success()), record(&text(&desk, "out/compare.json")));
    assert_eq!(files_in(&desk, "out"), ["compare.json", "index.html", "vpg.json", "vpg.png"]);
}

#[test]
fn the_ranking_page_does_not_tell_names() {
    let desk = street_desk();
    compare(&desk, &[&QUICK[..], &["--rank", "levelled,vpg", "--seed", "3"]].concat()).expect_success();
    let page = text(&desk, "out/ranking.html");
    assert!(!page.contains("levelled") && !page.contains("vpg"), "a name stands in the page");
    let panoramas = data_of(&page)["panoramas"].as_array().expect("panoramas").clone();
    // "levelled" backwards, in hexadecimal digits.
    let keys: Vec<&str> = panoramas.iter().filter_map(|one| one["key"].as_str()).collect();
    assert!(keys.contains(&"64656c6c6576656c") && keys.contains(&"677076"), "{keys:?}");
    assert_eq!(data_of(&page)["comparison"], desk.json("out/compare.json")["id"]);
}

#[cfg(unix)]
#[test]
fn names_of_files_do_not_break_the_page() {
    let desk = Desk::new();
    std::fs::create_dir(desk.join("<")).expect("a folder");
    // Its path ends a script element and begins another one.
    let names = ["script><script>alert(1)<!--.jpg", "b&quot;.jpg"];
    for (name, bytes) in names.iter().zip(street()) {
        desk.put(&format!("<{}{name}", std::path::MAIN_SEPARATOR), bytes);
    }
    let run = finish(trueup(desk.path(), &[&["compare", "<", "-o", "out"], &QUICK[..]].concat()));
    run.expect_success();
    for page in ["out/index.html", "out/ranking.html"] {
        let page = text(&desk, page);
        assert_eq!(page.matches("</script").count(), 2, "the data and the program");
        assert!(!page.contains("alert(1)<") && !page.contains("<!--"));
    }
    let shown = data_of(&text(&desk, "out/index.html"));
    let paths = shown["comparison"]["photographs"].to_string();
    assert!(names.iter().all(|name| paths.contains(name)), "{paths}");
}

#[test]
fn what_cannot_be_compared_is_refused_before_work_and_leaves_nothing() {
    let desk = street_desk();
    let files = desk.files();
    for (arguments, status, parts) in [
        (&["--methods", "vpg,magic"][..], 2, &["--methods magic: there is no such method"][..]),
        (&["--entry", "mesh.cell_px=20"], 2, &["there is no \":\" after a name"]),
        (&["--entry", "x: mesh.cell=20"], 2, &["there is no option \"mesh.cell\""]),
        (&["--entry", "x: mesh.cell_px=-20"], 2, &["invalid mesh.cell_px = -20"]),
        (&["--entry", "x: matching.max_distance_ratio=0.5"], 2, &["shares features and matches"]),
        (&["--entry", "vpg: mesh.cell_px=20"], 1, &["two entries have this name"]),
        (&["--rank", "vpg,magic"], 1, &["magic: it is not compared", "Name entries that are compared"]),
        (&["--rank", "vpg"], 1, &["2 to 4 entries can be ranked, not 1"]),
        (&["--format", "gif"], 2, &["\"gif\" cannot be (allowed: jpg | png | webp)"]),
        (&["--truth", "none.json"], 1, &["reading none.json"]),
        (&["--reference", "q.jpg"], 1, &["q.jpg: no photograph of this name was given"]),
        (&["--tally", "r.json"], 2, &["cannot be used with"]),
    ] {
        compare(&desk, arguments).expect_failure(status, parts);
        assert_eq!(desk.files(), files, "nothing is left behind by {arguments:?}");
    }
    finish(trueup(desk.path(), &["compare", "a.jpg", "b.jpg"])).expect_failure(2, &["--output <DIR>"]);
    let nowhere = finish(trueup(desk.path(), &["compare", "a.jpg", "b.jpg", "-o", "none/out"]));
    nowhere.expect_failure(1, &["none/out: the folder none does not exist"]);
    let onto_file = finish(trueup(desk.path(), &["compare", "a.jpg", "b.jpg", "-o", "c.jpg"]));
    onto_file.expect_failure(1, &["c.jpg: it is a file"]);
    assert_eq!(desk.files(), files);
}

#[test]
fn folders_of_other_things_are_spared() {
    let desk = street_desk();
    std::fs::create_dir(desk.join("out")).expect("a folder");
    desk.put("out/diary.txt", "Dear diary");
    let refused = compare(&desk, &QUICK);
    refused.expect_failure(1, &["out: the folder holds something that is not part of an older comparison: diary.txt"]);
    std::fs::remove_file(desk.join("out/diary.txt")).expect("removed");
    compare(&desk, &QUICK).expect_success();
    // What participants saved beside the pages stays, too.
    desk.put("out/ranking-results.json", "{}");
    compare(&desk, &QUICK).expect_failure(1, &["ranking-results.json"]);
    std::fs::remove_file(desk.join("out/ranking-results.json")).expect("removed");
    let onto_itself = finish(trueup(desk.path(), &["compare", "out/vpg.jpg", "out/levelled.jpg", "-o", "out"]));
    onto_itself.expect_failure(1, &["out/vpg.jpg: this photograph lies in"]);
    assert!(files_in(&desk, "out").contains(&"vpg.jpg".to_owned()));
}

#[test]
fn photographs_that_do_not_overlap_and_truths_of_others_fail_as_a_whole() {
    let desk = street_desk();
    desk.put("strange.json", street_truth().replace(".jpg", ".png"));
    let strange = compare(&desk, &[&QUICK[..], &["--truth", "strange.json"]].concat());
    strange.expect_failure(1, &["it names none of the 3 photographs"]);
    let desk = Desk::new();
    for seed in 1..3 {
        desk.put(&format!("noise{seed}.jpg"), noise(seed, 320, 240));
    }
    let files = desk.files();
    let run = finish(trueup(desk.path(), &["compare", "noise1.jpg", "noise2.jpg", "-o", "out"]));
    run.expect_failure(1, &["no overlapping photographs found"]);
    assert_eq!(desk.files(), files);
}

/// A file of results, as ranking.html saves it.
fn results(answers: &[(&str, &str, &[&str])]) -> String {
    let answers: Vec<Value> = answers
        .iter()
        .map(|(id, participant, ranking)| json!({ "id": id, "participant": participant, "ranking": ranking }))
        .collect();
    json!({ "format": "trueup-ranking", "version": 1, "comparison": "x", "answers": answers }).to_string()
}

#[test]
fn scores_are_summed_up_over_files() {
    let desk = Desk::new();
    desk.put("one.json", results(&[("1", "Ann", &["a", "b", "c", "d"]), ("2", "Bob", &["b", "a", "c", "d"])]));
    desk.put("two.json", results(&[("1", "Ann", &["a", "b", "c", "d"]), ("3", "", &["b", "c", "a", "d"])]));
    let run = finish(trueup(desk.path(), &["compare", "--tally", "one.json", "two.json", "--json"]));
    let tally: Value = serde_json::from_str(run.expect_success()).expect("JSON");
    assert_eq!((&tally["answers"], &tally["participants"], &tally["repeated"]), (&json!(3), &json!(3), &json!(1)));
    // b: 4, 5, 5: mean 14/3, squares 2/3, standard error sqrt(2/3 / 2 / 3) = 1/3. a: 5, 4, 3: mean 4, sqrt(2 / 2 / 3).
    let methods = tally["methods"].as_array().expect("methods");
    let close = |value: &Value, expected: f64| value.as_f64().is_some_and(|value| (value - expected).abs() < 1e-12);
    assert!(methods[0]["name"] == "b" && methods[1]["name"] == "a" && methods[3]["name"] == "d", "{tally:#}");
    assert!(
        close(&methods[0]["mean_score"], 14.0 / 3.0) && close(&methods[0]["standard_error"], 1.0 / 3.0),
        "{tally:#}"
    );
    assert!(close(&methods[1]["mean_score"], 4.0) && close(&methods[1]["standard_error"], 0.577_350_269_189_626));
    assert_eq!(methods[0]["ranks"], json!([2, 1, 0, 0]));

    let run = finish(trueup(desk.path(), &["compare", "--tally", "one.json", "two.json"]));
    let printed = run.expect_success();
    assert!(printed.contains("3 answers of 3 participants") && printed.contains("b  4.667       0.333"), "{printed}");
    assert!(printed.contains("b  to a  2 : 1  67 % (21 to 94)  p = 1.000"), "{printed}");
    desk.put("other.json", "{}");
    let other = finish(trueup(desk.path(), &["compare", "--tally", "other.json"]));
    other.expect_failure(
        1,
        &["other.json: its format is not \"trueup-ranking\"", "Give a file that ranking.html saved"],
    );
}

/// Masks are those of `stitch`: the projects record them, and panoramas differ.
#[test]
fn masks_are_heeded_by_every_entry() {
    let desk = street_desk();
    let mask = image::GrayImage::from_fn(480, 360, |x, _| image::Luma([u8::from(x >= 240) * 255]));
    mask.save(desk.join("mask.png")).expect("written");
    compare(&desk, &[&QUICK[..], &["--mask", "b.jpg=mask.png", "--keep", "c.jpg=mask.png"]].concat()).expect_success();
    for name in ["out/vpg.json", "out/levelled.json"] {
        let project = desk.json(name);
        assert_eq!(project["images"][1]["masks"], json!([{"path": "mask.png", "kind": "use"}]), "{name}");
        assert_eq!(project["images"][2]["masks"], json!([{"path": "mask.png", "kind": "keep"}]), "{name}");
    }
    compare(&desk, &["--mask", "mask.png"]).expect_failure(2, &["--mask mask.png: it is not of the form NAME=FILE"]);
}

#[test]
fn what_the_format_cannot_show_is_refused_before_any_work() {
    let desk = street_desk();
    let run = compare(&desk, &["--set", "output.background=transparent"]);
    run.expect_failure(2, &["writing vpg.jpg with a transparent background is not supported"]);
    let run = compare(&desk, &["--methods", "vpg", "--entry", "deep: output.depth=16"]);
    run.expect_failure(2, &["writing deep.jpg with 16 bits a sample is not supported"]);
    assert_eq!(desk.files(), ["a.jpg", "b.jpg", "c.jpg", "d.jpg"]);
}
